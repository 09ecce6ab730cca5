"""The rewriter on real programs: the same work in any order, by our interpreter and by LinuxCNC's."""

from __future__ import annotations

import functools
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.sequence import Sequence
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from rewriting import lowest_way, some_orders, work_of
from rs274_moves import moves_of_rs274, run_rs274
from shared_data import DATA

#: What only its own machine understands (`test_moves_rs274` has the lines at which it is refused).
UNREADABLE = ("gsender_invalid_gcode.nc", "lcnc_plasmac_pipe.ngc", "lcnc_plasmac_ramp_pierce.ngc")
GCODE = DATA / "gcode"
FILES = sorted(f.name for f in GCODE.glob("*") if f.suffix in (".ngc", ".nc", ".gcode") and f.name not in UNREADABLE)
#: Programs in which nothing may change places, and a word of why.
FIXED = {
    "bcnc_sample.gcode": "only",
    "camotics_genes_encoder.ngc": "in a loop or a subprogram",
    "camotics_heart_cutout.ngc": "holds",
    "camotics_scorpion.nc": "only",
    "cncjs_helical_thread.gcode": "is incremental (G91), but the position of Z before it is unknown",
    "lcnc_cam_nisley.ngc": "in a loop or a subprogram",
    "lcnc_test_12mmflat.ngc": "only",
    "pcb2gcode_easysdr_outline.ngc": "only",
    "ugs_serial_stress.gcode": "only",
}
FREE = [name for name in FILES if name not in FIXED]
#: All files; those that take more than half a second are slow.
LARGE = ("camotics_genes_encoder.ngc", "ugs_enclosure_cambam.nc")
TIERED = [pytest.param(name, marks=[pytest.mark.slow] if name in LARGE else []) for name in FILES]


@functools.cache
def read(name: str) -> tuple[str, Program, Sequence]:
    """Return the text of a file, its program, and its movable tasks; none of them is ever changed."""
    text = (GCODE / name).read_bytes().decode("latin-1")
    program = interpret_program(text, load_dialect("linuxcnc"), name)
    return text, program, find_sequence(program)


@pytest.mark.parametrize("name", TIERED)
def test_the_order_of_the_program_gives_its_own_bytes(name: str) -> None:
    text, program, sequence = read(name)
    assert rewrite(program, sequence, [np.arange(len(s.pieces)) for s in sequence.sections]) == text


@pytest.mark.parametrize("name", TIERED)
def test_another_order_does_the_same_work_and_crosses_no_lower(name: str) -> None:
    _, program, sequence = read(name)
    work, lowest = work_of(program), lowest_way(program)
    for seed in range(2 if sequence.sections else 0):
        text = rewrite(program, sequence, some_orders(sequence, seed))
        new = interpret_program(text, load_dialect("linuxcnc"), name)
        assert work_of(new) == work
        # Exactly: the numbers are those of the text.
        assert lowest_way(new) >= lowest or np.isnan(lowest)


@pytest.mark.parametrize("name", [case for case in TIERED if case.values[0] in FIXED])
def test_where_nothing_may_change_places_it_is_said_why(data: Path, name: str) -> None:
    _, _, sequence = read(name)
    assert sequence.sections == ()
    assert [issue.code for issue in sequence.issues].count("L502") == 1
    said = [*(issue.message for issue in sequence.issues), *(stay.reason for stay in sequence.stays)]
    assert any(FIXED[name] in text for text in said)


@pytest.mark.parametrize("name", FREE)
def test_linuxcnc_makes_the_same_cuts_of_another_order(rs274: str, tmp_path: Path, name: str) -> None:
    """The ends and feeds of all cutting moves that rs274 prints are the same multiset."""
    text, program, sequence = read(name)
    new = rewrite(program, sequence, some_orders(sequence, 5))
    assert new != text
    both = [run_rs274(rs274, program_text, tmp_path) for program_text in (text, new)]
    assert [status for status, _ in both] == [0, 0], [said[-300:] for _, said in both]
    cuts, cuts_now = (Counter(m for m in moves_of_rs274(said) if m[0] != "rapid") for _, said in both)
    assert cuts.total() > 10
    assert cuts == cuts_now
