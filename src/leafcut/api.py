"""The whole way in one place: read, plan, solve, lay, post, read back, verify, write, report.

The only file that joins the rooms. Rooms are imported where they are used, so `import leafcut` stays quick.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import LeafcutError, OptionError
from leafcut.files import StandardInput, check_is_text, check_output, read_program, write_together
from leafcut.model.heartbeat import Look
from leafcut.model.issue import Issue
from leafcut.model.nest import NestOutcome
from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.model.snapshot import Observer
from leafcut.model.solution import Solution
from leafcut.options import Settings, flag_name, settings_for
from leafcut.processes.course import Progress, Run, for_cutting, looking_for, machine_of, passing_on

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.gcode.program import Program
    from leafcut.model.cutting import CutPlan
    from leafcut.model.machine import Machine
    from leafcut.model.toolpath import Toolpath
    from leafcut.processes.program.reading import ProgramRead
    from leafcut.read.format import Format, Source

#: What a drawing or a program may be given as.
Given = str | Path | StandardInput

#: What `optimize` can be told to make of its input.
PROCESSES = ("auto", "drill", "cut", "pocket", "mill", "laser", "plasma")


def optimize(
    source: Given | Sequence[str | Path],
    output: str | Path | None = None,
    *,
    report: str | Path | None = None,
    process: str = "auto",
    options_file: str | Path | None = None,
    defaults_file: str | Path | None = None,
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
        a G-code program of any CAM. Of several drill files, such as those of plated and of other holes, one program is
        made.
    output, report
        Where to write the program and the report page; nothing is written without them.
    process
        ``cut`` makes a cutting program of the contours in a drawing, ``pocket`` a milling program of its pockets; else
        what a program does: ``drill``, ``mill``, ``laser`` or ``plasma``, where ``auto`` does not see it. Of a picture
        ``auto`` makes pockets.
    options_file
        A TOML file of options.
    defaults_file
        Another one, whose options hold where neither a call nor `options_file` says others.
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
    sources = _sources(source)
    settings = _collected(options, options_file, defaults_file)
    profile = settings.machine.machine
    tables = (settings.drill.tools, settings.drill.hole_order, settings.cut.chart, settings.cut.plan)
    inputs = [*sources, options_file, defaults_file, *tables, profile if profile.endswith(".toml") else None]
    outputs = [output, report, settings.cut.save_plan if process == "cut" else None]
    for k, target in enumerate(outputs):
        check_output(target, [*inputs, *outputs[:k]])
    if process == "cut":
        settings = for_cutting(settings)
    with _telling_defaults(settings):
        run = Run(settings, machine_of(settings), progress, cancelled or threading.Event(), observe)
        outcome = replace(_work(run, sources, process), output=str(output or ""), report=str(report or ""))
    outcome = replace(outcome, seconds=time.perf_counter() - began)
    page = _page(outcome) if report else ""  # before anything is written: it may fail
    texts = {str(output): outcome.text} if output else {}
    plan = outcome.shown.plan("after")
    if plan is not None and settings.cut.save_plan:
        texts[str(settings.cut.save_plan)] = _plan_text(plan)
    if report:
        texts[str(report)] = page
    write_together(texts, encodings={str(output): outcome.encoding})
    return outcome


def _sources(source: Given | Sequence[str | Path]) -> list[Given]:
    sources: list[Given] = [source] if isinstance(source, str | Path | StandardInput) else [*source]
    if not sources:
        raise OptionError("there is no input")
    return sources


def _collected(
    options: Mapping[str, Any], file: str | Path | None = None, defaults: str | Path | None = None
) -> Settings:
    return Settings.collect(options, Path(file) if file else None, Path(defaults) if defaults else None)


def _work(run: Run, sources: Sequence[Given], process: str) -> Outcome:
    """Do what is to be done with an input of its kind."""
    from leafcut.read.registry import read_source

    if process not in PROCESSES:
        raise OptionError(f"--process: '{process}' is not there; use one of {', '.join(PROCESSES)}")
    if len(sources) > 1:
        return _drilled_together(run, [read_source(one) for one in sources], process)
    format_, loaded = read_source(sources[0])
    if format_.name == "gcode" and process == "cut":
        raise OptionError("--process cut: this is a program; of a program, say what it does: laser or plasma")
    if format_.name == "gcode" and process == "pocket":
        raise OptionError("--process pocket: this is a program; of a program, say what it does: mill")
    if format_.name == "gcode":
        from leafcut.processes.program.run import resequence

        check_is_text(loaded.path, loaded.data)
        return _done(run, "program", format_.name, lambda run: resequence(run, loaded.path, loaded.data, process))
    if process not in ("auto", "drill", "cut", "pocket"):
        raise OptionError(f"--process {process}: a drawing is drilled, cut or milled; use auto, drill, cut or pocket")
    if process == "pocket" or (process == "auto" and format_.processes == ("pocket",)):
        from leafcut.processes.pocket.run import pocket

        return _done(run, "pocket", format_.name, lambda run: pocket(run, loaded))
    if process == "cut":
        from leafcut.processes.sheet.run import cut

        return _done(run, "cut", format_.name, lambda run: cut(run, loaded))
    from leafcut.processes.drilling.run import drill

    return _done(run, "drill", format_.name, lambda run: drill(run, loaded))


def _drilled_together(run: Run, inputs: Sequence[tuple[Format, Source]], process: str) -> Outcome:
    """Make one program of several drill files."""
    from leafcut.processes.drilling.run import drill

    for format_, loaded in inputs:
        if format_.name != "excellon" or process not in ("auto", "drill"):
            what = f"{loaded.path} is none" if format_.name != "excellon" else f"--process {process} is none for them"
            raise OptionError(f"one program is made of several drill files only; {what}")
    return _done(run, "drill", "excellon", lambda run: drill(run, *(loaded for _, loaded in inputs)))


@contextmanager
def _telling_defaults(settings: Settings) -> Iterator[None]:
    """Let a refusal tell which of the options that it names were not typed, but are of the person's own defaults."""
    try:
        yield
    except LeafcutError as problem:
        flags = {word.rstrip(".,:;") for word in str(problem).split()}
        own = [flag_name(name) for name in sorted(settings.defaults) if flag_name(name) in flags]
        if own:
            problem.add_note(f"{' and '.join(own)} may be of your own defaults, which --no-defaults leaves out")
        raise


