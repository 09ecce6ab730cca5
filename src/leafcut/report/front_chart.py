"""Draw the Pareto front of each tool (time, cost, tool life) with its speeds and feeds."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from leafcut.errors import OptionError
from leafcut.geometry.arrays import Point
from leafcut.model.cutting_front import CuttingData, CuttingPoint, ToolFront
from leafcut.report.cutting_data_report import points_to_show
from leafcut.report.drawing import RAMP
from leafcut.report.styles import drawing_css
from leafcut.report.svg import (
    centred_text_element,
    element,
    svg_number,
    text_element,
    tick_label,
    tick_step,
    ticks,
    title_element,
)
from leafcut.units import SECONDS_PER_MINUTE, format_time

#: Width and height of a panel, height of the header above a tool's two panels, and margins, user units.
_WIDE, _HIGH, _HEAD = 430.0, 290.0, 46.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 62.0, 16.0, 14.0, 44.0
_FOOT = 58.0
#: Margin around the data, as a share of its range.
_MARGIN = 0.07
_MAX_POINTS = 600
#: Maximum distance between the given point and the front, as a multiple of the front's range. A point farther away is
#: not drawn.
_MAX_DISTANCE = 2.0
#: Positions of a label relative to its mark, the best first, as (whether it is on the right, vertical shift in user
#: units).
_LABEL_POSITIONS = tuple((right, float(up)) for up in (0, -13, 13, -26, 26) for right in (True, False))
#: Distance of labels from their marks, and width of a letter, user units.
_OFF, _LETTER = 11.0, 6.3
_SECONDS_PER_HOUR = 3600.0
_STYLE = """
svg.front { background: var(--page); }
.front .card { fill: var(--card); stroke: var(--line); }
.front .gridline { stroke: var(--line); stroke-width: 1; }
.front .dots { stroke-width: 5; }
.front .swatch { stroke-width: 9; stroke-linecap: butt; }
.front .ring { fill: var(--card); stroke: var(--ink); stroke-width: 1.8; }
.front .chosen { fill: var(--cut); stroke: var(--card); stroke-width: 2; }
.front .own { fill: var(--card); stroke: var(--ink-2); stroke-width: 1.6; }
.front .name { fill: var(--ink); font-weight: 700; font-size: 14px; }
.front .label { fill: var(--ink); font-weight: 600; paint-order: stroke; stroke: var(--card); stroke-width: 4;
  stroke-linejoin: round; }
