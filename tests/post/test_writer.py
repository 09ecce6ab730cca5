"""The writer: its text, and its refusals."""

from __future__ import annotations

import math
import re

import pytest
from toolpaths import MILLING, two_tools, units_of

from leafcut.errors import PostError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Motion, Toolpath, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.words import comment_lines, to_plain_ascii
from leafcut.post.writer import write_program

G81 = DrillCycle("G81", 2.0, -5.0)


def written(b: ToolpathBuilder, name: str = "linuxcnc", end: bool = True, **options: object) -> list[str]:
    """Return the blocks after the preamble, without the end."""
    if end:
        b.end()
    text = write_program(b.build(), load_dialect(name), PostOptions(**options))
    lines = [line for line in text.splitlines() if line != "%"]
    last_of_head = next(n for n, line in enumerate(lines) if "G54" in line)
    body = lines[last_of_head + 1 :]
    return body[1:-1] if body[0].endswith("G61") else body[:-1]


def started(z: float = 10.0) -> ToolpathBuilder:
    """A builder that stands at X0 Y0 at a safe height."""
    b = ToolpathBuilder()
    b.rapid(z=z)
    b.rapid(0.0, 0.0)
    return b


@pytest.mark.parametrize("name", MILLING)
def test_units_and_z_come_before_any_move_in_the_plane(name: str) -> None:
    """The first words are the units, then plane, absolute and cancelled modes; the first move is Z alone."""
    for units in units_of(name):
        text = write_program(two_tools(name), load_dialect(name), PostOptions(output_units=units))
        blocks = [line for line in text.splitlines() if not line.startswith(("%", "O", "(", ";"))]
        profile = load_dialect(name)
        blocks = blocks[len(profile.opening) :]
        assert blocks[0] == (profile.units_mm if units == "mm" else profile.units_inch)
        heads = {"G17", "G90", "G40", "G80", "G94", "G54"} & set(profile.g_words.split())
        assert {"G17", "G90"} <= heads <= set(" ".join(blocks[1:4]).split())
        moves = [b for b in blocks if re.search(r"[XYZ]", b)]
        assert re.fullmatch(r"G0 Z\S+", moves[0])


def test_words_are_said_when_they_change_and_not_again() -> None:
    b = started()
    b.feed(5.0, 0.0, feed=2.0)
    b.feed(5.0, 7.0, feed=2.0)
    b.feed(5.0, 7.0, -1.0, feed=1.0)
    path = ["G0 Z10", "X0 Y0", "G1 X5 F120", "Y7", "Z-1 F60"]
    assert written(b) == path


def test_cycles_state_their_retract_and_are_closed_by_g80() -> None:
    """G98 or G99 with the first hole, places alone after it, G80 before anything else."""
    b = started()
    for x in (1.0, 2.0, 2.0):
        b.drill(x, 3.0, G81, feed=1.0)
    b.drill(4.0, 3.0, DrillCycle("G81", 2.0, -6.0), feed=1.0)
    b.rapid(z=10.0)
    expected = ["G99 G81 X1 Y3 Z-5 R2 F60", "X2", "X2 Y3", "G99 G81 X4 Y3 Z-6 R2", "G80", "G0 Z10"]
    assert written(b)[2:] == expected


def test_a_hole_that_returns_higher_than_g99_left_off_starts_its_own_series() -> None:
    """LinuxCNC would rise on a slant between G99 and G98: the hole is expanded, at the height of the toolpath."""
    b = started()
    b.drill(1.0, 0.0, G81, feed=1.0)
    b.drill(2.0, 0.0, DrillCycle("G81", 2.0, -5.0, True), feed=1.0)
    assert written(b)[2:] == ["G99 G81 X1 Y0 Z-5 R2 F60", "G80", "G0 X2", "G1 Z-5", "G0 Z10"]


