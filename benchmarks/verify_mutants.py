"""Mutated programs checked by `verify`, with LinuxCNC's interpreter as the reference.

    python -m benchmarks verify_mutants --mutants 6000 --seed 1

Programs consist of pieces with parameters, rotary axes, macros, offsets and cycles, in every dialect that is similar
enough to RS274/NGC for `rs274`. In words of other controls, every changed digit counts as different work. A mutant is
*missed* if `verify` accepts it and the reference does not. It is a *false alarm* if `verify` refuses it and `rs274`
prints the same output for both programs.
"""

from __future__ import annotations

import difflib
import math
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks import page
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.processes.program.proof.certificate import certify

HEAD = "G21 G90 G17 G40 G94 G54 G49 G80\nT1 M6\nS900 M3\nG0 X0. Y0. Z20.\n"
END = "G0 Z20.\nM5\nM30\n"
#: Placeholders: {x} and {y} are a new position in every piece, and {a} … {c} are numbers.
HOLE = "G0 X{x} Y{y}\nG0 Z2.\nG1 Z-{a} F100.\nG0 Z20.\n"
#: Pieces that `rs274` runs and that can be read in all dialects below.
COMMON = (
    HOLE,
    "G0 X{x} Y{y}\nG0 Z2.\nG1 Z-{a} F100.\nG1 X{x2} F300.\nG2 X{x} I-2.5 J0.\nG0 Z20.\n",
    "G98 G81 X{x} Y{y} Z-{a} R2. F120.\nX{x2}\nG80\n",
    "G99 G83 X{x} Y{y} Z-{a} R2. Q1.5 F120.\nY{y2}\nG80\nG0 Z20.\n",
    "G98 G73 X{x} Y{y} Z-{a} R2. Q1.5 F120.\nG80\n",
    "G98 G82 X{x} Y{y} Z-{a} R2. P0.5 F120.\nX{x2} R3.\nG80\n",
    "G98 G85 X{x} Y{y} Z-{a} R2. F120.\nG80\n",
    "G98 G89 X{x} Y{y} Z-{a} R2. P0.5 F120.\nG80\n",
    "G99 G81 X{x} Y{y} Z-{a} R2. F120.\nX{x2} R6.\nG98 Y{y2} R2.\nG80\nG0 Z20.\n",
    "G0 X{x} Y{y}\nG91\nG81 X3. Z-4. R-17. L3 F120.\nG80\nG90\n",
    "G92 X{b}\n" + HOLE + "G92.1\n",
    "G10 L2 P2 X{b} Y{c}\nG55\n" + HOLE + "G54\n",
    "G43 H2\nG0 Z20.\n" + HOLE + "G49\nG0 Z20.\n",
    "T{n} M6\nS{s} M3\nM8\n" + HOLE + "M9\n",
    "G4 P{p}\n" + HOLE,
    "G28 Z20.\nG0 Z20.\n",
    "G53 G0 Z0.\nG0 Z20.\n",
    "M1\n" + HOLE,
)
#: Pieces with integers, or with words that only LinuxCNC has.
LINUXCNC = (
    "#1={b}\nG92 X#1\n" + HOLE + "G92.1\n",
    "#3={n}\nG0 A[#3+90]\n" + HOLE + "G0 A0\n",
    "#3={n}\nG0 A[#3*15]\nG98 G81 X{x} Y{y} Z-{a} R2 F120\nG80\nG0 A0\n",
    "#2={s}\nG0 Z2\nG1 X{x} A30 F#2\nG0 Z20\nG0 A0\n",
    "G93\nG0 Z2\nG1 X{x} A30 F{n}\nG94\nG0 Z20\n",
    "o1{o} sub\nG0 A#1\nG0 X{x} Y{y}\nG0 Z2\nG1 Z[0-#2] F100\nG0 Z20\no1{o} endsub\no1{o} call [{n}] [{a}]\nG0 A0\n",
    "#1=0\no2{o} repeat [3]\n#1=[#1+{a}]\nG0 X[#1*3] Y{y}\nG0 Z2\nG1 Z-1 F100\nG0 Z20\no2{o} endrepeat\n",
    "#1=1.0000{n}\no3{o} if [#1 EQ 1]\n" + HOLE + "o3{o} else\nG4 P{p}\no3{o} endif\n",
    "#1=0\no4{o} while [#1 LT {n}]\n#1=[#1+1]\nG98 G81 X[#1*2] Y{y} Z-{a} R2 F120\no4{o} endwhile\nG80\n",
    "#5={b}\nG10 L1 P1 Z#5\nG43 H1\nG0 Z20\n" + HOLE + "G49\nG0 Z20\n",
    "#5={b}\nG10 L2 P1 X#5 R0\n" + HOLE + "G10 L2 P1 X0\nG0 X0 Y0\n",
    "G10 L2 P1 R{n}\n" + HOLE + "G10 L2 P1 R0\nG0 X0 Y0\n",
    "G0 X{x} Y{y}\nG10 L20 P1 X{b}\n" + HOLE + "G10 L2 P1 X0\nG0 X0 Y0\n",
    "#5={b}\nG52 X#5\n" + HOLE + "G52 X0\nG0 X0 Y0\n",
    "G10 L2 P9 X{b} Y{c}\nG59.3\n" + HOLE + "G54\nG0 X0 Y0\n",
    "#5={b}\nG43.1 Z#5\nG0 Z20\n" + HOLE + "G49\nG0 Z20\n",
    "#1={a}\nS400\nG0 X{x} Y{y}\nG33.1 Z5 K#1\nS900\nG0 Z20\n",
    "#1={a}\nG0 X{x} Y{y}\nG33 Z5 K#1\nG0 Z20\n",
    "G0 X{x} Y{y}\nG38.3 Z-{a} F50\nG0 Z20\n",
    "#1={n}\nM68 E0 Q#1\nM64 P1\n" + HOLE + "M65 P1\nM67 E1 Q{p}\n",
    "G64 P0.0{n} Q0.01\n" + HOLE + "G61\n",
    "G18\nG0 X{x} Z2\nG1 Z0 F200\nG2 X{x} Z0 I2 K0\nG17\nG0 Z20\n",
    "G95\nG0 X{x} Y{y}\nG0 Z2\nG1 Z-{a} F0.1\nG94\nG0 Z20\n",
    "G20\nG0 X0.{n} Y1.5\nG0 Z0.1\nG1 Z-0.05 F4.\nG0 Z0.8\nG21\n",
    "(MSG, turn part {n})\n" + HOLE,
    "#<depth>={a}\nG0 X{x} Y{y}\nG0 Z2\nG1 Z[0-#<depth>] F100\nG0 Z20\n",
    "M98 P7{o} L2\n",
    "G0 X{x} Y{y}\nG0 Z2\nG1 Z-1 F100\nG3 X{x} Y{y} I3 J0 P2\nG0 Z20\n",
    "F150\nG0 Z2\nG1 X{x} B20\nG0 Z20\nG0 B0\n",
    "G41.1 D3\nG0 X{x} Y{y}\nG1 X{x2} Y{y2} F200\nG1 Y90\nG40\nG0 X0 Y0\n",
)
SUB = "O7{o}\nG91\nG0 X1.5\nG90\nG0 Z2\nG1 Z-{a} F100\nG0 Z20\nM99\n"
#: Lines that only Fanuc and Haas have; every digit counts.
FANUC = (
    "G68 X0. Y0. R{b}\n", "G51 X0. Y0. P{b}\n", "G51.1 X{b}\n", "G65 P9{n} A{a} B{b}\n", "G12 I{a} F100. Z-{a} D{n}\n",
    "G150 P1 X{x} Y{y} Z-{a} R1. Q1.5 I2. D{n} G41 F100.\n", "G70 I{a} J{b} L6\n", "G10 L12 P{n} R{a}\n",
    "G10 L10 P{n} R{a}\n", "G154 P{n}\n", "G31 Z-{a} F50.\n", "M1{n}\n", "G76 X{x} Y{y} Z-{a} R2. Q1.5 F100.\n",
    "G47 E.5 F10. X{x} Y{y} I30. J{a} P0 R1. Z-{a}\n", "G0 A{b}\n", "G1 X{x} A{b} F{s}.\n", "#1={b}\nG0 A#1\n",
    "#1={b}\nG68 X0. Y0. R#1\n", "#1={n}\nG154 P#1\n", "G66 P9{n} A{a}\nG0 X{x}\nG0 Y{y}\nG67\n",
    "#101={b}\nG65 P9{n}\n",
)  # fmt: skip
RUN_BY_RS274 = ("linuxcnc", "mach3", "haas", "fanuc", "mach4")


