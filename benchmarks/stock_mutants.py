"""Mutated programs checked by the stock model: changed parts that it does not detect, and false alarms.

    python -m benchmarks stock_mutants --mutants 500 --seed 1 --reorder

Each program cuts features that are apart from each other, so the effect of a mutation is known. A different depth,
position, length or tool, or a missing feature, changes the part. A different order, feed or speed, or a repeated cut,
does not. *Missed* means that the part changed but the verdict is "same"; a *false alarm* is the opposite. `--reorder`
selects the check used by `leafcut reorder`; its cells are larger, so positions and lengths change by more.
"""

from __future__ import annotations

import random
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import leafcut
from benchmarks import page
from leafcut.errors import VerifyError
from leafcut.gcode.dialects import load_dialect
from leafcut.order.stop import Deadline
from leafcut.processes.job import Job, machine_of
from leafcut.processes.program.planning import create_stock_judge
from leafcut.processes.program.reading import read_foreign
from leafcut.processes.settings import collect_settings

#: Comment for each tool, with its diameter and shape.
TOOLS = {1: "D=6. CR=0. - flat end mill", 2: "D=4. CR=2. - ball end mill", 3: "D=5. TAPER=118deg - drill"}
#: Cell size, and pitch of the features, mm; no cut reaches the next feature.
CELL, PITCH = 0.1, 24.0
#: Minimum change of a depth and of a position, mm; the tolerance is 0.01 mm, and a wall may move by a cell.
LEAST_DEPTH, LEAST_PLACE = 0.02, 0.25
#: Minimum change of a position for `leafcut reorder`, mm; its cells are a twentieth of the smallest tool.
LEAST_REORDERED = 0.45


class Feature(NamedTuple):
    """A cut: kind, tool, position, length and depth, mm."""

    kind: str
    tool: int
    x: float
    y: float
    length: float
    depth: float
    feed: int = 300

    def text(self) -> str:
        """Return the blocks of the cut, which start and end at the safe height."""
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
    """Return some random features in a grid, sorted by tool."""
    cuts = []
    for place in range(chance.randint(4, 9)):
        kind = chance.choice(("hole", "slot", "arc", "ramp", "helix"))
        tool = 3 if kind == "hole" else chance.choice((1, 2))
        x, y = PITCH * (place % 3) + chance.uniform(0, 2), PITCH * (place // 3) + chance.uniform(0, 2)
        cuts.append(Feature(kind, tool, x, y, chance.uniform(3, 9), chance.uniform(0.5, 4)))
    return sorted(cuts, key=lambda cut: cut.tool)


def program(cuts: list[Feature], speed: int = 900) -> str:
    """Return a program with the features in this order."""
    lines, tool = ["G21 G90 G17 G40 G94\n"], 0
    for cut in cuts:
        if cut.tool != tool:
            tool = cut.tool
            lines.append(f"T{tool} M6 ({TOOLS[tool]})\nS{speed} M3\nG0 X0. Y0. Z20.\n")
        lines.append(cut.text())
    return "".join([*lines, "M5\nM30\n"])


def mutant(cuts: list[Feature], chance: random.Random, least: float = LEAST_PLACE) -> tuple[str, str, bool]:
    """Return the kind of the mutation, the new program, and whether the part changes.

    `least` is the minimum change of a position, mm.
    """
    at = chance.randrange(len(cuts))
    cut, others = cuts[at], [*cuts[:at], *cuts[at + 1 :]]
    how = chance.choice(("depth", "place", "length", "tool", "gone", "order", "feed", "speed", "twice"))
    sign, changed = chance.choice((-1, 1)), cut
    if how == "depth":
        changed = cut._replace(depth=cut.depth + sign * chance.uniform(LEAST_DEPTH, 0.4))
    elif how == "place":
        step = sign * chance.uniform(least, 2)
        changed = cut._replace(x=cut.x + step) if chance.random() < 0.5 else cut._replace(y=cut.y + step)
    elif how == "length":
        # A hole has no length, so the part does not change.
        changed = cut._replace(length=cut.length + chance.uniform(2 * least, 2))
    elif how == "tool":
        changed = cut._replace(tool={1: 2, 2: 1, 3: 1}[cut.tool])
    elif how == "feed":
        changed = cut._replace(feed=chance.randint(301, 900))
    order = list(cuts)
    order[at] = changed
    if how == "gone":
        order = others
    elif how == "order":
        chance.shuffle(order)
    elif how == "twice":
        order = [*order, cut]
    part = how in ("depth", "place", "tool", "gone") or (how == "length" and cut.kind != "hole")
    return how, program(order, 1200 if how == "speed" else 900), part


def differ(original: Path, new: Path) -> bool:
    """Return whether `leafcut stock` reports different parts for two programs."""
    return bool(leafcut.stock(new, same_as=original, cell=CELL).differences)


def reordered(original: Path, new: Path) -> bool:
    """Return whether the check in `leafcut reorder` refuses the new program."""
    settings = collect_settings({})
    job = Job(settings, machine_of(settings), Deadline())
    words = load_dialect("linuxcnc")
    before, after = (
        read_foreign(file.read_text(), str(file), settings, job.machine, words).program for file in (original, new)
    )
    judge = create_stock_judge(job, before, str(original), "mill").judge
    assert judge is not None
    try:
        judge.check(after)
    except VerifyError:
        return True
    return False


def run(
    mutants: int, seed: int, judge: Callable[[Path, Path], bool] = differ, least: float = LEAST_PLACE
) -> tuple[Counter[str], list[str]]:
    """Return the number of mutants by verdict, and the kinds of the missed mutants and false alarms."""
    chance, counts, wrong = random.Random(seed), Counter[str](), []
    with tempfile.TemporaryDirectory() as folder:
        original, new = Path(folder, "original.nc"), Path(folder, "new.nc")
        for _ in range(mutants):
            cuts = features(chance)
            how, text, part = mutant(cuts, chance, least)
            original.write_text(program(cuts))
            new.write_text(text)
            different = judge(original, new)
            result = ("seen" if part else "false alarm") if different else ("missed" if part else "the same")
            counts[result] += 1
            if result in ("missed", "false alarm"):
                wrong.append(how)
    return counts, wrong


def main(argv: Sequence[str]) -> int:
    """Check all mutants and print the verdicts; return 1 if a mutant is missed or there is a false alarm."""
    parser = page.parser("stock_mutants", __doc__, writes=False)
    parser.add_argument("--mutants", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reorder", action="store_true", help="the judge of `leafcut reorder`")
    given = parser.parse_args(argv)
    began = time.process_time()
    judge = (reordered, LEAST_REORDERED) if given.reorder else (differ, LEAST_PLACE)
    counts, wrong = run(given.mutants, given.seed, *judge)
    print(", ".join(f"{name} {counts[name]}" for name in ("seen", "the same", "missed", "false alarm")))
    print(f"{given.mutants} mutants, {time.process_time() - began:.0f} s of processor time")
    if wrong:
        print(f"wrong: {', '.join(sorted(set(wrong)))}")
    return int(bool(wrong))
