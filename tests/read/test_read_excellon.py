"""Excellon: dialects, units, number formats, slots, and what cannot be read with certainty."""

from __future__ import annotations

import re

import pytest

from leafcut.errors import ReadError
from leafcut.options import ReadOptions
from leafcut.read import Match, excellon, formats, read, registry
from leafcut.read.format import Source
from leafcut.read.recognition import sniff_excellon

KICAD = """M48
; DRILL file {KiCad 6.0.11} date Sat
; FORMAT={-:-/ absolute / metric / decimal}
; #@! TF.GenerationSoftware,Kicad,Pcbnew,6.0.11
FMAT,2
METRIC
T1C0.300
T2C1.500
%
G90
G05
T1
X142.29Y-100.25
X142.29Y-102.25
T2
G00X148.75Y-109.25
M15
G01X151.25Y-109.25
M16
G05
T0
M30
"""
ALTIUM = """M48
;Layer_Color=9474304
;FILE_FORMAT=4:4
METRIC,LZ
;TYPE=PLATED
T1F00S00C0.5000
;TYPE=NON_PLATED
T2F00S00C1.2000
%
T01
X0012Y0034
X00125Y0034
T02
Y005
M30
"""
EAGLE = """%
M48
M72
T01C0.0236
T02C0.0400
%
T01
X5000Y10000
X-2500Y10000
T02
X12500Y500
M30
"""


def holes(part):
    return [(h.x, h.y, h.diameter, h.layer) for h in part.holes]


def codes(part):
    return sorted(i.code for i in part.issues)


def body(text, head="METRIC\nT1C1.0\n"):
    return f"M48\n{head}%\nT1\n{text}\nM30\n"


def test_a_kicad_file_gives_holes_by_tool_and_its_routed_slot(text_file):
    part = read(text_file("k.drl", KICAD))
    assert holes(part) == [(142.29, -100.25, 0.3, "T1"), (142.29, -102.25, 0.3, "T1")]
    (slot,) = part.slots
    assert (slot.start, slot.end, slot.width, slot.layer) == ((148.75, -109.25), (151.25, -109.25), 1.5, "T2")
    assert not part.issues


def test_an_altium_file_keeps_leading_zeros_in_the_format_that_it_names(text_file):
    """By hand: 4:4 with trailing zeros left out, 0012 is 0012.0000 mm and 00125 is 0012.5000 mm; modal x."""
    part = read(text_file("a.txt", ALTIUM))
    assert holes(part) == [(12, 34, 0.5, "T1"), (12.5, 34, 0.5, "T1"), (12.5, 50, 1.2, "T2")]
    assert not part.issues


def test_an_eagle_file_in_inch_without_points_is_read_as_two_and_four_digits(text_file):
    """By hand: 5000 is 0.5000 in = 12.7 mm."""
    part = read(text_file("e.drd", EAGLE))
    assert holes(part) == [(12.7, 25.4, 0.59944, "T1"), (-6.35, 25.4, 0.59944, "T1"), (31.75, 1.27, 1.016, "T2")]
    assert codes(part) == ["L102"]
    assert part.units == "in"


def test_metric_without_points_is_read_as_three_and_three_digits_and_reported(text_file):
    part = read(text_file("m.drl", body("X5000Y10000\nX-2500", "METRIC,TZ\nT1C1.0\n")))
    assert holes(part) == [(5, 10, 1, "T1"), (-2.5, 10, 1, "T1")]
    assert "000.000" in part.issues[0].message
    assert codes(part) == ["L102"]


def test_the_format_of_an_old_kicad_comment_is_used(text_file):
    head = ";FORMAT={4:2/ absolute / metric / suppress leading zeros}\nMETRIC,TZ\nT1C1.0\n"
    part = read(text_file("m.drl", body("X500Y1000", head)))
    assert holes(part) == [(5, 10, 1, "T1")]
    assert not part.issues