class Mutant(NamedTuple):
    """The original and the new program, and the mutation; if `judged`, `rs274` runs the original."""

    dialect: str
    original: str
    new: str
    how: str
    judged: bool


def piece(pattern: str, chance: random.Random, number: int, point: bool) -> str:
    """Return a piece with random numbers."""

    def length(low: float, high: float) -> str:
        text = f"{chance.uniform(low, high):.2f}"
        return text if point or chance.random() < 0.7 else text.partition(".")[0]

    x, y, p = chance.uniform(0, 60), chance.uniform(0, 60), chance.uniform(0.1, 1)
    return pattern.format(
        x=f"{x:.2f}",
        y=f"{y:.2f}",
        x2=f"{x + 5:.2f}",
        y2=f"{y + 5:.2f}",
        a=length(1.2, 6),
        b=length(2, 30),
        c=length(2, 30),
        n=chance.randint(2, 9),
        s=chance.randint(200, 800),
        p=f"{p:.2f}",
        o=number,
    )


def program(name: str, chance: random.Random, number: int, foreign: bool) -> str:
    """Return a program of a few pieces; if `foreign`, it includes a piece that `rs274` cannot run."""
    patterns = COMMON + (LINUXCNC if name == "linuxcnc" else ())
    pieces = [chance.choice(patterns) for _ in range(chance.randint(2, 4))]
    if name == "linuxcnc":
        pieces[chance.randrange(len(pieces))] = chance.choice(LINUXCNC)
    if foreign:
        pieces.insert(chance.randint(0, len(pieces)), chance.choice(FANUC))
    texts = [piece(p, chance, 10 * number + k, name != "linuxcnc") for k, p in enumerate(pieces)]
    calls = set(re.findall(r"(?m)^M98 P7(\d+)", "".join(texts)))
    subs = "".join(piece(SUB.replace("{o}", o), chance, 0, True) for o in sorted(calls))
    return HEAD + "".join(texts) + END + subs


