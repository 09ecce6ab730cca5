"""Convert the tool libraries of other programs to rows with the same keys as leafcut's own libraries.

* LinuxCNC table (``tool.tbl``; user manual, "Tool Table Format"): lengths are in the units of the machine. The table
  has no tool kinds, but its comments may name them.
* Fusion library (``.json``, or zipped as ``.tools``): each tool has a unit. Feeds are in presets, one per material.
* FreeCAD library (``.fctl``, with one ``.fctb`` per tool): lengths have units, and tools have no feeds.
* Tables (``.csv``): see `leafcut.read.tool_table`.
"""

from __future__ import annotations

import io
import math
import re
import zipfile
import zlib
from collections.abc import Iterator
from lzma import LZMAError
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, printable
from leafcut.message import Message
from leafcut.model.tool import CONES, MILLS
from leafcut.read.format import parse_json
from leafcut.read.tool_kinds import (
    FUSION_KINDS,
    Preset,
    RawRow,
    ToolRow,
    cone_in_comment,
    tap_pitch_in_comment,
    tool_kind_in_comment,
)
from leafcut.read.tool_table import read_tool_table

#: Maximum size of a library, bytes, before and after unpacking.
MAX_BYTES = 16 * 1024 * 1024

#: Exceptions of `zipfile` and its decompressors for invalid or damaged files.
_TORN = (zipfile.BadZipFile, zlib.error, LZMAError, EOFError, OSError, ValueError, NotImplementedError, RuntimeError)

#: Extensions of libraries in which a tool may have several presets.
WITH_PRESETS = (".json", ".tools", ".csv")
_FUSION_UNITS = {"millimeters": "mm", "inches": "in"}
#: Keys of a segment of a shaft or of a holder.
_SEGMENT = ("height", "lower-diameter", "upper-diameter")
_WIDE = "shoulder-diameter"
_FREECAD_KINDS = {
    "drill": "drill", "endmill": "end-mill", "bullnose": "end-mill", "ballend": "ball-mill", "chamfer": "chamfer-mill",
    "v-bit": "v-bit", "vbit": "v-bit", "reamer": "reamer", "tap": "tap", "slotmill": "slot-mill",
}  # fmt: skip
#: Words that identify a preset for a material: 'Softwood' does, but 'Roughing' does not.
_MATERIALS = frozenset(
    {
        "abs", "acetal", "acrylic", "alloy", "alu", "aluminium", "brass", "bronze", "carbon", "ceramic", "composite",
        "copper", "delrin", "fiberglass", "foam", "fr4", "g10", "glass", "granite", "graphite", "hardwood", "hdpe",
        "inconel", "iron", "leather", "magnesium", "marble", "mdf", "nylon", "paper", "peek", "petg", "plastic",
        "plastics", "plywood", "pmma", "polycarbonate", "polyethylene", "polypropylene", "pom", "ptfe", "pvc", "rubber",
        "softwood", "stainless", "steel", "stone", "teflon", "titanium", "uhmw", "wax", "wood", "zinc",
    }
)  # fmt: skip
#: Kinds of mills, and kinds with a cone: see `leafcut.model.tool`.
_MILLS, _CONES = tuple(kind.value for kind in MILLS), tuple(kind.value for kind in CONES)


