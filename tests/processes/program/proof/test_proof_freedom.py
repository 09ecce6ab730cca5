"""Orders that change nothing are the same work, however the tool rises, waits or is switched; one step more is not."""

from __future__ import annotations

import pytest

from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of

HEAD = "G21 G90 G17 / T1 M6 / S1000 M3 / G0 Z5 / X-9 Y-9"
FOOT = "G0 Z20 / M5 / M2"

#: It rises in two steps, as a CAM writes it that retracts to a safe height first.
SHALLOW = "G0 X0 Y0 / G0 Z2 / G1 Z-1 F100 / G0 Z1 / G0 Z5"
#: The second pass at that place, and a hole elsewhere.
DEEP, OTHER = "G0 X0 Y0 / G0 Z2 / G1 Z-2 F100 / G0 Z5", "G0 X20 Y0 / G0 Z2 / G1 Z-2 F100 / G0 Z5"
HOLES = [f"G0 X{x} Y0 / G1 Z-1 F100 / G0 Z5" for x in (0, 10, 20)]
SIDE = "G41 D1 / G0 X30 Y5 / G1 Z-1 / X40 / G40 / G0 X50 / G0 Z5"
CYCLES = [f"G99 G81 X{x} Y0 Z-1 R1 F100" for x in (0, 10, 20)]
CYCLE = "G98 G81 X40 Y0 Z-1 R1 F100 / G80"
CUTS = [f"G0 X{x} Y0 / M3 S300 / G1 X{x + 5} F900 / M5" for x in (0, 10, 20)]
LASER = "G21 G90 / G0 X-5 Y-5"

Parts = list[str]


def what_differs(original: Parts, new: Parts, head: str = HEAD, foot: str = FOOT) -> list[str]:
    programs = [program_of(" / ".join([head, *parts, foot])) for parts in (original, new)]
    return [d.what for d in certify(*programs).differences]


def changed(parts: Parts, number: int, old: str, new: str) -> Parts:
    assert old in parts[number]
    return [part.replace(old, new, 1) if k == number else part for k, part in enumerate(parts)]


@pytest.mark.parametrize(
    "original, new",
    [
        ([SHALLOW, OTHER, DEEP], [SHALLOW, DEEP, OTHER]),
        ([SHALLOW, DEEP, OTHER], [OTHER, SHALLOW, DEEP]),
        ([*HOLES, SIDE], [HOLES[2], HOLES[0], HOLES[1], "G0 X20 Y0", SIDE]),
        ([*CYCLES, "G80", "G4 P1", "M8"], [CYCLES[1], CYCLES[0], CYCLES[2], "G80", "G4 P1", "M8"]),
        ([*CYCLES, "G80", "G4 P1", "M8"], [CYCLES[2], CYCLES[0], CYCLES[1], "G80", "G4 P1", "M8"]),
        ([*HOLES[:2], CYCLE, "G4 P1", "M0"], [CYCLE, *HOLES[:2], "G4 P1", "M0"]),
        ([CYCLE, *HOLES[:2], "G4 P1", "M0"], [*HOLES[:2], CYCLE, "G4 P1", "M0"]),
        ([*HOLES, "G4 P1", "M8"], [HOLES[1], HOLES[2], HOLES[0], "G4 P1", "M8"]),
    ],
)
def test_an_order_that_harms_nothing_is_the_same_work(original: Parts, new: Parts) -> None:
    assert what_differs(original, new) == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "number, old, new, what",
    [
        (1, "G0 Z2", "G0 Z1", "changed cut"),
        (1, "G0 Z2", "G0 Z1 / G0 Z2", "deeper rapid"),
        (0, "G0 Z1 / G0 Z5", "G0 Z1 / G0 Z0.5 / G0 Z5", "deeper rapid"),
        (1, "G0 Z5", "G0 Z4", "lower retract"),
        (2, "G0 X20 Y0", "G0 X20 Y0 Z3", "lower approach"),
    ],
)
def test_a_rapid_that_goes_deeper_at_one_place_is_caught(number: int, old: str, new: str, what: str) -> None:
    """The two passes follow each other now without a way across between them."""
    order = [SHALLOW, DEEP, OTHER]
    assert what in what_differs([SHALLOW, OTHER, DEEP], changed(order, number, old, new))


@pytest.mark.hazard
def test_a_lower_rapid_after_the_only_length_offset_of_a_program_is_caught() -> None:
    """Before the offset the height is unknown, so only the heights after it can be compared."""
    text = "G21 G90 / T1 M6 / S1 M3 / G0 X0 Y0 / G43 H1 / G0 Z{} / G1 Z-1 F100 / G0 Z5 / M5 / M2"
    same, deeper = (program_of(text.format(z)) for z in ("5", "0.5"))
    found = certify(same, deeper)
    assert any("right after a change of length offset" in str(d) for d in found.differences)


