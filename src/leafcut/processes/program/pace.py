"""Choose new speeds and heights for a program, write them, and verify the result.

Moves through air become rapids, and the feeds of cuts are raised up to the chip load.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, PostError, ReadError, VerifyError
from leafcut.files.digests import fill_in_digest
from leafcut.gcode.program import Program
from leafcut.geometry.arrays import Floats
from leafcut.material.cutting_force import DRIVE_EFFICIENCY, spindle_torque
from leafcut.material.height_field import StockBlock, default_cell_size
from leafcut.material.loads import MILLING, Loads, StockBefore, compute_loads, infer_largest_safe_stock
from leafcut.material.straight_moves import cutting_moves_for_cells, smallest_tool_diameter, undivided_cutting_moves
from leafcut.message import Message
from leafcut.model.cutter import Cutter, cutter_of_tool
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import BEAMS
from leafcut.model.obstacles import Obstacles
from leafcut.model.pace import Pace, PaceRules, PaceStretch, SpindleLoad, ToolLimits
from leafcut.model.pace_change import FeedLimit, PaceChange, ToolPace
from leafcut.model.tool import Tool
from leafcut.model.toolpath import MOTIONS, Kind
from leafcut.options import FeedOptions
from leafcut.processes.job import Job
from leafcut.processes.keep_out import obstacle_hits
from leafcut.processes.plan import Plan
from leafcut.processes.program.options import ResequenceOptions, pace_flags
from leafcut.processes.program.plan.corners import rows_with_free_rounding
from leafcut.processes.program.plan.heights import HeightLowering
from leafcut.processes.program.plan.pace import KeptFeed, arcs_in_air, plan_pace, reason_for_kept_feed
from leafcut.processes.program.post.pace_writer import with_heights, with_pace, with_returns
from leafcut.processes.program.proof.new_speeds import (
    changed_stretches,
    check_limits,
    check_lowered,
    rows_changed_to_rapid,
)
from leafcut.processes.program.proof.stock_judge import StockJudge
from leafcut.processes.program.reading import read_new
from leafcut.processes.program.tools import program_tools
from leafcut.processes.program.workpiece import BELOW, check_block_size, stock_block, stock_field
from leafcut.read.step import ChosenSolid
from leafcut.read.work_materials import load_material
from leafcut.timing.toolpath import PathTimes, measure_toolpath, time_rows

#: Matches a line with block delete (/).
_SKIPPED = re.compile(r"[ \t]*(?:[Nn][ \t]*[0-9]+[ \t]*)?/")
#: Relative tolerance for comparing limits.
_ROUNDED = 1e-4
#: Heights that differ by less than this count as equal, mm.
_SAME = 1e-6
#: A cut at least this wide counts as a full slot, as a share of the tool diameter. The grid of the model always leaves
#: a little material at the sides.
_SLOT = 0.95
#: Changes that turn out to cost time are undone in at most `_TRIALS` rounds. Each changed motion is timed together with
#: `_NEAR` motions on either side.
_TRIALS, _NEAR = 3, 2
#: Minimum clearance of new rapids when the new text is simulated, as a share of the requested clearance. The new text
#: divides slopes at different points, so its simulated clearance differs slightly.
_KEPT = 0.5


@dataclass(frozen=True, eq=False)
class PacedProgram:
    """A program with new speeds and heights."""

    text: str
    program: Program
    change: PaceChange
    issues: tuple[Issue, ...] = ()


def with_new_pace(plan: Plan, program: Program) -> PacedProgram:
    """Return the program with the requested heights and speeds.

    A change is kept only if it saves time and is proved to be safe. The new program must leave the same stock as the
    original.

    Raises
    ------
    OptionError
        A tool shape is unknown, an option needs ``--workpiece``, or the program drives a laser or torch.
    PlanError
        The simulation has too many cells or motions.
    """
    job, source = plan.job, plan.work.source
    options, feeds = job.settings.of(ResequenceOptions), job.settings.of(FeedOptions).feeds
    asked = pace_flags(job.settings)
    if plan.kind in BEAMS:
        raise OptionError(
            "{}: {} drives a laser or a torch, whose width of cut is not simulated; leave it out", asked[0], source
        )
    blind = [flag for flag in asked if flag != "--air"]
    workpiece = job.settings.stock.workpiece
    if blind and not workpiece:
        raise OptionError(
            "{} needs the position of the material; give --workpiece with the x,y,z of the lower and upper corners of "
            "the block",
            blind[0],
        )
    tools = program_tools(program, source, job.settings, job.machine)
    text = "".join(program.lines)
    if not tools:
        return PacedProgram(text, program, PaceChange())
    if line := _first_skippable_line(program):
        message = Message(
            "speeds and heights are unchanged, because the block-delete switch (/) can skip moves and leave "
            "their material uncut"
        )
        return PacedProgram(text, program, PaceChange(), (Issue("L513", message, Message("line {}", line)),))
    cutters = {number: cutter_of_tool(tool) for number, tool in tools.items()}
    rules = PaceRules(options.air, feeds, spindle=_spindle_load(job) if feeds else None)
    if workpiece:
        check_block_size(program, cutters, stock_block(workpiece, ChosenSolid.of(job.settings.read)), source, workpiece)
    steps = _PaceSteps(plan, tools, cutters, _stock_before(job, program, cutters), rules)
    loads = steps.simulate_loads(program, Message("cutting the stock"))
    if steps.stock.known and not loads.removed.cuts.any():
        raise OptionError(
            "--workpiece: {} never touches this stock, so every cut would be in air; specify the block "
            "in program coordinates",
            source,
        )
    found = PacedProgram(text, program, PaceChange(assumed=not steps.stock.known), tuple(steps.stock_notes()))
    if options.low_retracts:
        found = steps.lower_retracts(found)
    if not options.air and not feeds:
        return found
    return steps.raise_speeds(
        found, loads if found.program is program else steps.simulate_loads(found.program, Message("cutting the stock"))
    )


def _stock_before(job: Job, program: Program, cutters: Mapping[int, Cutter]) -> StockBefore:
    """Return the stock that the user described, or else the largest stock that the program's rapids do not hit."""
    options = job.settings.stock
    smallest = smallest_tool_diameter(cutters)
    if options.workpiece:
        which = ChosenSolid.of(job.settings.read)
        block = stock_block(options.workpiece, which)
        field = stock_field(options, block, options.cell or default_cell_size(block, smallest), which)
        return StockBefore(field, block.low[2], True)
    whole = undivided_cutting_moves(program.path, cutters)
    low, high = whole.swept_box(~whole.rapid, cutters)
    cell = options.cell or default_cell_size(
        StockBlock(
            (float(low[0]), float(low[1]), float(low[2]) - BELOW),
            (float(high[0]), float(high[1]), float(high[2]) + BELOW),
        ),
        smallest,
    )
    field = infer_largest_safe_stock(
        cutting_moves_for_cells(program.path, cutters, cell),
        cutters,
        cell,
        job.machine.rapid_style == "dogleg",
        os.cpu_count() or 1,
        job.start_step(Message("cutting the stock")),
    )
    return StockBefore(field, math.inf, False)


