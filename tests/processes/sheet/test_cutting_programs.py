"""Cutting programs as text: the words for every controller, and their acceptance by LinuxCNC."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from leafcut.errors import PostError
from leafcut.gcode.dialects import dialect_names, load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.cutting import CutData, CutPlan
from leafcut.model.sheet import Sheet
from leafcut.model.toolpath import Arc, Kind, Toolpath, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.processes.sheet.post import write_cut_program
from leafcut.processes.sheet.proof.torch import check_lighting_tool
from qtplasmac_filter import filtered
from rs274_moves import PRINTED, assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274

DATA = CutData("plasma", "mild_steel", 6.0, 20.0, 1.5, 45.0, 3.8, 0.5, 1.5, 130.0)


def light(b: ToolpathBuilder, x: float, y: float, power: float = 900.0) -> None:
    """Go to a place and pierce."""
    b.rapid(x, y)
    b.rapid(z=3.8)
    b.spindle(power)
    b.dwell(0.5)
    b.feed(z=1.5, feed=20.0)


def choose(b: ToolpathBuilder, tool: int) -> None:
    """Change to the scribe, or back to the torch."""
    b.tool(tool)
    b.offset(0)


def two_cuts(dark: bool = False, mark: bool = False, scribe: bool = False, hole_feed: float = 12.0) -> Toolpath:
    """A small hole at 60 %, an outline at full speed, and additions of a test."""
    b = ToolpathBuilder()
    b.blending(640, 0.1)
    b.rapid(z=10.0)
    light(b, 20.0, 10.0)
    b.height_control(False)
    b.feed(25.0, 10.0, feed=hole_feed)
    b.arc(False, (15.0, 10.0, 1.5), Arc((20.0, 10.0, 1.5)), feed=hole_feed)
    b.arc(False, (25.0, 10.0, 1.5), Arc((20.0, 10.0, 1.5)), feed=hole_feed)
    if dark:
        b.torch(False)
        b.arc(False, (20.0, 15.0, 1.5), Arc((20.0, 10.0, 1.5)), feed=hole_feed)
        b.torch(True)
    b.height_control(True)
    b.spindle(0.0)
    b.rapid(z=10.0)
    if mark:
        if scribe:
            choose(b, 1)
        b.rapid(5.0, 5.0)
        b.spindle(200.0, number=1)
        b.feed(9.0, 5.0, feed=20.0)
        b.spindle(0.0)
        if scribe:
            choose(b, 0)
    light(b, -3.0, 0.0)
    for x, y in ((0.0, 0.0), (0.0, 20.0), (40.0, 20.0), (40.0, 0.0), (0.0, 0.0)):
        b.feed(x, y, feed=20.0)
    b.spindle(0.0)
    b.rapid(z=10.0)
    b.end()
    return b.build()


def written(words: str, path: Toolpath, post: PostOptions | None = None, header: tuple[str, ...] = ()) -> str:
    """The program."""
    return write_cut_program(CutPlan(Sheet("s"), DATA, ()), path, load_dialect(words), post or PostOptions(), header)


QTPLASMAC = """\
G21
G17 G40 G49 G80 G90 G91.1 G92.1 G94 G97 G54
M52 P1
M65 P2
M65 P3
M68 E3 Q0
(marks: the scribe is tool 1; its X and Y offset from the torch, tool 0, must be in the tool table)
(o=0, kw=1.5, ph=3.8, pd=0.5, ch=1.5, fr=1200, ca=45, cv=130)
G64 P0.1
G0 X20 Y10
M3 $0 S1
M62 P2
M67 E3 Q60
G1 X25 F1200
G3 X15 I-5 J0
X25 I5 J0
M62 P3
X20 Y15 I-5 J0
M63 P3
M63 P2
M5 $0
T1 M6
G43 H0
G0 X5 Y5
M3 $1 S1
M67 E3 Q100
G1 X9
M5 $1
T0 M6
G43 H0
G0 X-3 Y0
M3 $0 S1
G1 X0
Y20
X40
Y0
X0
M5 $0
M65 P2
M65 P3
M68 E3 Q0
M2
"""

GRBL = """\
G21
G17 G40 G49 G80 G90 G94 G54
G0 X20 Y10
M4 S900
G1 X25 F720
G3 X15 I-5 J0
X25 I5 J0
S0
X20 Y15 I-5 J0
S900
M5
G0 X5 Y5
M4 S200
G1 X9 F1200
M5
G0 X-3 Y0
M4 S900
G1 X0
Y20
X40
Y0
X0
M5
M30
"""


@pytest.mark.parametrize("words, text", [("qtplasmac", QTPLASMAC), ("grbl-laser", GRBL)])
def test_a_controller_is_told_in_its_own_words(words: str, text: str) -> None:
    assert written(words, two_cuts(dark=True, mark=True, scribe=words == "qtplasmac")) == text


def test_a_table_whose_program_moves_z_pierces_high_and_cuts_low() -> None:
    text = written("plasma", two_cuts())
    assert "G0 Z10\nX20 Y10\nZ3.8\nM3 S1\nG4 P0.5\nG1 Z1.5 F1200\nX25 F720\n" in text
    assert text.endswith("M5\nG0 Z10\nM2\n")


def test_a_fanuc_laser_is_to_be_checked_on_the_machine() -> None:
    text = written("fanuc-laser", two_cuts(dark=True), header=("sheet",))
    assert "CHECK ON THE MACHINE" in text
    assert "G0 X20. Y10.\nM3 S900\nG4 P500\nG1 X25. F720.\n" in text


@pytest.mark.parametrize("words", dialect_names(torch=True))
@pytest.mark.parametrize("units", ["mm", "inch"])
def test_no_line_is_longer_than_the_controller_takes(words: str, units: str) -> None:
    post = PostOptions(output_units=units, line_numbers=True)
    text = written(words, two_cuts(), post, ("a sheet with a name " * 8,))
    assert max(map(len, text.splitlines())) <= load_dialect(words).max_line


def test_the_controllers_own_material_has_the_feed() -> None:
    text = written("qtplasmac", two_cuts(), PostOptions(material_number=12))
    assert "M190 P12\nM66 P3 L3 Q1\n" in text
    assert "(o=0" not in text
    assert re.findall(r"F\S+", text) == ["F#<_hal[plasmac.cut-feed-rate]>"]


@pytest.mark.parametrize(
    "words, path, post, message",
    [
        ("plasma", two_cuts(mark=True), PostOptions(), "plasma has no command for marking; leave the marks out"),
        ("plasma", two_cuts(dark=True), PostOptions(), "cannot switch the torch off during a cut"),
        ("plasma", two_cuts(), PostOptions(material_number=1), "no table of materials"),
        ("linuxcnc", two_cuts(dark=True), PostOptions(), "linuxcnc programs cannot state HEIGHT"),
        (
            "grbl-laser",
            two_cuts(mark=True),
            PostOptions(beam_power=200, mark_power=200),
            "is not below --beam-power",
        ),
    ],
)
def test_what_a_controller_cannot_do_is_refused(words: str, path: Toolpath, post: PostOptions, message: str) -> None:
    with pytest.raises(PostError, match=message):
        written(words, path, post)


@pytest.mark.parametrize("words", ["qtplasmac", "plasma"])
@pytest.mark.parametrize("units", ["mm", "inch"])
def test_linuxcnc_makes_the_same_moves(words: str, units: str, rs274: str, tmp_path: Path) -> None:
    """QtPlasmaC lowers the feed while the program runs; rs274, which runs nothing, prints the feed of F."""
    text = written(words, two_cuts(dark=words == "qtplasmac"), PostOptions(output_units=units))
    status, output = run_rs274(rs274, text, tmp_path)
    assert status == 0, output
    path = interpret_own_program(text.replace("Q60", "Q100"), load_dialect(words))
    ours = [m for m in moves_of_toolpath(path) if m[0] != "dwell" or words == "plasma"]
    assert_same_moves(ours, moves_of_rs274(output), PRINTED[units])


def test_every_row_is_read_back() -> None:
    path = interpret_own_program(written("plasma", two_cuts()), load_dialect("plasma"), left_over=True)
    cuts = [m for m in path if m.kind in (Kind.FEED, Kind.ARC_CCW)]
    assert [m.value for m in cuts] == [20.0, 12.0, 12.0, 12.0, 20.0, *5 * [20.0]]


def marks_among_cuts() -> Toolpath:
    """A cut, a mark from its end, a cut next to the mark's end, a mark; both travel moves could move a single axis."""
    b = ToolpathBuilder()
    b.rapid(z=10.0)
    light(b, 0.0, 0.0)
    b.feed(10.0, 0.0, feed=20.0)
    b.spindle(0.0)
    choose(b, 1)
    b.rapid(10.0, 0.0)
    b.spindle(200.0, number=1)
    b.feed(10.0, 10.0, feed=20.0)
    b.spindle(0.0)
    choose(b, 0)
    light(b, 10.0, 20.0)
    b.feed(20.0, 20.0, feed=20.0)
    b.spindle(0.0)
    choose(b, 1)
    b.rapid(30.0, 20.0)
    b.spindle(200.0, number=1)
    b.feed(40.0, 20.0, feed=20.0)
    b.spindle(0.0)
    choose(b, 0)
    b.end()
    return b.build()


