"""The functions of the library. Each function looks up a process in the registry and runs it.

The functions import packages only when they need them, so that importing leafcut is fast.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack

from leafcut.errors import LeafcutError, OptionError, PlanError
from leafcut.files.whole_files import StandardInput, check_file_exists, check_output, write_all_or_none
from leafcut.kernels.compiling import announced_compilations, compile_seconds
from leafcut.message import Message
from leafcut.model.heartbeat import OnProgress, Progress, heartbeat_for_step, progress_for_step
from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.model.snapshot import Observer
from leafcut.model.solution import Solution, Solved
from leafcut.options import ReadOptions, Settings, flag_name
from leafcut.order.stop import Deadline
from leafcut.processes import registry
from leafcut.processes.course import run_process
from leafcut.processes.job import Job, machine_of, refuse_missing_work
from leafcut.processes.settings import collect_settings, input_file_names, settings_for
from leafcut.read import Input, read
from leafcut.read.registry import READERS, detect_format_name, read_once, read_source_with_format
from leafcut.results.base import as_public_result

if TYPE_CHECKING:
    from leafcut.options.keywords import (
        CutKeywords,
        DrillKeywords,
        NestKeywords,
        OptimizeKeywords,
        PartKeywords,
        PocketKeywords,
        ReorderKeywords,
        SimulateKeywords,
        SolveKeywords,
        StockKeywords,
        ToolSpeedsKeywords,
        VerifyKeywords,
    )
    from leafcut.processes.base import Process, Work
    from leafcut.read.nest_list import WantedDrawing
    from leafcut.results.nest import NestResult
    from leafcut.results.program import ProgramResult
    from leafcut.results.simulation import SimulationResult
    from leafcut.results.stock import StockResult
    from leafcut.results.tool_speeds import ToolSpeedsResult
    from leafcut.results.tour import TourResult
    from leafcut.results.verification import VerificationResult
    from leafcut.timing.fitting import MachineFit


def optimize(
    source: Input | Sequence[Input],
    output: str | Path | None = None,
    *,
    report: str | Path | None = None,
    process: str = "auto",
    options_file: str | Path | None = None,
    defaults_file: str | Path | None = None,
    progress: OnProgress | None = None,
    observe: Observer | None = None,
    cancelled: threading.Event | None = None,
    **options: Unpack[OptimizeKeywords],
) -> ProgramResult:
    """Create a verified program from a drawing, or a faster version of an existing program.

    The program drills, cuts or mills the drawing.

    Parameters
    ----------
    source
        A drawing, a map of points, the name of an example such as ``example:plate-70``, or a G-code program from any
        CAM system. Several drill files, such as the files for plated and non-plated holes, become one program.
    output, report
        Files to write: the program, and either the report page or the table of times per part of a sheet (``.csv``). If
        they are omitted, the function writes no file.
    process
        ``drill``, ``cut`` or ``pocket`` for a drawing; ``drill``, ``mill``, ``laser`` or ``plasma`` for a program.
        ``auto`` chooses the process by the file, and creates pockets from a picture.
    options_file
        TOML file of options.
    defaults_file
        TOML file with default options. They apply unless the call or `options_file` overrides them.
    progress
        Function that is called with a `Progress` when a step starts and while the step runs. It must return quickly. If
        it raises an exception, the run ends.
    observe
        Observer of the searches; see `leafcut.model.snapshot`.
    cancelled
        Event that another thread can set to stop the search. The search then keeps its best result.
    options
        Options by name: ``machine="haas-vf2", thickness="0.25in", seed=7``. Numbers without a unit are in mm, s, rpm,
        and mm/min for feeds.

    Returns
    -------
    ProgramResult
        Text of the program, toolpaths, measures before and after the search, and issues.

    Raises
    ------
    ReadError, OptionError, PlanError, PostError, VerifyError, OutputError
        The message is a single line that describes the problem, its location, and the remedy. No file was written.
    """
    from leafcut.results.program import ProgramResult

    start, compiled = time.perf_counter(), compile_seconds()
    sources = _list_sources(source)
    settings = _collect_settings(process, options, options_file, defaults_file)
    inputs = [*_file_names(*sources), options_file, defaults_file, *input_file_names(settings)]
    check_output(output, inputs)
    check_output(report, [*inputs, output])
    named = process
    if process == "auto":
        process, sources = _guess_command(sources, settings)
    work = registry.drawing_process(process)
    outputs = [output, report, *(work.extra_output_paths(settings) if work else ())]
    for k, target in enumerate(outputs[2:], 2):
        check_output(target, [*inputs, *outputs[:k]])
    settings = work.with_defaults(settings) if work else settings
    with _note_defaults_file(settings), _note_guessed_process(named, process):
        run = Job(
            settings,
            machine_of(settings),
            Deadline.from_options(settings.solve),
            progress,
            cancelled or threading.Event(),
            observe,
            Deadline.for_bounds(settings.solve),
        )
        for target in outputs:
            check_output(target, _toml_file_names(run.machine.controller))
        done, outcome = _run_process(run, sources, process, table=_is_csv(report))
    outcome = replace(outcome, output=str(output or ""), report=str(report or ""))
    compiled = compile_seconds() - compiled
    outcome = replace(outcome, seconds=time.perf_counter() - start - compiled, compile_seconds=compiled)
    page = _report_text(outcome, report) if report else ""  # before anything is written: it may fail
    texts = {str(output): outcome.text} if output else {}
    texts |= done.extra_files(outcome, settings)
    if report:
        texts[str(report)] = page
    write_all_or_none(texts, encodings={str(output): outcome.encoding})
    return as_public_result(ProgramResult, outcome, [*inputs, *_toml_file_names(run.machine.controller)])


def drill(
    source: Input | Sequence[Input], output: str | Path | None = None, **keywords: Unpack[DrillKeywords]
) -> ProgramResult:
    """Create a verified program that drills the holes of a drawing, of drill files, or of a point map.

    `source` and `output` work as in `optimize`. `keywords` accepts the other keywords of `optimize` except `process`,
    and the drilling options. The function refuses other options.
    """
    return optimize(source, output, process="drill", **keywords)


def cut(source: Input, output: str | Path | None = None, **keywords: Unpack[CutKeywords]) -> ProgramResult:
    """Create a verified program that cuts the contours of a drawing from a sheet.

    The arguments are the same as in `optimize`, without `process`.
    """
    return optimize(source, output, process="cut", **keywords)


def pocket(source: Input, output: str | Path | None = None, **keywords: Unpack[PocketKeywords]) -> ProgramResult:
    """Create a verified program that mills the pockets of a drawing or a picture.

    The arguments are the same as in `optimize`, without `process`.
    """
    return optimize(source, output, process="pocket", **keywords)


def part(source: Input, output: str | Path | None = None, **keywords: Unpack[PartKeywords]) -> ProgramResult:
    """Create a verified program that mills the outlines and openings of a drawing through a plate, with tabs.

    The arguments are the same as in `optimize`, without `process`.
    """
    return optimize(source, output, process="part", **keywords)


def reorder(
    source: Input, output: str | Path | None = None, *, process: str = "auto", **keywords: Unpack[ReorderKeywords]
) -> ProgramResult:
    """Reorder the work in a program from another CAM system, and verify that the new program does the same work.

    The arguments are the same as in `optimize`. `process` is ``drill``, ``mill``, ``laser``, ``plasma`` or ``auto``.
    """
    return optimize(source, output, process="reorder" if process == "auto" else process, **keywords)


def _toml_file_names(*names: str | None) -> list[str]:
    return [name for name in names if name and name.lower().endswith(".toml")]


def _file_names(*sources: Input | None) -> list[str]:
    return [str(source) for source in sources if source is not None and not isinstance(source, StandardInput)]


def _list_sources(source: Input | Sequence[Input]) -> list[Input]:
    sources = [source] if isinstance(source, Input) else [*source]
    if not sources:
        raise OptionError("no input given")
    return sources


def _guess_command(sources: Sequence[Input], settings: Settings) -> tuple[str, list[Input]]:
    """Choose the command for the inputs, and return it with the loaded inputs.

    The result "auto" stands for the usual command.
    """
    loaded = [read_once(source) for source in sources]
    return registry.guess_command([read_source_with_format(source) for source in loaded], settings), [*loaded]


def _collect_settings(
    process: str | Work,
    options: Mapping[str, Any],
    file: str | Path | None = None,
    defaults: str | Path | None = None,
) -> Settings:
    check_file_exists("--options", Path(file) if file else None)
    work = registry.process_of_command(process) if isinstance(process, str) else process
    group = work.options if work else None
    return collect_settings(options, Path(file) if file else None, Path(defaults) if defaults else None, group)


def _settings_for_work(
    work: str,
    options: Mapping[str, Any],
    file: str | Path | None = None,
    defaults: str | Path | None = None,
    input_kind: str = "",
) -> Settings:
    command = registry.work(work)
    return settings_for(_collect_settings(command, options, file, defaults), command, input_kind)


def _with_process_defaults(settings: Settings, word: str) -> Settings:
    work = registry.drawing_process(word)
    return work.with_defaults(settings) if work else settings


def _is_csv(report: str | Path | None) -> bool:
    return str(report or "").lower().endswith(".csv")


def _run_process(run: Job, sources: Sequence[Input], process_word: str, *, table: bool) -> tuple[Process, Outcome[Any]]:
    """Run the process that suits the inputs, and return the process with its outcome.

    Raises
    ------
    OptionError
        The process does not use one of the options, or does not provide the requested table.
    """
    registry.check_process_value(process_word)
    inputs = [read_source_with_format(source) for source in sources]
    process = registry.process_for(inputs, process_word)
    if table and not process.tabulates:
        raise OptionError("--report: {} has no table of parts; give a name that ends in .html", process.title)
    settings = settings_for(run.settings, process, inputs[0][0].name)
    run = replace(run, settings=replace(settings, process=registry.needed_process_value(inputs, process_word, process)))
    outcome = run_process(process, run, [loaded for _, loaded in inputs], process_word)
    refuse_missing_work(run.settings, inputs[0][1], outcome.missing)
    return process, replace(outcome, defaults=run.settings.options_from_defaults())


@contextmanager
def _note_defaults_file(settings: Settings) -> Iterator[None]:
    try:
        yield
    except LeafcutError as problem:
        flags = {word.rstrip(".,:;") for word in str(problem).split()}
        from_defaults = [flag_name(name) for name in sorted(settings.defaults) if flag_name(name) in flags]
        if from_defaults:
            problem.add_note(
                f"{' and '.join(from_defaults)} may come from your defaults file; --no-defaults ignores it"
            )
        raise


@contextmanager
def _note_guessed_process(named: str, process: str) -> Iterator[None]:
    try:
        yield
    except (OptionError, PlanError) as problem:
        if named == "auto" != process:
            problem.add_note(f"leafcut {process} was chosen for this input; name another command if that is wrong")
        raise


def _report_text(outcome: Outcome[Any], file: str | Path) -> str:
    from leafcut.report.page import report_page_html

    report = registry.report_of(outcome)
    return report.cycle_time_csv() if _is_csv(file) else report_page_html(report)


def nest(
    parts: Sequence[str | Path | WantedDrawing],
    output: str | Path | None = None,
    *,
    options_file: str | Path | None = None,
    defaults_file: str | Path | None = None,
    progress: OnProgress | None = None,
    cancelled: threading.Event | None = None,
    **options: Unpack[NestKeywords],
) -> NestResult:
    """Nest parts on sheets in several variants, and write the sheets of the best variant as DXF drawings.

    `options_file`, `defaults_file`, `progress` and `cancelled` work as in `optimize`.

    Parameters
    ----------
    parts
        Drawings with quantities, such as ``"bracket.dxf:10"`` or a `leafcut.WantedDrawing`, or parts lists such as
        ``"parts.csv"``.
    output
        Drawing to write. If the sheets differ, they become ``sheet_1.dxf``, ``sheet_2.dxf`` … If it is omitted, the
        function writes no file. The result always contains the drawings.
    options
        Options by name: ``sheet="3000x1500", kerf=1.5, gap="5mm", variants=5``.

    Raises
    ------
    ReadError, OptionError, PlanError, VerifyError, OutputError
        The message is a single line that describes the problem, its location, and the remedy. No file was written.
    """
    from leafcut.results.nest import NestResult

    settings = _settings_for_work("nest", options, options_file, defaults_file)
    outcome, inputs = registry.command_function("nest")(
        parts, output, settings, other_inputs=[options_file, defaults_file], progress=progress, cancelled=cancelled
    )
    return as_public_result(
        NestResult, replace(outcome, defaults=settings.options_from_defaults()), [*inputs, *input_file_names(settings)]
    )


def read_part(source: Input, options: ReadOptions | None = None) -> Part:
    """Read a part from a file, or create it from a name such as ``example:plate-70`` or ``random:200:7``.

    All lengths in the part are in mm.

    Raises
    ------
    ReadError
        The file cannot be read or has no holes. With `options.strict`, the function also raises this error if the
        reader skipped or repaired anything.
    """
    return read(source, options)


def solve(
    source: Input | Part,
    *,
    defaults_file: str | Path | None = None,
    progress: OnProgress | None = None,
    observe: Observer | None = None,
    cancelled: threading.Event | None = None,
    **options: Unpack[SolveKeywords],
) -> TourResult:
    """Find a short closed tour through the points of a map.

    The length follows the distance rule of TSPLIB if the file states one. If the map has sets of points, the tour
    visits one point of each set and respects the given precedence. `progress`, `observe`, `cancelled` and `options`
    work as in `optimize`.

    Parameters
    ----------
    source
        A map of points, or a part from `read_part`.
    """
    from leafcut.results.tour import TourResult

    settings = _settings_for_work("solve", options, None, defaults_file)
    part = (
        source
        if isinstance(source, Part)
        else read(source, settings.read, heartbeat_for_step(progress, Message("reading")))
    )
    solved = Solved(part, _solve_part(part, settings, progress, observe, cancelled), settings.options_from_defaults())
    return as_public_result(TourResult, solved, [part.source or None, defaults_file, *input_file_names(settings)])


def _solve_part(
    part: Part,
    settings: Settings,
    progress: OnProgress | None,
    observe: Observer | None,
    cancelled: threading.Event | None,
) -> Solution:
    from leafcut.order import solve
    from leafcut.order.maps import check_forbidden_edges, problem_from_map

    problem = problem_from_map(part)
    step = Message("solving {}", part.name)
    heartbeat_for_step(progress, step)  # report the step at once: the search reports only between its steps
    on_progress = progress_for_step(progress, step)
    with announced_compilations(lambda message: progress(Progress(message)) if progress else None):
        solution = solve.solve(
            problem,
            settings.solve,
            settings.aco,
            firefly=settings.firefly,
            progress=on_progress,
            observe=observe,
            cancelled=cancelled,
        )
    check_forbidden_edges(part, solution.nodes)
    return solution


def simulate(
    program: Input,
    *,
    dialect: str | None = None,
    defaults_file: str | Path | None = None,
    progress: OnProgress | None = None,
    **options: Unpack[SimulateKeywords],
) -> SimulationResult:
    """Simulate a program on a machine.

    The result contains the machine time by kind of motion, the path, and the dangerous moves of the program.
    `defaults_file` and `progress` work as in `optimize`.

    Parameters
    ----------
    program
        A G-code program.
    dialect
        Dialect of the program: a name or a TOML file. It defaults to the dialect of the machine.
    options
        Options by name: ``machine="grbl-3018", units="in"``.
    """
    from leafcut.results.simulation import SimulationResult

    settings = _settings_for_work("simulate", options, None, defaults_file)
    outcome = registry.command_function("simulate")(program, settings, dialect, progress)
    return as_public_result(
        SimulationResult,
        outcome,
        [*_file_names(program), *_toml_file_names(dialect), defaults_file, *input_file_names(settings)],
    )


def check_times(
    measured: Sequence[tuple[str | Path, float]],
    machine: str,
    *,
    dialect: str | None = None,
    units: Literal["mm", "in"] | None = None,
    progress: OnProgress | None = None,
) -> tuple[MachineFit, list[SimulationResult]]:
    """Compare simulated with measured times of programs, s, and fit the machine to the measured times.

    Returns
    -------
    MachineFit
        The fit; see `leafcut.timing.fitting`.
    list of SimulationResult
        The simulation of each program before the fit.

    Raises
    ------
    ReadError, OptionError
        A program cannot be read, or `measured` is empty.
    """
    from leafcut.timing.fitting import MeasuredProgram, fit_machine

    if not measured:
        raise OptionError("no program was measured; add a time to each program")
    keywords: SimulateKeywords = {"machine": machine}
    if units:
        keywords["units"] = units
    simulations = [simulate(str(path), dialect=dialect, progress=progress, **keywords) for path, _ in measured]
    programs = [
        MeasuredProgram(simulation.program, simulation.run, seconds)
        for simulation, (_, seconds) in zip(simulations, measured, strict=True)
    ]
    return fit_machine(programs, simulations[0].machine), simulations


def stock(
    program: Input,
    *,
    same_as: Input | None = None,
    dialect: str | None = None,
    defaults_file: str | Path | None = None,
    progress: OnProgress | None = None,
    **options: Unpack[StockKeywords],
) -> StockResult:
    """Simulate how a program removes material from the stock.

    The result contains the material that each tool removes, the remaining stock, and rapids through material.
    `defaults_file` and `progress` work as in `optimize`.

    Parameters
    ----------
    program, dialect
        As in `simulate`.
    same_as
        Another program to compare with. The result lists the positions where the two programs leave different stock.
    options
        Options by name: ``workpiece="0,0,-10,80,60,0", tools="shop.toml"``.
    """
    from leafcut.results.stock import StockResult

    settings = _settings_for_work("stock", options, None, defaults_file)
    outcome = registry.command_function("stock")(program, settings, dialect, progress, same_as=same_as)
    inputs = [*_file_names(program, same_as), *_toml_file_names(dialect), defaults_file, *input_file_names(settings)]
    return as_public_result(StockResult, outcome, inputs)


def tool_speeds(
    drawing: Input | None = None,
    *,
    objective: str = "cost",
    save: str | Path | None = None,
    plot: str | Path | None = None,
    defaults_file: str | Path | None = None,
    progress: OnProgress | None = None,
    **options: Unpack[ToolSpeedsKeywords],
) -> ToolSpeedsResult:
    """Find the Pareto-optimal spindle speeds and feeds of tools. The criteria are time, cost and tool life.

    `defaults_file` and `progress` work as in `optimize`.

    Parameters
    ----------
    drawing
        Drawing with the holes to drill. If it is omitted, the result applies to one hole, or to 1 m of cut with an end
        mill.
    objective
        Criterion for choosing a point on each front: ``time`` or ``cost`` of a part, or ``life`` of the tool.
    save
        Tool library to write with the chosen speeds and feeds. It is either a copy of the given library or a new
        library.
    plot
        Picture of the fronts to write (SVG).
    options
        Options by name: ``material="c45", tools="shop.toml", depth=10``.

    Raises
    ------
    ReadError, OptionError, PlanError, OutputError
        The message is a single line that describes the problem, its location, and the remedy. No file was written.
    """
    from leafcut.report.front_chart import check_plot_extension, front_svg
    from leafcut.results.tool_speeds import ToolSpeedsResult

    settings = _settings_for_work(
        "cutting-data", options, None, defaults_file, "drawing" if drawing is not None else "none"
    )
    inputs = [*_file_names(drawing), defaults_file, *input_file_names(settings)]
    check_plot_extension(plot)
    check_output(plot, [*inputs, save])
    check_output(save, inputs)
    outcome = registry.command_function("cutting_data")(drawing, settings, objective, progress)
    texts = {str(plot): front_svg(outcome)} if plot else {}
    if save:
        texts[str(save)] = registry.command_function("cutting_data_library")(outcome, settings, save)
    write_all_or_none(texts)
    return as_public_result(ToolSpeedsResult, outcome, inputs)


def verify(
    original: Input,
    new: Input,
    *,
    dialect: str | None = None,
    defaults_file: str | Path | None = None,
    allow_reverse: bool = False,
    progress: OnProgress | None = None,
    **options: Unpack[VerifyKeywords],
) -> VerificationResult:
    """Check whether two programs do the same work, and return the proof or the differences.

    `defaults_file` and `progress` work as in `optimize`.

    Parameters
    ----------
    original, new
        G-code programs.
    dialect
        Dialect of both programs: a name or a TOML file. It defaults to the dialect of the machine.
    allow_reverse
        Accept open cuts of constant depth that run in the opposite direction.
    """
    from leafcut.results.verification import VerificationResult

    settings = _settings_for_work("verify", options, None, defaults_file)
    proof = registry.command_function("verify")(original, new, settings, dialect, progress, allow_reverse=allow_reverse)
    inputs = [*_file_names(original, new), *_toml_file_names(dialect), defaults_file, *input_file_names(settings)]
    return as_public_result(VerificationResult, proof, inputs)


def output_name(
    source: str | Path,
    process: str = "auto",
    options_file: str | Path | None = None,
    defaults_file: str | Path | None = None,
    **options: Any,
) -> str:
    """Return the file name of the program for an input. `program_for` returns the same name."""
    return program_for(source, process, options_file, defaults_file, **options)[0]


def program_for(
    source: Input,
    process: str = "auto",
    options_file: str | Path | None = None,
    defaults_file: str | Path | None = None,
    **options: Any,
) -> tuple[str, str]:
    """Return the file name of the program for an input, and the command that writes this program.

    For a program from another CAM system, the file keeps the name of the input, and the command is "reorder". For a
    drawing, the file extension depends on the dialect that `optimize` would use.

    Raises
    ------
    OptionError
        An option or the machine is invalid for every input.
    """
    settings = _collect_settings(process, options, options_file, defaults_file)
    if process == "auto" and Path(str(source)).is_file():
        process, _ = _guess_command([source], settings)
    settings = _with_process_defaults(settings, process)
    extension = program_extension(settings.post.dialect or machine_of(settings).controller)
    if detect_format_name(str(source)) == "gcode":
        return Path(str(source)).name, "reorder"
    name = Path(str(source).replace("example:", "").replace(":", "-")).stem + extension
    return name, "drill" if process == "auto" else process


def algorithms() -> dict[str, str]:
    """Return the algorithms that order the work. Each name maps to a title, or to the error of its plug-in."""
    from leafcut.order.algorithms import algorithm_titles

    return algorithm_titles()


def plugins() -> list[tuple[str, str]]:
    """List the plug-ins of installed packages. Each pair has the kind and name, and a description or an error."""
    from leafcut.gcode.dialects import DIALECTS
    from leafcut.order.packaged import PACKAGED as ALGORITHMS
    from leafcut.read.machine import MACHINES

    kinds = (READERS, registry.PACKAGED, ALGORITHMS, DIALECTS, MACHINES)
    return [(f"{kind.noun} {name}", words) for kind in kinds for name, words in kind.names_and_descriptions()]


def default_machine(work: str) -> str:
    """Return the default machine for a kind of work. If `work` is unknown, return the general default machine."""
    known = work in registry.process_names() or work in registry.OTHER_WORKS
    return (registry.work(work).with_defaults(Settings()) if known else Settings()).machine.machine


def dialect_of(options: Mapping[str, Any], process: str = "auto") -> str:
    """Return the dialect that `optimize` would use with these options, as a name or as the path of a file."""
    settings = _with_process_defaults(_collect_settings(process, options), process)
    return settings.post.dialect or machine_of(settings).controller


def program_extension(dialect_name: str) -> str:
    """Return the file extension for programs in a dialect, including the dot.

    `dialect_name` is the name of the dialect or the path of its file.
    """
    from leafcut.gcode.dialects import load_dialect

    return load_dialect(dialect_name).extension
