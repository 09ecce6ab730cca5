"""Write the report page as a self-contained HTML file, and drawings as separate files."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from PIL import Image

from leafcut.errors import LeafcutError
from leafcut.material.same_stock import stock_differences
from leafcut.material.solid import cut_display_solid
from leafcut.model.issue import missing_work_text
from leafcut.report import views
from leafcut.report.stock_picture import OverStock, stock_png
from leafcut.report.styles import css_hash, drawing_css, page_templates, style_sheet
from leafcut.report.svg import embed_styles
from leafcut.report.wording import (
    COMPILED,
    algorithm_names,
    fact_line,
    fact_value_text,
    replace_unprintable,
    search_time_words,
    time_words,
    title_words,
    verification_limits,
)

if TYPE_CHECKING:
    from leafcut.material.solid import Solid
    from leafcut.model.outcome import Which
    from leafcut.report.path_report import PathReport

#: A command-line option in a message.
_FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]*[a-z]")
#: Tolerance for equal heights of the stock, mm.
_TOLERANCE = 0.01
#: Number of colours in a picture of the stock. More colours would only make the page larger.
_COLOURS = 160


def report_page_html(report: PathReport[Any]) -> str:
    """Write the report as a self-contained HTML page with styles and pictures. It needs no scripts or external files.

    The template and `svg.element` escape all text from files, and a content security policy blocks scripts.
    """
    from markupsafe import Markup, escape

    css = drawing_css() + style_sheet("page.css") + _process_css(report)
    environment = page_templates("leafcut.report", report.package)
    environment.filters["flags"] = lambda words: Markup(_prevent_breaks_in_flags(str(escape(words))))
    page = environment.get_template("page.html.jinja")
    return page.render(css=css, css_hash=css_hash(css), **{**_template_values(report), **report.template_values()})


def _prevent_breaks_in_flags(html: str) -> str:
    """Keep each option in escaped text on one line. Browsers would otherwise break the line after a dash."""
    return _FLAG.sub(r'<span class="flag">\g<0></span>', html)


def path_svg(report: PathReport[Any], which: Which) -> str:
    """Draw the path ``before`` or ``after`` the search, with the work, as a stand-alone SVG."""
    return embed_styles(report.drawing(which), drawing_css() + _process_css(report))


def _process_css(report: PathReport[Any]) -> str:
    return style_sheet(f"{report.template}.css", report.package) if report.package != "leafcut.report" else ""


def _template_values(report: PathReport[Any]) -> dict[str, Any]:
    outcome, facts, savings = report.outcome, report.facts, report.savings_facts()
    return {
        "name": replace_unprintable(outcome.part.name),
        "came_in": report.came_in,
        "source": replace_unprintable(outcome.part.source),
        "output": replace_unprintable(outcome.output),
        "sha256": outcome.program_sha256,
        "machine": replace_unprintable(outcome.machine.name),
        "machine_words": replace_unprintable(outcome.machine.description),
        "dialect": replace_unprintable(outcome.dialect),
        "process": replace_unprintable(outcome.process),
        "algorithm": replace_unprintable(algorithm_names(outcome)) if report.ordered else "",
        "proof": report.proof,
        "template": f"{report.template}.html.jinja",
        "counts": title_words(facts),
        "orders": views.order_card_rows(report.order_rows(), report.known_orders()),
        "tiles": [
            (f.name, fact_value_text(f), f.sentence)
            for f in facts
            if f.name and f not in savings and fact_value_text(f)
        ],
        "savings": [(f.name, fact_line(f)) for f in savings if f.name],
        **report.page_tables(),
        "zero": [f"{name}: {words}" for name, words in (outcome.part.zero.facts() if outcome.part.zero else [])],
        "limits": verification_limits(outcome.issues),
        "seed": outcome.seed,
        "version": replace_unprintable(outcome.version),
        "seconds": time_words(outcome.seconds),
        "search": search_time_words(outcome) if report.ordered else "",
        "compiling": time_words(outcome.compile_seconds) if outcome.compile_seconds >= COMPILED else "",
        "verified": outcome.verified,
        "missing": missing_work_text(outcome.issues),
        "options": [(replace_unprintable(flag), replace_unprintable(value)) for flag, value in outcome.options.items()],
        "searches": views.search_rows(outcome, report.operation_title, report.nearest_neighbour_cost())
        if report.ordered
        else [],
        "left_out": max(0, len(outcome.operations) - views.MAX_SEARCHES),
        "workers": views.worker_rows(outcome) if report.ordered else {"rows": []},
        "issues": views.issue_rows(outcome),
        "program": views.program_excerpt(outcome),
        "stock": stock_pictures(report),
    }


def stock_pictures(report: PathReport[Any]) -> dict[str, Any] | None:
    """Return the pictures of the remaining stock for the page, or None if the stock is unknown.

    ``pictures`` contains the title, data URL and size of each picture. ``same`` is a sentence about the difference
    between the stock before and after the search.
    """
    outcome, stock = report.outcome, report.shown_stock()
    try:
        if report.came_in != "program":
            solid = cut_display_solid(outcome.path_after, stock)
            return {
                "pictures": [_stock_picture("After: leafcut", solid, with_travel=stock.surface is not None)],
                "same": "",
            }
        before = cut_display_solid(outcome.path_before, stock)
        after = cut_display_solid(outcome.path_after, replace(stock, block=(before.block.low, before.block.high)))
    except LeafcutError:
        return None
    wrong = sum(difference.cells for difference in stock_differences(before.after, after.after, _TOLERANCE))
    cells = f"{after.after.heights.size:,} cells of {after.after.cell:.3g} mm"
    return {
        "pictures": [_stock_picture("Before: the program’s order", before), _stock_picture("After: leafcut", after)],
        "same": f"{wrong:,} of {cells} differ." if wrong else f"No difference, in {cells}.",
    }


def _stock_picture(title: str, solid: Solid, *, with_travel: bool = False) -> tuple[str, str, str]:
    x, y = solid.origin
    field = replace(solid.after, x=solid.after.x + x, y=solid.after.y + y)  # in program coordinates, for the axes
    over = None
    if with_travel:
        lines = solid.moves.ends[solid.moves.rapid][:, [0, 1, 3, 4]] + (x, y, x, y)
        over = OverStock(lines, solid.before.heights <= solid.before.floor, solid.held)
    drawn = Image.open(io.BytesIO(stock_png(field, solid.block.high[2], over)))
    out = io.BytesIO()
    drawn.quantize(_COLOURS).save(out, "PNG", optimize=True)
    size = " × ".join(f"{b - a:.1f}" for a, b in zip(solid.block.low, solid.block.high, strict=True))
    if with_travel:
        title = f"{title}, its paths in red{', fixtures in grey' if solid.held.any() else ''}"
    return title, f"data:image/png;base64,{base64.b64encode(out.getvalue()).decode()}", f"{size} mm"
