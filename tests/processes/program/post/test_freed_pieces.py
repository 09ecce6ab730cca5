"""Pieces that may move as it can be proved: dwells at ends, speeds by S, parameters, subprograms, what follows G12."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.sequence import Sequence
from leafcut.processes.program.plan.fixed_tasks import group_stay_reasons
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.proof.certificate import certify
from rewriting import some_orders, work_of
from rs274_moves import moves_of_rs274, run_rs274

HEAD = "G21 G90 G94 G17\nT1 M6\nS1000 M3\nG0 Z5.\n"
PLACES = [(0, 0), (50, 0), (20, 10), (70, 5), (10, 30)]


def strokes(template: str) -> str:
    """Return pieces of work at `PLACES`, of which some name another speed."""
    speeds = ["", "S2000\n", "S1000\n", "S2000\n", "S1000\n"]
    return "".join(
        template.format(x=f"{x}.", y=f"{y}.", end=f"{x + 7}.", s=s) for (x, y), s in zip(PLACES, speeds, strict=True)
    )


SUBS = {
    "relative": "G91\nG1 Z-6. F150.\nX3. F300.\nG0 Z6.\nG90\nM99\n",
    "steps": "G91\nG0 X1.\nG1 Z-6. F150.\nG0 Z6.\nG90\nM99\n",
    "in place": "G1 Z-1. F150.\nG4 P0.3\nG0 Z5.\nM99\n",
}
#: By name: the body, the text after the end, and whether cuts may be reversed.
PROGRAMS: dict[str, tuple[str, str, bool]] = {
    "dwell after the plunge": (
        strokes("G0 X{x} Y{y}\nG1 Z-1. F100.\nG4 P0.5\nX{end} F300.\nG4 P0\nG0 Z5.\n"), "", True),
    "speed in the piece": (strokes("G0 X{x} Y{y}\n{s}G1 Z-1. F100.\nX{end}\nG0 Z5.\n"), "", False),
    "speed before the way": (strokes("{s}G0 X{x} Y{y}\nG1 Z-1. F100.\nX{end}\nG0 Z5.\n"), "", False),
    "cycle with a parameter for F": ("#1=100\n" + strokes("G98 G81 X{x} Y{y} Z-3. R1. F#1\n") + "G80\n", "", False),
    "cycle in which all is computed": (
        "#<depth>=3\n#2=1\n" + strokes("G98 G81 X[{x}+#2] Y{y} Z[0-#<depth>] R#2 F[#2*90]\n") + "G80\n", "", False),
    "subprogram from where the tool is": (strokes("G0 X{x} Y{y}\nM98 P7\n"), "O7\n" + SUBS["relative"], False),
    "subprogram run three times": (strokes("G0 X{x} Y{y}\nM98 P7 L3\n"), "O7\n" + SUBS["steps"], False),
    "subprogram in place": (strokes("G0 X{x} Y{y}\nM98 P7\n"), "O7\n" + SUBS["in place"], False),
}  # fmt: skip


def read(name: str) -> tuple[str, Program, Sequence, bool]:
    body, subprograms, either_way = PROGRAMS[name]
    text = f"{HEAD}{body}M5\nM30\n{subprograms}"
    program = interpret_program(text, load_dialect("linuxcnc"))
    return text, program, find_sequence(program, allow_reverse=either_way), either_way


@pytest.mark.parametrize("name", PROGRAMS)
def test_all_pieces_are_free_and_every_order_of_them_is_proved(name: str) -> None:
    """Each at its own S, F and dwell."""
    _, program, sequence, either_way = read(name)
    assert group_stay_reasons(sequence, {}, False) == ()
    (section,) = sequence.sections
    assert len(section.pieces) == len(PLACES)
    assert [c.reversible for c in section.pieces] == [either_way] * len(PLACES)
    for order in (*(some_orders(sequence, seed) for seed in range(3)), [np.arange(len(PLACES))[::-1]]):
        new = interpret_program(rewrite(program, sequence, order), load_dialect("linuxcnc"))
        assert certify(program, new).same
        assert work_of(new) == work_of(program)


@pytest.mark.parametrize("name", PROGRAMS)
def test_linuxcnc_makes_the_same_cuts_at_the_same_speeds(rs274: str, tmp_path: Path, name: str) -> None:
    text, program, sequence, _ = read(name)
    new = rewrite(program, sequence, some_orders(sequence, 1))
    assert new != text
    cuts = []
    for said in (text, new):
        status, output = run_rs274(rs274, said, tmp_path)
        assert status == 0, output
        cuts.append((Counter(m for m in moves_of_rs274(output) if m[0] != "rapid"), speeds_of_rs274(output)))
    assert cuts[0] == cuts[1]


def speeds_of_rs274(output: str) -> Counter:
    """Return with which speed every cut that rs274 prints ends where."""
    found: Counter = Counter()
    speed = ""
    for line in output.splitlines():
        name, _, rest = line.partition("(")
        if name.endswith("SET_SPINDLE_SPEED"):
            speed = rest
        elif name.endswith("STRAIGHT_FEED"):
            found[rest, speed] += 1
    return found


def test_a_stroke_from_its_other_end_waits_behind_the_plunge_as_before() -> None:
    _, program, sequence, _ = read("dwell after the plunge")
    text = rewrite(program, sequence, [np.array([0, ~2, ~1, 3, ~4])])
    assert "G0 X27. Y10.\nG1 Z-1. F100.\nG4 P0.5\nX20. F300.\nG4 P0\nG0 Z5.\n" in text
    proof = certify(program, interpret_program(text, load_dialect("linuxcnc")), allow_reverse=True)
    assert proof.same and proof.reversed_cuts == 3
    wrong = (
        text.replace("G4 P0.5\nX20.", "G4 P0.4\nX20."),
        text.replace("G1 Z-1. F100.\nG4 P0.5\nX20. F300.", "G4 P0.5\nG1 Z-1. F100.\nX20. F300."),
        text.replace("G4 P0.5\nX20. F300.\nG4 P0\n", "G4 P0\nX20. F300.\nG4 P0.5\n"),
    )
    for said in wrong:
        assert said != text
        assert not certify(program, interpret_program(said, load_dialect("linuxcnc")), allow_reverse=True).same


@pytest.mark.parametrize(
    "body, reason",
    [
        (strokes("G0 X{x} Y{y}\n{s}M3\nG1 Z-1. F100.\nX{end}\nG0 Z5.\n"), "the spindle is switched on or off"),
        (strokes("#1=[#1+1]\nG0 X{x} Y{y}\nG1 Z-1. F#1\nG0 Z5.\n").replace("[#1+1]", "90", 1), "parameters"),
        (strokes("G0 X{x} Y{y}\nG1 Z-1. F100.\nG1 X[#5420+7]\nG0 Z5.\n"), "parameters"),
        (strokes("G0 X{x} Y{y}\nM98 P8\n"), "coolant is switched on or off"),
        (strokes("#1=3\nG0 X{x} Y{y}\nM98 P9\n"), "parameters"),
    ],
    ids=[
        "M3 again",
        "a parameter set in between",
        "the current position",
        "M8 in the subprogram",
        "computed subprogram",
    ],
)
def test_what_cannot_be_proved_stays_and_says_why(body: str, reason: str) -> None:
    subprograms = "O8\nG1 Z-1. F100.\nM8\nX1.\nM9\nG0 Z5.\nM99\nO9\nG1 Z-#1 F100.\nG0 Z5.\nM99\n"
    program = interpret_program(f"{HEAD}{body}M5\nM30\n{subprograms}", load_dialect("linuxcnc"))
    sequence = find_sequence(program)
    groups = group_stay_reasons(sequence, {}, False)
    assert sum(g.count for g in groups) == len(PLACES)
    assert all(reason in g.text for g in groups)


def test_a_section_directly_behind_a_call_that_stays_has_its_own_lines() -> None:
    """The call's subprogram switches coolant; its text stands behind the end."""
    tail = "M5\nM30\nO8\nM8\nG4 P1\nM9\nM99\n"
    body = "G0 X90. Y90.\nM98 P8\n(first)\n" + strokes("(a hole)\nG0 X{x} Y{y}\nG1 Z-1. F100.\nG0 Z5.\n")
    program = interpret_program(HEAD + body + tail, load_dialect("linuxcnc"))
    sequence = find_sequence(program, mix_operations=True)
    (section,) = sequence.sections
    new = rewrite(program, sequence, [np.array([2, 1, 0, 4, 3])])
    assert len(section.pieces) == len(PLACES)
    assert sorted(set(new.splitlines())) == sorted({*(HEAD + body + tail).splitlines()})
    assert new.endswith(tail)
    assert new.count("M98 P8\n") == 1 and new.index("M98 P8") < new.index("X20.")
    assert certify(program, interpret_program(new, load_dialect("linuxcnc"))).same


def test_what_follows_a_circular_pocket_of_haas_is_free() -> None:
    """The position after G12 is unknown until the next words; holes after it do not depend on it."""
    pocket = "G0 X9. Y90.\nG12 I5. Z-2. F200. D1\nG0 Z5.\n"
    body = strokes("G0 X{x} Y{y}\nG1 Z-1. F100.\nG0 Z5.\n")
    program = interpret_program(f"%\nO1\n{HEAD}{pocket}{body}{pocket}{body}M30\n%\n", load_dialect("haas"))
    sequence = find_sequence(program)
    assert [len(s.pieces) for s in sequence.sections] == [5, 5]
    assert group_stay_reasons(sequence, {}, False) == ()
    new = interpret_program(rewrite(program, sequence, some_orders(sequence, 1)), load_dialect("haas"))
    assert certify(program, new).same