def mutations(text: str, chance: random.Random) -> Iterator[tuple[str, str]]:
    """Yield an endless series of mutations, each in one position, with their description and text."""
    lines = text.splitlines(keepends=True)
    digits = [m.start() for m in re.finditer(r"(?<![NO])[0-9]", text)]
    words = list(re.finditer(r"[A-Z][-+]?[0-9.]+|[A-Z#]?\[[^\]\n]*\]|#[0-9]+", text))
    other = {"G0": "G1", "G1": "G0", "G2": "G3", "G3": "G2", "G81": "G85", "G83": "G73", "G73": "G83", "G98": "G99",
             "G99": "G98", "G90": "G91", "G91": "G90", "M3": "M4", "M8": "M7", "G54": "G56", "G55": "G54", "G43": "G49",
             "G92": "G52", "M1": "M0", "M5": "M3", "M30": "M99", "G17": "G18", "G28": "G30", "M64": "M65", "G21": "G20",
             "G61": "G61.1", "G94": "G95", "G40": "G41"}  # fmt: skip
    while True:
        match chance.randrange(8):
            case 0 | 1 | 2:
                at = chance.choice(digits)
                digit = chance.choice([d for d in "0123456789" if d != text[at]])
                yield f"digit {text[at]} to {digit} at {at}", text[:at] + digit + text[at + 1 :]
            case 3:
                word = chance.choice(words)
                yield f"without {word[0]}", text[: word.start()] + text[word.end() :]
            case 4:
                k = chance.randrange(len(lines))
                yield f"without line {k + 1}", "".join(lines[:k] + lines[k + 1 :])
            case 5:
                k = chance.randrange(len(lines) - 1)
                yield (
                    f"lines {k + 1} and {k + 2} swapped",
                    "".join([*lines[:k], lines[k + 1], lines[k], *lines[k + 2 :]]),
                )
            case 6:
                k = chance.randrange(len(lines))
                yield f"line {k + 1} twice", "".join([*lines[: k + 1], *lines[k:]])
            case _:
                found = [w for w in words if w[0] in other]
                word = chance.choice(found)
                yield f"{word[0]} to {other[word[0]]}", text[: word.start()] + other[word[0]] + text[word.end() :]


