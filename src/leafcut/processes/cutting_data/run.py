"""Choose speeds and feeds for a part and build the Pareto front.

The choice depends on the work of each tool and on the speeds of the machine.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from leafcut.errors import OptionError, PlanError, name_suggestion
from leafcut.geometry.arrays import Floats, Indices, Mask
from leafcut.material.cutting_force import DRIVE_EFFICIENCY
from leafcut.message import Message
from leafcut.model.cutting_front import OBJECTIVES, CuttingData, CuttingPoint, ToolFront
from leafcut.model.heartbeat import OnProgress
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import CuttingWork, Head, ToolMaterial
from leafcut.model.machine import Machine
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Kind
from leafcut.model.work_material import WorkMaterial
from leafcut.options import Settings
from leafcut.options.cutting import SpeedOptions
from leafcut.order.stop import Deadline
from leafcut.processes import registry
from leafcut.processes.course import run_process
from leafcut.processes.cutting_data.economics import CuttingResults, Prices, ToolWork, cutting_results, index_of_best
from leafcut.processes.job import Job, library_of, machine_of
from leafcut.read import Input
from leafcut.read.registry import read_source_with_format
from leafcut.read.work_materials import load_material
from leafcut.units import SECONDS_PER_MINUTE, format_time

#: Minimum chip thickness as a share of the maximum. If the chip is thinner, the tool rubs more than it cuts (estimate).
_LEAST_CHIP = 0.25
#: Chip thickness for mills of high-speed steel, as a share of the chip thickness for carbide mills in catalogues. Mills
#: of high-speed steel bend and break sooner (estimate).
_HSS_MILL_CHIP = 0.5
_SECONDS_PER_HOUR = 3600.0
#: Default cost of the machine and its operator per hour, in any currency.
_SHOP_RATE = 60.0
#: Default cost of a worn tool if the library states no `life_cost`, in the same currency (estimate).
_TOOL_COST = 10.0
#: Time to get from one hole to the next if there is no drawing, including retract and approach, s (estimate).
_MOVE = 1.5
#: Length of cut of an end mill, mm. The best speeds and feeds do not depend on it.
_CUT_LENGTH = 1000.0
#: Time to replace a worn tool and to set its length, s (estimate).
_WORN_CHANGE = 120.0
#: Longest tool life that is assumed, s. A tool is replaced after half a shift.
_MAX_LIFE = 14_400.0
#: Minimum tool life, seconds in the cut. A tool with a shorter life would be changed too often.
_LEAST_LIFE = 300.0
#: Steps of the spindle speed, 1/min, and of the feed rate, mm/s. They are finer than in any chart of cutting data.
_RPM_STEP, _FEED_STEP = 10.0, 5.0 / 60.0
#: Default depth of cut of a mill, in diameters.
_DEPTH = 0.5
#: Number of combinations in a batch, maximum total number of combinations, and maximum number of speeds.
_BATCH_SIZE, _MAX_CANDIDATES, _MAX_SPEEDS = 200_000, 20_000_000, 1_000_000
#: Rounding tolerance of the grid of speeds and feeds.
_ROUNDING_TOLERANCE = 1e-9


def cutting_data(
    drawing: Input | None, settings: Settings, objective: str, progress: OnProgress | None = None
) -> CuttingData:
    """Choose the Pareto-optimal speeds and feeds for the tools of a part, and the best of them for an objective.

    Raises
    ------
    ReadError
        If the drawing cannot be read.
    OptionError
        If the material is missing or unknown.
    PlanError
        If no tool has a known tool life in the material, or if a limit excludes all speeds and feeds.
    """
    if objective not in OBJECTIVES:
        raise OptionError(f"--objective: unknown value '{objective}'{name_suggestion(objective, OBJECTIVES)}")
    if "material" not in settings.given:
        raise OptionError("the material is missing; name it with --material ('leafcut list materials' shows all names)")
    options = settings.of(SpeedOptions)
    machine = machine_of(settings)
    if machine.head is not Head.SPINDLE:
        raise OptionError(f"--machine {machine.name}: has no spindle; speeds and feeds are for drills and mills")
    material = load_material(settings.job.material)
    issues: list[Issue] = []
    works = list(_plan_tool_works(drawing, settings, machine, material, issues, progress))
    if not works:
        reasons = Message.joined("; ", (issue.message for issue in issues[:3]))
        raise PlanError(f"no tool remains to choose speeds for{f': {reasons}' if reasons else ''}")
    fronts = _tool_fronts(works, settings, machine, material, objective, issues)
    return CuttingData(
        source="" if drawing is None else str(drawing),
        machine=machine,
        material=material,
        objective=objective,
        shop_rate=_shop_rate(options),
        tools=tuple(fronts),
        issues=tuple(issues),
        defaults=settings.options_from_defaults(),
    )


def _tool_fronts(
    works: list[tuple[ToolWork, ToolMaterial]],
    settings: Settings,
    machine: Machine,
    material: WorkMaterial,
    objective: str,
    issues: list[Issue],
) -> list[ToolFront]:
    """Return the Pareto fronts of all tools. If a tool has no front, an issue is added.

    Raises PlanError if no tool has a front.
    """
    fronts: list[ToolFront] = []
    refused: list[PlanError] = []
    for work, kind in works:
        try:
            _check_tool_life_known(work.tool, kind, work.work, material)
            _check_flutes_and_teeth(work)
            fronts.append(_tool_front(work, settings, machine, material, objective, kind))
        except PlanError as problem:
            refused.append(problem)
    if not fronts:
        raise refused[0]
    issues += [
        Issue("L440", Message("no speeds were chosen: {}", problem), severity=Severity.WARNING) for problem in refused
    ]
    return fronts


def _plan_tool_works(
    drawing: Input | None,
    settings: Settings,
    machine: Machine,
    material: WorkMaterial,
    issues: list[Issue],
    progress: OnProgress | None,
) -> Iterator[tuple[ToolWork, ToolMaterial]]:
    """Yield the work of each tool, and the material of the tool.

    If no speeds can be chosen for a tool, an issue is added instead.
    """
    options = settings.of(SpeedOptions)
    if drawing is None:
        tool_works = list(_tool_works_from_options(settings, machine))
    else:
        tool_works = tool_works_from_drawing(drawing, settings, machine, issues, progress)
    left_out: list[str] = []
    for tool, holes, fed, cut, idle in tool_works:
        kind = tool.material or ToolMaterial(options.tool_material)
        if tool.kind is ToolKind.DRILL and holes:
            lives = material.lives_of(CuttingWork.DRILL, kind)
            yield ToolWork(tool, CuttingWork.DRILL, lives, fed, cut, idle, cut / holes, holes=holes), kind
        elif tool.kind is ToolKind.END_MILL and drawing is None:
            yield _milling_work(tool, settings, material, kind), kind
        else:
            left_out.append(f"T{tool.number}")
    if left_out:
        names = ", ".join(left_out)
        message = Message("no speeds were chosen for {}: leafcut knows speeds only for drills and end mills", names)
        issues.append(Issue("L440", message, severity=Severity.NOTE))


def _check_tool_life_known(tool: Tool, kind: ToolMaterial, work: CuttingWork, material: WorkMaterial) -> None:
    """Raise PlanError if a tool has no tool life equation. The message names the tools that have one."""
    if material.lives_of(work, kind):
        return
    known = [candidate.value for candidate in ToolMaterial if material.lives_of(work, candidate)]
    noun = {CuttingWork.DRILL: "drills", CuttingWork.MILL: "end mills"}[work]
    known_text = f"it has constants of {' and '.join(known)} {noun}" if known else f"it has none for {noun}"
    raise PlanError(
        f"{tool.label}: {material.name} has no tool-life constants of {kind.value} {noun}; {known_text}; add a "
        "[[life]] in a material file of your own, or set --tool-material"
    )


def _check_flutes_and_teeth(work: ToolWork) -> None:
    if not work.teeth:
        raise PlanError(f"{work.tool.label}: the number of its teeth is unknown; add 'teeth' in the tool library")
    flute_length = work.tool.flute_length
    if flute_length is not None and work.hole_depth > flute_length:
        raise PlanError(
            f"{work.tool.label}: its flutes are {flute_length:g} mm long, but with its point the holes are "
            f"{work.hole_depth:.4g} mm deep; take it out of the tool library or correct its 'flute_length'"
        )


def _tool_works_from_options(settings: Settings, machine: Machine) -> Iterator[tuple[Tool, int, float, float, float]]:
    """Yield each tool with the work that the options describe.

    This is the number of holes, and for one hole, the distances at feed and in the material, mm, and the time of other
    moves, s.
    """
    job, library = settings.job, library_of(settings, machine)
    if library is not None:
        tools = list(library.tools)
    elif job.tool_diameter is not None:
        tools = [Tool(1, job.tool_diameter, assumed=True)]
    else:
        raise OptionError("the tool is missing; give a drawing, --tools or --tool-diameter")
    drills = [tool for tool in tools if tool.kind is ToolKind.DRILL]
    deep = None
    if drills:
        deep = job.thickness + job.break_through if job.thickness is not None else job.blind_depth
        if deep is None:
            raise OptionError("the depth of the holes is missing; give --depth or --thickness")
    for tool in tools:
        if tool.kind is ToolKind.DRILL and deep is not None:
            cut = deep + tool.point_length
            yield tool, 1, cut + job.retract_height, cut, _MOVE
        else:
            yield tool, 0, 0.0, 0.0, 0.0


def _milling_work(tool: Tool, settings: Settings, material: WorkMaterial, kind: ToolMaterial) -> ToolWork:
    # The user's defaults are for pockets and do not describe this cut. Without options it is a full slot.
    step_over, step_down = (
        None if name in settings.defaults else getattr(settings.job, name) for name in ("step_over", "step_down")
    )
    width, depth = (step_over or 1.0) * tool.diameter, step_down or _DEPTH * tool.diameter
    lives, teeth = material.lives_of(CuttingWork.MILL, kind), tool.teeth or 0
    return ToolWork(
        tool, CuttingWork.MILL, lives, fed=_CUT_LENGTH, cut=_CUT_LENGTH, width=width, depth=depth, teeth=teeth
    )


def _tool_front(
    work: ToolWork, settings: Settings, machine: Machine, material: WorkMaterial, objective: str, kind: ToolMaterial
) -> ToolFront:
    options, tool = settings.of(SpeedOptions), work.tool
    tool_cost = tool.life_cost if tool.life_cost is not None else _TOOL_COST
    prices = Prices(_shop_rate(options) / _SECONDS_PER_HOUR, tool_cost, _WORN_CHANGE, _MAX_LIFE)
    grid = _speed_grid(work, kind, machine, material)
    limits = _cutting_limits(work, machine)
    fronts: list[CuttingResults] = []
    candidates = allowed = 0
    for rpm, feed in grid.blocks():
        candidates += len(rpm)
        if len(rpm):
            results = cutting_results(work, material, prices, rpm, feed, DRIVE_EFFICIENCY)
            allowed_results = results.select(mask_within_limits(limits, results))
            allowed += len(allowed_results.rpm)
            fronts.append(_pareto_front(allowed_results))  # candidates dominated within a batch are dominated overall
    if not candidates:
        raise PlanError(
            f"{tool.label}: no feed of the machine gives a chip of {grid.least_chip:.3g} to {grid.largest_chip:.3g} mm"
        )
    if not allowed:
        raise limit_error(tool.label, limits)
    best = _pareto_front(CuttingResults(*(np.concatenate(columns) for columns in zip(*fronts, strict=True))))
    best = best.select(np.lexsort((best.rpm, -best.life, best.cost, best.time)))
    given = None
    if not tool.assumed or {"feed", "spindle_speed"} & settings.given:
        given = _evaluate_given(work, material, prices)
    return ToolFront(
        tool=tool,
        tool_material=kind,
        work=work.work,
        holes=work.holes,
        points=best.points(),
        chosen=index_of_best(best, objective),
        candidates=candidates,
        allowed=allowed,
        given=given,
        sources=tuple(dict.fromkeys(life.source for life in work.lives)),
    )


def _shop_rate(options: SpeedOptions) -> float:
    return _SHOP_RATE if options.shop_rate is None else options.shop_rate


def _pareto_front(results: CuttingResults) -> CuttingResults:
    return results.select(non_dominated(np.column_stack((results.time, results.cost, -results.life))))


def _evaluate_given(work: ToolWork, material: WorkMaterial, prices: Prices) -> CuttingPoint | None:
    tool = work.tool
    if not (tool.feed > 0 and tool.spindle_rpm > 0):
        return None
    rpm, feed = np.array([tool.spindle_rpm]), np.array([tool.feed])
    return cutting_results(work, material, prices, rpm, feed, DRIVE_EFFICIENCY).points()[0]


def _speed_grid(work: ToolWork, kind: ToolMaterial, machine: Machine, material: WorkMaterial) -> SpeedGrid:
    share = material.drill_feed if work.work is CuttingWork.DRILL else material.mill_feed
    if work.work is CuttingWork.MILL and kind is ToolMaterial.HSS:
        share *= _HSS_MILL_CHIP
    largest = share * work.tool.diameter
    if not largest:
        raise OptionError(f"{material.name} has no limits of the chip thickness; use a material file with these limits")
    return SpeedGrid(
        lowest_rpm=machine.spindle_min_rpm,
        highest_rpm=machine.spindle_max_rpm,
        rpm_step=_RPM_STEP,
        highest_feed=machine.max_feed,
        feed_step=_FEED_STEP,
        least_chip=_LEAST_CHIP * largest,
        largest_chip=largest,
        teeth=work.teeth,
    )


def _cutting_limits(work: ToolWork, machine: Machine) -> list[CuttingLimit]:
    limits = [CuttingLimit("tool life", "tool or material", _LEAST_LIFE, format_time, lambda y: y.life, at_least=True)]
    power, torque, thrust = machine.spindle_power, machine.spindle_torque, machine.max_thrust
    if power:
        limits.append(
            CuttingLimit(
                "power", "spindle.power of the machine", power, lambda w: f"{w / 1000.0:.3g} kW", lambda y: y.power
            )
        )
    if torque:
        limits.append(
            CuttingLimit(
                "torque", "spindle.torque of the machine", torque, lambda m: f"{m / 1000.0:.3g} N·m", lambda y: y.torque
            )
        )
    if thrust and work.work is CuttingWork.DRILL:
        limits.append(
            CuttingLimit(
                "thrust", "spindle.max_thrust of the machine", thrust, lambda f: f"{f:.3g} N", lambda y: y.thrust
            )
        )
    return limits


def non_dominated(values: Floats) -> Mask:
    """Return a mask of the rows of `values`, finite float64[n, 3], that no other row dominates.

    A row dominates another row if none of its three numbers is larger, and at least one is smaller. Equal rows do not
    dominate each other, so either all of them are on the front or none. The rows are sorted by their first number. The
    front of the other two numbers is a staircase, so the method takes O(n log n).

    Source: H. T. Kung, F. Luccio and F. P. Preparata, On Finding the Maxima of a Set of Vectors, J. ACM 22 (1975), for
    three dimensions.
    """
    order: Indices = np.lexsort(values.T[::-1])
    rows = values[order]
    new = np.append(True, (rows[1:] != rows[:-1]).any(axis=1))[: len(rows)]
    kept = np.array(_non_dominated_rows(rows[new].tolist()), dtype=bool)
    mask = np.zeros(len(values), dtype=bool)
    if len(rows):
        mask[order] = kept[np.cumsum(new) - 1]
    return mask


def _non_dominated_rows(rows: list[list[float]]) -> list[bool]:
    """For each row, return whether no earlier row dominates it. The rows are distinct and in lexicographic order."""
    seconds: list[float] = []  # ascending
    thirds: list[float] = []  # descending: the smallest third number of all rows whose second is no larger
    kept: list[bool] = []
    for _, second, third in rows:
        index = bisect_right(seconds, second)
        dominated = index > 0 and thirds[index - 1] <= third
        kept.append(not dominated)
        if dominated:
            continue
        start = index - 1 if index > 0 and seconds[index - 1] == second else index
        stop = index
        while stop < len(thirds) and thirds[stop] >= third:
            stop += 1
        seconds[start:stop], thirds[start:stop] = [second], [third]
    return kept


# -- limits ----------------------------------------------------------------------------------------------------------


class SpeedGrid(NamedTuple):
    """All pairs of speed, rpm, and feed, mm/s, whose feed per tooth is between `least_chip` and `largest_chip`, mm."""

    lowest_rpm: float
    highest_rpm: float
    rpm_step: float
    highest_feed: float
    feed_step: float
    least_chip: float
    largest_chip: float
    teeth: int = 1

    def blocks(self) -> Iterator[tuple[Floats, Floats]]:
        """Yield all pairs of speed, rpm, and feed, mm/s, in batches.

        Raises PlanError if there are too many pairs.
        """
        speeds = self._steps(self.lowest_rpm, self.highest_rpm, self.rpm_step)
        by_rpm = self.teeth / SECONDS_PER_MINUTE
        first = np.maximum(np.ceil(self.least_chip * by_rpm * speeds / self.feed_step - _ROUNDING_TOLERANCE), 1.0)
        highest = np.minimum(self.largest_chip * by_rpm * speeds, self.highest_feed)
        counts = np.maximum(np.floor(highest / self.feed_step + _ROUNDING_TOLERANCE) - first + 1.0, 0.0)
        if not counts.sum() <= _MAX_CANDIDATES:
            raise PlanError(
                f"{counts.sum():.3g} speeds and feeds are too many (at most {_MAX_CANDIDATES:g}); lower the machine's "
                "spindle.max_speed"
            )
        ends = np.cumsum(counts)
        start = 0
        while start < len(speeds):
            done = ends[start - 1] if start else 0.0
            stop = max(int(np.searchsorted(ends, done + _BATCH_SIZE, side="right")), start + 1)
            batch_counts = counts[start:stop].astype(np.int64)
            rpm = np.repeat(speeds[start:stop], batch_counts)
            number = np.arange(len(rpm)) - np.repeat(np.cumsum(batch_counts) - batch_counts, batch_counts)
            yield (
                rpm,
                np.asarray(self.feed_step * (np.repeat(first[start:stop], batch_counts) + number), dtype=np.float64),
            )
            start = stop

    @staticmethod
    def _steps(low: float, high: float, step: float) -> Floats:
        """Return the multiples of a step between `low` and `high`. If there are none, return `high` alone."""
        first, last = max(math.ceil(low / step - _ROUNDING_TOLERANCE), 1), math.floor(high / step + _ROUNDING_TOLERANCE)
        if last - first >= _MAX_SPEEDS:
            raise PlanError(f"{last - first:.3g} spindle speeds are too many; lower the machine's spindle.max_speed")
        return step * np.arange(first, last + 1, dtype=float) if last >= first else np.array([high])


@dataclass
class CuttingLimit:
    """A limit on speeds and feeds, with a record of how it affects the candidates.

    Attributes
    ----------
    alone
        Whether at least one candidate is within this limit, regardless of the other limits.
    nearest
        Value of the candidate that comes closest to the limit.
    """

    quantity: str
    flag: str
    value: float
    shown: Callable[[float], str]
    values_of: Callable[[CuttingResults], Floats]
    at_least: bool = False
    alone: bool = False
    nearest: float = field(default=math.nan)

    def mask_within(self, results: CuttingResults) -> Mask:
        """Return a mask of the candidates within the limit.

        The method also records which value comes closest to the limit.
        """
        values = self.values_of(results)
        within: Mask = values >= self.value if self.at_least else values <= self.value
        best = float(values.max() if self.at_least else values.min())
        self.nearest = (np.fmax if self.at_least else np.fmin)(self.nearest, best)
        return within


def mask_within_limits(limits: list[CuttingLimit], results: CuttingResults) -> Mask:
    """Return a mask of the candidates that are within all limits. Each limit records its effect."""
    allowed = np.ones(len(results.rpm), dtype=bool)
    for limit in limits:
        mask = limit.mask_within(results)
        limit.alone |= bool(mask.any())
        allowed &= mask
    return allowed


def limit_error(label: str, limits: list[CuttingLimit]) -> PlanError:
    """Return an error that names the limit that excludes all candidates.

    Usually there is only one such limit, because a slower spindle with a thinner chip improves every limited quantity.
    """
    for limit in limits:
        if not limit.alone:
            least, most = ("at least", "at most") if limit.at_least else ("at most", "at least")
            return PlanError(
                f"{label}: no speed and feed reaches a {limit.quantity} of {least} {limit.shown(limit.value)}; "
                f"possible is {most} {limit.shown(limit.nearest)}; change {limit.flag}"
            )
    flags = ", ".join(dict.fromkeys(limit.flag for limit in limits))
    return PlanError(f"{label}: no speed and feed is within all limits together; change {flags}")


# -- work of a drawing -----------------------------------------------------------------------------------------------


def tool_works_from_drawing(
    drawing: Input, settings: Settings, machine: Machine, issues: list[Issue], progress: OnProgress | None
) -> list[tuple[Tool, int, float, float, float]]:
    """Return the work of each tool that drills a drawing, in order.

    The drawing is planned and ordered as by `leafcut drill`. Each entry contains the tool, the number of its holes, its
    distance at feed, mm, its distance in the material, mm, and the time of its other moves, s. Only the distance in the
    material wears a tool. The feed from the R plane to the surface does not.

    Raises
    ------
    ReadError, OptionError, PlanError, PostError, VerifyError
        If the drawing cannot be drilled.
    """
    from leafcut.timing.toolpath import time_rows

    format_, source = read_source_with_format(drawing)
    process = registry.process("drill")
    if "drill" not in format_.processes:
        raise PlanError(f"{drawing}: is a {format_.name}; speeds and feeds are chosen for a drawing with holes")
    # The material determines the speeds; in drilling, the option only selects presets of a Fusion library.
    asked = settings.asked - {"material"}
    limits = Deadline.from_options(settings.solve), Deadline.for_bounds(settings.solve)
    # The planned speeds do not matter, so the spindle may turn slower than it can.
    slow = replace(machine, spindle_min_rpm=0.0)
    job = Job(replace(settings, asked=asked), slow, limits[0], progress, bounds=limits[1])
    outcome = run_process(process, job, [source], "drill")
    issues += [issue for issue in outcome.issues if issue.severity is not Severity.NOTE]
    times = time_rows(outcome.path_after, machine)
    path = times.path
    tool_numbers = path.latest(Kind.TOOL, path.ref)
    at_feed = path.kind == Kind.FEED
    length = np.zeros(len(path))
    length[1:] = np.abs(np.diff(path.end[:, 2]))
    holes: dict[int, int] = {}
    tools: dict[int, Tool] = {}
    for operation in outcome.operations:
        tools[operation.tool.number] = operation.tool
        drilled = 0 if operation.slots else len(operation.holes)
        holes[operation.tool.number] = holes.get(operation.tool.number, 0) + drilled
    works = []
    for number, tool in tools.items():
        if tool.kind is not ToolKind.DRILL or not holes[number]:
            works.append((tool, 0, 0.0, 0.0, 0.0))
            continue
        of_tool = tool_numbers == number
        feed_length = float(length[of_tool & at_feed].sum())
        # The times of the tool change and the spindle start belong to the part, but do not depend on the speed.
        idle = float(times.seconds[of_tool].sum()) - feed_length / tool.feed
        works.append(
            (
                tool,
                holes[number],
                feed_length,
                feed_length - holes[number] * settings.job.retract_height,
                max(idle, 0.0),
            )
        )
    return works
