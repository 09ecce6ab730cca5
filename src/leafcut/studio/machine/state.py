"""What is known of the machine at one moment: the same for every page and every program that asks."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from leafcut.model.machine import XYZ


class Connection(StrEnum):
    """Whether there is a machine."""

    CLOSED = "closed"
    OPENING = "opening"
    OPEN = "open"


class MachineTask(StrEnum):
    """What the machine was told to do by hand, or by a program."""

    NOTHING = ""
    ASKING = "asking"
    HOMING = "homing"
    PROBING = "probing"
    FRAMING = "framing"
    RUNNING = "running"
    STOPPING = "stopping"


@dataclass(frozen=True)
class MachineQuestion:
    """What a person is asked while a program stands: a change of tool, a pause of the program, or the next hole.

    `said` is what the controller answered to what was done meanwhile.
    """

    kind: str
    words: str
    line: int
    hole: int = 0
    tool: int | None = None
    said: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProgramProgress:
    """How far a program is: lines and holes from 1, 0 before the first; times of the machine, s; mm/min, percent.

    `alone` says that it goes on when no page shows it.
    """

    name: str
    lines: int
    holes: int
    line: int = 0
    hole: int = 0
    feed: float = 0.0
    override: int = 100
    done_s: float = 0.0
    left_s: float = 0.0
    by_hole: bool = False
    alone: bool = False


@dataclass(frozen=True)
class ProgramEnd:
    """How the last program ended, in words; `line` and `go_on_hole` are those with which it can go on, 0 for none."""

    name: str
    complete: bool
    words: str
    line: int
    go_on_hole: int
    position_kept: bool


@dataclass(frozen=True)
class MachineState:
    """The machine at one moment.

    Attributes
    ----------
    number
        Grows with every change.
    status, pins
        What the controller says that it does, and its inputs that are on.
    machine, work
        Where the tool is, mm; None where that is not said.
    homing, soft_limits, travel
        What the controller is set to; lowest and highest machine coordinates, mm.
    unsure
        It was locked by an alarm, or reset, and may not be where it thinks.
    holder
        Who may command it: a page, or "program"; empty for nobody.
    said, bad, saying
        What was told last, whether it is a complaint, and its number.
    """

    number: int = 0
    connection: Connection = Connection.CLOSED
    port: str = ""
    baud: int = 0
    version: str = ""
    status: str = ""
    pins: str = ""
    machine: XYZ | None = None
    work: XYZ | None = None
    feed: float = 0.0
    speed: float = 0.0
    homing: bool = False
    soft_limits: bool = False
    travel: tuple[XYZ, XYZ] | None = None
    unsure: bool = False
    doing: MachineTask = MachineTask.NOTHING
    holder: str = ""
    said: str = ""
    bad: bool = False
    saying: int = 0
    question: MachineQuestion | None = None
    progress: ProgramProgress | None = None
    ended: ProgramEnd | None = None

    @property
    def open(self) -> bool:
        """Whether a controller is connected."""
        return self.connection is Connection.OPEN

    @property
    def moves(self) -> bool:
        """Whether it moves, or is about to: what Stop is for."""
        return self.doing is not MachineTask.NOTHING or self.status in ("Run", "Jog", "Home", "Hold", "Door")

    def as_json(self) -> dict[str, Any]:
        """Return it in plain values."""
        made = asdict(self)
        if self.travel is not None and any(abs(v) == float("inf") for end in self.travel for v in end):
            made["travel"] = None
        return made
