"""Measure how many small source faults the fast tests detect: `python tools/mutants.py --count 100`.

The same number of mutmut mutants is drawn from solver, proof, readers, post-processors and the course of a job, with
the commit hash as seed, so that the choice is not arbitrary. The fast tests are run once to record which of them
execute which line. For each mutant, the script changes one source file, runs the tests that can detect the change until
the first failure, and restores the file. It prints each mutant with its result. Run it in a clean clone that nothing
else uses.

`make test` may kill a few more mutants, because only `--most` seconds of tests are run for each mutant, and tests that
start a process, or use a cached result, are not recorded. An endless loop counts as killed.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import json
import math
import random
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from coverage import CoverageData
from mutmut.mutation.file_mutation import create_mutations

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "leafcut"

#: Group → patterns of its files in the package.
GROUPS = {
    "solver": ("order/*.py", "order/literature/*.py", "kernels/*.py"),
    "proof": ("proof/*.py", "processes/*/proof/*.py"),
    "readers": ("read/**/*.py", "gcode/*.py"),
    "course": ("processes/*.py", "processes/*/process.py", "processes/*/spec.py"),
    "posts": ("post/*.py", "processes/*/post/*.py", "processes/*/post.py"),
}

#: Marker expression of the fast tests, as in the Makefile.
FAST = "not (slow or browser or external)"

#: Processor time allowed for compiling a changed kernel, s, and additional processor time allowed per test, s.
COMPILING, EACH = 90.0, 0.005

#: Marker of a decorator that was changed to a comment.
DECORATOR = "# decorator: "

#: Other tests that use the kernels, in addition to the tests of the kernels.
BESIDE_KERNELS = ("tests/order/", "tests/material/", "tests/timing/")


class Mutant(NamedTuple):
    """One change in one file."""

    group: str
    file: Path
    #: Line number of the change, starting at 1.
    line: int
    text: str

    def diff(self) -> str:
        """Return the changed lines."""
        old = self.file.read_text(encoding="utf-8").splitlines()
        lines = difflib.unified_diff(old, self.text.splitlines(), lineterm="", n=0)
        return "\n".join(line for line in lines if line[:1] in "+-" and line[:3] not in ("+++", "---"))


def without_decorators(text: str) -> str:
    """Change the decorators of functions to comments, because mutmut does not change decorated functions."""
    lines = text.splitlines(keepends=True)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            for decorator in node.decorator_list:
                for index in range(decorator.lineno - 1, decorator.end_lineno or decorator.lineno):
                    lines[index] = DECORATOR + lines[index]
    return "".join(lines)


def mutations_of(file: Path) -> tuple[Any, list[Any]]:
    """Return the syntax tree of a file without decorators, and its mutations by mutmut."""
    return create_mutations(str(file), without_decorators(file.read_text(encoding="utf-8")))[:2]


def draw(count: int, seed: str, groups: Sequence[str]) -> list[Mutant]:
    """Return random mutants, the same number from each group; all mutants of a group have the same probability."""
    random_state = random.Random(seed)
    chosen: list[Mutant] = []
    for group in groups:
        files = sorted({file for pattern in GROUPS[group] for file in SOURCE.glob(pattern)})
        numbers = [len(mutations_of(file)[1]) for file in files]
        seen: set[str] = set()
        while len(seen) < -(-count // len(groups)):
            (file,) = random_state.choices(files, numbers)
            module, mutations = mutations_of(file)
            mutation = random_state.choice(mutations)
            mutated = module.deep_replace(mutation.original_node, mutation.mutated_node).code
            old, text = (source.replace(DECORATOR, "") for source in (module.code, mutated))
            if text in seen or text == old:
                continue
            seen.add(text)
            pairs = enumerate(zip(old.splitlines(), text.splitlines(), strict=False), 1)
            line = next((number for number, (before, after) in pairs if before != after), 1)
            chosen.append(Mutant(group, file, line, text))
    return chosen


def near_folder(file: Path) -> str:
    """Return the folder of tests that mirrors a source file."""
    folder = ROOT / "tests" / file.relative_to(SOURCE).parent
    while not folder.is_dir():
        folder = folder.parent
    return str(folder.relative_to(ROOT))


def lines_of_statement(file: Path, line: int) -> range:
    """Return the lines of the innermost statement at a line; for a compound statement, only those of its header."""
    lines = range(line, line + 1)
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):  # yields outer statements first
        if isinstance(node, ast.stmt) and node.lineno <= line <= (node.end_lineno or node.lineno):
            end = node.body[0].lineno - 1 if hasattr(node, "body") else node.end_lineno or node.lineno
            if line <= max(end, node.lineno):
                lines = range(node.lineno, max(end, node.lineno) + 1)
    return lines


class Recorded(NamedTuple):
    """Records of the fast tests in a run without a mutant: lines executed by each test, and its time, s."""

    lines: CoverageData
    seconds: dict[str, float]


def tests_for(mutant: Mutant, recorded: Recorded) -> list[str]:
    """Return the tests that can detect a change, in the order in which they are run.

    First come tests near the file that execute the line, then other tests that execute it; in each group, the fastest
    test is first. For compiled kernels and module-level lines, there are no records, so all tests near them follow.
    """
    contexts = recorded.lines.contexts_by_lineno(str(mutant.file))
    names = {name for line in lines_of_statement(mutant.file, mutant.line) for name in contexts.get(line, ())}
    # The value of a fixture may be used by all tests of a file.
    files = {name.partition("::")[0] for name in names if name.endswith("|setup")}
    run = {name.rpartition("|")[0] for name in names if name.endswith("|run")}
    run |= {test for test in recorded.seconds if test.partition("::")[0] in files}
    near = (f"{near_folder(mutant.file)}/",)
    others: set[str] = set()
    if mutant.file.is_relative_to(SOURCE / "kernels"):
        others = {test for test in recorded.seconds if test.startswith((*near, *BESIDE_KERNELS))}
    elif "" in names or not names:
        others = {test for test in recorded.seconds if test.startswith(near)}
    chosen = [test for test in run | others if test in recorded.seconds]
    return sorted(chosen, key=lambda test: (test not in run, not test.startswith(near), recorded.seconds[test]))


def killed(mutant: Mutant, tests: list[str], seconds: float) -> bool:
    """Apply a mutant and run tests until the first failure; return whether a test fails, or takes much longer than
    usual.

    `seconds` is the processor time of the tests without the mutant.
    """
    original = mutant.file.read_bytes()
    try:
        mutant.file.write_text(mutant.text, encoding="utf-8")
        return not passes(tests, "-n", "0", most=3.0 * seconds + COMPILING)
    finally:
        mutant.file.write_bytes(original)


def passes(tests: list[str], *flags: str, most: float = math.inf, quiet: bool = True) -> bool:
    """Run fast tests until the first failure; return whether all pass within `most` seconds of processor time."""
    output = subprocess.DEVNULL if quiet else None

    def limit() -> None:
        if math.isfinite(most):
            resource.setrlimit(resource.RLIMIT_CPU, (int(most), int(most)))

    with tempfile.NamedTemporaryFile("w", encoding="utf-8", suffix=".txt") as names:
        names.write("\n".join(tests))
        names.flush()
        chosen = [f"@{names.name}"] if tests else []
        command = [sys.executable, "-m", "pytest", "-x", "-p", "no:cacheprovider", "-m", FAST, *flags, *chosen]
        run = subprocess.run(command, cwd=ROOT, stdout=output, stderr=output, preexec_fn=limit, check=False)
        return run.returncode in (0, 5)  # 5 means that no fast test was collected


def record(files: set[Path]) -> Recorded:
    """Run the fast tests once; return which of them execute which lines of the files, and their times."""
    times = ROOT / "build" / "mutant_times.jsonl"
    times.parent.mkdir(exist_ok=True)
    with tempfile.NamedTemporaryFile("w", encoding="utf-8", suffix=".ini") as settings:
        # Trace only these files, so that the run takes hardly longer than without recording.
        settings.write("[run]\ninclude =\n" + "".join(f"    {file}\n" for file in sorted(files)))
        settings.flush()
        flags = ["--cov", f"--cov-config={settings.name}", "--cov-context=test", "--cov-report="]
        if not passes([], "-n", "2", "--dist", "worksteal", *flags, f"--report-log={times}", quiet=False):
            sys.exit("the fast tests fail without a mutant; every mutant would count as killed")
    lines = CoverageData(str(ROOT / ".coverage"))
    lines.read()
    rows = map(json.loads, times.read_text(encoding="utf-8").splitlines())
    return Recorded(lines, {row["nodeid"]: row["duration"] + EACH for row in rows if row.get("when") == "call"})


def main() -> None:
    """Draw mutants, run the tests on each, and print the survivors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100, help="number of mutants")
    parser.add_argument("--groups", nargs="+", choices=list(GROUPS), default=list(GROUPS), help="default: all")
    parser.add_argument("--seed", default="", help="default: the hash of the commit")
    parser.add_argument("--most", type=float, default=90.0, help="most processor time of the tests for a mutant, s")
    parser.add_argument("--part", default="1/1", help="K/N: run every N-th mutant, starting at the K-th")
    given = parser.parse_args()
    if subprocess.run(["git", "status", "--porcelain"], cwd=ROOT, capture_output=True, check=True).stdout:
        sys.exit("the clone has changes; commit them or use a fresh clone")
    commit = subprocess.run(["git", "rev-parse", "HEAD"], cwd=ROOT, capture_output=True, text=True, check=True)
    seed = given.seed or commit.stdout.strip()
    part, parts = map(int, given.part.split("/"))
    mutants = draw(given.count, seed, given.groups)[part - 1 :: parts]
    recorded = record({mutant.file for mutant in mutants})
    print(f"{len(mutants)} mutants of seed {seed}", flush=True)
    survivors = 0
    for number, mutant in enumerate(mutants, 1):
        tests, seconds = tests_for(mutant, recorded), 0.0
        for count, test in enumerate(tests):
            seconds += recorded.seconds[test]
            if seconds > given.most:
                tests = tests[:count]
                break
        start, diff = time.monotonic(), mutant.diff()
        dead = bool(tests) and killed(mutant, tests, seconds)
        survivors += not dead
        place = f"{mutant.file.relative_to(ROOT)}:{mutant.line}"
        result = "killed" if dead else "SURVIVED" if tests else "NO TEST"
        print(f"{number}. {mutant.group}: {place}: {result} ({time.monotonic() - start:.0f} s)\n{diff}", flush=True)
    print(f"{len(mutants) - survivors} of {len(mutants)} killed ({1 - survivors / len(mutants):.0%})")


if __name__ == "__main__":
    main()
