"""The whole way in one place: read, plan, solve, lay, post, read back, verify, write, report.

The only file that joins the rooms. Rooms are imported where they are used, so `import leafcut` stays quick.
"""

from __future__ import annotations

import threading
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.files import check_output, read_program, write_whole
from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.model.solution import Solution
from leafcut.options import Settings
from leafcut.runs.run import Progress, Run, machine_of, passing_on

if TYPE_CHECKING:
    from leafcut.gcode.program import Program

#: What `optimize` can be told to make of its input.
PROCESSES = ("auto", "drill", "mill", "laser", "plasma")


def optimize(
    source: str | Path,
    output: str | Path | None = None,
    *,
    report: str | Path | None = None,
    process: str = "auto",
    options_file: str | Path | None = None,
    progress: Progress | None = None,
    cancelled: threading.Event | None = None,
    **options: Any,
) -> Outcome:
    """Turn a drawing into a verified drilling program, or a program into the same work in less time.

    Parameters
    ----------
    source
        A drawing or a map that `leafcut.read_part` understands, the name of an example such as ``example:plate-70``, or
        a G-code program of any CAM.
    output, report
        Where to write the program and the report page; nothing is written without them.
    process
        What a program does: ``drill``, ``mill``, ``laser`` or ``plasma``, where ``auto`` does not see it.
    options_file
        A TOML file of options.
    progress
        Called as the work goes on with (what, cost so far or None, share done, gap or None).
    cancelled
        Set it from another thread to stop the search and keep the best.
    options
        Any option of `leafcut.options` by its name: ``machine="haas-vf2", thickness="0.25in", seed=7``. A number
        without a unit is what it is on the command line: mm, s, rpm, and mm/min for feeds.

    Returns
    -------
    Outcome
        Toolpaths, measures before and after, the program's text and all else that was found out.

    Raises
    ------
    ReadError, OptionError, PlanError, PostError, VerifyError, OutputError
        One line that says what was found and what to do. Nothing has been written then.
    """
    began = time.perf_counter()
    settings = Settings.collect(options, Path(options_file) if options_file else None)
    profile = settings.machine.machine
    inputs = [source, options_file, settings.drill.tools, profile if profile.endswith(".toml") else None]
    for target in (output, report):
        check_output(target, inputs)
    check_output(report, [output])
    run = Run(settings, machine_of(settings), progress, cancelled or threading.Event())
    outcome = replace(_work(run, source, process), output=str(output or ""), report=str(report or ""))
    outcome = replace(outcome, seconds=time.perf_counter() - began)
    page = _page(outcome) if report else ""  # before anything is written: it may fail
    if output:
        write_whole(output, outcome.text, encoding=outcome.encoding)
    if report:
        write_whole(report, page)
    return outcome


def _work(run: Run, source: str | Path, process: str) -> Outcome:
    """Do what is to be done with an input of its kind."""
    from leafcut.read.registry import read_source

    if process not in PROCESSES:
        raise OptionError(f"--process: '{process}' is not there; use one of {', '.join(PROCESSES)}")
    format_, loaded = read_source(source)
    if format_.name == "gcode":
        from leafcut.runs.resequencing import resequence

        return resequence(run, loaded.path, loaded.data, process)
    if process not in ("auto", "drill"):
        raise OptionError(f"--process {process}: of a drawing, leafcut makes drilling programs; use auto or drill")
    from leafcut.runs.drilling import drill

    return drill(run, source)


def _page(outcome: Outcome) -> str:
    from leafcut.report.page import write_page

    return write_page(outcome)


def solve_part(
    part: Part, *, progress: Progress | None = None, cancelled: threading.Event | None = None, **options: Any
) -> Solution:
    """Return a closed tour through the points of a map, by TSPLIB's rule of distance where the file has one.

    Where the map has sets of points, the tour visits one point of each, and keeps what must come before what.
    `progress`, `cancelled` and `options` are those of `optimize`.
    """
    from leafcut.plan.maps import check_allowed, problem_of_map
    from leafcut.solve.compiling import announced
    from leafcut.solve.solve import solve

    settings, problem = Settings.collect(options), problem_of_map(part)
    tell = passing_on(progress, f"solving {part.name}")
    with announced(lambda: progress("compiling (first run on this machine)", None, 0.0, None) if progress else None):
        solution = solve(
            problem, settings.solve, settings.aco, firefly=settings.firefly, progress=tell, cancelled=cancelled
        )
    check_allowed(part, solution.nodes)
    return solution


def solve_file(
    source: str | Path, *, progress: Progress | None = None, cancelled: threading.Event | None = None, **options: Any
) -> tuple[dict[str, Any], NDArray[np.int32]]:
    """Solve a map file as a closed tour; return the answer of ``leafcut solve --json`` and the tour int32[n]."""
    from leafcut.read import read
    from leafcut.report.json_answer import solution_as_json

    part = read(source, Settings.collect(options).read)
    solution = solve_part(part, progress=progress, cancelled=cancelled, **options)
    return solution_as_json(part, solution), solution.nodes


def simulate(program: str | Path, *, dialect: str | None = None, **options: Any) -> dict[str, Any]:
    """Return what a program costs on a machine: seconds and lengths by kind of motion, extents, and dangers in it."""
    from leafcut.timing.toolpath import measure
    from leafcut.verify.clearance import check_clearance
    from leafcut.verify.envelope import check_envelope

    machine = machine_of(Settings.collect(options))
    read = _interpret(program, dialect or machine.controller)
    path = read.path
    result = measure(path, machine)
    low, high = path.extents
    dangers = (*check_envelope(path, machine), *check_clearance(path, safe_z=machine.safe_z or 0.0))
    return {
        "program": str(program),
        "machine": machine.name,
        "time_s": result.time_s,
        "rapid_mm": result.travel_mm,
        "feed_mm": result.cut_mm,
        "by_kind": result.by_kind,
        "extents": {axis: [low[k], high[k]] for k, axis in enumerate("xyz")},
        "issues": [str(d) for d in dangers],
    }


def verify_programs(
    original: str | Path,
    new: str | Path,
    *,
    dialect: str | None = None,
    allow_reverse: bool = False,
    **options: Any,
) -> dict[str, Any]:
    """Return whether two programs do the same work, what was counted, and every difference as one line.

    With `allow_reverse`, open cuts of one depth are the same from either end.
    """
    from leafcut.verify.certificate import certify

    machine = machine_of(Settings.collect(options))
    words = dialect or machine.controller
    found = certify(_interpret(original, words), _interpret(new, words), machine=machine, allow_reverse=allow_reverse)
    answer = found.as_json()
    for row, difference in zip(answer["differences"], found.differences, strict=True):
        row["words"] = str(difference)
    return answer


def _interpret(program: str | Path, dialect_name: str) -> Program:
    from leafcut.gcode.dialects import dialect
    from leafcut.gcode.foreign import interpret_program

    return interpret_program(read_program(program), dialect(dialect_name), str(program))
