"""The fronts of time, cost and tool life as a picture: of every tool, and where on the machine they lie."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from leafcut.errors import OptionError
from leafcut.model.cutting_front import CuttingData, CuttingPoint, ToolFront
from leafcut.report.colours import drawing_css
from leafcut.report.drawing import RAMP
from leafcut.report.svg import element, nice_step, short, text, text_within, tick_words, ticks, title
from leafcut.units import SECONDS_PER_MINUTE, format_time

#: A panel with its margins, and the head over the two of a tool, in user units.
_WIDE, _HIGH, _HEAD = 430.0, 290.0, 46.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 62.0, 16.0, 14.0, 44.0
_FOOT = 58.0
#: Room around what is drawn, in parts of it.
_MARGIN = 0.07
_MOST_POINTS = 600
_SECONDS_PER_HOUR = 3600.0
_STYLE = """
svg.front { background: var(--page); }
.front .card { fill: var(--card); stroke: var(--line); }
.front .gridline { stroke: var(--line); stroke-width: 1; }
.front .along { stroke: var(--line-2); stroke-width: 1.2; }
.front .dots { stroke-width: 5; }
.front .ring { fill: var(--card); stroke: var(--ink); stroke-width: 1.8; }
.front .chosen { fill: var(--cut); stroke: var(--card); stroke-width: 2; }
.front .own { fill: var(--card); stroke: var(--ink-2); stroke-width: 1.6; }
.front .name { fill: var(--ink); font-weight: 700; font-size: 14px; }
.front .label { fill: var(--ink); font-weight: 600; paint-order: stroke; stroke: var(--card); stroke-width: 4;
  stroke-linejoin: round; }
