"""Reads settings and state from the reports of GRBL, grblHAL and FluidNC.

FluidNC has a configuration file and emulates only some of GRBL's numbered settings. For example, ``$20`` is the soft
limit of the X axis only, and no setting contains the homing position or the maximum spindle speed. For this reason,
leafcut requests the configuration (``$CD``) and reads it in the same way as `leafcut machine import`.

Source: gnea/grbl wiki, "Grbl v1.1 Configuration", and system.c, `system_check_travel_limits`; grblHAL/core, report.c
(`report_build_info`, `report_home_position`); bdring/FluidNC, Report.cpp (`report_build_info`), ProcessSettings.cpp
(`dump_config`), Uart.cpp (`rx_buffer_available`), SettingsDefinitions.cpp.
"""

from __future__ import annotations

import math
from dataclasses import replace

from leafcut.errors import ReadError, SendError
from leafcut.message import Message
from leafcut.model.machine import XYZ
from leafcut.read.controllers.fluidnc import FluidConfiguration, parse_board_configuration
from leafcut.sender.answers import ControllerAnswer, Report, Status
from leafcut.sender.character_counting import GRBL_BUFFER
from leafcut.sender.controller_facts import Facts, SettingNames, TimingSettings, position_in_mm, require_positive_values
from leafcut.units import MM_PER_INCH

_LOCK, _DEVIATION, _ARC_TOLERANCE, _INCHES = 1, 11, 12, 13
_SOFT_LIMITS, _HOMING, _HOME_TO_MIN, _FASTEST, _LASER = 20, 22, 23, 30, 32
_STEPS, _RATES, _ACCELERATIONS, _TRAVELS = 100, 110, 120, 130
#: Value of `$1` for which the motors are always on.
_ALWAYS_ON = 255
#: Letters in ``[OPT:``. Z: the homing position is machine zero. L: the machine is not locked before it is homed.
_ZERO_AT_HOME, _NO_LOCK = "Z", "L"
_PLACES = ("G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92", "TLO")


def _three_setting_names(first: int) -> tuple[str, str, str]:
    return (f"${first}", f"${first + 1}", f"${first + 2}")


def _keys_by_axis(key: str) -> tuple[str, str, str]:
    return (f"{key} of x", f"{key} of y", f"{key} of z")


_GRBL_NAMES = SettingNames(
    "$22=0",
    "$20=0",
    _three_setting_names(_TRAVELS),
    _three_setting_names(_RATES),
    _three_setting_names(_ACCELERATIONS),
    "$30",
    "$32",
)
_FLUIDNC_NAMES = SettingNames(
    Message("not every axis has a homing cycle"),
    "soft_limits",
    _keys_by_axis("max_travel_mm"),
    _keys_by_axis("max_rate_mm_per_min"),
    _keys_by_axis("acceleration_mm_per_sec2"),
    "speed_map",
    "$32",
)


def facts_from_answers(
    answers: list[ControllerAnswer], status: Status, *, homed: bool, configuration: str = ""
) -> Facts:
    """Read the answers to ``$I``, ``$$``, ``$#`` and ``$G``.

    Parameters
    ----------
    answers
        The answers of the controller.
    status
        The current status.
    homed
        Whether the machine was homed since the connection was opened.
    configuration
        FluidNC's answer to ``$CD``.

    Raises
    ------
    SendError
        The settings are invalid, or the controller is not GRBL 1.1 or newer because it reports no version or no
        settings.
    """
    reports = [report for report in answers if isinstance(report, Report)]
    build = next((report for report in reports if report.name == "VER"), None)
    options = next((report for report in reports if report.name == "OPT"), None)
    settings = _Settings({report.name: report.text for report in reports if report.name.startswith("$")})
    if build is None or options is None or not settings:
        raise SendError("the device is not GRBL 1.1, grblHAL or FluidNC (no version, or no settings)")
    letters, *counts = options.text.split(",")
    buffer = GRBL_BUFFER
    if len(counts) >= 2 and counts[1].strip().isdecimal():
        buffer = int(counts[1])
    elif not configuration:
        raise SendError("the controller does not report the size of its buffer ([OPT:{}])", options.text)
    modes = next((tuple(report.text.split()) for report in reports if report.name == "GC"), ())
    facts = _add_numbered_settings(
        settings, letters, Facts(build.text.partition(":")[0], buffer, status, *_NOWHERE, _GRBL_NAMES)
    )
    facts = replace(facts, modes=modes, places=_stored_positions(reports, facts.unit))
    if configuration:
        return _add_fluidnc_configuration(facts, configuration, homed=homed)
    return replace(facts, homed=True if homed else _homed_or_unknown(reports, letters))