def test_marks_are_made_with_the_scribe_by_its_own_offset(rs274: str, qtplasmac_gcode: str, tmp_path: Path) -> None:
    """LinuxCNC uses tool 1 and its offset for marks and tool 0 for cuts; QtPlasmaC's filter accepts this."""
    text = written("qtplasmac", marks_among_cuts())
    status, said = run_rs274(rs274, text, tmp_path)
    assert status == 0
    names = "CHANGE_TOOL|USE_TOOL_LENGTH_OFFSET|START_SPINDLE_CLOCKWISE|STRAIGHT_TRAVERSE|PROGRAM_END"
    found = re.findall(rf"({names})\(([^)]*)\)", said)
    calls = [(name, "at" if "OFFSET" in name else what.split(".")[0]) for name, what in found]
    tool = ["CHANGE_TOOL", "USE_TOOL_LENGTH_OFFSET", "STRAIGHT_TRAVERSE", "START_SPINDLE_CLOCKWISE"]
    begin = next(k for k, (name, _) in enumerate(calls) if name == tool[2])
    assert [name for name, _ in calls[begin:]] == [*tool[2:], *tool, *tool, *tool, *tool[:2], "PROGRAM_END"]
    numbers = [what != "0" for name, what in calls[begin:] if name in (tool[0], tool[3])]
    assert numbers == [False, *[True] * 2, *[False] * 2, *[True] * 2, False]
    assert text.count("G43 H0\nG0 X10 Y0\nM3 $1") == text.count("G43 H0\nG0 X10 Y20\nM3 $0") == 1
    passed = filtered(qtplasmac_gcode, text, tmp_path / "filter")
    assert passed.said == ""
    mark, back = ["t1m6", "g43h0", "m3$1s1"], ["t0m6", "g43h0"]
    assert re.findall("t[01]m6|g43h0|m3..s1", passed.text) == ["m3$0s1", *mark, *back, "m3$0s1", *mark, *back]