@dataclass(frozen=True, eq=False)
class _PaceSteps:
    """Data shared by the steps that choose heights and speeds. `stock` is the material before the first cut."""

    plan: Plan
    tools: Mapping[int, Tool]
    cutters: Mapping[int, Cutter]
    stock: StockBefore
    rules: PaceRules

    @property
    def job(self) -> Job:
        return self.plan.job

    @property
    def obstacles(self) -> Obstacles | None:
        found: Obstacles | None = self.plan.work.obstacles
        return found

    def simulate_loads(self, program: Program, what: Message, stock: StockBefore | None = None) -> Loads:
        check_cancelled = self.job.start_step(what)
        return compute_loads(
            program.path, self.cutters, stock or self.stock, self.rules.clearance, os.cpu_count() or 1, check_cancelled
        )

    @cached_property
    def judge(self) -> StockJudge:
        return StockJudge.from_original(
            self.plan.work.program, self.tools, self.cutters, {}, self.stock.field, self.stock.known
        )

    @property
    def stock_with_surroundings(self) -> StockBefore:
        """The stock, surrounded by material up to the same height because the positions of the fixtures are unknown."""
        return replace(self.stock, beside=self.stock_top)

    @property
    def stock_top(self) -> float:
        return float(self.stock.field.heights.max()) if self.stock.known else math.inf

    def stock_notes(self) -> Iterator[Issue]:
        if not self.stock.known:
            message = Message(
                "the stock is not given, so leafcut finds moves in air only where the program has already "
                "moved or cut; give --workpiece to find more"
            )
            yield Issue("L510", message, severity=Severity.NOTE)

    def interpret(self, text: str) -> Program:
        try:
            return read_new(self.job, self.plan.dialect, text)
        except ReadError as problem:
            raise VerifyError("the new program cannot be read: {}", problem) from None

    def cycle_time(self, program: Program) -> float:
        return measure_toolpath(program.path, self.job.machine).time_s

    # -- heights -----------------------------------------------------------------------------------------------------

    def lower_retracts(self, found: PacedProgram) -> PacedProgram:
        found = replace(found, change=replace(found.change, retracts_s=0.0))
        before = self.cycle_time(found.program)
        kept: set[int] = set()
        for step in ("returns", "heights", "initials"):
            program = found.program
            loads = self.simulate_loads(program, Message("choosing heights"), self.stock_with_surroundings)
            ways = HeightLowering(
                program, loads, self.rules.clearance, self.job.machine, self.stock_top, self.obstacles
            )
            try:
                if step == "returns":
                    returns = ways.find_cycle_returns()
                    text, count = with_returns(program, returns, self.plan.dialect.max_line), len(returns)
                else:
                    heights = ways.lowered_heights() if step == "heights" else ways.lowered_initial_heights()
                    text, count = with_heights(program, heights), len(heights)
                kept |= ways.kept
                if not count:
                    continue
                text = fill_in_digest(text)
                new = self.interpret(text)
                self.check_heights(program, new)
                if step == "returns":
                    drills = program.path.kind == Kind.DRILL
                    count = int((new.path.end[drills, 2] < program.path.end[drills, 2] - _SAME).sum())
            except (PostError, VerifyError) as problem:
                found = replace(
                    found, issues=(*found.issues, Issue("L513", Message("the heights are unchanged: {}", problem)))
                )
                continue
            saved = before - self.cycle_time(new)
            if saved > (found.change.retracts_s or 0.0):
                change = replace(found.change, retracts_s=saved, lowered=found.change.lowered + count)
                found = replace(found, text=text, program=new, change=change)
        if kept:
            message = Message("{} rapids over --keep-out zones keep their heights", len(kept))
            message = message if len(kept) > 1 else Message("a rapid over a --keep-out zone keeps its height")
            found = replace(found, issues=(*found.issues, Issue("L513", message, Message("line {}", min(kept)))))
        return found

    def check_heights(self, program: Program, new: Program) -> None:
        """Check that the new program differs only in lower moves, and that these moves stay clear of the material.

        Raises
        ------
        VerifyError
            Another difference exists, or a lowered move comes too close to the material.
        """
        bent = self.stock_top if self.job.machine.rapid_style == "dogleg" else -math.inf
        check_lowered(
            program.path,
            new.path,
            self.simulate_loads(new, Message("verifying"), self.stock_with_surroundings),
            self.rules,
            bent,
        )
        self.check_stock_and_obstacles(new)

    def check_stock_and_obstacles(self, new: Program) -> None:
        """Check that the new program leaves the same stock as the original and hits no obstacle.

        Raises
        ------
        VerifyError
            The stock differs, or a move hits an obstacle.
        """
        self.judge.check(new)
        if self.obstacles is not None and (met := obstacle_hits(self.job, self.obstacles, new.path)):
            raise VerifyError(str(met[0]))

    # -- speeds ------------------------------------------------------------------------------------------------------

    def raise_speeds(self, found: PacedProgram, loads: Loads) -> PacedProgram:
        """Raise the speeds of the program.

        Keep the old speeds if the new speeds fail the verification or save no time.
        """
        program, rules = found.program, self.rules
        pace = self.choose_pace(program, loads, rules)
        issues = (*found.issues, *self.unknown_limit_notes(pace, loads))
        none = replace(found, change=self.summarize_change(found, loads, pace, loads.feed, {}), issues=issues)
        try:
            pace, text, new = self.undo_losses(program, pace)
            speed, stretches, nearest = self.prove_speeds(program, new, loads, pace)
        except (PostError, VerifyError) as problem:
            said = Issue("L513", Message("the speeds are unchanged: {}", problem))
            return replace(none, issues=(*issues, said, *_exceeded_limit_issues(none.change)))
        before, after = self.cycle_time(program), self.cycle_time(new)
        # A feed above the limit of its tool is reduced even if that costs time.
        own = program.path.value
        slowed = any(part.speed < own[row] for row, parts in stretches.items() for part in parts)
        if after >= before and not slowed:
            kept = self.unchanged_feed_notes(program, loads, pace, none.change, loads.feed)
            return replace(none, issues=(*issues, *kept, *_exceeded_limit_issues(none.change)))
        between = after if rules.air else before
        if rules.air and rules.feeds:
            alone = self.choose_pace(program, loads, replace(rules, feeds=False))
            between = self.cycle_time(self.undo_losses(program, alone)[2])
        change = replace(
            self.summarize_change(found, loads, pace, speed, stretches),
            air_s=before - between if rules.air else None,
            feeds_s=between - after if rules.feeds else None,
            clearance_mm=nearest if math.isfinite(nearest) else None,
        )
        raised = np.isfinite(speed) & loads.is_milling & (speed > loads.feed)
        if rules.feeds and raised.any() and rows_with_free_rounding(program.path, self.job.machine, math.inf).any():
            message = Message(
                "the program lets the controller round corners without a limit (G64 without P), and higher "
                "feeds round them more; give a tolerance such as G64 P0.01"
            )
            issues = (*issues, Issue("L511", message))
        kept = self.unchanged_feed_notes(program, loads, pace, change, speed)
        return PacedProgram(text, new, change, (*issues, *kept, *_exceeded_limit_issues(change)))

    def choose_pace(self, program: Program, loads: Loads, rules: PaceRules) -> Pace:
        check_cancelled = self.job.start_step(Message("choosing speeds"))
        chords = self.arcs_as_chords(program, loads) if rules.air else ()
        return plan_pace(
            program, loads, self.tools, self.cutters, rules, self.job.machine, self.stock_top, check_cancelled, chords
        )

    def arcs_as_chords(self, program: Program, loads: Loads) -> Collection[int]:
        """Return the rows of arcs through air that a rapid along the chord can replace without hitting anything."""
        path = program.path
        rows = [
            row
            for row in arcs_in_air(program, loads, self.rules, self.job.machine)
            if self.obstacles is None
            or min(path.before[row, 2], path.end[row, 2])
            >= self.obstacles.min_rapid_height(
                _point_xy(path.before[row]), _point_xy(path.end[row]), int(path.tool[row])
            )
        ]
        if not rows:
            return ()
        kind = path.kind.copy()
        kind[rows] = Kind.FEED
        tried = self.simulate_loads(replace(program, path=replace(path, kind=kind)), Message("choosing speeds"))
        met = tried.removed.cuts | (tried.removed.over > -self.rules.clearance)
        return set(rows) - set(tried.source[met].tolist())

    def write_pace(self, program: Program, pace: Pace) -> tuple[str, Program]:
        text = fill_in_digest(
            with_pace(program, pace, self.plan.dialect.max_line, self.job.start_step(Message("writing")))
        )
        return text, self.interpret(text) if pace.stretches else program

    def undo_losses(self, program: Program, pace: Pace) -> tuple[Pace, str, Program]:
        """Undo raised speeds that cost time.

        Dividing a cut changes the look-ahead of the controller, which can slow the cut down.

        Returns
        -------
        tuple
            The remaining speeds, the new text, and the program read back from that text.
        """
        machine, path = self.job.machine, program.path
        own = _seconds_by_row(time_rows(path, machine), np.arange(len(path)))
        text, new = self.write_pace(program, pace)
        for _ in range(_TRIALS):
            found = changed_stretches(path, new.path)
            counts = np.ones(len(path), dtype=np.int64)
            counts[list(found)] = [len(parts) for parts in found.values()]
            saved = own - _seconds_by_row(time_rows(new.path, machine), np.repeat(np.arange(len(counts)), counts))
            # The look-ahead changes for adjacent motions as well.
            sums = np.concatenate([[0.0], np.cumsum(saved)])
            last = len(saved) - 1
            slower = {
                row
                for row, parts in pace.stretches.items()
                if any(part.speed > path.value[row] for part in parts)
                and sums[min(row + _NEAR, last) + 1] - sums[max(row - _NEAR, 0)] <= 0.0
            }
            if not slower:
                break
            kept = {
                row: _cap_at_feed(parts, float(path.value[row])) if row in slower else parts
                for row, parts in pace.stretches.items()
            }
            pace = Pace({row: parts for row, parts in kept.items() if parts}, pace.limits)
            text, new = self.write_pace(program, pace)
        return pace, text, new

    def prove_speeds(
        self, program: Program, new: Program, loads: Loads, pace: Pace
    ) -> tuple[Floats, dict[int, tuple[PaceStretch, ...]], float]:
        """Verify the new speeds.

        Returns
        -------
        tuple
            The speed of each simulated move (mm/s), the changed segments, and the smallest clearance (mm).

        Raises
        ------
        VerifyError
            The path or the stock has changed, or a new rapid comes too close to the material.
        """
        found = changed_stretches(program.path, new.path)
        speed = check_limits(loads, found, pace.limits, self.rules, self.cutters)
        fast, chords = rows_changed_to_rapid(program.path, found)
        # Check the new rapids in pieces, like cuts.
        kind = new.path.kind.copy()
        kind[fast] = Kind.FEED
        again = self.simulate_loads(replace(new, path=replace(new.path, kind=kind)), Message("verifying"))
        ends = again.moves.ends
        # Straight retracts pass only where the tool has just been.
        mine = np.isin(again.source, fast) & ~(again.is_vertical & (ends[:, 5] > ends[:, 2]))
        # A chord is a new path that only this check covers, so it needs the full clearance.
        keeps = np.where(np.isin(again.source, chords), 1.0 - 1e-6, _KEPT)
        near = mine & (again.removed.cuts | (again.removed.over > -keeps * self.rules.clearance))
        if near.any():
            line = int(new.path.line[again.source[int(np.flatnonzero(near)[0])]])
            raise VerifyError("line {} of the new program: a rapid comes too close to the material", line)
        self.check_stock_and_obstacles(new)
        return speed, found, -float(again.removed.over[mine].max(initial=-math.inf))

    def summarize_change(
        self,
        found: PacedProgram,
        loads: Loads,
        pace: Pace,
        speed: Floats,
        stretches: Mapping[int, tuple[PaceStretch, ...]],
    ) -> PaceChange:
        """Summarize the new speeds. The caller adds the time saved."""
        every = [part.speed for parts in stretches.values() for part in parts]
        chip = loads.chip
        # In a plunge, the last stretch is in the material.
        into = speed.copy()
        for at in np.flatnonzero(loads.is_plunging).tolist():
            if parts := stretches.get(int(loads.source[at])):
                into[at] = parts[-1].speed
        by_tool = []
        for number, limit in sorted(pace.limits.items()):
            mine = loads.main_cuts_of_tool(number) & np.isfinite(speed)
            if not mine.any():  # all its moves except plunges are now rapids
                continue
            feed, after = loads.feed[mine], speed[mine]
            ratio = after / feed
            by_tool.append(
                ToolPace(
                    number,
                    self.tools[number].label,
                    (float(feed.min()), float(feed.max())),
                    (float(after.min()), float(after.max())),
                    float(chip[mine].max()),
                    float((chip[mine] * ratio).max()),
                    limit.chip,
                    limit.stated,
                    float(loads.rate[mine].max()),
                    float((loads.rate[mine] * ratio).max()),
                    tuple(self.tool_limit_changes(number, loads, into, limit)),
                )
            )
        return replace(
            found.change,
            air_s=0.0 if self.rules.air else None,
            feeds_s=0.0 if self.rules.feeds else None,
            rapids=sum(map(math.isinf, every)),
            clearance_mm=None,
            changed=sum(any(math.isfinite(part.speed) for part in parts) for parts in stretches.values()),
            tools=tuple(by_tool),
        )

    def tool_limit_changes(self, number: int, loads: Loads, speed: Floats, limit: ToolLimits) -> Iterator[FeedLimit]:
        """Yield the power, torque and plunge feed of a tool: maximum before the change, maximum after it, and limit."""
        diameter = 2.0 * self.cutters[number].radius
        of_tool = (loads.moves.tool == number) & np.isfinite(speed)
        ratio = np.divide(speed, loads.feed, out=np.ones_like(speed), where=of_tool & (loads.feed > 0))

        def most(values: Floats, which: NDArray[np.bool_], power: float = 1.0) -> tuple[float, float]:
            mine = of_tool & which
            after = values[mine] * ratio[mine] ** power
            return float(values[mine].max(initial=0.0)), float(after.max(initial=0.0))

        cuts = loads.is_milling | loads.is_ramping
        all_cuts = cuts | loads.is_plunging
        if limit.spindle is not None:
            power = loads.power(limit.spindle, limit.teeth, diameter)
            grows = 1.0 - limit.spindle.material.mc
            if math.isfinite(limit.spindle.power):
                used = power / limit.spindle.efficiency
                yield FeedLimit("power", *most(used, all_cuts, grows), limit.spindle.power)
            if math.isfinite(limit.spindle.torque):
                torque = spindle_torque(power, np.where(loads.rpm > 0, loads.rpm, np.inf))
                yield FeedLimit("torque", *most(torque, all_cuts, grows), limit.spindle.torque)
        if math.isfinite(limit.plunge):
            yield FeedLimit("plunge", *most(loads.descent_speed, loads.is_ramping | loads.is_plunging), limit.plunge)

    def unknown_limit_notes(self, pace: Pace, loads: Loads) -> Iterator[Issue]:
        for number, tool in self.tools.items() if self.rules.feeds else ():
            if number in pace.limits:
                continue
            mine = loads.main_cuts_of_tool(number)
            turns = tool.kind not in MILLING or not mine.any() or bool((loads.rpm[mine] > 0).all())
            why = (
                Message("the tool does not mill")
                if turns
                else Message("the program does not state the spindle speed of its cuts")
            )
            yield Issue("L512", Message("{} keeps its feed: {}", tool.label, why), severity=Severity.NOTE)
        if self.rules.feeds and pace.limits:
            for message in self.ignored_limit_messages(pace):
                yield Issue("L514", message, severity=Severity.NOTE)

    def unchanged_feed_notes(
        self, program: Program, loads: Loads, pace: Pace, change: PaceChange, speed: Floats
    ) -> list[Issue]:
        """Explain why a tool keeps all of its feeds. Tools that exceed a limit are skipped."""
        issues, above = list[Issue](), {tool.number for tool in change.tools if _exceeded_limits(tool)}
        for number, limit in sorted(pace.limits.items()) if self.rules.feeds else ():
            mine = loads.main_cuts_of_tool(number) & np.isfinite(speed)
            if number in above or not mine.any() or not np.allclose(speed[mine], loads.feed[mine], rtol=1e-9, atol=0.0):
                continue
            tool, diameter = self.tools[number], 2.0 * self.cutters[number].radius
            why = reason_for_kept_feed(program, loads, number, limit, diameter, self.rules, self.job.machine)
            words = Message("the tool only plunges") if why is None else _kept_feed_text(why, limit, diameter)
            issues.append(Issue("L512", Message("{} keeps its feed: {}", tool.label, words), severity=Severity.NOTE))
        return issues

    def ignored_limit_messages(self, pace: Pace) -> Iterator[Message]:
        """Yield a message for each feed limit that is ignored because a value is missing.

        The message includes the remedy.
        """

        def named(numbers: Iterable[int]) -> str:
            return ", ".join(f"T{number}" for number in numbers)

        numbers = sorted(pace.limits)
        spindle = self.rules.spindle
        toothless = [number for number in numbers if not self.tools[number].teeth]
        if spindle is None:
            yield Message(
                "the power and torque of the spindle do not limit the feeds, because the material is unknown; give "
                "--material"
            )
        elif not spindle.limited:
            yield Message(
                "the power and torque of the spindle do not limit the feeds, because the machine's profile "
                "does not state them; set spindle.power in the profile"
            )
        elif toothless:
            yield Message(
                "the power and torque of the spindle do not limit the feeds of {}, because the number of teeth "
                "is unknown; give it with --tools",
                named(toothless),
            )
        yield Message("feeds in slots are limited like feeds in other cuts")
        if unknown := [number for number in numbers if math.isinf(pace.limits[number].plunge)]:
            yield Message("plunges and ramps of {} keep their feeds; give a plunge feed with --tools", named(unknown))


