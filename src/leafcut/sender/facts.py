"""What a controller says of itself before anything is sent: settings, origins, modes, place, whatever its firmware."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from leafcut.errors import SendError
from leafcut.model.machine import XYZ, Machine
from leafcut.sender.answers import Status

_ZERO: XYZ = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class SettingNames:
    """How a controller calls what it is set to, and what its places are counted in, for messages."""

    homing: str
    soft_limits: str
    travel: tuple[str, str, str]
    rates: tuple[str, str, str]
    accelerations: tuple[str, str, str]
    fastest: str = ""
    laser: str = ""
    coordinates: str = "machine coordinates"


@dataclass(frozen=True)
class Clock:
    """What the time of a program goes by on a board; None where it does not say it.

    Attributes
    ----------
    rates, accelerations
        Of each axis, mm/s and mm/s².
    steps
        Steps in a millimetre.
    deviation, arc_tolerance
        Of corners and of arcs, mm.
    motor_lock_s
        How long motors are held before they are let go, s.
    """

    rates: XYZ | None = None
    accelerations: XYZ | None = None
    steps: XYZ | None = None
    deviation: float | None = None
    arc_tolerance: float | None = None
    motor_lock_s: float | None = None

    def timed(self, machine: Machine) -> Machine:
        """Return a machine with all that is said here."""
        return replace(
            machine,
            rapid_velocity=self.rates or machine.rapid_velocity,
            acceleration=self.accelerations or machine.acceleration,
            steps_per_mm=self.steps or machine.steps_per_mm,
            corner_deviation=machine.corner_deviation if self.deviation is None else self.deviation,
            arc_tolerance=machine.arc_tolerance if self.arc_tolerance is None else self.arc_tolerance,
            motor_lock_s=machine.motor_lock_s if self.motor_lock_s is None else self.motor_lock_s,
        )


@dataclass(frozen=True)
class Facts:
    """What a controller said: lengths in mm, whatever units it reports in.

    Attributes
    ----------
    version, buffer
        Of the firmware; bytes of its buffer.
    status
        What it did when it was asked last.
    low, high
        The lowest and the highest machine coordinates, mm; -inf and inf where it does not say.
    names
        How it calls its settings.
    unit
        Millimetres in one unit of its reports.
    homing, homed
        Whether it can be homed, so that its machine coordinates mean something; whether it was, None where it cannot be
        asked.
    soft_limits
        Whether it keeps to its travel by itself.
    laser_mode, fastest
        Whether laser mode is on; the speed of the spindle, or the power of the laser, at most.
    arcs
        Whether it has G2 and G3.
    clock
        What times go by.
    places
        Origins by name, ``G54``, ``G28``, ``G92``, ``TLO``: x, y, z in mm.
    modes
        The words that are active.
    """

    version: str
    buffer: int
    status: Status
    low: XYZ
    high: XYZ
    names: SettingNames
    unit: float = 1.0
    homing: bool = True
    homed: bool | None = True
    soft_limits: bool = True
    laser_mode: bool = False
    fastest: float = float("inf")
    arcs: bool = True
    clock: Clock = Clock()
    places: dict[str, XYZ] = field(default_factory=dict)
    modes: tuple[str, ...] = ()

    @property
    def knows_place(self) -> bool:
        """Whether its machine coordinates are those of the machine: it was homed."""
        return self.homing and self.homed is True

    @property
    def soft_limits_off(self) -> str:
        """What is told where its soft limits are off; empty where they are on."""
        return (
            ""
            if self.soft_limits
            else f"soft limits are off ({self.names.soft_limits}): the controller itself stops at no limit"
        )

    def travel(self) -> tuple[XYZ, XYZ]:
        """Return the lowest and the highest machine coordinates, mm."""
        return self.low, self.high

    def origin(self, frame: int) -> XYZ:
        """Return the zero of a work offset (540 for G54) in machine coordinates, mm, G92 and tool length included."""
        own = self.places.get(f"G{frame / 10:g}", _ZERO)
        shift, length = self.places.get("G92", _ZERO), self.places.get("TLO", _ZERO)
        return (own[0] + shift[0], own[1] + shift[1], own[2] + shift[2] + length[2])

    @property
    def frame(self) -> int:
        """The work offset that is active, in tenths."""
        return next((int(word[1:]) * 10 for word in self.modes if word in self.places and word != "G92"), 540)

    def machine_place(self, status: Status | None = None) -> XYZ | None:
        """Return where the machine is, in machine coordinates, mm; None where it does not say."""
        status = status or self.status
        if status.machine is not None:
            return scaled(status.machine, self.unit)
        if status.work is None:
            return None
        x, y, z = scaled(status.work, self.unit)
        zero = self.origin(self.frame) if status.offset is None else scaled(status.offset, self.unit)
        return (x + zero[0], y + zero[1], z + zero[2])

    def work_place(self, status: Status, offset: XYZ | None) -> XYZ | None:
        """Return where the machine is in work coordinates, mm; `offset` is what it said of that last, in its units."""
        if status.work is not None:
            return scaled(status.work, self.unit)
        place = self.machine_place(status)
        if place is None:
            return None
        zero = self.origin(self.frame) if offset is None else scaled(offset, self.unit)
        return (place[0] - zero[0], place[1] - zero[1], place[2] - zero[2])

    def timed(self, machine: Machine) -> Machine:
        """Return a machine with the speeds, accelerations and all else that this board's clock goes by."""
        return self.clock.timed(machine)


def scaled(place: XYZ, unit: float) -> XYZ:
    """Return a place in mm."""
    return (place[0] * unit, place[1] * unit, place[2] * unit)


def moving(values: XYZ, what: tuple[str, str, str]) -> XYZ:
    """Return rates, accelerations or steps of the axes.

    Raises
    ------
    SendError
        One is 0, so that the axis cannot move.
    """
    if not all(one > 0.0 for one in values):
        raise SendError(f"the controller has 0 in one of {', '.join(what)}: it cannot move")
    return values
