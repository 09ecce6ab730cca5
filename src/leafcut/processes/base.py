"""The base classes of all work. A `Work` has options, and a `Process` is a `Work` that also generates programs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from leafcut.errors import VerifyError
from leafcut.message import Message
from leafcut.model.kinds import Head
from leafcut.options import (
    AcoOptions,
    CutDataOptions,
    FireflyOptions,
    JobOptions,
    PostOptions,
    QuoteOptions,
    Settings,
    SolveOptions,
)
from leafcut.options.option_spec import Conditions, OptionGroup, when_absent

if TYPE_CHECKING:
    from leafcut.model.difference import Difference
    from leafcut.model.issue import Issue
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.part import Part
    from leafcut.model.plan import Candidate, Order
    from leafcut.model.quote import RunCost
    from leafcut.model.toolpath import Toolpath
    from leafcut.processes.job import Job
    from leafcut.processes.plan import OrderRefused, Pass, Plan
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source
    from leafcut.report.path_report import PathReport

#: Groups of a form in the studio. Each group has the key of its title and the names of its options.
FormGroups = tuple[tuple[str, tuple[str, ...]], ...]

#: Options that appear in the forms of several processes, by group.
SEARCH = ("preset", "time_limit", "algorithm", "objective")
SEARCH_MORE = (
    "iterations",
    "bound",
    "seed",
    "threads",
    "candidates",
    "local_search",
)
PLACE = ("mirror", "rotate", "origin")
POST = ("dialect", "output_units", "line_numbers", "program_number", "header")


def option_names(group: type[OptionGroup], but: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the names of all options of a group, except the names in `but`."""
    left_out = set(but)
    return tuple(name for name in group.specs() if name not in left_out)


def use(group: type[OptionGroup], *names: str, but: Iterable[str] = (), **needs: Conditions) -> dict[str, Conditions]:
    """Return the options of a group that a type of work uses. Each option comes with the conditions for its use.

    Parameters
    ----------
    names
        Options to use in addition to the keys of `needs`. Without `names` and `needs`, the whole group is used.
    but
        Options to leave out.
    needs
        Conditions that replace the usual conditions of an option (`OptionSpec.needs`).
    """
    specs, left_out = group.specs(), set(but)
    chosen = (*names, *needs) if names or needs else tuple(specs)
    return {name: needs.get(name, specs[name].needs) for name in chosen if name not in left_out}


#: Options that several processes share: for the search, for programs from drawings, and for cutting data that a program
#: lacks.
ORDERED = use(SolveOptions) | use(AcoOptions) | use(FireflyOptions)
WRITTEN = use(PostOptions, *POST, "coolant")
_LOOKED_UP = (when_absent("cut_speed"),)
LOOKED_UP = use(CutDataOptions, "cut_speed")
LOOKED_UP |= use(CutDataOptions, cut_process=_LOOKED_UP, amps=_LOOKED_UP, nozzle=_LOOKED_UP, chart=_LOOKED_UP)
LOOKED_UP |= use(JobOptions, thickness=_LOOKED_UP, material=_LOOKED_UP)

#: Help texts and defaults of options that mean something special for programs from other CAM systems.
HELP_OF_CUTTING_DATA = {
    "thickness": ("thickness of the sheet, for cutting data that the program does not state", "unknown"),
    "material": ("material of the sheet, by its name in the cut chart", ""),
}
HELP_OF_PROGRAM = {
    "tools": ("", "the tools that the program describes"),
    "tool_diameter": ("diameter of the flat mills that the program does not describe", "unknown"),
    "z_zero": (
        "Z0 of the program on the solid of --workpiece after it is turned: the highest point, the lowest "
        "point, or the solid's own Z0 (drawn)",
        "drawn",
    ),
}


