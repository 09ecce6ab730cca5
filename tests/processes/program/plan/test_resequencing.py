"""What of a program may change places, and what must stay; every program is worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.errors import PlanError
from leafcut.model.problem import Metric
from leafcut.model.sequence import FixedBlocks, Section, Sequence
from leafcut.processes.program.plan.resequencing import build_problem, find_sequence, first_cut_speeds
from rewriting import program_of

HEAD = "G21 G90 / T1 M6 / S1000 M3 / G0 Z5 / "
FOOT = " / G0 Z20 / M5 / M2"


def sequence_of(body: str, **options: object) -> Sequence:
    return find_sequence(program_of(HEAD + body + FOOT), **options)  # type: ignore[arg-type]


def pieces(body: str, **options: object) -> list[list[tuple[int, int]]]:
    """Return the first and last line of every task, section by section; the body starts on line 5."""
    program = program_of(HEAD + body + FOOT)
    sections = find_sequence(program, **options).sections  # type: ignore[arg-type]
    return [[(c.line, int(program.line[c.end - 1])) for c in s.pieces] for s in sections]


def pairs(section: Section) -> list[tuple[int, int]]:
    return sorted((a, b) for a, b in section.precedence.tolist())


def square(x: float, y: float, side: float, z: float = -1) -> str:
    """Return a closed cut of five blocks and its way in and out: eight blocks."""
    corners = [(x + side, y), (x + side, y + side), (x, y + side), (x, y)]
    cuts = " / ".join(f"X{a} Y{b}" for a, b in corners)
    return f"G0 X{x} Y{y} / G1 Z{z} F100 / {cuts} / G0 Z5"


def test_every_hole_of_a_cycle_is_a_piece_and_its_end_is_not() -> None:
    section = sequence_of("G99 G81 X0 Y0 Z-3 R1 F100 / X10 / Y10 / G80").sections[0]
    assert [c.entry for c in section.pieces] == [(0, 0), (10, 0), (10, 10)]
    assert [(c.line, c.kind, c.bottom, c.leave_z) for c in section.pieces] == [
        (5, "hole", -3, 1),
        (6, "hole", -3, 1),
        (7, "hole", -3, 1),
    ]
    assert section.clearance == 1
    assert section.tool == 1


def test_a_hole_written_out_is_a_piece_with_all_its_pecks() -> None:
    body = "G0 X0 Y0 / Z1 / G1 Z-1 F50 / G0 Z1 / Z-0.5 / G1 Z-2 / G0 Z5 / X10 / G1 Z-2 / G0 Z5"
    assert pieces(body) == [[(5, 11), (12, 14)]]
    section = sequence_of(body).sections[0]
    assert [(c.kind, c.entry, c.exit, c.bottom) for c in section.pieces] == [
        ("hole", (0, 0), (0, 0), -2),
        ("hole", (10, 0), (10, 0), -2),
    ]


def test_a_cut_is_a_piece_from_the_way_to_it_until_the_next() -> None:
    body = "G0 X0 Y0 / G1 Z-1 F50 / X5 / G0 Z5 / X20 Y0 / G1 Z-1 / G2 X24 I2 / G0 Z5"
    assert pieces(body) == [[(5, 8), (9, 12)]]
    assert [(c.kind, c.exit) for c in sequence_of(body).sections[0].pieces] == [("cut", (5, 0)), ("cut", (24, 0))]


def test_a_hole_repeated_in_one_block_is_one_piece() -> None:
    assert pieces("G99 G81 X0 Y0 Z-3 R1 L3 F100 / X10 / X20") == [[(5, 5), (6, 6), (7, 7)]]


def test_a_detour_to_the_first_place_stays_before_the_section() -> None:
    assert pieces("G0 X-50 Y-50 / X0 Y0 / G1 Z-1 F50 / G0 Z5 / X9 / G1 Z-1 / G0 Z5") == [[(6, 8), (9, 11)]]


def test_a_way_below_the_cuts_is_no_way_between_pieces() -> None:
    """At Z-0.5, inside the slot that was cut, the tool is not up: the slot is one piece."""
    slot = "G0 X0 Y0 / G1 Z-1 F50 / X5 / G0 Z-0.5 / X9 / G1 Z-1 / X12 / G0 Z5"
    assert pieces(slot + " / X0 Y20 / G1 Z-1 / X5 / G0 Z5") == [[(5, 12), (13, 16)]]


BARRIERS = {
    "M0": "the program stops for the operator",
    "M1": "the program stops for the operator",
    "T2 M6": "a tool change",
    "T2": "the choice of the next tool",
    "M8": "coolant is switched on or off",
    "S2000": "the spindle is switched on or off",
    "M5 / S1000 M3": "the spindle is switched on or off between two tasks",
    "G43 H1 G0 Z5": "a change of length offset",
    "G53 G0 Z0 / G0 Z5": "a move in machine coordinates",
    "G92 X0": "the origin is moved",
    "G55 / G0 Z5": "a change of work offset",
    "G64 P0.1": "a change of path control (G61, G64)",
    "G20 / F4 / G21 / F100": "a change of units",
    "G93 / G94 F100": "a change of feed mode",
    "/G0 Z9 / G0 Z5": "the block-delete switch may skip the block",
}


@pytest.mark.parametrize("block", BARRIERS)
def test_what_has_a_meaning_of_its_own_parts_sections(block: str) -> None:
    holes = "G0 X{} Y0 / G1 Z-1 F100 / G0 Z5 / X{} / G1 Z-1 / G0 Z5"
    sequence = sequence_of(f"{holes.format(0, 9)} / {block} / {holes.format(20, 30)}")
    assert [len(s.pieces) for s in sequence.sections] == [2, 2]
    between = sequence.items[2]
    assert isinstance(between, FixedBlocks)
    assert any(BARRIERS[block] in reason for reason in between.reasons)


def test_a_coolant_or_tool_change_is_told_in_an_issue() -> None:
    holes = "G0 X{} Y0 / G1 Z-1 F100 / G0 Z5 / X{} / G1 Z-1 / G0 Z5"
    issues = sequence_of(f"{holes.format(0, 9)} / M8 / {holes.format(20, 30)}").issues
    assert [(i.code, i.message, i.place) for i in issues] == [
        ("L501", "the block keeps its position: coolant is switched on or off", "line 11")
    ]


def test_a_reason_with_a_semicolon_is_one_note_at_its_own_line() -> None:
    """The part after the semicolon was reported as a separate reason, both at the first line of the program."""
    issues = sequence_of(
        "G0 Z5 / G81 X0 Y0 Z-1 R1 F100 / X5 / G91 X5 R1 / G80 / G90 / G81 X20 Y0 Z-1 R1 / X25 / G80"
    ).issues
    told = [(i.message, i.place) for i in issues if "inside a cycle" in i.message]
    assert told == [("the block keeps its position: G90/G91 changed inside a cycle; give R and Z again", "line 8")]


def test_blocks_with_the_same_unknown_axis_are_one_note() -> None:
    """Each value was a reason of its own, and a line of the report."""
    holes = "G0 X0 Y0 A10 / G1 Z-1 F100 / G0 Z5 / X9 A20 / G1 Z-1 / G0 Z5 / X20 A30 / G1 Z-1 / G0 Z5"
    issues = sequence_of(holes).issues
    told = [(i.message, i.place) for i in issues if "axis A" in i.message]
    assert told == [("the block keeps its position: the axis A is not understood", "line 5")]


def test_a_program_of_one_piece_says_that_nothing_can_move() -> None:
    sequence = sequence_of("G0 X0 Y0 / G1 Z-1 F100 / X10 / G0 Z5")
    assert [type(i) for i in sequence.items] == [FixedBlocks]
    assert [(i.code, i.message) for i in sequence.issues] == [("L502", "no work in the program can be reordered")]
    assert [(s.reason, s.line) for s in sequence.stays] == [("only", 5)]


def test_of_a_program_that_works_nowhere_it_is_said_that_there_is_no_work() -> None:
    (issue,) = sequence_of("G0 X0 Y0 / X10 / G0 Z5").issues
    assert (issue.code, issue.message) == (
        "L502",
        "no work in the program can be reordered: the block contains no work",
    )


def test_relative_blocks_move_inside_a_piece_and_hold_it_fast_outside() -> None:
    inside = "G0 X{} Y0 / G1 Z-1 F100 / G91 / X2 / G90 / G0 Z5"
    assert pieces(f"{inside.format(0)} / {inside.format(9)}") == [[(5, 10), (11, 16)]]
    outside = "G91 / G0 X9 / G1 Z-6 F100 / G0 Z6 / X9 / G1 Z-6 / G0 Z6 / G90"
    assert pieces(f"G0 X0 Y0 / {outside}") == []


def test_the_spindle_may_turn_round_inside_a_piece() -> None:
    """A tap written out: down, reverse, up, forward."""
    tap = "G0 X{} Y0 / G1 Z-3 F100 / M4 / G1 Z5 / M3"
    assert pieces(f"{tap.format(0)} / {tap.format(9)}") == [[(5, 9), (10, 14)]]


def test_a_dwell_with_the_tool_up_stays() -> None:
    holes = "G0 X{} Y0 / G1 Z-1 F100 / G4 P0.1 / G0 Z5 / X{} / G1 Z-1 / G4 P0.1 / G0 Z5"
    assert pieces(f"{holes.format(0, 9)} / G4 P2 / {holes.format(20, 30)}") == [[(5, 8), (9, 12)], [(14, 17), (18, 21)]]


def test_where_the_tool_rises_higher_a_section_ends() -> None:
    """Two holes this side of a clamp, two on the other, at R 1; over the clamp the tool goes at Z5."""
    sequence = sequence_of("G99 G81 X0 Y0 Z-3 R1 F100 / X9 / G98 X18 / G99 X60 / X70 / X80")
    assert [[c.entry[0] for c in s.pieces] for s in sequence.sections] == [[0, 9, 18], [60, 70, 80]]
    assert [s.clearance for s in sequence.sections] == [1, 1]


def test_passes_at_one_place_with_a_low_way_between_are_one_piece() -> None:
    two = "G0 X{x} Y0 / Z1 / G1 Z-1 F100 / X{y} / G0 Z1 / X{x} / G1 Z-2 / X{y} / G0 Z5"
    assert pieces(" / ".join(two.format(x=x, y=x + 5) for x in (0, 20, 40))) == [[(5, 13), (14, 22), (23, 31)]]


def test_passes_over_the_same_place_keep_their_order() -> None:
    line = "G0 X{} Y0 / G1 Z{} F100 / Y9 / G0 Z5"
    section = sequence_of(" / ".join(line.format(*at) for at in ((0, -1), (30, -1), (0, -2)))).sections[0]
    assert pairs(section) == [(0, 2)]


def test_holes_at_one_place_keep_their_order_and_neighbours_do_not() -> None:
    section = sequence_of("G99 G81 X0 Y0 Z-1 R1 F100 / X5 / X0 Z-3 / X5.05 / X5.5").sections[0]
    assert pairs(section) == [(0, 2), (1, 3)]


def test_cuts_nearer_than_the_tool_is_wide_keep_their_order_where_a_comment_says_how_wide() -> None:
    body = "{}G0 X0 Y0 / G1 Z-1 F100 / X10 / G0 Z5 / X0 Y2 / G1 Z-1 / X10 / G0 Z5"
    assert pairs(sequence_of(body.format("")).sections[0]) == []
    assert pairs(sequence_of(body.format("(end mill, diameter 3 mm) / ")).sections[0]) == [(0, 1)]
    assert pairs(sequence_of(body.format("(end mill, diameter 1.5 mm) / ")).sections[0]) == []


def test_what_lies_inside_comes_before_the_cut_that_frees_it() -> None:
    section = sequence_of(f"{square(90, 0, 10)} / {square(4, 4, 2)} / G0 X8 Y8 / G1 Z-1 / G0 Z5 / {square(0, 0, 10)}")
    assert pairs(section.sections[0]) == [(1, 3), (2, 3)]


def test_inside_a_circle_with_a_lead_in_is_inside() -> None:
    ring = "G0 X8 Y0 / G1 Z-1 F100 / G3 X10 Y0 I1 / G3 X10 Y0 I-10 / G3 X8 Y0 I-1 / G0 Z5"
    body = f"G0 X-5 Y-5 / G1 Z-1 F100 / G0 Z5 / {ring} / G0 X7.5 Y7.5 / G1 Z-1 / G0 Z5"
    assert pairs(sequence_of(body).sections[0]) == [(0, 1)]


def test_a_finishing_cut_inside_the_rough_one_stays_behind_it_in_milling() -> None:
    section = sequence_of(f"{square(50, 0, 10)} / {square(0, 0, 10)} / {square(0.5, 0.5, 9)}").sections[0]
    assert pairs(section) == [(1, 2)]


def test_precedence_is_that_of_brute_force_on_random_holes() -> None:
    """Pairs nearer than a touch, found by all distances; those that follow from others are left out."""
    rng = np.random.default_rng(3)
    xy = rng.integers(0, 60, (150, 2)) * 0.05
    body = "G99 G81 Z-1 R1 F100 " + " / ".join(f"X{x:.2f} Y{y:.2f}" for x, y in xy.tolist())
    section = sequence_of(body).sections[0]
    assert len(section.pieces) == int((np.diff(xy, axis=0) != 0).any(axis=1).sum()) + 1
    place = np.array([c.entry for c in section.pieces])
    near = np.hypot(*(place[:, None] - place[None]).transpose(2, 0, 1)) < 0.0901
    wanted = np.triu(near, 1)
    reached = np.zeros_like(wanted)
    for a, b in sorted(pairs(section), key=lambda pair: pair[1]):
        reached[:, b] |= reached[:, a]
        reached[a, b] = True
    closure = wanted.copy()
    for k in range(len(closure)):
        closure |= closure[:, k : k + 1] & closure[k : k + 1]
    assert (reached == closure).all()
    assert wanted.any()


def test_a_laser_is_known_by_its_beam_and_its_ways_are_the_dark_ones() -> None:
    cut = "G1 X{0} Y0 F3000 / M3 S80 / G4 P0.5 / G1 X{1} F100 / M5 S0"
    program = program_of("G21 G90 / " + " / ".join(cut.format(x, x + 5) for x in (0, 10, 20)) + " / G0 X0 Y0 / M2")
    sequence = find_sequence(program)
    assert sequence.process == "laser"
    section = sequence.sections[0]
    assert [(c.line, c.kind, c.entry, c.exit) for c in section.pieces] == [
        (2, "cut", (0, 0), (5, 0)),
        (7, "cut", (10, 0), (15, 0)),
        (12, "cut", (20, 0), (25, 0)),
    ]
    assert section.end == (0, 0)


def test_a_torch_is_known_and_rises_between_cuts() -> None:
    cut = "G0 X{0} Y0 / Z3 / M3 / G4 P0.6 / G1 Z1.5 F500 / X{1} F2000 / M5 / G0 Z15"
    text = "G21 G90 (plasma) / G0 Z15 / " + " / ".join(cut.format(x, x + 5) for x in (0, 10, 20)) + " / X0 Y9 / M2"
    sequence = find_sequence(program_of(text))
    assert sequence.process == "plasma"
    assert [c.line for c in sequence.sections[0].pieces] == [3, 11, 19]
    assert sequence.sections[0].clearance == 15


def test_grbl_power_words_switch_the_beam() -> None:
    cut = "G0 X{0} Y0 S0 / G1 X{1} S500 F800"
    text = "G21 G90 / M4 S0 / " + " / ".join(cut.format(x, x + 5) for x in (0, 10, 20)) + " / S0 / M5 / M2"
    sequence = find_sequence(program_of(text))
    assert sequence.process == "laser"
    assert [c.line for c in sequence.sections[0].pieces] == [3, 5, 7]


def test_the_process_is_known_or_chosen() -> None:
    assert sequence_of("G99 G81 X0 Y0 Z-3 R1 F100 / X10").process == "drill"
    assert sequence_of(square(0, 0, 10)).process == "mill"
    assert sequence_of(square(0, 0, 10), process="laser").process == "laser"
    with pytest.raises(PlanError, match="did you mean 'drill'"):
        sequence_of(square(0, 0, 10), process="drll")


def test_the_pieces_tile_the_program() -> None:
    holes = "G0 X{} Y0 / G1 Z-1 F100 / G0 Z5 / X{} / G1 Z-1 / G0 Z5"
    program = program_of(HEAD + f"{holes.format(0, 9)} / M8 / {holes.format(20, 30)}" + FOOT)
    edges = [0]
    for item in find_sequence(program).items:
        spans = [(item.begin, item.end)] if isinstance(item, FixedBlocks) else [(c.begin, c.end) for c in item.pieces]
        for begin, end in spans:
            assert begin == edges[-1] and end > begin
            edges.append(end)
    assert edges[-1] == program.n_blocks


def test_the_problem_of_a_section_has_a_cluster_a_piece() -> None:
    section = sequence_of(f"{square(4, 4, 2)} / {square(0, 0, 10)} / G0 X20 Y0 / G1 Z-1 / X25 / G0 Z5").sections[0]
    problem = build_problem(section, Metric(), (1.0, 2.0), None)
    assert problem.entry.tolist() == [[4, 4], [0, 0], [20, 0]]
    assert problem.exit.tolist() == [[4, 4], [0, 0], [25, 0]]
    assert problem.cluster.tolist() == [0, 1, 2]
    assert problem.precedence.tolist() == [[0, 1]]
    assert problem.start == (1.0, 2.0)
    assert problem.end is None


def test_what_stays_is_said_with_the_line_that_it_is_about() -> None:
    holes = "G99 G81 X0 Y0 Z-1 R1 F100 / X5 / X9 / G80"
    first = f"G21 G90 / T1 M6 / S1000 M3 / G0 X0 Y0 / G43 Z5 H1 / {holes}"
    second = f"M5 / T2 M6 / S900 M3 / G0 G43 Z5 H2 / {holes} / M2"
    sequence = find_sequence(program_of(f"{first} / {second}"))
    assert ("the block keeps its position: a tool change", "line 11") in [(i.message, i.place) for i in sequence.issues]
    assert ("unknown-height", 4) in [(s.reason, s.line) for s in sequence.stays]


def test_full_circles_of_a_mill_are_cuts_and_no_holes() -> None:
    section = sequence_of("G0 X0 Y0 / G1 Z-1 F50 / G2 I3 / G0 Z5 / X20 / G1 Z-1 / G2 I3 / G0 Z5").sections[0]
    assert [c.kind for c in section.pieces] == ["cut", "cut"]


def test_the_speed_of_a_piece_is_that_of_its_first_cut() -> None:
    """The last speed before it applies; a task without a speed has that of the previous task."""
    body = " / ".join(
        f"{speed}{square(20.0 * k, 0, 5)}"
        for k, speed in enumerate(["", "S2000 / ", "", "S500 / S3000 / ", "S1000 / "])
    )
    program = program_of(HEAD + body + FOOT)
    sections = find_sequence(program).sections
    told = [speed for section in sections for speed in first_cut_speeds(program, section).tolist()]
    assert told == [1000, 2000, 2000, 3000, 1000]
