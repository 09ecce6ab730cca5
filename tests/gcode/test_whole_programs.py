"""Everything that is understood of small programs: rows, modal states, and the reasons why blocks stay.

`programs/` has each program, its dialect in its name, and the reading, which was checked by eye against the program.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Modal, Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.toolpath import Kind
from plain_text import number, text_of

PROGRAMS = Path(__file__).parent / "programs"


def row_text(program: Program, row: int) -> str:
    """Return a row: its kind, its end, its value, and its arc or cycle."""
    motion = program.path[row]
    end = ",".join(map(number, motion.end))
    parts = [motion.kind.name, end, f"value {number(motion.value)}" * bool(motion.value)]
    if motion.kind in (Kind.ARC_CW, Kind.ARC_CCW):
        parts.append(text_of(program.path.arcs[motion.ref]))
    elif motion.kind is Kind.DRILL:
        parts.append(text_of(program.path.cycles[motion.ref]))
    elif motion.ref:
        parts.append(f"ref {motion.ref}")
    return " ".join(filter(None, parts))


def changes(before: Modal, after: Modal) -> str:
    """Return the modal values that differ, after the change."""
    names = [name for name in Modal.__dataclass_fields__ if getattr(before, name) != getattr(after, name)]
    return ", ".join(f"{name} {text_of(getattr(after, name))}" for name in names)


def reading_of(text: str, name: str) -> str:
    """Return what is understood of a program, block by block."""
    try:
        program = interpret_program(text, load_dialect(name), "program")
    except ReadError as problem:
        return f"refused: {problem}\n"
    lines = []
    for block in range(program.n_blocks):
        lines.append(f"{program.line[block]}: {program.lines[int(program.line[block]) - 1].strip()}")
        lines += [f"    {row_text(program, row)}" for row in range(*map(int, program.first[block : block + 2]))]
        if block in program.switched_off:
            end, during = program.switched_off[block]
            lines.append(f"    before row {end}: {changes(program.modal(block + 1), program.modals[during])}")
        if program.before[block] != program.before[block + 1]:
            lines.append(f"    then {changes(program.modal(block), program.modal(block + 1))}")
        if block in program.fixed:
            lines.append(f"    stays: {program.fixed[block]}")
        if block in program.descriptions:
            text, *digests = program.descriptions[block]
            named = zip(("parameters", "calls", "again"), digests, strict=True)
            found = [f"[{name} {digest}]" for name, digest in named if digest or (name, digest) == ("parameters", "")]
            lines.append(f"    described: {' '.join([text, *found])}")
    for field in ("last_line", "obeyed", "assumed_units", "feed_words", "calls", "dark_rapids", "title_lines"):
        if getattr(program, field):
            lines.append(f"{field}: {text_of(getattr(program, field))}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("file", sorted(PROGRAMS.glob("*.nc")), ids=lambda file: file.stem)
def test_a_program_is_understood_as_it_was_written(file: Path) -> None:
    """The suffix of the name is the dialect: mill.haas.nc. Programs are separated by lines of dashes."""
    texts = file.read_text(encoding="utf-8").split("-----\n")
    reading = "-----\n".join(reading_of(text, file.stem.rpartition(".")[2]) for text in texts)
    assert reading == file.with_suffix(".txt").read_text(encoding="utf-8")