def mutants(count: int, seed: int) -> Iterator[Mutant]:
    """Yield mutants, eight of each program; every fifth changes a digit in a Haas or Fanuc program."""
    chance = random.Random(seed)
    name, text = "", ""
    mutated: Iterator[tuple[str, str]] = iter(())
    for number in range(count):
        if number % 5 == 4:
            other = chance.choice(("haas", "fanuc"))
            yield _digit_of_foreign(other, program(other, chance, number, True), chance)
            continue
        if number % 8 == 0:
            name = RUN_BY_RS274[chance.randrange(5)] if number % 16 else "linuxcnc"
            text = program(name, chance, number, False)
            mutated = mutations(text, chance)
        how, new = next(pair for pair in mutated if pair[1] != text)
        yield Mutant(name, text, new, how, True)


def _digit_of_foreign(name: str, text: str, chance: random.Random) -> Mutant:
    """Return a mutant with a changed digit in a line that only Fanuc or Haas has."""
    known = {line for p in (HEAD, END, *COMMON) for line in re.sub(r"\{.*?\}", "", p).splitlines()}
    own = re.compile(r"(?m)^(?:G68|G51|G65|G12|G150|G70|G10 L1|G154|G31|M1\d|G76|G47|G0 A|G1 X\S+ A|#|G66).*$")
    lines = [m for m in own.finditer(text) if re.sub(r"[0-9.]", "", m[0]) not in known]
    line = chance.choice(lines)
    at = chance.choice([k for k in range(line.start() + 2, line.end()) if text[k].isdigit()])
    digit = str((int(text[at]) + 1) % 10)
    return Mutant(name, text, text[:at] + digit + text[at + 1 :], f"digit of '{line[0]}' to {digit}", False)


#: Height of machine zero above program zero, mm, which is far above the workpiece.
MACHINE_ZERO = 203.2


class Judge:
    """LinuxCNC's interpreter, used as the reference."""

    def __init__(self, command: str) -> None:
        self.command = command
        self.folder = Path(tempfile.mkdtemp(prefix="mutants"))
        table = "".join(f"T{n} P{n} D3.0 Z0 ;tool\n" for n in range(1, 100))
        (self.folder / "tool.tbl").write_text(table, encoding="ascii")

    def prints(self, text: str, name: str = "linuxcnc") -> list[str] | None:
        """Return the canonical commands of a program, or None if it is refused or has no end."""
        if load_dialect(name).groups == "fanuc":  # these controls start in G98, but LinuxCNC starts in G99
            text = f"G98\n{text}"
        (self.folder / "part.ngc").write_text(text, encoding="ascii", newline="")
        for left in self.folder.glob("*.var*"):
            left.unlink()
        home = dict(os.environ, HOME=str(self.folder))
        # Machine zero is far above the workpiece, as on a mill; the interpreter starts in inches.
        (self.folder / "part.var").write_text(f"5220\t1\n5223\t{-MACHINE_ZERO / 25.4}\n", encoding="ascii")
        command = [self.command, "-g", "-t", "tool.tbl", "-v", "part.var", "part.ngc"]
        try:
            done = subprocess.run(
                command, cwd=self.folder, env=home, capture_output=True, text=True, timeout=5, check=False
            )
        except subprocess.TimeoutExpired:
            return None
        if done.returncode or len(done.stdout) > 400_000:
            return None
        called = re.findall(r"(?m)^\s*\d+ \S+\s+([A-Z_0-9]+\(.*\))\s*$", done.stdout)
        return [c for c in called if not c.startswith("COMMENT")]

    def close(self) -> None:
        """Remove the temporary folder."""
        shutil.rmtree(self.folder, ignore_errors=True)


_STATES = ("SET_FEED_RATE", "SET_FEED_MODE", "SELECT_PLANE", "SET_SPINDLE_SPEED", "SET_SPINDLE_MODE", "FLOOD_ON",
           "FLOOD_OFF", "MIST_ON", "MIST_OFF", "SET_MOTION_CONTROL_MODE", "SET_NAIVECAM_TOLERANCE",
           "STOP_SPINDLE_TURNING", "START_SPINDLE_CLOCKWISE", "START_SPINDLE_COUNTERCLOCKWISE", "SELECT_TOOL",
           "SET_FEED_REFERENCE", "START_SPEED_FEED_SYNCH", "STOP_SPEED_FEED_SYNCH")  # fmt: skip
#: Calls that set an origin; they are barriers if they change it.
_ORIGINS = ("SET_G5X_OFFSET", "SET_G92_OFFSET", "SET_XY_ROTATION", "USE_TOOL_LENGTH_OFFSET")
_WORK = ("STRAIGHT_FEED", "ARC_FEED", "DWELL")


