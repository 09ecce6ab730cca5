"""What a controller says of itself before anything is sent: settings, origins, modes, place."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from leafcut.errors import SendError
from leafcut.model.machine import XYZ, Machine
from leafcut.sender.answers import Abilities, Build, ControllerAnswer, Modes, Place, Status, StoredSetting
from leafcut.units import MM_PER_INCH

#: Settings by what they say. Source: gnea/grbl wiki, "Grbl v1.1 Configuration".
_LOCK, _REPORT, _DEVIATION, _ARC_TOLERANCE, _INCHES = 1, 10, 11, 12, 13
_SOFT_LIMITS, _HOMING, _HOME_TO_MIN, _PULL_OFF, _FASTEST, _LASER = 20, 22, 23, 27, 30, 32
_STEPS, _RATES, _ACCELERATIONS, _TRAVELS = 100, 110, 120, 130
#: `$1` of motors that stay on.
_ALWAYS_ON = 255
_ZERO: XYZ = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Facts:
    """What a controller said: lengths in mm, whatever ``$13`` is.

    Attributes
    ----------
    version, letters, buffer
        Of the firmware; what it was built with; bytes of its buffer.
    settings
        The answer to ``$$``: number → text.
    places
        The answer to ``$#``: name → x, y, z in mm.
    modes
        The words that are active.
    status
        What it did when it was asked last.
    """

    version: str
    letters: str
    buffer: int
    settings: dict[int, str]
    places: dict[str, XYZ]
    modes: tuple[str, ...]
    status: Status

    def number(self, setting: int, default: float = 0.0) -> float:
        """Return a setting as a number; `default` where the controller has none."""
        text = self.settings.get(setting, "")
        try:
            return float(text) if text else default
        except ValueError:
            raise SendError(
                f"the controller says ${setting}={text}, which is no number; look at its settings"
            ) from None

    @property
    def unit(self) -> float:
        """Millimetres in one unit of its reports."""
        return MM_PER_INCH if self.number(_INCHES) else 1.0

    @property
    def laser_mode(self) -> bool:
        """Whether laser mode is on."""
        return self.number(_LASER) == 1.0

    @property
    def homing(self) -> bool:
        """Whether it can be homed, so that its machine coordinates mean something."""
        return int(self.number(_HOMING)) & 1 == 1

    @property
    def soft_limits(self) -> bool:
        """Whether it keeps to its travel by itself."""
        return self.number(_SOFT_LIMITS) >= 1.0

    @property
    def fastest(self) -> float:
        """The speed of the spindle, or the power of the laser, at most."""
        return self.number(_FASTEST, 1000.0)

    def travel(self) -> tuple[XYZ, XYZ]:
        """Return the lowest and the highest machine coordinates, mm; -inf and inf where there is no setting.

        Source: gnea/grbl 1.1, system.c, `system_check_travel_limits`.
        """
        low, high = [], []
        to_min = int(self.number(_HOME_TO_MIN))
        for axis in range(3):
            length = self.number(_TRAVELS + axis, math.inf)
            up = "Z" in self.letters and to_min >> axis & 1
            low.append(0.0 if up else -length)
            high.append(length if up else 0.0)
        return (low[0], low[1], low[2]), (high[0], high[1], high[2])

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
            return _scaled(status.machine, self.unit)
        if status.work is None:
            return None
        x, y, z = _scaled(status.work, self.unit)
        zero = self.origin(self.frame) if status.offset is None else _scaled(status.offset, self.unit)
        return (x + zero[0], y + zero[1], z + zero[2])

    def work_place(self, status: Status, offset: XYZ | None) -> XYZ | None:
        """Return where the machine is in work coordinates, mm; `offset` is what it said of that last, in its units."""
        if status.work is not None:
            return _scaled(status.work, self.unit)
        place = self.machine_place(status)
        if place is None:
            return None
        zero = self.origin(self.frame) if offset is None else _scaled(offset, self.unit)
        return (place[0] - zero[0], place[1] - zero[1], place[2] - zero[2])

    def timed(self, machine: Machine) -> Machine:
        """Return a machine with the speeds, accelerations and all else that this board's clock goes by."""
        given = self.settings
        rates = self._axes(_RATES, machine.rapid_velocity, 1.0 / 60.0)
        lock = self.number(_LOCK, 1000.0 * machine.motor_lock_s)
        return replace(
            machine,
            rapid_velocity=rates,
            acceleration=self._axes(_ACCELERATIONS, machine.acceleration),
            steps_per_mm=self._axes(_STEPS, machine.steps_per_mm),
            corner_deviation=self.number(_DEVIATION, machine.corner_deviation),
            arc_tolerance=self.number(_ARC_TOLERANCE, machine.arc_tolerance),
            motor_lock_s=(0.0 if lock == _ALWAYS_ON else lock / 1000.0) if _LOCK in given else machine.motor_lock_s,
        )

    def _axes(self, first: int, otherwise: XYZ, factor: float = 1.0) -> XYZ:
        found = [self.number(first + axis, otherwise[axis] / factor) * factor for axis in range(3)]
        if not all(one > 0.0 for one in found):
            raise SendError(f"the controller has 0 in one of ${first} to ${first + 2}: it cannot move")
        return (found[0], found[1], found[2])


def gathered(answers: list[ControllerAnswer], status: Status) -> Facts:
    """Return the facts out of the answers to ``$I``, ``$$``, ``$#`` and ``$G``.

    Raises
    ------
    SendError
        What answers is not GRBL 1.1 or newer: it does not say its version, or has no settings.
    """
    build = next((one for one in answers if isinstance(one, Build)), None)
    built = next((one for one in answers if isinstance(one, Abilities)), None)
    settings = {one.number: one.value for one in answers if isinstance(one, StoredSetting)}
    if build is None or built is None or not settings:
        raise SendError("what answers there is not GRBL 1.1, grblHAL or FluidNC (no version, or no settings)")
    modes = next((one.words for one in answers if isinstance(one, Modes)), ())
    facts = Facts(build.version, built.letters, built.buffer, settings, {}, modes, status)
    return replace(facts, places=_places(answers, facts.unit))


def _places(answers: list[ControllerAnswer], unit: float) -> dict[str, XYZ]:
    found: dict[str, XYZ] = {}
    for one in answers:
        if isinstance(one, Place):
            x, y, z = one.values[:3] if len(one.values) >= 3 else (0.0, 0.0, one.values[-1])
            found[one.name] = _scaled((x, y, z), unit)
    return found


def _scaled(place: XYZ, unit: float) -> XYZ:
    return (place[0] * unit, place[1] * unit, place[2] * unit)
