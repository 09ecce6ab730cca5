"""The whole way in one place: read, plan, solve, lay, post, read back, verify, write, report.

The only file that joins the rooms. Rooms are imported where they are used, so `import leafcut` stays quick.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.files import check_output, read_program, write_together
from leafcut.model.issue import Issue
from leafcut.model.look import Look
from leafcut.model.nest import NestOutcome
from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.model.snapshot import Observer
from leafcut.model.solution import Solution
from leafcut.options import Settings, settings_for
from leafcut.runs.run import Progress, Run, for_cutting, looking_for, machine_of, passing_on

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.gcode.program import Program
    from leafcut.model.cutting import CutPlan
    from leafcut.model.machine import Machine
    from leafcut.model.toolpath import Toolpath
    from leafcut.runs.reading import ProgramRead

#: What `optimize` can be told to make of its input.
PROCESSES = ("auto", "drill", "cut", "pocket", "mill", "laser", "plasma")


def optimize(
    source: str | Path,
    output: str | Path | None = None,
    *,
    report: str | Path | None = None,
    process: str = "auto",
    options_file: str | Path | None = None,
    progress: Progress | None = None,
    observe: Observer | None = None,
    cancelled: threading.Event | None = None,
    **options: Any,
) -> Outcome:
    """Turn a drawing into a verified program that drills, cuts or mills it, or a program into a quicker one.

    Parameters
    ----------
    source
        A drawing or a map that `leafcut.read_part` understands, the name of an example such as ``example:plate-70``, or
        a G-code program of any CAM.
    output, report
        Where to write the program and the report page; nothing is written without them.
    process
        ``cut`` makes a cutting program of the contours in a drawing, ``pocket`` a milling program of its pockets; else
        what a program does: ``drill``, ``mill``, ``laser`` or ``plasma``, where ``auto`` does not see it. Of a picture
        ``auto`` makes pockets.
    options_file
        A TOML file of options.
    progress
        Called as the work goes on with (what, cost so far or None, share done, gap or None).
    observe
        Called by the searches between their steps, to look at them closely; see `leafcut.model.snapshot`.
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
    tables = (settings.drill.tools, settings.drill.hole_order, settings.cut.chart, settings.cut.plan)
    inputs = [source, options_file, *tables, profile if profile.endswith(".toml") else None]
    outputs = [output, report, settings.cut.save_plan if process == "cut" else None]
    for k, target in enumerate(outputs):
        check_output(target, [*inputs, *outputs[:k]])
    if process == "cut":
        settings = for_cutting(settings)
    run = Run(settings, machine_of(settings), progress, cancelled or threading.Event(), observe)
    outcome = replace(_work(run, source, process), output=str(output or ""), report=str(report or ""))
    outcome = replace(outcome, seconds=time.perf_counter() - began)
    page = _page(outcome) if report else ""  # before anything is written: it may fail
    texts = {str(output): outcome.text} if output else {}
    if outcome.cut_plan is not None and settings.cut.save_plan:
        texts[str(settings.cut.save_plan)] = _plan_text(outcome.cut_plan)
    if report:
        texts[str(report)] = page
    write_together(texts, encodings={str(output): outcome.encoding})
    return outcome


def _work(run: Run, source: str | Path, process: str) -> Outcome:
    """Do what is to be done with an input of its kind."""
    from leafcut.read.registry import read_source

    if process not in PROCESSES:
        raise OptionError(f"--process: '{process}' is not there; use one of {', '.join(PROCESSES)}")
    format_, loaded = read_source(source)
    if format_.name == "gcode" and process == "cut":
        raise OptionError("--process cut: this is a program; of a program, say what it does: laser or plasma")
    if format_.name == "gcode" and process == "pocket":
        raise OptionError("--process pocket: this is a program; of a program, say what it does: mill")
    if format_.name == "gcode":
        from leafcut.runs.resequencing import resequence

        return resequence(_for(run, "program", format_.name), loaded.path, loaded.data, process)
    if process not in ("auto", "drill", "cut", "pocket"):
        raise OptionError(f"--process {process}: a drawing is drilled, cut or milled; use auto, drill, cut or pocket")
    if process == "pocket" or (process == "auto" and format_.processes == ("pocket",)):
        from leafcut.runs.pocketing import pocket

        return pocket(_for(run, "pocket", format_.name), source)
    if process == "cut":
        from leafcut.runs.cutting import cut

        return cut(_for(run, "cut", format_.name), source)
    from leafcut.runs.drilling import drill

    return drill(_for(run, "drill", format_.name), source)


def _for(run: Run, work: str, input_kind: str) -> Run:
    """Return a run with the options that its kind of work uses; refuse others."""
    return replace(run, settings=settings_for(run.settings, work, input_kind))


