"""Draw results that have no report page: the path of a program, a tour, a nest, and the remaining stock."""

from __future__ import annotations

import base64
import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from leafcut.material.stock_cut import StockCut
from leafcut.model.nest import NestOutcome
from leafcut.model.simulation import Simulation
from leafcut.model.solution import Solved
from leafcut.report.frame import Frame
from leafcut.report.part_edge import path_segments
from leafcut.report.plan_view import plan_view
from leafcut.report.stock_picture import stock_png
from leafcut.report.styles import drawing_css
from leafcut.report.svg import (
    STEPS,
    element,
    embed_styles,
    scaled_group_element,
    segments_path_data,
    svg_number,
    title_element,
)
from leafcut.report.wording import count_text, replace_unprintable

#: Maximum number of sheets in the drawing of a nest. More sheets would be too small to see.
MAX_SHEETS = 6
#: Gap between two sheets, as a share of the width of the first sheet.
_APART = 0.06
_NO_LINES = np.zeros((0, 2, 2))


def simulation_picture(simulation: Simulation) -> str:
    """Draw the path of a program from above, as a stand-alone SVG."""
    view = plan_view(simulation.path)
    return _segments_svg(f"Path of {simulation.program}", {"rapid": view.rapids, "cut": view.cuts})


def tour_picture(solved: Solved) -> str:
    """Draw a tour through the points of a map, as a stand-alone SVG."""
    places = solved.part.hole_xy[[*solved.solution.nodes, *solved.solution.nodes[:1]]]
    lines = np.stack([places[:-1], places[1:]], axis=1) if len(places) else _NO_LINES
    return _segments_svg(f"Tour of {solved.part.name}", {"rapid": lines})


def nest_picture(outcome: NestOutcome) -> str:
    """Draw the first sheets of the best nest, one above the other, as a stand-alone SVG."""
    best = outcome.nests[0]
    edges, parts, y = [_NO_LINES], [_NO_LINES], 0.0
    for layout in best.layouts[:MAX_SHEETS]:
        sheet = best.stock_of(layout)
        edges += [path_segments(path.moved(0.0, y)) for path in sheet.paths]
        parts += [path_segments(contour.path.moved(0.0, y)) for contour in best.contours(layout)]
        y += (1.0 + _APART) * sheet.width
    shown, every = len(best.layouts[:MAX_SHEETS]), count_text(len(best.layouts), "layout")
    words = f"Nest: {every}" if shown == len(best.layouts) else f"Nest: the first {shown} of {every}"
    return _segments_svg(words, {"plate": np.concatenate(edges), "cut": np.concatenate(parts)})


def stock_picture(stock_cut: StockCut) -> str:
    """Draw the remaining stock from above, coloured by depth, as a stand-alone SVG with an embedded PNG."""
    data = stock_png(stock_cut.field, stock_cut.block.high[2])
    width, height = Image.open(io.BytesIO(data)).size
    address = f"data:image/png;base64,{base64.b64encode(data).decode()}"
    return element(
        "svg",
        title_element(replace_unprintable(f"Stock after {stock_cut.program}")),
        element("image", href=address, width=float(width), height=float(height)),
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {svg_number(width)} {svg_number(height)}",
        width=float(width),
        height=float(height),
        role="img",
    )


def _segments_svg(words: str, lines: dict[str, NDArray[np.float64]]) -> str:
    """Draw segments as a stand-alone SVG. `lines` maps a CSS class to segments, float64[n, 2, 2], mm."""
    points = np.concatenate([segments.reshape(-1, 2) for segments in lines.values()])
    (x0, y0), (x1, y1) = (points.min(axis=0), points.max(axis=0)) if len(points) else np.zeros((2, 2))
    frame = Frame.around_corners((float(x0), float(y0)), (float(x1), float(y1)))
    paths = [
        element("path", d=segments_path_data(frame.to_user_units(segments)), class_=name, stroke_width=float(STEPS))
        for name, segments in lines.items()
        if len(segments)
    ]
    return embed_styles(
        frame.drawing_svg(words, "window", (scaled_group_element(*paths),), "drawing", size=True), drawing_css()
    )