@pytest.mark.parametrize(
    "name, words",
    [
        ("linuxcnc", ["G98 G83 X1 Y2 Z-10 R2 Q4 F60"]),
        ("haas", ["G98 G83 X1. Y2. Z-10. R2. Q4. F60."]),
        ("fanuc", ["G98 G83 X1. Y2. Z-10. R2. Q4. F60."]),
        (
            "fagor8055",
            ["X1 Y2", "Z2", "G1 Z-2 F60", "G0 Z2", "Z-1.746", "G1 Z-6", "G0 Z2", "Z-5.746", "G1 Z-10", "G0 Z10"],
        ),
        ("grbl", ["X1 Y2", "Z2", "G1 Z-2 F60", "G0 Z2", "Z-1.746", "G1 Z-6", "G0 Z2", "Z-5.746", "G1 Z-10", "G0 Z10"]),
    ],
)
def test_pecks_are_a_cycle_or_are_written_out(name: str, words: list[str]) -> None:
    """Where the controller has no such cycle, its moves stand one by one."""
    b = started()
    b.drill(1.0, 2.0, DrillCycle("G83", 2.0, -10.0, True, 4.0), feed=1.0)
    assert [line for line in written(b, name)[2:] if line != "G80"] == words


def test_rounding_does_not_add_a_peck() -> None:
    """10 mm in three pecks stay three: Q is rounded up where rounding down would leave a thousandth over."""
    b = started()
    b.drill(1.0, 2.0, DrillCycle("G83", 0.0, -10.0, False, 10 / 3), feed=1.0)
    assert "Q3.334" in written(b)[2]


@pytest.mark.parametrize(
    "name, words",
    [
        ("linuxcnc", ["G4 P1.25", "Z-5 R2 P0.5"]),
        ("grbl", ["G4 P1.25", "G4 P0.5"]),
        ("mach3", ["G4 P1.25", "Z-5 R2 P0.5"]),
        ("mach4", ["G4 P1.25", "Z-5 R2 P0.5"]),
        ("haas", ["G4 P1.25", "Z-5. R2. P0.5"]),
        ("fanuc", ["G4 P1250", "Z-5. R2. P500"]),
        ("fagor8055", ["G4 K125", "G81 X1 Y1 Z2 I-5 K50"]),
    ],
)
def test_dwells_are_in_the_controllers_own_unit(name: str, words: list[str]) -> None:
    """Seconds, milliseconds, or hundredths."""
    b = started()
    b.dwell(1.25)
    b.drill(1.0, 1.0, DrillCycle("G82", 2.0, -5.0, False, 0.0, 0.5), feed=1.0)
    text = "\n".join(written(b, name))
    assert all(word in text for word in words)


def test_a_whole_second_keeps_its_point_where_the_point_is_the_unit() -> None:
    """On a Haas P2. is two seconds and P2 two milliseconds."""
    b = started()
    b.dwell(2.0)
    assert written(b, "haas")[-1] == "G4 P2."


@pytest.mark.parametrize(
    "name, words",
    [
        ("linuxcnc", ["(T7 drill)", "T7 M6", "S100 M3", "G0 G43 H7 Z10", "X0 Y0", "Z5"]),
        ("haas", ["(T7 drill)", "T7 M6", "S100 M3", "G0 G43 H7 Z10.", "X0. Y0.", "Z5."]),
        ("fanuc", ["(T7 DRILL)", "T7 M6", "S100 M3", "G0 G43 H7 Z10.", "X0. Y0.", "Z5."]),
        ("fagor8055", ["(T7 drill)", "T7 D7 M6", "S100 M3", "G0 G43 Z10", "X0 Y0", "Z5"]),
        ("grbl", ["(T7 drill)", "T7", "M0", "S100 M3", "G0 Z10", "X0 Y0", "Z5"]),
    ],
)
def test_a_tool_change_ends_with_a_move_in_z_that_takes_up_its_length(name: str, words: list[str]) -> None:
    """G43 is in the first block with Z; after it, all coordinates are repeated."""
    b = ToolpathBuilder()
    b.tool(7)
    b.spindle(100.0)
    b.rapid(z=10.0)
    b.rapid(0.0, 0.0)
    b.rapid(0.0, 0.0, 5.0)
    b.end()
    text = write_program(b.build(), load_dialect(name), PostOptions(), tool_names={7: "drill"})
    lines = text.splitlines()
    start = lines.index(words[0])
    assert lines[start : start + len(words)] == words


