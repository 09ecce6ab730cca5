"""Tool libraries of other programs written as one of leafcut's own: the same tools when they are read again."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

import leafcut
from leafcut.errors import DataError, OptionError
from leafcut.model.tool import ToolKind
from leafcut.read.tool_text import convert_library_to_toml
from leafcut.read.tools import load_tools

TABLE = """Tool;Type;Ø [mm];Description;Feed (mm/min);RPM;Flutes;Tip angle
1;drill;3,2;HSS;120;3000;2;118
T2;end mill;6;2 flute;600;12000;2;0
3;;10 mm;spot drill 90;100;2000;;90
4;tapping head;6;;;;;
5;drill;0,125 in;inch;100;900;;
"""
FUSION = """\
"Type (tool_type)","Number (tool_number)","Description (tool_description)","Diameter (tool_diameter)",\
"Unit (tool_unit)","Corner Radius (tool_cornerRadius)","Number of Flutes (tool_numberOfFlutes)",\
"Cutting Feedrate (tool_feedCutting)","Plunge Feedrate (tool_feedPlunge)","Spindle Speed (tool_spindleSpeed)",\
"Taper Angle (tool_taperAngle)","Thread Pitch (tool_threadPitch)","Tip Diameter (tool_tipDiameter)"
"flat end mill","1","quarter inch","0.25","inches","0","3","40","10","15000","0","0","0"
"bull nose end mill","2","bull","8","millimeters","1","4","900","300","12000","0","0","0"
"chamfer mill","3","90 deg","10","millimeters","0","2","500","200","10000","45","0","0.2"
"drill","4","M5 core","4.2","millimeters","0","2","100","90","2500","0","0","0"
"tap right hand","5","M5","5","millimeters","0","1","400","400","500","0","0.8","0"
"probe","6","touch","2","millimeters","0","0","0","0","0","0","0","0"
"""
LINUXCNC = "T1 P1 D3.0 Z-10 ;3 mm drill\nT2 P2 D6.0 ;6 mm end mill, 2 flutes\nT9 P9 D5 ;probe\n"
FUSION_JSON = {
    "data": [
        {"type": "flat end mill", "unit": "millimeters", "description": "6 flat", "post-process": {"number": 7},
         "geometry": {"DC": 6.0, "LCF": 18.0, "NOF": 2},
         "start-values": {"presets": [{"n": 10000, "v_f": 600, "v_f_plunge": 200}]}},
    ],
    "version": 36,
}  # fmt: skip
FREECAD = {
    "shape": "drill.fcstd",
    "name": "Drill 5",
    "parameter": {"Diameter": "5.00 mm", "TipAngle": "118.00 °", "Flutes": "2"},
}
FILES = {
    "shop.csv": TABLE,
    "fusion.csv": FUSION,
    "tool.tbl": LINUXCNC,
    "library.json": json.dumps(FUSION_JSON),
    "drill.fctb": json.dumps(FREECAD),
}


@pytest.mark.parametrize("name", FILES)
def test_a_library_is_read_again_with_the_same_tools(name: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_text(FILES[name], encoding="utf-8")
    text, library = convert_library_to_toml(str(file), "mm")
    out = tmp_path / f"{name}.toml"
    out.write_text(text, encoding="utf-8")
    again = load_tools(out)
    assert again.tools == library.tools == load_tools(file).tools and again.tools
    assert all(f"# left out: {line}" in text for line in library.left_out)
    assert ("has no feeds" in text) is library.without_feeds is (name in ("tool.tbl", "drill.fctb"))


def test_a_table_of_ones_own_has_units_in_its_cells_and_in_its_head(tmp_path: Path) -> None:
    (tmp_path / "shop.csv").write_text(TABLE, encoding="utf-8")
    library = load_tools(tmp_path / "shop.csv")
    one, two, three, five = library.tools
    assert (one.kind, one.diameter, one.feed, one.spindle_rpm) == (ToolKind.DRILL, 3.2, 2.0, 3000)
    assert one.point_angle == pytest.approx(math.radians(118))
    assert (two.kind, two.diameter, two.teeth, two.point_angle) == (ToolKind.END_MILL, 6.0, 2, math.pi)
    assert (three.kind, three.diameter, three.number) == (ToolKind.CENTRE_DRILL, 10.0, 3)
    assert five.diameter == pytest.approx(3.175)
    assert library.left_out == ("T4: 'tapping head' is not a kind of tool",)


def test_a_table_of_fusion_has_the_unit_of_each_tool(tmp_path: Path) -> None:
    """Feeds are in the tool's unit a minute; a drill goes down at its plunge rate; 45° of a side is a cone of 90°."""
    (tmp_path / "fusion.csv").write_text(FUSION, encoding="utf-8")
    flat, bull, chamfer, drill, tap = load_tools(tmp_path / "fusion.csv").tools
    assert flat.diameter == pytest.approx(6.35) and flat.feed == pytest.approx(40 * 25.4 / 60)
    assert (bull.corner_radius, bull.teeth, bull.plunge_feed) == (1.0, 4, 5.0)
    assert chamfer.point_angle == pytest.approx(math.pi / 2) and chamfer.tip_diameter == 0.2
    assert (drill.feed, drill.diameter) == (1.5, 4.2)
    assert tap.pitch == 0.8 and tap.feed == pytest.approx(0.8 * 500 / 60)


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("tool.tbl", "T1 P1 D0.25 ;drill\n", "does not state its unit; give it with --units"),
        ("a.csv", "T,D,kind\n1,0.25,drill\n", "line 2: 'diameter' has no unit; give it with --units"),
        ("a.csv", "T,D [in],kind,feed\n1,0.25,drill,4\n", "line 2: 'feed' has no unit"),
    ],
)
def test_an_import_does_not_guess_the_unit_of_a_library(name: str, text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(OptionError, match=re.escape(words)):
        convert_library_to_toml(str(tmp_path / name))
    assert convert_library_to_toml(str(tmp_path / name), "in")[1].tools[0].diameter == pytest.approx(6.35)


def with_presets(folder: Path, name: str, *presets: tuple[str, int]) -> Path:
    """Write a Fusion library with a drill of 5 mm that has one preset per name and speed; feeds are a tenth of it."""
    file = folder / name
    if name.endswith(".csv"):
        head = "Number (tool_number),Type (tool_type),Diameter (tool_diameter),Unit (tool_unit),"
        head += "Preset Name (preset_name),Plunge Feedrate (tool_feedPlunge),Spindle Speed (tool_spindleSpeed)\n"
        rows = [f"7,drill,5,millimeters,{preset},{n / 10},{n}\n" for preset, n in presets]
        file.write_text(head + "".join(rows))
    else:
        tool = {
            "type": "drill", "unit": "millimeters", "post-process": {"number": 7}, "geometry": {"DC": 5.0},
            "start-values": {"presets": [{"name": p, "n": n, "v_f": n / 10} for p, n in presets]},
        }  # fmt: skip
        file.write_text(json.dumps({"data": [tool]}))
    return file


@pytest.mark.hazard
@pytest.mark.parametrize("name", ["library.json", "fusion.csv"])
def test_the_material_chooses_the_preset_of_a_fusion_tool(name: str, tmp_path: Path) -> None:
    presets = (("Softwood", 15000), ("Steel", 1500), ("Stainless steel", 900), ("Aluminum roughing", 6000))
    file = with_presets(tmp_path, name, *presets)
    for material, speed in (
        ("softwood", 15000),
        ("steel", 1500),
        ("steel-c45", 1500),
        ("stainless_steel", 900),
        ("aluminium", 6000),
    ):
        (tool,) = load_tools(file, material=material).tools
        assert (tool.spindle_rpm, tool.feed) == (speed, pytest.approx(speed / 600)), material
    assert "15000" in convert_library_to_toml(str(file), material="softwood")[0]
    for material in ("", "brass", "stainless-304"):
        with pytest.raises(DataError, match="name one with --material: 'Softwood', 'Steel', 'Stainless steel'"):
            load_tools(file, material=material)


@pytest.mark.parametrize("name", ["library.json", "fusion.csv"])
def test_equal_presets_and_single_presets_need_no_material(name: str, tmp_path: Path) -> None:
    for presets in ([("Wood", 9000), ("Plastic", 9000)], [("Wood", 9000)]):
        assert load_tools(with_presets(tmp_path, name, *presets)).tools[0].spindle_rpm == 9000


@pytest.mark.hazard
@pytest.mark.parametrize("name", ["library.json", "fusion.csv"])
def test_a_single_preset_of_another_material_is_not_used(name: str, tmp_path: Path) -> None:
    """A preset that names no material has the feeds of the shop, whatever it cuts."""
    for preset, fits in (
        ("Softwood", False),
        ("Stainless steel", False),
        ("Mild steel", True),
        ("Steel", True),
        ("HDPE sheet", False),
        ("Delrin", False),
        ("Preset 1", True),
        ("", True),
    ):
        file = with_presets(tmp_path, name, (preset, 9000))
        if fits:
            assert load_tools(file, material="mild_steel").tools[0].spindle_rpm == 9000, preset
        else:
            with pytest.raises(DataError, match=f"no single preset for 'mild_steel'; name one .*: '{preset}'"):
                load_tools(file, material="mild_steel")
        assert load_tools(file).tools[0].spindle_rpm == 9000


def test_drilling_obeys_or_refuses_the_material(tmp_path: Path) -> None:
    library = with_presets(tmp_path, "library.json", ("Softwood", 15000), ("Steel", 1500))
    plate = tmp_path / "plate.csv"
    plate.write_text("x,y,d\n10,10,5\n20,10,5\n")
    given = {"thickness": 6, "machine": "linuxcnc-mill", "time_limit": 1}
    text = leafcut.optimize(plate, tools=library, material="steel", **given).text
    assert "S1500" in text and "F150" in text
    own = tmp_path / "own.toml"
    own.write_text("[[tool]]\nnumber = 1\ndiameter = 5\nfeed = 100\nspindle_speed = 2000\n")
    with pytest.raises(OptionError, match="--material selects the presets of a Fusion tool library"):
        leafcut.optimize(plate, tools=own, material="steel", **given)
    with pytest.raises(OptionError, match="--material: only used with --tools"):
        leafcut.optimize(plate, material="steel", **given)


def test_fusion_libraries_of_2016_keep_feeds_in_a_single_preset(tmp_path: Path) -> None:
    tool = {
        "type": "drill", "unit": "millimeters", "post-process": {"number": 7}, "geometry": {"DC": 5.0},
        "start-values": {"*": {"n": 2000, "v_f": 300, "v_f_plunge": 240}},
    }  # fmt: skip
    (tmp_path / "old.json").write_text(json.dumps({"data": [tool]}))
    (drill,) = load_tools(tmp_path / "old.json").tools
    assert (drill.spindle_rpm, drill.feed) == (2000, 4.0)


def test_a_comma_in_a_freecad_tool_is_a_decimal_point(tmp_path: Path) -> None:
    bit = {"shape": "drill.fcstd", "parameter": {"Diameter": "3,175 mm", "TipAngle": "118,00 °"}}
    (tmp_path / "drill.fctb").write_text(json.dumps(bit))
    assert load_tools(tmp_path / "drill.fctb").tools[0].diameter == 3.175


def test_lengths_without_a_unit_are_those_that_are_said(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("T,D,kind\n1,0.5,drill\n")
    assert load_tools(tmp_path / "a.csv", "in").tools[0].diameter == pytest.approx(12.7)
    assert "0.5 in" in convert_library_to_toml(str(tmp_path / "a.csv"), "in")[0]


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.csv", b"a,b\n1,2\n", "no column is called number or diameter"),
        ("a.csv", b"T,kind\n1,drill\n", "no column is called diameter"),
        ("a.csv", b"T,D,kind\nx,1,drill\n", "no tool of this library can be used: line 2: the tool number 'X'"),
        ("a.csv", b"T,D,kind\n1,-1,drill\n", "'diameter' is -1 mm, but must be above 0"),
        ("a.csv", b"T,D,kind\n1,0,drill\n", "the key 'diameter' is missing"),
        ("a.csv", b"T,D,kind,unit\n1,1,drill,furlong\n", "the unit 'furlong' is not mm or in"),
        ("a.csv", b"\0\0", "is a binary file"),
        ("a.csv", b"T,D\n" + b"1,1\n" * 10_001, "has more than 10000 rows"),
        ("a.csv", b"x" * (17 << 20), "a tool library of 17 MiB"),
        ("a.csv", b"", "no column is called"),
        ("a.toml", b"", "is a library of leafcut's own; leafcut imports .csv"),
        ("a.txt", b"", "not a tool library; leafcut imports"),
        ("none.csv", None, "file not found"),
    ],
)
def test_what_is_no_library_is_refused_in_one_line(name: str, data: bytes | None, words: str, tmp_path: Path) -> None:
    if data is not None:
        (tmp_path / name).write_bytes(data)
    with pytest.raises(OptionError) as caught:
        convert_library_to_toml(str(tmp_path / name), "mm")
    assert words in str(caught.value) and "\n" not in str(caught.value)


def test_the_first_of_two_tools_with_one_number_is_taken_and_empty_rows_are_skipped(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("T,D,kind,cycle\n1,4,drill,g81\n,,,\n1,5,drill,g81\n2,6,drill,\n")
    library = load_tools(tmp_path / "a.csv", "mm")
    assert [(tool.number, tool.diameter, tool.cycle) for tool in library.tools] == [(1, 4.0, "G81"), (2, 6.0, None)]
    (line,) = library.left_out
    assert "another tool has the same number" in line