def _done(run: Run, work: str, input_kind: str, do: Callable[[Run], Outcome]) -> Outcome:
    """Do a kind of work with the options that it uses; refuse others; tell what of them is of the person's defaults."""
    run = replace(run, settings=settings_for(run.settings, work, input_kind))
    return replace(do(run), defaults=run.settings.from_defaults())


def _plan_text(plan: CutPlan) -> str:
    from leafcut.processes.sheet.plan.apply_plan_file import plan_file
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
    defaults_file: str | Path | None = None,
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

    `options_file`, `defaults_file`, `progress` and `cancelled` are those of `optimize`.

    Raises
    ------
    ReadError, OptionError, PlanError, VerifyError, OutputError
        One line that says what was found and what to do. Nothing has been written then.
    """
    from leafcut.processes.nesting.run import nest_drawings
    from leafcut.read.nest_list import read_wanted

    settings = settings_for(_collected(options, options_file, defaults_file), "nest")
    words = [str(part) for part in parts]
    wanted = read_wanted(words)
    lists = [name for word in words for name in (word, word.rpartition(":")[0]) if name]
    inputs = [options_file, defaults_file, *lists, *(one.file for one in wanted)]
    check_output(output, inputs)
    if settings.nest.remnants_out is not None:
        check_output(settings.nest.remnants_out / "rest.dxf", inputs)  # before any work: the folder is there
    outcome, texts = nest_drawings(wanted, settings, output, progress=progress, cancelled=cancelled)
    sheets = [word.name for word in settings.nest.sheets if word.size is None]
    for name in texts:
        check_output(name, [*inputs, *sheets])
    write_together(texts)
    return replace(outcome, defaults=settings.from_defaults())


def solve_part(
    part: Part, *, progress: Progress | None = None, observe: Observer | None = None,
    cancelled: threading.Event | None = None, **options: Any,
) -> Solution:  # fmt: skip
    """Return a closed tour through the points of a map, by TSPLIB's rule of distance where the file has one.

    Where the map has sets of points, the tour visits one point of each, and keeps what must come before what.
    `progress`, `observe`, `cancelled` and `options` are those of `optimize`.
    """
    return _solved(part, settings_for(_collected(options), "solve"), progress, observe, cancelled)


def _solved(
    part: Part, settings: Settings, progress: Progress | None, observe: Observer | None,
    cancelled: threading.Event | None,
) -> Solution:  # fmt: skip
    from leafcut.solve.compiling import announced
    from leafcut.solve.maps import check_allowed, problem_of_map
    from leafcut.solve.solve import solve

    problem = problem_of_map(part)
    tell = passing_on(progress, f"solving {part.name}")
    with announced(lambda words: progress(words, None, 0.0, None) if progress else None):
        solution = solve(
            problem, settings.solve, settings.aco, firefly=settings.firefly, progress=tell, observe=observe,
            cancelled=cancelled,
        )  # fmt: skip
    check_allowed(part, solution.nodes)
    return solution


def solve_file(
    source: Given,
    *,
    defaults_file: str | Path | None = None,
    progress: Progress | None = None,
    observe: Observer | None = None,
    cancelled: threading.Event | None = None,
    **options: Any,
) -> tuple[dict[str, Any], NDArray[np.int32]]:
    """Solve a map file as a closed tour; return the answer of ``leafcut solve --json`` and the tour int32[n]."""
    from leafcut.read import read
    from leafcut.report.json_answer import solution_as_json

    settings = settings_for(_collected(options, None, defaults_file), "solve")
    part = read(source, settings.read, looking_for(progress, "reading"))
    solution = _solved(part, settings, progress, observe, cancelled)
    return {**solution_as_json(part, solution), **_defaults(settings)}, solution.nodes


def _defaults(settings: Settings) -> dict[str, list[str]]:
    """Return what an answer tells of the person's defaults: nothing where none of them is used."""
    told = settings.from_defaults()
    return {"defaults": list(told)} if told else {}


