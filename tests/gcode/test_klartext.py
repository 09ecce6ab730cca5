"""Heidenhain's conversational language: writing, reading back, and refusals."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import leafcut
from leafcut.errors import LeafcutError, OptionError, PostError, ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.klartext import interpret_klartext
from leafcut.model.cycles import expand_cycles
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.writer import write_program
from leafcut.proof.program import check_program, interpret_written_program
from leafcut.proof.read_back import compare_motion

WORDS = load_dialect("heidenhain")
GOLDEN = Path(__file__).parents[1] / "golden" / "two_drills_heidenhain_mm.h"
MILL = Machine("mill", "", "heidenhain", (100.0, 100.0, 50.0), (500.0, 500.0, 250.0), 40.0, (-400.0,) * 3, (400.0,) * 3)

CYCLES = (
    DrillCycle("G81", 2.0, -5.25),
    DrillCycle("G82", 2.0, -5.5, True, 0.0, 0.25),
    DrillCycle("G83", 2.0, -10.0, False, 10 / 3),
    DrillCycle("G85", 2.0, -5.0),
    DrillCycle("G81", 12.5, 3.25, True),
)


def drills(cycles: tuple[DrillCycle, ...] = CYCLES, feed: float = 2.0) -> Toolpath:
    """Two drills, each with two holes of every cycle, from a clearance of 25 mm."""
    b = ToolpathBuilder()
    for tool, rpm in ((1, 1000.0), (2, -2000.0)):
        b.tool(tool)
        b.rapid(z=25.0)
        b.spindle(rpm)
        b.dwell(2.5)
        b.coolant(2)
        b.rapid(0.0, 0.0)
        for row, cycle in enumerate(cycles):
            if b.position[2] != 25.0:
                b.rapid(z=25.0)
            for column in range(2):
                b.drill(12.7 * column + 1 / 3, 5.0 * row + 1 / 7, cycle, feed=feed + row / 8)
        b.rapid(z=40.0)
        b.spindle(0.0)
        b.coolant(0)
    b.end()
    return b.build()


def text_of(path: Toolpath) -> str:
    return write_program(path, WORDS, PostOptions(), ["two drills"], tool_names={1: "drill 3 mm"})


def test_a_program_is_the_golden_one() -> None:
    text = text_of(drills())
    if os.environ.get("LEAFCUT_WRITE_GOLDEN") == "1":
        GOLDEN.write_bytes(text.encode("ascii"))
    assert GOLDEN.read_bytes() == text.encode("ascii")
    numbers = [int(one) for one in re.findall(r"^(\d+) ", text, re.MULTILINE)]
    assert numbers == list(range(len(numbers)))


def test_blocks_have_one_number_with_line_numbers_too() -> None:
    """The language numbers every block itself, so the option adds nothing."""
    assert write_program(drills(), WORDS, PostOptions(line_numbers=True)) == write_program(
        drills(), WORDS, PostOptions()
    )


def test_a_golden_program_is_what_was_planned() -> None:
    """The same proof that stands before a file is written."""
    path = drills()
    assert check_program(path, interpret_written_program(GOLDEN.read_text("ascii"), WORDS), WORDS, MILL, "mm") == []


@settings(max_examples=settings().max_examples * 2)
@given(data=st.data())
def test_any_drilling_reads_back(data: st.DataObject) -> None:
    """Any planes, depths and dwells, with and without return to the height before: the same moves."""
    cycles = []
    for _ in range(data.draw(st.integers(1, 4))):
        name = data.draw(st.sampled_from(["G81", "G82", "G83", "G73", "G85"]))
        r_plane, depth = data.draw(st.integers(-500, 2000)) / 100, data.draw(st.integers(30, 4000)) / 100
        peck = depth / data.draw(st.floats(0.8, 5.0)) if name in ("G83", "G73") else 0.0
        dwell = data.draw(st.integers(1, 9000)) / 1000 if name == "G82" else 0.0
        high = name != "G85" and data.draw(st.booleans())
        cycles.append(DrillCycle(name, r_plane, r_plane - depth, high, peck, dwell))
    path = drills(tuple(cycles), data.draw(st.floats(0.2, 50.0)))
    read = interpret_klartext(text_of(path))
    assert compare_motion(expand_cycles(path), expand_cycles(read), 0.0016) == []


def mutations(text: str) -> list[tuple[str, str]]:
    """Return (line, text) for every digit of every number behind a block number, set to the next digit."""
    found, at = [], 0
    for line in text.splitlines(keepends=True):
        start = line.index(" ") + 1
        code = re.sub(r" ;.*", "", line[start:]) if "BLK FORM" not in line and line[start : start + 2] != "; " else ""
        for place, letter in enumerate(code):
            if letter.isdigit():
                digit = str((int(letter) + 1) % 10)
                where = at + start + place
                found.append((line, text[:where] + digit + text[where + 1 :]))
        at += len(line)
    return found


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_one_digit_changed_is_found(every: int) -> None:
    """But for a feed within half a percent, and a speed within a thousandth."""
    path = drills()
    text = text_of(path)
    missed = []
    for line, changed in mutations(text)[::every]:
        try:
            faults = check_program(path, interpret_written_program(changed, WORDS), WORDS, MILL, "mm")
        except LeafcutError:
            continue
        if not faults and not re.search(r"Q206=|R0 F\d|TOOL CALL", line):
            missed.append(line)
    # A stroke longer than the depth of the hole is still a single stroke.
    assert {re.sub(r"[\d.]+", "0", line.strip()) for line in missed} <= {"Q0=+0 ;PLUNGING DEPTH ~"}


def test_a_line_lost_is_found() -> None:
    path = drills()
    lines = text_of(path).splitlines()
    for number, line in enumerate(lines):
        if " ; " in line or "BLK FORM" in line:
            continue
        rest = [re.sub(r"^\d+", "", one) if one[0].isdigit() else one for one in lines[:number] + lines[number + 1 :]]
        count = iter(range(len(rest)))
        text = "".join(
            f"{next(count)}{one}\n" if one.startswith(" ") and not one.startswith("  Q") else f"{one}\n" for one in rest
        )
        with_faults = False
        try:
            with_faults = bool(check_program(path, interpret_written_program(text, WORDS), WORDS, MILL, "mm"))
        except LeafcutError:
            with_faults = True
        assert with_faults, line


HEAD = "BEGIN PGM A MM|TOOL CALL 1 Z S100|L Z+10 R0 FMAX|M3|L X+0 Y+0 R0 FMAX|"
CYCLE = (
    "CYCL DEF 200 DRILLING ~\n Q200=+2 ;A ~\n Q201=-5 ;B ~\n Q206=+60 ;C ~\n Q202=+5 ;D ~\n Q210=+0 ;E ~\n"
    " Q203=+0 ;F ~\n Q204=+10 ;G ~\n Q211=+0 ;H"
)


def numbered(blocks: str) -> str:
    return "".join(f"{number} {block}\n" for number, block in enumerate(blocks.split("|")))


def test_the_planes_of_cycle_200_count_from_the_surface() -> None:
    path = interpret_klartext(numbered(HEAD + CYCLE + "|L X+1 R0 FMAX M99|M30|END PGM A MM"))
    assert path.cycles == (DrillCycle("G81", 2.0, -5.0, True),)
    path = interpret_klartext(
        numbered(
            HEAD
            + CYCLE.replace("Q203=+0", "Q203=-4").replace("204=+10", "204=+2")
            + "|L X+1 R0 FMAX M99|M30|END PGM A MM"
        )
    )
    assert path.cycles == (DrillCycle("G81", -2.0, -9.0),)


@pytest.mark.parametrize(
    "blocks, words",
    [
        ("TOOL CALL 1 Z", "start with BEGIN PGM"),
        ("BEGIN PGM A INCH", "start with BEGIN PGM"),
        ("BEGIN PGM A MM|L Z+5 R0 FMAX", "before the first TOOL CALL"),
        (HEAD + "L X+1 R0 FMAX M99", "M99 calls no cycle, because CYCL DEF 200 is missing after the last tool call"),
        (HEAD + CYCLE.replace("Q201=-5", "Q201=+5"), "Q201 below it"),
        (HEAD + CYCLE.replace("Q204=+10", "Q204=+1"), "Q204 not below Q200"),
        (HEAD + CYCLE.replace("Q204=+10", "Q204=+8") + "|L X+1 R0 FMAX M99", "Q204 is neither"),
        (HEAD + CYCLE.replace("Q202=+5", "Q202=+2"), "Q202 must not be less than the depth"),
        (HEAD + CYCLE.replace("Q210=+0", "Q210=+1"), "Q210 must be 0"),
        (HEAD + CYCLE.replace(" ~\n Q211=+0 ;H", ""), "cycle 200 needs Q200"),
        (HEAD + CYCLE + "|L Z+1 R0 FMAX|L X+1 R0 FMAX M99", "from below its set-up clearance"),
        (HEAD + CYCLE + "|L X+1 Z+3 R0 FMAX M99", "a hole must be approached with"),
        (
            HEAD + CYCLE + "|TOOL CALL 2 Z S5|L X+1 R0 FMAX M99",
            "M99 calls no cycle, because CYCL DEF 200 is missing after the last tool call",
        ),
        (HEAD + "CYCL DEF 9.0 DWELL TIME|M8", "CYCL DEF 9.1, which states the dwell time, is missing"),
        (HEAD + "CYCL DEF 203 UNIVERSAL DRILLING", "that it wrote itself"),
        (HEAD + "CC X+0 Y+0", "that it wrote itself"),
        (HEAD + "L X+1 RL F100", "that it wrote itself"),
        (HEAD + "L X+Q1 R0 FMAX", "that it wrote itself"),
        (HEAD + CYCLE + " ~", "the last block is incomplete (~)"),
        (HEAD + "M30|END PGM A MM|M5", "the program continues after END PGM"),
        ("BEGIN PGM A MM|TOOL CALL 1 Z|M3", "M3 has no speed, because TOOL CALL lacks S"),
        (HEAD + "CYCL DEF 9.0 DWELL TIME|CYCL DEF 9.1 DWELL -1", "a dwell cannot be negative"),
        (HEAD + "L R0 FMAX", "the L block has no axis"),
        (HEAD + "L X+1 R0 F0", "the cut has no feed"),
        (HEAD + "L " + "X+1 " * 3_000, "characters; this is not a program"),
        (HEAD + "M30", "END PGM is missing"),
        (HEAD + "END PGM A MM", "the program ends without M30"),
        (HEAD + "M30|M3", "continues after M30"),
    ],
)
def test_what_is_not_written_so_is_refused(blocks: str, words: str) -> None:
    with pytest.raises(ReadError, match=re.escape(words)) as caught:
        interpret_klartext(numbered(blocks))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("text", "line", "block"), [("G21\nG0 X1\n", 1, 0), ("0 BEGIN PGM A MM\n2 M30\n", 2, 1)])
def test_a_missing_block_number_says_what_to_do(text: str, line: int, block: int) -> None:
    told = f"line {line}: block {block} is missing, but a Klartext (conversational) program numbers its blocks from 0"
    with pytest.raises(ReadError, match=re.escape(told)):
        interpret_klartext(text)


def _arc(b: ToolpathBuilder) -> None:
    b.arc(True, (2.0, 0.0, 25.0), Arc((1.0, 0.0, 25.0)), feed=1.0)


def _machine(b: ToolpathBuilder) -> None:
    b.machine(z=0.0)


def _tap(b: ToolpathBuilder) -> None:
    b.drill(1.0, 1.0, DrillCycle("G84", 2.0, -3.0), feed=1.0)


def _other_speed(b: ToolpathBuilder) -> None:
    b.spindle(100.0)
    b.spindle(200.0)


@pytest.mark.parametrize(
    "work, words",
    [
        (_arc, "only drilling programs"),
        (_machine, "machine zero"),
        (_tap, "no tapping cycle"),
        (_other_speed, "a single speed"),
    ],
)
def test_what_has_no_words_is_refused(work: object, words: str) -> None:
    b = ToolpathBuilder()
    b.tool(1)
    b.rapid(z=25.0)
    b.rapid(0.0, 0.0)
    work(b)  # type: ignore[operator]
    b.end()
    with pytest.raises(PostError, match=words):
        text_of(b.build())


def test_a_drawing_is_drilled_verified_and_its_program_is_not_reordered(tmp_path: Path) -> None:
    plate = tmp_path / "plate.csv"
    plate.write_text("x,y,diameter\n10,10,5\n40,10,5\n40,40,8\n10,40,8\n25,25,5\n")
    fast: dict[str, Any] = {
        "process": "drill",
        "thickness": 5,
        "algorithm": "nn",
        "bound": False,
        "dialect": "heidenhain",
    }
    files = [tmp_path / name for name in ("a.h", "b.h", "c.h")]
    files[0].write_text(leafcut.optimize(plate, **fast).text)
    files[1].write_text(leafcut.optimize(plate, start_point="45,45", **fast).text)
    files[2].write_text(re.sub(r"X\+40 Y\+10\b", "X+41 Y+10", files[0].read_text()))
    assert leafcut.verify(files[0], files[1], dialect="heidenhain").same
    assert not leafcut.verify(files[0], files[2], dialect="heidenhain").same
    with pytest.raises(OptionError, match="does not reorder"):
        leafcut.optimize(files[0], dialect="heidenhain")
    with pytest.raises(ReadError, match="Heidenhain conversational"):
        leafcut.simulate(files[0])
