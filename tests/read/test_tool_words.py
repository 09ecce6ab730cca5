"""The words for tools: names of columns and units, kinds of other programs, sizes of threads."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from leafcut.read.tool_formats import read_foreign_library
from leafcut.read.tool_kinds import cone_in_comment, tap_pitch_in_comment, tool_kind_in_comment
from leafcut.read.tool_table import read_tool_table

#: Key → the names of its column, a cell, the value that it gives, and the kind of tool that has the key.
COLUMNS: dict[str, tuple[str, str, object, str]] = {
    "number": ("number,T,tool,No.,Nr,tool number,x (tool_number)", "7", 7, "drill"),
    "kind": ("kind,Type,tool type,x (tool_type)", "reamer", "reamer", ""),
    "diameter": ("diameter,dia.,D,Ø,tool diameter,x (tool_diameter)", "5", "5 mm", "drill"),
    "name": ("name,Description,comment,Remark,x (tool_description)", "long", "long", "drill"),
    "feed": ("feed,feed rate,Cutting Feedrate,x (tool_feedCutting)", "300", "300 mm/min", "drill"),
    "plunge_feed": (
        "plunge_feed,plunge,Plunge Feedrate,plunge rate,x (tool_feedPlunge)", "90", "90 mm/min", "end-mill"
    ),
    "spindle_speed": ("spindle_speed,Speed,RPM,S,x (tool_spindleSpeed)", "900", "900 rpm", "drill"),
    "teeth": ("teeth,Flutes,number of flutes,x (tool_numberOfFlutes)", "3", 3, "end-mill"),
    "flute_length": ("flute_length,cutting length,x (tool_fluteLength)", "20", "20 mm", "drill"),
    "point_angle": ("point_angle,tip angle,angle,x (tool_tipAngle)", "118", "118 deg", "drill"),
    "taper": ("taper_angle,x (tool_taperAngle)", "22,5", "45 deg", "v-bit"),
    "corner_radius": ("corner_radius,x (tool_cornerRadius)", "1", "1 mm", "end-mill"),
    "tip_diameter": ("tip_diameter,x (tool_tipDiameter)", "0.2", "0.2 mm", "v-bit"),
    "pitch": ("pitch,thread pitch,x (tool_threadPitch)", "0.8", "0.8 mm", "tap"),
    "peck": ("peck", "2", "2 mm", "drill"),
    "dwell": ("dwell", "0.5", "0.5 s", "drill"),
    "cycle": ("cycle", "g81", "G81", "drill"),
}  # fmt: skip
CASES = [(key, name) for key, (names, *_) in COLUMNS.items() for name in names.split(",")]


@pytest.mark.parametrize(("key", "name"), CASES)
def test_a_column_of_a_table_of_tools_is_known_by_each_of_its_names(key: str, name: str) -> None:
    _, cell, value, kind = COLUMNS[key]
    cells = {"number": ("t", "7"), "kind": ("type", kind), "diameter": ("d", "8")} | {key: (name, cell)}
    text = "\n".join(";".join(column) for column in zip(*cells.values(), strict=True))
    ((tool, values),) = read_tool_table(Path("a.csv"), text.encode(), "mm")
    assert tool == "T7" and isinstance(values, dict)
    assert values["point_angle" if key == "taper" else key] == value


@pytest.mark.parametrize("head", ["unit", "Units", "x (tool_unit)"])
@pytest.mark.parametrize(
    ("word", "unit"),
    [("mm", "mm"), ("Millimeters", "mm"), ("millimetres", "mm"), ("in", "in"), ("Inch", "in"), ("inches", "in")],
)
def test_a_row_may_state_its_unit(head: str, word: str, unit: str) -> None:
    text = f"T,type,D,feed,{head}\n1,drill,4,20,{word}\n"
    assert list(read_tool_table(Path("a.csv"), text.encode(), "")) == [
        ("T1", {"number": 1, "kind": "drill", "diameter": f"4 {unit}", "feed": f"20 {unit}/min"})
    ]


@pytest.mark.parametrize("head", ["preset", "Preset Name (preset_name)"])
def test_rows_with_presets_are_presets_of_their_tool(head: str) -> None:
    text = f"T,type,D,{head}\n1,drill,4,steel\n1,drill,4,wood\n2,drill,5,\n"
    drill = {"number": 1, "kind": "drill", "diameter": "4 mm"}
    assert list(read_tool_table(Path("a.csv"), text.encode(), "mm")) == [
        ("T1", [("steel", drill), ("wood", drill)]),
        ("T2", {"number": 2, "kind": "drill", "diameter": "5 mm"}),
    ]


#: Types of Fusion and shapes of FreeCAD → kinds.
FUSION = {
    "drill": "drill", "center drill": "centre-drill", "spot drill": "centre-drill", "reamer": "reamer",
    "flat end mill": "end-mill", "bull nose end mill": "end-mill", "ball end mill": "ball-mill",
    "chamfer mill": "chamfer-mill", "slot mill": "slot-mill", "tap right hand": "tap",
}  # fmt: skip
FREECAD = {
    "drill": "drill", "endmill": "end-mill", "bullnose": "end-mill", "ballend": "ball-mill", "chamfer": "chamfer-mill",
    "v-bit": "v-bit", "vbit": "v-bit", "reamer": "reamer", "tap": "tap", "slotmill": "slot-mill",
}  # fmt: skip


def test_a_type_of_fusion_is_a_kind_in_its_library_and_in_its_table(tmp_path: Path) -> None:
    tools = [
        {"type": name.title(), "unit": "inches", "geometry": {"DC": 1}, "post-process": {"number": number}}
        for number, name in enumerate(FUSION)
    ]
    (tmp_path / "a.json").write_text(json.dumps({"data": tools}))
    (tmp_path / "a.csv").write_text("T,D,type\n" + "".join(f"{k},1,{name}\n" for k, name in enumerate(FUSION)))
    for file in ("a.json", "a.csv"):
        rows, _ = read_foreign_library(tmp_path / file, "in") or ([], False)
        kinds = [values["kind"] if isinstance(values, dict) else values for _, values in rows]
        assert kinds == list(FUSION.values()), file


@pytest.mark.parametrize("shape", FREECAD)
def test_a_shape_of_freecad_is_a_kind(shape: str, tmp_path: Path) -> None:
    (tmp_path / "a.fctb").write_text(json.dumps({"shape": f"{shape}.fcstd", "parameter": {"Diameter": "5 mm"}}))
    assert read_foreign_library(tmp_path / "a.fctb", "") == (
        [("T1", {"number": 1, "kind": FREECAD[shape], "name": "a", "diameter": "5 mm"})],
        True,
    )


#: Coarse pitches of ISO 261, mm.
COARSE = {
    "1.6": "0.35", "2": "0.4", "2.5": "0.45", "3": "0.5", "4": "0.7", "5": "0.8", "6": "1.0", "8": "1.25", "10": "1.5",
    "12": "1.75", "14": "2.0", "16": "2.0", "18": "2.5", "20": "2.5", "22": "2.5", "24": "3.0",
}  # fmt: skip


def test_a_metric_thread_without_a_pitch_is_coarse() -> None:
    assert {size: tap_pitch_in_comment(f"tap m{size}") for size in COARSE} == {
        size: f"{pitch} mm" for size, pitch in COARSE.items()
    }


@pytest.mark.parametrize(
    ("comment", "kind"),
    [
        ("centre drill", "centre-drill"), ("Center-Drill", "centre-drill"), ("spot  drill", "centre-drill"),
        ("spot 90", "centre-drill"), ("Spotting", "centre-drill"), ("center", None), ("Reamer H7", "reamer"),
        ("ream", "reamer"), ("stream", None), ("slot mill", "slot-mill"), ("Slot-Drill", "slot-mill"),
        ("slotcutter", "slot-mill"), ("router bit", "slot-mill"), ("ball nose", "ball-mill"), ("baller", None),
        ("End Mill", "end-mill"), ("endmill", "end-mill"), ("EM", "end-mill"), ("ems", None),
        ("Schaftfraeser", "end-mill"), ("DRILL 5", "drill"), ("drills", None), ("Bohrer", "drill"),
        ("5 mm HSS", "drill"), ("HSS", "drill"), ("hss 5mm", "drill"), ("hss long", None), ("2 flute", "end-mill"),
        ("4FL", "end-mill"), ("3-flutes", "end-mill"), ("0 flutes", None), ("rougher", "end-mill"),
        ("roughing 10", "end-mill"), ("rough", None), ("tap end mill", None), ("bull end mill", None),
        ("engraver 2 flute", None), ("chamfer drill", "drill"), ("mill drill", None), ("c'bore end mill", None),
        ("saw 2 flute", None), ("slitting 2 fl", None), ("form end mill", None), ("fly end mill", None),
        ("radius end mill", None), ("dovetail end mill", None), ("csk end mill", None), ("probe ball", None),
        ("thread end mill", None), ("vbit 2 flute", None), ("v-bit 2 flute", None), ("face end mill", None),
    ],
)  # fmt: skip
def test_a_comment_names_a_kind(comment: str, kind: str | None) -> None:
    assert tool_kind_in_comment(comment) == kind


@pytest.mark.parametrize(
    ("comment", "cone"),
    [
        ("Chamfer 90 deg", ("chamfer-mill", "90 deg")), ("csk 82°", ("chamfer-mill", "82 deg")),
        ("c'sink 60 degree", ("chamfer-mill", "60 deg")), ("csink 59 degrees", ("chamfer-mill", "")),
        ("Countersink", ("chamfer-mill", "")), ("mill-drill 90 deg", ("chamfer-mill", "90 deg")),
        ("chamfer 45 deg INCLUDED", ("chamfer-mill", "45 deg")), ("V-bit 30 deg", ("v-bit", "30 deg")),
        ("vbit", ("v-bit", "")), ("Engraver 10 deg", ("v-bit", "10 deg")), ("engrave 9 deg", ("v-bit", "")),
        ("drill 118 deg", None), ("csk 90 degs", ("chamfer-mill", "")),
    ],
)  # fmt: skip
def test_a_comment_names_a_cone_and_its_full_angle(comment: str, cone: tuple[str, str] | None) -> None:
    """A chamfer mill of less than 60 degrees is probably named by its half angle."""
    assert cone_in_comment(comment) == cone


@pytest.mark.parametrize(
    ("comment", "pitch"),
    [
        ("Tap", ""), ("taps M6", None), ("drill for tap", None), ("tap LH M6", None), ("left tap", None),
        ("tap mill", None), ("tap 1/4-20", "1.270000 mm"), ("tap #4-40", "0.635000 mm"), ("tap #8 - 32", "0.793750 mm"),
        ("tap M6x0.75", "0.75 mm"), ("tap m10 × 1.25", "1.25 mm"), ("tap M8-1", "1 mm"), ("tap M8 * .5", ".5 mm"),
        ("tap M7", ""), ("tap M100", ""), ("tap M6/2", ""), ("tap 3/8-4", ""),
    ],
)  # fmt: skip
def test_a_comment_names_a_tap_and_its_pitch(comment: str, pitch: str | None) -> None:
    assert tap_pitch_in_comment(comment) == pitch