def _numbers(name: str, values: str, unit: float) -> list[float]:
    """Return the numbers of a call, with lengths in mm."""
    numbers = [float(v) for v in re.findall(r"-?\d+\.?\d*", values)]
    if name not in ("STRAIGHT_FEED", "ARC_FEED", "STRAIGHT_TRAVERSE", "STRAIGHT_PROBE"):
        return numbers
    # Turns of an arc and rotary axes are not lengths.
    lengths = {0, 1, 2} if name != "ARC_FEED" else {0, 1, 2, 3, 5}
    return [round(v * unit, 4) if k in lengths else v for k, v in enumerate(numbers)]


def _after_arc(place: list[float], numbers: list[float], plane: str) -> list[float]:
    """Return the end of an arc."""
    first, second = {"CANON_PLANE_XZ": (2, 0), "CANON_PLANE_YZ": (1, 2)}.get(plane, (0, 1))
    place = list(place)
    place[first], place[second], place[3 - first - second] = numbers[0], numbers[1], numbers[5]
    return place


def work_of(prints: list[str]) -> tuple[list[object], list[dict[object, float]]]:
    """Return the work as barriers in order and the cuts between them with their modes, and the heights of rapids.

    The heights are those of the lowest rapids across and of the lowest ends of rapids between two barriers.
    """
    work: list[object] = []
    group: Counter[object] = Counter()
    heights: list[dict[object, float]] = [{}]
    active = {"SELECT_PLANE": "SELECT_PLANECANON_PLANE_XY", "SET_FEED_MODE": "SET_FEED_MODE0, 0"}
    unit = 1.0
    # The start is unknown, and so is the height after the origin changes.
    place: list[float] = [math.nan] * 3 + [0.0] * 3
    moved = True
    for call in prints:
        name, _, rest = call.partition("(")
        values = rest.rstrip(")")
        if name in _STATES:
            key = re.sub(r"_(?:ON|OFF|CLOCKWISE|COUNTERCLOCKWISE)$", "", name).replace(
                "STOP_SPINDLE_TURNING", "START_SPINDLE"
            )
            active[key.replace("STOP_SPEED", "START_SPEED")] = name + values
            continue
        if name in _ORIGINS:
            known, active[name] = active.get(name), values
            if values == known or (known is None and not re.search(r"[1-9]", values.partition(".")[2])):
                continue
            moved = True
        if name in ("USE_LENGTH_UNITS", "MESSAGE"):
            unit = 25.4 if "INCH" in values else 1.0 if name == "USE_LENGTH_UNITS" else unit
            group[call] += name == "MESSAGE"
            continue
        numbers = _numbers(name, values, unit)
        if name in _WORK and place[3:] == (numbers[-3:] if name != "DWELL" else place[3:]):
            # In exact-stop mode, a feed move of length 0 makes the machine stop.
            exact = "EXACT" in active.get("SET_MOTION_CONTROL_MODE", "")
            does_nothing = name == "STRAIGHT_FEED" and numbers[:6] == place and not exact
            begin = tuple(place)
            read = tuple(item for item in sorted(active.items()) if name == "ARC_FEED" or item[0] != "SELECT_PLANE")
            group[name, begin, unit, values, read] += not does_nothing
            if name == "STRAIGHT_FEED":
                place, moved = numbers[:6], False
            elif name == "ARC_FEED":
                place = _after_arc(place, numbers, active["SELECT_PLANE"][12:])
            continue
        if name == "STRAIGHT_TRAVERSE" and numbers[3:] == place[3:]:
            if numbers[:2] != place[:2] and not math.isnan(place[0]):
                low = numbers[2] if moved else min(place[2], numbers[2])
                heights[-1]["across"] = min(low, heights[-1].get("across", math.inf))
            if (moved or numbers[2] < place[2]) and numbers[2] < MACHINE_ZERO - 0.001:
                heights[-1]["lowest"] = min(numbers[2], heights[-1].get("lowest", math.inf))
            place, moved = numbers[:6], False
            continue
        moves = name.startswith(("STRAIGHT", "ARC", "RIGID"))
        read = [item for item in sorted(active.items()) if moves or item[0].startswith(("START_SPIN", "FLOOD", "MIST"))]
        work += [group, (call, () if name in ("PROGRAM_END", "ON_RESET", "PALLET_SHUTTLE") else tuple(read))]
        group = Counter()
        heights.append({})
        if numbers and name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "STRAIGHT_PROBE"):
            place = numbers[:6]
    return [*work, group], heights


