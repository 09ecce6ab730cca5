"""A map that is saved is read back to the very same places."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.cli.app import run
from leafcut.read import read
from leafcut.read.csvmap import holes_as_csv


@pytest.mark.parametrize("name", ["random:200:7", "example:plate-15x15-70", "example:plate-10"])
def test_saved_points_are_the_same_when_they_are_read(name: str, tmp_path: Path) -> None:
    part, file = read(name), tmp_path / "map.csv"
    file.write_text(holes_as_csv(part), encoding="utf-8")
    again = read(str(file))
    assert [(h.x, h.y, h.diameter) for h in again.holes] == [(h.x, h.y, h.diameter) for h in part.holes]


def test_a_map_is_saved_by_solve_and_no_input_is_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "map.csv"
    words = ["--no-bound", "--preset", "fast", "--no-defaults"]
    assert run(["solve", "random:20:3", "--save-map", str(file), *words]) == 0
    assert [(h.x, h.y) for h in read(str(file)).holes] == [(h.x, h.y) for h in read("random:20:3").holes]
    before = file.read_text()
    assert run(["solve", str(file), "--save-map", str(file), *words]) == 1
    assert run(["solve", "random:20", "--save-map", str(tmp_path / "map.dxf"), *words]) == 2
    assert "ends in .csv" in capsys.readouterr().err
    assert file.read_text() == before
    assert [one.name for one in tmp_path.iterdir()] == ["map.csv"]
