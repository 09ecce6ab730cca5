"""The real firmware of GRBL on a simulated board, behind a cable that can be pulled; and a plate of 70 holes for it."""

from __future__ import annotations

import os
import select
import subprocess
import threading
import tty
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MappingProxyType

import pytest

from benchmarks import grbl_time
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.port import SerialPort
from outside_programs import missing

#: A quick machine, so that the board, which runs at the speed of life, has done soon: mm/min, mm/s², steps/mm.
SETTINGS = {
    0: 3, 1: 255, 10: 3, 11: 0.05, 13: 0, 20: 0, 21: 0, 22: 1, 30: 10000, 32: 0, 100: 80, 101: 80, 102: 80,
    110: 12000, 111: 12000, 112: 9000, 120: 8000, 121: 8000, 122: 8000, 130: 200, 131: 200, 132: 60,
}  # fmt: skip
ZERO = (-150.0, -150.0, -30.0)
PROFILE = """
name = "board"
controller = "grbl"
rapid.velocity = ["12 m/min", "12 m/min", "9 m/min"]
rapid.acceleration = "8000 mm/s2"
travel.min = ["-200 mm", "-200 mm", "-60 mm"]
travel.max = ["0 mm", "0 mm", "0 mm"]
"""
#: Lines before the first hole, and lines of each.
HEAD, EACH, HOLES = 4, 4, 70


def plate(count: int = HOLES, feeds: Mapping[int, int] = MappingProxyType({})) -> str:
    """Return the program of a plate: hole k has the lines HEAD + EACH·(k-1) + 1 and the three lines after it.

    Each hole is drilled 1 mm down; `feeds` are the feeds of slow holes, mm/min.
    """
    lines = ["(plate)", "G21 G90 G94 G17 G54", "G0 Z4 ; up", "M3 S5000"]
    for k in range(count):
        row, column = divmod(k, 10)
        x = 1.5 * (column if row % 2 == 0 else 9 - column)
        lines += [f"G0 X{x:.3f} Y{1.5 * row:.3f}", "Z0.5", f"G1 Z-0.5 F{feeds.get(k + 1, 3000)}", "G0 Z0.5"]
    return "\n".join([*lines, "G0 Z4", "M5", "M30", ""])


def needed_board() -> None:
    """Skip the test without the firmware or without the simulator; fail if the simulator is required."""
    if not (grbl_time.BOARD / grbl_time.FIRMWARE).exists():
        pytest.skip("the simulated GRBL board is not here; set LEAFCUT_GRBL")
    if grbl_time.missing():
        missing("the simulator of the GRBL board", "libsimavr-dev libelf-dev gcc libc6-dev")


class Board:
    """A board that runs, and the cable to it: `port` is the end that a sender opens."""

    def __init__(self, folder: Path) -> None:
        program = grbl_time.build_board(folder)
        command = [str(program), str(grbl_time.BOARD / grbl_time.FIRMWARE), "--pty"]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert self._process.stdout is not None
        self._line = os.open(self._process.stdout.readline().strip(), os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._line)
        self.sent = b""
        self.said = b""
        self.most = 0
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self._plug: tuple[int, int] | None = None
        self.plug_in()
        self._carrier = threading.Thread(target=self._carry, daemon=True)
        self._carrier.start()

    def plug_in(self) -> None:
        """Put the cable in, with a new port."""
        self._plug = os.openpty()
        tty.setraw(self._plug[1])
        self.port = os.ttyname(self._plug[1])

    def pull(self) -> None:
        """Pull the cable: whoever has the port open loses it; the board goes on."""
        with self._lock:
            assert self._plug is not None
            self._plug, (ours, theirs) = None, self._plug
            os.close(theirs)
            os.close(ours)

    def press(self, data: bytes) -> None:
        """Do what a button of the board, or another program, does."""
        os.write(self._line, data)

    def _carry(self) -> None:
        while not self._ended.is_set():
            plug = self._plug
            ends = [self._line] + ([plug[0]] if plug else [])
            ready: list[int] = []
            with suppress(OSError, ValueError):
                ready, _, _ = select.select(ends, [], [], 0.05)
            with self._lock, suppress(OSError):
                # The numbers of a cable that was pulled meanwhile may be those of other files now.
                if plug is not self._plug:
                    continue
                if self._line in ready:
                    data = os.read(self._line, 4096)
                    self.said += data
                    if plug:
                        os.write(plug[0], data)
                if plug and plug[0] in ready:
                    data = os.read(plug[0], 4096)
                    self.sent += data
                    self._count()
                    os.write(self._line, data)

    def _count(self) -> None:
        """Keep the most bytes of lines that were on their way without an answer at any time."""
        lines = bytes(c for c in self.sent if c < 0x80 and c not in b"?!~\x18").split(b"\n")
        answers = sum(line.strip() == b"ok" or line.startswith(b"error") for line in self.said.split(b"\n"))
        self.most = max(self.most, sum(len(line) + 1 for line in lines[answers:]) - 1)

    def forget(self) -> None:
        """Start recording again."""
        self.sent, self.said, self.most = b"", b"", 0

    def lines(self) -> list[str]:
        """Return the lines that went to the board since."""
        text = bytes(c for c in self.sent if c < 0x80 and c not in b"?!~\x18").decode("ascii")
        return [line for line in text.split("\n") if line]

    def close(self) -> None:
        """Switch it off."""
        self._ended.set()
        self._carrier.join()
        if self._plug:
            self.pull()
        os.close(self._line)
        self._process.terminate()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()


@contextmanager
def set_up(folder: Path, settings: Mapping[int, float], zero: tuple[float, float, float]) -> Iterator[Board]:
    """Switch a board on, with its settings and the zero of G54 in machine coordinates; in the end, switch it off."""
    board = Board(folder)
    try:
        port = SerialPort(board.port)
        talk = GrblConversation(port)
        talk.connect()
        for number, value in settings.items():
            talk.ask(f"${number}={value}")
        talk.ask("G10 L2 P1 X{} Y{} Z{}".format(*zero))
        port.close()
        yield board
    finally:
        board.close()


@pytest.fixture(scope="module")
def patient() -> Iterator[None]:
    """Wait longer than a person would: the board runs on a processor that does much else."""
    before, GrblConversation.patience = GrblConversation.patience, 10.0
    yield
    GrblConversation.patience = before


@pytest.fixture(scope="module")
def running(patient: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Board]:
    """Yield the board, set up."""
    needed_board()
    with set_up(tmp_path_factory.mktemp("board"), SETTINGS, ZERO) as board:
        yield board


@pytest.fixture
def board(running: Board) -> Board:
    """Return the board at rest, in its power-on state except for its position."""
    port = SerialPort(running.port)
    talk = GrblConversation(port)
    talk.connect()
    talk.reset()
    talk.unlock()
    port.close()
    running.forget()
    return running
