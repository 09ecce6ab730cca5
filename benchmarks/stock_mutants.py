"""Programs spoilt in one place each, and whether what they leave of the stock shows it, with nothing else looked at.

    python benchmarks/stock_mutants.py --mutants 500 --seed 1 --reorder

Every program cuts some features, each by itself, so that what a change does to the part is known from how it was made:
a depth, a place, a length, a tool that changed, or a feature that is gone, leaves another part; another order, another
feed or speed, the same cut twice, does not. *Missed* is a changed part that is called the same, a *false alarm* the
other way round. With ``--reorder`` the judge is that of `leafcut reorder`, whose cells are larger: a place or a length
changes by more than one of them then.
"""

from __future__ import annotations

import argparse
import random
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import leafcut
from leafcut.errors import VerifyError
from leafcut.gcode.dialects import dialect
from leafcut.processes.course import Run, machine_of
from leafcut.processes.program.reading import read_foreign
from leafcut.processes.program.stock_proof import stock_judge
from leafcut.processes.settings import collect

#: Diameter and shape of every tool, as its comment says them.
TOOLS = {1: "D=6. CR=0. - flat end mill", 2: "D=4. CR=2. - ball end mill", 3: "D=5. TAPER=118deg - drill"}
#: Cells, mm, and how far apart features are: no cut of one reaches another one.
CELL, PITCH = 0.1, 24.0
#: The least change of a depth and of a place that counts: the tolerance is 0.01 mm, and a wall may move by a cell.
LEAST_DEPTH, LEAST_PLACE = 0.02, 0.25
#: The cells of `leafcut reorder` are a twentieth of the smallest tool.
LEAST_REORDERED = 0.45


class Feature(NamedTuple):
    """A cut: its kind, tool, place, length and depth, mm."""

    kind: str
    tool: int
    x: float
    y: float
    length: float
    depth: float
    feed: int = 300

    def text(self) -> str:
        """Return its blocks, from the safe height and back."""
        x, y, end, depth = self.x, self.y, self.x + self.length, -self.depth
        over = f"G0 X{x:.3f} Y{y:.3f}\nG0 Z2.\n"
        down = f"G1 Z{depth:.3f} F{self.feed}\n"
        body = {
            "hole": f"G98 G81 X{x:.3f} Y{y:.3f} Z{depth:.3f} R2. F{self.feed}\nG80\n",
            "slot": f"{over}{down}G1 X{end:.3f}\nG0 Z20.\n",
            "arc": f"{over}{down}G2 X{end:.3f} I{self.length / 2:.3f} J0.\nG0 Z20.\n",
            "ramp": f"{over}G1 Z0. F{self.feed}\nG1 X{end:.3f} Z{depth:.3f}\nG1 X{x:.3f}\nG0 Z20.\n",
            "helix": f"{over}G1 Z0. F{self.feed}\nG3 X{x:.3f} Z{depth:.3f} I{self.length / 2:.3f} J0.\nG0 Z20.\n",
        }
        return body[self.kind]


