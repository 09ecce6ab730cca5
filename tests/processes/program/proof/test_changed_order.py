"""Changed orders that matter: kind, lines and the whole text, for strokes, rows, squares and parts."""

from __future__ import annotations

import pytest

from leafcut.model.difference import Difference
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of

Points = tuple[tuple[float, float], ...]


def stroke(*points: tuple[float, float], z: float = -1.0) -> str:
    """Return a stroke of a mill: two lines, one for each point after the first, and a rise."""
    (x, y), *rest = points
    return " / ".join([f"G0 X{x} Y{y}", f"G1 Z{z} F100", *(f"X{a} Y{b}" for a, b in rest), "G0 Z5"])


def lit(*points: tuple[float, float]) -> str:
    """Return a cut of a laser: two lines, one for each point after the first, and M5."""
    (x, y), *rest = points
    return " / ".join([f"G0 X{x} Y{y}", "M3 S900", *(f"G1 X{a} Y{b} F600" for a, b in rest), "M5"])


def square(x: float, y: float, side: float) -> Points:
    return ((x, y), (x + side, y), (x + side, y + side), (x, y + side), (x, y))


def milled(*parts: str) -> str:
    return " / ".join(["G21 G90 G17 G40 G94", "(T1 D=6. end mill)", "T1 M6", "S900 M3", "G0 Z5", *parts, "M5", "M2"])


ALONG, ACROSS, FAR = stroke((0, 0), (20, 0)), stroke((10, -5), (10, 5)), stroke((90, 90), (95, 90))
DEEPER = stroke((0, 0), (20, 0), z=-2.0)
OUTER, INNER = stroke(*square(0, 0, 40)), stroke((20, 20), (22, 20))
ROWS = [stroke((0, 5.0 * k), (30, 5.0 * k)) for k in range(5)]
LATER = "which originally came later and now comes first"


@pytest.mark.parametrize(
    ("before", "after", "differences"),
    [
        ([ALONG, ACROSS, FAR], [ALONG, FAR, ACROSS], []),
        ([ALONG, ACROSS], [ACROSS, ALONG], [
            ("order", 8, 12, f"X20.000 Y0.000 Z-1.000 (line 8) touches X10.000 Y5.000 Z-1.000 (line 12), {LATER}"),
        ]),
        ([ALONG, FAR, ACROSS], [ACROSS, FAR, ALONG], [
            ("order", 8, 16, f"X20.000 Y0.000 Z-1.000 (line 8) touches X10.000 Y5.000 Z-1.000 (line 16), {LATER}"),
        ]),
        ([ALONG, DEEPER], [DEEPER, ALONG], [
            ("order", 7, 11, f"X0.000 Y0.000 Z-1.000 (line 7) touches X0.000 Y0.000 Z-2.000 (line 11), {LATER}"),
            ("order", 7, 11, f"X0.000 Y0.000 Z-1.000 (line 7) touches X20.000 Y0.000 Z-2.000 (line 12), {LATER}"),
            ("order", 8, 12, f"X20.000 Y0.000 Z-1.000 (line 8) touches X0.000 Y0.000 Z-2.000 (line 11), {LATER}"),
            ("order", 8, 12, f"X20.000 Y0.000 Z-1.000 (line 8) touches X20.000 Y0.000 Z-2.000 (line 12), {LATER}"),
            ("order", 7, 11, "X0.000 Y0.000 Z-1.000 (line 7) is at another level beside X0.000 Y0.000 Z-2.000 "
             f"(line 11), {LATER}"),
        ]),
        (ROWS, [ROWS[0], ROWS[2], ROWS[1], *ROWS[3:]], [
            ("order", 11, 15, "X0.000 Y5.000 Z-1.000 (line 11) clears a row beside X0.000 Y10.000 Z-1.000 (line 15), "
             f"{LATER}"),
        ]),
        ([OUTER, INNER], [INNER, OUTER], [
            ("inner before outer", 14, 7, "X20.000 Y20.000 Z-1.000 (line 14) lies inside a closed cut that ends at "
             "X0.000 Y0.000 Z-1.000 (line 11); originally it was cut after this cut, and now it is cut before it"),
        ]),
        ([INNER, OUTER], [OUTER, INNER], [
            ("inner after outer", 7, 14, "X20.000 Y20.000 Z-1.000 (line 7) lies inside a closed cut that ends at "
             "X0.000 Y0.000 Z-1.000 (line 15); originally it was cut before this cut, and now it is cut after it"),
            ("part detached too early", 7, 14, "X20.000 Y20.000 Z-1.000 (line 7) was cut before the part whose outline "
             "ends at X0.000 Y0.000 Z-1.000 (line 15) was detached; now it is cut afterwards"),
        ]),
        ([OUTER, FAR, INNER], [FAR, OUTER, INNER], []),
    ],
)  # fmt: skip
def test_a_changed_order_of_a_mill_is_named(
    before: list[str], after: list[str], differences: list[tuple[str, int, int, str]]
) -> None:
    found = certify(program_of(milled(*before)), program_of(milled(*after)))
    assert list(found.differences) == [Difference(*one) for one in differences] and found.notes == ()