def test_g85_slots_are_slots_and_repeats_are_holes(text_file):
    part = read(text_file("g.drl", body("X1.0Y2.0\nX10.0Y0.0G85X14.0Y3.0\nX20.0Y0.0\nR3X2.5")))
    assert holes(part) == [(x, y, 1, "T1") for x, y in ((1, 2), (20, 0), (22.5, 0), (25, 0), (27.5, 0))]
    assert [(s.start, s.end) for s in part.slots] == [((10, 0), (14, 3))]


def test_a_route_of_several_lines_is_a_chain_of_slots_and_one_without_length_a_hole(text_file):
    route = "G00X0.0Y0.0\nM15\nG01X5.0\nG01Y5.0\nM16\nG05\nG00X9.0Y9.0\nM15\nG01X9.0Y9.0\nM16\nG05"
    part = read(text_file("r.drl", body(route)))
    assert [(s.start, s.end) for s in part.slots] == [((0, 0), (5, 0)), ((5, 0), (5, 5))]
    assert holes(part) == [(9, 9, 1, "T1")]


def test_feeds_and_speeds_of_a_machines_own_file_do_not_redefine_a_tool(text_file):
    text = body("X1.0Y1.0\nT2F200S65\nX2.0Y2.0\nT3C.125\nX3.0Y3.0", "INCH\nT1C.04F200S65\nT2C.06\n")
    part = read(text_file("f.drl", text))
    assert [(h.diameter, h.layer) for h in part.holes] == [(1.016, "T1"), (1.524, "T2"), (3.175, "T3")]


def test_units_and_tools_can_be_chosen(text_file):
    path = text_file("k.drl", KICAD)
    assert holes(read(path, ReadOptions(layers=("t1",), units="in")))[0] == (3614.166, -2546.35, 7.62, "T1")
    assert len(read(path, ReadOptions(layers=("T2",))).slots) == 1
    with pytest.raises(ReadError, match=r"no holes.*tools: T1, T2"):
        read(path, ReadOptions(layers=("T9",)))


def test_without_units_mm_are_assumed_and_reported(text_file):
    part = read(text_file("u.drl", body("X1.0Y2.0", "T1C1.0\n")))
    assert holes(part) == [(1, 2, 1, "T1")]
    assert codes(part) == ["L102"]


def test_a_doubled_hit_is_drilled_once(text_file):
    part = read(text_file("d.drl", body("X1.0Y2.0\nX5.0Y5.0\nX1.0Y2.0")))
    assert len(part.holes) == 2
    assert codes(part) == ["L301"]


@pytest.mark.parametrize(
    "text, line, words",
    [
        (body("X1.0Y1.0\nWHAT"), 7, "unknown Excellon command; export only drills"),
        (body("R,T\nX1.0Y1.0"), 6, "unknown Excellon command; export only drills"),
        (body("G93X1.0Y0\nX1.0Y1.0"), 6, "moves the origin"),
        (body("X1.0Y1.0\nT7\nX2.0Y2.0"), 7, "Undefined tool"),
        (body("X1.0Y1.0\nG85X2.0Y2.0"), 7, "needs a start and an end"),
        (body("X1.0Y1.0\nG02X2.0Y2.0A1.0"), 7, "routed arc"),
        (body("X1000Y1000", "T1C1.0\n"), 5, "no decimal point"),
        ("M48\nMETRIC\nT1C1.0\n%\nX1.0Y1.0\nM30\n", 5, "before any tool is selected"),
        (body("X1.0Y1.0\nM30\nX2.0Y1.0"), 8, "before any tool is selected"),
        (body("X" + "1" * 300), 6, "not an Excellon command"),
        (body("R999999999X1.0"), None, "repeats (R) expand to more than 100,0"),
        (body(""), None, "no holes"),
    ],
)
def test_what_cannot_be_read_with_certainty_is_refused_with_its_line(text_file, text, line, words):
    path = text_file("bad.drl", text)
    with pytest.raises(ReadError, match=re.escape(words)) as caught:
        read(path)
    assert caught.value.line == line
    assert "\n" not in str(caught.value)


def test_a_file_without_its_end_is_reported_and_one_cut_in_a_number_is_refused(text_file):
    whole = body("X1.0Y2.0\nX10.0Y20.0")
    assert codes(read(text_file("c.drl", whole.replace("M30\n", "")))) == ["L101"]
    with pytest.raises(ReadError, match="its last line is truncated"):
        read(text_file("c.drl", whole[: whole.index("0.0\nM30")]))


