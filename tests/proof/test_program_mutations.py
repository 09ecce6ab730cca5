"""One digit changed anywhere in a program is found, in every dialect: the proof of a program can fail."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache

import pytest

from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import dialect, dialects
from leafcut.model.machine import Machine
from leafcut.model.toolpath import DrillCycle, Toolpath, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.writer import write_program
from leafcut.proof.program import check_program, read_back

MILL = Machine(
    "mill", "", "linuxcnc", (100.0, 100.0, 50.0), (500.0, 500.0, 250.0), 40.0, (-400.0, -400.0, -300.0),
    (400.0, 400.0, 100.0), work_offset=(0.0, 0.0, 0.0), spindle_max_rpm=9000.0, safe_z=0.0,
)  # fmt: skip

#: Words that say what is so anyway: without radius compensation, arcs, constant surface speed or a length offset it
#: does not matter whether these are switched off, nor how exactly corners are met; and a G0 ends a cycle as G80 does.
IDLE = {"G17", "G40", "G44", "G49", "G54", "G61", "G64", "G80", "G90", "G91.1", "G92.1", "G97", "G98", "G99"}

#: What is missed and does no harm: G91 G28 and G90 follow the first G90, and nothing moves after the last one; without
#: arcs and cycles there is no plane.
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

#: Those for drilling only are tried by `tests/gcode/test_klartext.py`.
NAMES = [name for name in dialects(torch=False) if dialect(name).language != "klartext"]

# A block number, a program number and a comment move nothing. A Siemens control has arguments in parentheses and names.
_WORD = re.compile(r"(?<!\d)\([^)]*\)|;.*|[NO]\d+|([A-Z\"]|(?<=\d)\(|,)([-+]?[\d.]+)")


def planned(name: str) -> Toolpath:
    """Two drills with every cycle that the dialect has, and a slot, as the planner lays them."""
    cycles = {
        "G81": DrillCycle("G81", 2.125, -5.25),
        "G82": DrillCycle("G82", 2.125, -5.375, True, 0.0, 0.25),
        "G83": DrillCycle("G83", 2.125, -10.125, False, 3.25),
        "G73": DrillCycle("G73", 2.125, -10.25, True, 3.125),
        "G85": DrillCycle("G85", 2.125, -5.5),
        "G84": DrillCycle("G84", 2.125, -6.125),
    }
    names = [n for n in cycles if n != "G84" or n in dialect(name).cycles]
    b = ToolpathBuilder()
    to_zero = dialect(name).has_machine_moves
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
        # The second tool is there for what a change of tools writes; every word tried takes a whole reading.
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
    return path, write_program(path, dialect(name), PostOptions(output_units=units), ["mutations"])


def faults(name: str, units: str, text: str) -> list[str]:
    """Return what the proof says about a text, as words."""
    path = written(name, units)[0]
    try:
        return [str(d) for d in check_program(path, read_back(text, dialect(name)), dialect(name), MILL, units)]
    except LeafcutError as problem:
        return [str(problem)]


Mutation = tuple[str, str, str, str]


def mutations(text: str) -> Iterator[list[Mutation]]:
    """Yield for every word (word before, word after, line, text) for each of its digits, set to the next digit."""
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


def tried_of(text: str, name: str, units: str) -> Iterator[Mutation]:
    """Yield the changes that matter; in inches of a decimal number the smallest alone, which is the hardest to find.

    Every digit tried takes a whole reading; that greater changes are found, too, is tried in millimetres.
    """
    for changes in mutations(text):
        matter = [one for one in changes if matters(one[0], one[1], name)]
        yield from matter[-1:] if units == "inch" and changes and "." in changes[0][0] else matter


def matters(before: str, after: str, name: str) -> bool:
    """Return whether a change of one word changes the work, by rules of thumb of the shop, not by the interpreter."""
    old, new = (float(word[1:]) for word in (before, after))
    # A dwell is not kept better than to a thousandth of a second.
    dwell = 1.0 if dialect(name).dwell_unit == "ms" else 0.001
    room = {dialect(name).dwell_letter: dwell + 1e-9, "F": max(0.005 * old, 0.5), "S": max(0.001 * old, 0.5)}
    return abs(new - old) > room.get(before[0], 0.0) and not {before, after} <= IDLE


@pytest.mark.parametrize(
    "name, units",
    [(name, units) for name in NAMES for units in ("mm", "inch")[: 1 + bool(dialect(name).units_inch)]],
)
def test_one_digit_changed_is_found_wherever_it_matters(name: str, units: str) -> None:
    _, text = written(name, units)
    assert faults(name, units, text) == []
    tried, missed = 0, []
    for before, after, line, changed in tried_of(text, name, units):
        tried += 1
        if not faults(name, units, changed):
            missed.append(f"{before} → {after} in '{line}'")
    assert tried > (200 if units == "mm" else 100)
    assert missed == HARMLESS.get(name, [])


@pytest.mark.parametrize("name", NAMES)
def test_a_line_lost_is_found(name: str) -> None:
    """Every line that moves, waits, or switches a tool, the spindle or the coolant on, and every end of those."""
    _, text = written(name, "mm")
    lines = text.splitlines()
    working = [k for k, line in enumerate(lines) if re.match(r"[^(%;]*([XYZ]|M[0-9]|G4|S\d|T\d)", line)]
    assert len(working) > 30
    lost = ["\n".join([*lines[:k], *lines[k + 1 :], ""]) for k in working]
    assert [lines[k] for k, rest in zip(working, lost, strict=True) if not faults(name, "mm", rest)] == []


@pytest.mark.parametrize("name", NAMES)
def test_every_head_states_what_another_program_may_have_left_over(name: str) -> None:
    head = [word for line in written(name, "mm")[1].splitlines()[:12] for word in line.split()]
    assert {"G17", "G90", "G40", "G80", "G94", "G54"} & set(dialect(name).g_words.split()) <= set(head)