@pytest.mark.parametrize(
    "was, now",
    [
        ("T1 M6\n", ""),
        ("T1 M6", "T2 M6"),
        ("G43 H0\n", ""),
        ("T0 M6\nG43 H0\nG0 X10 Y20", "G0 X10 Y20"),
        ("G0 X10 Y20", "G0 Y20"),
        ("T0 M6\nG43 H0\nM65", "M65"),
    ],
)
def test_a_scribe_that_is_not_chosen_or_has_not_gone_by_its_offset_is_a_difference(was: str, now: str) -> None:
    text = written("qtplasmac", marks_among_cuts())
    words = load_dialect("qtplasmac")
    assert was in text
    assert check_lighting_tool(interpret_own_program(text, words), words) == []
    assert check_lighting_tool(interpret_own_program(text.replace(was, now, 1), words), words)


def lit(*, feed: float = 20.0) -> ToolpathBuilder:
    """A torch that burns at the start of a cut."""
    b = ToolpathBuilder()
    b.rapid(z=10.0)
    light(b, 0.0, 0.0)
    b.feed(10.0, 0.0, feed=feed)
    return b


def _feed_under_compensation(b: ToolpathBuilder) -> None:
    b.radius(41, 1.5)
    b.feed(20.0, 0.0, feed=20.0)
    b.feed(30.0, 0.0, feed=10.0)


def _switched_under_compensation(b: ToolpathBuilder) -> None:
    b.radius(42, 1.5)
    b.feed(20.0, 0.0, feed=20.0)
    b.height_control(False)


def _probed(b: ToolpathBuilder) -> None:
    b.probe(-1.0, feed=5.0)


def _scribe_while_lit(b: ToolpathBuilder) -> None:
    b.tool(1)


def _scribe_under_compensation(b: ToolpathBuilder) -> None:
    b.radius(41, 1.5)
    b.feed(20.0, 0.0, feed=20.0)
    b.spindle(0.0)
    b.tool(1)


