"""What a certificate states: the checks that it covers, its counts and digest, and the reach of the new program."""

from __future__ import annotations

import hashlib

import pytest

from leafcut.model.difference import Difference
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of

HEAD = "G21 G90 G17 G40 G94 / T1 M6 / S900 M3 / G0 X0 Y0 Z5"
STROKE = "G1 Z-1 F100 / X20 / G0 Z5"
HOLES = "G99 G81 X30 Y5 Z-3 R1 F60 / X40 / G80 / G0 Z5"
TEXT = f"{HEAD} / {STROKE} / {HOLES} / G4 P1 / M0 / T2 M6 / G0 X0 Y9 / {STROKE} / M5 / M2"

#: The checks, as the documents list them.
CHECKS = (
    "barriers: pauses, tool changes, work offsets, machine moves, settings that the controller takes from comments and "
    "parameters, and blocks that are not understood, in order",
    "holes, cuts and dwells between two barriers: position, depth, cycle, peck, dwell, feed, speed or power, "
    "direction, tool, length offset, work offset, coolant, radius compensation, feed mode, blending, plane",
    "order of cuts that touch each other, and of closed cuts, outlines with tabs, and the work inside them",
    "order of nearby passes of a mill: at different levels, side by side, and in rows",
    "work of a mill before parts are detached",
    "heights of rapids at both ends and between them; no rapid interrupts a cut",
    "envelope",
)
REVERSED = "open cuts at one level without lead-in or lead-out, in either direction"


def test_a_certificate_states_its_checks_counts_and_digest() -> None:
    one, other = program_of(TEXT), program_of(TEXT.replace("F60", "F61"))
    found = certify(one, one)
    assert found.same and found.differences == () and found.compared == CHECKS and not found.allow_reverse
    assert certify(one, one, allow_reverse=True).compared == (*CHECKS, REVERSED)
    assert (found.before.holes, found.before.cuts, found.before.dwells) == (2, 4, 1)
    assert (found.before.stages, found.before.tool_changes) == (2, 2) and found.after == found.before
    assert found.sha256 == hashlib.sha256("".join(one.lines).encode()).hexdigest()
    changed = certify(one, other)
    assert not changed.same and changed.compared == () and changed.sha256 == found.sha256
    assert certify(other, one).sha256 == hashlib.sha256("".join(other.lines).encode()).hexdigest() != found.sha256


DETOUR = "G0 X{} Y0 Z5 / X0"


@pytest.mark.parametrize(
    ("x", "text"),
    [
        (-50, "X-50.000 is below every move of the original, X0.000"),
        (25, "X25.000 is above every move of the original, X20.000"),
        (20.002, ""), (20.003, "X20.003 is above every move of the original, X20.000"), (-0.002, ""), (15, ""),
    ],
)  # fmt: skip
def test_a_new_program_reaches_no_farther_than_the_original(x: float, text: str) -> None:
    original = program_of(f"{HEAD} / {STROKE} / M5 / M2")
    new = program_of(f"{HEAD} / {DETOUR.format(x)} / {STROKE} / M5 / M2")
    found = certify(original, new).differences
    line = 4 if x < 0 else 6
    assert list(found) == ([Difference("envelope", line, 5, text)] if text else [])


@pytest.mark.parametrize(("low", "same"), [(-60.0, True), (-50.0, True), (-49.9, False)])
@pytest.mark.parametrize("stroke", [STROKE, "G1 Z-1 F100 / X10 / X20 / G0 Z5"])
def test_a_new_program_may_reach_as_far_as_its_detours_need(low: float, same: bool, stroke: str) -> None:
    """Also if a straight cut is written in two parts."""
    original = program_of(f"{HEAD} / {STROKE} / M5 / M2")
    new = program_of(f"{HEAD} / {DETOUR.format(-50)} / {stroke} / M5 / M2")
    beyond = (low, -1.0, -1.0), (1.0, 1.0, 1.0)
    assert certify(original, new, beyond=beyond).same is same


def test_a_hole_that_is_added_is_not_reported_by_its_reach_too() -> None:
    hole = "G99 G81 X30 Y-5 Z-3 R1 F60 / G80 / G0 Z5"
    original, new = (program_of(f"{HEAD} / {STROKE} / {more}M5 / M2") for more in ("", f"{hole} / "))
    assert [one.what for one in certify(original, new).differences] == ["extra hole"]


def test_other_units_are_named_first_of_all_causes() -> None:
    original = program_of(f"{HEAD} / {STROKE} / M5 / M2")
    new = program_of(f"{HEAD} / {STROKE} / M5 / M2".replace("G21", "G20"))
    text = "mm became inches, but the lengths did not change accordingly"
    assert Difference("units", 1, 1, text) in certify(original, new).differences
    back = "inches became mm, but the lengths did not change accordingly"
    assert Difference("units", 1, 1, back) in certify(new, original).differences
