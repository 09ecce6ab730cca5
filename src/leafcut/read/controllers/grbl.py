"""Import the settings of GRBL and grblHAL from a saved reply to ``$$``.

Source: GRBL 1.1 wiki, "Grbl v1.1 Configuration" (meaning of each number; always in mm, mm/min and mm/s², independent of
``$13``); gnea/grbl 1.1, system.c `system_check_travel_limits` (the travel counts down from 0); grblHAL/core, settings.h
(additional numbers).
"""

from __future__ import annotations

import re

from leafcut.model.kinds import Head
from leafcut.read.controllers.values import Axes, Scalar, Values, format_line_numbers, parse_leading_number

#: ``$110=500.000`` or ``$110 = 500 (x max rate, mm/min)``, optionally after a prefix written by the terminal.
SETTING = re.compile(r"^[^$\[]{0,40}\$(\d{1,4})\s*=\s*([^\s(;]+)", re.MULTILINE)
_VERSION = re.compile(r"\[VER:\s*([^:\]]{1,40})|Grbl(?:HAL)?\s+([0-9][^\s'\[]{0,20})", re.IGNORECASE)
_HAL = re.compile(r"grblHAL", re.IGNORECASE)
#: Numbers that only grblHAL has, such as ``$341`` (tool change): GRBL ends at 132, and its other derivatives below 340.
_ONLY_HAL = frozenset(range(340, 1000))
#: Setting in the file of a sender: ``"key": "$110", "value": "500.000"`` (Universal Gcode Sender), or ``"$110":
#: "500.000"`` (gSender).
_KEPT = re.compile(
    r'"key"\s*:\s*"\$(\d{1,4})"\s*,\s*"value"\s*:\s*"([^"\n]{0,40})"|"\$(\d{1,4})"\s*:\s*"?([^",}\n]{0,40})"?'
)

_TRAVELS, _ACCELERATIONS, _RATES = (130, 131, 132), (120, 121, 122), (110, 111, 112)
_STEPS, _LOCK, _ARC_TOLERANCE = (100, 101, 102), 1, 12
#: Value of ``$1`` that keeps the motors enabled.
_ALWAYS_ON = 255
_DEVIATION, _HOMING, _HOME_TO_MIN, _FASTEST_RPM, _SLOWEST_RPM, _LASER, _SPINDLE_ON = 11, 22, 23, 30, 31, 32, 394
#: grblHAL: bit of ``$22`` that sets machine zero at the switch when homing.
_ZERO_AT_SWITCH = 8
#: Minimum number of settings that identifies a text as GRBL settings.
_SOME = 3


def import_grbl(text: str, file: str) -> Values:
    """Import GRBL settings.

    Raises
    ------
    ReadError
        A required setting is missing, is not a number, or is implausible.
    """
    settings = _parse_settings(text)
    hal = _HAL.search(text) is not None or not _ONLY_HAL.isdisjoint(settings)
    version = _VERSION.search(text)
    name = (version[1] or version[2]) if version else ""
    values = Values(file, " ".join(filter(None, ["grblHAL" if hal else "GRBL", name])))
    values.store_motion(
        _axis_settings(values, settings, _RATES, "mm/min"), _axis_settings(values, settings, _ACCELERATIONS, "mm/s2")
    )
    laser = bool(_setting_flags(values, settings, _LASER))
    _store_controller(values, settings, laser)
    _store_travel(values, settings, hal)
    values.derive("rapid.style", "linear", "GRBL moves all axes together on a straight line")
    values.derive("corners.style", "grbl", "GRBL plans by junction deviation")
    if _DEVIATION in settings:
        values.take(
            "corners.deviation",
            f"{_setting_number(values, settings, _DEVIATION):.10g} mm",
            _setting_source(settings, _DEVIATION),
        )
    else:
        values.assume("corners.deviation", "0.01 mm", "GRBL's own default of $11; the file does not have it")
    _store_arc_tolerance_and_steps(values, settings)
    return values


def is_settings_reply(text: str) -> bool:
    """Return whether a text contains GRBL settings.

    The text can be the reply of the controller to ``$$``, or a file saved by a G-code sender.
    """
    return sum(1 for _ in SETTING.finditer(text)) >= _SOME or (
        text.lstrip("\ufeff \t\r\n").startswith("{") and sum(1 for _ in _KEPT.finditer(text)) >= _SOME
    )


def _parse_settings(text: str) -> dict[int, Scalar]:
    """Parse the settings by number, with the line of each setting. If a number occurs twice, the last value wins."""
    settings = {}
    if text.lstrip("\ufeff \t\r\n").startswith("{"):
        line, position = 1, 0
        for entry in _KEPT.finditer(text):
            line += text.count("\n", position, entry.start())
            position = entry.start()
            settings[int(entry[1] or entry[3])] = Scalar((entry[2] or entry[4] or "").strip(), line)
        return settings
    for count, text_line in enumerate(text.splitlines(), 1):
        match = SETTING.match(text_line)
        if match:
            settings[int(match[1])] = Scalar(match[2], count)
    return settings


