"""Draw charts of the best cost during a search, and bar charts."""

from __future__ import annotations

import math
from dataclasses import dataclass

from leafcut.message import Message
from leafcut.model.kinds import CutMethod
from leafcut.model.solution import Solution
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
from leafcut.report.wording import cost_words

WIDTH, HEIGHT = 480.0, 230.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 58.0, 10.0, 12.0, 40.0
_MAX_POINTS = 600
#: Minimum improvement for drawing a curve, as a share of the cost. A smaller improvement would be invisible.
_FLAT = 1e-5
#: The time axis is logarithmic if the ratio of the last to the first time exceeds this.
_LOG_FROM = 20.0
_LINE_HEIGHT = 14.0
#: Space for the label at the end of the curve.
_WORDS = 110.0
_EMPTY = 1e-9
#: Vertical margins as a share of the range; the label of the lower bound is below its line.
_MARGIN = 0.08
_SPACE_UNDER_BOUND = 0.14

#: Maps each kind of motion to its displayed name, in stacking order.
TIME_KINDS: dict[str, Message] = {
    "rapid": Message("rapids"),
    "feed": Message("cutting"),
    "dwell": Message("dwell"),
    "tool_change": Message("tool changes"),
    "spindle": Message("spindle"),
}


def names_of_time_kinds(method: str | None) -> dict[str, Message]:
    """Return the names of the kinds of motion for a cutting method. For a spindle, `method` is None."""
    if method is None:
        return TIME_KINDS
    beam = Message("beam on, off") if method == CutMethod.LASER else Message("piercing")
    return TIME_KINDS | {"feed": Message("feed moves"), "spindle": beam}


@dataclass(frozen=True)
class _Axes:
    """The ranges of the axes. `log` states whether the time axis is logarithmic."""

    seconds: tuple[float, float]
    costs: tuple[float, float]
    log: bool

    def x(self, seconds: float) -> float:
        low, high = self.seconds
        seconds = min(max(seconds, low), high)
        part = math.log(seconds / low) / math.log(high / low) if self.log else (seconds - low) / (high - low)
        return _LEFT + part * (WIDTH - _LEFT - _RIGHT)

    def y(self, cost: float) -> float:
        low, high = self.costs
        return _TOP + (high - cost) / (high - low) * (HEIGHT - _TOP - _BOTTOM)


def convergence_chart(solution: Solution, nearest: float | None, words: str) -> str:
    """Draw the best cost over time. Return "" if the search did not improve the cost.

    `nearest` is the cost of the nearest-neighbour order. If it is known, the chart shows it as a dashed line. `words`
    is the title of the chart.
    """
    history = [(max(s, 0.0), c) for s, c in solution.history if math.isfinite(s) and math.isfinite(c)]
    if len(history) < 2 or history[0][1] - history[-1][1] <= _FLAT * abs(history[0][1]):
        return ""
    history = sorted(_thinned_history(history))
    levels = {"nearest neighbour": nearest, "lower bound": solution.lower_bound}
    known = {name: level for name, level in levels.items() if level is not None and math.isfinite(level)}
    under = _SPACE_UNDER_BOUND if "lower bound" in known else _MARGIN
    axes = _fit_axes(history, [*known.values(), *(c for _, c in history)], solution.seconds, under)
    factor, unit = _scale_and_unit(solution.unit, axes.costs[1])
    lines = [_level_line_svg(axes, name, level) for name, level in known.items()]
    return element(
        "svg",
        title_element(words),
        _grid_svg(axes, factor, unit),
        *lines,
        _curve_svg(axes, history, solution.unit),
        *_level_labels(axes, known, solution.unit),
        viewBox=f"0 0 {svg_number(WIDTH)} {svg_number(HEIGHT)}",
        class_="chart",
        role="img",
    )