_NOWHERE: tuple[XYZ, XYZ] = ((-math.inf,) * 3, (math.inf,) * 3)


class _Settings(dict[str, str]):
    """The settings in the answer to ``$$``. Maps each setting, such as ``$110``, to its text."""

    def number(self, setting: int, default: float = 0.0) -> float:
        text = self.get(f"${setting}", "")
        try:
            return float(text) if text else default
        except ValueError:
            raise SendError(
                "the controller has ${}={}, which is not a number; check its settings", setting, text
            ) from None

    def number_or_none(self, setting: int) -> float | None:
        return self.number(setting) if self.get(f"${setting}") else None

    def axis_values(self, first: int, factor: float = 1.0) -> XYZ | None:
        if not all(self.get(name) for name in _three_setting_names(first)):
            return None
        x, y, z = (self.number(first + axis) * factor for axis in range(3))
        return require_positive_values((x, y, z), _three_setting_names(first))


def _add_numbered_settings(settings: _Settings, letters: str, facts: Facts) -> Facts:
    low, high = [], []
    to_min = int(settings.number(_HOME_TO_MIN))
    for axis in range(3):
        length = settings.number(_TRAVELS + axis, math.inf)
        up = _ZERO_AT_HOME in letters and to_min >> axis & 1
        low.append(0.0 if up else -length)
        high.append(length if up else 0.0)
    lock = settings.number_or_none(_LOCK)
    return replace(
        facts,
        low=(low[0], low[1], low[2]),
        high=(high[0], high[1], high[2]),
        unit=MM_PER_INCH if settings.number(_INCHES) else 1.0,
        homing=int(settings.number(_HOMING)) & 1 == 1,
        soft_limits=settings.number(_SOFT_LIMITS) >= 1.0,
        laser_mode=settings.number(_LASER) == 1.0,
        fastest=settings.number(_FASTEST, 1000.0),
        clock=TimingSettings(
            settings.axis_values(_RATES, 1.0 / 60.0),
            settings.axis_values(_ACCELERATIONS),
            settings.axis_values(_STEPS),
            settings.number_or_none(_DEVIATION),
            settings.number_or_none(_ARC_TOLERANCE),
            None if lock is None else 0.0 if lock == _ALWAYS_ON else lock / 1000.0,
        ),
    )


def _homed_or_unknown(reports: list[Report], letters: str) -> bool | None:
    """Return whether the machine was homed, or None if this is unknown.

    grblHAL reports this for each axis. A GRBL board is locked until it is homed, unless it reports that it does not
    lock.
    """
    home = next((report.text.rpartition(":")[2] for report in reports if report.name == "HOME"), "")
    if home.isdecimal():
        return int(home) & 7 == 7
    return None if _NO_LOCK in letters else True


def _add_fluidnc_configuration(facts: Facts, text: str, *, homed: bool) -> Facts:
    """Add the values in FluidNC's configuration. If ``must_home`` is off, `homed` may still be unknown."""
    try:
        configuration: FluidConfiguration = parse_board_configuration(text, "$CD")
    except ReadError as problem:
        raise SendError("the controller's configuration cannot be used: {}", problem) from None
    return replace(
        facts,
        names=_FLUIDNC_NAMES,
        low=configuration.low,
        high=configuration.high,
        homing=configuration.homing,
        homed=True if homed or configuration.must_home else None,
        soft_limits=configuration.soft_limits,
        fastest=configuration.fastest,
        clock=TimingSettings(
            require_positive_values(configuration.rates, _FLUIDNC_NAMES.rates),
            require_positive_values(configuration.accelerations, _FLUIDNC_NAMES.accelerations),
            require_positive_values(configuration.steps, _keys_by_axis("steps_per_mm")),
            configuration.deviation,
            configuration.arc_tolerance,
        ),
    )


def _stored_positions(reports: list[Report], unit: float) -> dict[str, XYZ]:
    places: dict[str, XYZ] = {}
    for report in reports:
        values = report.numbers if report.name in _PLACES else None
        if values:
            x, y, z = values[:3] if len(values) >= 3 else (0.0, 0.0, values[-1])
            places[report.name] = position_in_mm((x, y, z), unit)
    return places
