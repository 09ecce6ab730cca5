"""The rewriter on real programs: the same work in any order, by our interpreter and by LinuxCNC's."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from leafcut.errors import ReadError
from leafcut.gcode.dialects import dialect
from leafcut.gcode.foreign import interpret_program
from leafcut.gcode.program import Program
from leafcut.plan.resequencing import find_sequence
from leafcut.post.rewriter import rewrite
from rewriting import lowest_way, some_orders, work_of
from rs274_moves import moves_of_rs274, run_rs274

DATA = Path(os.environ.get("LEAFCUT_DATA") or Path(__file__).parents[2] / "../shared/data") / "gcode"
FILES = sorted(f.name for f in DATA.glob("*") if f.suffix in (".ngc", ".nc", ".gcode"))


def read(name: str) -> tuple[str, Program]:
    text = (DATA / name).read_bytes().decode("latin-1")
    try:
        return text, interpret_program(text, dialect("linuxcnc"), name)
    except ReadError as problem:
        pytest.skip(str(problem))


@pytest.mark.parametrize("name", FILES)
def test_the_order_of_the_program_gives_its_own_bytes(name: str) -> None:
    text, program = read(name)
    sequence = find_sequence(program)
    assert rewrite(program, sequence, [np.arange(len(s.chains)) for s in sequence.sections]) == text


@pytest.mark.parametrize("name", FILES)
def test_another_order_does_the_same_work_and_crosses_no_lower(name: str) -> None:
    _, program = read(name)
    sequence = find_sequence(program)
    for seed in range(3 if sequence.sections else 0):
        text = rewrite(program, sequence, some_orders(sequence, seed))
        new = interpret_program(text, dialect("linuxcnc"), name)
        assert work_of(new) == work_of(program)
        # Not by a hair: the numbers are those of the text.
        assert lowest_way(new) >= lowest_way(program) or np.isnan(lowest_way(program))


@pytest.mark.external
@pytest.mark.parametrize("name", FILES)
def test_linuxcnc_makes_the_same_cuts_of_another_order(rs274: str, tmp_path: Path, name: str) -> None:
    """The ends and feeds of all cutting moves that rs274 prints are the same multiset."""
    text, program = read(name)
    sequence = find_sequence(program)
    if not sequence.sections:
        pytest.skip("nothing may change places")
    status, said = run_rs274(rs274, text, tmp_path)
    if status != 0:
        pytest.skip("rs274 refuses the original")
    new = rewrite(program, sequence, some_orders(sequence, 5))
    assert new != text
    status, said_now = run_rs274(rs274, new, tmp_path)
    assert status == 0, said_now[-300:]
    cuts, cuts_now = (Counter(m for m in moves_of_rs274(s) if m[0] != "rapid") for s in (said, said_now))
    assert cuts.total() > 10
    assert cuts == cuts_now
