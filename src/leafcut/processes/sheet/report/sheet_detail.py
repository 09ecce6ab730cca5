"""Detail drawings of single cuts, with the true width of the kerf, the lead-in and the lead-out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leafcut.geometry.arrays import Points
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Cut, CutPlan
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.report.cut_words import cut_name
from leafcut.processes.sheet.report.sheet_drawing import dot_class, path_sections
from leafcut.report.marks import arrow_head
from leafcut.report.svg import STEPS, element, lines_data, nice_step, scaled_group, text, tick_words, title
from leafcut.report.wording import length_words

BoundingBox = tuple[float, float, float, float]

#: Width and height of the window, in user units of the drawing.
_WIDTH, _HEIGHT = 300.0, 190.0
#: Half of the height of the window, in lengths of the lead-in and in kerf widths; and its minimum, mm.
_LEADS, _KERFS, _LEAST = 1.6, 5.0, 4.0
_CHORDS = 0.08
#: Margin around the window within which a wide line may still be visible, in user units.
_BEYOND = 60.0
_ARROW = 4.5
_SMALLEST_DOT = 2.4


@dataclass(frozen=True)
class DetailView:
    """A window on the sheet: its centre in mm, and its scale in user units per mm."""

    middle: tuple[float, float]
    scale: float

    @property
    def box(self) -> BoundingBox:
        """Smallest x and y, followed by the largest x and y, of the window, mm."""
        (x, y), half = self.middle, (0.5 * _WIDTH / self.scale, 0.5 * _HEIGHT / self.scale)
        return (x - half[0], y - half[1], x + half[0], y + half[1])

    def place(self, points: Points) -> Points:
        """Convert points in mm, float64[…, 2], to user units with y pointing down."""
        x, y = self.middle
        placed: Points = np.stack(
            [0.5 * _WIDTH + (points[..., 0] - x) * self.scale, 0.5 * _HEIGHT - (points[..., 1] - y) * self.scale],
            axis=-1,
        )
        return placed

    def shows(self, box: BoundingBox) -> bool:
        """Return whether a box, given in mm, may be visible in the window."""
        own = self.box
        return box[0] <= own[2] and box[2] >= own[0] and box[1] <= own[3] and box[3] >= own[1]

    def edge(self, path: Polyline) -> str:
        """Return the SVG path data of a whole path, in steps of 1 / `report.svg.STEPS` user units."""
        return lines_data(self._segments(path))

    def line(self, path: Polyline) -> str:
        """Return the SVG path data of the visible segments of a path, in steps of 1 / `report.svg.STEPS` user units."""
        segments = self._segments(path)
        low, high = segments.min(axis=1), segments.max(axis=1)
        seen = (low <= (_WIDTH + _BEYOND, _HEIGHT + _BEYOND)).all(axis=1) & (high >= -_BEYOND).all(axis=1)
        return lines_data(segments[seen])

    def _segments(self, path: Polyline) -> Points:
        points = self.place(path.flattened(_CHORDS / self.scale))
        return np.stack([points[:-1], points[1:]], axis=1)


def detailed_cuts(plan: CutPlan) -> list[int]:
    """Return the indices of the cuts to draw in detail: the first hole and the first outline with a lead-in."""
    found: dict[bool, int] = {}
    for number, cut in enumerate(plan.cuts):
        if cut.kind == "cut" and cut.lead_in > 0.0 and cut.contours:
            found.setdefault(plan.sheet.contours[cut.contours[0]].is_hole, number)
    return sorted(found.values())


def cut_detail(plan: CutPlan, number: int) -> dict[str, str]:
    """Return the drawing of the start and end of a cut (``svg``), its ``caption``, and its lead lengths (``words``)."""
    cut = plan.cuts[number]
    half = max(_LEADS * cut.lead_in, _KERFS * plan.data.kerf, _LEAST)
    view = DetailView(cut.path.point_at(cut.lead_in), 0.5 * _HEIGHT / half)
    window = f"window-look-{number}"
    edge = element("rect", x=0.0, y=0.0, width=_WIDTH, height=_HEIGHT)
    near = [c for c in plan.cuts if c is not cut and view.shows(c.path.extents)]
    inside = (
        _part_areas(view, plan.sheet),
        *(_kerf_band(view, c, plan.data.kerf) for c in (*near, cut)),
        _start_marks(view, plan, cut),
    )
    words = f"Cut {number + 1}: {cut_name(plan, cut)}"
    svg = element(
        "svg",
        title(words),
        element("clipPath", edge, id=window),
        element("rect", x=0.0, y=0.0, width=_WIDTH, height=_HEIGHT, class_="look"),
        element("g", *inside, clip_path=f"url(#{window})"),
        _scale_bar(view),
        viewBox=f"0 0 {_WIDTH:g} {_HEIGHT:g}",
        class_="drawing sheet closer",
        role="img",
    )
    return {"svg": svg, "caption": words, "words": _lead_words(cut)}


def _lead_words(cut: Cut) -> str:
    """Return a text with the lengths of the leads, and the length of the path with the torch off.

    For example: ``lead-in 6.0 mm, lead-out 4.0 mm``.
    """
    after = [(kind, high - low) for kind, low, high in path_sections(cut) if low >= cut.lead_out]
    words = [f"lead-in {length_words(cut.lead_in)}"]
    for kind, phrase in (("lead", "lead-out {}"), ("dark", "{} with the torch off")):
        length = sum(part for of_kind, part in after if of_kind == kind)
        words += [phrase.format(length_words(length))] if length > 0.0 else []
    return ", ".join(words)


def _part_areas(view: DetailView, sheet: Sheet) -> str:
    """Draw the visible parts. Each part is an area without its holes."""
    areas: dict[int, str] = {}
    for c in sheet.contours:
        if c.kind == "cut" and c.path.closed and c.part and not c.chamber:
            areas[c.part] = areas.get(c.part, "") + view.edge(c.path) + "z"
    seen = {c.part for c in sheet.contours if view.shows(c.path.extents)}
    return scaled_group(*(element("path", d=data, class_="part rim") for part, data in areas.items() if part in seen))


def _kerf_band(view: DetailView, cut: Cut, kerf: float) -> str:
    """Draw a cut as a band of its true width, with its centreline."""
    lines = []
    for kind, low, high in path_sections(cut):
        data = view.line(cut.path.piece(low, high))
        if kind in ("kerf", "lead", "bridge"):
            lines.append(element("path", d=data, class_=f"{kind} band", stroke_width=kerf * view.scale * STEPS))
        lines.append(element("path", d=data, class_=kind, stroke_width=1.2 * STEPS))
    return scaled_group(*lines)


def _start_marks(view: DetailView, plan: CutPlan, cut: Cut) -> str:
    """Draw the start of a cut, with arrowheads on its lead-in and just after it."""
    x, y = view.place(np.array(cut.path.start)).tolist()
    heads = []
    for at in (0.55 * cut.lead_in, cut.lead_in + 1.1 * max(cut.lead_in, _LEAST)):
        place, (dx, dy) = view.place(np.array(cut.path.point_at(at))).tolist(), cut.path.direction_at(at)
        heads.append(element("path", d=arrow_head((place[0], place[1]), (dx, -dy), _ARROW), class_="kerf-arrow"))
    radius = max(0.5 * plan.data.kerf * view.scale, _SMALLEST_DOT)
    return "".join(heads) + element("circle", cx=x, cy=y, r=radius, class_=dot_class(cut))


def _scale_bar(view: DetailView) -> str:
    step = nice_step(_WIDTH / view.scale, 6)
    length = step * view.scale
    bar = element("path", d=f"M{_WIDTH - 10 - length:.2f} {_HEIGHT - 13}v6m0 -3h{length:.2f}m0 -3v6", class_="bar")
    words = text(
        f"{tick_words(step, step)} mm", _WIDTH - 16 - length, _HEIGHT - 10, text_anchor="end", dy="0.34em", class_="on"
    )
    return bar + words