def _plan_text(plan: CutPlan) -> str:
    from leafcut.plan.following import plan_file
    from leafcut.read.plan_file import plan_text

    return plan_text(plan_file(plan.sheet, plan.data, plan.cuts))


def _page(outcome: Outcome) -> str:
    from leafcut.report.page import write_page

    return write_page(outcome)


def nest(
    parts: Sequence[str | Path],
    output: str | Path | None = None,
    *,
    options_file: str | Path | None = None,
    progress: Progress | None = None,
    cancelled: threading.Event | None = None,
    **options: Any,
) -> NestOutcome:
    """Lay parts on sheets, in several variants, and write the sheets of the best one as DXF drawings.

    Parameters
    ----------
    parts
        Drawings with quantities, ``"bracket.dxf:10"``, or lists of them, ``"parts.csv"``.
    output
        The drawing to write; with several different sheets, ``sheet_1.dxf`` and so on. Nothing is written without it.
    options
        Any option of `leafcut.options` by its name: ``sheet="3000x1500", kerf=1.5, gap="5mm", variants=5``.

    `options_file`, `progress` and `cancelled` are those of `optimize`.

    Raises
    ------
    ReadError, OptionError, PlanError, VerifyError, OutputError
        One line that says what was found and what to do. Nothing has been written then.
    """
    from leafcut.read.nest_list import read_wanted
    from leafcut.runs.nesting import nest_drawings

    settings = settings_for(Settings.collect(options, Path(options_file) if options_file else None), "nest")
    words = [str(part) for part in parts]
    wanted = read_wanted(words)
    lists = [name for word in words for name in (word, word.rpartition(":")[0]) if name]
    inputs = [options_file, *lists, *(one.file for one in wanted)]
    check_output(output, inputs)
    if settings.nest.remnants_out is not None:
        check_output(settings.nest.remnants_out / "rest.dxf", inputs)  # before any work: the folder is there
    outcome, texts = nest_drawings(wanted, settings, output, progress=progress, cancelled=cancelled)
    sheets = [word.name for word in settings.nest.sheets if word.size is None]
    for name in texts:
        check_output(name, [*inputs, *sheets])
    write_together(texts)
    return outcome


def solve_part(
    part: Part, *, progress: Progress | None = None, observe: Observer | None = None,
    cancelled: threading.Event | None = None, **options: Any,
) -> Solution:  # fmt: skip
    """Return a closed tour through the points of a map, by TSPLIB's rule of distance where the file has one.

    Where the map has sets of points, the tour visits one point of each, and keeps what must come before what.
    `progress`, `observe`, `cancelled` and `options` are those of `optimize`.
    """
    from leafcut.plan.maps import check_allowed, problem_of_map
    from leafcut.solve.compiling import announced
    from leafcut.solve.solve import solve

    settings, problem = settings_for(Settings.collect(options), "solve"), problem_of_map(part)
    tell = passing_on(progress, f"solving {part.name}")
    with announced(lambda words: progress(words, None, 0.0, None) if progress else None):
        solution = solve(
            problem, settings.solve, settings.aco, firefly=settings.firefly, progress=tell, observe=observe,
            cancelled=cancelled,
        )  # fmt: skip
    check_allowed(part, solution.nodes)
    return solution


def solve_file(
    source: str | Path,
    *,
    progress: Progress | None = None,
    observe: Observer | None = None,
    cancelled: threading.Event | None = None,
    **options: Any,
) -> tuple[dict[str, Any], NDArray[np.int32]]:
    """Solve a map file as a closed tour; return the answer of ``leafcut solve --json`` and the tour int32[n]."""
    from leafcut.read import read
    from leafcut.report.json_answer import solution_as_json

    part = read(source, settings_for(Settings.collect(options), "solve").read, looking_for(progress, "reading"))
    solution = solve_part(part, progress=progress, observe=observe, cancelled=cancelled, **options)
    return solution_as_json(part, solution), solution.nodes


def simulate(
    program: str | Path, *, dialect: str | None = None, progress: Progress | None = None, **options: Any
) -> dict[str, Any]:
    """Return what a program costs on a machine: seconds and lengths by kind of motion, extents, and dangers in it.

    `progress` is that of `optimize`; here and in all else an exception that it raises ends the work.
    """
    return {"program": str(program), **read_run(program, dialect=dialect, progress=progress, **options).cost()}


