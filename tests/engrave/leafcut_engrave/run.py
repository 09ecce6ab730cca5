"""A drawing in, an engraving program out: read, plan, solve, lay, post, prove."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from leafcut import __version__
from leafcut.errors import PlanError
from leafcut.gcode.dialects import dialect
from leafcut.model.kinds import Head
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.tool import Tool, ToolKind
from leafcut.options import SolveOptions
from leafcut.order.compiling import announced
from leafcut.order.solve import solve
from leafcut.post.header import header_lines
from leafcut.post.writer import write_program
from leafcut.processes.course import Run, check_words_used, machine_issues, refuse
from leafcut.processes.placing import placed
from leafcut.proof.envelope import check_envelope
from leafcut.proof.program import check_program, read_back
from leafcut.read import read_contours
from leafcut.read.format import Source
from leafcut.timing.toolpath import measure
from leafcut.timing.travel import travel_metric
from leafcut_engrave.model import EngravingDetail
from leafcut_engrave.options import EngraveOptions
from leafcut_engrave.plan import lay, problem_of
from leafcut_engrave.proof import check_lines

#: How deep lines are engraved where nobody says it, and how near curves are followed, mm.
DEPTH, TOLERANCE = 0.2, 0.005


def engrave(run: Run, source: Source) -> Outcome[EngravingDetail]:
    """Return the verified program that engraves the lines of a drawing."""
    settings, machine = run.settings, run.machine
    if machine.head is not Head.SPINDLE:
        raise PlanError(f"{machine.name} has a {machine.head}, which cannot engrave; give another --machine")
    options, job, depth = settings.of(EngraveOptions), settings.job, settings.job.depth or DEPTH
    part = placed(read_contours(source, settings.read, run.looking("reading")), settings.read)
    lines = [contour.path.flattened(TOLERANCE) for contour in part.contours]
    problem = problem_of(lines, travel_metric(machine, settings.solve.objective), job)
    words = dialect(settings.post.dialect or machine.controller)
    check_words_used(settings, machine, words)
    laid = partial(
        lay, lines, machine=machine, job=job, options=options, depth=depth, coolant=settings.post.coolant
    )  # fmt: skip
    drawn = laid(range(0, 2 * len(lines), 2))
    refuse(check_envelope(drawn, machine))
    with announced(run.tell):
        order = partial(solve, problem, firefly=settings.firefly, cancelled=run.cancelled)
        found = order(
            settings.solve, settings.aco, progress=run.passing_on("ordering lines"), observe=run.observe
        )  # fmt: skip
        nearest = order(SolveOptions(algorithm="nn", bound=False), settings.aco)
    path = laid(found.nodes.tolist())
    measures = [measure(p, machine, start=problem.start) for p in (drawn, laid(nearest.nodes.tolist()), path)]
    tool = Tool(options.engraver, 0.1, ToolKind.END_MILL, feed=options.engraving_feed,
                spindle_rpm=options.engraving_speed)  # fmt: skip
    header = header_lines(
        source=Path(part.source or part.name).name, version=__version__, machine=machine, tools=[tool], path=path,
        seconds=(measures[0].time_s, measures[2].time_s), seed=settings.solve.seed, options=settings.changed(),
        units=settings.post.output_units,
    )  # fmt: skip
    text = write_program(path, words, settings.post, header)
    written = read_back(text, words)
    refuse(check_program(path, written, words, machine, settings.post.output_units))
    refuse(check_lines(written, lines, depth, 2.0 * TOLERANCE))
    return Outcome(
        part=part, machine=machine, process="engrave",
        operations=(OperationOutcome(tool, "engrave", (), False, found),),
        before=measures[0], nearest=measures[1], after=measures[2], path_before=drawn, path_after=path, text=text,
        dialect=words.name, seed=settings.solve.seed, verified=True, written=written,
        issues=(*part.issues, *machine_issues(machine)), options=settings.changed(), version=__version__,
        detail=EngravingDetail(len(lines), depth),
    )  # fmt: skip
