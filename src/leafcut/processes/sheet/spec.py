"""Prepare a sheet for the search: resolve the rules, create the cuts, and look for chains."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, PlanError, printable
from leafcut.gcode.dialects import dialect_names, load_dialect
from leafcut.gcode.torch import KERF_REGISTER
from leafcut.geometry.arrays import Point
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.cutting import CutData, PlanFile
from leafcut.model.heartbeat import progress_for_step
from leafcut.model.issue import Issue, Severity
from leafcut.model.kinds import CutMethod, Head, first_word_of_process
from leafcut.model.obstacles import Obstacles
from leafcut.model.plan import Order
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.processes.contours import SAME_THICKNESS, prepare_sheet, read_placed_contours, without_excluded_holes
from leafcut.processes.cutting_machines import CUTTING_MACHINES
from leafcut.processes.job import (
    Job,
    check_dialect_options,
    dialect_of,
    plane_point,
    refuse_missing_work,
    refuse_too_large,
)
from leafcut.processes.ordering import nearest_order
from leafcut.processes.plan import Plan
from leafcut.processes.quoting import stock_price
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.order_passes import (
    SEARCH_SHARE,
    SheetWork,
    build_stages,
    cached_motion,
    sequence_from_choices,
)
from leafcut.processes.sheet.plan.cut_rules import resolve_rules
from leafcut.processes.sheet.plan.cutting import (
    CutSequence,
    Cutting,
    HeadTravel,
    drawing_order,
    prepare_cutting,
    sorted_by_band,
    sweep_bands,
)
from leafcut.processes.sheet.plan.moved_starts import clear_pierces_of_kerfs, with_leads_apart
from leafcut.processes.sheet.plan.narrow_shapes import with_narrow_shapes
from leafcut.processes.sheet.plan.toolpath import TORCH_ON, TorchSetup
from leafcut.processes.sheet.post import check_dialect_support
from leafcut.processes.sheet.proof.matched_runs import CutRequest
from leafcut.processes.zones import crossing_heights, parse_zones, refuse_higher_zones
from leafcut.proof.envelope import check_machine_limits
from leafcut.read.cutchart import find_cut_data, is_variant_of_process, load_chart
from leafcut.timing.profile import trapezoid_time
from leafcut.timing.travel import travel_metric

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.model.machine import Machine, Probe
    from leafcut.model.obstacles import Obstacles
    from leafcut.model.part import Part
    from leafcut.model.sheet import Sheet
    from leafcut.options import Settings
    from leafcut.processes.sheet.plan.detached_parts import DetachableParts
    from leafcut.processes.sheet.plan.starts import CutStart
    from leafcut.read.format import Source

#: Share of the remaining time for finding chains. The rest is for the order of all cuts.
CHAIN_SHARE = 0.4
#: The torch may round corners within this tolerance to keep its speed, mm (G64 P).
PATH_TOLERANCE = 0.1
#: Maximum thickness that a beam can pierce safely while it moves, mm. This is an estimate: up to this thickness, the
#: pierce delay is a few tenths of a second.
_MAX_MOVING_PIERCE = 3.0


def plan_sheet(job: Job, source: Source) -> Plan:
    """Plan the cutting of a sheet. The plan contains the cuts with all possible starts, and chains that save time."""
    settings = job.settings
    options = settings.of(CutOptions)
    job.report(Message("reading"))
    data, issues = _cut_data(job)
    issues += _micro_joint_issues(data, options)
    post_dialect = dialect_of(job)
    _check_dialect(post_dialect, data.process)
    check_dialect_options(settings, post_dialect)
    probe = usable_probe(job.machine, post_dialect)
    if post_dialect.torch is not None and not post_dialect.torch.waits and not post_dialect.moves_z:
        if options.pierce_delay:
            raise OptionError("{} has no pierce delay; leave out --pierce-delay", post_dialect.name)
        data = replace(data, pierce_delay=0.0)  # a beam that is off at standstill can pierce only in motion
    torch = _torch_setup(job, post_dialect, data, probe)
    planned = settings.job.plan is not None
    rules = resolve_rules(data, options, switches=torch.switches, max_feed=job.machine.max_feed, planned=planned)
    part, sheet = _read_sheet(job, source)
    sheet = _priced(with_size_and_zones(sheet, options, parse_zones(settings.job.keep_out)), settings, data)
    if post_dialect.moves_z:
        refuse_higher_zones(settings.job.keep_out, settings.job.clearance_height)
    drawn, sheet, narrow = with_narrow_shapes(sheet, rules)
    issues += narrow
    refuse_too_large(check_machine_limits(_bounding_move(sheet), job.machine), part, settings)
    marks = any(c.kind == "mark" for c in sheet.contours)
    check_dialect_support(post_dialect, settings.post, marks=marks, compensates=options.compensation == "controller")
    file = _load_plan_file(settings.job.plan) if settings.job.plan else None
    job.report(Message("looking for pierce points"))
    cutting = prepare_cutting(sheet, rules)
    if file is not None:
        from leafcut.processes.sheet.plan.plan_file import restrict_starts_to_plan

        cutting = restrict_starts_to_plan(cutting, file, everything=settings.solve.keeps_order)
        issues += _plan_issues(file, data)
    issues += _kerf_register_issues(post_dialect, data, options)
    issues = [*sheet.issues, *issues, *cutting.issues]
    refuse_missing_work(settings, source, issues)
    head = HeadTravel(
        travel_metric(job.machine, settings.solve.objective),
        _lowering_time(job.machine, torch) if post_dialect.moves_z else 0.0,
        plane_point(settings.job.start_point),
        plane_point(settings.job.end_point),
    )
    known, given, fits = _given_order(cutting, file, options, head)
    work = SheetWork(
        drawn=drawn,
        cutting=cutting,
        given=given,
        nearest=given,
        torch=torch,
        head=head,
        planned=file if fits else None,
        order_fixed=options.heat_distance > 0.0 or (options.sweep != "free" and fits),
        parts=None if post_dialect.moves_z else _detachable_parts(job, cutting),
        obstacles=_obstacles(job, post_dialect.moves_z),
    )
    plan = Plan(
        job=job,
        part=part,
        dialect=post_dialect,
        work=work,
        spec=CutRequest(
            half=rules.half,
            joints=options.micro_joints,
            joint_width=options.joint_width,
            safe_height=settings.job.clearance_height,
            probe=probe,
            power=settings.post.beam_power if post_dialect.torch is not None and post_dialect.torch.power else None,
            material_number=settings.post.material_number,
        ),
        box=_bounding_box(cutting.sheet),
        issues=[*issues, *_probe_issues(probe)],
        keeps_given=settings.solve.keeps_order,
        search_share=SEARCH_SHARE,
        may_fall_back=False,
    )
    # The area that leads require does not depend on the order, so it is checked before the searches.
    refuse_too_large(check_machine_limits(cached_motion(plan, Order((given,))).path, job.machine), part, settings)
    nearest = nearest_order(job, build_stages(job, cutting, head, known))
    joined = _with_best_chains(job, cutting, file, head.overhead)
    if joined is not cutting:
        known = sorted_by_band(joined, drawing_order(joined), options)
    by_nearest = with_leads_apart(
        clear_pierces_of_kerfs(sequence_from_choices(job, cutting, nearest.choices), head), head
    )
    work = replace(work, cutting=joined, nearest=by_nearest)
    return replace(plan, work=work, stages=build_stages(job, joined, head, known))


def _load_plan_file(path: Path) -> PlanFile:
    from leafcut.read.plan_file import load_plan

    return load_plan(path)


def _torch_setup(job: Job, post_dialect: Dialect, data: CutData, probe: Probe | None) -> TorchSetup:
    torch, post = post_dialect.torch, job.settings.post
    beam = torch is not None and torch.power
    return TorchSetup(
        data,
        job.settings.job.clearance_height,
        safe_z=job.machine.safe_z,
        switches=torch is not None and torch.can_switch_off_along_path,
        moves_z=post_dialect.moves_z,
        power=post.beam_power if beam else TORCH_ON,
        mark_power=post.mark_power if beam else TORCH_ON,
        tolerance=PATH_TOLERANCE if torch is not None else 0.0,
        probe=probe,
        mark_tool=torch.mark_tool if torch is not None else None,
    )


def _given_order(
    cutting: Cutting, file: PlanFile | None, options: CutOptions, head: HeadTravel
) -> tuple[list[CutStart], CutSequence, bool]:
    """Return the cuts in the order of the plan file. Without a plan file, return them in drawing order.

    Returns
    -------
    order
        One start of each cut, in the given order.
    sequence
        The sequence for comparison. It uses all choices of the plan file if they fit, otherwise the given order.
    follows
        Whether the sequence follows all choices of the plan file.
    """
    order = drawing_order(cutting)
    if file is not None:
        from leafcut.processes.sheet.plan.chains import chains_from_plan_file, with_chains
        from leafcut.processes.sheet.plan.plan_file import order_as_planned, restrict_starts_to_plan

        order = order_as_planned(cutting, file)
    known = sorted_by_band(cutting, order, options)
    given, fits = clear_pierces_of_kerfs(CutSequence(cutting, tuple(known)), replace(head, start=None, end=None)), False
    known = list(given.starts)
    if file is not None:
        try:
            whole = restrict_starts_to_plan(cutting, file, everything=True)
            whole = with_chains(whole, chains_from_plan_file(whole, file, everything=True))
            starts = tuple(order_as_planned(whole, file))
        except PlanError:
            fits = False
        else:
            given, fits = CutSequence(whole, starts), True
    return known, with_leads_apart(given, head), fits


def _with_best_chains(job: Job, cutting: Cutting, file: PlanFile | None, overhead: float) -> Cutting:
    """Add the chains of the plan file and, if requested, other chains that save time.

    Raises PlanError if a chain of the plan file does not fit.
    """
    settings, options, keep = job.settings, job.settings.of(CutOptions), job.settings.solve.keeps_order
    if file is None and (not options.chains or keep):
        return cutting
    from leafcut.order.solve import solve
    from leafcut.processes.sheet.plan.chains import (
        chain_blocks,
        chain_problem,
        chains_from_plan_file,
        chains_from_solution,
        with_chains,
    )

    chains = [] if file is None else chains_from_plan_file(cutting, file, everything=keep)
    if not options.chains or keep:
        return with_chains(cutting, chains)
    blocks = chain_blocks(cutting, sweep_bands(cutting, options), chains)
    deadline, left = job.deadline.for_share(CHAIN_SHARE), sum(map(len, blocks))
    for block in blocks:
        job.report(Message("looking for bridges"))
        own = deadline.for_share(len(block) / left)
        left -= len(block)
        found = chain_problem(cutting, block, overhead, min(job.machine.rapid_velocity[:2]))
        if found is None:
            continue
        problem, bridges = found
        search = replace(settings.solve, bound=False, algorithm="auto", time_limit=own.remaining_time_limit)
        on_progress = progress_for_step(job.progress, Message("joining cuts"), 0.0, 1.0)
        solution = solve(problem, search, settings.aco, progress=on_progress, cancelled=job.cancelled)
        own.subtract(solution.seconds)
        chains = [*chains, *chains_from_solution(cutting, bridges, [int(n) for n in solution.nodes], chains)]
    return with_chains(cutting, chains)


def _detachable_parts(job: Job, cutting: Cutting) -> DetachableParts:
    from leafcut.processes.sheet.plan.detached_parts import DetachableParts

    return DetachableParts(cutting.sheet, 0.5 * job.machine.nozzle_diameter)


def _obstacles(job: Job, moves_z: bool) -> Obstacles | None:
    settings = job.settings.job
    zones = parse_zones(settings.keep_out)
    if not len(zones):
        return None

    heights = np.full(len(zones), math.inf)
    if moves_z:
        heights = crossing_heights(settings.keep_out, settings.clearance_height)
    return Obstacles(zones, heights, dogleg=job.machine.rapid_style == "dogleg")


def _bounding_move(sheet: Sheet) -> Toolpath:
    """Return a move across the bounding box of all contours. It is used to check the travel of the machine."""
    builder = ToolpathBuilder()
    x0, y0, x1, y1 = _bounding_box(sheet)
    builder.rapid(x0, y0)
    builder.rapid(x1, y1)
    return builder.build()


def _bounding_box(sheet: Sheet) -> tuple[float, float, float, float]:
    boxes = np.array([c.path.extents for c in sheet.contours])
    x0, y0 = boxes[:, :2].min(axis=0).tolist()
    x1, y1 = boxes[:, 2:].max(axis=0).tolist()
    return x0, y0, x1, y1


def _read_sheet(job: Job, source: Source) -> tuple[Part, Sheet]:
    part = read_placed_contours(job, source)
    sheet = prepare_sheet(part, job.settings.sheet, job.settings.read.concentric)
    return part, without_excluded_holes(sheet, job.settings.read)


def _priced(sheet: Sheet, settings: Settings, data: CutData) -> Sheet:
    """Return the sheet with its price. Raises OptionError if a quote needs the price and it is unknown."""
    return replace(sheet, price=stock_price(settings, sheet.price, sheet.area, data.material, data.thickness))


def _cut_data(job: Job) -> tuple[CutData, list[Issue]]:
    data, options, thickness = job.settings.cut_data, job.settings.of(CutOptions), job.settings.job.thickness
    machine_kind = job.machine.head.method
    if machine_kind is None:
        raise OptionError(
            "{} has a spindle and cannot cut a sheet by heat or water; choose --machine "
            '{} or a profile of your own with process = "torch"',
            job.machine.name,
            ", ".join(CUTTING_MACHINES.values()),
        )
    _check_process(data.cut_process or machine_kind, machine_kind, job.machine.name)
    if thickness is None:
        raise OptionError("cutting needs the sheet's thickness; give --thickness, such as --thickness 6mm")
    process, warnings = resolve_cut_process(job.machine, data.cut_process)
    found, issues = find_cut_data(
        load_chart(data.chart),
        process,
        job.settings.job.material,
        thickness,
        data.amps,
        data.nozzle,
        feed=data.cut_speed,
        kerf=data.kerf,
        pierce_delay=options.pierce_delay,
        pierce_height=options.pierce_height,
        cut_height=options.cut_height,
    )
    return found, [*warnings, *issues]


def resolve_cut_process(machine: Machine, asked: str | None) -> tuple[str, list[Issue]]:
    """Return the process in the cut chart, and a warning if its power differs from the power of the machine.

    Raises OptionError if the machine uses another cutting method.
    """
    own = machine.cut_process.lower() or str(machine.head.method)
    if asked is None or is_variant_of_process(own, asked):
        return own, []
    asked = asked.lower()
    if is_variant_of_process(asked, own):
        return asked, []
    kind, kind_asked = (name.split("_")[:2] for name in (own, asked))
    if kind != kind_asked:
        raise OptionError(
            '--cut-process {}: {} has {}; choose another --machine, or a profile of your own with cut_process = "{}"',
            printable(asked),
            machine.name,
            own,
            printable(asked),
        )
    words = Message(
        "the cutting data are for {} (--cut-process), but {} has {}; check the power", asked, machine.name, own
    )
    return asked, [Issue("L413", words)]


def _check_process(asked: str, kind: str, machine: str) -> None:
    how = first_word_of_process(asked)
    if how == kind or how not in tuple(CutMethod):
        return
    raise OptionError(
        '{} cuts by {}, not by {}; choose --machine {}, or a profile of your own with process = "{}"',
        machine,
        kind,
        how,
        CUTTING_MACHINES[how],
        Head.for_method(CutMethod(how)),
    )


def _check_dialect(post_dialect: Dialect, process: str) -> None:
    how = first_word_of_process(process)
    if post_dialect.torch is not None and how in tuple(CutMethod) and how not in post_dialect.torch.cuts:
        able = [
            name for name in dialect_names(torch=True) if how in (load_dialect(name).torch or post_dialect.torch).cuts
        ]
        raise OptionError(
            "programs for {} cut by {}, not by {}; choose --dialect {}",
            post_dialect.name,
            " or ".join(post_dialect.torch.cuts),
            how,
            " or ".join(able),
        )


def usable_probe(machine: Machine, post_dialect: Dialect) -> Probe | None:
    """Return the probe for touching off before each pierce.

    Return None if the machine has no probe or programs cannot use it.
    """
    return machine.probe if post_dialect.torch is not None and post_dialect.torch.probe else None


def _micro_joint_issues(data: CutData, options: CutOptions) -> list[Issue]:
    """Warn about micro-joints if the sheet is so thick that the beam cannot pierce it while it moves."""
    if (
        first_word_of_process(data.process) != CutMethod.LASER
        or not options.micro_joints
        or data.thickness <= _MAX_MOVING_PIERCE
    ):
        return []
    wait = Message("the {:.2g} s", data.pierce_delay) if data.pierce_delay > 0.0 else Message("the time")
    words = Message(
        "after a micro-joint the beam restarts in motion, without {} that piercing {:g} mm takes, and may not "
        "cut through; test one part first, or leave out --micro-joints",
        wait,
        data.thickness,
    )
    return [Issue("L620", words)]


def _plan_issues(plan: PlanFile, data: CutData) -> list[Issue]:
    """Warn if the plan file was created with other cutting data, because its leads and starts suit another kerf."""
    differs = []
    if plan.thickness and abs(plan.thickness - data.thickness) > SAME_THICKNESS:
        differs.append(Message("{:g} mm, not {:g} mm", plan.thickness, data.thickness))
    if plan.material and plan.material != data.material:
        differs.append(Message("{}, not {}", plan.material, data.material))
    if plan.process and plan.process != data.process:
        differs.append(Message("{}, not {}", plan.process, data.process))
    if not differs:
        return []
    words = Message(
        "the plan was made for {}, so this sheet is cut with its own data and the fixed values of the plan; "
        "check its leads and starts, or make a new plan",
        Message.joined_by_and(differs),
    )
    return [Issue("L621", words, plan.source)]


def _kerf_register_issues(post_dialect: Dialect, data: CutData, options: CutOptions) -> list[Issue]:
    """Warn if the controller takes the kerf from a register, because the program does not set the register."""
    if options.compensation != "controller" or post_dialect.torch is None or post_dialect.torch.compensation != "G41":
        return []
    text = Message(
        "the controller takes half of the kerf from register D{}; set it to {:.4g} mm, as a radius, or every "
        "part will have the wrong size",
        KERF_REGISTER,
        0.5 * data.kerf,
    )
    return [Issue("L622", text)]


def _probe_issues(probe: Probe | None) -> list[Issue]:
    if probe is None:
        return []
    words = Message(
        "the torch probes the sheet before each pierce; its switch is assumed to trip {:g} mm after contact; "
        "measure this distance, and set probe.switch_offset in the machine profile",
        probe.switch_offset,
    )
    return [Issue("L618", words, "", Severity.NOTE)]


def _lowering_time(machine: Machine, torch: TorchSetup) -> float:
    """Return the time that each cut needs to lower the head, touch off and retract, s."""
    data, probe, clearance = torch.data, torch.probe, torch.clearance
    velocity, acceleration = machine.rapid_velocity[2], machine.acceleration[2] * machine.acceleration_factor
    strokes = [clearance - data.pierce_height, clearance - data.cut_height]
    finding = 0.0
    if probe is not None:
        finding = trapezoid_time(clearance + probe.switch_offset, probe.feed, acceleration)
        strokes[0] = data.pierce_height + probe.switch_offset
    return finding + sum(trapezoid_time(max(stroke, 0.0), velocity, acceleration) for stroke in strokes)


def with_size_and_zones(sheet: Sheet, options: CutOptions, zones: NDArray[np.float64]) -> Sheet:
    """Return the sheet with the size in `options` and with additional keep-out zones, float64[k, 4], mm.

    Raises OptionError if the size is invalid. Raises PlanError if a contour lies outside a sheet of this size.
    """
    outline = sheet.outline
    if options.sheet_size:
        width, height = parse_sheet_size(options.sheet_size)
        outline = Polyline.of_points([(0, 0), (width, 0), (width, height), (0, height)], closed=True)
        for number, c in enumerate(sheet.contours, 1):
            low_x, low_y, high_x, high_y = c.path.extents
            if min(low_x, low_y) < -1e-6 or high_x > width + 1e-6 or high_y > height + 1e-6:
                raise PlanError(
                    "contour {} (part {}) reaches from ({:.6g}, {:.6g}) to "
                    "({:.6g}, {:.6g}), outside the sheet of {:g} × {:g} mm; "
                    "give a larger --sheet-size, or move the drawing with --origin",
                    number,
                    c.part,
                    low_x,
                    low_y,
                    high_x,
                    high_y,
                    width,
                    height,
                )
    added = tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in zones)
    return replace(sheet, outline=outline, zones=(*sheet.zones, *added))


def parse_sheet_size(text: str) -> Point:
    """Parse the size of a sheet, such as ``3000x1500``.

    Return width and height, mm. Raises OptionError for other text.
    """
    try:
        width, height = (float(word) for word in text.lower().replace("×", "x").removesuffix("mm").split("x"))
    except ValueError:
        raise OptionError("--sheet-size: '{}' is not a size such as 3000x1500", text) from None
    if not (0.0 < width < 1e6 and 0.0 < height < 1e6):
        raise OptionError("--sheet-size: '{}' is out of range", text)
    return width, height
