"""Tool libraries of LinuxCNC, Fusion and FreeCAD are accepted everywhere; unusable tools are reported."""

from __future__ import annotations

import json
import math
import zipfile
from contextlib import suppress
from pathlib import Path

import pytest

from leafcut import api
from leafcut.errors import OptionError
from leafcut.model.cutter import ball_mill, bull_mill, cutter_of_tool, pointed_cutter
from leafcut.model.tool import ToolKind
from leafcut.read.tools import load_tools

TABLE = """T1 P1 D0.125000 Z+0.511000 ;1/8 end mill
T2 P2 D0.201 Z+1.273 ;#7 drill
T3 P3 D0.25 ;1/4 fly cutter
T4 P4 Z+0.1 ;big drill
T5 P5 D.5

"""
FUSION = {
    "version": 36,
    "data": [
        {
            "type": "drill", "unit": "inches", "description": "1/4 drill",
            "geometry": {"DC": 0.25, "SIG": 135, "LCF": 2.0, "NOF": 2}, "post-process": {"number": 7},
            "start-values": {"presets": [{"n": 3000, "v_f": 12.0, "v_f_plunge": 6.0}]},
        },
        {
            "type": "flat end mill", "unit": "millimeters", "description": "6 mm flat", "post-process": {"number": 8},
            "geometry": {"DC": 6.0, "LCF": 20, "NOF": 3},
            "start-values": {"presets": [{"n": 12000, "v_f": 900.0, "v_f_plunge": 300.0}]},
        },
        {"type": "dovetail mill", "unit": "millimeters", "geometry": {"DC": 3}, "post-process": {"number": 9}},
    ],
}  # fmt: skip


def test_linuxcnc_tables_have_the_units_of_the_machine_and_kinds_in_their_comments(tmp_path: Path) -> None:
    file = tmp_path / "tool.tbl"
    file.write_text(TABLE)
    inch, mm = load_tools(file, "in"), load_tools(file)
    assert [(t.number, t.kind) for t in inch.tools] == [(1, ToolKind.END_MILL), (2, ToolKind.DRILL)]
    assert [t.diameter for t in inch.tools] == pytest.approx([3.175, 5.1054])
    assert mm.by_number[2].diameter == pytest.approx(0.201)
    assert [line.split(":")[0] for line in inch.left_out] == ["T3", "T4", "T5"]


@pytest.mark.parametrize(
    ("comment", "kind"),
    [
        ("1/2 2fl long em", "end-mill"),
        ("EM 6mm", "end-mill"),
        ("3/8 4fl carbide", "end-mill"),
        ("3/4 roughing", "end-mill"),
        ("16 mm Schaftfräser", "end-mill"),
        ("2 flute drill", "drill"),
        ("Bohrer poliert", "drill"),
        ("5.0 hss", "drill"),
        ("HSS 1/4 in", "drill"),
        ("#7 tap drill", "drill"),
        ("hss end mill", "end-mill"),
        ("hss 1/4 ball", "ball-mill"),
        ("2-1/4 face mill", None),
        ("demo zero diameter", None),
        ("spotting hss", "centre-drill"),
        ("6mm ball 2 flute", "ball-mill"),
        *((f"{word} 4 flute", None) for word in ("keyseat cutter", "Woodruff", "t-slot", "counterbore", "lollipop")),
        *((f"{word} 2 fl", None) for word in ("vee cutter 60 deg", "corner radius R1", "taper", "step", "dovetail")),
    ],
)
def test_kinds_are_understood_as_shops_write_them_in_a_linuxcnc_table(
    comment: str, kind: str | None, tmp_path: Path
) -> None:
    """Comments of LinuxCNC's sample configurations, and of shops."""
    (tmp_path / "tool.tbl").write_text(f"T1 P1 D5 ;{comment}\nT2 P2 D3 ;drill\n", encoding="utf-8")
    library = load_tools(tmp_path / "tool.tbl")
    assert (library.by_number[1].kind.value if 1 in library.by_number else None) == kind


