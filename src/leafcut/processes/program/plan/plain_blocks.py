"""Blocks that are fully described by their words, so that their numbers can be replaced."""

from __future__ import annotations

from leafcut.gcode.program import Program
from leafcut.gcode.words import Word, plain_block


def words_of_row(program: Program, row: int) -> tuple[Word, ...]:
    """Return the words of the line of a row of the path; none if they are not plain words."""
    line = program.lines[int(program.line[program.block_of(row)]) - 1]
    plain = plain_block(line)
    return () if plain is None else plain.words


def is_plain(program: Program, row: int) -> bool:
    """Return whether a row is the only effect of its block: absolute, uncompensated, and run exactly once."""
    block = program.block_of(row)
    if int(program.first[block + 1]) - int(program.first[block]) != 1:
        return False
    if block in program.fixed or block in program.said or program.text_line[block] != program.line[block]:
        return False
    after = program.modal(block + 1)
    return not after.incremental and after.radius == 40 and bool(words_of_row(program, row))
