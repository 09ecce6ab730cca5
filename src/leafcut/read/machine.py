"""Machine profiles: TOML → `Machine`. Those shipped are found by name, others by the path of their file."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, nearest
from leafcut.model.machine import XYZ, Machine, Probe
from leafcut.read.toml_table import Table, parse_toml, read_toml

RAPID_STYLES = ("linear", "dogleg")
PROCESSES = ("spindle", "torch", "laser", "flame", "water")
CORNERS = ("linuxcnc", "grbl", "round")

#: Every key of a profile, by table; a source is given by ``key`` or ``table.key``.
_KEYS: dict[str, tuple[str, ...]] = {
    "": (
        "name", "description", "controller", "process", "units", "max_feed", "acceleration_factor",
        "home", "work_offset", "safe_z", "rapid", "corners", "travel", "spindle", "tool_change", "probe",
        "sources",
    ),
    "rapid": ("style", "velocity", "acceleration"),
    "corners": ("style", "deviation"),
    "travel": ("min", "max"),
    "spindle": ("min_speed", "max_speed", "start_time"),
    "tool_change": ("automatic", "time", "position"),
    "probe": ("feed", "depth", "switch_offset"),
}  # fmt: skip

#: What a profile may give a source for: every value that is a fact of the machine.
SOURCE_KEYS: tuple[str, ...] = (
    *(k for k in _KEYS[""] if k not in ("name", "description", "sources") and k not in _KEYS),
    *(f"{table}.{key}" for table, keys in _KEYS.items() if table for key in keys),
)

#: LinuxCNC and others check the limits of an axis to about this, mm.
_ROOM = 1e-6


def machine_names() -> list[str]:
    """Return the names of the shipped machines, in order."""
    return sorted(
        f.name.removesuffix(".toml") for f in resources.files("leafcut.machines").iterdir() if f.name.endswith(".toml")
    )


def machine_descriptions() -> dict[str, str]:
    """Return name → description of the shipped machines, in order."""
    return {name: load_machine(name).description for name in machine_names()}


def load_machine(name_or_path: str, work_offset: Sequence[float] | None = None) -> Machine:
    """Return a shipped machine by its name, or the machine of a profile by the path of a ``.toml`` file.

    `work_offset` (x, y, z of program zero in machine coordinates, mm) takes the place of the profile's own.

    Raises
    ------
    OptionError
        No machine of that name (the nearest name is given), a file that cannot be read, or a profile in which a key
        is unknown, missing or of a wrong kind, or says what cannot be.
    """
    if name_or_path.lower().endswith(".toml"):
        machine = _machine_of(read_toml(Path(name_or_path)), name_or_path)
    else:
        names = machine_names()
        if name_or_path not in names:
            raise OptionError(f"unknown machine '{name_or_path}'{nearest(name_or_path, names)}")
        file = resources.files("leafcut.machines") / f"{name_or_path}.toml"
        machine = _machine_of(parse_toml(file.read_bytes(), f"{name_or_path}.toml"), f"{name_or_path}.toml")
    return machine if work_offset is None else replace(machine, work_offset=_work_offset(work_offset))


def _work_offset(value: Sequence[float]) -> XYZ:
    if len(value) != 3 or not all(math.isfinite(v) for v in value):
        raise OptionError(
            f"the work offset needs x, y and z in machine coordinates, such as '-400,-200,-300', not {value}"
        )
    return (float(value[0]), float(value[1]), float(value[2]))


def _machine_of(data: dict[str, Any], place: str) -> Machine:
    top = Table(data, place, _KEYS[""])
    rapid, corners, travel, spindle, change = (
        top.table(name, _KEYS[name]) for name in ("rapid", "corners", "travel", "spindle", "tool_change")
    )
    machine = Machine(
        name=top.text("name"),
        description=top.text("description"),
        controller=top.text("controller"),
        process=top.text("process", "spindle", PROCESSES),
        units=top.text("units", "mm", ("mm", "in")),
        rapid_style=rapid.text("style", "linear", RAPID_STYLES),
        rapid_velocity=_xyz(rapid.vector("velocity", "mm/s")),
        acceleration=_xyz(rapid.vector("acceleration", "mm/s²")),
        acceleration_factor=top.number("acceleration_factor", 1.0),
        corners=corners.text("style", "", ("", *CORNERS)),
        corner_deviation=corners.quantity("deviation", "mm", Machine.corner_deviation),
        max_feed=top.quantity("max_feed", "mm/s"),
        travel_min=_xyz(travel.vector("min", "mm")),
        travel_max=_xyz(travel.vector("max", "mm")),
        home=_xyz(top.vector("home", "mm", (0.0, 0.0, 0.0))),
        work_offset=top.optional("work_offset", lambda key: _xyz(top.vector(key, "mm"))),
        safe_z=top.optional("safe_z", lambda key: top.quantity(key, "mm")),
        spindle_min_rpm=spindle.quantity("min_speed", "rpm", 0.0),
        spindle_max_rpm=spindle.quantity("max_speed", "rpm", Machine.spindle_max_rpm),
        spindle_start_s=spindle.quantity("start_time", "s", 0.0),
        tool_changer=change.flag("automatic", True),
        tool_change_s=change.quantity("time", "s", Machine.tool_change_s),
        tool_change_position=change.optional("position", lambda key: _xy(change.vector(key, "mm", size=2))),
        probe=_probe(top) if "probe" in top else None,
        sources=_sources(top),
    )
    _check(machine, place, top)
    return machine


def _probe(top: Table) -> Probe:
    table = top.table("probe", _KEYS["probe"])
    return Probe(
        table.quantity("feed", "mm/s"),
        table.quantity("depth", "mm", Probe.depth),
        table.quantity("switch_offset", "mm", Probe.switch_offset),
    )


def _xyz(v: tuple[float, ...]) -> XYZ:
    return (v[0], v[1], v[2])


def _xy(v: tuple[float, ...]) -> tuple[float, float]:
    return (v[0], v[1])


def _sources(top: Table) -> dict[str, str]:
    """Return where each value comes from, by ``key`` or ``table.key``."""
    table = top.table("sources", SOURCE_KEYS)
    return {key: table.text(key) for key in table.values}


def _check(machine: Machine, place: str, top: Table) -> None:
    """Refuse numbers that no machine has, before anything divides by them; they are told as they stand in the file."""

    def refuse(key: str, reason: str) -> OptionError:
        return OptionError(f"{place}: '{key}' {reason}")

    if not machine.name or not machine.controller:
        raise refuse("name" if not machine.name else "controller", "is empty")
    for i, axis in enumerate("xyz"):
        low, high = machine.travel_min[i], machine.travel_max[i]
        for key, value in (
            ("rapid.velocity", machine.rapid_velocity[i]),
            ("rapid.acceleration", machine.acceleration[i]),
        ):
            if not value > 0:
                shown = top.table("rapid", _KEYS["rapid"]).typed(key.removeprefix("rapid."), i)
                raise refuse(key, f"of {axis} is {shown}, but must be above 0")
        if not high > low:
            raise refuse("travel.max", f"of {axis} is {high:g} mm, but must be above the smallest, {low:g} mm")
        if not low - _ROOM <= machine.home[i] <= high + _ROOM:
            raise refuse("home", f"of {axis} is {machine.home[i]:g} mm, outside the travel {low:g} to {high:g} mm")
    if machine.safe_z is not None and not machine.travel_min[2] <= machine.safe_z <= machine.travel_max[2]:
        raise refuse("safe_z", f"is {machine.safe_z:g} mm, outside the travel of z")
    if not 0 < machine.acceleration_factor <= 1:
        raise refuse("acceleration_factor", f"is {machine.acceleration_factor:g}, but must be above 0 and at most 1")
    _check_positive(machine, top, refuse)
    if machine.probe is not None:
        _check_probe(machine.probe, machine.max_feed, refuse)
    if not 0 <= machine.spindle_min_rpm <= machine.spindle_max_rpm or not machine.spindle_max_rpm > 0:
        raise refuse("spindle.max_speed", "must be above 0 and not below spindle.min_speed")
    for key, seconds in (("spindle.start_time", machine.spindle_start_s), ("tool_change.time", machine.tool_change_s)):
        if seconds < 0:
            raise refuse(key, f"is {seconds:g} s, but must not be negative")


def _check_probe(probe: Probe, max_feed: float, refuse: Callable[[str, str], OptionError]) -> None:
    if not 0 < probe.feed <= max_feed:
        raise refuse("probe.feed", "must be above 0 and at most max_feed")
    if not 0 <= probe.switch_offset < probe.depth:
        raise refuse("probe.switch_offset", "must not be negative, and below probe.depth")


def _check_positive(machine: Machine, top: Table, refuse: Callable[[str, str], OptionError]) -> None:
    if not machine.corner_deviation > 0:
        shown = top.table("corners", _KEYS["corners"]).typed("deviation")
        raise refuse("corners.deviation", f"is {shown}, but must be above 0")
    if not machine.max_feed > 0:
        raise refuse("max_feed", f"is {top.typed('max_feed')}, but must be above 0")
