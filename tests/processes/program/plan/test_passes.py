"""Significant order for a mill of unknown diameter, and outlines held by tabs."""

from __future__ import annotations

import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.gcode.tool_comments import tool_diameter_in_comments
from leafcut.processes.program.plan.resequencing import find_sequence
from rewriting import program_of

HEAD = "G21 G90 / {}T1 M6 / S1000 M3 / G0 Z5 / "
FOOT = " / G0 Z20 / M5 / M2"


def ordered(cuts: list[str], before: int, after: int, comment: str = "", process: str = "auto") -> bool:
    """Return whether one of the cuts must come before another."""
    program = program_of(HEAD.format(comment) + " / ".join(cuts) + FOOT)
    section = find_sequence(program, process=process).sections[0]
    assert len(section.pieces) == len(cuts)
    known = {before}
    for a, b in sorted(section.precedence.tolist()):
        if a in known:
            known.add(b)
    return after in known


def line(y: float, z: float = -1, x0: float = 0, x1: float = 60) -> str:
    return f"G0 X{x0} Y{y} / G1 Z{z} F100 / X{x1} / G0 Z5"


def test_a_deeper_cut_near_a_shallower_one_stays_behind_it() -> None:
    assert ordered([line(0, -1), line(3, -2)], 0, 1)
    assert ordered([line(0, -2), line(3, -1)], 0, 1)


def test_cuts_at_two_depths_that_no_mill_reaches_at_once_are_free() -> None:
    assert not ordered([line(0, -1), line(13, -2)], 0, 1)


@pytest.mark.parametrize(
    ("comment", "diameter", "kept"),
    [
        ("", 3, {0: 1}), ("", 6, {0: 1, 1: 2}), ("", 0, {0: 1, 1: 2}),
        # A comment counts more than the option.
        ("(T1 D=3. end mill) / ", 6, {0: 1}), ("(T1 D=6. end mill) / ", 3, {0: 1, 1: 2}),
    ],
)  # fmt: skip
def test_a_tool_diameter_counts_for_a_mill_without_a_comment(
    comment: str, diameter: float, kept: dict[int, int]
) -> None:
    """Lines at two depths, 2 and 5 mm apart: the first two overlap for both mills, the last two for the wider one."""
    cuts = " / ".join((line(0, -2), line(2, -1), line(7, -2)))
    section = find_sequence(program_of(HEAD.format(comment) + cuts + FOOT), tool_diameter=diameter).sections[0]
    assert dict(section.precedence.tolist()) == kept


def test_a_finishing_pass_beside_its_roughing_stays_behind_it() -> None:
    rough_and_finished = [line(0.5), line(50.5), line(50), line(0)]
    assert ordered(rough_and_finished, 0, 3)
    assert ordered(rough_and_finished, 1, 2)
    assert not ordered(rough_and_finished, 0, 1)


def test_single_lines_at_one_depth_are_free() -> None:
    assert not ordered([line(0), line(4)], 0, 1)


def test_lines_that_only_meet_at_their_ends_are_no_finishing_pass() -> None:
    assert not ordered([line(0), line(0, x0=60.5, x1=120)], 0, 1)


def test_rows_that_clear_a_surface_keep_their_order() -> None:
    rows = [line(y) for y in (0, 20, 40, 55)]
    assert ordered(rows, 0, 3)


@pytest.mark.parametrize("places", [(0, 40, 20, 55), (0, 20), (0, 20, 60)])
def test_slots_that_do_not_advance_evenly_are_free(places: tuple[int, ...]) -> None:
    slots = [line(y) for y in places]
    assert not ordered(slots, 0, len(slots) - 1)


def test_holes_of_several_depths_are_free() -> None:
    holes = ["G0 X0 Y0 / G1 Z-1 F50 / G0 Z5", "G0 X6 Y0 / G1 Z-2 / G0 Z5"]
    assert not ordered(holes, 0, 1)


def test_carving_that_follows_a_surface_is_free_at_all_depths() -> None:
    carved = [f"G0 X0 Y{y} / G1 Z-1 F100 / X20 Z-{y + 2} / X40 Z-1 / X60 Z0.5 / G0 Z5" for y in (0, 2)]
    assert not ordered(carved, 0, 1)