@pytest.mark.parametrize(
    ("comment", "pitch"),
    [
        ("M6 tap", 1.0), ("tap M5", 0.8), ("TAP M8", 1.25), ("M2.5 spiral flute tap", 0.45), ("M6x0.75 tap", 0.75),
        ("M8 x 1 form tap", 1.0), ("1/4-20 tap", 1.27), ("#10-32 tap UNF", 25.4 / 32),
        ("tap", None), ("M7 tap", None), ("M5 tap LH", None), ("5 mm tap", None), ("M6 thread mill tap", None),
        ("3/8-4 flute tap", None),
    ],
)  # fmt: skip
def test_a_tap_of_a_linuxcnc_table_has_the_pitch_of_its_thread(
    comment: str, pitch: float | None, tmp_path: Path
) -> None:
    """A metric thread without a pitch is coarse; a number after an inch size is in threads per inch."""
    (tmp_path / "tool.tbl").write_text(f"T1 P1 D8 ;{comment}\nT2 P2 D3 ;drill\n")
    library = load_tools(tmp_path / "tool.tbl", "mm")
    if pitch is None:
        assert [tool.number for tool in library.tools] == [2]
    else:
        assert (library.by_number[1].kind, library.by_number[1].pitch) == (ToolKind.TAP, pytest.approx(pitch, abs=1e-5))


def test_a_row_without_a_comment_says_that_the_comment_is_missing(tmp_path: Path) -> None:
    (tmp_path / "tool.tbl").write_text("T11 D5\nT2 D3 ;drill\nT12 D5 ;tap\n")
    assert load_tools(tmp_path / "tool.tbl", "mm").left_out == (
        "T11: the tool has no comment that names its kind, such as drill or end mill",
        "T12: the comment 'tap' does not state the pitch of the thread, such as M6x1 or 1/4-20",
    )


@pytest.mark.parametrize("comment", ["C'sink 82 deg", "82° csk", "chamfer mill 82deg", "82 degree mill-drill"])
def test_a_countersink_of_a_linuxcnc_table_needs_its_angle(comment: str, tmp_path: Path) -> None:
    (tmp_path / "tool.tbl").write_text(f"T1 D12 ;{comment}\nT2 D12 ;c'sink\nT3 D3 ;60 deg V-bit\n", encoding="utf-8")
    library = load_tools(tmp_path / "tool.tbl")
    assert library.by_number[1].kind is ToolKind.CHAMFER_MILL
    assert library.by_number[1].point_angle == pytest.approx(math.radians(82))
    assert library.by_number[3].kind is ToolKind.V_BIT
    (tmp_path / "one.tbl").write_text("T1 D12 ;45 deg chamfer mill\nT2 D12 ;45 deg included chamfer mill\n")
    assert [tool.number for tool in load_tools(tmp_path / "one.tbl").tools] == [2]  # 45 degrees per side, or in total?
    assert library.left_out == ("T2: the comment 'c'sink' does not state the full angle of the cone, such as 90 deg",)


@pytest.mark.parametrize("name", ["shop.json", "shop.tools"])
def test_fusion_says_units_feeds_and_numbers_of_every_tool(name: str, tmp_path: Path) -> None:
    file = tmp_path / name
    if name.endswith(".tools"):
        with zipfile.ZipFile(file, "w") as packed:
            packed.writestr("tools.json", json.dumps(FUSION))
    else:
        file.write_text(json.dumps(FUSION))
    library = load_tools(file)
    drill, mill = library.by_number[7], library.by_number[8]
    assert (drill.diameter, drill.flute_length) == pytest.approx((6.35, 50.8))
    assert (drill.feed, drill.spindle_rpm) == pytest.approx((6.0 * 25.4 / 60.0, 3000.0))  # down, not across
    assert drill.point_angle == pytest.approx(math.radians(135))
    assert (mill.feed, mill.plunge_feed, mill.teeth) == (15.0, 5.0, 3)
    assert library.left_out == ("T9: leafcut has no tool of type 'dovetail mill'",)


@pytest.mark.parametrize("how", [zipfile.ZIP_DEFLATED, zipfile.ZIP_LZMA, zipfile.ZIP_BZIP2])
def test_a_damaged_zip_is_no_library_wherever_it_is_damaged(how: int, tmp_path: Path) -> None:
    file = tmp_path / "shop.tools"
    with zipfile.ZipFile(file, "w", how) as packed:
        packed.writestr("tools.json", json.dumps(FUSION))
    whole = file.read_bytes()
    for at in range(0, len(whole), 7):
        file.write_bytes(whole[:at] + bytes(255 - b for b in whole[at : at + 5]) + whole[at + 5 :])
        with suppress(OptionError):
            load_tools(file)