@pytest.mark.parametrize(
    "words, fault, message",
    [
        (
            "qtplasmac",
            _feed_under_compensation,
            "the feed cannot change (M67) while the controller compensates the kerf (G41, G42)",
        ),
        (
            "qtplasmac",
            _switched_under_compensation,
            "outputs cannot be switched (M62) while the controller compensates the kerf (G41, G42)",
        ),
        ("flame", _probed, f"{load_dialect('flame').name} has no probing command"),
        ("qtplasmac", _scribe_while_lit, "the tool cannot be changed (M6) while the torch is on"),
        ("qtplasmac", _scribe_under_compensation, "the tool cannot be changed (M6) while the torch is on"),
    ],
)
def test_a_toolpath_that_a_torch_cannot_follow_is_refused_in_one_line(
    words: str, fault: Callable[[ToolpathBuilder], None], message: str
) -> None:
    b = lit()
    fault(b)
    b.end()
    with pytest.raises(PostError) as caught:
        written(words, b.build())
    assert str(caught.value) == message


def test_a_feed_that_the_material_table_does_not_have_is_refused() -> None:
    """A share of 0.1 % is negligible; one below 10 % would be taken for 100 %, so F states it."""
    post = PostOptions(material_number=3)
    for feed in (20.0, 20.0 * 1.0009, 20.0 * 0.9992):
        b = lit(feed=feed)
        b.end()
        assert re.findall(r"F\S+", written("qtplasmac", b.build(), post)) == ["F#<_hal[plasmac.cut-feed-rate]>"]
    b = lit(feed=1.5)
    b.end()
    with pytest.raises(PostError) as caught:
        written("qtplasmac", b.build(), post)
    assert str(caught.value) == (
        "a feed of 90 mm/min cannot be set if the controller takes the feed from its material table; leave out "
        "--material-number"
    )


@pytest.mark.parametrize(
    "feed, words",
    [
        (20.0, ["F1200"]),
        (19.992, ["F1199.52"]),
        (19.98, ["M67 E3 Q99.9", "F1200"]),
        (2.0, ["M67 E3 Q10", "F1200"]),
        (1.98, ["F118.8"]),
        (24.0, ["F1440"]),
    ],
)
def test_a_feed_is_a_share_of_the_charts_from_a_tenth_to_the_whole(feed: float, words: list[str]) -> None:
    """Shares are rounded to 0.1 %; other feeds are stated by F."""
    b = lit(feed=feed)
    b.end()
    assert re.findall(r"M67 E3 Q\S+|F\d\S+", written("qtplasmac", b.build()).partition("M3")[2]) == words


def test_marks_state_their_feed_and_cuts_take_that_of_the_material_table_again() -> None:
    text = written("qtplasmac", two_cuts(mark=True, scribe=True, hole_feed=20.0), PostOptions(material_number=12))
    table = "F#<_hal[plasmac.cut-feed-rate]>"
    assert re.findall(r"F\S+", text) == [table, "F1200", table]


def test_a_lower_feed_under_compensation_is_set_before_it() -> None:
    """M67 is refused between G41.1 and G40, so the share of the first cut under compensation comes before both."""
    b = ToolpathBuilder()
    for x in (0.0, 50.0):
        b.rapid(x, 0.0)
        b.spindle(900.0)
        b.feed(x + 5.0, 0.0, feed=20.0)
        b.radius(41, 1.5)
        b.feed(x + 10.0, 0.0, feed=12.0)
        b.feed(x + 10.0, 9.0, feed=12.0)
        b.radius(40)
        b.feed(x, 9.0, feed=20.0)
        b.spindle(0.0)
    b.end()
    body = written("qtplasmac", b.build()).partition("M3 $0 S1\n")[2]
    cut = "G1 X{}{}\nM67 E3 Q60\nG41.1 D1.5\nX{}\nY9\nG40\nM67 E3 Q100\nX{}\nM5 $0\n"
    second = cut.format(55, "", 60, 50)
    assert body.startswith(cut.format(5, " F1200", 10, 0) + "G0 X50 Y0\nM3 $0 S1\n" + second)


def test_a_compensation_that_changes_its_side_keeps_the_share_of_the_feed() -> None:
    """From G41.1 to G42.1 without G40, M67 may not come again."""
    b = lit()
    b.radius(41, 1.5)
    b.feed(20.0, 0.0, feed=12.0)
    b.radius(42, 1.5)
    b.feed(20.0, 9.0, feed=12.0)
    b.radius(40)
    b.spindle(0.0)
    b.end()
    body = written("qtplasmac", b.build()).partition("X10 F1200\n")[2].partition("M5")[0]
    assert body == "M67 E3 Q60\nG41.1 D1.5\nX20\nG42.1 D1.5\nY9\nG40\n"


