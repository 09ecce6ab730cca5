"""Reorder damaged programs: leafcut refuses each in one line, or orders and proves it."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

import leafcut
from leafcut.errors import LeafcutError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.processes.program.proof.certificate import certify

#: Lines used of each file, and damaged copies of each file.
LINES, TIMES = 120, 8


def damaged(lines: list[str], rng: random.Random) -> str:
    """Return a program with one to four faults: characters or lines changed, swapped, dropped or doubled."""
    lines = list(lines)
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(lines))
        line, kind = lines[at], rng.randrange(7)
        place = rng.randrange(len(line) + 1)
        letter = rng.choice("0123456789.-+XYZGMFSTIJKRPQLHDN()%;/#[]oO \t\n\0é")
        if kind == 0:
            lines[at] = line[:place] + letter + line[place + 1 :]
        elif kind == 1:
            lines[at] = line[:place] + line[place + 1 :]
        elif kind == 2:
            lines[at] = line[:place] + letter + line[place:]
        elif kind == 3:
            other = rng.randrange(len(lines))
            lines[at], lines[other] = lines[other], line
        elif kind == 4:
            del lines[at]
        elif kind == 5:
            lines.insert(at, line)
        else:
            lines = lines[: max(1, at)]
        lines = lines or ["%\n"]
    return "".join(lines)


@pytest.mark.parametrize(
    ("every", "times", "least"), [(4, 2, 1), pytest.param(1, TIMES, 20, marks=pytest.mark.slow)], ids=["short", "all"]
)
def test_damaged_programs_are_refused_or_proved(data: Path, tmp_path: Path, every: int, times: int, least: int) -> None:
    """The test interprets and certifies each result again."""
    words, done, refused = load_dialect("linuxcnc"), 0, 0
    for file in sorted((data / "gcode").glob("*.[ng]*"))[::every]:
        lines = file.read_text(encoding="latin-1").splitlines(keepends=True)[:LINES]
        for seed in range(times):
            text = damaged(lines, random.Random(f"{file.name} {seed}"))
            path = tmp_path / f"{seed}.nc"
            path.write_text(text, encoding="utf-8", newline="")
            try:
                found = leafcut.optimize(path, preset="fast", iterations=2, bound=False, threads=1)
            except LeafcutError as problem:
                assert "\n" not in str(problem)
                refused += 1
                continue
            done += 1
            original, new = interpret_program(text, words), interpret_program(found.text, words)
            assert certify(original, new).same
            assert found.after.time_s <= found.before.time_s * (1 + 1e-9)
    assert min(done, refused) >= least


@pytest.mark.parametrize("seed", range(3))
def test_noise_is_refused(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "noise.nc"
    path.write_bytes(random.Random(seed).randbytes(3000))
    with pytest.raises(LeafcutError):
        leafcut.optimize(path)