def test_coordinates_out_of_range_are_skipped_and_reported(text_file):
    part = read(text_file("n.drl", body("X1.0Y1.0\nX99999999.0Y1.0")))
    assert len(part.holes) == 1
    assert codes(part) == ["L203"]


# Holes, slots and tools as the table beside the real files gives them.
BOARDS = {
    "custom_pads_test": (4, 0, 1),
    "test_pads_inside_pads": (13, 0, 2),
    "ecc83-pp": (33, 0, 5),
    "sonde_xilinx": (77, 0, 4),
    "StickHub": (87, 1, 3),
    "complex_hierarchy": (165, 0, 7),
    "pic_programmer": (251, 0, 14),
    "flat_hierarchy": (254, 0, 14),
    "carte_test": (278, 0, 9),
    "kit-dev-coldfire-xilinx_5213": (523, 3, 10),
}


@pytest.mark.parametrize("board", BOARDS)
def test_real_boards_have_the_holes_slots_and_tools_that_a_plain_search_finds(data, board):
    path = data / "boards" / f"{board}.drl"
    part = read(path)
    tools = {h.layer for h in part.holes} | {s.layer for s in part.slots}
    assert (len(part.holes), len(part.slots), len(tools)) == BOARDS[board]
    hits, tool, sizes = [], "", {}
    for line in path.read_text().splitlines():
        if match := re.fullmatch(r"T(\d+)C([\d.]+)", line):
            sizes[match[1]] = float(match[2])
        elif match := re.fullmatch(r"T(\d+)", line):
            tool = match[1]
        elif match := re.fullmatch(r"X(-?[\d.]+)Y(-?[\d.]+)", line):
            hits.append((float(match[1]), float(match[2]), sizes[tool]))
    assert [(h.x, h.y, h.diameter) for h in part.holes] == hits
    assert not part.issues


def test_a_slash_alone_skips_nothing(text_file):
    part = read(text_file("slash.drl", "M48\nMETRIC\nT1C0.8\nR,H\n/\n%\nT1\nX3.0Y4.0\nM30\n"))
    assert holes(part) == [(3.0, 4.0, 0.8, "T1")]
    with pytest.raises(ReadError):
        read(text_file("skipped.drl", "M48\nMETRIC\nT1C0.8\n%\nT1\n/X3.0Y4.0\nX5.0Y4.0\nM30\n"))


def test_a_tool_zero_with_a_diameter_drills(text_file):
    """Without a diameter T0 ends the work."""
    head, body = "M48\nMETRIC\nT0C0.3\nT1C0.8\n%\n", "T0\nX1.0Y2.0\nT1\nX3.0Y4.0\n"
    part = read(text_file("zero.drl", f"{head}{body}T0\nM30\n"))
    assert holes(part) == [(1.0, 2.0, 0.3, "T0"), (3.0, 4.0, 0.8, "T1")]
    assert not part.issues


def test_a_g_code_program_is_not_taken_for_a_drill_file():
    assert sniff_excellon(b"%\nO0001\nG21 G90\nM48\nT1 M6\nG81 X1 Y1 Z-2 R1 F100\nM30\n%\n") == 0


@pytest.mark.parametrize("name", ["thruhole.tap", "board.nc", "board.cnc", "board.txt", "board.ngc"])
@pytest.mark.parametrize(
    "text",
    [
        KICAD,
        "%\nT1C0.028F197S550\nX0.2475Y0.1525\nT2C0.038F197S550\nX0.1475Y0.2525\nM30\n",
        "T01C0.8\nT02C1.1\nG05\nT01\nX1.0Y2.0\nX3.0Y4.0G85X3.0Y6.0\nT02\nG00X1.0Y1.0\nM15\nG01X2.0\nM16\nG05\nM30\n",
    ],
)
def test_a_drill_file_is_known_by_its_words_whatever_its_name_is(text_file, name, text):
    part = read(text_file(name, text))
    assert part.format == "excellon"
    assert len(part.holes) + len(part.slots) in (2, 3)


