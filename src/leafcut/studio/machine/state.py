"""State of the machine at one moment, identical for all pages and programs."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from leafcut.model.machine import XYZ


class Connection(StrEnum):
    """State of the connection."""

    CLOSED = "closed"
    OPENING = "opening"
    OPEN = "open"


class MachineTask(StrEnum):
    """Current task of the machine, started by hand or by a program."""

    NOTHING = ""
    ASKING = "asking"
    HOMING = "homing"
    PROBING = "probing"
    FRAMING = "framing"
    RUNNING = "running"
    STOPPING = "stopping"


@dataclass(frozen=True)
class MachineQuestion:
    """Question to the user during a program; `said` lists the controller's answers to manual actions meanwhile."""

    kind: str
    words: str
    line: int
    hole: int = 0
    tool: int | None = None
    said: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProgramProgress:
    """Progress: line and hole from 1 (0 before the first), s, mm/min, percent; `alone`: it continues without a page."""

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
    """Message about the end of the last program; it can continue at `line` or `go_on_hole`, 0 for none."""

    name: str
    complete: bool
    words: str
    line: int
    go_on_hole: int
    position_kept: bool


@dataclass(frozen=True)
class MachineState:
    """State of the machine at one moment; `number` grows with every change.

    `machine` and `work` are positions of the tool, mm, None if not reported, and may be wrong (`unsure`) after an alarm
    or a reset. `travel` is the lowest and the highest machine coordinates, mm. `holder` is the controlling page or
    "program", empty for none; `said` the last message, `saying` its number, and `bad` whether it is an error.
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
        """Whether it moves or is about to move, so that Stop applies."""
        return self.doing is not MachineTask.NOTHING or self.status in ("Run", "Jog", "Home", "Hold", "Door")

    def as_json(self) -> dict[str, Any]:
        """Return the state as plain values."""
        values = asdict(self)
        if self.travel is not None and any(abs(v) == float("inf") for end in self.travel for v in end):
            values["travel"] = None
        return values
