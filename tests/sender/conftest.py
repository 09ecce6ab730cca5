"""A board shared by the tests of one file; each test starts at the same position, idle."""

from __future__ import annotations

from pathlib import Path

import pytest

from grbl_board import PROFILE, board, patient, plate, running

__all__ = ["board", "machine", "patient", "program", "running"]


@pytest.fixture
def machine(tmp_path: Path) -> str:
    file = tmp_path / "board.toml"
    file.write_text(PROFILE, encoding="utf-8")
    return str(file)


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "plate.nc"
    file.write_text(plate(), encoding="utf-8")
    return file
