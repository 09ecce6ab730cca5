"""Cuts made from their other end: let pass where that is allowed and changes nothing else."""

from __future__ import annotations

import pytest

from leafcut.model.certificate import Certificate
from leafcut.processes.program.proof.certificate import certify, proof_lines
from rewriting import program_of

HEAD = "G21 G90 / T1 M6 / S1000 M3 / G0 Z5 / "
OTHER = "X50 Y0 / Z1 / G1 Z-1 F50 / Y9 F200 / G0 Z5"
FOOT = " / M5 / M2"
CUT = "G0 X0 Y0 / Z1 / G1 Z-1 F50 / X5 F200 / G2 X9 I2 / G1 X20 Y3 / G0 Z5 / "
BACK = "G0 X20 Y3 / Z1 / G1 Z-1 F50 / X9 Y0 F200 / G3 X5 I-2 / G1 X0 / G0 Z5 / "


def proof(old: str, new: str, allow_reverse: bool = True) -> Certificate:
    programs = (program_of(HEAD + text + OTHER + FOOT) for text in (old, new))
    return certify(*programs, allow_reverse=allow_reverse)


def test_a_cut_from_its_other_end_is_the_same_only_where_that_is_allowed() -> None:
    found = proof(CUT, BACK)
    assert found.same
    assert (found.reversed_cuts, found.allow_reverse) == (1, True)
    assert proof_lines(found, "1.2")[2] == "leafcut: reversed cuts: 1, --allow-reverse"
    assert not proof(CUT, BACK, allow_reverse=False).same
    assert proof(BACK, CUT).same


def test_a_program_without_work_has_nothing_to_turn() -> None:
    still = program_of("G21 G90 / G0 X0 Y0 Z5 / X9 / M2")
    found = certify(still, still, allow_reverse=True)
    assert found.same
    assert found.reversed_cuts == 0


def test_the_same_direction_is_no_reversal() -> None:
    for text in (CUT, BACK):
        found = proof(text, text)
        assert found.same
        assert found.reversed_cuts == 0
        assert len(proof_lines(found, "1.2")) == 2


@pytest.mark.parametrize(
    "was, becomes, what",
    [
        ("F200", "F210", "changed cut"),
        ("F50", "F60", "changed cut"),
        ("Z-1", "Z-1.1", "changed cut"),
        ("X20 Y3", "X20.1 Y3", "cut"),
        (" / G1 X0 /", " /", "cut"),
        ("G3 X5 I-2", "G2 X5 I-2", "arc"),
        ("I-2", "R2.5", "arc"),
        ("X9 Y0", "X9 Y0 / G0 Z5 / Z1 / G1 Z-1", "cut"),
        ("G1 Z-1 F50 / X9 Y0 F200", "G1 Z0 F50 / Z0.5 / Z-1 / X9 Y0 F200", "cut"),
        ("Z1 /", "Z0 /", "cut"),
        ("G1 X0 / G0 Z5", "G1 X0 / G0 Z3", "lower retract"),
        ("G0 X20 Y3 / Z1", "G0 Z3 / X20 Y3 / Z1", "lower"),
        ("G1 X0", "S900 G1 X0 / S1000", "cut"),
        ("G1 X0", "G4 P1 / G1 X0", "dwell"),
        ("G1 X0", "M8 G1 X0 / M9", "cut"),
    ],
)
def test_any_other_change_of_a_cut_that_is_turned_is_found(was: str, becomes: str, what: str) -> None:
    assert was in BACK
    found = proof(CUT, BACK.replace(was, becomes, 1))
    assert not found.same
    assert what in " ".join(map(str, found.differences))


@pytest.mark.parametrize(
    "old, new",
    [
        # Closed: the direction decides between climb and conventional milling.
        ("G1 Z-1 F50 / X5 F200 / Y5 / X0 / Y0", "G1 Z-1 F50 / Y5 F200 / X5 / Y0 / X0"),
        # A slow way in would become a slow way out.
        ("G1 Z-1 F50 / X1 F90 / X5 F200 / Y5", "G0 X5 Y5 / G1 Z-1 F50 / Y0 F200 / X1 / X0 F90"),
        # An arc leads in.
        ("G1 Z-1 F50 / G2 X2 I1 F200 / G1 X9 / Y5", "G0 X9 Y5 / G1 Z-1 F50 / Y0 F200 / X2 / G3 X0 I-1"),
        # The lead-in to a closed cut would start on the part.
        ("G1 Z-1 F50 / X4 F200 / X8 / Y4 / X4 / Y0", "G0 X4 Y0 / G1 Z-1 F50 / Y4 F200 / X8 / Y0 / X4 / X0"),
        # It sinks.
        ("G1 Z-1 F50 / X5 Z-2 F200", "G0 X5 Y0 / G1 Z-2 F50 / X0 Z-1 F200"),
        # The tool is on one side of the line.
        ("G1 Z-1 F50 / G41 D1 X5 F200 / G40 X9", "G0 X9 Y0 / G1 Z-1 F50 / G42 D1 X5 F200 / G40 X0"),
        # It waits in the middle.
        ("G1 Z-1 F50 / X5 F200 / G4 P1 / X9", "G0 X9 Y0 / G1 Z-1 F50 / X5 F200 / G4 P1 / X0"),
        # It waits behind the plunge, and would wait before the rise.
        ("G1 Z-1 F50 / G4 P1 / X5 F200", "G0 X5 Y0 / G1 Z-1 F50 / X0 F200 / G4 P1"),
    ],
)
def test_a_cut_that_shows_a_direction_keeps_it(old: str, new: str) -> None:
    begin = "G0 X0 Y0 / "
    texts = [(t if t.startswith("G0") else begin + t) + " / G0 Z5 / " for t in (old, new)]
    assert proof(texts[0], texts[0]).same
    assert not proof(*texts).same


def test_a_cut_is_not_turned_over_a_place_where_the_tool_had_to_be_higher() -> None:
    """The tool left X20 at Z9 before: now it comes there, and must be as high."""
    old = CUT.replace("Y3 / G0 Z5", "Y3 / G0 Z9")
    assert proof(old, old).same
    found = proof(old, BACK.replace("G1 X0 / G0 Z5", "G1 X0 / G0 Z9"))
    assert "lower approach" in {d.what for d in found.differences}


def test_passes_on_top_of_each_other_keep_their_order_whichever_way_they_go() -> None:
    deep = BACK.replace("Z-1", "Z-2")
    assert proof(CUT + deep, BACK + deep).same
    assert proof(CUT + deep, BACK + CUT.replace("Z-1", "Z-2")).reversed_cuts == 2
    found = proof(CUT + deep, CUT.replace("Z-1", "Z-2") + CUT)
    assert "order" in {d.what for d in found.differences}