def read_foreign_library(path: Path, units: str, material: str = "") -> tuple[list[ToolRow], bool] | None:
    """Read the tools in the library of another program. Return None if the file is not such a library.

    Parameters
    ----------
    units
        Unit of lengths without a unit in the file: ``mm``, ``in``, or "" if unknown.
    material
        Selects a preset of each tool.

    Returns
    -------
    list of ToolRow
        The tools.
    bool
        Whether the library lacks feeds.

    Raises
    ------
    DataError
        The file cannot be read, does not match its extension, or needs `units`.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        return None
    try:
        data = path.read_bytes()
        if len(data) > MAX_BYTES:
            raise DataError("{}: a tool library of {} MiB; the limit is {} MiB", path, len(data) >> 20, MAX_BYTES >> 20)
        rows = [(name, _choose_preset(values, material)) for name, values in reader(path, data, units)]
        return rows, not any("feed" in row for _, row in rows if isinstance(row, dict))
    except OSError as problem:
        raise DataError("{}: cannot be read ({})", path, problem.strerror) from None


def _choose_preset(values: dict[str, Any] | str | list[Preset], material: str) -> dict[str, Any] | str:
    """Choose the preset of a tool for a material, and return the values of the tool.

    If no preset fits, the function returns the reason instead. A preset fits if its words contain all words of the
    material, or vice versa. A tool with a single preset needs no material, unless the preset is named after a material.
    """
    if not isinstance(values, list):
        return values
    material_words = _material_words(material)
    if len(values) == 1 and not (material_words and _material_words(values[0][0]) & _MATERIALS):
        return values[0][1]
    fitting = [
        preset
        for preset in values
        if material_words
        and (material_words <= _material_words(preset[0]) or material_words >= _material_words(preset[0]))
    ]
    exact = [preset for preset in fitting if _material_words(preset[0]) == material_words]
    candidates = exact or fitting or ([] if material_words else values)
    if candidates and all(row == candidates[0][1] for _, row in candidates):
        return candidates[0][1]
    names = ", ".join(f"'{printable(name, 30)}'" for name, _ in values[:6])
    fault = (
        Message("no single preset for '{}'", printable(material, 30)) if material_words else Message("several presets")
    )
    return Message("the tool has {}; name one with --material: {}{}", fault, names, ", …" if len(values) > 6 else "")


def _material_words(text: str) -> frozenset[str]:
    return frozenset(re.findall(r"\w+", text.lower().replace("_", " ").replace("aluminum", "aluminium")))


def _read_linuxcnc_table(path: Path, data: bytes, units: str) -> Iterator[RawRow]:
    if not units:
        raise DataError("{}: a LinuxCNC tool table does not state its unit; give it with --units", path)
    for number, line in enumerate(data.decode("utf-8", "replace").splitlines(), 1):
        entries, _, comment = line.partition(";")
        if not entries.strip():
            continue
        values = {word[0].upper(): word[1:] for word in entries.split()}
        if "T" not in values or not re.fullmatch(r"[0-9]{1,9}", values["T"]):
            raise DataError(
                "{}: line {}: '{}' is not a line of a LinuxCNC tool table", path, number, printable(line, 40)
            )
        yield f"T{values['T']}", _linuxcnc_tool(values, comment.strip(), units)


def _linuxcnc_tool(values: dict[str, str], comment: str, units: str) -> dict[str, Any] | str:
    kind, cone, pitch = tool_kind_in_comment(comment), cone_in_comment(comment), tap_pitch_in_comment(comment)
    if kind is None and cone is not None:
        kind = cone[0]
    elif kind is None and pitch is not None:
        kind = "tap"
    remark = Message("the comment '{}'", printable(comment, 30))
    if not comment:
        return Message("the tool has no comment that names its kind, such as drill or end mill")
    if kind is None:
        return Message("{} names no kind of tool that leafcut knows, such as drill or end mill", remark)
    if cone is not None and not cone[1]:
        return Message("{} does not state the full angle of the cone, such as 90 deg", remark)
    if kind == "tap" and not pitch:
        return Message("{} does not state the pitch of the thread, such as M6x1 or 1/4-20", remark)
    if "D" not in values:
        return Message("the tool has no diameter (D)")
    row = {
        "number": int(values["T"]),
        "kind": kind,
        "diameter": f"{values['D']} {units}",
        "name": _printable_name(comment),
    }
    if cone is not None:
        row["point_angle"] = cone[1]
    elif kind == "tap":
        row["pitch"] = pitch
    return row


def _read_fusion_library(path: Path, data: bytes, _: str) -> Iterator[RawRow]:
    library = _parse_library_json(path, _unzip_json(path, data) if path.suffix.lower() == ".tools" else data)
    tools = library.get("data") if isinstance(library, dict) else None
    if not isinstance(tools, list):
        raise DataError("{}: is not a tool library of Fusion: it has no list 'data'", path)
    for count, tool in enumerate(tools, 1):
        if not isinstance(tool, dict):
            yield Message("tool {}", count), Message("the entry is not a Fusion tool")
            continue
        number = _subtable(tool, "post-process").get("number")
        name = f"T{number}" if isinstance(number, int) else Message("tool {}", count)
        kind = FUSION_KINDS.get(str(tool.get("type", "")).lower())
        unit = _FUSION_UNITS.get(str(tool.get("unit", "")))
        if "type" not in tool:
            yield name, Message("the tool has no type")
        elif kind is None:
            yield name, Message("leafcut has no tool of type '{}'", printable(str(tool["type"]), 30))
        elif "unit" not in tool:
            yield name, Message("the tool has no unit")
        elif unit is None:
            yield name, Message("the unit '{}' is not millimeters or inches", printable(str(tool["unit"]), 20))
        else:
            presets = list(_fusion_presets(tool)) or [("", {})]
            yield name, [(name, _fusion_tool(tool, kind, unit, number, preset)) for name, preset in presets]


def _fusion_presets(tool: dict[str, Any]) -> Iterator[Preset]:
    """Yield the presets of a tool. Libraries from 2016 to 2018 have a single preset called ``*``."""
    start = _subtable(tool, "start-values")
    presets = start.get("presets")
    for preset in presets if isinstance(presets, list) else [start.get("*")]:
        if isinstance(preset, dict):
            material = _subtable(preset, "material")
            yield str(preset.get("name") or material.get("query") or material.get("category") or ""), preset


def _fusion_tool(tool: dict[str, Any], kind: str, unit: str, number: object, preset: dict[str, Any]) -> dict[str, Any]:
    geometry = _subtable(tool, "geometry")
    mill = kind in _MILLS
    angle = _format_with_unit(geometry.get("SIG"), "deg") if kind in ("drill", "centre-drill") else None
    if kind in _CONES and isinstance(geometry.get("TA"), int | float):
        angle = f"{2 * geometry['TA']} deg"  # Fusion states the angle of one side
    plunge = preset.get("v_f_plunge") or preset.get("v_f")
    fields = {
        "number": number,
        "kind": kind,
        "name": _printable_name(str(tool.get("description", ""))),
        "diameter": _format_with_unit(geometry.get("DC"), unit),
        "flute_length": _format_with_unit(geometry.get("LCF"), unit),
        "point_angle": angle,
        "corner_radius": _format_with_unit(geometry.get("RE") or None, unit) if kind == "end-mill" else None,
        "tip_diameter": _format_with_unit(geometry.get("tip-diameter") or None, unit) if kind in _CONES else None,
        "pitch": _format_with_unit(geometry.get("TP"), unit) if kind == "tap" else None,
        "spindle_speed": _format_with_unit(preset.get("n"), "rpm"),
        "feed": None if kind == "tap" else _format_with_unit(preset.get("v_f") if mill else plunge, f"{unit}/min"),
        "plunge_feed": _format_with_unit(preset.get("v_f_plunge"), f"{unit}/min") if mill else None,
        "teeth": geometry.get("NOF") if mill else None,
        **_fusion_body(tool, geometry, unit),
    }
    return {key: value for key, value in fields.items() if value is not None}


def _fusion_body(tool: dict[str, Any], geometry: dict[str, Any], unit: str) -> dict[str, str | None]:
    """Return the known shape of a tool above its flutes.

    A shaft starts above the shoulder, and a holder starts at the stickout (LB). A holder has its own unit.
    """
    flutes, shoulder, wide, stickout = (
        _positive_length(geometry.get(key)) for key in ("LCF", "shoulder-length", _WIDE, "LB")
    )
    pieces = _body_segment_texts(_subtable(tool, "shaft"), unit)
    wide = wide or _positive_length(geometry.get("DC"))
    if 0 < flutes < shoulder and wide:
        neck = dict(zip(_SEGMENT, (shoulder - flutes, wide, wide), strict=True))
        pieces = [*_body_segment_texts({"segments": [neck]}, unit), *pieces]
    holder = _subtable(tool, "holder")
    holder_unit = _FUSION_UNITS.get(str(holder.get("unit", "")), unit)
    return {
        "shank_diameter": _format_with_unit(geometry.get("SFDM"), unit) if flutes else None,
        "stickout": _format_with_unit(stickout, unit),
        "shaft": ", ".join(pieces) or None if flutes else None,
        "holder": ", ".join(_body_segment_texts(holder, holder_unit)) or None if stickout else None,
    }


def _body_segment_texts(body: dict[str, Any], unit: str) -> list[str]:
    """Format the segments of a tool body as texts. Return no segments if any segment is invalid."""
    segments = body.get("segments")
    texts = []
    for segment in segments if isinstance(segments, list) else []:
        length, lower, upper = (
            _positive_length(segment.get(key) if isinstance(segment, dict) else None) for key in _SEGMENT
        )
        if not (length and lower and upper):
            return []
        texts.append(f"{lower:.6f} {unit}-{upper:.6f} {unit} x {length:.6f} {unit}")
    return texts


def _positive_length(value: object) -> float:
    """Return the value if it is a positive number, otherwise 0."""
    plain = isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < math.inf
    return float(value) if plain and isinstance(value, int | float) else 0.0


def _read_freecad_library(path: Path, data: bytes, _: str) -> Iterator[RawRow]:
    library = _parse_library_json(path, data)
    if path.suffix.lower() == ".fctb":
        yield "T1", _freecad_tool(path, library, 1)
        return
    tools = library.get("tools") if isinstance(library, dict) else None
    if not isinstance(tools, list):
        raise DataError("{}: is not a tool library of FreeCAD: it has no list 'tools'", path)
    for count, entry in enumerate(tools, 1):
        number, file = (entry.get("nr"), entry.get("path")) if isinstance(entry, dict) else (None, None)
        if not isinstance(number, int) or not isinstance(file, str):
            yield Message("tool {}", count), Message("the tool has no number or no file")
            continue
        # FreeCAD stores bits beside the library, or in a folder Bit beside the folder of the library.
        candidates = [path.parent / Path(file).name, path.parent.parent / "Bit" / Path(file).name]
        bit = next((candidate for candidate in candidates if candidate.is_file()), None)
        if bit is None:
            yield (
                f"T{number}",
                Message(
                    "the tool's file {} lies neither beside the library nor in ../Bit", printable(Path(file).name, 40)
                ),
            )
            continue
        yield f"T{number}", _freecad_tool(bit, _parse_library_json(bit, bit.read_bytes()[:MAX_BYTES]), number)


def _freecad_tool(path: Path, bit: Any, number: int) -> dict[str, Any] | str:
    if not isinstance(bit, dict):
        return Message("the file is not a FreeCAD tool")
    shape = Path(str(bit.get("shape", ""))).stem.lower()
    kind = _FREECAD_KINDS.get(shape)
    if kind is None:
        return Message("leafcut has no tool of shape '{}'", printable(shape, 30))
    # FreeCAD writes numbers in the user's locale without thousands separators: '3,175 mm'.
    values = {
        key: value.replace(",", ".") if isinstance(value, str) else value
        for key, value in _subtable(bit, "parameter").items()
    }
    flutes = str(values.get("Flutes", ""))
    angle = values.get({"drill": "TipAngle", **dict.fromkeys(_CONES, "CuttingEdgeAngle")}.get(kind, ""))
    fields = {
        "number": number,
        "kind": kind,
        "name": _printable_name(str(bit.get("name", path.stem))),
        "diameter": values.get("Diameter"),
        "flute_length": values.get("CuttingEdgeHeight"),
        "point_angle": None if angle is None else str(angle).replace("°", "deg"),
        "corner_radius": values.get("FlatRadius", values.get("CornerRadius")) if shape == "bullnose" else None,
        "tip_diameter": values.get("TipDiameter")
        if kind in _CONES and _is_positive_length(values.get("TipDiameter"))
        else None,
        "pitch": values.get("Pitch") if kind == "tap" else None,
        "teeth": int(flutes) if kind in _MILLS and re.fullmatch(r"[0-9]{1,9}", flutes) else None,
        "shank_diameter": values.get("ShankDiameter") if _is_positive_length(values.get("CuttingEdgeHeight")) else None,
    }
    return {key: value for key, value in fields.items() if value is not None}


def _is_positive_length(text: object) -> bool:
    """Return whether a length is above 0. FreeCAD stores the tip of a sharp V-bit as ``0.00 mm``."""
    return bool(re.search(r"[1-9]", str(text or "")))


def _parse_library_json(path: Path, data: bytes) -> Any:
    try:
        return parse_json(data.decode("utf-8-sig"))
    except (ValueError, RecursionError) as problem:
        raise DataError("{}: not valid JSON ({})", path, printable(str(problem), 60)) from None


def _unzip_json(path: Path, data: bytes) -> bytes:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            inner = next((i for i in packed.infolist() if i.filename.lower().endswith(".json")), None)
            if inner is not None and inner.file_size > MAX_BYTES:
                raise DataError("{}: unpacks to more than {} MiB", path, MAX_BYTES >> 20)
            if inner is not None:
                return packed.read(inner)
    except _TORN as problem:
        if isinstance(problem, DataError):
            raise
    raise DataError("{}: is not a tool library of Fusion: a zip file with a .json was expected", path)


def _subtable(table: dict[str, Any], key: str) -> dict[str, Any]:
    subtable = table.get(key)
    return subtable if isinstance(subtable, dict) else {}


def _format_with_unit(value: Any, unit: str) -> str | None:
    """Format a value with its unit. Return None for 0 and for values that are not numbers."""
    plain = isinstance(value, int | float) and not isinstance(value, bool)
    return f"{value!r} {unit}" if plain and value else None


def _printable_name(text: str) -> str:
    return printable(text.strip(), 40)


READERS = {
    ".csv": read_tool_table,
    ".tbl": _read_linuxcnc_table,
    ".json": _read_fusion_library,
    ".tools": _read_fusion_library,
    ".fctl": _read_freecad_library,
    ".fctb": _read_freecad_library,
}
