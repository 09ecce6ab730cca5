"""Write a tool library with the chosen speeds and feeds.

This is either the user's library with changed values, or a new library.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError
from leafcut.files.schemas import TOOLS
from leafcut.files.whole_files import read_toml_text
from leafcut.model.cutting_front import CuttingData, CuttingPoint
from leafcut.model.tool import CONES, Tool, ToolKind
from leafcut.options import Settings
from leafcut.units import SECONDS_PER_MINUTE


def library_text(data: CuttingData, settings: Settings, file: str | Path) -> str:
    """Return a tool library in TOML with the chosen speeds and feeds.

    A TOML library of the user keeps its comments and its order. Only feeds, speeds and the schema change. Raises
    OptionError if the file name does not end in .toml.
    """
    from leafcut.processes.job import library_of

    if Path(file).suffix.lower() != ".toml":
        raise OptionError(
            f"--save {Path(file).name}: a tool library is written as TOML; name a file that ends in .toml"
        )
    chosen = {front.tool.number: front.best for front in data.tools}
    library = settings.job.tools
    if library is not None and library.suffix.lower() == ".toml":
        return _updated_library_text(library, chosen)
    tools = [front.tool for front in data.tools]
    full_library = library_of(settings, data.machine)
    if full_library is not None:
        tools = list(full_library.tools)
    return _new_library_text(tools, chosen)


def _updated_library_text(library: Path, chosen: dict[int, CuttingPoint]) -> str:
    import tomlkit

    document = tomlkit.parse(read_toml_text(library))
    document.setdefault(TOOLS.key, TOOLS.current)
    for table in document.get("tool", []):
        point = chosen.get(int(table["number"]))
        if point is not None:
            for key, value in _cutting_data_entries(point).items():
                table[key] = value
    return tomlkit.dumps(document)


def _new_library_text(tools: list[Tool], chosen: dict[int, CuttingPoint]) -> str:
    import tomlkit

    document, rows = tomlkit.document(), tomlkit.aot()
    for tool in tools:
        row = tomlkit.table()
        for key, value in _library_entries(tool):
            row.add(key, value)
        for key, value in _cutting_data_entries(chosen[tool.number]).items() if tool.number in chosen else ():
            row[key] = value
        rows.append(row)
    document.add(TOOLS.key, TOOLS.current)
    document.add("tool", rows)
    return tomlkit.dumps(document)


def _cutting_data_entries(point: CuttingPoint) -> dict[str, str]:
    return {
        "feed": f"{point.feed * SECONDS_PER_MINUTE:.10g} mm/min",
        "spindle_speed": f"{point.rpm:.10g} rpm",
    }


def _library_entries(tool: Tool) -> Iterator[tuple[str, Any]]:
    yield "number", tool.number
    yield "kind", tool.kind.value
    if tool.name:
        yield "name", tool.name
    yield "diameter", f"{tool.diameter:.10g} mm"
    if tool.kind in (ToolKind.DRILL, ToolKind.CENTRE_DRILL, *CONES):
        yield "point_angle", f"{math.degrees(tool.point_angle):.10g} deg"
    if tool.feed and tool.kind is not ToolKind.TAP:
        yield "feed", f"{tool.feed * SECONDS_PER_MINUTE:.10g} mm/min"
    if tool.spindle_rpm:
        yield "spindle_speed", f"{tool.spindle_rpm:.10g} rpm"
    lengths = {"peck": tool.peck, "pitch": tool.pitch, "flute_length": tool.flute_length, "depth": tool.depth}
    lengths |= {"corner_radius": tool.corner_radius or None, "tip_diameter": tool.tip_diameter or None}
    for key, length in lengths.items():
        if length is not None:
            yield key, f"{length:.10g} mm"
    if tool.plunge_feed:
        yield "plunge_feed", f"{tool.plunge_feed * SECONDS_PER_MINUTE:.10g} mm/min"
    if tool.teeth is not None:
        yield "teeth", tool.teeth