@pytest.mark.hazard
@pytest.mark.parametrize("lost", ["T1 M6", "G28 Z0", "G53 G0 Z0"])
def test_a_length_offset_that_is_not_taken_again_is_a_difference(lost: str) -> None:
    """Some controllers cancel it at a tool change, also of the same tool, or at a move to a machine position."""
    head = "G21 G90 / T1 M6 / S1 M3 / G43 H1 / G0 Z5 / X0 Y0 / G1 Z-1 F100 / G0 Z5 / "
    text = head + lost + " / S1 M3 / {}G0 Z5 / X9 / G1 Z-1 / G0 Z5 / M5 / M2"
    again, without = (program_of(text.format(words)) for words in ("G43 H1 / ", ""))
    assert certify(again, again).same
    for original, new in ((again, without), (without, again)):
        texts = " ".join(map(str, certify(original, new).differences))
        assert "applied after the tool change or the machine move" in texts


def test_a_rapid_into_a_hole_stays_allowed_where_it_is_made_elsewhere_after_it() -> None:
    """The tool goes down again at rapid, and waits above; then it goes away first, and comes back to wait."""
    deep = "G0 X0 Y0 / G1 Z-1 F100 / G0 Z1 / G0 {} / G0 Z5"
    original = [HOLES[1], deep.format("Z-1"), "G4 P1", HOLES[2]]
    for z, found in (("Z-1", []), ("Z-1.5", ["deeper rapid", "envelope"])):
        assert what_differs(original, [deep.format(z), HOLES[1], "G0 X0 Y0", "G4 P1", HOLES[2]]) == found


@pytest.mark.parametrize("old, new", [("G41 D1", "G42 D1"), ("G41 D1", "G41 D2"), ("G41 D1 / ", ""), ("X30", "X31")])
def test_another_compensation_behind_holes_is_caught(old: str, new: str) -> None:
    order = [HOLES[2], HOLES[0], HOLES[1], "G0 X20 Y0", SIDE]
    assert what_differs([*HOLES, SIDE], changed(order, 4, old, new)) != []


def test_a_way_into_compensation_begins_where_it_did() -> None:
    """How the controller comes to the side of the contour depends on where it comes from."""
    assert what_differs([*HOLES, SIDE], [HOLES[2], HOLES[0], HOLES[1], SIDE]) == ["changed cut"]


def test_a_hole_made_under_compensation_that_was_made_before_it_is_caught() -> None:
    new = [HOLES[0], HOLES[2], SIDE.replace("G40 / G0 X50 / G0 Z5", f"G0 Z5 / {HOLES[1]} / G40 / G0 X50")]
    assert what_differs([*HOLES, SIDE], new) != []


def test_a_cut_that_went_on_under_compensation_from_a_hole_is_caught_behind_another() -> None:
    """G41 and a feed from the position of the last hole: the cut starts there."""
    side = "G41 D1 / G1 X30 Y5 / G40 / G0 Z5"
    assert what_differs([*HOLES, side], [HOLES[1], HOLES[0], HOLES[2], side]) == []
    assert what_differs([*HOLES, side], [HOLES[2], HOLES[0], HOLES[1], side]) != []


@pytest.mark.parametrize(
    "new",
    [
        [CYCLES[1], "G4 P1", CYCLES[0], CYCLES[2], "G80", "M8"],
        [CYCLES[1], CYCLES[0], "G4 P1", CYCLES[2], "G80", "M8"],
        [*CYCLES, "G80", "G4 P0.5", "M8"],
        [*CYCLES, "G80", "M8"],
        [*CYCLES, "G80", "M8", "G4 P1"],
    ],
)
def test_a_dwell_behind_the_last_hole_stays_there_with_its_time(new: Parts) -> None:
    """The tool has risen and waits for the next move, above whichever hole was last."""
    assert what_differs([*CYCLES, "G80", "G4 P1", "M8"], new) != []


def test_cuts_of_a_laser_in_another_order_are_the_same_and_a_beam_that_stays_on_is_caught() -> None:
    order = [CUTS[1], CUTS[0], CUTS[2]]
    home = "G0 X0 Y0 / M2"
    assert what_differs(CUTS, order, LASER, home) == []
    for number in range(3):
        lit = changed(order, number, " / M5", "")
        assert "beam on" in what_differs(CUTS, lit, LASER, home)
    early = changed(order, 1, "G0 X0 Y0 / M3 S300", "M3 S300 / G0 X0 Y0")
    assert "beam on" in what_differs(CUTS, early, LASER, home)
