"""The report page: one HTML file with everything inside, and drawings as files of their own."""

from __future__ import annotations

import base64
import hashlib
from typing import Any

from leafcut.model.cutting import CutPlan
from leafcut.model.outcome import Measure, Outcome
from leafcut.processes.pocket.report import pocket_page
from leafcut.processes.pocket.report.pocket_words import pocket_counts_words
from leafcut.processes.sheet.report import sheet_page
from leafcut.processes.sheet.report.cut_words import cut_counts_words
from leafcut.processes.sheet.report.sheet_drawing import build_sheet_scene, sheet_drawing
from leafcut.processes.sheet.report.sheet_page import plan_words, sheet_size
from leafcut.report import views
from leafcut.report.colours import drawing_css, style_sheet
from leafcut.report.drawing import RAMP, Scene, Which, build_scene, cut_tools, drawing, tool_class
from leafcut.report.svg import element
from leafcut.report.wording import (
    BEAMS,
    algorithm_words,
    clean,
    counts_words,
    length_words,
    order_words,
    staying_words,
    time_words,
)


def write_page(outcome: Outcome) -> str:
    """Return the report as one HTML page that needs nothing else: no script, no request, styles and drawings inside.

    Everything from files is escaped by the template or by `svg.element`; a content security policy lets nothing run.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    plan = outcome.cut_plan
    css = drawing_css() + style_sheet("page.css") + _more_css(outcome)
    environment = Environment(
        loader=PackageLoader("leafcut.report", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # What our own functions drew is escaped already; the mark of it is given here, once, and nowhere else.
    environment.filters["drawn"] = Markup
    page = environment.get_template("page.html.jinja")
    return page.render(css=css, css_hash=_hash(css), **_content(outcome), **_work(outcome, plan))


def path_svg(outcome: Outcome, which: Which) -> str:
    """Return the path ``before`` or ``after`` over the holes, the sheet or the pockets, as a stand-alone SVG file."""
    plan = outcome.cut_plans[0 if which == "before" else -1] if outcome.cut_plans else None
    if plan is not None:
        known = [p for p in outcome.cut_plans if p is not None]
        words = plan_words(outcome, 0 if which == "before" else 2)
        svg, css = sheet_drawing(build_sheet_scene(known), plan, which, words, size=True), style_sheet("sheet.css")
    elif outcome.pocket_plans:
        svg, css = pocket_page.pocket_svg(outcome, which), style_sheet("pocket.css")
    else:
        svg, css = drawing(build_scene(outcome), which, _path_words(outcome, which), size=True), ""
    style = element("style", drawing_css() + css)
    head, title, rest = svg.partition("</title>")
    return f"{head}{title}{style}{rest}\n"


def _more_css(outcome: Outcome) -> str:
    """Return the styles of what only this kind of work has."""
    if outcome.pocket_plans:
        return style_sheet("pocket.css")
    return style_sheet("sheet.css") if outcome.cut_plan is not None else ""


def _hash(css: str) -> str:
    return base64.b64encode(hashlib.sha256(css.encode()).digest()).decode()


def _path_words(outcome: Outcome, which: Which) -> str:
    order = f"the {order_words(outcome)}’s order" if which == "before" else "leafcut’s order"
    return f"Path of {clean(outcome.part.name)} in {order}"


def _content(outcome: Outcome) -> dict[str, Any]:
    """Return what the page says of any work."""
    return {
        "name": clean(outcome.part.name),
        "came_in": order_words(outcome),
        "source": clean(outcome.part.source),
        "output": clean(outcome.output),
        "sha256": outcome.program_sha256,
        "machine": clean(outcome.machine.name),
        "machine_words": clean(outcome.machine.description),
        "dialect": clean(outcome.dialect),
        "process": clean(outcome.process),
        "algorithm": "" if _no_choice(outcome) else clean(algorithm_words(outcome)),
        "proof": "read back and simulated" if outcome.pocket_plans else "read back, same work",
        "seed": outcome.seed,
        "version": clean(outcome.version),
        "seconds": time_words(outcome.seconds),
        "verified": outcome.verified,
        "options": [(clean(flag), clean(value)) for flag, value in outcome.options.items()],
        "searches": [] if _no_choice(outcome) else views.searches(outcome),
        "left_out": max(0, len(outcome.operations) - views.MOST_SEARCHES),
        "sections": any(o.lines for o in outcome.operations),
        "workers": views.workers(outcome) if not _no_choice(outcome) else {"rows": []},
        "staying": staying_words(outcome),
        "issues": views.issues(outcome),
        "program": views.program(outcome),
    }


def _no_choice(outcome: Outcome) -> bool:
    """Return whether there is but one region of one pocket: nothing was ordered."""
    return bool(outcome.pocket_plans) and all(len(o.solution.nodes) == 1 for o in outcome.operations)


def _work(outcome: Outcome, plan: CutPlan | None) -> dict[str, Any]:
    """Return what the page says of cuts in a sheet, or of holes and the paths of a program."""
    if plan is not None:
        return {
            "counts": cut_counts_words(plan),
            "size": sheet_size(plan),
            "saved": sheet_page.saved(outcome, plan),
            "orders": sheet_page.cards(outcome),
            "way": "Between cuts",
            "sheet": sheet_page.sheet_content(outcome, plan),
            "pocket": None,
        }
    if outcome.pocket_plans:
        return {
            "counts": pocket_counts_words(outcome),
            "size": pocket_page.pocket_size(outcome),
            "saved": pocket_page.saved(outcome),
            "orders": pocket_page.cards(outcome),
            "way": "Rapids",
            "sheet": None,
            "pocket": pocket_page.pocket_content(outcome),
        }
    scene = build_scene(outcome)
    return {
        "sheet": None,
        "pocket": None,
        "way": "Travel",
        "counts": counts_words(outcome),
        "size": _size(outcome, scene),
        "drawn": bool(outcome.part.holes or outcome.part.slots or len(scene.after.points)),
        "saved": views.saved(outcome),
        "orders": views.orders(outcome),
        "times": views.times(outcome),
        "before": drawing(scene, "before", _path_words(outcome, "before"), holes="=holes"),
        "after": drawing(scene, "after", _path_words(outcome, "after"), holes="#holes"),
        "wide": scene.frame.wide,
        "travel": [_travel_words(outcome, measure) for measure in (outcome.before, outcome.after)],
        "legend": _legend(outcome, scene),
        "tools": views.tools(outcome, scene),
        "tools_say": views.tools_say(outcome),
        "tools_left_out": max(0, len(outcome.operations) - views.MOST_TOOL_ROWS),
    }


def _travel_words(outcome: Outcome, measure: Measure) -> str:
    return f"{length_words(measure.travel_mm)} {'with the beam off' if outcome.process in BEAMS else 'travel'}"


def _size(outcome: Outcome, scene: Scene) -> str:
    if outcome.certificate is not None:
        return f"{scene.extent[0]:.4g} × {scene.extent[1]:.4g} mm"
    x0, y0, x1, y1 = outcome.part.extents
    return f"{x1 - x0:.4g} × {y1 - y0:.4g} mm between centres"


def _legend(outcome: Outcome, scene: Scene) -> dict[str, Any]:
    """Return what the drawings show; only what is there is explained."""
    # A hole's colour is that of its last tool, so a tool that is always followed by another one colours nothing.
    shown = {d.tool for d in scene.dots} | {tool for tool, _, _ in scene.slots}
    cutting = cut_tools(scene)
    shown |= set(cutting.values())
    holes = {d.tool for d in scene.dots} | {tool for tool, _, _ in scene.slots}
    entries = [
        (tool_class(scene, t), _tool_words(outcome, scene.tools[t]), t not in holes) for t in sorted(shown) if t >= 0
    ]
    if -1 in shown:
        entries.append(("idle", "not machined", False))
    return {
        "ramp": None if scene.numbered else [f"r{i}" for i in range(0, RAMP, 3)],
        "cuts": bool(len(scene.after.cuts) or len(scene.before.cuts)) and not cutting,
        "stops": bool(len(scene.after.stops)),
        "tools": entries,
        "enlarged": scene.enlarged,
        "unsized": scene.unsized,
    }


def _tool_words(outcome: Outcome, number: int) -> str:
    """Return ``T1 drill Ø6.35, 70 holes and 2 slots``, a tool's operations taken together."""
    mine = [o for o in outcome.operations if o.tool.number == number]
    return f"{views.tool_words(mine[0].tool)}, {' and '.join(views.work_words(o) for o in mine[:3])}"