class Work(Protocol):
    """A type of work, with its name and its options.

    Attributes
    ----------
    name, title
        Name in commands, and name in messages, such as "drilling".
    options
        Groups of options that only this work has. In a file of options, the table of the first group accepts all
        options that the work uses.
    uses
        Shared options that the work uses, with their conditions (`use`).
    otherwise
        Advice for options that the work does not use. It replaces "leave it out".
    helps
        Options with a special meaning in this work. Each has a help text, and its default in words ("" for the usual
        default).
    command, help
        Name of the command, and a one-line help text. The command of a process is also a value of ``--process``.
    form
        Groups of options in the form, with the most important group first: (key of the title, names of options). The
        first two groups are open.
    heads
        Machine heads that can do the work; empty if any head can.
    pictured
        Style of thumbnails: ``holes`` as dots, ``lines``, or filled ``areas``.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    options: ClassVar[tuple[type[OptionGroup], ...]] = ()
    uses: ClassVar[Mapping[str, Conditions]] = {}
    otherwise: ClassVar[Mapping[str, str]] = {}
    helps: ClassVar[Mapping[str, tuple[str, str]]] = {}
    command: ClassVar[str]
    help: ClassVar[str] = ""
    form: ClassVar[FormGroups] = ()
    heads: ClassVar[tuple[Head, ...]] = ()
    pictured: ClassVar[str] = "lines"

    @property
    def asks(self) -> str:
        """The value of ``--process`` that selects this work if a file suits several processes."""
        return "auto"

    def used(self) -> Mapping[str, Conditions]:
        """Return all options that the work uses, with their conditions. This includes its own and shared options."""
        own_options = {name: spec.needs for group in self.options for name, spec in group.specs().items()}
        return own_options | dict(self.uses)

    def with_defaults(self, settings: Settings) -> Settings:
        """Return the settings, completed with the defaults of this work.

        For example, a work may have a usual machine.
        """
        return settings

    def usual_machine(self, format_name: str) -> str:
        """Return the usual machine for files of a format. If the default machine is right for them, return ""."""
        return ""

    def rate_drawing(self, drawing: WholeDrawing) -> Suitability | None:
        """Rate how well a drawing suits this work. Return None if the work does not rate drawings."""
        return None

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        """Return the geometry of an input for a preview. By default, this is its holes."""
        from leafcut.read import read

        return read(source, settings.read)


class Process(Work, Protocol):
    """A type of work that generates programs. The default methods suit most processes.

    Attributes
    ----------
    name
        Name of the process, to which file formats refer.
    reads
        Type of input: ``drawing`` or ``program``. If `api.optimize` does not run the process, it is "".
    formats
        File formats for which a plug-in is offered.
    by_itself
        Whether the process is chosen automatically for a file that suits no other process.
    joins
        File format for which several files may be joined to one program, or "" for none.
    instead
        Advice for wrong values of ``--process``.
    takes
        Description of the input.
    layer_names
        Patterns of layer names that suggest work for this process.
    tabulates
        Whether a report may be a table of the parts (CSV).
    with_nearest
        Whether the outcome is compared with the nearest-neighbour order.
    quoted_with
        Options that a quote for a customer needs in addition to those of every process. Empty if the process has no
        quotes.
    """

    reads: ClassVar[str] = ""
    formats: ClassVar[tuple[str, ...]] = ()
    by_itself: ClassVar[bool] = False
    joins: ClassVar[str] = ""
    instead: ClassVar[Mapping[str, str]] = {}
    takes: ClassVar[str] = "a drawing"
    layer_names: ClassVar[tuple[str, ...]] = ()
    tabulates: ClassVar[bool] = False
    with_nearest: ClassVar[bool] = True
    quoted_with: ClassVar[tuple[str, ...]] = ()

    @property
    def process_values(self) -> tuple[str, ...]:
        """The values of ``--process`` that select the process."""
        return (self.command,)

    @property
    def asks(self) -> str:
        """The value of ``--process`` that selects this process if a file suits several.

        It is ``auto`` for the usual process.
        """
        return self.command

    # The course of a job (`processes.course`) calls these methods in this order.

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Read the files, resolve the options, and return the tasks. `asked` is the value of ``--process``.

        Raises
        ------
        ReadError, OptionError, PlanError
            The message is a single line that names the error, its position and the remedy.
        """
        ...

    @property
    def order_passes(self) -> Sequence[Pass]:
        """The passes that improve the order after the search.

        They deal with costs that depend on neighbouring tasks.
        """
        return ()

    def generate_input_order(self, plan: Plan) -> Candidate:
        """Return the motion in the order of the input."""
        return self.generate(plan, plan.input_order)

    def generate_nearest_order(self, plan: Plan) -> Candidate | None:
        """Return the motion in the nearest-neighbour order.

        Return None if the process does not compare with this order.
        """
        from leafcut.processes.ordering import nearest_order

        return self.generate(plan, nearest_order(plan.job, plan.stages)) if self.with_nearest else None

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Generate the motion of an order and compute its time.

        Raises
        ------
        PlanError
            If the order does not contain each task exactly once.
        """
        ...

    def fastest(self, plan: Plan, best: Candidate, given: Candidate, nearest: Candidate | None) -> Candidate:
        """Return the candidate with the lowest cost for the objective, according to the detailed machine model.

        The order stays the same if the user set it, or if it comes from the algorithms nn or none.
        """
        from leafcut.processes.ordering import solutions_of_order

        solve = plan.job.settings.solve
        if plan.keeps_given or not plan.may_fall_back or solve.algorithm in ("nn", "none"):
            return best
        reference = min(
            [given] if nearest is None else [given, nearest], key=lambda candidate: candidate.cost(solve.objective)
        )
        if reference.cost(solve.objective) >= best.cost(solve.objective):
            return best
        order = replace(best.order, choices=reference.order.choices)
        return replace(
            reference, order=replace(order, solutions=tuple(solutions_of_order(plan.job, plan.stages, order)))
        )

    def write_and_verify(self, plan: Plan, given: Candidate, best: Candidate) -> Candidate:
        """Write the program of a candidate, read it back and verify it. Return the candidate with its program.

        Raises
        ------
        VerifyError
            If verification failed. The message names the first difference or danger, and states how many more there
            are.
        OrderRefused
            If verification failed, but another order may pass.
        """
        from leafcut.processes.job import refuse_differences

        text = self.write(plan, given, best)
        plan.job.report(Message("verifying"))
        written, problems = self.judge(plan, best, text)
        refuse_differences(problems)
        return replace(best, text=text, written=written)

    def write(self, plan: Plan, given: Candidate, best: Candidate) -> str:
        """Write the program of a candidate. The header compares its time with the time of the input's order."""
        from leafcut.post.writer import write_program
        from leafcut.processes.header import header_lines

        return write_program(
            best.path,
            plan.dialect,
            plan.job.settings.post,
            [*header_lines(plan, given, best, self.command), *self.header_notes(plan, best)],
            tool_names={tool.number: tool.label.split(" ", 1)[1] for tool in plan.tools},
            rapid_velocity=max(plan.job.machine.rapid_velocity),
            preselect_tool=plan.job.machine.preselect_tool,
        )

    def header_notes(self, plan: Plan, best: Candidate) -> Sequence[str]:
        """Return additional lines for the header of the program."""
        return ()

    def judge(self, plan: Plan, best: Candidate, text: str) -> tuple[Toolpath, list[Difference]]:
        """Read the program back. Return the toolpath, and the differences between the program and the request."""
        raise NotImplementedError

    def keep_in_place(self, plan: Plan, order: Order, refused: OrderRefused, trial: int) -> Order:
        """Return an order that leaves the refused tasks at their position in the input. `trial` counts from 1.

        Raises VerifyError if no such order exists. By default, there is none.
        """
        raise VerifyError("the program was not written: {}", refused)

    def finish(self, plan: Plan, best: Candidate) -> Candidate:
        """Make final changes to the verified program. The order of the program stays the same."""
        return best

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return the work of each tool, in program order."""
        ...

    def issues(self, plan: Plan, best: Candidate) -> Sequence[Issue]:
        """Return issues about the order. The issues of the plan are not included."""
        return ()

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> Any:
        """Return the results that only this process has."""
        ...

    def run_cost(self, plan: Plan, best: Candidate) -> RunCost:
        """Return the time and the cost of a run of the program with its parts, for a quote.

        Raises PlanError if the program makes no parts.
        """
        raise NotImplementedError

    def is_quoted(self, settings: Settings) -> bool:
        """Return whether the process has quotes, and the user asked for one."""
        return bool(self.quoted_with) and settings.of(QuoteOptions).quote is not None

    def extra_output_paths(self, settings: Settings) -> list[Path]:
        """Return the paths of all files that the process writes in addition to the program."""
        quote = settings.of(QuoteOptions).quote if self.quoted_with else None
        return [quote] if quote else []

    def extra_files(self, outcome: Outcome[Any], settings: Settings) -> dict[str, str]:
        """Return the texts of the files to write in addition to the program, keyed by file name."""
        if outcome.quote is None:
            return {}
        from leafcut.report.quote_page import quote_page_html

        return {str(settings.of(QuoteOptions).quote): quote_page_html(outcome.quote)}

    def report(self, outcome: Outcome[Any]) -> PathReport[Any]:
        """Return the report of an outcome, with its facts and pictures. The default report shows a path over holes."""
        from leafcut.report.path_report import PathReport

        return PathReport(outcome)

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        """Return the placed geometry of an input for a preview. By default, return its holes."""
        from leafcut.processes.placing import place_part

        return place_part(super().preview_part(source, settings), settings.read)