#: Messages by `KeptFeed.reason`, with share (%) and line. The key "chip" is used if the feed comes from the tool
#: library.
_KEPT_WORDS = {
    "chip": partial(
        Message,
        "in {:.0f} % of the cutting time, the chip load is at the limit set by the feed and speed in the "
        "library, first at line {}",
    ),
    "rate": partial(
        Message, "in {:.0f} % of the cutting time, the removal rate equals that of the worst cut, first at line {}"
    ),
    "spindle": partial(
        Message, "in {:.0f} % of the cutting time, the power or torque of the spindle is the limit, first at line {}"
    ),
    "ramp": partial(
        Message,
        "in {:.0f} % of the cutting time, the tool cuts on ramps, first at line {}; give its plunge feed with --tools",
    ),
    "finish": partial(Message, "in {:.0f} % of the cutting time, the tool finishes walls, first at line {}"),
    "machine": partial(
        Message, "in {:.0f} % of the cutting time, the feed is already the machine's maximum, first at line {}"
    ),
    "lines": partial(Message, "lines that cannot be changed take {:.0f} % of the cutting time; the first is line {}"),
    "short": partial(
        Message,
        "in {:.0f} % of the cutting time, a higher feed would save nothing, because the cuts are too short, "
        "first at line {}",
    ),
}