def compared(before: list[str], after: list[str]) -> tuple[list[Difference], tuple[str, ...]]:
    """Compare cuts of a laser; return the differences and the notes."""
    programs = [program_of(" / ".join(["G21 G90 G17 G94", *cuts, "M2"]), "grbl-laser") for cuts in (before, after)]
    found = certify(*programs, notes=True)
    return list(found.differences), found.notes


HOLE, FIRST, SECOND, THIRD = lit(*square(10, 10, 10)), *(lit(*square(x, 0, 40)) for x in (0, 50, 100))


def test_a_hole_that_a_laser_cuts_after_its_part_is_in_a_free_part() -> None:
    text = (
        "X20.000 Y10.000 and an unknown Z (line 4) lies inside a closed cut that ends at X0.000 Y0.000 and an unknown "
        "Z (line 14); originally it was cut before this cut, and now it is cut after it, in a part that "
        "is already detached by then"
    )
    assert compared([HOLE, FIRST], [FIRST, HOLE]) == ([Difference("inner after outer", 4, 11, text)], ())
    assert compared([FIRST, HOLE], [HOLE, FIRST]) == ([], ())


@pytest.mark.parametrize(
    ("before", "after", "moved", "one", "other"),
    [
        ([FIRST, SECOND], [SECOND, FIRST], "1 of 2", "X50.000 Y0.000 (line 14)", "X0.000 Y0.000 (line 7)"),
        ([HOLE, FIRST, SECOND], [SECOND, HOLE, FIRST], "1 of 2", "X50.000 Y0.000 (line 21)", "X0.000 Y0.000 (line 14)"),
        ([FIRST, SECOND, THIRD], [THIRD, SECOND, FIRST], "2 of 3", "X50.000 Y0.000 (line 14)",
         "X0.000 Y0.000 (line 7)"),
        ([FIRST, SECOND, THIRD], [FIRST, THIRD, SECOND], "1 of 3", "X100.000 Y0.000 (line 21)",
         "X50.000 Y0.000 (line 14)"),
        ([FIRST, HOLE, SECOND], [HOLE, FIRST, SECOND], "", "", ""),
        ([FIRST, SECOND], [FIRST, SECOND], "", "", ""),
    ],
)  # fmt: skip
def test_parts_of_a_laser_that_come_free_in_another_order_are_noted(
    before: list[str], after: list[str], moved: str, one: str, other: str
) -> None:
    note = (
        f"parts detach in a different order: {moved} outlines are cut earlier than before. "
        f"Example: the outline that ends at {one} is now cut before the path that ends at {other}"
    )
    assert compared(before, after) == ([], (note,) if moved else ())