@pytest.mark.parametrize(
    "name, words",
    [
        ("linuxcnc", ["G53 G0 Z0"]),
        ("haas", ["G53 G0 Z0."]),
        ("fanuc", ["G91 G28 Z0.", "G90"]),
        ("grbl", ["G53 G0 Z0"]),
        ("fagor8055", ["G53 G0 Z0"]),
    ],
)
def test_machine_zero_is_said_as_the_controller_is_used_to(name: str, words: list[str]) -> None:
    """A Fanuc goes home by G28, the others by G53; other heights of the machine are G53 everywhere."""
    b = started()
    b.machine(z=0.0)
    b.machine(x=-10.0, y=-20.0)
    assert written(b, name)[2:-1] == words
    assert re.fullmatch(r"G53( G0)? X-10\.? Y-20\.?", written(b, name, end=False)[-1])


def test_inches_convert_lengths_and_feeds() -> None:
    """25.4 mm are 1 in, 25.4 mm/s are 60 in/min; dwells and speeds stay."""
    b = started(25.4)
    b.spindle(500.0)
    b.dwell(1.5)
    b.feed(50.8, -12.7, feed=25.4)
    assert written(b, output_units="inch") == ["G0 Z1", "X0 Y0", "S500 M3", "G4 P1.5", "G1 X2 Y-0.5 F60"]


def test_blocks_can_be_numbered() -> None:
    """N10, N20, …; the frame and comments carry no number."""
    b = started()
    b.end()
    lines = write_program(b.build(), load_dialect("haas"), PostOptions(line_numbers=True), ["part"]).splitlines()
    assert lines[:4] == ["%", "O0001 (part)", "(part)", "N10 G21"] and lines[-2:] == ["N60 M30", "%"]


def test_the_program_number_and_the_header_are_options() -> None:
    """O0042; without a header, the program starts without a comment."""
    b = started()
    b.end()
    options = PostOptions(program_number=42, header=False)
    lines = write_program(b.build(), load_dialect("fanuc"), options, ["part"]).splitlines()
    assert lines[1] == "O0042" and not any("(" in line for line in lines)


def test_mach3_programs_say_which_setting_their_dwells_need() -> None:
    """A fact that the machine decides is written where the person at the machine reads it."""
    b = started()
    b.end()
    assert "must be off" in write_program(b.build(), load_dialect("mach3"), PostOptions(), ["part"])


@pytest.mark.parametrize(
    "text, plain",
    [
        ("plate (v2).dxf", "plate [v2].dxf"),
        ("Ø3 µm 90° × 20 %", "D3 um 90 deg x 20 pct"),
        ("Müller — Blech\n\tzwei\x00", "Muller - Blech zwei"),
        ("MSG, all is well", "- MSG - all is well"),
        ("ProbeOpen plate.dxf", "- ProbeOpen plate.dxf"),
        ("logclose", "- logclose"),
        ("o=0, ph=4", "- o=0, ph=4"),
        ("plate 2 ;qtplasmac filtered", "plate 2 ,qtplasmac filtered"),
        ("really?!~", "really..-"),
        ("日本", ".."),
        ("a)\nG0 Z-50 (", "a] G0 Z-50 ["),
    ],
)
def test_comments_are_plain_ascii_that_no_controller_acts_on(text: str, plain: str) -> None:
    """No parentheses, no line ends, no active comments, no characters that act at once."""
    assert to_plain_ascii(text) == plain