@pytest.mark.parametrize("units, place", [("in", (6.2865, 3.8735)), ("mm", (2.475, 1.525))])
def test_units_give_the_usual_format_of_a_file_that_states_none(text_file, units, place):
    path = text_file("as.drl", "%\nT1C0.028F197S550\nX2475Y1525\nX002475Y002525\nM30\n")
    with pytest.raises(ReadError, match="give --units in"):
        read(path)
    part = read(path, ReadOptions(units=units))
    assert (part.holes[0].x, part.holes[0].y) == place
    assert codes(part) == ["L102"] and "gives no format" in part.issues[0].message


def test_places_after_tools_without_a_size_are_no_program():
    assert sniff_excellon(b"%\nT1\nX1000Y1000\nX2000Y1000\nM30\n") == Match.YES


@pytest.mark.parametrize(
    "text",
    [
        "T1 M6 (CUTTER 3 MM)\nS9000 M3\nG0 Z5.\nG81 X1. Y1. Z-2. R1. F100.\nX2.Y2.\nM30\n",
        "G92 X2500. Y1250.\nT201C45.\nX100.Y200.\nX150.Y200.\nG50\n",
        "%\nT1C1\nM06\nX1.Y1.\nZ-2.\nM30\n",
        "G91\nT1\nX1.Y1.\nX2.Y2.\n",
    ],
)
def test_a_program_with_bare_places_stays_a_program(text):
    assert registry.choose_format(formats(), Source("program.tap", text.encode())).name == "gcode"


def test_resets_of_counters_and_a_zero_set_to_zero_change_nothing(text_file):
    plain = read(text_file("a.drl", body("X1.0Y2.0\nX5.0Y5.0")))
    reset = read(text_file("a.drl", body("R,H\nG93X0Y0\nG93X0.0Y0.000\nX1.0Y2.0\nr,cp\nX5.0Y5.0")))
    assert reset.holes == plain.holes and not reset.issues


@pytest.mark.parametrize("header", ["INCH,TZ\n", ";FILE_FORMAT=2:4\nINCH,TZ\n"])
def test_holes_that_all_lie_inside_one_of_them_cannot_be_right(text_file, header):
    """X3 is 0.0003 in = 0.00762 mm; the file means 3 in."""
    path = text_file("tz.drl", f"M48\n{header}T1C0.0394\n%\nT1\nX3Y1\nX2Y1\nM30\n")
    told = " ".join(issue.message for issue in read(path).issues if issue.code == "L102")
    assert (
        "2 holes span 0.00254 × 0 mm, less than the diameter of the largest, 1.00076 mm, which is implausible; "
        "export the file with decimal"
    ) in told
    whole = text_file("tz.drl", f"M48\n{header}T1C0.0394\n%\nT1\nX30000Y10000\nX20000Y10000\nM30\n")
    assert "implausible" not in str(read(whole).issues)


@pytest.mark.parametrize("count", [1, 3])
def test_repeats_make_no_more_holes_than_the_size_of_the_file_allows(text_file, count):
    """Refused before the holes are made: one line asks for a million."""
    repeats = f"R{999_999 // count}X0.1\n" * count
    path = text_file("a.drl", f"M48\nMETRIC\nT1C0.8\n%\nT1\nX1.0Y1.0\n{repeats}M30\n")
    with pytest.raises(
        ReadError, match=r"repeats \(R\) expand to more than 100,\d\d\d holes, too many for a file of 1 kB"
    ):
        read(path)


def test_a_file_of_very_many_tools_is_refused_before_they_are_sorted_for_each_of_them(text_file, monkeypatch):
    monkeypatch.setattr(excellon, "MAX_TOOLS", 3)
    tools = "".join(f"T{k}C0.{k}\n" for k in range(1, 5))
    with pytest.raises(ReadError, match=r"a.drl:6: more than 3 tools; split the file"):
        read(text_file("a.drl", f"M48\nMETRIC\n{tools}%\nT1\nX1.0Y1.0\nM30\n"))
