"""The modules that find the sections of a program, each by itself: on programs of a few blocks, worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain

from leafcut.gcode.program import Program
from leafcut.model.issue import Issue
from leafcut.model.sequence import FixedBlocks, ProgramTask, Section, Sequence
from leafcut.processes.program.plan.resequencing import (
    SectionFinder,
    count_saved_tool_changes,
    divide_at_operations,
    follows_compensation,
    merge_sections,
    must_stay_last,
    stops_before_work,
    with_reversible,
)
from rewriting import program_of

HOLE = "G0 X{0} Y0 / G1 Z-1 F100 / G0 Z5"
CUT = "G0 X{0} Y0 / G1 Z-1 F100 / Y9 / G0 Z5"
HEAD = "G21 G90 / S1000 M3 / G0 Z5"


def found(*bodies: str, process: str = "mill") -> tuple[Program, SectionFinder, Sequence]:
    """Return a program, its section finder, and the resulting sequence."""
    program = program_of(" / ".join([HEAD, *bodies, "G0 Z20 / M5 / M2"]))
    finder = SectionFinder(program, process)
    return program, finder, Sequence(tuple(finder.sections_and_fixed_blocks()), process, (), ())


def places(sequence: Sequence) -> list[list[float]]:
    """Return the X of every piece of every section."""
    return [[run.entry[0] for run in section.pieces] for section in sequence.sections]


def texts(program: Program, item: ProgramTask | FixedBlocks) -> list[str]:
    return [program.lines[int(program.line[block]) - 1].strip() for block in range(item.begin, item.end)]


# -- SectionFinder ---------------------------------------------------------------------------------------------------


def test_sections_and_what_stays_are_all_blocks_of_the_program_each_once() -> None:
    program, finder, sequence = found(*(HOLE.format(x) for x in (0, 10, 20)), "M0", *(CUT.format(x) for x in (40, 50)))
    edges = [0]
    for item in sequence.items:
        for run in item.pieces if isinstance(item, Section) else (item,):
            assert run.begin == edges[-1]
            edges.append(run.end)
    assert edges[-1] == program.n_blocks
    assert places(sequence) == [[0, 10, 20], [40, 50]]
    assert [s.kind for section in finder.sections() for s in section.pieces] == ["hole"] * 3 + ["cut"] * 2


def test_a_piece_begins_with_the_way_to_its_work_and_ends_with_the_rise() -> None:
    program, _, sequence = found(*(HOLE.format(x) for x in (0, 10, 20)))
    run = sequence.sections[0].pieces[1]
    assert texts(program, run) == ["G0 X10 Y0", "G1 Z-1 F100", "G0 Z5"]
    assert (run.entry, run.exit) == ((10, 0), (10, 0))
    assert (run.arrive_z, run.leave_z, run.bottom) == (5, 5, -1)
    assert sequence.sections[0].clearance == 5


def test_ways_across_below_the_zero_of_the_part_begin_no_pieces() -> None:
    """The second, the third and the fourth hole are reached below the part's surface: they go with the first."""
    low = [f"G0 X{x} Y0 / G1 Z-2 F100 / G0 Z-0.5" for x in (0, 10, 20, 30)]
    *_, sequence = found(*low, "G0 Z5", HOLE.format(50), HOLE.format(60))
    assert places(sequence) == [[0, 50, 60]]


# -- fixed_last ------------------------------------------------------------------------------------------------------


def test_a_feed_where_the_piece_ended_holds_it_and_a_way_across_does_not() -> None:
    for behind, held in (("G1 Z-2 / G0 Z5", True), ("G0 X90 Y0 / G1 Z-2 / G0 Z5", False), ("G0 Z9 / X90", False)):
        program, finder, _ = found(HOLE.format(0), HOLE.format(10), "M8", behind)
        run = ProgramTask(6, 9, "hole", (10, 0), (10, 0), 5, 5, -1, 7)
        assert texts(program, run)[0] == "G0 X10 Y0"
        assert must_stay_last(program, finder.rows, run) == held, behind


def test_a_tool_stops_before_its_work_where_a_stop_comes_first() -> None:
    program, finder, _ = found(HOLE.format(0), "M0", HOLE.format(10))
    first_work, second_work = (int(row) for row in finder.rows.cut.nonzero()[0])
    assert stops_before_work(program, finder.rows, first_work + 1)
    assert not stops_before_work(program, finder.rows, first_work)
    assert not stops_before_work(program, finder.rows, second_work)
    assert stops_before_work(program, finder.rows, second_work + 1)  # the end is a stop


def test_compensation_ends_in_the_first_move_behind_the_last_one_under_it() -> None:
    program, finder, _ = found("G0 X0 Y0 / G1 Z-1 F100 / G41 D1 / G1 X5 Y5 / G40 / G0 Z5 / G0 X20")
    rows = [row for row in range(len(program.path)) if follows_compensation(program, row)]
    blocks = finder.program.row_block[rows].tolist()
    ended = {program.lines[int(program.line[b]) - 1].strip() for b in blocks}
    assert ended == {"G40", "G0 Z5"}
    program, finder, _ = found("G0 X0 Y0 / G1 Z-1 F100 / G41 D1 G1 X5 Y5 / G40 G0 Z5 / G0 X20")
    rows = [row for row in range(len(program.path)) if follows_compensation(program, row)]
    assert {program.lines[int(program.line[b]) - 1].strip() for b in finder.program.row_block[rows]} == {"G40 G0 Z5"}


