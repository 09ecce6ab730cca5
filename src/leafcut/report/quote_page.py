"""Write a quote as a self-contained HTML page for A4 paper, and as a fact for the summary and the JSON answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.fact import Fact
from leafcut.model.quote import PartCost, Quote, QuoteLine
from leafcut.report.styles import css_hash, page_templates, style_sheet
from leafcut.report.svg import STEPS, element, scaled_group_element, segments_path_data, svg_number, title_element
from leafcut.report.wording import count_text, replace_unprintable, time_words

#: Width and height of the picture of a part, user units.
_WIDTH, _HEIGHT = 150.0, 96.0
_MARGIN = 3.0
#: Separator of thousands: a narrow no-break space.
_THOUSANDS = "\u202f"
#: Chord error of arcs in a picture, user units.
_CHORD = 0.05


def quote_page_html(quote: Quote) -> str:
    """Write a quote as a self-contained HTML page. It needs no scripts or external files.

    The template and `svg.element` escape all text from files, and a content security policy blocks scripts. The page
    shows prices, but neither costs nor the markup.
    """
    css = style_sheet("quote.css")
    return (
        page_templates("leafcut.report")
        .get_template("quote.html.jinja")
        .render(
            css=css,
            css_hash=css_hash(css),
            seller=[replace_unprintable(line) for line in quote.seller],
            made=quote.made.isoformat(),
            valid_until=quote.valid_until.isoformat(),
            currency=replace_unprintable(quote.currency),
            material=_material_words(quote.material),
            supplied=quote.is_material_supplied,
            thickness=f"{quote.thickness:g} mm",
            rows=[_row(line) for line in quote.lines],
            weight=_at_most(weight_words(quote.weight_kg), any(line.part.lighter for line in quote.lines)),
            total=price_words(quote.total),
            terms=[replace_unprintable(line) for line in quote.terms],
        )
    )


def quote_fact(quote: Quote) -> Fact:
    """Return the quote as a fact for the summary and the JSON answer."""
    words = Message(
        "{} {} for {}, valid until {}",
        price_words(quote.total),
        replace_unprintable(quote.currency),
        count_text(quote.quantity, "part"),
        quote.valid_until.isoformat(),
    )
    return Fact("quote", quote_as_json(quote), "", words, Message("Quote"))


def quote_as_json(quote: Quote) -> dict[str, Any]:
    """Return a quote as JSON data. `cost` and `setup_cost` are for the shop; the page does not contain them."""
    return {
        "currency": quote.currency,
        "date": quote.made.isoformat(),
        "valid_until": quote.valid_until.isoformat(),
        "material": quote.material,
        "thickness_mm": quote.thickness,
        "runs": quote.runs,
        "parts": [
            {
                "name": str(line.part.name),
                "quantity": line.quantity,
                "outlines": line.part.outlines,
                "time_s_each": line.time_s,
                "weight_kg_each": line.part.weight_kg,
                "price_each": line.price,
                "price": line.total,
            }
            for line in quote.lines
        ],
        "price": quote.total,
        "cost": quote.cost,
        "setup_cost": quote.setup_cost,
        "markup_percent": quote.markup,
    }


def price_words(price: float) -> str:
    """Format a price with two decimals. A narrow space separates thousands, because commas have two meanings."""
    return f"{price:,.2f}".replace(",", _THOUSANDS)


def weight_words(kg: float) -> str:
    """Format a weight, kg, in grams below 1 kg."""
    if kg >= 1.0:
        return f"{kg:,.2f} kg".replace(",", _THOUSANDS)
    grams = 1000.0 * kg
    return f"{grams:.0f} g" if grams >= 10.0 else f"{grams:.2g} g"


def _at_most(words: str, lighter: bool) -> str:
    """Return a weight that is an upper limit if the part is `lighter`."""
    return f"at most {words}" if lighter else words


def _material_words(name: str) -> str:
    stem = name.replace("\\", "/").rpartition("/")[2].removesuffix(".toml")
    return replace_unprintable(stem.replace("_", " "))


def _row(line: QuoteLine) -> dict[str, str]:
    part = line.part
    return {
        "name": replace_unprintable(part.name),
        "note": f"set of {part.outlines} parts" if part.outlines > 1 else "",
        "picture": part_picture(part),
        "size": _size_words(part.edges),
        "quantity": f"{line.quantity:,}".replace(",", _THOUSANDS),
        "weight": _at_most(weight_words(part.weight_kg), part.lighter),
        "time": time_words(line.time_s),
        "price": price_words(line.price),
        "total": price_words(line.total),
    }


def _size_words(edges: Sequence[Polyline]) -> str:
    x0, y0, x1, y1 = _box(edges)
    return f"{round(x1 - x0, 1):.8g} × {round(y1 - y0, 1):.8g} mm"


def _box(edges: Sequence[Polyline]) -> tuple[float, float, float, float]:
    boxes = [edge.extents for edge in edges]
    x0, y0, x1, y1 = (pick(box[k] for box in boxes) for k, pick in enumerate((min, min, max, max)))
    return x0, y0, x1, y1


def part_picture(part: PartCost) -> str:
    """Draw a part as an SVG element: its area with openings, and its engraved lines."""
    x0, y0, x1, y1 = _box(part.edges)
    scale = min((_WIDTH - 2 * _MARGIN) / max(x1 - x0, 1e-9), (_HEIGHT - 2 * _MARGIN) / max(y1 - y0, 1e-9))
    width, height = (x1 - x0) * scale + 2 * _MARGIN, (y1 - y0) * scale + 2 * _MARGIN

    def path_data(path: Polyline) -> str:
        points = path.flattened(_CHORD / scale)
        drawn = np.stack([(points[:, 0] - x0) * scale + _MARGIN, (y1 - points[:, 1]) * scale + _MARGIN], axis=-1)
        return segments_path_data(np.stack([drawn[:-1], drawn[1:]], axis=1))

    area = "".join(f"{path_data(edge)}z" for edge in part.edges)
    lines = "".join(map(path_data, part.lines))
    return element(
        "svg",
        title_element(part.name),
        scaled_group_element(
            element("path", d=area, class_="area", stroke_width=float(STEPS)),
            *([element("path", d=lines, class_="lines", stroke_width=float(STEPS))] if lines else []),
        ),
        viewBox=f"0 0 {svg_number(width)} {svg_number(height)}",
        width=width,
        height=height,
        role="img",
    )