@dataclass(frozen=True)
class ProgramRun:
    """What a program does on a machine.

    Attributes
    ----------
    path
        What the program says, and `run` that with what its controller adds at every cut.
    dialect
        In which it was read.
    issues
        What is dangerous in it, what was assumed, and what of the controller's own doing is not known.
    """

    path: Toolpath
    run: Toolpath
    machine: Machine
    dialect: str
    issues: tuple[Issue, ...] = ()

    def cost(self) -> dict[str, Any]:
        """Return what `simulate` tells, but for the program's name."""
        from leafcut.report.json_answer import issues_as_json
        from leafcut.timing.toolpath import measure

        path, machine = self.path, self.machine
        # From where `optimize` counts, too, unless `--start-point` says otherwise.
        result = measure(self.run, machine, start=(0.0, 0.0))
        low, high = path.extents
        return {
            "machine": machine.name,
            "time_s": result.time_s,
            "rapid_mm": result.travel_mm,
            "feed_mm": result.cut_mm,
            "by_kind": result.by_kind,
            "extents": {axis: [low[k], high[k]] for k, axis in enumerate("xyz")},
            "issues": issues_as_json(self.issues),
        }


def read_run(
    program: str | Path, *, dialect: str | None = None, progress: Progress | None = None, **options: Any
) -> ProgramRun:
    """Return what a program does on the machine that the options name."""
    from leafcut.gcode import dialects
    from leafcut.runs.reading import read_foreign

    settings = settings_for(Settings.collect(options), "simulate")
    machine = machine_of(settings)
    name = dialect or machine.controller
    words = dialects.dialect(name)
    look = looking_for(progress, "reading")
    read = read_foreign(read_program(program), str(program), settings, machine, words, look)
    _check_lifts(settings, read.words)
    name = read.words.name
    run, unknown = _as_run(read.program, name, settings.drill.clearance_height)
    return ProgramRun(read.program.path, run, read.machine, name, (*read.dangers, *read.issues, *unknown))


def _check_lifts(settings: Settings, words: Dialect) -> None:
    """Refuse a height for what the controller does itself where it does nothing itself."""
    if "clearance_height" in settings.asked and (words.torch is None or not words.torch.material_comment):
        raise OptionError(f"--clearance-height: a program for {words.name} says its heights itself; leave it out")


def _as_run(program: Program, dialect_name: str, clearance: float) -> tuple[Toolpath, list[Issue]]:
    """Return what a program does with what its controller adds at every cut, and what of that is not known."""
    from leafcut.gcode.dialects import dialect
    from leafcut.gcode.material import as_run

    torch = dialect(dialect_name).torch
    if torch is None or not torch.material_comment:
        return program.path, []
    path, unknown = as_run(program.path, program.lines, clearance)
    words = f"{unknown} cuts are of a material that the program does not tell, (o=0, …): their pierces are not counted"
    return path, [Issue("L413", words)] if unknown else []


def verify_programs(
    original: str | Path,
    new: str | Path,
    *,
    dialect: str | None = None,
    allow_reverse: bool = False,
    progress: Progress | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Return whether two programs do the same work, what was counted, and every difference as one line.

    With `allow_reverse`, open cuts of one depth are the same from either end.
    """
    from leafcut.gcode import dialects
    from leafcut.verify.certificate import certify

    settings = settings_for(Settings.collect(options), "verify")
    machine = machine_of(settings)
    words = dialect or machine.controller
    look = looking_for(progress, "verifying")
    first = _interpret(original, dialects.dialect(words), settings, machine, look, choose=True)
    other = _interpret(new, first.words, settings, first.machine, look, choose=False)
    found = certify(first.program, other.program, machine=first.machine, allow_reverse=allow_reverse, look=look)
    answer = found.as_json()
    for row, difference in zip(answer["differences"], found.differences, strict=True):
        row["words"] = str(difference)
    return answer


def default_machine(process: str = "auto") -> str:
    """Return the machine that `optimize` takes where none is named."""
    settings = Settings()
    return (for_cutting(settings) if process == "cut" else settings).machine.machine


def dialect_of(options: Mapping[str, Any], process: str = "auto") -> str:
    """Return the dialect in which `optimize` would write with these options."""
    settings = Settings.collect(options)
    settings = for_cutting(settings) if process == "cut" else settings
    return settings.post.dialect or machine_of(settings).controller


def program_extension(dialect_name: str) -> str:
    """Return what the names of a dialect's programs end in, with the dot."""
    from leafcut.gcode.dialects import dialect

    return dialect(dialect_name).extension


def _interpret(
    program: str | Path, words: Dialect, settings: Settings, machine: Machine, look: Look, *, choose: bool
) -> ProgramRead:
    from leafcut.runs.reading import read_foreign

    return read_foreign(read_program(program), str(program), settings, machine, words, look, choose=choose)
