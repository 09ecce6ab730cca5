"""The rewriter's words: expected texts worked by hand, one rule each."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.errors import PostError
from leafcut.model.sequence import FixedBlocks, Section, Sequence
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.insertion import format_length, insert_words, insert_words_within, renumbered
from leafcut.processes.program.post.rewriter import OriginalPositions, rewrite
from rewriting import program_of, rewritten

HEAD = "G21 G90 / S1000 M3 / G0 Z5 / X-9 Y-9 / "
FOOT = " / G0 Z20 / M5 / M2"


def body(text: str, *orders: list[int]) -> str:
    """Return the rewritten text between header and footer."""
    new = rewritten(HEAD + text + FOOT, *orders)
    assert new.startswith(HEAD)
    assert new.endswith(FOOT)
    return new.removeprefix(HEAD).removesuffix(FOOT)


def test_pieces_that_say_all_themselves_move_as_they_are() -> None:
    one, two = "G0 X0 Y0 / G1 Z-1 F100 / G0 Z5", "G0 X9 Y5 / G1 Z-1 F100 / X3 / G0 Z5"
    assert body(f"{one} / {two}", [1, 0]) == f"{two} / {one}"


def test_an_axis_that_was_not_stated_is_added() -> None:
    """The second hole has Y from the first, the third X from the second."""
    text = "G0 X0 Y1 / G1 Z-1 F100 / G0 Z5 / X9 / G1 Z-1 / G0 Z5 / Y7 (up) / G1 Z-1 / G0 Z5"
    assert body(text, [2, 0, 1]) == (
        "Y7 X9.0 F100 (up) / G1 Z-1 / G0 Z5 / G0 X0 Y1 / G1 Z-1 F100 / G0 Z5 / X9 / G1 Z-1 / G0 Z5"
    )


def test_a_feed_is_written_as_it_was_where_the_new_neighbour_has_another() -> None:
    text = "G0 X0 Y0 / G1 Z-1 F100. / G0 Z5 / X9 Y0 / G1 Z-1 / G0 Z5 / X8 Y5 / G1 Z-1 F200 / G0 Z5"
    assert body(text, [0, 2, 1]) == (
        "G0 X0 Y0 / G1 Z-1 F100. / G0 Z5 / X8 Y5 / G1 Z-1 F200 / G0 Z5 / X9 Y0 F100. / G1 Z-1 / G0 Z5"
    )


def test_the_piece_that_is_first_now_says_the_feed_that_stood_elsewhere() -> None:
    """On the line of the tool change, as torches have it; and once only, however many sections follow each other."""
    cut = "G0 X{0} Y0 / M3 / G1 X{1} / M5"
    cuts = [cut.format(x, x + 5) for x in (0, 20, 40)]
    head = "G21 G90 / T1 M6 F5840 / "
    new = rewritten(head + " / ".join(cuts) + " / M2", [2, 1, 0])
    assert new == head + " / ".join([cuts[2].replace("Y0", "Y0 F5840"), *cuts[1::-1]]) + " / M2"
    assert rewritten(head + " / ".join(cuts) + " / M2", [0, 2, 1]).count("F5840") == 1


def test_what_the_first_piece_said_for_the_others_the_new_first_one_says() -> None:
    first, other = "G0 X0 Y0 {}/ G1 Z-1 F100 / G0 Z5", "G0 X9 Y5 {}/ G1 Z-1 / G0 Z5"
    for word, new in (("S1000 ", "G0 X9 Y5 F100 S1000 / G1"), ("G90 ", "G90 G0 X9 Y5 F100 / G1")):
        text = f"{first.format(word)} / {other.format('')}"
        assert body(text, [1, 0]).startswith(new), word


def test_a_feed_mode_that_the_first_piece_states_does_not_stand_for_its_feed() -> None:
    """The second task comes first and also states G94; the first task keeps its feed."""
    text = "G0 X0 Y0 / G1 Z-1 F100 / G0 Z5 / G0 X9 Y0 / G94 / G1 Z-1 / G0 Z5 / G0 X8 Y5 / G1 Z-1 F200 / G0 Z5"
    assert body(text, [2, 1, 0]) == (
        "G94 G0 X8 Y5 / G1 Z-1 F200 / G0 Z5 / G0 X9 Y0 F100 / G94 / G1 Z-1 / G0 Z5 / G0 X0 Y0 / G1 Z-1 F100 / G0 Z5"
    )


def test_a_hole_that_stays_rises_as_high_as_it_did() -> None:
    """G99 leaves 5 in mind for the G98 behind M9, which follows another hole now: it rises there before."""
    text = "G99 G81 X0 Y0 Z-3 R1 F100 / X9 Y0 / M9 / G98 X7 Y7 / G80"
    assert body(text, [1, 0]).endswith("M9 / G98 X7 Y7 / G80")
    text = "G99 G81 X0 Y0 Z-3 R1 F100 / G81 X9 Y0 Z-4 / M9 / G98 G82 X7 Z-4 R1 P1 / G80"
    assert " / G80 / G0 X9.0 Y0.0 / G0 Z5.0 / M9 / G98 G82 X7 Z-4 R1 P1 / G80" in body(text, [1, 0])


def test_the_initial_height_is_the_one_before_the_first_hole_of_a_series() -> None:
    """G99 leaves the tool at 1 behind each hole; M8 ends no series, a rapid does."""
    holes = "G99 G81 X0 Y0 Z-3 R1 F100 / X9 / M8 / X18 / G98 X20 / G80 / G0 Z9 / G0 X3 / G99 G81 X0 Z-3 R2 / X9"
    program = program_of(HEAD + holes + FOOT)
    original = OriginalPositions(program)
    height = {int(program.line[block]): original.initial_height_before(block) for block in range(program.n_blocks)}
    assert [height[line] for line in (5, 6, 7, 8, 9)] == [5] * 5
    assert [height[line] for line in (13, 14)] == [9, 9]


def test_a_hole_that_stays_and_goes_on_with_a_cycle_that_is_another_now_is_refused_with_its_line() -> None:
    """The last hole takes its depth from the second one; behind the first it would be 1 mm less deep."""
    program = program_of(HEAD + "G98 G81 X0 Y0 Z-3 R5 F100 / X9 Y0 Z-4 / X20 Y0 / G80" + FOOT)
    (section,) = find_sequence(program).sections
    pieces, last = section.pieces[:2], section.pieces[2].begin
    sequence = Sequence(
        (FixedBlocks(0, pieces[0].begin), Section(pieces), FixedBlocks(last, program.n_blocks)), "drill"
    )
    with pytest.raises(PostError, match=r"^line 7 continues a drilling cycle, which has changed$"):
        rewrite(program, sequence, [np.array([1, 0])])


def test_a_cycle_ends_before_a_way_in_machine_coordinates_that_stays() -> None:
    """G28 under a cycle is an error of the controller; the rapid of the last piece ended it before."""
    text = "G98 G81 X0 Y0 Z-3 R1 F100 / G0 X9 Y0 / G1 Z-1 / G0 Z5 / G28 Z5"
    assert body(text, [1, 0]).endswith("G98 G81 X0 Y0 Z-3 R1 F100 / G80 / G28 Z5")


def test_a_last_piece_that_rose_for_the_end_rises_as_high_when_it_is_first() -> None:
    """From the hole to the cut the tool rises from 1 to 5; after the cut it rises to 5 again."""
    text = "G99 G81 X0 Y0 Z-3 R1 F100 / G0 X9 Y0 Z5 / G1 Z-1 / Z1"
    new = rewritten(HEAD + text + " / G0 Z5 / M5 / M2", [1, 0])
    assert " / G1 Z-1 / Z1 / G0 Z5.0 / G99 G81 X0 Y0 Z-3 R1 F100 / G0 Z5 / M5 / M2" in new


@pytest.mark.parametrize("came, rose, height", [(4, 9, 4), (9, 5, 5)])
def test_behind_the_last_piece_the_tool_rises_as_it_came_or_rose(came: int, rose: int, height: int) -> None:
    """The original goes from Z1 to the stop at `rose`; made first, the piece is left at the lower of both heights."""
    text = f"G99 G81 X0 Y0 Z-3 R1 F100 / G0 X9 Y0 Z{came} / G1 Z-1 / Z1"
    new = rewritten(f"{HEAD}{text} / G0 Z{rose} / M5 / M2", [1, 0])
    assert f" / G1 Z-1 / Z1 / G0 Z{height}.0 / G99 G81 X0 Y0 Z-3 R1" in new


def test_the_new_first_place_is_reached_no_lower_than_the_plane_at_which_the_tool_reached_the_old_one() -> None:
    """From 1, the tool rises to the plane 6 of the first hole and goes over there; the next place it reaches at 2."""
    text = "G1 Z0 F100 / G0 Z1 / M8 / G99 G81 X0 Y0 Z-3 R6 F100 / G80 / G0 Z2 / X9 Y0 / G1 Z-3 F100 / G0 Z2"
    assert "M8 / G0 Z6.0 / " in rewritten(HEAD + text + FOOT, [1, 0])


def test_a_series_that_began_below_its_plane_is_not_begun_below_it_elsewhere() -> None:
    """The second hole rises to its own plane 1 and the tool crosses at 2; made second, the series starts at 2."""
    text = "G1 Z0 F100 / M8 / G99 G81 X0 Y0 Z-3 R2 F100 / G98 G81 X9 Y0 Z-3 R1 / G0 Z5 / X20 Y0 / G1 Z-1 / G0 Z5"
    text += " / G0 X30 Y0 / G1 Z-1 / G0 Z5"
    new = body(text, [1, 0, 2])
    assert " / G0 X0.0 Y0.0 / G0 Z2.0 / G99 G81 X0 Y0 Z-3 R2" in new
    assert "Z1.0" not in new


def test_a_motion_is_added_in_front() -> None:
    """After the first piece, which ends with a feed, the second states G0; the third relies on the G0 before it."""
    text = "G0 X0 Y0 / G1 Z-1 F100 / Z5 / G0 X9 Y0 / G1 Z-1 / G0 Z5 / N7X8Y5 / G1 Z-1 / Z5"
    assert body(text, [0, 2, 1]) == ("G0 X0 Y0 / G1 Z-1 F100 / Z5 / N7G0X8Y5 / G1 Z-1 / Z5 / G0 X9 Y0 / G1 Z-1 / G0 Z5")


def test_the_first_hole_of_a_cycle_gets_its_words_and_the_others_keep_theirs() -> None:
    text = "G99 G83 X0 Y0 Z-3 R1.0 Q1.5 F100 / X9 Y0 / X9 Y9 / G80"
    assert body(text, [2, 0, 1]) == (
        "G99 G83 X9 Y9 R1.0 Z-3 Q1.5 F100 / G99 G83 X0 Y0 Z-3 R1.0 Q1.5 F100 / X9 Y0 / G80"
    )


def test_a_cycle_that_a_block_states_is_not_stated_twice() -> None:
    """The second block names its cycle and takes Z and R from the first."""
    text = "G99 G81 X0 Y0 Z-3 R1 F100 / G81 X9 Y0 / X9 Y9 / G80"
    assert body(text, [1, 2, 0]) == ("G99 G81 X9 Y0 R1 Z-3 F100 / X9 Y9 / G99 G81 X0 Y0 Z-3 R1 F100 / G80")


def test_another_depth_in_a_cycle_is_said_again() -> None:
    text = "G99 G81 X0 Y0 Z-3 R1 F100 / X9 Y0 Z-4 / X9 Y9 / G80"
    assert body(text, [0, 2, 1]) == "G99 G81 X0 Y0 Z-3 R1 F100 / G81 X9 Y9 R1 Z-4 / X9 Y0 Z-4 / G80"


def test_retract_words_are_said_where_they_differ() -> None:
    """Both rise to 5: by G98, and by G99 with R 5."""
    text = "G98 G81 X0 Y0 Z-3 R5 F100 / X9 Y0 / G99 X9 Y9 / X0 Y9 / G80"
    assert body(text, [3, 0, 1, 2]) == (
        "G99 G81 X0 Y9 R5 Z-3 F100 / G98 G81 X0 Y0 Z-3 R5 F100 / X9 Y0 / G99 X9 Y9 / G80"
    )


def test_a_plane_and_absolute_centres_are_said_again() -> None:
    text = (
        "G0 X0 Y0 / G1 Z-1 F100 / G2 X4 I2 J0 / G0 Z5 / X20 Y0 / G1 Z-1 / G90.1 G18 G2 X24 Z-1 I22 K-1 / G0 Z5 / "
        "X40 Y0 / G1 Z-1 / G2 X44 Z-1 I42 K-1 / G0 Z5"
    )
    new = body(text, [0, 2, 1])
    assert "G18 G90.1 X40 Y0" in new
    assert "G17 G91.1" not in new


def test_what_stays_behind_gets_back_what_it_relies_on() -> None:
    """M8 separates two sections; the X5 after it relies on feed, motion and the Y of the last task."""
    text = "G0 X0 Y0 / G1 Z-1 F100 / G0 Z5 / X9 Y0 / G1 Z-1 F200 / G0 Z5 / M8 / X5 / G1 Z-1 / X6 / G0 Z5"
    assert body(text, [1, 0]) == (
        "X9 Y0 / G1 Z-1 F200 / G0 Z5 / G0 X0 Y0 / G1 Z-1 F100 / G0 Z5 / G0 X9.0 Y0.0 / F200 / "
        "M8 / X5 / G1 Z-1 / X6 / G0 Z5"
    )


def test_where_another_height_is_needed_the_tool_is_lifted_before_it_crosses() -> None:
    """The last hole is left at Z5 by G0; the first is reached at 5, the others at 1, by a feed up."""
    text = "G0 X0 Y0 / G1 Z-1 F100 / Z1 / G0 X9 / G1 Z-1 / Z1 / G0 X18 / G1 Z-1 / Z1"
    assert body(text, [1, 0, 2]) == (
        # From Z5 across, then down to 1, as before; to the task that was first at 5, as before.
        "G0 X9.0 Y0.0 / G0 Z1.0 / G0 X9 F100 / G1 Z-1 / Z1 / G0 Z5.0 / G0 X0 Y0 / G1 Z-1 F100 / Z1 / "
        "G0 X18.0 Y0.0 / G0 Z1.0 / G0 X18 / G1 Z-1 / Z1"
    ).replace("G0 X18.0 Y0.0 / G0 Z1.0 / ", "")


def test_over_the_first_place_the_tool_comes_no_lower_than_the_original_did() -> None:
    """The original came over its first place at Z5; the piece that is first now goes down to Z1 on its way."""
    text = "G0 X0 Y0 / Z1 / G1 Z-1 F100 / Z1 / G0 X9 Y0 Z1 / G1 Z-1 / Z1"
    assert body(text, [1, 0]) == ("G0 X9.0 Y0.0 / G0 X9 Y0 Z1 F100 / G1 Z-1 / Z1 / G0 X0 Y0 / Z1 / G1 Z-1 F100 / Z1")


def test_blocks_of_our_own_are_in_the_unit_of_their_section() -> None:
    """The second section is in inches, so words added there are in inches."""
    one = "G0 X0 Y0 / G1 Z-1 F100 / Z30 / G0 X9 / G1 Z-1 / Z30"
    new = body(f"{one} / G20 / M8 / G0 Z1 / X2 Y2 / G1 Z-.1 F4 / G0 Z1 / X3 / G1 Z-.1 / G0 Z1", [0, 1], [1, 0])
    assert f"{one} / G20 / M8 / G0 Z1 / X3 Y2.0 F4 / " in new


def test_where_the_length_offset_has_changed_a_piece_waits_for_z() -> None:
    holes = "G0 X{0} Y0 / G1 Z-1 F100 / G0 Z5 / X{1} / G1 Z-1 / G0 Z5 / X{2} / G1 Z-1 / G0 Z5"
    program = program_of(HEAD + holes.format(0, 9, 18) + " / G43 H2 / " + holes.format(30, 39, 48) + FOOT)
    assert [[c.line for c in s.pieces] for s in find_sequence(program).sections] == [[5, 8, 11], [18, 21]]


def test_a_laser_keeps_its_power_and_its_ways() -> None:
    cut = "G1 X{0} Y0 F3000 / M3{2} / G4 P0.5 / G1 X{1} F100 / M5"
    one, two = cut.format(0, 5, " S80"), cut.format(10, 15, "")
    three = cut.format(20, 25, " S40")
    new = rewritten(f"G21 G90 / {one} / {two} / {three} / G0 X0 Y0 / M2", [0, 2, 1])
    again = two.replace("F3000", "F3000 S80")
    assert new == f"G21 G90 / {one} / {three} / {again} / G0 X0 Y0 / M2"


def test_comments_before_a_piece_travel_with_it() -> None:
    one, two = ("(hole {})\nG0 X{} Y0\nG1 Z-1 F100\nG0 Z5\n".format(*n) for n in ((1, 0), (2, 9)))
    new = rewritten(f"G21 G90\nG0 Z5\n(all holes)\n{one}{two}M2\n", [1, 0]).split(" / ")
    assert new[2:8] == ["(all holes)", "(hole 2)", "G0 X9 Y0", "G1 Z-1 F100", "G0 Z5", "(hole 1)"]


def test_a_comment_above_a_blank_line_belongs_to_the_piece_before() -> None:
    piece = "\n(begin {0})\nG0 X{1} Y0\nG1 Z-1 F9\nG0 Z5\n(end {0})\n"
    new = rewritten(f"G21 G90\nG0 Z5\n{piece.format(1, 0)}{piece.format(2, 9)}M2\n", [1, 0]).split(" / ")
    assert new == [
        "G21 G90",
        "G0 Z5",
        "",
        "(begin 2)",
        "G0 X9 Y0",
        "G1 Z-1 F9",
        "G0 Z5",
        "",
        "(begin 1)",
        "G0 X0 Y0",
        "G1 Z-1 F9",
        "G0 Z5",
        "(end 1)",
        "(end 2)",
        "M2",
    ]


def test_line_ends_stay_and_new_blocks_get_them() -> None:
    text = "G21 G90\r\nG0 Z5\r\nX0 Y0\r\nG1 Z-1 F100\r\nZ1\r\nG0 X9\r\nG1 Z-1\r\nG0 Z1\r\nM8\r\nX5\r\nM2"
    program = program_of(text)
    new = rewrite(program, find_sequence(program), [np.array([1, 0])])
    assert new.count("\r\n") == new.count("\n")
    assert len(new.split("\r\n")) > len(text.split("\r\n"))
    assert new.endswith("M2")


@pytest.mark.parametrize("end", ["\r", "\r\n"])
@pytest.mark.parametrize("last", ["M2", "M2\n"])
def test_any_line_ends_stay_as_they_are(end: str, last: str) -> None:
    """The last piece comes first and starts at Z1, so rapids are inserted."""
    text = (
        "N1 G21 G90\nN2 G0 Z5\nN3 X0 Y0\nN4 G1 Z-1 F100\nN5 Z1\nN6 G0 X9\nN7 G1 Z-1\nN8 G0 Z1\nN9 M8\nN10 X5\nN11 "
        + last
    )

    def reordered(text: str) -> str:
        program = program_of(text, "grbl")
        return rewrite(program, find_sequence(program), [np.array([1, 0])], renumber=True)

    assert reordered(text.replace("\n", end)) == reordered(text).replace("\n", end)
    assert reordered(text).count("\n") > text.count("\n")


def test_numbers_are_renewed_only_on_request() -> None:
    text = "N10 G21 G90 / N20 G0 Z5 / N30 X0 Y0 / N40 G1 Z-1 F100 / N50 G0 Z5"
    text += " / N60 X9 Y0 / N70 G1 Z-1 / N80 G0 Z5 / N90 M2"
    program = program_of(text)
    sequence = find_sequence(program)
    kept = rewrite(program, sequence, [np.array([1, 0])]).split("\n")
    assert [line.split()[0] for line in kept] == ["N10", "N20", "N60", "N70", "N80", "N30", "N40", "N50", "N90"]
    new = rewrite(program, sequence, [np.array([1, 0])], renumber=True).split("\n")
    assert [line.split()[0] for line in new] == [f"N{n}" for n in range(10, 100, 10)]
    assert [line.split(" ", 1)[1] for line in new] == [line.split(" ", 1)[1] for line in kept]


def test_a_program_that_jumps_to_numbers_is_not_renumbered() -> None:
    text = "N10 G21 G90 / N20 G0 Z5 / N30 M2 / N40 M99 P10"
    program = program_of(text)
    with pytest.raises(PostError, match="jumps to a line by its number"):
        rewrite(program, find_sequence(program), [], renumber=True)


def test_an_order_that_is_none_is_refused() -> None:
    program = program_of(HEAD + "G99 G81 X0 Y0 Z-3 R1 F100 / X9 / X0 Z-4" + FOOT)
    sequence = find_sequence(program)
    with pytest.raises(PostError, match="each of the 3 tasks once"):
        rewrite(program, sequence, [np.array([0, 1, 1])])
    with pytest.raises(PostError, match="line 7 would come before line 5"):
        rewrite(program, sequence, [np.array([2, 1, 0])])


def test_words_are_put_into_a_line_in_its_own_manner() -> None:
    assert insert_words("/N10 X5Y6 ;go\r\n", ["G0"], ["F9"]) == "/N10 G0X5Y6F9 ;go\r\n"
    assert insert_words("(a) X5 (b) ;(c)\n", [], ["Y1"]) == "(a) X5 Y1 (b) ;(c)\n"
    assert insert_words("\tg1 x5", ["G17"], []) == "\tG17 g1 x5"
    assert insert_words("X5\n", [], []) == "X5\n"


def test_a_line_that_would_be_too_long_leaves_its_words_to_a_block_before_it() -> None:
    """X0 Y9 and the long remark are 76 characters; F100. would make it 82, and the controller takes 80."""
    remark = "(" + "r" * 68 + ")"
    text = f"G0 X0 Y0 / G1 Z-1 F100. / G0 Z5 / X9 Y0 F200 / G1 Z-1 / G0 Z5 / X0 Y9 {remark} / G1 Z-1 / G0 Z5"
    program = program_of(HEAD + text + FOOT)
    assert len(f"X0 Y9 {remark}") == 76
    new = rewrite(program, find_sequence(program), [np.array([2, 0, 1])], longest=80)
    assert max(map(len, new.splitlines())) <= 80
    assert f"\nX0 Y9 {remark}\n" in new
    long = rewrite(program, find_sequence(program), [np.array([2, 0, 1])])
    assert max(map(len, long.splitlines())) > 80


def test_lengths_have_a_point_and_no_exponent() -> None:
    assert [format_length(v, 1.0) for v in (0.0, -0.0, 3.0, 0.00001, -12.3456789)] == [
        "0.0",
        "0.0",
        "3.0",
        "0.00001",
        "-12.345679",
    ]
    assert format_length(0.254, 25.4) == "0.01"


@pytest.mark.parametrize("word", ["G17", "G18", "G19", "G90", "G91", "G90.1", "G91.1", "G98", "G99", "F100", "S9000"])
def test_words_without_a_move_may_have_a_block_of_their_own(word: str) -> None:
    """`G81 X5 (a hole)` has 15 characters; the G81 causes a move and cannot stand alone."""
    front, back = (["G81"], [word]) if word[0] in "FS" else ([word, "G81"], [])
    assert insert_words_within("X5 (a hole)\n", front, back, 15, 11) == [f"{word}\n", "G81 X5 (a hole)\n"]
    assert insert_words_within("X5 (a hole)\r\n", front, back, 15, 11) == [f"{word}\r\n", "G81 X5 (a hole)\r\n"]
    with pytest.raises(PostError) as caught:
        insert_words_within("X5 (a hole)\n", front, back, 14, 11)
    assert str(caught.value) == "'X5 (a hole)' would be longer than the 14 characters that the controller accepts"


def test_a_line_as_long_as_the_original_is_never_too_long() -> None:
    line = "X5 (a hole that is deep)"
    assert insert_words_within(line, [], ["Y1"], 10, len(line) + 3) == ["X5 Y1 (a hole that is deep)"]
    assert insert_words_within(line, ["G90"], [], 10, len(line)) == ["G90\n", line]


@pytest.mark.parametrize(
    "lines, numbers",
    [
        (["N10", "N20", "N30"], ["N10", "N20", "N30"]),
        (["N5", "N7", "N30"], ["N5", "N7", "N9"]),
        (["N7", "N5", "N30"], ["N5", "N7", "N9"]),
        (["N010", "N020"], ["N010", "N020"]),
        (["N0", "N0", "N0"], ["N0", "N1", "N2"]),
        (["N40"], ["N40"]),
        (["X1", "N40", "+X2", "X3", "N1"], ["X1", "N1", "N40 +X2", "X3", "N79"]),
        (["N99990", "N99995"], ["N1", "N2"]),
        (["N99989", "N99994"], ["N99989", "N99994"]),
        (["/N10", " N20"], ["/N10", " N20"]),
        (["N10.5", "X3"], ["N10.5", "X3"]),
    ],
)
def test_numbers_start_and_rise_as_in_the_program(lines: list[str], numbers: list[str]) -> None:
    """New lines, here with a +, get a number; N-numbers end at 99999."""
    assert renumbered([(line.removeprefix("+"), line.startswith("+")) for line in lines], 255) == [
        number.replace("+", "") for number in numbers
    ]


@pytest.mark.parametrize("jump", ["M99 P10", "M97 P10", "m 97", "GOTO 10", "IF [#1 EQ 2] goto 10"])
def test_a_jump_by_number_forbids_new_numbers(jump: str) -> None:
    with pytest.raises(PostError) as caught:
        renumbered([("N10 X1\n", False), (jump + "\n", False)], 255)
    assert str(caught.value) == f"'{jump}' jumps to a line by its number; leave out --line-numbers"
    for harmless in ("(GOTO 10)", "M99", "M970"):
        assert renumbered([("N10 X1\n", False), (harmless + "\n", False)], 255)[1] == harmless + "\n"


def test_too_many_or_too_long_numbered_lines_are_refused() -> None:
    with pytest.raises(PostError) as caught:
        renumbered([("N1\n", False)] * 100_000, 255)
    assert str(caught.value) == (
        "the program has 100000 numbered lines, more than the N-numbers that exist; leave out --line-numbers"
    )
    assert renumbered([("N1\n", False)] * 99_999, 255)[-1] == "N99999\n"
    lines = [("N8 X1\n", False), ("N10 X1234\n", False), ("Y5678\n", True)]
    assert renumbered(lines, longest=9) == ["N8 X1\n", "N10 X1234\n", "N12 Y5678\n"]
    with pytest.raises(PostError) as caught:
        renumbered(lines, longest=8)
    assert str(caught.value) == "with its number, line 3 is longer than 8 characters; leave out --line-numbers"