"""


def check_name(file: str | Path | None) -> None:
    """Refuse a name that is not that of a picture of lines.

    Raises
    ------
    OptionError
        It does not end in ``.svg``.
    """
    if file is not None and Path(file).suffix.lower() != ".svg":
        raise OptionError(
            f"--plot: '{Path(file).name}' is not a picture that can be written; name a file ending in .svg"
        )


@dataclass(frozen=True)
class _Axis:
    """Numbers to user units along one side of a panel; by their logarithms where they spread far."""

    low: float
    high: float
    begin: float
    end: float
    log: bool = False

    @classmethod
    def over(cls, values: Sequence[float], begin: float, end: float, far: float = math.inf) -> _Axis:
        """Return an axis with room around some values; a logarithmic one where they spread over the factor `far`."""
        low, high = min(values), max(values)
        if low > 0 and high / low > far:
            room = (high / low) ** _MARGIN
            return cls(low / room, high * room, begin, end, True)
        room = _MARGIN * ((high - low) or abs(high) or 1.0)
        return cls(max(low - room, 0.0) if low >= 0 else low - room, high + room, begin, end)

    def at(self, value: float) -> float:
        """Return where a number lies."""
        if self.log:
            part = math.log(value / self.low) / math.log(self.high / self.low)
        else:
            part = (value - self.low) / (self.high - self.low)
        return self.begin + part * (self.end - self.begin)

    def marks(self, count: int) -> list[tuple[float, str]]:
        """Return round numbers on the axis with their words."""
        if self.log:
            powers = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
            found = [m * 10.0**p for p in powers for m in (1, 2, 5)]
            return [(v, f"{v:g}") for v in found if self.low <= v <= self.high]
        step = nice_step(self.high - self.low, count)
        return [(v, tick_words(v, step)) for v in ticks(self.low, self.high, step)]


def front_svg(found: CuttingData) -> str:
    """Return the fronts of all tools as a stand-alone SVG, two panels for each.

    On the left what one part costs against how long it takes; on the right which spindle speeds and feed rates these
    are. The colour is the tool's life, violet for the shortest and teal for the longest.
    """
    lives = [point.life for one in found.tools for point in one.points]
    shade = _shade(min(lives), max(lives))
    width, each = 2 * _WIDE, _HEAD + _HIGH
    rows = [element("g", _tool(one, found, shade), transform=f"translate(0 {short(k * each)})")
            for k, one in enumerate(found.tools)]  # fmt: skip
    bottom = len(rows) * each
    height = bottom + _FOOT
    words = f"Speeds and feeds for {found.material.name} on {found.machine.name}"
    return (
        element(
            "svg",
            title(words),
            element("style", drawing_css() + _STYLE),
            element("rect", x=0.0, y=0.0, width=width, height=height, fill="var(--page)"),
            *rows,
            _legend(min(lives), max(lives), bottom, any(one.given for one in found.tools)),
            xmlns="http://www.w3.org/2000/svg",
            viewBox=f"0 0 {short(width)} {short(height)}",
            width=width,
            height=height,
            class_="drawing front",
            role="img",
        )
        + "\n"
    )


def _shade(shortest: float, longest: float) -> Callable[[float], int]:
    """Return what gives a life its colour: the number of a class of the ramp."""
    span = math.log(longest / shortest) if longest > shortest else 1.0
    return lambda life: round((RAMP - 1) * math.log(life / shortest) / span)


def _tool(one: ToolFront, found: CuttingData, shade: Callable[[float], int]) -> str:
    made = f"{one.holes} hole{'s' * (one.holes != 1)}" if one.holes else "milling"
    head = text(one.tool.label, 16, 30, class_="name")
    about = f"{one.tool_material.value} · {made} · {found.material.name} on {found.machine.name}"
    beside = text(about, 2 * _WIDE - 16, 30, text_anchor="end")
    points = _thinned(one.points, one.chosen)
    left = _panel(
        one, points, shade, 0.0, lambda p: p.time / _unit(points)[0], lambda p: p.cost,
        (f"time of one part, {_unit(points)[1]}", "cost of one part"),
    )  # fmt: skip
    right = _panel(
        one, points, shade, _WIDE, lambda p: p.rpm, lambda p: p.feed * SECONDS_PER_MINUTE,
        ("spindle speed, rpm", "feed rate, mm/min"),
    )  # fmt: skip
    return head + beside + left + right


def _unit(points: Sequence[CuttingPoint]) -> tuple[float, str]:
    longest = max(point.time for point in points)
    if longest >= 2 * _SECONDS_PER_HOUR:
        return _SECONDS_PER_HOUR, "h"
    return (SECONDS_PER_MINUTE, "min") if longest >= 4 * SECONDS_PER_MINUTE else (1.0, "s")


def _thinned(points: tuple[CuttingPoint, ...], chosen: int) -> list[CuttingPoint]:
    """Return some of the points, the ends and the chosen one among them."""
    last = len(points) - 1
    if last < _MOST_POINTS:
        return list(points)
    kept = {i * last // (_MOST_POINTS - 1) for i in range(_MOST_POINTS)} | {chosen}
    return [points[i] for i in sorted(kept)]


def _panel(
    one: ToolFront, points: list[CuttingPoint], shade: Callable[[float], int], left: float,
    across: Callable[[CuttingPoint], float], up: Callable[[CuttingPoint], float], names: tuple[str, str],
) -> str:  # fmt: skip
    """Return one panel: axes, the front, the best of each objective, and what the library has."""
    begin, end = left + _LEFT, left + _WIDE - _RIGHT
    bottom, top = _HEAD + _HIGH - _BOTTOM, _HEAD + _TOP
    own = [one.given] if one.given is not None else []
    x = _Axis.over([across(p) for p in (*points, *own)], begin, end)
    y = _Axis.over([up(p) for p in (*points, *own)], bottom, top)
    card = element("rect", x=begin, y=top, width=end - begin, height=bottom - top, class_="card")
    grid, numbers = [], []
    for value, words in y.marks(5):
        grid.append(f"M{short(begin)} {short(y.at(value))}H{short(end)}")
        numbers.append(text(words, begin - 7, y.at(value), text_anchor="end", dy="0.34em"))
    for value, words in x.marks(5):
        grid.append(f"M{short(x.at(value))} {short(top)}V{short(bottom)}")
        numbers.append(text_within(words, x.at(value), bottom + 16, left + _WIDE))
    middle = (top + bottom) / 2
    axes = text(names[0], (begin + end) / 2, bottom + 34, text_anchor="middle") + text(
        names[1], left + 16, middle, text_anchor="middle", transform=f"rotate(-90 {short(left + 16)} {short(middle)})"
    )

    def place(point: CuttingPoint) -> tuple[float, float]:
        return x.at(across(point)), y.at(up(point))

    return (
        card + element("path", d="".join(grid), class_="gridline") + "".join(numbers) + axes
        + _dots(points, place, shade) + _marks(one, place, (begin + end) / 2)
    )  # fmt: skip


def _dots(
    points: list[CuttingPoint], place: Callable[[CuttingPoint], tuple[float, float]], shade: Callable[[float], int]
) -> str:
    """Return the points, in one path of each colour."""
    by_colour: dict[int, list[str]] = {}
    for point in points:
        px, py = place(point)
        by_colour.setdefault(shade(point.life), []).append(f"M{short(px)} {short(py)}h0")
    return "".join(element("path", d="".join(d), class_=f"dots r{c}") for c, d in sorted(by_colour.items()))


def _marks(one: ToolFront, place: Callable[[CuttingPoint], tuple[float, float]], middle: float) -> str:
    """Return the quickest, the cheapest and the longest-lived point, and what the library has."""
    points = one.points
    named = {
        "quickest": min(points, key=lambda p: (p.time, p.cost)),
        "cheapest": min(points, key=lambda p: (p.cost, p.time)),
        "longest life": min(points, key=lambda p: (-p.life, p.cost)),
    }
    if one.given is not None:
        named["library"] = one.given
    places: dict[tuple[float, float], list[str]] = {}
    for name, point in named.items():
        places.setdefault(place(point), []).append(name)
    drawn, labels, taken = [], [], list[float]()
    chosen = place(one.best)
    for (px, py), names in sorted(places.items(), key=lambda item: item[0][1]):
        kind = "chosen" if (px, py) == chosen else "own" if names == ["library"] else "ring"
        drawn.append(_diamond(px, py) if kind == "own" else element("circle", cx=px, cy=py, r=5.0, class_=kind))
        to_left = px > middle
        height = py + 4
        while any(abs(height - other) < 14 for other in taken):
            height += 14
        taken.append(height)
        anchor = "end" if to_left else "start"
        labels.append(text(", ".join(names), px + (-11 if to_left else 11), height, text_anchor=anchor, class_="label"))
    if chosen not in places:
        drawn.append(element("circle", cx=chosen[0], cy=chosen[1], r=5.0, class_="chosen"))
    return "".join((*drawn, *labels))


def _diamond(x: float, y: float) -> str:
    return element("path", d=f"M{short(x)} {short(y - 6)}l6 6l-6 6l-6 -6z", class_="own")


def _legend(shortest: float, longest: float, top: float, own: bool) -> str:
    """Return what the colours and the marks are."""
    begin, wide = 16.0 + 110.0, 180.0
    y = top + 20
    step = wide / (RAMP - 1)
    steps = [element("path", d=f"M{short(begin + i * step)} {short(y)}h{short(step)}", class_=f"r{i}", stroke_width=9.0,
                     stroke_linecap="butt") for i in range(RAMP - 1)]  # fmt: skip
    words = (
        text("tool life in the cut", 16, y + 4)
        + text(format_time(shortest), begin, y + 21, text_anchor="start")
        + text(format_time(longest), begin + wide, y + 21, text_anchor="end")
    )
    x = begin + wide + 40
    marks = element("circle", cx=x, cy=y, r=5.0, class_="chosen") + text("chosen", x + 12, y + 4)
    x += 82
    marks += element("circle", cx=x, cy=y, r=5.0, class_="ring") + text("best for one objective", x + 12, y + 4)
    if own:
        x += 168
        marks += _diamond(x, y) + text("as in the tool library", x + 12, y + 4)
    return "".join(steps) + words + marks