def simulate(
    program: Given,
    *,
    dialect: str | None = None,
    defaults_file: str | Path | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Return what a program costs on a machine: seconds and lengths by kind of motion, extents, and dangers in it.

    `progress` is that of `optimize`; here and in all else an exception that it raises ends the work.
    """
    settings = settings_for(_collected(options, None, defaults_file), "simulate")
    cost = _read_run(program, settings, dialect, progress).cost()
    return {"program": str(program), **cost, **_defaults(settings)}


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
    program: Given, *, dialect: str | None = None, progress: Progress | None = None, **options: Any
) -> ProgramRun:
    """Return what a program does on the machine that the options name."""
    return _read_run(program, settings_for(_collected(options), "simulate"), dialect, progress)


def _read_run(program: Given, settings: Settings, dialect: str | None, progress: Progress | None) -> ProgramRun:
    from leafcut.gcode import dialects
    from leafcut.processes.program.reading import read_foreign

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
    original: Given,
    new: Given,
    *,
    dialect: str | None = None,
    defaults_file: str | Path | None = None,
    allow_reverse: bool = False,
    progress: Progress | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Return whether two programs do the same work, what was counted, and every difference as one line.

    With `allow_reverse`, open cuts of one depth are the same from either end.
    """
    from leafcut.gcode import dialects
    from leafcut.processes.program.proof.certificate import certify

    settings = settings_for(_collected(options, None, defaults_file), "verify")
    machine = machine_of(settings)
    words = dialect or machine.controller
    look = looking_for(progress, "verifying")
    first = _interpret(original, dialects.dialect(words), settings, machine, look, choose=True)
    other = _interpret(new, first.words, settings, first.machine, look, choose=False)
    found = certify(
        first.program, other.program, machine=first.machine, allow_reverse=allow_reverse, look=look, notes=True
    )
    answer = found.as_json()
    for row, difference in zip(answer["differences"], found.differences, strict=True):
        row["words"] = str(difference)
    return {**answer, **_defaults(settings)}


def output_name(
    source: str | Path,
    process: str = "auto",
    options_file: str | Path | None = None,
    defaults_file: str | Path | None = None,
    **options: Any,
) -> str:
    """Return the name of the program of an input among those of several inputs: a program keeps its own.

    That of a drawing ends as programs of the dialect do in which `optimize` would write it.

    Raises
    ------
    OptionError
        An option, or the machine, is refused whatever the input is.
    """
    from leafcut.read.registry import format_name

    settings = _collected(options, options_file, defaults_file)
    settings = for_cutting(settings) if process == "cut" else settings
    extension = program_extension(settings.post.dialect or machine_of(settings).controller)
    if format_name(source) == "gcode":
        return Path(source).name
    return Path(str(source).replace("example:", "").replace(":", "-")).stem + extension


def in_place(part: Part, settings: Settings, work: str) -> Part:
    """Return what was read for a kind of work as it lies before that work is planned."""
    from leafcut.processes.placing import placed, placed_sheet

    if work == "cut":
        return placed_sheet(part, settings.read, settings.sheet)
    return placed(part, settings.read) if work in ("drill", "pocket") else part


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
    program: Given, words: Dialect, settings: Settings, machine: Machine, look: Look, *, choose: bool
) -> ProgramRead:
    from leafcut.processes.program.reading import read_foreign

    return read_foreign(read_program(program), str(program), settings, machine, words, look, choose=choose)