# -- merging ---------------------------------------------------------------------------------------------------------


def tool(number: int, *holes: int) -> str:
    return f"T{number} M6 / S1000 M3 / G0 Z5 / " + " / ".join(HOLE.format(x) for x in holes) + " / G0 Z20 / M5"


def test_as_many_changes_are_saved_as_were_counted_before() -> None:
    for order, saved in (((1, 2, 1), 1), ((1, 2, 1, 2), 2), ((1, 2, 3), 0), ((1, 2, 3, 1), 1)):
        bodies = [tool(number, 100 * k, 100 * k + 10) for k, number in enumerate(order)]
        program, finder, sequence = found(*bodies)
        joined = merge_sections(program, sequence, finder.rows)
        assert count_saved_tool_changes(program, sequence, finder.rows) == saved
        assert len(sequence.sections) - len(joined.sections) == saved
        assert sum("M6" in " ".join(texts(program, kept)) for kept in joined.dropped) == saved
        assert sorted(chain(*places(joined))) == sorted(chain(*places(sequence)))


def test_work_of_another_tool_at_the_same_place_is_not_passed() -> None:
    program, finder, sequence = found(tool(1, 0, 50), tool(2, 20, 10), tool(1, 30, 10))
    assert places(sequence) == [[0, 50], [20, 10], [30, 10]]
    assert merge_sections(program, sequence, finder.rows) is sequence


# -- operations ------------------------------------------------------------------------------------------------------


def test_a_comment_that_marks_an_operation_divides_a_section_and_its_pairs() -> None:
    cuts = [CUT.format(x) for x in (0, 20, 20, 60, 80)]
    program, finder, sequence = found(*cuts[:2], "(SLOT)", *cuts[2:])
    assert places(sequence) == [[0, 20, 20, 60, 80]]
    assert sequence.sections[0].precedence.tolist() == [[1, 2]]
    apart = divide_at_operations(program, sequence, finder.rows, mix_operations=False)
    assert places(apart) == [[0, 20], [20, 60, 80]]
    assert [section.precedence.tolist() for section in apart.sections] == [[], []]
    assert places(divide_at_operations(program, sequence, finder.rows, mix_operations=True)) == places(sequence)


def test_pairs_within_a_part_of_a_section_are_counted_from_its_first_piece() -> None:
    cuts = [CUT.format(x) for x in (0, 20, 40, 60, 60)]
    program, finder, sequence = found(*cuts[:2], "(SLOT)", *cuts[2:])
    apart = divide_at_operations(program, sequence, finder.rows, mix_operations=False)
    assert [section.precedence.tolist() for section in apart.sections] == [[], [[1, 2]]]


def test_only_the_first_part_of_a_section_starts_where_it_did_and_only_the_last_ends_there() -> None:
    cuts = [CUT.format(x) for x in (0, 20, 40, 60)]
    behind = "M1 / G0 X90 Y0 / G1 Z-1 / G0 Z5"
    program, finder, sequence = found("G0 X-9 Y-9", *cuts[:2], "(SLOT)", *cuts[2:], behind)
    whole = sequence.sections[0]
    assert (whole.start, whole.end) == ((-9, -9), (90, 0))
    first, last, *_ = divide_at_operations(program, sequence, finder.rows, mix_operations=False).sections
    assert (first.start, first.end) == (whole.start, None)
    assert (last.start, last.end) == (None, whole.end)


# -- reversing -------------------------------------------------------------------------------------------------------


def test_cuts_that_may_be_turned_are_marked_and_nothing_else_is_changed() -> None:
    closed = "G0 X{0} Y0 / G1 Z-1 F100 / X{1} / Y9 / X{0} / Y{2} / G0 Z5"
    bodies = [CUT.format(0), HOLE.format(20), closed.format(60, 70, 0), closed.format(80, 88, 0.5), CUT.format(90)]
    program, finder, sequence = found(*bodies)
    sequence = replace(sequence, issues=(Issue("L503", "said before"),))
    marked = with_reversible(program, sequence, finder.rows)
    runs = [run for section in marked.sections for run in section.pieces]
    turned = {0: True, 20: False, 60: False, 80: False, 90: True}
    assert {run.entry[0]: run.reversible for run in runs} == turned
    plain = [replace(run, reversible=False) for run in runs]
    assert plain == [run for section in sequence.sections for run in section.pieces]
    assert [issue.message for issue in marked.issues] == ["said before", "2 cuts can be reversed"]


def test_one_cut_that_may_be_turned_is_told_in_the_singular() -> None:
    program, finder, sequence = found(HOLE.format(0), CUT.format(20), HOLE.format(40))
    (issue,) = with_reversible(program, sequence, finder.rows).issues
    assert (issue.code, issue.message) == ("L504", "1 cut can be reversed")