def test_long_comments_are_split_into_lines_that_fit() -> None:
    """No line is longer than the controller takes, and no word is lost."""
    text = "word " * 60 + "x" * 200
    lines = comment_lines(text, 79)
    assert all(len(line) <= 79 and line[0] == "(" and line[-1] == ")" for line in lines)
    assert "".join(line[1:-1].replace(" ", "") for line in lines) == text.replace(" ", "")


def test_a_header_cannot_smuggle_in_a_block() -> None:
    """Whatever a file or a tool is called, the program moves as planned."""
    b = started()
    b.tool(1)
    b.rapid(z=10.0)
    b.end()
    path, evil = b.build(), "x)\nG0 Z-99\n%\n(y\rM3 S9 ; G1 Z-5 \u2028 G2"
    for name in MILLING:
        text = write_program(path, load_dialect(name), PostOptions(), [evil, evil * 9], tool_names={1: evil})
        assert text.isascii() and all(len(line) <= load_dialect(name).max_line for line in text.splitlines())
        read = [m.kind for m in interpret_own_program(text, load_dialect(name)) if m.kind is not Kind.OFFSET]
        assert read == [Kind.RAPID, Kind.RAPID, Kind.TOOL, Kind.RAPID, Kind.END]


def _sideways_first(b: ToolpathBuilder) -> None:
    b.rapid(1.0, 1.0)


def _all_axes_first(b: ToolpathBuilder) -> None:
    b.rapid(1.0, 1.0, 10.0)


def _cut_first(b: ToolpathBuilder) -> None:
    b.feed(z=-1.0, feed=1.0)


def _machine_sideways_first(b: ToolpathBuilder) -> None:
    b.machine(x=0.0, y=0.0)


def _sideways_after_tool(b: ToolpathBuilder) -> None:
    b.rapid(z=10.0)
    b.tool(1)
    b.rapid(1.0, 1.0)


def _drill_after_tool(b: ToolpathBuilder) -> None:
    b.rapid(z=10.0)
    b.rapid(0.0, 0.0)
    b.tool(1)
    b.drill(1.0, 1.0, G81, feed=1.0)


def _no_feed(b: ToolpathBuilder) -> None:
    b.rapid(z=10.0)
    b.feed(z=-1.0, feed=0.0)


def _too_far(b: ToolpathBuilder) -> None:
    b.rapid(z=1e9)


def _peck_of_nothing(b: ToolpathBuilder) -> None:
    b.rapid(z=10.0)
    b.drill(0.0, 0.0, DrillCycle("G83", 2.0, -5.0), feed=1.0)


def _arc_of_nothing(b: ToolpathBuilder) -> None:
    b.rapid(z=10.0)
    b.rapid(0.0, 0.0)
    b.arc(True, (0.0004, 0.0, 10.0), Arc((5.0, 0.0, 10.0)), feed=1.0)


def _arc_from_nowhere(b: ToolpathBuilder) -> None:
    b.rapid(z=5.0)
    b.arc(False, (10.0, 0.0, 5.0), Arc((5.0, 0.0, 5.0)), feed=1.0)


def _cut_to_nowhere(b: ToolpathBuilder) -> None:
    b.rapid(z=5.0)
    b.feed(z=math.nan, feed=1.0)


def _drill_nowhere(b: ToolpathBuilder) -> None:
    b.rapid(z=5.0)
    b.drill(math.nan, 1.0, DrillCycle("G81", 2.0, -5.0), feed=1.0)


def _one_coolant_off(b: ToolpathBuilder) -> None:
    b.coolant(3)
    b.coolant(1)


