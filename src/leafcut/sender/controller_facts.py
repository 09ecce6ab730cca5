"""Data that every controller reports before a job: settings, origins, modes and position."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from leafcut.errors import SendError
from leafcut.message import Message
from leafcut.model.machine import XYZ, Machine
from leafcut.sender.answers import Status

_ZERO: XYZ = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class SettingNames:
    """Names of the controller's settings and coordinate systems, as used in messages."""

    homing: str
    soft_limits: str
    travel: tuple[str, str, str]
    rates: tuple[str, str, str]
    accelerations: tuple[str, str, str]
    fastest: str = ""
    laser: str = ""
    coordinates: str = Message("machine coordinates")


@dataclass(frozen=True)
class TimingSettings:
    """Board settings that affect the cycle time. A setting is None if the board does not report it.

    Attributes
    ----------
    rates, accelerations, steps
        Values for each axis, in mm/s, mm/s² and steps per mm.
    deviation, arc_tolerance
        Junction deviation and arc tolerance, mm.
    motor_lock_s
        Time after the end of a move until the board releases the motors, s.
    """

    rates: XYZ | None = None
    accelerations: XYZ | None = None
    steps: XYZ | None = None
    deviation: float | None = None
    arc_tolerance: float | None = None
    motor_lock_s: float | None = None

    def machine_with_settings(self, machine: Machine) -> Machine:
        """Return the machine profile, with the settings that the board has reported."""
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
    """Settings and state that a controller reports. Lengths are in mm, even if the controller reports inches.

    Attributes
    ----------
    buffer
        Size of the receive buffer, bytes.
    low, high
        Limits of the machine coordinates, mm. They are -inf and inf if the controller does not report them.
    unit
        Size of the report unit, mm.
    homing
        Whether the machine can home. If it cannot, its machine coordinates are meaningless.
    homed
        Whether the machine was homed, or None if this is unknown.
    fastest
        Maximum spindle speed in rpm, or maximum laser power.
    places
        Origins and stored positions by name (``G54``, ``G28``, ``G92``, ``TLO``): x, y, z in mm.
    modes
        Modal words that are currently active.
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
    clock: TimingSettings = TimingSettings()
    places: dict[str, XYZ] = field(default_factory=dict)
    modes: tuple[str, ...] = ()

    @property
    def has_valid_coordinates(self) -> bool:
        """Whether the machine coordinates are valid because the machine was homed."""
        return self.homing and self.homed is True

    @property
    def soft_limits_warning(self) -> str:
        """A message that the soft limits are off, or an empty string if they are on."""
        return (
            ""
            if self.soft_limits
            else Message(
                "soft limits are off ({}), so the controller does not stop at the limits", self.names.soft_limits
            )
        )

    def travel_limits(self) -> tuple[XYZ, XYZ]:
        """Return the lower and upper limits of the machine coordinates, mm."""
        return self.low, self.high

    def work_zero(self, frame: int) -> XYZ:
        """Return the zero point of a work coordinate system in machine coordinates, mm.

        The result includes G92 and the tool length. `frame` is ten times the number of the G word, such as 540 for G54.
        """
        offset = self.places.get(f"G{frame / 10:g}", _ZERO)
        shift, length = self.places.get("G92", _ZERO), self.places.get("TLO", _ZERO)
        return (offset[0] + shift[0], offset[1] + shift[1], offset[2] + shift[2] + length[2])

    @property
    def active_work_offset(self) -> int:
        """The active work coordinate system, as ten times the number of its G word. For example, G54 is 540."""
        return next((int(word[1:]) * 10 for word in self.modes if word in self.places and word != "G92"), 540)

    def machine_position(self, status: Status | None = None) -> XYZ | None:
        """Return the tool position in machine coordinates, mm, or None if the controller does not report it."""
        status = status or self.status
        if status.machine is not None:
            return position_in_mm(status.machine, self.unit)
        if status.work is None:
            return None
        x, y, z = position_in_mm(status.work, self.unit)
        zero = (
            self.work_zero(self.active_work_offset)
            if status.offset is None
            else position_in_mm(status.offset, self.unit)
        )
        return (x + zero[0], y + zero[1], z + zero[2])

    def work_position(self, status: Status, offset: XYZ | None) -> XYZ | None:
        """Return the tool position in work coordinates, mm.

        `offset` is the last offset between machine and work coordinates that the controller has reported. It is in
        report units.
        """
        if status.work is not None:
            return position_in_mm(status.work, self.unit)
        place = self.machine_position(status)
        if place is None:
            return None
        zero = self.work_zero(self.active_work_offset) if offset is None else position_in_mm(offset, self.unit)
        return (place[0] - zero[0], place[1] - zero[1], place[2] - zero[2])

    def machine_with_settings(self, machine: Machine) -> Machine:
        """Return the machine profile, with the speeds, accelerations and other timing settings of this board."""
        return self.clock.machine_with_settings(machine)


def position_in_mm(place: XYZ, unit: float) -> XYZ:
    """Convert a position to mm. `unit` is the size of its unit in mm."""
    return (place[0] * unit, place[1] * unit, place[2] * unit)


def require_positive_values(values: XYZ, names: tuple[str, str, str]) -> XYZ:
    """Return the rates, accelerations or steps of the axes. Raises `SendError` if an axis is 0 and so cannot move."""
    if not all(value > 0.0 for value in values):
        raise SendError("the controller has 0 in one of {}: it cannot move", ", ".join(names))
    return values