def _kept_feed_text(why: KeptFeed, limit: ToolLimits, diameter: float) -> Message:
    reason, share = why.reason, 100.0 * why.share
    if reason == "chip" and not limit.stated:
        if why.width < _SLOT * diameter:
            return Message(
                "the worst cut is {:.3g} mm wide at line {}, and the chip load is the same in {:.0f} % of the "
                "cutting time; give the feed and speed of the tool with --tools",
                why.width,
                why.line,
                share,
            )
        return Message(
            "the worst cut is a full slot at line {}, and the chip load is the same in {:.0f} % of the cutting "
            "time; give the feed and speed of the tool with --tools",
            why.line,
            share,
        )
    return _KEPT_WORDS[reason](share, why.line)


def _spindle_load(job: Job) -> SpindleLoad | None:
    """Return the limits of spindle power and torque, or None if the option ``--material`` is not used.

    Raises
    ------
    OptionError
        The material is unknown.
    """
    if "material" not in job.settings.given:
        return None
    material = load_material(job.settings.job.material)
    power = job.machine.spindle_power
    return SpindleLoad(material, power or math.inf, job.machine.spindle_torque or math.inf, DRIVE_EFFICIENCY)


def _first_skippable_line(program: Program) -> int:
    """Return the first line with a move that block delete (/) may skip, or 0."""
    moves = np.isin(program.path.kind, [int(kind) for kind in MOTIONS])
    lines = np.unique(program.line[program.row_block[moves]]).tolist()
    return next((line for line in lines if _SKIPPED.match(program.lines[line - 1])), 0)


