"""A board for the tests of one file, as its tests leave it: each begins at the same place, idle."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from grbl_board import PROFILE, SETTINGS, ZERO, Board, grbl_time, plate

from leafcut.sender.conversation import Conversation
from leafcut.sender.port import SerialPort


@pytest.fixture(scope="module")
def patient() -> Iterator[None]:
    """Wait longer than a person would: the board runs on a processor that does much else."""
    before, Conversation.patience = Conversation.patience, 10.0
    yield
    Conversation.patience = before


@pytest.fixture(scope="module")
def running(patient: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Board]:
    """Yield the board, set up; skip without the firmware, and without its compiler fail where that is required."""
    if not (grbl_time.BOARD / grbl_time.FIRMWARE).exists():
        pytest.skip("the simulated GRBL board is not here; set LEAFCUT_GRBL")
    if grbl_time.missing():
        if os.environ.get("LEAFCUT_REQUIRE_EXTERNAL") == "1":
            pytest.fail(f"{grbl_time.missing()} are required here")
        pytest.skip(f"{grbl_time.missing()} are not installed")
    board = Board(tmp_path_factory.mktemp("board"))
    try:
        port = SerialPort(board.port)
        talk = Conversation(port)
        talk.connect()
        for number, value in SETTINGS.items():
            talk.ask(f"${number}={value}")
        talk.ask("G10 L2 P1 X{} Y{} Z{}".format(*ZERO))
        port.close()
        yield board
    finally:
        board.close()


@pytest.fixture
def board(running: Board) -> Board:
    """Return the board at rest, as it was switched on but for its place."""
    port = SerialPort(running.port)
    talk = Conversation(port)
    talk.connect()
    talk.reset()
    talk.unlock()
    port.close()
    running.forget()
    return running


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