@pytest.mark.parametrize(
    "fault, name, reason",
    [
        (_sideways_first, "linuxcnc", "the first move must be in Z only"),
        (_all_axes_first, "haas", "the first move must be in Z only"),
        (_cut_first, "grbl", "must be a rapid in Z alone"),
        (_machine_sideways_first, "haas", "must be in Z only"),
        (_sideways_after_tool, "grbl", "after a change of tool, the first move must be in Z"),
        (_drill_after_tool, "linuxcnc", "must be a rapid in Z alone"),
        (_no_feed, "mach3", "give the tool a feed"),
        (_too_far, "mach3", "out of range for any machine"),
        (_peck_of_nothing, "haas", "needs a peck depth"),
        (_arc_of_nothing, "grbl", "less than two units of the last decimal place apart"),
        (_one_coolant_off, "linuxcnc", "switch off both first"),
        (_arc_from_nowhere, "linuxcnc", "the arc starts at an unknown position"),
        (_cut_to_nowhere, "linuxcnc", "a cut goes to an unknown position"),
        (_drill_nowhere, "linuxcnc", "a hole is drilled while the position of the tool is unknown"),
    ],
)
def test_what_could_break_something_is_refused(fault: object, name: str, reason: str) -> None:
    """One clear line instead of a program."""
    b = ToolpathBuilder()
    fault(b)  # type: ignore[operator]
    b.end()
    with pytest.raises(PostError, match=reason) as caught:
        write_program(b.build(), load_dialect(name), PostOptions())
    assert "\n" not in str(caught.value)


def test_a_tool_is_not_changed_by_hand_at_a_turning_spindle() -> None:
    """Where a person changes the tool, the spindle stands still."""
    b = started()
    b.tool(1)
    b.spindle(100.0)
    b.rapid(z=10.0)
    b.tool(2)
    b.end()
    with pytest.raises(
        PostError, match=r"a manual tool change is planned while the spindle is running; stop the spindle first"
    ):
        write_program(b.build(), load_dialect("grbl"), PostOptions())
    assert "T2 M6" in write_program(b.build(), load_dialect("haas"), PostOptions())


@pytest.mark.parametrize("name", ["grbl", "mach3", "fagor8055"])
def test_tapping_is_refused_where_there_is_no_cycle_for_it(name: str) -> None:
    """A tap turns back with the spindle: no plain moves can say that."""
    b = started()
    b.drill(1.0, 1.0, DrillCycle("G84", 2.0, -5.0), feed=1.0)
    with pytest.raises(PostError, match="no tapping cycle"):
        written(b, name)


def test_a_toolpath_must_end_once() -> None:
    """Rows after the end, or no end at all, are faults of the toolpath."""
    for motions in ([], [Motion(Kind.END, (0, 0, 0), 0, 0, 0)] * 2):
        with pytest.raises(PostError, match="end"):
            write_program(Toolpath.of_motions(motions), load_dialect("haas"), PostOptions())


def test_mist_is_refused_where_there_is_none() -> None:
    """Haas has M8 only."""
    b = started()
    b.coolant(1)
    with pytest.raises(PostError, match="no M7"):
        written(b, "haas")


def test_turns_and_planes_of_arcs_are_said_where_the_controller_has_them() -> None:
    """Two turns in XZ: G18 and P2 on LinuxCNC; others have no P there."""
    b = started()
    b.arc(False, (0.0, 0.0, 10.0), Arc((5.0, 0.0, 10.0), 18, 2), feed=1.0)
    assert written(b)[-1] == "G18 G3 I5 K0 P2 F60"
    with pytest.raises(PostError, match="arcs of more than one turn"):
        written(b, "haas", end=False)


@pytest.mark.parametrize("name", MILLING)
def test_blending_is_written_or_refused(name: str) -> None:
    """A controller without words for it must not get a program whose corners are cut another way than planned."""
    b = started()
    b.blending(640, 0.1)
    b.feed(x=1.0, feed=5.0)
    b.end()
    profile = load_dialect(name)
    if profile.corner_tolerance or profile.rounding:
        assert "G64" in write_program(b.build(), profile, PostOptions())
    else:
        with pytest.raises(PostError, match="programs cannot state BLENDING"):
            write_program(b.build(), profile, PostOptions())