def _thinned_history(history: list[tuple[float, float]]) -> list[tuple[float, float]]:
    if len(history) <= _MAX_POINTS:
        return history
    last = len(history) - 1
    return [history[i * last // (_MAX_POINTS - 1)] for i in range(_MAX_POINTS)]


def _fit_axes(history: list[tuple[float, float]], costs: list[float], total: float, under: float) -> _Axes:
    end = max(history[-1][0], total if math.isfinite(total) else 0.0)
    end = end if end > 0 else 1.0
    start = min((s for s, _ in history if s > 0), default=end)
    log = end / start > _LOG_FROM
    low, high = min(costs), max(costs)
    margin = high - low if high > low else max(abs(high), 10.0)
    foot = low - under * margin
    return _Axes((start if log else 0.0, end), (max(0.0, foot) if low >= 0 else foot, high + _MARGIN * margin), log)


def _scale_and_unit(unit: str, largest: float) -> tuple[float, str]:
    if unit == "mm":
        return (0.001, "m") if largest >= 10_000 else (1.0, "mm")
    return (1.0 / 60.0, "min") if largest >= 600 else (1.0, "s")


def _grid_svg(axes: _Axes, factor: float, unit: str) -> str:
    bottom = HEIGHT - _BOTTOM
    low, high = (c * factor for c in axes.costs)
    step = tick_step(high - low, 4)
    lines, numbers = [], []
    for value in ticks(low, high, step):
        y = axes.y(value / factor)
        lines.append(f"M{svg_number(_LEFT)} {svg_number(y)}H{svg_number(WIDTH - _RIGHT)}")
        numbers.append(text_element(tick_label(value, step), _LEFT - 7, y, text_anchor="end", dy="0.34em"))
    marks = [f"M{svg_number(_LEFT)} {svg_number(bottom)}H{svg_number(WIDTH - _RIGHT)}"]
    for seconds, words in _second_ticks(axes):
        x = axes.x(seconds)
        marks.append(f"M{svg_number(x)} {svg_number(bottom)}v4")
        numbers.append(centred_text_element(words, x, bottom + 16, WIDTH))
    middle = (_TOP + bottom) / 2
    names = text_element(
        "seconds of search", (_LEFT + WIDTH - _RIGHT) / 2, bottom + 33, text_anchor="middle"
    ) + text_element(
        f"cost, {unit}", 12, middle, text_anchor="middle", transform=f"rotate(-90 12 {svg_number(middle)})"
    )
    return (
        element("path", d="".join(lines), class_="gridline")
        + element("path", d="".join(marks), class_="tick")
        + "".join(numbers)
        + names
    )


def _second_ticks(axes: _Axes) -> list[tuple[float, str]]:
    low, high = axes.seconds
    if not axes.log:
        step = tick_step(high - low, 5)
        return [(v, tick_label(v, step)) for v in ticks(low, high, step)]
    powers = range(math.ceil(math.log10(low) - _EMPTY), math.floor(math.log10(high) + _EMPTY) + 1)
    marks = [(10.0**p, f"{10.0**p:.{max(0, -p)}f}") for p in powers]
    # With fewer than two powers of ten on the axis, mark its ends instead.
    return marks if len(marks) > 1 else [(v, f"{v:.2g}") for v in (low, high)]


def _curve_svg(axes: _Axes, history: list[tuple[float, float]], unit: str) -> str:
    points = [(axes.x(s), axes.y(c)) for s, c in history]
    (x, y), *rest = points
    words = [f"M{svg_number(x)} {svg_number(y)}", *(f"H{svg_number(px)}V{svg_number(py)}" for px, py in rest)]
    end_x, end_y = WIDTH - _RIGHT, points[-1][1]
    words.append(f"H{svg_number(end_x)}")
    # The cost never rises, so there is space above the curve. The label is above the highest step within its width.
    over = [py for (_, py), (next_x, _) in zip(points, [*rest, (end_x, end_y)], strict=True) if next_x > end_x - _WORDS]
    label_y = min([end_y, *over]) - 8
    label_y = label_y if label_y > _TOP + 4 else end_y + 16
    label = text_element(
        f"best {cost_words(history[-1][1], unit)}", end_x - 8, label_y, text_anchor="end", class_="value"
    )
    dot = element("circle", cx=end_x, cy=end_y, r=3.5, class_="point")
    return element("path", d="".join(words), class_="curve") + dot + label


def _level_line_svg(axes: _Axes, name: str, level: float) -> str:
    y = svg_number(axes.y(level))
    return element(
        "path", d=f"M{svg_number(_LEFT)} {y}H{svg_number(WIDTH - _RIGHT)}", class_=f"level {name.partition(' ')[0]}"
    )


def _level_labels(axes: _Axes, levels: dict[str, float], unit: str) -> list[str]:
    """Return the labels of the level lines.

    A label is below its line, or above the line if there is no space below.
    """
    words = []
    for name, level in levels.items():
        y = axes.y(level)
        under = y + _LINE_HEIGHT + 2 <= HEIGHT - _BOTTOM and not (name == "nearest neighbour" and y - _TOP > 12)
        y += 13 if under else -6
        words.append(text_element(f"{name} {cost_words(level, unit)}", _LEFT + 8, y, class_="note"))
    return words


def stacked_bar_svg(times: dict[str, float], longest: float) -> str:
    """Draw the seconds of each kind of motion as a stacked bar. A bar of `longest` seconds has the full width."""
    x, parts = 0.0, []
    for kind in TIME_KINDS:
        width = 100.0 * max(times.get(kind, 0.0), 0.0) / longest if longest > 0 else 0.0
        if width > 0:
            parts.append(element("rect", x=x, y=0.0, width=width, height=10.0, class_=f"time {kind.replace('_', '-')}"))
        x += width
    return element("svg", *parts, viewBox="0 0 100 10", preserveAspectRatio="none", class_="bar", aria_hidden="true")


def bar_svg(part: float, kind: str = "plain") -> str:
    """Draw a bar that is filled to the fraction `part`, 0 to 1."""
    part = min(max(part, 0.0), 1.0) if math.isfinite(part) else 0.0
    track = element("rect", x=0.0, y=0.0, width=100.0, height=10.0, class_="track")
    fill = element("rect", x=0.0, y=0.0, width=100.0 * part, height=10.0, class_=f"fill {kind}")
    return element(
        "svg", track, fill, viewBox="0 0 100 10", preserveAspectRatio="none", class_="bar", aria_hidden="true"
    )
