"""Read tool libraries: convert TOML to a `ToolLibrary`."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, OptionError, printable
from leafcut.files.schemas import TOOLS
from leafcut.files.toml_table import TomlTable
from leafcut.files.whole_files import read_toml
from leafcut.message import Message
from leafcut.model.kinds import ToolMaterial
from leafcut.model.tool import CONES, MILLS, BodySegment, Recipe, Tool, ToolKind, ToolLibrary
from leafcut.options import CYCLES
from leafcut.read.tool_formats import read_foreign_library
from leafcut.read.tool_keys import HOLE_KEYS, NO_TOOLS, TOOL_KEYS
from leafcut.read.tool_kinds import ToolRow
from leafcut.units import parse_quantity

_TOOL_KEYS, _HOLE_KEYS = (tuple(key.name for key in keys) for keys in (TOOL_KEYS, HOLE_KEYS))

_HIGHEST_NUMBER = 99_999_999  # eight digits: the longest T word (Fanuc)
_LARGEST = 1000.0

#: Keys that only mills have, keys that mills never have, and keys for certain kinds of tools.
_MILL_KEYS, _NO_MILL_KEYS = ("plunge_feed", "teeth"), ("cycle", "peck", "dwell", "pitch")
_SOME_MILLS = {"corner_radius": (ToolKind.END_MILL,), "tip_diameter": CONES}
_MOST_TEETH = 100

#: Default of the full point angle. The common twist drill has 118°, and other tools end flat.
_POINT_ANGLE = {ToolKind.DRILL: math.radians(118), ToolKind.CENTRE_DRILL: math.radians(118)}

#: Maximum number of segments in the body of a tool. Each segment is checked for collisions.
_MOST_SEGMENTS = 40

#: Relative tolerance between the feed of a tap and pitch × speed. It allows for rounding in catalogues.
_TAP_FEED = 0.005


def load_tools(path: str | Path, units: str = "mm", material: str = "") -> ToolLibrary:
    """Load the tool library of a TOML file, with one ``[[tool]]`` per tool and one ``[[hole]]`` per recipe.

    A tap always uses the cycle G84. If a tap has no feed, its feed becomes pitch × speed.

    `leafcut.read.tool_formats` reads the libraries of other programs. For these, `units` applies to lengths without a
    unit, and `material` selects a preset of each tool.

    Raises
    ------
    OptionError
        The file does not exist.
    DataError
        The file cannot be read, or a table is invalid: an unknown key, a duplicate number, a tap without a pitch, a
        recipe with a missing tool … The message contains the file and the number of the table.
    """
    place = str(path)
    foreign = read_foreign_library(Path(path), units, material)
    if foreign is not None:
        return _build_foreign_library(*foreign, place)[1]
    top = TomlTable(read_toml(Path(path), TOOLS), place, ("tool", "hole"))
    tools: dict[int, Tool] = {}
    for count, values in enumerate(_array_of_tables(top, "tool"), start=1):
        table = TomlTable(values, f"{place}: [[tool]] {count}", _TOOL_KEYS, ("tool", count))
        tool = _parse_tool(table)
        if tool.number in tools:
            raise table.value_error("number", "{} is used twice; every tool needs its own", tool.number)
        tools[tool.number] = tool
    if not tools:
        raise DataError("{}: this library has no [[tool]]", place)
    recipes: dict[tuple[float, str], Recipe] = {}
    for count, values in enumerate(_array_of_tables(top, "hole"), start=1):
        table = TomlTable(values, f"{place}: [[hole]] {count}", _HOLE_KEYS, ("hole", count))
        recipe = _parse_recipe(table, tools)
        if (recipe.diameter, recipe.layer) in recipes:
            raise table.value_error(
                "diameter", "{:g} mm on layer '{}' already has a recipe", recipe.diameter, recipe.layer
            )
        recipes[recipe.diameter, recipe.layer] = recipe
    return ToolLibrary(tuple(tools.values()), tuple(recipes.values()), place)


def load_foreign_library(path: Path, units: str, material: str) -> tuple[list[dict[str, Any]], ToolLibrary]:
    """Read the usable tools in the library of another program, both as values of ``[[tool]]`` and as a library.

    Raises
    ------
    DataError
        The file cannot be read, is not a tool library, or contains no usable tool.
    """
    foreign = read_foreign_library(path, units, material)
    if foreign is None:
        raise DataError("{}: not a tool library of another program", path)
    return _build_foreign_library(*foreign, str(path))


def _build_foreign_library(
    rows: list[ToolRow], without_feeds: bool, place: str
) -> tuple[list[dict[str, Any]], ToolLibrary]:
    """Return the rows of the usable tools, and the library. The library lists unusable tools with the reasons."""
    tools: dict[int, Tool] = {}
    kept: list[dict[str, Any]] = []
    left_out: list[Message] = []
    for name, values in rows:
        try:
            if isinstance(values, str):
                raise DataError(values)
            tool = _parse_tool(TomlTable(values, "", _TOOL_KEYS))
            if tool.number in tools:
                raise DataError("another tool has the same number")
        except DataError as problem:
            left_out.append(Message("{}: {}", name, problem))
        else:
            tools[tool.number] = tool
            kept.append(values)
    if not tools:
        refusal = Message("{}: no tool of this library can be used", place)
        raise DataError(Message.joined(": ", [refusal, *left_out[:1]]))
    return kept, ToolLibrary(tuple(tools.values()), (), place, tuple(left_out), without_feeds)


def _array_of_tables(top: TomlTable, key: str) -> list[Any]:
    tables = top.values.get(key, [])
    if not isinstance(tables, list):
        raise DataError("{}: '{}' must be written as [[{}]], once for each entry", top.place, key, key).at(key=key)
    return tables


def _parse_tool(table: TomlTable) -> Tool:
    kind = ToolKind(table.text("kind", ToolKind.DRILL, [k.value for k in ToolKind if k not in NO_TOOLS]))
    angle = table.quantity("point_angle", "rad", _POINT_ANGLE.get(kind, math.pi))
    if not 0 < angle <= math.pi + 1e-9:
        raise table.value_error("point_angle", "must be above 0° and at most 180°")
    tool = Tool(
        number=table.integer("number", 1, _HIGHEST_NUMBER),
        diameter=_parse_positive_quantity(table, "diameter", "mm"),
        kind=kind,
        name=table.text("name", ""),
        point_angle=min(angle, math.pi),
        feed=_parse_positive_quantity(table, "feed", "mm/s") if "feed" in table else 0.0,
        spindle_rpm=_parse_positive_quantity(table, "spindle_speed", "rpm") if "spindle_speed" in table else 0.0,
        cycle=table.optional("cycle", lambda key: table.text(key, choices=CYCLES)),
        peck=table.optional("peck", lambda key: _parse_positive_quantity(table, key, "mm")),
        dwell=table.optional("dwell", lambda key: _parse_seconds(table, key)),
        pitch=table.optional("pitch", lambda key: _parse_positive_quantity(table, key, "mm")),
        flute_length=table.optional("flute_length", lambda key: _parse_positive_quantity(table, key, "mm")),
        depth=table.optional("depth", lambda key: _parse_positive_quantity(table, key, "mm")),
        plunge_feed=_parse_positive_quantity(table, "plunge_feed", "mm/s") if "plunge_feed" in table else 0.0,
        teeth=table.optional("teeth", lambda key: table.integer(key, 1, _MOST_TEETH)),
        corner_radius=_parse_positive_quantity(table, "corner_radius", "mm") if "corner_radius" in table else 0.0,
        tip_diameter=_parse_positive_quantity(table, "tip_diameter", "mm") if "tip_diameter" in table else 0.0,
        material=table.optional("material", lambda key: ToolMaterial(table.text(key, choices=tuple(ToolMaterial)))),
        life_cost=table.optional("life_cost", lambda key: _parse_cost(table, key)),
        shank_diameter=table.optional("shank_diameter", lambda key: _parse_positive_quantity(table, key, "mm")),
        stickout=table.optional("stickout", lambda key: _parse_positive_quantity(table, key, "mm")),
        shaft=_parse_body_segments(table, "shaft"),
        holder=_parse_body_segments(table, "holder"),
    )
    _check_mill(tool, table)
    for key, needs in (("shank_diameter", "flute_length"), ("shaft", "flute_length"), ("holder", "stickout")):
        if key in table and needs not in table:
            raise table.value_error(key, "needs '{}': its start above the tip", needs)
    _check_cycle(tool, table)
    return _with_tapping_cycle(tool, table) if kind is ToolKind.TAP else tool


def _parse_body_segments(table: TomlTable, key: str) -> tuple[BodySegment, ...]:
    """Parse the segments of a tool body, such as ``20-28 x 5, 28 x 40``."""
    pieces = [piece.strip() for piece in table.text(key, "").split(",")] if key in table else []
    if len(pieces) > _MOST_SEGMENTS:
        raise table.value_error(key, "has {} sections; the limit is {}", len(pieces), _MOST_SEGMENTS)
    segments = []
    for piece in pieces:
        diameters, separator, length = piece.lower().partition("x")
        lower, dash, upper = diameters.partition("-")
        try:
            lengths = [parse_quantity(text.strip(), "mm") for text in (length, lower, upper if dash else lower)]
        except OptionError:
            lengths = []
        if not separator or not lengths or not all(0.0 < value <= _LARGEST for value in lengths):
            raise table.value_error(
                key,
                "has the section '{}', but must be such as '28 x 40', or '20-28 x 5' for a cone, in mm",
                printable(piece, 40),
            )
        segments.append(BodySegment(*lengths))
    return tuple(segments)


def _parse_positive_quantity(table: TomlTable, key: str, unit: str) -> float:
    value = table.quantity(key, unit)
    if not value > 0 or (unit == "mm" and value > _LARGEST):
        limit = Message(" and at most {:g} mm", _LARGEST) if unit == "mm" else ""
        raise table.value_error(key, "is {}, but must be above 0{}", table.as_written(key), limit)
    return value


def _parse_seconds(table: TomlTable, key: str) -> float:
    value = table.quantity(key, "s")
    if not 0 <= value <= 100:
        raise table.value_error(key, "is {}, but must be from 0 to 100 s", table.as_written(key))
    return value


def _parse_cost(table: TomlTable, key: str) -> float:
    value = table.number(key, 0.0)
    if not 0 <= value <= 1e6:
        raise table.value_error(key, "is {:g}, but must be from 0 to 1000000", value)
    return value


def _check_mill(tool: Tool, table: TomlTable) -> None:
    mill = tool.kind in MILLS
    without = (*_NO_MILL_KEYS, *(() if tool.kind in CONES else ("point_angle",))) if mill else _MILL_KEYS
    wrong = next((key for key in without if key in table), None)
    if wrong is not None:
        if mill:
            raise table.value_error(wrong, "is not for kind '{}', only for drilling tools", tool.kind)
        raise table.value_error(wrong, "is for mills only")
    for key, kinds in _SOME_MILLS.items():
        if key in table and tool.kind not in kinds:
            raise table.value_error(key, "is not for kind '{}', only for {}", tool.kind, ", ".join(kinds))
    if tool.corner_radius > 0.5 * tool.diameter:
        raise table.value_error("corner_radius", "is {:g} mm, more than half of the diameter", tool.corner_radius)
    if tool.kind in CONES:
        if not 0.0 < tool.point_angle < math.pi:
            raise DataError("{}: a {} needs 'point_angle', the full angle of its cone", table.place, tool.kind).at(
                *table.section, "point_angle"
            )
        if tool.tip_diameter >= tool.diameter:
            raise table.value_error("tip_diameter", "is {:g} mm, not below the diameter", tool.tip_diameter)


def _check_cycle(tool: Tool, table: TomlTable) -> None:
    if tool.cycle in ("G83", "G73") and tool.peck is None:
        raise table.value_error("cycle", "is {}, which needs 'peck', the peck depth", tool.cycle)
    if tool.cycle == "G82" and tool.dwell is None:
        raise table.value_error("cycle", "is G82, which needs 'dwell', the dwell at the bottom")
    if tool.cycle is not None and (tool.cycle == "G84") is not (tool.kind is ToolKind.TAP):
        raise table.value_error(
            "cycle", "is {} for a {}; G84 requires a tap, and a tap requires G84", tool.cycle, tool.kind.value
        )
    if tool.depth is not None and tool.kind is not ToolKind.CENTRE_DRILL:
        raise table.value_error(
            "depth", "is for centre drills only; set the depth of holes with --depth or --thickness"
        )


def _with_tapping_cycle(tool: Tool, table: TomlTable) -> Tool:
    """Return a copy of a tap that uses the cycle G84 and the feed pitch × speed."""
    if tool.pitch is None:
        raise DataError("{}: a tap needs 'pitch', mm per revolution, such as '1 mm' for M6", table.place).at(
            *table.section, "pitch"
        )
    if tool.pitch >= tool.diameter:
        raise table.value_error("pitch", "is {:g} mm, not below the diameter {:g} mm", tool.pitch, tool.diameter)
    feed = tool.pitch * tool.spindle_rpm / 60.0
    if tool.feed and feed and abs(tool.feed - feed) > _TAP_FEED * feed:
        raise table.value_error(
            "feed",
            "is {:g} mm/min, but pitch × speed is {:g} mm/min; leave it out",
            tool.feed * 60,
            feed * 60,
        )
    return replace(tool, cycle="G84", feed=feed or tool.feed)


def _parse_recipe(table: TomlTable, tools: dict[int, Tool]) -> Recipe:
    steps = table.integers("steps", 1, _HIGHEST_NUMBER)
    for number in steps:
        if number not in tools:
            raise table.value_error("steps", "names tool {}, which is not in this library", number)
        if tools[number].kind in MILLS:
            raise table.value_error("steps", "names tool {}, a mill; a step needs a drilling tool", number)
    if len(set(steps)) < len(steps):
        raise table.value_error("steps", "names a tool twice")
    return Recipe(_parse_positive_quantity(table, "diameter", "mm"), steps, table.text("layer", "*"))