def test_a_freecad_library_finds_its_bits_beside_it_or_in_its_folder(tmp_path: Path) -> None:
    (tmp_path / "Library").mkdir()
    (tmp_path / "Bit").mkdir()
    tools = [{"nr": 1, "path": "5mm_Drill.fctb"}, {"nr": 2, "path": "old.fctb"}, {"nr": 3, "path": "gone.fctb"}]
    (tmp_path / "Library" / "Default.fctl").write_text(json.dumps({"version": 1, "tools": tools}))
    drill = {"Diameter": "5.0000 mm", "TipAngle": "119.0000 °", "Length": "50.0000 mm"}
    bit = {"version": 2, "name": "5mm Drill", "shape": "drill.fcstd", "parameter": drill, "attribute": {}}
    (tmp_path / "Bit" / "5mm_Drill.fctb").write_text(json.dumps(bit))
    (tmp_path / "Library" / "old.fctb").write_text(json.dumps({**bit, "shape": "probe.fcstd"}))
    library = load_tools(tmp_path / "Library" / "Default.fctl")
    assert [(t.number, t.diameter, t.name) for t in library.tools] == [(1, 5.0, "5mm Drill")]
    assert library.tools[0].point_angle == pytest.approx(math.radians(119))
    assert [line.split(":")[0] for line in library.left_out] == ["T2", "T3"]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.tbl", "1 2 3\n", "line 1: '1 2 3' is not a line of a LinuxCNC tool table"),
        ("a.tbl", "T1 P1 D3 ;dovetail\n", "no tool of this library can be used: T1: the comment 'dovetail'"),
        ("a.json", "{", "not valid JSON"),
        ("a.json", "{}", "is not a tool library of Fusion"),
        ("a.json", '{"data": [7]}', "no tool of this library can be used: tool 1: the entry is not a Fusion tool"),
        ("a.json", '{"data": [{"type": "saw"}]}', "tool 1: leafcut has no tool of type 'saw'"),
        ("a.json", '{"data": [{"unit": "millimeters"}]}', "tool 1: the tool has no type"),
        ("a.json", '{"data": [{"type": "drill"}]}', "tool 1: the tool has no unit"),
        (
            "a.json",
            '{"data": [{"type": "drill", "unit": "ells", "post-process": {"number": 4}}]}',
            "T4: the unit 'ells' is not millimeters or inches",
        ),
        ("a.fctl", '{"tools": [{"nr": "1"}]}', "tool 1: the tool has no number or no file"),
        ("a.tools", "{}", "a zip file with a .json was expected"),
        ("a.fctl", "[]", "is not a tool library of FreeCAD"),
    ],
)
def test_what_is_no_library_is_refused_in_one_line(name: str, text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(OptionError, match=words):
        load_tools(tmp_path / name)


def test_drills_of_a_table_without_feeds_drill_with_assumed_ones_that_are_told(tmp_path: Path) -> None:
    (tmp_path / "holes.csv").write_text("x,y,d\n0,0,5.1054\n10,0,5.1054\n")
    (tmp_path / "tool.tbl").write_text(TABLE.replace("0.201", "5.1054"))
    found = api.optimize(tmp_path / "holes.csv", depth=2, tools=tmp_path / "tool.tbl", iterations=1)
    assert "T2 M6" in found.text
    said = {i.code: i.message for i in found.issues}
    assert "the tool library states no feeds, so leafcut assumes" in said["L401"]
    assert "T3: the comment" in said["L407"]


def test_mills_that_are_not_flat_have_their_shape(tmp_path: Path) -> None:
    """A bull nose, a ball and a chamfer mill; Fusion states the taper per side, FreeCAD the full angle."""
    kinds = (
        ("bull nose end mill", {"DC": 8, "RE": 1}),
        ("ball end mill", {"DC": 6, "RE": 3}),
        ("chamfer mill", {"DC": 10, "TA": 45, "tip-diameter": 2}),
    )
    tools = [
        {"type": kind, "unit": "millimeters", "geometry": geometry, "post-process": {"number": number}}
        for number, (kind, geometry) in enumerate(kinds, 1)
    ]
    (tmp_path / "a.json").write_text(json.dumps({"data": tools}))
    bits = (
        ("bullnose", {"Diameter": "8 mm", "FlatRadius": "1 mm"}),
        ("ballend", {"Diameter": "6 mm"}),
        ("chamfer", {"Diameter": "10 mm", "CuttingEdgeAngle": "90.0 °", "TipDiameter": "2 mm"}),
    )
    for shape, values in bits:
        (tmp_path / f"{shape}.fctb").write_text(json.dumps({"shape": f"{shape}.fcstd", "parameter": values}))
    paths = [{"nr": number, "path": f"{shape}.fctb"} for number, (shape, _) in enumerate(bits, 1)]
    (tmp_path / "a.fctl").write_text(json.dumps({"tools": paths}))
    shapes = (bull_mill(8.0, 1.0), ball_mill(6.0), pointed_cutter(10.0, math.radians(90), 2.0))
    for name in ("a.json", "a.fctl"):
        assert tuple(map(cutter_of_tool, load_tools(tmp_path / name).tools)) == shapes
    (tmp_path / "a.tbl").write_text("T4 P4 D6 ;6mm ball nose\n")
    assert cutter_of_tool(load_tools(tmp_path / "a.tbl").tools[0]) == ball_mill(6.0)


def test_fusion_says_what_is_above_the_flutes_from_below_the_holder_in_its_own_unit(tmp_path: Path) -> None:
    """Flutes of 10, a neck of 2.8 up to the shoulder at 14, a cone of 3 to the shank of 6, out of the holder by 40."""
    tool = {
        "type": "ball end mill", "unit": "millimeters", "post-process": {"number": 4},
        "geometry": {"DC": 3.0, "LCF": 10, "shoulder-length": 14, "shoulder-diameter": 2.8, "SFDM": 6, "LB": 40},
        "shaft": {"segments": [{"height": 3, "lower-diameter": 2.8, "upper-diameter": 6}]},
        "holder": {
            "unit": "inches",
            "segments": [
                {"height": 0.2, "lower-diameter": 0.5, "upper-diameter": 1.0},
                {"height": 2, "lower-diameter": 1.0, "upper-diameter": 1.0},
            ],
        },
    }  # fmt: skip
    file = tmp_path / "shop.json"
    file.write_text(json.dumps({"data": [tool]}))
    (read,) = load_tools(file).tools
    assert (read.flute_length, read.shank_diameter, read.stickout) == pytest.approx((10.0, 6.0, 40.0))
    assert read.shaft == (pytest.approx((4.0, 2.8, 2.8)), pytest.approx((3.0, 2.8, 6.0)))
    assert read.holder == (pytest.approx((5.08, 12.7, 25.4)), pytest.approx((50.8, 25.4, 25.4)))


@pytest.mark.parametrize(
    "broken",
    [
        {"holder": {"segments": [{"height": 1, "lower-diameter": 2}]}},
        {"holder": {"segments": [{"height": 0, "lower-diameter": 2, "upper-diameter": 2}]}},
        {"holder": {"segments": "none"}, "shaft": []},
        {"holder": [], "shaft": {"segments": [3, None]}},
    ],
)
def test_a_holder_that_is_none_leaves_its_tool_without_one(broken: dict[str, object], tmp_path: Path) -> None:
    geometry = {"DC": 3.0, "LCF": 10, "SFDM": True, "LB": 1e400}
    tool = {"type": "flat end mill", "unit": "millimeters", "geometry": geometry, "post-process": {"number": 4}}
    file = tmp_path / "shop.json"
    file.write_text(json.dumps({"data": [{**tool, **broken}]}))
    (read,) = load_tools(file).tools
    assert (read.shank_diameter, read.stickout, read.shaft, read.holder) == (None, None, (), ())


def test_freecad_says_the_shank_of_a_tool_with_its_flutes(tmp_path: Path) -> None:
    bit = {"shape": "endmill.fcstd", "parameter": {
        "Diameter": "3.00 mm", "CuttingEdgeHeight": "8.00 mm", "ShankDiameter": "6.00 mm"}}  # fmt: skip
    (tmp_path / "mill.fctb").write_text(json.dumps(bit))
    (read,) = load_tools(tmp_path / "mill.fctb").tools
    assert (read.flute_length, read.shank_diameter) == pytest.approx((8.0, 6.0))