def _store_arc_tolerance_and_steps(values: Values, settings: dict[int, Scalar]) -> None:
    if _ARC_TOLERANCE in settings:
        source = _setting_source(settings, _ARC_TOLERANCE)
        values.take("corners.arc_tolerance", f"{_setting_number(values, settings, _ARC_TOLERANCE):.10g} mm", source)
    if all(key in settings for key in _STEPS):
        steps = [f"{_setting_number(values, settings, key):.10g} steps/mm" for key in _STEPS]
        values.take("motors.steps_per_mm", steps, _setting_sources(settings, _STEPS))
    if _LOCK in settings:
        lock_time = _setting_number(values, settings, _LOCK)
        source = _setting_source(settings, _LOCK)
        values.take("motors.lock_time", f"{0.0 if lock_time == _ALWAYS_ON else lock_time:.10g} ms", source)


def _store_controller(values: Values, settings: dict[int, Scalar], laser: bool) -> None:
    values.derive("controller", "grbl-laser" if laser else "grbl", "the settings have GRBL's format")
    if laser:
        values.store_process(Head.LASER, f"{_setting_source(settings, _LASER)}: laser mode")
    else:
        values.assume("process", Head.SPINDLE.value, "laser mode is off ($32); the file has no other information")
    highest = _setting_number(values, settings, _FASTEST_RPM) if _FASTEST_RPM in settings else 0.0
    lowest = _setting_number(values, settings, _SLOWEST_RPM) if _SLOWEST_RPM in settings else 0.0
    if highest > 0:
        keys = [key for key in (_FASTEST_RPM, _SLOWEST_RPM) if key in settings]
        values.store_spindle_range(highest, lowest, _setting_sources(settings, keys))
        if highest == 1000.0 and not laser:
            values.note("$30 is 1000 rpm, GRBL's own default: set it to the spindle speed at full voltage")
    if _SPINDLE_ON in settings:
        values.take(
            "spindle.start_time",
            f"{_setting_number(values, settings, _SPINDLE_ON):.10g} s",
            _setting_source(settings, _SPINDLE_ON),
        )
    else:
        values.assume_spindle_start(laser)
    values.store_manual_tool_changes("GRBL itself has no tool changer")


def _store_travel(values: Values, settings: dict[int, Scalar], hal: bool) -> None:
    homing = _setting_flags(values, settings, _HOMING)
    to_min = _setting_flags(values, settings, _HOME_TO_MIN)
    if any(key in settings for key in _TRAVELS):
        lengths = _axis_settings(values, settings, _TRAVELS, "mm")
        for length, axis in zip(lengths.numbers, "xyz", strict=True):
            if not length > 0:
                raise values.refusal(f"the travel of {axis} is {length:g} mm, but must be above 0 ({lengths.source})")
        # grblHAL may count from the homing switch: up from 0 if the switch is at the lower end of the axis.
        counts_up = [bool(hal and homing & _ZERO_AT_SWITCH and to_min >> axis & 1) for axis in range(3)]
        source = f"{lengths.source}; " + (
            "counted from the switches ($22, $23)" if any(counts_up) else "GRBL counts down from 0"
        )
        ends = list(zip(counts_up, lengths.numbers, strict=True))
        lowest = Axes(tuple(0.0 if rises else -length for rises, length in ends), "mm", source, derived=True)
        highest = Axes(tuple(length if rises else 0.0 for rises, length in ends), "mm", source, derived=True)
        values.store_travel(lowest, highest)
        home = [
            low if to_min >> axis & 1 else high
            for axis, (low, high) in enumerate(zip(lowest.numbers, highest.numbers, strict=True))
        ]
    else:
        home = [0.0, 0.0, 0.0]
        values.note("the file has no travel ($130 to $132): it is not checked")
    if homing & 1:
        home_source = _setting_sources(settings, [key for key in (_HOMING, _HOME_TO_MIN) if key in settings])
        values.store_home(Axes(tuple(home), "mm", f"{home_source}: the ends with its limit switches", derived=True))
    else:
        reason = "no homing ($22): machine zero is its position at power-on"
        values.store_home(Axes((0.0, 0.0, 0.0), "mm", reason, assumed=True))
        values.note("homing is off ($22=0): the travel starts at the position at power-on")


def _axis_settings(values: Values, settings: dict[int, Scalar], keys: tuple[int, ...], unit: str) -> Axes:
    for key in keys:
        if key not in settings:
            raise values.refusal(f"has no ${key}; save the complete answer to $$")
    return Axes(tuple(_setting_number(values, settings, key) for key in keys), unit, _setting_sources(settings, keys))


def _setting_number(values: Values, settings: dict[int, Scalar], key: int) -> float:
    setting = settings[key]
    return parse_leading_number(values, setting.text, f"${key}", setting.line)


def _setting_flags(values: Values, settings: dict[int, Scalar], key: int) -> int:
    if key not in settings:
        return 0
    flags = _setting_number(values, settings, key)
    if not 0 <= flags < 1 << 16:
        raise values.refusal(f"${key} is {flags:g}, but must be a whole number from 0", settings[key].line)
    return int(flags)


def _setting_source(settings: dict[int, Scalar], key: int) -> str:
    return f"${key} = {settings[key].text}, {format_line_numbers([settings[key].line])}"


def _setting_sources(settings: dict[int, Scalar], keys: tuple[int, ...] | list[int]) -> str:
    texts = ", ".join(f"${key} = {settings[key].text}" for key in keys)
    return f"{texts}, {format_line_numbers(settings[key].line for key in keys)}"
