"""A program with cuts turned round, spoilt in every place where turning may go wrong: the certificate finds each."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pytest

from leafcut.errors import LeafcutError
from leafcut.gcode.program import Program
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of

#: Every kind of piece, with another feed in the middle, for a mill, and for a laser.
CUTS = (
    "X{} Y0 / {} / G1 X{} F200 / Y5 F90 / X{} F200 / Y9 / {}",
    "X{} Y20 / {} / G2 X{} I2 J0 F200 / G3 X{} I2 J0 F150 / G2 X{} I2.5 J0 F200 / {}",
    "X{} Y40 / {} / G1 X{} F200 / G3 X{} Y43 R4 / G1 X{} / {}",
)
MILL = ("G1 Z-1 F50", "G1 Z1 F80 / G0 Z5", "G21 G90 / T1 M6 / S900 M3 / G0 Z5", "M5 / M2")
LASER = ("M3", "M5", "G21 G90 / S300", "M2")


def original_of(down: str, up: str, head: str, foot: str) -> Program:
    lines = [head]
    for number in range(6):
        x = 30 * number
        steps = (x, down, x + 4, x + 8, up) if number % 3 == 0 else (x, down, x + 4, x + 8, x + 13, up)
        lines.append("G0 " + CUTS[number % 3].format(*steps))
    return program_of(" / ".join([*lines, foot]))


def turned(program: Program) -> str:
    """Return the text with every cut made from its other end."""
    sequence = find_sequence(program, allow_reverse=True)
    (section,) = sequence.sections
    assert all(piece.reversible for piece in section.pieces)
    return rewrite(program, sequence, [np.array([~k for k in range(len(section.pieces))])])


def each(text: str, pattern: str, becomes: str | dict[str, str]) -> Iterator[str]:
    """Yield the text with one place changed where the pattern is found, each in turn."""
    for found in re.finditer(pattern, text):
        new = becomes[found[0]] if isinstance(becomes, dict) else found.expand(becomes)
        yield text[: found.start()] + new + text[found.end() :]


def feeds_moved(text: str) -> Iterator[str]:
    """Yield the text with the feeds of two blocks of a cut exchanged, if they differ."""
    lines = text.splitlines()
    for k in range(len(lines) - 1):
        one, other = (re.search(r"F\d+", line) for line in lines[k : k + 2])
        if one and other and one[0] != other[0]:
            pair = lines[k].replace(one[0], other[0]), lines[k + 1].replace(other[0], one[0])
            yield "\n".join([*lines[:k], *pair, *lines[k + 2 :], ""])


def lines_gone(text: str) -> Iterator[str]:
    """Yield the text without one of the lines that cut, and with one twice."""
    lines = text.splitlines()
    for k, line in enumerate(lines):
        if line.startswith(("G1", "G2", "G3")) and "Z" not in line:
            yield "\n".join([*lines[:k], *lines[k + 1 :], ""])


MUTATIONS = {
    "an arc with the other G word": lambda text: each(text, r"\bG[23]\b", {"G2": "G3", "G3": "G2"}),
    "an arc made a line": lambda text: each(text, r"\bG[23] (.*?)(?: [IJR][-\d.]+)+", r"G1 \1"),
    "the centre where it was from the other end": lambda text: each(text, r"I-(\d)", r"I\1"),
    "another radius": lambda text: each(text, r"R4\b", "R5"),
    "feeds on the wrong pieces": feeds_moved,
    "a feed lost": lambda text: each(text, r"(?m)^(.*) F90$", r"\1"),
    "a piece lost": lines_gone,
    "an end not moved": lambda text: each(text, r"(?m)^G0 X(\d+)", r"G0 X1\1"),
}


@pytest.mark.parametrize("tool", [MILL, LASER], ids=["mill", "laser"])
def test_cuts_turned_round_are_the_same_work_with_the_option_only(tool: tuple[str, str, str, str]) -> None:
    original = original_of(*tool)
    new = program_of(turned(original))
    found = certify(original, new, allow_reverse=True)
    assert found.same
    assert found.reversed_cuts == 6
    assert not certify(original, new).same


@pytest.mark.hazard
@pytest.mark.parametrize("tool", [MILL, LASER], ids=["mill", "laser"])
def test_one_cut_turned_without_the_option_is_found(tool: tuple[str, str, str, str]) -> None:
    original = original_of(*tool)
    sequence = find_sequence(original, allow_reverse=True)
    for k in range(6):
        order = np.array([~i if i == k else i for i in range(6)])
        new = program_of(rewrite(original, sequence, [order]))
        assert certify(original, new, allow_reverse=True).reversed_cuts == 1
        assert not certify(original, new).same


@pytest.mark.hazard
@pytest.mark.parametrize("mutation", MUTATIONS.values(), ids=MUTATIONS.keys())
@pytest.mark.parametrize("tool", [MILL, LASER], ids=["mill", "laser"])
def test_what_turning_may_get_wrong_is_found(tool: tuple[str, str, str, str], mutation: object) -> None:
    original = original_of(*tool)
    spoilt = list(mutation(turned(original)))  # type: ignore[operator]
    assert len(spoilt) > 1
    for text in spoilt:
        try:
            new = program_of(text)
        except LeafcutError:  # An arc that does not end on its circle is no program.
            continue
        assert not certify(original, new, allow_reverse=True).same, text