def differ(before: list[str], after: list[str]) -> bool:
    """Return whether two outputs differ in their work, or the second contains lower rapids."""
    if before == after:
        return False
    (work, heights), (new_work, lower) = work_of(before), work_of(after)
    if work != new_work:
        return True
    return any(
        h.get(k, math.inf) > low.get(k, math.inf) + 1e-4
        for h, low in zip(heights, lower, strict=True)
        for k in ("across", "lowest")
    )


class Count(NamedTuple):
    """Number of mutants by verdict; missed mutants, false alarms, and programs that differ from themselves."""

    became: Counter[str]
    missed: list[Mutant]
    alarms: list[Mutant]
    unequal: list[Mutant]


def judge_all(count: int, seed: int, command: str, every: int = 10) -> Count:
    """Check mutants; of the refused mutants, check one in `every` for a false alarm."""
    judge = Judge(command)
    became: Counter[str] = Counter()
    shown: dict[str, list[Mutant]] = {"missed": [], "alarm": [], "unequal": []}
    last, prints, original = "", None, None
    for mutant in mutants(count, seed):
        if mutant.original != last:
            last = mutant.original
            prints = judge.prints(last, mutant.dialect) if mutant.judged else None
            original = _read(last, mutant.dialect)
            if original is not None and not certify(original, original, tolerance_mm=0.0).same:
                shown["unequal"].append(mutant)
            became["not run by rs274"] += mutant.judged and prints is None
        verdict = _verdict(mutant, original)
        became[verdict] += 1
        if verdict == "same" and mutant.judged and prints is not None:
            now = judge.prints(mutant.new, mutant.dialect)
            refused = now is None and mutant.dialect == "linuxcnc"
            if refused or (now is not None and differ(prints, now)):
                shown["missed"].append(mutant)
        elif verdict == "same" and not mutant.judged:
            shown["missed"].append(mutant)
        elif verdict == "seen" and prints is not None and became["seen"] % every == 0 and mutant.judged:
            became["checked for a false alarm"] += 1
            # Without a mode word, the output is the same although the program differs.
            if judge.prints(mutant.new, mutant.dialect) == prints and mutant.new.startswith(HEAD.partition("\n")[0]):
                shown["alarm"].append(mutant)
    judge.close()
    return Count(became, shown["missed"], shown["alarm"], shown["unequal"])


def _read(text: str, name: str) -> Program | None:
    try:
        return interpret_program(text, load_dialect(name))
    except LeafcutError:
        return None


def _verdict(mutant: Mutant, original: Program | None) -> str:
    new = _read(mutant.new, mutant.dialect)
    if original is None or new is None:
        return "refused"
    return "same" if certify(original, new, tolerance_mm=0.0).same else "seen"


def main(argv: Sequence[str]) -> int:
    """Check all mutants and print the verdicts; return 1 if a mutant is missed."""
    parser = page.parser("verify_mutants", __doc__, writes=False)
    parser.add_argument("--mutants", type=int, default=6000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--show", type=int, default=10, help="most missed mutants and false alarms to show")
    options = parser.parse_args(argv)
    command = shutil.which("rs274")
    if command is None:
        print("rs274 is required: apt-get install linuxcnc-uspace", file=sys.stderr)
        return 2
    start = time.process_time()
    found = judge_all(options.mutants, options.seed, command)
    print(f"{options.mutants} mutants, seed {options.seed}, {time.process_time() - start:.0f} s of processor time")
    print(", ".join(f"{verdict} {number}" for verdict, number in sorted(found.became.items())))
    counts = [len(some) for some in (found.missed, found.alarms, found.unequal)]
    print("missed {}, false alarms {}, different from themselves {}".format(*counts))
    for title, some in (("missed", found.missed), ("false alarm", found.alarms), ("itself", found.unequal)):
        for mutant in some[: options.show]:
            lines = [text.splitlines() for text in (mutant.original, mutant.new)]
            print(f"\n{title}: {mutant.dialect}, {mutant.how}")
            print("\n".join(difflib.unified_diff(*lines, n=30, lineterm="")))
    return 1 if found.missed else 0
