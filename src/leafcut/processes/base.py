"""What a process is: a kind of work that leafcut does, from the options that it uses to what it writes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from leafcut.errors import VerifyError
from leafcut.model.kinds import Head
from leafcut.options import (
    AcoOptions,
    CutDataOptions,
    FireflyOptions,
    JobOptions,
    PostOptions,
    Settings,
    SolveOptions,
)
from leafcut.options.condition import Conditions, absent
from leafcut.options.option_spec import OptionGroup

if TYPE_CHECKING:
    from leafcut.model.difference import Difference
    from leafcut.model.issue import Issue
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.part import Part
    from leafcut.model.plan import Candidate, Order
    from leafcut.model.toolpath import Toolpath
    from leafcut.processes.job import Job
    from leafcut.processes.plan import OrderRefused, Pass, Plan
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source
    from leafcut.report.path_report import PathReport

#: Groups of a form: the key of a title, and names of options.
FormGroups = tuple[tuple[str, tuple[str, ...]], ...]

#: Options that forms of several processes show, by the group that they stand in.
SEARCH = ("preset", "time_limit", "algorithm", "objective")
SEARCH_MORE = (
    "iterations",
    "target_gap",
    "bound",
    "seed",
    "threads",
    "candidates",
    "local_search",
)
PLACE = ("mirror", "rotate", "origin")
POST = ("dialect", "output_units", "line_numbers", "program_number", "header")


def all_of(group: type[OptionGroup], but: Iterable[str] = ()) -> tuple[str, ...]:
    """Return the options of a group, without some that stand elsewhere."""
    left_out = set(but)
    return tuple(name for name in group.specs() if name not in left_out)


def use(group: type[OptionGroup], *names: str, but: Iterable[str] = (), **needs: Conditions) -> dict[str, Conditions]:
    """Return options of a group, each with the conditions for its use.

    Parameters
    ----------
    names
        Those that are used, beside those of `needs`; all of the group where none is named.
    but
        Those that are not.
    needs
        Conditions that replace those of the option itself (`OptionSpec.needs`).
    """
    specs, left_out = group.specs(), set(but)
    chosen = (*names, *needs) if names or needs else tuple(specs)
    return {name: needs.get(name, specs[name].needs) for name in chosen if name not in left_out}


#: Options that several processes use: of what orders the work, of a program that is made from a drawing, and of the
#: cutting data that a program without speeds of its own is cut with.
ORDERED = use(SolveOptions) | use(AcoOptions) | use(FireflyOptions)
WRITTEN = use(PostOptions, *POST, "coolant")
_LOOKED_UP = (absent("cut_speed"),)
LOOKED_UP = use(CutDataOptions, "cut_speed")
LOOKED_UP |= use(CutDataOptions, cut_process=_LOOKED_UP, amps=_LOOKED_UP, nozzle=_LOOKED_UP, chart=_LOOKED_UP)
LOOKED_UP |= use(JobOptions, thickness=_LOOKED_UP, material=_LOOKED_UP)


class Work(Protocol):
    """A kind of work, as far as its options go.

    Attributes
    ----------
    name, title
        By which it is asked for, and as a message calls it: "drilling".
    options
        The groups of options that are its own; the first one's table in a file may hold all that it uses.
    uses
        The options of shared groups that it uses, each with the conditions for its use (`use`).
    otherwise
        What to do instead of giving an option that it does not use, where that is more than to leave it out.
    helps
        Help of options that mean something more special here: text, and default in words ("" for that of the option).
    """

    name: ClassVar[str]
    title: ClassVar[str]
    options: ClassVar[tuple[type[OptionGroup], ...]] = ()
    uses: ClassVar[Mapping[str, Conditions]] = {}
    otherwise: ClassVar[Mapping[str, str]] = {}
    helps: ClassVar[Mapping[str, tuple[str, str]]] = {}

    def used(self) -> Mapping[str, Conditions]:
        """Return all options that it uses, each with the conditions for its use."""
        return self.uses


class Process(Work, Protocol):
    """One kind of work. A class that inherits from it says what is its own; the rest is as most have it.

    Attributes
    ----------
    name
        By which formats say what they are for, too.
    asked_as
        What ``--process`` may say of its input to have it.
    reads
        ``drawing`` or ``program``: what its input is. "" for what is not asked for through `api.optimize`.
    formats
        The formats that it is offered for, of a process that they do not know: one from outside.
    by_itself
        Whether a file that is good for this alone is given to it without being asked.
    joins
        The format of which it makes one program of several files; "" where it does so of none.
    instead
        What ``--process`` may be mistaken for, and what to say then.
    command, help
        The command that does it alone, and what that does, in a line. It is what ``--process`` says to have it.
    takes
        What its input is, in words.
    asks
        What ``--process`` has to say where a file is good for several kinds of work.
    offered_with
        The kind of work with which a page offers this one, too.
    form
        The options that a form shows, the important ones first: (key of the title, names). The first two groups are
        open, the others folded.
    heads
        What a machine must work with to do it; empty where any will do.
    pictured
        How a small picture shows what it works: ``holes`` as dots, ``lines``, or ``areas`` filled.
    with_nearest
        Whether the outcome compares with the nearest-neighbour order.
    """

    asked_as: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[str] = ""
    formats: ClassVar[tuple[str, ...]] = ()
    by_itself: ClassVar[bool] = False
    joins: ClassVar[str] = ""
    instead: ClassVar[Mapping[str, str]] = {}
    command: ClassVar[str]
    help: ClassVar[str] = ""
    takes: ClassVar[str] = "a drawing"
    asks: ClassVar[str] = "auto"
    offered_with: ClassVar[str] = ""
    form: ClassVar[FormGroups] = ()
    heads: ClassVar[tuple[Head, ...]] = ()
    pictured: ClassVar[str] = "lines"
    with_nearest: ClassVar[bool] = True

    def used(self) -> Mapping[str, Conditions]:
        """Return the options that it uses, its own and of shared groups, each with the conditions for its use."""
        own = {name: spec.needs for group in self.options for name, spec in group.specs().items()}
        return own | dict(self.uses)

    def usual(self, settings: Settings) -> Settings:
        """Return the settings with what this process takes where nobody said anything: its usual machine."""
        return settings

    def machine_for(self, format_name: str) -> str:
        """Return the machine that is at hand for files of a format; "" where they need none of their own."""
        return ""

    def suits(self, drawing: WholeDrawing) -> Suitability | None:
        """Return how well a drawing suits it, from all that the drawing shows; None for no opinion."""
        return None

    # The course of a job (`processes.course`) calls these in the order in which they stand here.

    def plan(self, job: Job, sources: Sequence[Source], asked: str) -> Plan:
        """Read the files, resolve the options, and return the tasks; `asked` is the value of ``--process``.

        Raises
        ------
        ReadError, OptionError, PlanError
            One line: what is wrong, where, and what to do.
        """
        ...

    @property
    def passes(self) -> Sequence[Pass]:
        """Changes of a found order for what depends on neighbouring tasks."""
        return ()

    def given(self, plan: Plan) -> Candidate:
        """Return the motion in the order of the input."""
        return self.generate(plan, plan.given)

    def nearest(self, plan: Plan) -> Candidate | None:
        """Return the motion in the nearest-neighbour order; None to compare with none."""
        from leafcut.processes.ordering import nearest_order

        return self.generate(plan, nearest_order(plan.job, plan.stages)) if self.with_nearest else None

    def generate(self, plan: Plan, order: Order) -> Candidate:
        """Return the motion of an order.

        Raises
        ------
        PlanError
            The order does not do each task once.
        """
        ...

    def least(self, plan: Plan, best: Candidate, given: Candidate, nearest: Candidate | None) -> Candidate:
        """Return the candidate with the least time: the search does not see all that the machine's clock sees.

        An order that the user asks for stays: that of the drawing, the nearest neighbour's, or one of the plan.
        """
        from leafcut.processes.ordering import restated

        solve = plan.job.settings.solve
        if plan.keeps_given or not plan.unforced or solve.algorithm in ("nn", "none"):
            return best
        other = min([given] if nearest is None else [given, nearest], key=lambda one: one.cost(solve.objective))
        if other.cost(solve.objective) >= best.cost(solve.objective):
            return best
        order = replace(best.order, choices=other.order.choices)
        return replace(other, order=replace(order, solutions=tuple(restated(plan.job, plan.stages, order))))

    def prove(self, plan: Plan, given: Candidate, best: Candidate) -> Candidate:
        """Write the program, read it back, and judge it; return the candidate with its program.

        Raises
        ------
        VerifyError
            The first difference or danger, and their number.
        OrderRefused
            Another order may pass.
        """
        from leafcut.processes.job import refuse

        text = self.write(plan, given, best)
        plan.job.tell("verifying")
        written, problems = self.judge(plan, best, text)
        refuse(problems)
        return replace(best, text=text, written=written)

    def write(self, plan: Plan, given: Candidate, best: Candidate) -> str:
        """Return the program of a candidate; its header compares it with the order of the input."""
        from leafcut.post.writer import write_program
        from leafcut.processes.plan import header, tool_names

        return write_program(
            best.path,
            plan.words,
            plan.job.settings.post,
            header(plan, given, best),
            tool_names=tool_names(plan),
            rapid_velocity=max(plan.job.machine.rapid_velocity),
            preselect_tool=plan.job.machine.preselect_tool,
        )

    def judge(self, plan: Plan, best: Candidate, text: str) -> tuple[Toolpath, list[Difference]]:
        """Return the program read back, and what is wrong with it."""
        raise NotImplementedError

    def keep(self, plan: Plan, order: Order, refused: OrderRefused, trial: int) -> Order:
        """Return the order with faulty tasks in their place in the input; the trials count from 1."""
        raise VerifyError(f"the program was not written: {refused}")

    def finish(self, plan: Plan, best: Candidate) -> Candidate:
        """Return the proved program with changes that do not change its order."""
        return best

    def operations(self, plan: Plan, best: Candidate) -> tuple[OperationOutcome, ...]:
        """Return the work of each tool with its order."""
        ...

    def issues(self, plan: Plan, best: Candidate) -> Sequence[Issue]:
        """Return what is noticed in the order; the plan's issues are reported anyway."""
        return ()

    def detail(self, plan: Plan, given: Candidate, nearest: Candidate | None, best: Candidate) -> Any:
        """Return the part of the outcome that this process alone has."""
        ...

    def writes_besides(self, settings: Settings) -> list[Path]:
        """Return the files that it writes beside the program."""
        return []

    def files(self, outcome: Outcome[Any], settings: Settings) -> dict[str, str]:
        """Return the files that it writes beside the program: name → text."""
        return {}

    def report(self, outcome: Outcome[Any]) -> PathReport[Any]:
        """Return the facts and pictures of an outcome; by default those of a path over holes."""
        from leafcut.report.path_report import PathReport

        return PathReport(outcome)

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Return what is read of an input, as it lies before the work is planned: what a preview shows."""
        ...
