"""The proof can fail: it finds a changed digit and a lost line in the program of every dialect."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator, Sequence
from functools import cache
from typing import TypeVar

import pytest

from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import dialect_names, load_dialect
from leafcut.model.machine import Machine
from leafcut.model.toolpath import DrillCycle, Toolpath, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.writer import write_program
from leafcut.proof.program import check_program, interpret_written_program

T = TypeVar("T")

MILL = Machine(
    "mill",
    "",
    "linuxcnc",
    (100.0, 100.0, 50.0),
    (500.0, 500.0, 250.0),
    40.0,
    (-400.0, -400.0, -300.0),
    (400.0, 400.0, 100.0),
    work_offset=(0.0, 0.0, 0.0),
    spindle_max_rpm=9000.0,
    safe_z=0.0,
)

#: Words without effect in these programs. They contain no radius compensation, arc, constant surface speed or length
#: offset, so nothing depends on their cancellation or on the path mode. G0 ends a cycle like G80.
IDLE = {"G17", "G40", "G44", "G49", "G54", "G61", "G64", "G80", "G90", "G91.1", "G92.1", "G97", "G98", "G99"}

#: Mutants that the proof rightly passes. G91 G28 and a second G90 follow the first G90, and no move follows the last
#: one. Programs without arcs and cycles use no plane.
HARMLESS = {
    "fanuc": [
        "G90 → G00 in 'G17 G00 G40 G49 G80'",
        "G90 → G91 in 'G17 G91 G40 G49 G80'",
        "G90 → G00 in 'G00'",
        "G90 → G91 in 'G91'",
    ],
    "centroid": [
        "G90 → G00 in 'G17 G00 G40 G49 G80'",
        "G90 → G91 in 'G17 G91 G40 G49 G80'",
        "G90 → G00 in 'G00'",
        "G90 → G91 in 'G91'",
    ],
    "siemens-iso": [
        "G90 → G00 in 'G17 G00 G40 G49 G80'",
        "G90 → G91 in 'G17 G91 G40 G49 G80'",
        "G90 → G00 in 'G00'",
        "G90 → G91 in 'G91'",
    ],
    "grbl": ["G17 → G18 in 'G18 G90 G40 G49 G80'"],
    "rrf": ["G17 → G18 in 'G18'"],
    "masso": [
        "G90 → G00 in 'G17 G00 G40 G80'",
        "G90 → G91 in 'G17 G91 G40 G80'",
        "G90 → G00 in 'G00'",
        "G90 → G91 in 'G91'",
    ],
}

#: `tests/gcode/test_klartext.py` covers the dialects for drilling only.
NAMES = [name for name in dialect_names(torch=False) if load_dialect(name).language != "klartext"]

# Block numbers, program numbers and comments move nothing. Siemens controls use names and arguments in parentheses.
_WORD = re.compile(r"(?<!\d)\([^)]*\)|;.*|[NO]\d+|([A-Z\"]|(?<=\d)\(|,)([-+]?[\d.]+)")


def planned(name: str) -> Toolpath:
    """Return a planned toolpath: two drills with every cycle of the dialect, and a slot."""
    cycles = {
        "G81": DrillCycle("G81", 2.125, -5.25),
        "G82": DrillCycle("G82", 2.125, -5.375, True, 0.0, 0.25),
        "G83": DrillCycle("G83", 2.125, -10.125, False, 3.25),
        "G73": DrillCycle("G73", 2.125, -10.25, True, 3.125),
        "G85": DrillCycle("G85", 2.125, -5.5),
        "G84": DrillCycle("G84", 2.125, -6.125),
    }
    names = [n for n in cycles if n != "G84" or n in load_dialect(name).cycles]
    b = ToolpathBuilder()
    to_zero = load_dialect(name).has_machine_moves
    for tool, rpm in ((1, 1234.0), (2, 2345.0)):
        if to_zero:
            b.machine(z=0.0)
        b.spindle(0.0)
        b.coolant(0)
        b.tool(tool)
        b.spindle(rpm)
        b.dwell(2.25)
        b.coolant(2)
        if not to_zero:
            b.rapid(z=30.5)
        b.rapid(11.125, 12.375)
        b.rapid(z=25.5)
        # The second tool drills once only: it is here for the tool change.
        for row, cycle in enumerate(names[: None if tool == 1 else 1]):
            for column in range(2):
                b.drill(11.125 * (column + 1), 12.375 + 5.125 * row, cycles[cycle], feed=(123.5 + row) / 60)
            if b.position[2] < 25.5:
                b.rapid(z=25.5)
    b.rapid(51.25, 13.125)
    b.rapid(z=2.125)
    b.feed(z=-1.625, feed=65.5 / 60)
    b.feed(61.375, 13.125, feed=234.5 / 60)
    b.rapid(z=25.5)
    if to_zero:
        b.machine(z=0.0)
    b.spindle(0.0)
    b.coolant(0)
    b.end()
    return b.build()


@cache
def written(name: str, units: str) -> tuple[Toolpath, str]:
    path = planned(name)
    return path, write_program(path, load_dialect(name), PostOptions(output_units=units), ["mutations"])


def faults(name: str, units: str, text: str) -> list[str]:
    """Return the differences that the proof finds in a text."""
    path = written(name, units)[0]
    try:
        return [
            str(d)
            for d in check_program(
                path, interpret_written_program(text, load_dialect(name)), load_dialect(name), MILL, units
            )
        ]
    except LeafcutError as problem:
        return [str(problem)]


Mutation = tuple[str, str, str, str]


def mutations(text: str) -> Iterator[list[Mutation]]:
    """Yield for each word its mutants, one per digit: (word before, word after, line, text)."""
    for word in _WORD.finditer(text):
        if word.group(1) is None:
            continue
        found = []
        for place in range(word.start(2), word.end(2)):
            if text[place].isdigit():
                digit = str((int(text[place]) + 1) % 10)
                changed = text[:place] + digit + text[place + 1 :]
                line = changed[changed.rfind("\n", 0, place) + 1 : changed.index("\n", place)]
                found.append((word.group(), changed[word.start() : word.end()], line, changed))
        yield found


def relevant_mutations(text: str, name: str, units: str) -> Iterator[Mutation]:
    """Yield the mutants that change the work.

    In inches, yield only the smallest change of a decimal number, the hardest to find.
    """
    for changes in mutations(text):
        matter = [one for one in changes if matters(one[0], one[1], name)]
        yield from matter[-1:] if units == "inch" and changes and "." in changes[0][0] else matter


def matters(before: str, after: str, name: str) -> bool:
    """Return whether a changed word changes the work, by rules of thumb and not by the interpreter."""
    old, new = (float(word[1:]) for word in (before, after))
    # Controllers keep a dwell to 1 ms.
    dwell = 1.0 if load_dialect(name).dwell_unit == "ms" else 0.001
    room = {load_dialect(name).dwell_letter: dwell + 1e-9, "F": max(0.005 * old, 0.5), "S": max(0.001 * old, 0.5)}
    return abs(new - old) > room.get(before[0], 0.0) and not {before, after} <= IDLE


#: Mutants and lost lines of each program in the short form: a seeded sample.
SAMPLE = 25
LENGTHS = ["short", pytest.param("all", marks=pytest.mark.slow)]


def sampled(mutants: Sequence[T], length: str, name: str) -> list[T]:
    """Return all mutants, or a sample of them."""
    return list(mutants) if length == "all" else random.Random(name).sample(mutants, SAMPLE)


@pytest.mark.hazard
@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize(
    "name, units",
    [(name, units) for name in NAMES for units in ("mm", "inch")[: 1 + bool(load_dialect(name).units_inch)]],
)
def test_the_proof_finds_every_changed_digit_that_changes_the_work(name: str, units: str, length: str) -> None:
    _, text = written(name, units)
    assert faults(name, units, text) == []
    mutants = list(relevant_mutations(text, name, units))
    assert len(mutants) > (200 if units == "mm" else 100)
    missed = [
        f"{before} → {after} in '{line}'"
        for before, after, line, changed in sampled(mutants, length, f"{name} {units}")
        if not faults(name, units, changed)
    ]
    harmless = HARMLESS.get(name, [])
    assert missed == harmless if length == "all" else set(missed) <= set(harmless)


@pytest.mark.hazard
@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("name", NAMES)
def test_the_proof_finds_a_lost_line(name: str, length: str) -> None:
    """Lines that move or dwell, or that switch tool, spindle or coolant."""
    _, text = written(name, "mm")
    lines = text.splitlines()
    working = [k for k, line in enumerate(lines) if re.match(r"[^(%;]*([XYZ]|M[0-9]|G4|S\d|T\d)", line)]
    assert len(working) > 30
    dropped = sampled(working, length, name)
    assert [lines[k] for k in dropped if not faults(name, "mm", "\n".join([*lines[:k], *lines[k + 1 :], ""]))] == []


@pytest.mark.hazard
@pytest.mark.parametrize("name", NAMES)
def test_the_head_of_a_program_resets_every_modal_state_that_another_program_may_leave(name: str) -> None:
    head = [word for line in written(name, "mm")[1].splitlines()[:12] for word in line.split()]
    assert {"G17", "G90", "G40", "G80", "G94", "G54"} & set(load_dialect(name).g_words.split()) <= set(head)
