"""Verify a pocketing program, and report changed entries, required holes and uncut areas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from leafcut.errors import count_of
from leafcut.message import Message
from leafcut.model.issue import Issue, MissingWork, Severity
from leafcut.model.pocket import UNCOVERED
from leafcut.model.toolpath import Toolpath
from leafcut.processes.job import refuse_differences
from leafcut.processes.pocket.job import PocketJob, PocketMotion, raise_path, required_holes
from leafcut.processes.pocket.plan.rules import finishing_levels
from leafcut.processes.zones import crossing_heights, parse_zones
from leafcut.proof.program import check_program, interpret_written_program
from leafcut.report.wording import area_words
from leafcut.units import MM_PER_INCH

if TYPE_CHECKING:
    from leafcut.material.removal import Removal
    from leafcut.processes.milling.entries import Descent
    from leafcut.processes.pocket.proof.chips import MeasuredChips


#: Maximum number of uncut areas per pocket that are reported with their positions.
NAMED_PLACES = 3


def required_hole_lines(job: PocketJob, descents: Sequence[Descent]) -> list[str]:
    """Return a line for the program header for each hole that must be drilled before milling."""
    scale, unit = (MM_PER_INCH, "in") if job.run.settings.post.output_units == "inch" else (1.0, "mm")
    return [
        Message(
            "needs a hole at X{:.4f} Y{:.4f}, {:.4g} {} or wider, {:.4g} {} deep",
            x / scale,
            y / scale,
            job.data.tool.diameter / scale,
            unit,
            -bottom / scale,
            unit,
        )
        for (x, y), bottom in required_holes(descents).items()
    ]


def prove_pockets(
    job: PocketJob, motion: PocketMotion, text: str
) -> tuple[Toolpath, list[Issue], MeasuredChips | None]:
    """Compare the program with the planned motion, and simulate the program.

    Returns
    -------
    toolpath
        The toolpath read back from the program.
    issues
        Warnings about uncut areas.
    chips
        The measured chips, or None for a constant feed.

    Raises
    ------
    VerifyError
        The program has differences, gouges or dangerous moves. The message gives their number and describes the
        first.
    """
    from leafcut.processes.pocket.proof.pocket import (
        check_pockets,
        depth_differences,
        fast_cut_differences,
        gouge_differences,
        simulate_levels,
        step_over_differences,
        stock_top_differences,
    )

    job.run.report(Message("verifying"))
    heights, tool = job.heights, job.data.tool
    written = interpret_written_program(text, job.dialect)
    refuse_differences(
        check_program(
            motion.path,
            written,
            job.dialect,
            job.run.machine,
            job.run.settings.post.output_units,
            zones=parse_zones(job.run.settings.job.keep_out),
            zone_height=crossing_heights(job.run.settings.job.keep_out, heights.clearance + job.top),
            tools=(tool,),
            milled=True,
            surface_z=job.top,
        )
    )
    whole, written = written, raise_path(written, -job.top)
    pockets, levels = job.part.pockets, [one.levels for one in job.levels]
    if job.solid is not None:
        refuse_differences(
            stock_top_differences(job.solid.milled, job.tops, job.solid.pockets, job.solid.triangles, job.rules.radius)
        )
    refuse_differences(
        check_pockets(written, pockets, job.finish_rules, [-one.floor for one in job.levels], heights.retract, job.tops)
    )
    refuse_differences(
        depth_differences(written, job.finish_rules, max(one.step for one in job.levels), pockets, job.tops)
    )
    finishing = [finishing_levels(one, tool.diameter) if job.rules.stock else () for one in job.levels]
    simulated = simulate_levels(written, pockets, job.finish_rules, levels, finishing)
    chips = None
    if job.limits is None:
        refuse_differences(fast_cut_differences(written, job.finish_rules, tool.feed))
    else:
        from leafcut.processes.pocket.proof.chips import measure_chips

        chips = measure_chips(
            written, job.finish_rules, job.limits, tool, sorted({z for one in (*levels, *finishing) for z in one})
        )
        refuse_differences(chips.wrong)
    refuse_differences(gouge_differences(simulated, pockets))
    refuse_differences(step_over_differences(simulated, pockets, job.finish_rules))
    lowest = [(level.number, level.removal) for level in simulated if level.z == job.levels[level.number].floor]
    return whole, _uncut_area_issues(job, lowest), chips


def _uncut_area_issues(job: PocketJob, removed: list[tuple[int, Removal]]) -> list[Issue]:
    from leafcut.geometry.regions import polygons

    issues = []
    for number, removal in removed:
        share = 100.0 * removal.uncovered.area / removal.reachable.area if removal.reachable.area > 0.0 else 0.0
        if share <= UNCOVERED:
            continue
        left = sorted(polygons(removal.uncovered), key=lambda piece: -piece.area)
        points = [piece.representative_point() for piece in left[:NAMED_PLACES]]
        at = ", ".join(f"({point.x:.2f}, {point.y:.2f})" for point in points)
        more = Message(" and {}", count_of(len(left) - NAMED_PLACES, "more place")) if len(left) > NAMED_PLACES else ""
        words = Message(
            "{}: {} remain uncut ({:.2f} %)", job.part.pockets[number].label, area_words(removal.uncovered.area), share
        )
        work = MissingWork("place", len(left), tuple((point.x, point.y) for point in points))
        issues.append(Issue("L711", words, Message("near {}{}", at, more), missing=work))
    return issues


def exact_stop_notes(job: PocketJob) -> list[Issue]:
    """Return a note if the tool stops after every move, but would keep moving with enough stock on the walls."""
    if not job.dialect.rounding or job.max_corner_rounding <= job.rules.stock:
        return []
    words = Message(
        "programs for {} stop after every move (G61), because G64 would round corners into the walls by up to "
        "{:.2g} mm at this feed; set --stock to this value to rough without stops",
        job.dialect.name,
        job.max_corner_rounding,
    )
    return [Issue("L704", words, severity=Severity.NOTE)]


def entry_issues(descents: Sequence[Descent]) -> list[Issue]:
    """Return issues about entry moves that differ from the requested kind, and about holes to drill first."""
    changed = [d for d in descents if d.kind != d.asked]
    issues = []
    for kind in dict.fromkeys(d.kind for d in changed):
        places = list(dict.fromkeys(d.place for d in changed if d.kind == kind))
        asked = next(d.asked for d in changed if d.kind == kind)
        words = Message("there is no room for a {}, so the entry was changed to a {}", asked, kind)
        more = Message(", and at {} more", len(places) - 1) if len(places) > 1 else ""
        severity = Severity.WARNING if kind == "plunge" else Severity.NOTE
        issues.append(
            Issue("L702", words, Message("at ({:.3f}, {:.3f}){}", places[0][0], places[0][1], more), severity)
        )
    if needed := required_holes(descents):
        words = Message("{} holes", len(needed)) if len(needed) > 1 else Message("a hole")
        places = list(needed)[:4]
        at = "; ".join(f"({x:.3f}, {y:.3f})" for x, y in places) + (" …" if len(needed) > 4 else "")
        issues.append(
            Issue(
                "L703",
                Message("drill {} to the depth of the pocket before you run this program", words),
                Message("at {}", at),
            )
        )
    return issues
