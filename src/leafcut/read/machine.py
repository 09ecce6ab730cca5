"""Read machine profiles: convert TOML to a `Machine`.

A profile that ships with leafcut or with an installed package (`leafcut.machines`) is loaded by name. All other
profiles are loaded by path.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, OptionError, name_suggestion, printable
from leafcut.files.plugins import PluginKind, entry_point_file
from leafcut.files.schemas import MACHINE
from leafcut.files.toml_table import TomlTable
from leafcut.files.whole_files import parse_toml, read_toml
from leafcut.gcode.dialects import DIALECTS, dialect_names, load_dialect
from leafcut.message import Message
from leafcut.model.kinds import Head, first_word_of_process
from leafcut.model.machine import XYZ, Machine, Probe
from leafcut.read.machine_keys import (
    CORNERS,
    KEYS,
    RAPID_STYLES,
    SOURCE_KEYS,
    TOP_KEYS,
    UNKNOWN,
    fill_in_defaults,
    profile_template,
)
from leafcut.units import SECONDS_PER_MINUTE

#: Tolerance of axis limits in LinuxCNC and other controllers, mm.
_TOLERANCE = 1e-6
#: Maximum number of motor steps per mm.
_MAX_STEPS = 1e5
#: Largest nozzle diameter, mm.
_WIDEST_NOZZLE = 200.0


def shipped_machines() -> list[str]:
    """Return the sorted names of the shipped machines."""
    return sorted(
        file.name.removesuffix(".toml") for file in _machine_folder().iterdir() if file.name.endswith(".toml")
    )


def _machine_folder() -> Any:
    return resources.files("leafcut") / "machines"


def _plugin_profile_path(name: str, entry: Any) -> Path:
    path = entry_point_file(name, entry)
    load_machine(str(path))
    return path


#: Machines from other packages, as TOML profiles.
MACHINES = PluginKind(
    "machine",
    "leafcut.machines",
    shipped_machines,
    _plugin_profile_path,
    lambda path: load_machine(str(path)).description,
)


def machine_names() -> list[str]:
    """Return the names of all machines, starting with the shipped machines. Broken plug-ins are left out."""
    return [*shipped_machines(), *(plugin.name for plugin in MACHINES.plugins() if plugin.adds is not None)]


def machine_descriptions() -> list[tuple[str, str]]:
    """Return the name, description and controller of each machine. A broken plug-in has its name and error instead."""
    known = {name: load_machine(name) for name in machine_names()}
    # For a dialect given by path, only the file name is shown.
    rows = [(name, f"{one.description} ({Path(one.controller).name})") for name, one in known.items()]
    return rows + [(one.name, one.refusal) for one in MACHINES.plugins() if one.adds is None]


def load_machine(name_or_path: str, work_offset: Sequence[float] | None = None) -> Machine:
    """Load a machine by name, or from the path of a ``.toml`` profile.

    `work_offset` overrides the value in the profile. It is the program zero in machine coordinates: x, y, z in mm.

    Raises
    ------
    OptionError
        The machine or the file does not exist (the message suggests the nearest name), or a plug-in cannot be read.
    DataError
        The file cannot be read, or a key of the profile is unknown, missing, of the wrong kind or out of range.
    """
    machine = _machine_from_values(*_load_profile(name_or_path))
    return machine if work_offset is None else replace(machine, work_offset=_checked_work_offset(work_offset))


def machine_template(name_or_path: str) -> str:
    """Return a machine profile as TOML for editing. Comments explain every key.

    Raises the same errors as `load_machine`.
    """
    data, place = _load_profile(name_or_path)
    machine = _machine_from_values(data, place)
    return profile_template(data, machine.name)


def machine_from_profile_text(text: str, place: str) -> Machine:
    """Convert the text of a profile to a machine. Error messages start with `place`.

    Raises
    ------
    DataError
        A key is unknown, missing, of the wrong kind or out of range.
    """
    return _machine_from_values(parse_toml(text, place, MACHINE), place)


def load_profile_values(name_or_path: str) -> dict[str, Any]:
    """Return the keys and values of a machine profile without any changes.

    Raises the same errors as `load_machine`.
    """
    data, place = _load_profile(name_or_path)
    _machine_from_values(data, place)
    return data


def _load_profile(name_or_path: str) -> tuple[dict[str, Any], str]:
    if name_or_path.lower().endswith(".toml"):
        return read_toml(Path(name_or_path), MACHINE), name_or_path
    if name_or_path not in shipped_machines():
        if name_or_path in MACHINES.names():
            path = MACHINES.load(name_or_path)
            return {**read_toml(path, MACHINE), "name": name_or_path}, str(path)
        raise OptionError("unknown machine '{}'{}", name_or_path, name_suggestion(name_or_path, machine_names()))
    file = _machine_folder() / f"{name_or_path}.toml"
    return parse_toml(file.read_text(encoding="utf-8"), file.name, MACHINE), file.name


def _checked_work_offset(value: Sequence[float]) -> XYZ:
    if len(value) != 3 or not all(math.isfinite(v) for v in value):
        raise OptionError(
            "the work offset needs x, y and z in machine coordinates, such as '-400,-200,-300', not {}", value
        )
    return (float(value[0]), float(value[1]), float(value[2]))


def _machine_from_values(data: dict[str, Any], place: str) -> Machine:
    given = TomlTable(data, place, TOP_KEYS)
    filled, assumed = fill_in_defaults(data)
    top = TomlTable(filled, place, TOP_KEYS)
    rapid, corners, motors, travel, spindle, change = (
        top.table(name, KEYS[name]) for name in ("rapid", "corners", "motors", "travel", "spindle", "tool_change")
    )
    probe, sources = top.table("probe", KEYS["probe"]), top.table("sources", SOURCE_KEYS)
    velocity = _as_xyz(rapid.vector("velocity", "mm/s"))
    name = top.text("name", Path(place).stem)
    controller, family = _controller_dialect(top, place)
    machine = Machine(
        name=name,
        description=top.text("description", name),
        controller=controller,
        family=family,
        head=Head(top.text("process", choices=tuple(Head))),
        cut_process=top.text("cut_process", ""),
        units=top.text("units", choices=("mm", "in")),
        rapid_style=rapid.text("style", choices=RAPID_STYLES),
        rapid_velocity=velocity,
        acceleration=_as_xyz(rapid.vector("acceleration", "mm/s²")),
        acceleration_factor=top.number("acceleration_factor", 1.0),
        corners=corners.text("style", "", ("", *CORNERS)),
        corner_deviation=corners.quantity("deviation", "mm"),
        arc_tolerance=corners.quantity("arc_tolerance", "mm"),
        steps_per_mm=_as_xyz(motors.vector("steps_per_mm", "steps/mm")),
        motor_lock_s=motors.quantity("lock_time", "s"),
        max_feed=top.quantity("max_feed", "mm/s", min(velocity[:2])),
        travel_min=_travel_limits(travel, "min", -math.inf),
        travel_max=_travel_limits(travel, "max", math.inf),
        home=_as_xyz(top.vector("home", "mm")),
        work_offset=top.optional("work_offset", lambda key: _as_xyz(top.vector(key, "mm"))),
        safe_z=top.optional("safe_z", lambda key: top.quantity(key, "mm")),
        spindle_min_rpm=spindle.quantity("min_speed", "rpm"),
        spindle_max_rpm=spindle.quantity("max_speed", "rpm"),
        spindle_power=spindle.quantity("power", "W", 0.0),
        spindle_torque=spindle.quantity("torque", "N·mm", 0.0),
        max_thrust=spindle.quantity("max_thrust", "N", 0.0),
        spindle_start_s=spindle.quantity("start_time", "s"),
        tool_changer=change.flag("automatic", True),
        preselect_tool=change.flag("preselect", False),
        optional_stop=change.flag("optional_stop", False),
        tool_change_s=change.quantity("time", "s"),
        tool_change_position=change.optional("position", lambda key: _as_xy(change.vector(key, "mm", size=2))),
        nozzle_diameter=top.quantity("nozzle_diameter", "mm"),
        probe=Probe(
            probe.quantity("feed", "mm/s"), probe.quantity("depth", "mm"), probe.quantity("switch_offset", "mm")
        )
        if "probe" in top
        else None,
        sources={key: sources.text(key) for key in sources.values},
    )
    if "max_feed" not in given:
        assumed["max_feed"] = f"{machine.max_feed * SECONDS_PER_MINUTE:g} mm/min (the slower of the rapids of x and y)"
    unlimited = [axis for axis, name in enumerate("xyz") if not math.isfinite(machine.reach(axis))]
    if unlimited:
        assumed["travel"] = f"unknown in {', '.join('xyz'[axis] for axis in unlimited)} (not checked)"
    machine = replace(machine, assumed=assumed)
    _check_values(machine, place, top)
    return machine


def _controller_dialect(top: TomlTable, place: str) -> tuple[str, str]:
    """Return the dialect of a machine (a name or a path), and the shipped dialect that it extends, or "".

    A dialect file must be in the same folder as the profile or in a subfolder. This prevents a profile from reading
    files elsewhere.
    """
    name = top.text("controller")
    if name.lower().endswith(".toml"):
        file = Path(name)
        if file.is_absolute() or file.drive or ".." in file.parts:
            raise top.value_error(
                "controller", "names '{}', but a dialect file must be in the folder of the profile", printable(name)
            )
        name = str(Path(place).parent / file)
        if not Path(name).is_file():
            raise top.value_error(
                "controller", "names '{}', which does not exist in the folder of the profile", printable(str(file))
            )
        return name, load_dialect(name).family
    if name in DIALECTS.names():
        return name, DIALECTS.load(name).family
    if name and name not in dialect_names():
        raise top.value_error(
            "controller", "is '{}', which is not a dialect{}", printable(name), name_suggestion(name, dialect_names())
        )
    return name, ""


def _travel_limits(travel: TomlTable, key: str, unlimited: float) -> XYZ:
    """Return the travel limits of the axes. `unlimited` replaces an unknown limit."""
    if not travel.values:
        return (unlimited,) * 3
    value = travel.values.get(key)
    if value == UNKNOWN:
        return (unlimited,) * 3
    if not isinstance(value, list) or UNKNOWN not in value or len(value) != 3:
        return _as_xyz(travel.vector(key, "mm"))
    known = travel.with_value(key, ["0 mm" if limit == UNKNOWN else limit for limit in value]).vector(key, "mm")
    return _as_xyz(
        tuple(unlimited if limit == UNKNOWN else position for limit, position in zip(value, known, strict=True))
    )


def _as_xyz(v: tuple[float, ...]) -> XYZ:
    return (v[0], v[1], v[2])


def _as_xy(v: tuple[float, ...]) -> tuple[float, float]:
    return (v[0], v[1])


def _check_values(machine: Machine, place: str, top: TomlTable) -> None:
    """Raise `DataError` for an invalid value. Messages show the numbers as the user wrote them in the file."""

    def refusal(key: str, reason: Message) -> DataError:
        table, _, name = key.rpartition(".")
        return DataError("{}: '{}' {}", place, key, reason).at(table, key=name)

    if not machine.name or not machine.controller:
        raise refusal("name" if not machine.name else "controller", Message("is empty"))
    _check_cut_process(machine, refusal)
    for i, axis in enumerate("xyz"):
        low, high = machine.travel_min[i], machine.travel_max[i]
        for key, value in (
            ("rapid.velocity", machine.rapid_velocity[i]),
            ("rapid.acceleration", machine.acceleration[i]),
        ):
            if not value > 0:
                typed = top.table("rapid", KEYS["rapid"]).as_written(key.removeprefix("rapid."), i)
                raise refusal(key, Message("of {} is {}, but must be above 0", axis, typed))
        if not high > low:
            raise refusal(
                "travel.max", Message("of {} is {:g} mm, but must be above the smallest, {:g} mm", axis, high, low)
            )
        if not low - _TOLERANCE <= machine.home[i] <= high + _TOLERANCE:
            raise refusal(
                "home",
                Message("of {} is {:g} mm, outside the travel {:g} to {:g} mm", axis, machine.home[i], low, high),
            )
    if machine.safe_z is not None and not machine.travel_min[2] <= machine.safe_z <= machine.travel_max[2]:
        raise refusal("safe_z", Message("is {:g} mm, outside the travel of z", machine.safe_z))
    if not 0 < machine.acceleration_factor <= 1:
        raise refusal(
            "acceleration_factor", Message("is {:g}, but must be above 0 and at most 1", machine.acceleration_factor)
        )
    _check_positive(machine, top, refusal)
    _check_spindle_loads(machine, refusal)
    if machine.probe is not None:
        _check_probe(machine.probe, machine.max_feed, refusal)
    if not 0 <= machine.spindle_min_rpm <= machine.spindle_max_rpm or not machine.spindle_max_rpm > 0:
        raise refusal("spindle.max_speed", Message("must be above 0 and not below spindle.min_speed"))
    for key, seconds in (("spindle.start_time", machine.spindle_start_s), ("tool_change.time", machine.tool_change_s)):
        if seconds < 0:
            raise refusal(key, Message("is {:g} s, but must not be negative", seconds))


def _check_cut_process(machine: Machine, refusal: Callable[[str, Message], DataError]) -> None:
    name, method = machine.cut_process, machine.head.method
    if name and method is None:
        raise refusal(
            "cut_process", Message("is for a machine that cuts sheet, not for one with a spindle; leave it out")
        )
    if name and first_word_of_process(name) != method:
        raise refusal("cut_process", Message("is '{}', but its name must start with '{}'", printable(name), method))


def _check_spindle_loads(machine: Machine, refusal: Callable[[str, Message], DataError]) -> None:
    for key, value in (
        ("spindle.power", machine.spindle_power),
        ("spindle.torque", machine.spindle_torque),
        ("spindle.max_thrust", machine.max_thrust),
    ):
        if value < 0:
            raise refusal(key, Message("must not be negative"))


def _check_probe(probe: Probe, max_feed: float, refusal: Callable[[str, Message], DataError]) -> None:
    if not 0 < probe.feed <= max_feed:
        raise refusal("probe.feed", Message("must be above 0 and at most max_feed"))
    if not 0 <= probe.switch_offset < probe.depth:
        raise refusal("probe.switch_offset", Message("must not be negative, and below probe.depth"))


def _check_positive(machine: Machine, top: TomlTable, refusal: Callable[[str, Message], DataError]) -> None:
    for key, value in (("deviation", machine.corner_deviation), ("arc_tolerance", machine.arc_tolerance)):
        if not value > 0:
            shown = top.table("corners", KEYS["corners"]).as_written(key)
            raise refusal(f"corners.{key}", Message("is {}, but must be above 0", shown))
    motors = top.table("motors", KEYS["motors"])
    for axis, steps in zip("xyz", machine.steps_per_mm, strict=True):
        if not 0 < steps <= _MAX_STEPS:
            raise refusal(
                "motors.steps_per_mm",
                Message("of {} is {:g}, but must be above 0, {:g} at most", axis, steps, _MAX_STEPS),
            )
    if not 0 <= machine.motor_lock_s < 1:
        raise refusal(
            "motors.lock_time", Message("is {}, but must be 0 or more, below 1 s", motors.as_written("lock_time"))
        )
    if not 0 <= machine.nozzle_diameter <= _WIDEST_NOZZLE:
        raise refusal(
            "nozzle_diameter",
            Message("is {}, but must be 0 to {:g} mm", top.as_written("nozzle_diameter"), _WIDEST_NOZZLE),
        )
    if not machine.max_feed > 0:
        raise refusal("max_feed", Message("is {}, but must be above 0", top.as_written("max_feed")))