def test_after_a_probe_the_cut_states_its_feed_again() -> None:
    b = ToolpathBuilder()
    for x in (0.0, 50.0):
        b.rapid(z=10.0)
        b.rapid(x, 0.0)
        b.probe(-12.0, feed=5.0)
        b.set_place(Kind.SHIFT, (x, 0.0, -0.5), 0)
        b.rapid(z=10.0)
        light(b, x, 0.0)
        b.feed(x + 9.0, 0.0, feed=20.0)
        b.spindle(0.0)
    b.set_place(Kind.SHIFT, (math.nan, math.nan, math.nan), 0)
    b.end()
    text = written("plasma", b.build())
    assert re.findall(r"F\S+", text) == ["F300", "F1200", "F300", "F1200"]
    assert text.endswith("M5\nG92.1\nM2\n")


def test_a_probing_table_measures_the_sheet_and_cancels_the_shift_at_the_end() -> None:
    """Without rows for blending, G61 ends the rounding of an earlier program."""
    b = ToolpathBuilder()
    b.rapid(z=10.0)
    b.rapid(1.0, 2.0)
    b.probe(-12.0, feed=5.0)
    b.set_place(Kind.SHIFT, (1.0, 2.0, -0.5), 0)
    b.rapid(z=3.8)
    b.spindle(900.0)
    b.feed(z=1.5, feed=20.0)
    b.feed(5.0, 2.0, feed=20.0)
    b.spindle(0.0)
    b.probe(-12.0, feed=20.0)
    b.set_place(Kind.SHIFT, (math.nan, math.nan, math.nan), 0)
    b.rapid(z=10.0)
    b.end()
    assert written("plasma", b.build()) == (
        "G21\nG17 G40 G49 G80 G90 G91.1 G92.1 G94 G97 G54\nG61\nG0 Z10\nX1 Y2\nG38.2 Z-12 F300\nG92 Z-0.5\nG0 Z3.8\n"
        "M3 S1\nG1 Z1.5 F1200\nX5\nM5\nG38.2 Z-12\nG92.1\nG0 Z10\nM2\n"
    )


@pytest.mark.parametrize("words, exact", [("qtplasmac", True), ("waterjet", True), ("grbl-laser", False)])
def test_corners_are_exact_unless_the_toolpath_states_their_blending(words: str, exact: bool) -> None:
    b = lit()
    b.end()
    assert ("G61" in written(words, b.build()).splitlines()) is exact
    b = ToolpathBuilder()
    b.blending(640, 0.1)
    b.end()
    assert "G61" not in written(words, b.build()).splitlines()


def test_the_header_can_be_left_out() -> None:
    b = lit()
    b.end()
    for words in ("plasma", "haas"):
        assert "(sheet)" in written(words, b.build(), None, ("sheet",)).splitlines()
        assert "(" not in written(words, b.build(), PostOptions(header=False), ("sheet",)).partition("G21")[0]


def test_a_mill_cuts_a_sheet_with_its_spindle_and_without_further_waits() -> None:
    b = ToolpathBuilder()
    b.rapid(z=10.0)
    b.spindle(900.0)
    b.rapid(0.0, 0.0)
    b.feed(z=-1.0, feed=20.0)
    b.spindle(0.0)
    b.end()
    assert written("haas", b.build()).splitlines()[-7:] == [
        "G0 Z10.",
        "S900 M3",
        "X0. Y0.",
        "G1 Z-1. F1200.",
        "M5",
        "M30",
        "%",
    ]


def test_moves_at_a_feed_with_the_torch_off_state_their_own_feed() -> None:
    """Shares of the chart's feed (M67) are for lit cuts only: half the feed before and after them is F600."""
    b = ToolpathBuilder()
    b.rapid(0.0, 0.0, 10.0)
    b.feed(5.0, 0.0, feed=10.0)
    for x in (10.0, 30.0):
        b.spindle(900.0)
        b.feed(x, 0.0, feed=20.0)
        b.spindle(0.0)
        b.feed(x + 5.0, 0.0, feed=10.0)
    b.end()
    body = written("qtplasmac", b.build()).partition("G0 X0 Y0\n")[2]
    assert body.partition("M65")[0] == (
        "G1 X5 F600\nM3 $0 S1\nX10 F1200\nM5 $0\nX15 F600\nM3 $0 S1\nX30 F1200\nM5 $0\nX35 F600\n"
    )