"""


def check_plot_extension(file: str | Path | None) -> None:
    """Raise OptionError unless the file name ends in ``.svg``."""
    if file is not None and Path(file).suffix.lower() != ".svg":
        raise OptionError(
            "--plot: '{}' is not a picture that can be written; name a file ending in .svg", Path(file).name
        )


#: A box: left, top, right, bottom, user units.
_Box = tuple[float, float, float, float]


#: Functions that return the values on the axes of the panels.
_AXIS_VALUES: tuple[Callable[[CuttingPoint], float], ...] = (
    lambda point: point.time,
    lambda point: point.cost,
    lambda point: point.rpm,
    lambda point: point.feed,
)


@dataclass(frozen=True)
class _Axis:
    """Maps values to user units along a side of a panel."""

    low: float
    high: float
    start: float
    end: float

    @classmethod
    def covering(cls, values: Sequence[float], start: float, end: float) -> _Axis:
        low, high = min(values), max(values)
        margin = _MARGIN * ((high - low) or abs(high) or 1.0)
        return cls(max(low - margin, 0.0), high + margin, start, end)

    def position_at(self, value: float) -> float:
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)

    def ticks(self) -> list[tuple[float, str]]:
        step = tick_step(self.high - self.low, 5)
        return [(value, tick_label(value, step)) for value in ticks(self.low, self.high, step)]


def front_svg(data: CuttingData) -> str:
    """Draw the Pareto fronts of all tools as a stand-alone SVG with two panels for each tool.

    The left panel plots the cost of a part against its time. The right panel plots the feed rate against the spindle
    speed. The colour stands for the tool life, from violet (shortest) to teal (longest).
    """
    lives = [point.life for tool in data.tools for point in tool.points]
    shade = _colour_scale(min(lives), max(lives))
    width, row_height = 2 * _WIDE, _HEAD + _HIGH
    rows = [
        element("g", _tool_panels_svg(tool, data, shade), transform=f"translate(0 {svg_number(k * row_height)})")
        for k, tool in enumerate(data.tools)
    ]
    bottom = len(rows) * row_height
    height = bottom + _FOOT
    words = f"Speeds and feeds for {data.material.name} on {data.machine.name}"
    return (
        element(
            "svg",
            title_element(words),
            element("style", drawing_css() + _STYLE),
            element("rect", x=0.0, y=0.0, width=width, height=height, fill="var(--page)"),
            *rows,
            _legend_svg(min(lives), max(lives), bottom, any(map(_visible_given_point, data.tools))),
            xmlns="http://www.w3.org/2000/svg",
            viewBox=f"0 0 {svg_number(width)} {svg_number(height)}",
            width=width,
            height=height,
            class_="drawing front",
            role="img",
        )
        + "\n"
    )


def _colour_scale(shortest: float, longest: float) -> Callable[[float], int]:
    span = math.log(longest / shortest) if longest > shortest else 1.0
    return lambda life: round((RAMP - 1) * math.log(life / shortest) / span)


def _tool_panels_svg(front: ToolFront, data: CuttingData, shade: Callable[[float], int]) -> str:
    holes = f"{front.holes} hole{'s' * (front.holes != 1)}" if front.holes else "1 m of cut"
    head = text_element(front.tool.label, 16, 30, class_="name")
    description = f"{front.tool_material.value} · {holes} · {data.material.name} on {data.machine.name}"
    if front.given is not None:
        description += f" · as given {format_time(front.given.time)}, {front.given.cost:.2f}"
    beside = text_element(description, 2 * _WIDE - 16, 30, text_anchor="end")
    points = _every_nth_point(front.points, front.chosen)
    left = _panel_svg(
        front,
        points,
        shade,
        0.0,
        lambda p: p.time / _time_unit(points)[0],
        lambda p: p.cost,
        (f"time, {_time_unit(points)[1]}", "cost"),
    )
    right = _panel_svg(
        front,
        points,
        shade,
        _WIDE,
        lambda p: p.rpm,
        lambda p: p.feed * SECONDS_PER_MINUTE,
        ("spindle speed, rpm", "feed rate, mm/min"),
    )
    return head + beside + left + right


def _time_unit(points: Sequence[CuttingPoint]) -> tuple[float, str]:
    longest = max(point.time for point in points)
    if longest >= 2 * _SECONDS_PER_HOUR:
        return _SECONDS_PER_HOUR, "h"
    return (SECONDS_PER_MINUTE, "min") if longest >= 4 * SECONDS_PER_MINUTE else (1.0, "s")


def _every_nth_point(points: tuple[CuttingPoint, ...], chosen: int) -> list[CuttingPoint]:
    last = len(points) - 1
    if last < _MAX_POINTS:
        return list(points)
    kept = {i * last // (_MAX_POINTS - 1) for i in range(_MAX_POINTS)} | {chosen}
    return [points[i] for i in sorted(kept)]


def _panel_svg(
    front: ToolFront,
    points: list[CuttingPoint],
    shade: Callable[[float], int],
    left: float,
    x_of: Callable[[CuttingPoint], float],
    y_of: Callable[[CuttingPoint], float],
    names: tuple[str, str],
) -> str:
    start, end = left + _LEFT, left + _WIDE - _RIGHT
    bottom, top = _HEAD + _HIGH - _BOTTOM, _HEAD + _TOP
    given = _visible_given_point(front)
    shown = points if given is None else [*points, given]
    x = _Axis.covering([x_of(point) for point in shown], start, end)
    y = _Axis.covering([y_of(point) for point in shown], bottom, top)
    card = element("rect", x=start, y=top, width=end - start, height=bottom - top, class_="card")
    grid, numbers = [], []
    for value, words in y.ticks():
        grid.append(f"M{svg_number(start)} {svg_number(y.position_at(value))}H{svg_number(end)}")
        numbers.append(text_element(words, start - 7, y.position_at(value), text_anchor="end", dy="0.34em"))
    for value, words in x.ticks():
        grid.append(f"M{svg_number(x.position_at(value))} {svg_number(top)}V{svg_number(bottom)}")
        numbers.append(centred_text_element(words, x.position_at(value), bottom + 16, left + _WIDE))
    middle = (top + bottom) / 2
    axes = text_element(names[0], (start + end) / 2, bottom + 34, text_anchor="middle") + text_element(
        names[1],
        left + 16,
        middle,
        text_anchor="middle",
        transform=f"rotate(-90 {svg_number(left + 16)} {svg_number(middle)})",
    )

    def place(point: CuttingPoint) -> Point:
        return x.position_at(x_of(point)), y.position_at(y_of(point))

    frame = (start, top, end, bottom)
    return (
        card
        + element("path", d="".join(grid), class_="gridline")
        + "".join(numbers)
        + axes
        + _dots_svg(points, place, shade)
        + _draw_marks(front, [place(point) for point in points], place, frame)
    )


def _visible_given_point(front: ToolFront) -> CuttingPoint | None:
    """Return the given speed and feed.

    Return None if the point is so far from the front that the front would become too small.
    """
    if front.given is None:
        return None
    for value_of in _AXIS_VALUES:
        values = [value_of(point) for point in front.points]
        reach = _MAX_DISTANCE * ((max(values) - min(values)) or max(values))
        if not min(values) - reach <= value_of(front.given) <= max(values) + reach:
            return None
    return front.given


def _dots_svg(points: list[CuttingPoint], place: Callable[[CuttingPoint], Point], shade: Callable[[float], int]) -> str:
    by_colour: dict[int, list[str]] = {}
    for point in points:
        px, py = place(point)
        by_colour.setdefault(shade(point.life), []).append(f"M{svg_number(px)} {svg_number(py)}h0")
    return "".join(element("path", d="".join(d), class_=f"dots r{c}") for c, d in sorted(by_colour.items()))


def _draw_marks(front: ToolFront, dots: list[Point], place: Callable[[CuttingPoint], Point], frame: _Box) -> str:
    given = _visible_given_point(front)
    place_of = {name: place(point) for name, point in points_to_show(front).items() if name != "as given"}
    if given is not None:
        place_of["as given"] = place(given)
    places: dict[Point, list[str]] = {}
    for name, position in place_of.items():
        places.setdefault(position, []).append(name)
    chosen = place(front.best)
    drawn, labels, boxes = list[str](), list[str](), list[_Box]()
    for (x, y), names in sorted(places.items(), key=lambda item: item[0][1]):
        kind = "chosen" if (x, y) == chosen else "own" if names == ["as given"] else "ring"
        drawn.append(_diamond_svg(x, y) if kind == "own" else element("circle", cx=x, cy=y, r=5.0, class_=kind))
        words = ", ".join(names)
        box, label = _best_label(words, (x, y), dots, [*boxes, *(_mark_box(corner) for corner in places)], frame)
        boxes.append(box)
        labels.append(label)
    if chosen not in places:
        drawn.append(element("circle", cx=chosen[0], cy=chosen[1], r=5.0, class_="chosen"))
    return "".join((*drawn, *labels))


def _mark_box(place: Point) -> _Box:
    return place[0] - 6, place[1] - 6, place[0] + 6, place[1] + 6


def _best_label(words: str, at: Point, dots: list[Point], boxes: list[_Box], frame: _Box) -> tuple[_Box, str]:
    wide = _LETTER * len(words)
    best: tuple[float, _Box, str] | None = None
    for number, (right, up) in enumerate(_LABEL_POSITIONS):
        x, y = at[0] + (_OFF if right else -_OFF), at[1] + 4 + up
        box = (x, y - 11, x + wide, y + 3) if right else (x - wide, y - 11, x, y + 3)
        hidden = sum(box[0] < dx < box[2] and box[1] < dy < box[3] for dx, dy in dots)
        crossed = sum(box[0] < b[2] and b[0] < box[2] and box[1] < b[3] and b[1] < box[3] for b in boxes)
        sticks_out = box[0] < frame[0] or box[2] > frame[2] or box[1] < frame[1] or box[3] > frame[3]
        cost = number + 5.0 * hidden + 100.0 * crossed + 1000.0 * sticks_out
        if best is None or cost < best[0]:
            label = text_element(words, x, y, text_anchor="start" if right else "end", class_="label")
            best = (cost, box, label)
    assert best is not None
    return best[1], best[2]


def _diamond_svg(x: float, y: float) -> str:
    return element("path", d=f"M{svg_number(x)} {svg_number(y - 6)}l6 6l-6 6l-6 -6z", class_="own")


def _legend_svg(shortest: float, longest: float, top: float, has_given: bool) -> str:
    start, wide = 16.0 + 110.0, 180.0
    y = top + 20
    step = wide / (RAMP - 1)
    places = [f"M{svg_number(start + i * step)} {svg_number(y)}h{svg_number(step)}" for i in range(RAMP - 1)]
    steps = [element("path", d=place, class_=f"swatch r{i}") for i, place in enumerate(places)]
    words = (
        text_element("tool life in the cut", 16, y + 4)
        + text_element(format_time(shortest), start, y + 21, text_anchor="start")
        + text_element(format_time(longest), start + wide, y + 21, text_anchor="end")
    )
    x = start + wide + 40
    marks = element("circle", cx=x, cy=y, r=5.0, class_="chosen") + text_element("chosen", x + 12, y + 4)
    x += 82
    marks += element("circle", cx=x, cy=y, r=5.0, class_="ring") + text_element("best for one objective", x + 12, y + 4)
    if has_given:
        x += 168
        marks += _diamond_svg(x, y) + text_element("as given", x + 12, y + 4)
    return "".join(steps) + words + marks