def _point_xy(point: Floats) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _exceeded_limit_issues(change: PaceChange) -> Iterator[Issue]:
    for tool in change.tools:
        if over := _exceeded_limits(tool):
            message = Message(
                "{} stays above its limit ({}) in cuts whose lines cannot be changed", tool.label, ", ".join(over)
            )
            yield Issue("L512", message)


def _exceeded_limits(tool: ToolPace) -> list[str]:
    over = [one.name for one in tool.limits if one.after > one.limit * (1.0 + _ROUNDED)]
    return over + (["chip"] if tool.limit_stated and tool.chip_after > tool.chip_limit * (1.0 + _ROUNDED) else [])


def _cap_at_feed(parts: tuple[PaceStretch, ...], own: float) -> tuple[PaceStretch, ...]:
    """Cap the speeds of a cut's segments at its original feed.

    Return an empty tuple if no segment is slower than that feed.
    """
    kept: list[PaceStretch] = []
    for part in parts:
        speed = min(part.speed, own)
        if kept and kept[-1].speed == speed:
            kept.pop()
        kept.append(PaceStretch(part.until, speed))
    return tuple(kept) if any(part.speed < own for part in kept) else ()


def _seconds_by_row(times: PathTimes, source: NDArray[np.int64]) -> Floats:
    """Add up the time of each source row, s. `source` maps each row of the timed path to its source row."""
    count = int(source.max(initial=-1)) + 1
    return np.bincount(source[times.source], weights=times.seconds, minlength=count).astype(np.float64)
