"""The state of the machine at a moment in time. All pages show the same state."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from leafcut.model.machine import XYZ


class Connection(StrEnum):
    """The state of the connection to a controller."""

    CLOSED = "closed"
    OPENING = "opening"
    OPEN = "open"


class MachineTask(StrEnum):
    """The current task of the machine."""

    NOTHING = ""
    ASKING = "asking"
    HOMING = "homing"
    PROBING = "probing"
    FRAMING = "framing"
    RUNNING = "running"
    STOPPING = "stopping"


@dataclass(frozen=True)
class MachineQuestion:
    """A question to the user while a program runs. `replies` contains the controller's replies to manual actions."""

    kind: str
    words: str
    line: int
    hole: int = 0
    replies: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProgramProgress:
    """The progress of a program. Lines and holes count from 1. Before the first line or hole, they are 0.

    Attributes
    ----------
    feed, override
        Feed in mm/min, and override in percent.
    done_s, left_s
        Elapsed and remaining time, s.
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


@dataclass(frozen=True)
class ProgramEnd:
    """How the last program ended. It can resume at `line` or at hole `go_on_hole`, which are 0 if it cannot resume."""

    name: str
    complete: bool
    words: str
    line: int
    go_on_hole: int


@dataclass(frozen=True)
class MachineState:
    """The state of the machine at a moment in time. `number` increases with every change.

    Attributes
    ----------
    machine, work
        Position of the tool in machine and work coordinates, mm, or None if it is not reported.
    travel
        Lowest and highest machine coordinates, mm.
    unsure
        Whether the position may be wrong after an alarm or a reset.
    holder
        The page that has control. It is empty if no page has control.
    said, saying, bad
        The last message, its number, and whether it is an error.
    """

    number: int = 0
    connection: Connection = Connection.CLOSED
    port: str = ""
    version: str = ""
    status: str = ""
    machine: XYZ | None = None
    work: XYZ | None = None
    feed: float = 0.0
    homing: bool = False
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
    def is_connected(self) -> bool:
        """Whether a controller is connected."""
        return self.connection is Connection.OPEN

    @property
    def is_moving(self) -> bool:
        """Whether the machine is moving or about to move, so that the user may want to stop it."""
        return self.doing is not MachineTask.NOTHING or self.status in ("Run", "Jog", "Home", "Hold", "Door")