def features(chance: random.Random) -> list[Feature]:
    """Return some features in a grid, the same tools one after the other."""
    found = []
    for place in range(chance.randint(4, 9)):
        kind = chance.choice(("hole", "slot", "arc", "ramp", "helix"))
        tool = 3 if kind == "hole" else chance.choice((1, 2))
        x, y = PITCH * (place % 3) + chance.uniform(0, 2), PITCH * (place // 3) + chance.uniform(0, 2)
        found.append(Feature(kind, tool, x, y, chance.uniform(3, 9), chance.uniform(0.5, 4)))
    return sorted(found, key=lambda one: one.tool)


def program(cuts: list[Feature], speed: int = 900) -> str:
    """Return the program of features in their order."""
    lines, tool = ["G21 G90 G17 G40 G94\n"], 0
    for one in cuts:
        if one.tool != tool:
            tool = one.tool
            lines.append(f"T{tool} M6 ({TOOLS[tool]})\nS{speed} M3\nG0 X0. Y0. Z20.\n")
        lines.append(one.text())
    return "".join([*lines, "M5\nM30\n"])


def mutant(cuts: list[Feature], chance: random.Random, least: float = LEAST_PLACE) -> tuple[str, str, bool]:
    """Return how a program was changed, its text, and whether another part comes of it.

    `least` is the least change of a place, mm.
    """
    at = chance.randrange(len(cuts))
    one, others = cuts[at], [*cuts[:at], *cuts[at + 1 :]]
    how = chance.choice(("depth", "place", "length", "tool", "gone", "order", "feed", "speed", "twice"))
    sign, changed = chance.choice((-1, 1)), one
    if how == "depth":
        changed = one._replace(depth=one.depth + sign * chance.uniform(LEAST_DEPTH, 0.4))
    elif how == "place":
        step = sign * chance.uniform(least, 2)
        changed = one._replace(x=one.x + step) if chance.random() < 0.5 else one._replace(y=one.y + step)
    elif how == "length":
        # Of a hole nothing is long.
        changed = one._replace(length=one.length + chance.uniform(2 * least, 2))
    elif how == "tool":
        changed = one._replace(tool={1: 2, 2: 1, 3: 1}[one.tool])
    elif how == "feed":
        changed = one._replace(feed=chance.randint(301, 900))
    order = list(cuts)
    order[at] = changed
    if how == "gone":
        order = others
    elif how == "order":
        chance.shuffle(order)
    elif how == "twice":
        order = [*order, one]
    part = how in ("depth", "place", "tool", "gone") or (how == "length" and one.kind != "hole")
    return how, program(order, 1200 if how == "speed" else 900), part


def differ(original: Path, new: Path) -> bool:
    """Return whether `leafcut stock` finds that two programs leave something else."""
    return bool(leafcut.cut_stock(new, same_as=original, cell=CELL).differences)


def reordered(original: Path, new: Path) -> bool:
    """Return whether the judge of `leafcut reorder` would refuse a program in place of another one."""
    settings = collect({})
    made = Run(settings, machine_of(settings))
    words = dialect("linuxcnc")
    one, other = (
        read_foreign(file.read_text(), str(file), settings, made.machine, words).program for file in (original, new)
    )
    judge = stock_judge(made, one, str(original), "mill").judge
    assert judge is not None
    try:
        judge.check(other)
    except VerifyError:
        return True
    return False


def run(
    mutants: int, seed: int, judge: Callable[[Path, Path], bool] = differ, least: float = LEAST_PLACE
) -> tuple[Counter[str], list[str]]:
    """Return how many were seen, the same, missed and false alarms, and the ways in which the last two were made."""
    chance, counts, wrong = random.Random(seed), Counter[str](), []
    with tempfile.TemporaryDirectory() as folder:
        original, new = Path(folder, "original.nc"), Path(folder, "new.nc")
        for _ in range(mutants):
            cuts = features(chance)
            how, text, part = mutant(cuts, chance, least)
            original.write_text(program(cuts))
            new.write_text(text)
            found = judge(original, new)
            result = ("seen" if part else "false alarm") if found else ("missed" if part else "the same")
            counts[result] += 1
            if result in ("missed", "false alarm"):
                wrong.append(how)
    return counts, wrong


def main() -> None:
    """Run it and print what came of it; exit status 1 where a mutant was missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--mutants", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reorder", action="store_true", help="the judge of `leafcut reorder`")
    given = parser.parse_args()
    began = time.process_time()
    judge = (reordered, LEAST_REORDERED) if given.reorder else (differ, LEAST_PLACE)
    counts, wrong = run(given.mutants, given.seed, *judge)
    print(", ".join(f"{name} {counts[name]}" for name in ("seen", "the same", "missed", "false alarm")))
    print(f"{time.process_time() - began:.0f} s of processor time for {given.mutants}")
    if wrong:
        raise SystemExit(f"wrong: {', '.join(sorted(set(wrong)))}")


if __name__ == "__main__":
    main()