@pytest.mark.parametrize("process, gap", [("mill", 6.0), ("laser", 1.0)])
def test_what_lies_inside_an_outline_that_tabs_hold_comes_before_it(process: str, gap: float) -> None:
    h = gap / 2
    places = (
        [(20 + h, 0), (40, 0), (40, 20 - h)], [(40, 20 + h), (40, 40), (20 + h, 40)],
        [(20 - h, 40), (0, 40), (0, 20 + h)], [(0, 20 - h), (0, 0), (20 - h, 0)],
    )  # fmt: skip
    on, off = ("G1 Z-1 F100", "G0 Z5") if process == "mill" else ("M3", "M5")
    cuts = [f"G0 X20 Y{y} / {on} / G1 X24 F100 / {off}" for y in (18, 22)]
    for (x0, y0), *others in places:
        way = " / ".join(f"G1 X{x} Y{y}" for x, y in others)
        cuts.append(f"G0 X{x0} Y{y0} / {on} / {way} / {off}")
    body = " / ".join([*cuts, cuts[0].replace("X20 ", "X200 ").replace("X24 ", "X204 ")])
    head = HEAD.format("") if process == "mill" else "G21 G90 / G0 Z5 / "
    section = find_sequence(program_of(head + body + FOOT), process=process).sections[0]
    begins = {c.entry: k for k, c in enumerate(section.pieces)}
    found = {tuple(pair) for pair in section.precedence.tolist()}
    for inner in ((20, 18), (20, 22)):
        for outer, *_ in places:
            assert (begins[inner], begins[outer]) in found


@pytest.mark.parametrize(
    "comment, width",
    [
        ("(T1 D=10. CR=0. - ZMIN=-8. - FLAT END MILL) / (T5 D=6.8 CR=0. - DRILL)", 10.0),
        ("(1 = End Mill {6 mm})", 6.0),
        ("(End Mill {0.25 inch})", 6.35),
        ('(1/8" ENDMILL)', 3.175),
        ("( T1 |  8. FLAT ENDMILL | H1 )", 8.0),
        ("(2 FLUTE END MILL)", 0.0),
        ("(T2 D=4.)", 0.0),
        ("(ENDMILL)", 0.0),
    ],
)
def test_the_width_of_a_tool_is_what_its_own_comment_says(comment: str, width: float) -> None:
    program = program_of(HEAD.format(comment + " / ") + line(0) + FOOT)
    assert tool_diameter_in_comments(program, program.n_blocks - 4) == pytest.approx(width)


def test_the_list_of_tools_at_the_top_tells_the_width_far_below() -> None:
    program = program_of(
        "(T1 D=8.) / (T2 D=3.) / G21 G90 / " + "G4 P0 / " * 400 + "T1 M6 / S1000 M3 / G0 Z5 / " + line(0)
    )
    assert tool_diameter_in_comments(program, program.n_blocks - 1) == 8.0


def test_in_a_subprogram_the_comment_of_the_tool_that_calls_it_counts() -> None:
    """The change before it in the text belongs to the last tool: obstacles would be passed 4.5 mm too near."""
    body = "T1 M6 / (10MM ENDMILL) / S1000 M3 / M98 P2 / T2 M6 / (1MM ENDMILL) / S1000 M3 / M98 P2 / M30 / "
    called = "O2 / G90 G0 Z5. / G1 Z-1. F100. / X10. / G0 Z5. / M99 / %"
    lines = f"% / O1 / G21 G90 G94 G17 / {body}{called}".replace(" / ", "\n")
    program = interpret_program(lines, load_dialect("haas"))
    cuts = [block for block in range(program.n_blocks) if program.lines[program.line[block] - 1].startswith("X10.")]
    assert [tool_diameter_in_comments(program, block) for block in cuts] == [10.0, 1.0]


def test_mills_that_are_described_by_their_name_keep_what_they_reach_in_order() -> None:
    assert ordered([line(0), line(5)], 0, 1, comment="(1 = End Mill {6 mm}) / ")
    assert not ordered([line(0), line(7)], 0, 1, comment="(1 = End Mill {6 mm}) / ")
