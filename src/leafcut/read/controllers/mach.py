"""Import the machine profile of Mach3 (``Mach3Mill.xml``) or Mach4 (``Machine.ini``).

Sources for Mach3: published profiles and LinuxCNC's import (stepconf/import_mach.py) agree that ``VelN`` and ``AccN``
are in native units per second, ``MNMin`` and ``MNMax`` are the soft limits of axis N, and ``Units`` is 0 for mm and 1
for inches; "Using Mach3Mill", 5.5 (motor tuning) and 5.6 (soft limits, pulleys).

Source for Mach4: "Software Installation and Configuration Guide", chapter 4. Velocity, acceleration and soft limits are
in counts. ``CountsPerUnit`` is per ``SetupUnits``: 200 for inches and 210 for mm, from G20 and G21.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from leafcut.errors import ReadError, printable
from leafcut.model.kinds import Head
from leafcut.read.controllers.ini_text import Ini, read_ini
from leafcut.read.controllers.values import Axes, Values, parse_leading_number

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

#: Characters invalid in XML, which Mach3 still writes in names of people and files (``<LastUser>``).
_NO_XML = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")
#: Default soft limits, which mean unset.
_MACH3_UNSET = (-100.0, 100.0)
#: Tags that Mach3 writes only after the motor tuning of an axis is saved.
_MACH3_MOTORS = tuple(f"{stem}{axis}" for axis in range(3) for stem in ("Vel", "Acc"))
#: Estimate of the corner rounding, which neither file contains, and its reason.
_DEVIATION = "0.05 mm", "constant velocity rounds corners; the file does not state by how much"


def import_mach3(text: str, file: str, units: str | None = None) -> Values:
    """Import a Mach3 profile.

    Raises
    ------
    ReadError
        The text is not XML, declares entities, or does not contain the tuning of a motor. The error is also raised if a
        value is implausible or not a number.
    """
    tags = _preference_texts(text, file)
    values = Values(file, "Mach3")

    def tag_text(tag: str) -> str:
        if tag not in tags:
            raise values.refusal(f"has no <{tag}>; is the file complete?")
        return tags[tag]

    def per_axis(stem: str) -> tuple[float, ...]:
        return tuple(
            parse_leading_number(values, tag_text(stem.format(axis)), f"<{stem.format(axis)}>") for axis in range(3)
        )

    untuned = [tag for tag in _MACH3_MOTORS if tag not in tags]
    if untuned:
        raise values.refusal(
            f"has no <{untuned[0]}>: the tuning of this motor was never saved; "
            "in Mach3 open Config, Motor Tuning and save each axis, then read the file again"
        )
    statement = f"<Units> is {printable(tags['Units'], 10)}" if "Units" in tags else "it has no <Units>"
    unit = _resolve_unit(values, {"0": "mm", "1": "in"}.get(tags.get("Units", "").strip()), statement, units)
    name = tags.get("Profile", "").strip()
    if name:
        values.take("name", printable(name, 40), "<Profile>")
    values.derive("controller", "mach3", "the file is one of Mach3")
    values.take("units", unit, "<Units>")
    values.store_motion(
        Axes(per_axis("Vel{}"), f"{unit}/s", "motor tuning, <Vel0> to <Vel2>"),
        Axes(per_axis("Acc{}"), f"{unit}/s2", "motor tuning, <Acc0> to <Acc2>"),
    )
    steps = [parse_leading_number(values, tags[f"Steps{k}"], f"<Steps{k}>") for k in range(3) if f"Steps{k}" in tags]
    if any(not value > 0 for value in steps):
        raise values.refusal("steps per unit (<Steps0> to <Steps2>) must be above 0; is the motor tuning done?")
    lowest, highest = per_axis("M{}Min"), per_axis("M{}Max")
    _store_mach3_travel(values, unit, lowest, highest, limits_off=tags.get("SoftLimit", "1").strip() == "0")
    values.store_home(Axes((0.0, 0.0, 0.0), unit, "in Mach3 the owner chooses the position of zero", assumed=True))
    _store_mach3_process(values, tags)
    return values


def _store_mach3_travel(
    values: Values, unit: str, lowest: tuple[float, ...], highest: tuple[float, ...], limits_off: bool
) -> None:
    if limits_off and all(pair == _MACH3_UNSET for pair in zip(lowest, highest, strict=True)):
        values.note("soft limits are off and were never set: the travel is not checked")
        return
    if limits_off:
        values.note("soft limits are off in Mach3 (<SoftLimit>0): their travel is used anyway")
    source = "soft limits, <M0Min> to <M2Max>"
    values.store_travel(Axes(lowest, unit, source), Axes(highest, unit, source))


def _store_mach3_process(values: Values, tags: Mapping[str, str]) -> None:
    values.assume("process", Head.SPINDLE.value, "the file does not state the process")
    if tags.get("PlasmaMode", "0").strip() == "1":
        values.note('PlasmaMode is on: if this is a plasma table, set process = "torch" and controller = "plasma"')
    pulley = int(parse_leading_number(values, tags.get("PULLEY", "0"), "<PULLEY>")) + 1
    highest = parse_leading_number(values, tags.get(f"SPEED{pulley}", "0"), f"<SPEED{pulley}>")
    if highest > 0:
        lowest = parse_leading_number(values, tags.get(f"LSPEED{pulley}", "0"), f"<LSPEED{pulley}>")
        values.store_spindle_range(highest, max(lowest, 0.0), f"pulley in use, <SPEED{pulley}>")
    if "SpinDelayCW" in tags:
        delay = parse_leading_number(values, tags["SpinDelayCW"], "<SpinDelayCW>")
        values.take("spindle.start_time", f"{max(delay, 0.0):.10g} s", "<SpinDelayCW>")
    else:
        values.assume_spindle_start()
    _store_motion_style(values)


def import_mach4(text: str, file: str, units: str | None = None) -> Values:
    """Import a Mach4 profile.

    Raises
    ------
    ReadError
        The motor of an axis or its tuning is missing, or a value is implausible or not a number.
    """
    ini = read_ini(text, file)
    values = Values(file, "Mach4")
    setup = ini.get("SetupUnits", "Preferences")
    stated_unit = {"200": "in", "210": "mm"}.get(setup.text if setup else "")
    statement = (
        f"[Preferences]SetupUnits is {printable(setup.text, 10)}" if setup else "[Preferences] has no SetupUnits"
    )
    unit = _resolve_unit(values, stated_unit, statement, units)
    name = ini.get("Profile", "Preferences")
    if name is not None and name.text:
        values.take("name", printable(name.text, 40), f"[Preferences]Profile, {name.place}")
    values.derive("controller", "mach4", "the file is one of Mach4")
    values.take("units", unit, statement)
    motors = [_motor_section_name(ini, values, axis) for axis in range(3)]
    values.store_motion(
        Axes(*_motor_values(ini, values, motors, "MaxVelocity", f"{unit}/s"), derived=True),
        Axes(*_motor_values(ini, values, motors, "MaxAccel", f"{unit}/s2"), derived=True),
    )
    _store_mach4_travel(ini, values, motors, unit)
    values.store_home(
        Axes((0.0, 0.0, 0.0), unit, "Mach4's file has the direction of homing, not its end", assumed=True)
    )
    values.assume("process", Head.SPINDLE.value, "the file does not state the process")
    fastest, slowest = ini.get("MaxRPM", "SpindleRange0"), ini.get("MinRPM", "SpindleRange0")
    high = parse_leading_number(values, fastest.text, f"MaxRPM ({fastest.place})") if fastest else 0.0
    if fastest and high > 0:
        low = parse_leading_number(values, slowest.text, f"MinRPM ({slowest.place})") if slowest else 0.0
        values.store_spindle_range(high, max(low, 0.0), f"[SpindleRange0], {fastest.place}")
    delay = ini.get("SpindleDelay", "Preferences")
    if delay is not None:
        seconds = parse_leading_number(values, delay.text, f"SpindleDelay ({delay.place})")
        values.take("spindle.start_time", f"{max(seconds, 0.0):.10g} s", f"[Preferences]SpindleDelay, {delay.place}")
    else:
        values.assume_spindle_start()
    _store_motion_style(values)
    return values


def _store_mach4_travel(ini: Ini, values: Values, motors: list[str], unit: str) -> None:
    low, _, _ = _motor_values(ini, values, motors, "SoftMinLimit", unit)
    high, _, source = _motor_values(ini, values, motors, "SoftMaxLimit", unit)
    was_set = [top > bottom for bottom, top in zip(low, high, strict=True)]
    if not any(was_set):
        values.note("soft limits were never set: the travel is not checked")
        return
    flags = [ini.get("SoftLimitUsed", f"Axis{axis}") for axis in range(3)]
    ignored = [n for n, flag, is_set in zip("xyz", flags, was_set, strict=True) if is_set and flag and flag.text == "0"]
    if ignored:
        values.note(f"soft limits of {', '.join(ignored)} are off in Mach4: their travel is used anyway")
    lowest = tuple(value if is_set else -math.inf for value, is_set in zip(low, was_set, strict=True))
    highest = tuple(value if is_set else math.inf for value, is_set in zip(high, was_set, strict=True))
    values.store_travel(Axes(lowest, unit, source, derived=True), Axes(highest, unit, source, derived=True))


def _motor_section_name(ini: Ini, values: Values, axis: int) -> str:
    child = ini.get("ChildMotor0", f"Axis{axis}")
    section = child.text if child is not None else f"Motor{axis}"
    if section not in ini.sections:
        raise values.refusal(
            f"has no section [{printable(section, 20)}], the motor of axis {'xyz'[axis]}; is the file complete?"
        )
    return section


def _motor_values(
    ini: Ini, values: Values, motors: list[str], key: str, unit: str
) -> tuple[tuple[float, ...], str, str]:
    """Convert a setting of each motor from counts to mm or inches.

    Returns
    -------
    tuple of float
        The converted value of each motor.
    str
        The unit of these values.
    str
        The source of the values.
    """
    numbers, sources = [], []
    for motor in motors:
        entry, counts = ini.get(key, motor), ini.get("CountsPerUnit", motor)
        if entry is None or counts is None:
            raise values.refusal(
                f"has no {key if entry is None else 'CountsPerUnit'} in [{motor}]; is the file complete?"
            )
        scale = parse_leading_number(values, counts.text, f"[{motor}]CountsPerUnit ({counts.place})")
        if not scale > 0:
            raise values.refusal(f"[{motor}]CountsPerUnit is {scale:g}, but must be above 0 ({counts.place})")
        numbers.append(
            float(f"{parse_leading_number(values, entry.text, f'[{motor}]{key} ({entry.place})') / scale:.8g}")
        )
        sources.append(f"[{motor}] {entry.place}")
    return tuple(numbers), unit, f"{key} ÷ CountsPerUnit of {', '.join(sources)}"


def _store_motion_style(values: Values) -> None:
    values.derive("rapid.style", "linear", "Mach moves all axes together on a straight line")
    values.assume("corners.style", "round", "constant velocity (G64) rounds corners of feed moves")
    values.assume("corners.deviation", *_DEVIATION)
    values.store_manual_tool_changes("macros decide (M6), which are not read")


def _resolve_unit(values: Values, stated: str | None, statement: str, given: str | None) -> str:
    if stated is None and given is None:
        raise values.refusal(f"{statement}, so its lengths may be mm or inches; set --units")
    if stated is not None and given not in (None, stated):
        raise values.refusal(f"{statement}: its units are {stated}, not {given}; leave --units out")
    return stated or given or "mm"


def _preference_texts(text: str, file: str) -> dict[str, str]:
    """Return the text of each tag in ``<Preferences>``. If a tag occurs twice, the last text wins."""
    from defusedxml.common import DefusedXmlException
    from defusedxml.ElementTree import ParseError, fromstring

    try:
        root: Element = fromstring(_NO_XML.sub("?", re.sub(r"^﻿?\s*<\?xml[^>]*\?>", "", text)))
    except DefusedXmlException:
        raise ReadError(file, "declares XML entities, which Mach3 never writes; the file is refused") from None
    except (ParseError, ValueError) as problem:
        raise ReadError(file, f"is not a complete XML file ({printable(str(problem), 60)})") from None
    tags: dict[str, Any] = {}
    for section in [root] if root.tag == "Preferences" else root.findall("Preferences"):
        tags |= {element.tag: element.text or "" for element in section}
    if not tags:
        raise ReadError(file, "is XML, but not a Mach3 profile: <profile> with <Preferences> was expected")
    return tags
