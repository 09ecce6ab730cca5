"""Messages on two different programs: each difference and its position once, and no false differences."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.difference import Difference
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of

EXAMPLES = Path(__file__).parents[4] / "examples"

HEAD = "G21 G90 G17 G40 / T1 M6 / S1000 M3 / G0 Z5"
HOLES = "G99 G81 X0 Y0 Z-1 R1 F100 / X10 / X20 / X30 / X40 / G80"
FOOT = "G0 Z20 / M5 / M2"
DRILLING = f"{HEAD} / {HOLES} / {FOOT}"
ADDED = "X10 / X15"


def told(original: str, new: str) -> list[Difference]:
    return list(certify(program_of(original), program_of(new)).differences)


def whats(original: str, new: str) -> list[str]:
    return [one.what for one in told(original, new)]


def changed(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def test_a_hole_that_was_added_is_all_that_is_told() -> None:
    """Neither program states G94, G97, G69 …, and more cuts rely on them in one than in the other."""
    (found,) = told(DRILLING, changed(DRILLING, ("X10", ADDED)))
    assert (found.what, found.original, found.new) == ("extra hole", 0, 7)
    assert "X15.000 Y0.000" in found.text


def test_a_hole_added_before_a_mode_is_stated_late_is_all_that_is_told() -> None:
    late = changed(DRILLING, ("X30", "G94 F100 X30"))
    assert whats(late, changed(late, ("X10", ADDED))) == ["extra hole"]


@pytest.mark.parametrize("word", ["G90", "G17", "G40"])
def test_a_mode_that_is_no_longer_stated_is_told_beside_a_hole_that_was_added(word: str) -> None:
    both = told(DRILLING, changed(DRILLING, (f" {word}", ""), ("X10", ADDED)))
    assert sorted(one.what for one in both) == ["extra hole", "not stated"]
    assert any(word in one.text for one in both)


@pytest.mark.parametrize("work", [HOLES, "G0 X0 Y0 / G1 Z-1 F100 / X9 / G0 Z5 / G0 X0 Y5 / G1 Z-1 / X9 / G0 Z5"])
def test_a_mode_that_is_stated_after_more_of_the_same_cuts_is_told_also_beside_one_that_was_added(work: str) -> None:
    """The word moves behind cuts that both programs make."""
    first, rest = work.split(" / ", 2)[:2], work.split(" / ", 2)[2]
    start = " / ".join(first)
    original = f"{HEAD} / {start} / G94 F100 / {rest} / {FOOT}"
    new = f"{HEAD} / {start} / {rest} / G94 F100 / {FOOT}"
    assert "not stated" in whats(original, new)
    assert "not stated" in whats(original, changed(new, (FOOT, f"G0 X50 / G1 Z-1 F100 / G0 Z5 / {FOOT}")))


def test_cuts_that_go_on_from_each_other_are_told_from_where_they_begin_to_where_they_end() -> None:
    """A hole, then a stroke of three cuts: down, along and aside."""
    hole, stroke = "G0 X40 Y40 / G1 Z-1 F100 / G0 Z5", "G0 X0 Y0 / G1 Z-1 F100 / X9 / Y5 / G0 Z5"
    original = f"{HEAD} / {hole} / {stroke} / {FOOT}"
    (gone,) = told(original, f"{HEAD} / {hole} / {FOOT}")
    assert gone.text == "3 cuts from X0.000 Y0.000 Z5.000 to X9.000 Y5.000 Z-1.000 with tool 1 are missing"
    (moved,) = told(original, changed(original, ("X0 Y0", "X0 Y20"), ("X9 / Y5", "X9 / Y25")))
    assert moved.text.endswith("are now from X0.000 Y20.000 Z5.000 to X9.000 Y25.000 Z-1.000")


CAM = EXAMPLES / "cam_121.nc"
#: Lines of its first drilling cycle, from 1: each is a hole of its own.
FIRST_CYCLE = range(11, 131)


def of_lines(lines: list[str]) -> Program:
    return interpret_program("\n".join(lines) + "\n", load_dialect("linuxcnc"))


def one_told(original: list[str], new: list[str]) -> Difference:
    (found,) = certify(of_lines(original), of_lines(new)).differences
    return found


@pytest.mark.parametrize("line", random.Random(3).sample(FIRST_CYCLE, 4))
def test_one_hole_of_a_real_program_that_is_left_out_added_or_moved_is_told_with_its_lines_and_place(line: int) -> None:
    original = CAM.read_text().splitlines()
    place = f"{original[line - 1]} Z-1.000"
    head, tail = original[: line - 1], original[line:]
    gone = one_told(original, head + tail)
    assert (gone.what, gone.original, gone.new, gone.also) == ("missing hole", line, 0, ())
    assert place in gone.text
    added = one_told(head + tail, original)
    assert (added.what, added.original, added.new, added.also) == ("extra hole", 0, line, ())
    assert place in added.text
    moved = one_told(original, [*head, "X123.456 Y7.890", *tail])
    assert (moved.what, moved.original, moved.new, moved.also) == ("moved hole", line, line, ())
    assert place in moved.text and "X123.456 Y7.890 Z-1.000" in moved.text


@pytest.mark.parametrize(
    "old, new, line, holes, words",
    [
        ("F150.", "F160.", 10, 121, "feed in mm/min 150 became 160"),
        ("Z-1.", "Z-1.2", 10, 121, "depth -1 became -1.2"),
        ("Q1.5", "Q2.", 141, 121, "peck 1.5 became 2"),
        ("S4000", "S3500", 137, 121, "speed 4000 became 3500"),
        ("H2", "H1", 139, 121, "length offset 2 became 1"),
    ],
)
def test_a_word_that_holds_for_many_holes_is_one_difference_with_all_their_lines(
    old: str, new: str, line: int, holes: int, words: str
) -> None:
    original = CAM.read_text().splitlines()
    other = original.copy()
    other[line - 1] = original[line - 1].replace(old, new)
    assert other != original
    found = one_told(original, other)
    begin = 10 if line < 130 else 141
    assert [(found.original, found.new), *found.also] == [(k, k) for k in range(begin, begin + holes)]
    assert words in found.text and str(holes) in found.text
    assert str(found).endswith(f"(original lines {begin} to {begin + holes - 1}, lines {begin} to {begin + holes - 1})")


def test_coolant_left_out_is_one_difference_in_the_words_of_the_program() -> None:
    original = CAM.read_text().splitlines()
    found = one_told(original, original[:8] + original[9:])
    assert original[8] == "M8"
    assert found.what == "changed hole" and "coolant M8 became M9" in found.text
    assert len(found.also) == 120


@pytest.mark.parametrize(
    "line, old, new, what", [(136, "T2", "T3", "changed tool"), (138, "G54", "G55", "extra work offset")]
)
def test_a_tool_or_work_offset_is_told_at_its_block_and_not_of_every_hole_behind_it(
    line: int, old: str, new: str, what: str
) -> None:
    original = CAM.read_text().splitlines()
    other = original.copy()
    other[line - 1] = original[line - 1].replace(old, new)
    found = one_told(original, other)
    assert (found.what, found.new, found.also) == (what, line, ())
    assert new[1:] in found.text


def test_what_comes_behind_another_tool_is_told_where_more_than_the_tool_has_changed() -> None:
    original = CAM.read_text().splitlines()
    other = original.copy()
    other[135], other[138] = other[135].replace("T2", "T3"), other[138].replace("H2", "H3")
    found = [str(one) for one in certify(of_lines(original), of_lines(other)).differences]
    assert len(found) == 2 and "change to tool 3" in found[0]
    assert "length offset 2 became 3" in found[1] and "tool 2" not in found[1]


CONTOUR = "G0 X0 Y0 / G1 Z-1 F100 / X10 / Y10 / X5 Y15 / X0 Y10 / Y0 / G0 Z5"
TWICE = f"{HEAD} / {CONTOUR} / {CONTOUR} / {FOOT}"
#: Lines of its second and third side in either of the two passes.
PASSES = ((8, 9), (16, 17))


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("number", [0, 1])
def test_a_corner_of_one_of_two_equal_passes_is_told_in_its_own_pass_and_alone(number: int, side: int) -> None:
    """The following cut also starts elsewhere; and the other pass has an equal cut."""
    lines = TWICE.split(" / ")
    line = PASSES[number][side]
    gone = one_told(lines, lines[: line - 1] + lines[line:])
    assert (gone.what, gone.original, gone.new) == ("missing cut", line, 0)
    added = one_told(lines[: line - 1] + lines[line:], lines)
    assert (added.what, added.original, added.new) == ("extra cut", 0, line)
    moved = lines.copy()
    moved[line - 1] = "X12 Y12"
    found = one_told(lines, moved)
    assert (found.what, found.original, found.new) == ("moved cut", line, line)
    assert "X12.000 Y12.000" in found.text


def test_a_contour_at_another_depth_is_one_difference() -> None:
    lines = TWICE.split(" / ")
    deeper = lines.copy()
    deeper[5] = "G1 Z-1.5 F100"
    found = one_told(lines, deeper)
    assert found.text.endswith("depth -1 became -1.5")
    assert [(found.original, found.new), *found.also] == [(k, k) for k in range(6, 12)]


def test_corners_that_change_places_are_told_as_another_order() -> None:
    lines = TWICE.split(" / ")
    swapped = lines.copy()
    swapped[6], swapped[7], swapped[8] = "X10 Y0", "X5 Y15", "X10 Y10"
    found = one_told(lines, swapped)
    assert found.what == "reordered cut"
    assert [(found.original, found.new), *found.also] == [(8, 8), (9, 9), (10, 10)]


PECKED = "G0 X{} Y5 / G0 Z1 / G1 Z-2 F100 / G0 Z1 / G0 Z-1.5 / G1 Z-4 / G4 P0.2 / G0 Z10"


def test_a_hole_of_single_moves_is_one_hole() -> None:
    first, gone, rest = (PECKED.format(x) for x in (5, 15, 25))
    with_it, without = (f"{HEAD} / {' / '.join(parts)} / {FOOT}" for parts in ((first, gone, rest), (first, rest)))
    for one, other, what in ((with_it, without, "missing hole"), (without, with_it, "extra hole")):
        (found,) = told(one, other)
        assert found.what == what
        assert "hole at X15.000 Y5.000 Z-4.000" in found.text
    (found,) = told(with_it, changed(with_it, ("X15", "X16")))
    assert found.what == "moved hole"
    assert "X15.000 Y5.000" in found.text and "X16.000 Y5.000" in found.text


def test_a_plunge_from_which_a_cut_goes_on_is_no_hole() -> None:
    slot = "G0 X50 Y5 / G1 Z-1 F100 / X60 / G0 Z5"
    (found,) = told(f"{HEAD} / {HOLES} / {slot} / {FOOT}", f"{HEAD} / {HOLES} / {FOOT}")
    assert found.what == "missing cut"


@pytest.mark.parametrize(
    ("original", "new", "words"),
    [
        ("#1=5 / M100 P#1", "#1=6 / M100 P#1", "'M100P#1 = M100 P5' became 'M100P#1 = M100 P6'"),
        ("M100 P5", "M100 P 6.", "'M100P5' became 'M100P6.'"),
    ],
)
def test_a_block_with_a_parameter_is_shown_with_its_value(original: str, new: str, words: str) -> None:
    """Plain words are shown as the line has them."""
    (found,) = told(*(changed(DRILLING, (HEAD, f"{HEAD} / {block}")) for block in (original, new)))
    assert found.what == "changed block" and words in found.text


def test_a_spindle_that_stays_off_is_told_of_the_cuts_and_not_of_the_end_again() -> None:
    text = f"{HEAD} / {CONTOUR} / M2"
    (found,) = told(text, changed(text, ("S1000 M3", "S1000")))
    assert "M3 became M5" in found.text and found.what == "changed cut"
    (found,) = told(f"{HEAD} / {CONTOUR} / M5 / M2", f"{HEAD} / {CONTOUR} / M2")
    assert found.what == "changed end of program" and "M5 became M3" in found.text


def test_the_other_unit_with_the_same_figures_is_told_first() -> None:
    first, *_ = told(DRILLING, changed(DRILLING, ("G21", "G20")))
    assert (first.what, first.original, first.new) == ("units", 1, 1)


def test_work_that_goes_farther_is_not_told_again_as_larger_but_a_rapid_that_does_is() -> None:
    far = changed(DRILLING, ("X40", "X40 / X400"))
    assert whats(DRILLING, far) == ["extra hole"]
    assert sorted(whats(DRILLING, changed(far, (FOOT, f"G0 Z20 / X999 / {FOOT}")))) == ["envelope", "extra hole"]


def test_rapids_that_are_all_lower_are_one_difference() -> None:
    cuts = [f"G0 X{x} Y0 / G0 Z1 / G1 Z-1 F100 / G0 Z5" for x in (0, 10, 20, 30)]
    text = f"{HEAD} / {' / '.join(cuts)} / {FOOT}"
    (found,) = told(text, text.replace("F100 / G0 Z5", "F100 / G0 Z3"))
    assert found.what == "lower retract"
    assert "at Z3.000 instead of Z5.000" in found.text and "2 other places" in found.text
    assert [found.new, *(new for _, new in found.also)] == [8, 12, 16]


def test_cuts_that_begin_lower_are_not_told_as_another_order() -> None:
    cuts = " / ".join(f"G0 X{x} Y0 / G0 Z1 / G1 Z-1 F100 / G0 Z5" for x in (0, 10, 20))
    (found,) = told(f"{HEAD} / {cuts} / {FOOT}", f"{HEAD} / {cuts.replace('G0 Z1', 'G0 Z0.5')} / {FOOT}")
    assert found.what == "changed cut" and found.text.endswith("start Z1 became Z0.5")
