"""Charts of searches.

ECharts draws them as SVG, and CSS variables define their colours so that they match the theme.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from nicegui import ui
from nicegui.element import Element
from nicegui.elements.echart import EChart
from nicegui.elements.mixins.text_element import TextElement

from leafcut.studio.page.elements import box, text

#: Options of ECharts.
ChartOptions = dict[str, Any]
#: Maps each key to its text.
ChartWords = Mapping[str, str]
#: Rows that contain the fields of `model.study.Iteration`.
ChartRows = Sequence[Sequence[float | None]]

#: A horizontal axis becomes logarithmic if its last value is more than this many times its first value.
_LOG_FROM = 60.0
_NUMBER = "v => v == null ? '–' : v.toLocaleString('en-US', {maximumFractionDigits: 3})"
_TOOLTIP = {
    "trigger": "axis", "confine": True, ":valueFormatter": _NUMBER, "backgroundColor": "var(--card)",
    "borderColor": "var(--line)", "textStyle": {"color": "var(--ink)", "fontSize": 12},
    "axisPointer": {"lineStyle": {"color": "var(--line-2)"}},
}  # fmt: skip


class Chart:
    """A chart. ECharts is large, and most pages show no chart, so it is only loaded when the first chart appears."""

    def __init__(self, classes: str = "chart") -> None:
        self.place = box("div", classes, role="img")
        self._chart: EChart | None = None

    def show(self, options: ChartOptions, label: str) -> None:
        """Show a chart. Screen readers read `label` aloud."""
        if self._chart is None:
            with self.place:
                self._chart = ui.echart(options, renderer="svg").classes("echart")
        else:
            self._chart.props["options"] = options
            self._chart.update()
        if self.place.props.get("aria-label") != label:
            self.place.props["aria-label"] = label
            self.place.update()


class SwitchedChart:
    """A chart whose horizontal axis can be switched between iterations and time."""

    def __init__(self, words: ChartWords, classes: str) -> None:
        self.by, self._draw = "iteration", (lambda by: ({}, ""))  # type: str, Callable[[str], tuple[ChartOptions, str]]
        with box("div", f"{classes} switched") as self.place:
            with box("div", "lc-switch", role="group", aria_label=words["axis"]):
                self._buttons = {by: self._add_switch(words[by], by) for by in ("iteration", "time")}
            self._chart = Chart("echart")

    def show(self, draw: Callable[[str], tuple[ChartOptions, str]]) -> None:
        """Show a chart.

        `draw` receives ``iteration`` or ``time``, and returns the options and the label of the chart.
        """
        self._draw = draw
        self._choose_axis(self.by)

    def _add_switch(self, words: str, by: str) -> TextElement:
        switch = text("button", words, "lc-mode", type="button")
        switch.on("click", lambda: self._choose_axis(by))
        return switch

    def _choose_axis(self, by: str) -> None:
        self.by = by
        for name, switch in self._buttons.items():
            switch.props(f"aria-pressed={'true' if name == by else 'false'}")
        self._chart.show(*self._draw(by))


def convergence_chart(
    history: Sequence[tuple[float, float]], bound: float | None, unit: str, words: ChartWords, now: float = 0.0
) -> tuple[ChartOptions, str]:
    """Create the chart that shows the cost over the search time. Return its options and its label.

    Parameters
    ----------
    history
        (seconds, cost) at every improvement.
    bound
        Lower bound, if it is known.
    unit
        Unit of the cost.
    words
        Texts of the chart.
    now
        Elapsed time, s.
    """
    best, last = history[-1][1], max(now, history[-1][0], 0.001)
    points = [*history, (last, best)]
    line = _line_series(words["best"], points, "--accent", 2.2, step="end")
    line["endLabel"] = {
        "show": True, "formatter": f"{best:,.2f} {unit}".strip(), "align": "right", "verticalAlign": "bottom",
        "offset": [0, -6], "color": "var(--ink)", "fontWeight": 600,
    }  # fmt: skip
    line["markLine"] = _bound_line(bound, words)
    options = _chart_with_axes(
        [line], [cost for _, cost in points], _horizontal_axis([t for t, _ in points], "s"), bound, top=16
    )
    return options, f"{words['best']} {best:,.2f} {unit}".strip()


def learning_chart(
    rows: ChartRows, bound: float | None, unit: str, words: ChartWords, by: str
) -> tuple[ChartOptions, str]:
    """Create the chart of an ant or firefly search. Return its options and its label.

    For each iteration, the chart shows the best, mean and worst cost, the best cost so far and the λ-branching factor.
    `rows` contains the fields of `model.study.Iteration`.
    """
    at, axis = _positions_and_axis(rows, by, words)
    last = rows[-1]
    rounds = [(x, *row[3:6]) for x, row in zip(at, rows, strict=True) if row[3] is not None]
    branching = [(x, row[6]) for x, row in zip(at, rows, strict=True) if row[6] is not None]
    shortest = [(x, row[2]) for x, row in zip(at, rows, strict=True)]
    series = []
    for k, name, colour in ((3, "worst", "--idle"), (2, "mean", "--ink-2"), (1, "round", "--t0")):
        if rounds:
            series.append(_line_series(words[name], [(row[0], row[k]) for row in rounds], colour, 1.4))
    series.append(_line_series(f"{words['shortest']} {last[2]:,.1f}", shortest, "--accent", 2.2, step="end"))
    series[-1]["markLine"] = _bound_line(bound, words)
    costs = [
        float(cost or 0.0) for points in (*(row[1:] for row in rounds), [row[2] for row in rows]) for cost in points
    ]
    options = _chart_with_axes(series, costs, axis, bound, top=44)
    if branching:
        series.append({**_line_series(words["branching"], branching, "--t1", 1.4, dashed=True), "yAxisIndex": 1})
        second = {"position": "right", "min": 0, "splitNumber": 2, "splitLine": {"show": False}}
        options["yAxis"] = [options["yAxis"], {**_Y, **second, "axisLabel": {"color": "var(--t1)"}}]
        options["grid"]["right"] = 34
    label = f"{words['shortest']} {last[2]:,.2f} {unit}".rstrip()
    if rounds:
        label += "".join(f", {words[key]} {rounds[-1][k]:,.2f}" for k, key in ((1, "round"), (2, "mean"), (3, "worst")))
    return options, label + (f", {words['branching']} {branching[-1][1]:.2f}" if branching else "")


def brightness_chart(values: Sequence[float], words: ChartWords) -> tuple[ChartOptions, str]:
    """Create a bar chart with the brightness of all fireflies, and mark the brightest.

    Return its options and its label.
    """
    most = max(values)
    colours = ["var(--accent)" if value == most else "var(--idle)" for value in values]
    columns = [{"value": v, "itemStyle": {"color": colour}} for v, colour in zip(values, colours, strict=True)]
    hidden = {"show": False}
    options: ChartOptions = {
        "animation": False,
        "grid": {"left": 0, "right": 0, "top": 2, "bottom": 0},
        "xAxis": {"type": "category", **hidden},
        "yAxis": {"type": "value", "max": max(most, 1e-12), **hidden},
        "series": [{"type": "bar", "data": columns, "barCategoryGap": "20%", "silent": True}],
    }
    return options, f"{words['best']} {most:.3f}"


def bar_chart(place: Element, rows: Iterable[tuple[str, float, str, bool]]) -> None:
    """Fill an element with one bar per row.

    A row contains a name, a value, a note, and whether this is the best row.
    """
    rows = list(rows)
    most = max((value for _, value, _, _ in rows), default=0.0) or 1.0
    place.clear()
    with place, box("ul", "lc-bars"):
        for name, value, note, best in rows:
            with box("li"):
                text("span", name, "lc-who")
                with box("span", "lc-track"):
                    box("i", "lc-fill lc-won" if best else "lc-fill").style(f"width: {100.0 * value / most:.1f}%")
                text("span", note, "lc-note")


def _line_series(
    name: str, points: Sequence[Sequence[Any]], colour: str, width: float, *, step: str = "", dashed: bool = False
) -> ChartOptions:
    style = {"color": f"var({colour})", "width": width, "type": "dashed" if dashed else "solid", "join": "round"}
    line: ChartOptions = {
        "type": "line", "name": name, "data": [list(point) for point in points], "showSymbol": False,
        "lineStyle": style, "itemStyle": {"color": f"var({colour})"}, "emphasis": {"disabled": True},
    }  # fmt: skip
    return {**line, "step": step} if step else line


def _bound_line(bound: float | None, words: ChartWords) -> ChartOptions:
    data = [] if bound is None else [{"yAxis": bound}]
    label = {"position": "insideStartTop", "color": "var(--ink-2)", "fontSize": 11}
    return {
        "silent": True, "symbol": "none", "data": data,
        "label": {**label, "formatter": f"{words['bound']} {bound or 0.0:,.2f}"},
        "lineStyle": {"color": "var(--ink-2)", "type": [1, 4], "width": 2, "cap": "round"},
    }  # fmt: skip


def _positions_and_axis(rows: ChartRows, by: str, words: ChartWords) -> tuple[list[float], ChartOptions]:
    at = [float(row[0 if by == "iteration" else 1] or 0.0) for row in rows]
    return at, _horizontal_axis(at, words["iterationAxis"] if by == "iteration" else "s")


def _horizontal_axis(values: Sequence[float], name: str) -> ChartOptions:
    last = max(values)
    first = min((v for v in values if v > 0.0), default=last)
    log = last > _LOG_FROM * first > 0.0
    return {
        "type": "log" if log else "value", "min": first if log else 0, "max": last, "name": name,
        "nameLocation": "start", "nameGap": 8, "nameTextStyle": {"color": "var(--ink-2)", "verticalAlign": "top"},
        "splitLine": {"show": False}, "axisLine": {"lineStyle": {"color": "var(--line-2)"}},
        "axisLabel": {"color": "var(--ink-2)", "hideOverlap": True, "showMaxLabel": False, "showMinLabel": not log},
    }  # fmt: skip


_Y: ChartOptions = {
    "type": "value", "axisLine": {"show": False}, "axisTick": {"show": False},
    "splitLine": {"lineStyle": {"color": "var(--line)"}, "showMinLine": False, "showMaxLine": False},
    "axisLabel": {"color": "var(--ink-2)", "showMinLabel": False, "showMaxLabel": False},
}  # fmt: skip


def _chart_with_axes(
    series: list[ChartOptions],
    values: Sequence[float],
    horizontal: ChartOptions,
    bound: float | None,
    *,
    top: int,
) -> ChartOptions:
    """Return the ECharts options of a chart. The vertical axis covers all values and the bound."""
    seen = [*values, bound] if bound is not None else values
    low, high = min(seen), max(seen)
    if horizontal.get("type") == "log":
        for line in series:
            line["data"] = [[max(x, horizontal["min"]), y] for x, y in line["data"]]
    spare = max(0.06 * (high - low), 1e-4 * abs(high), 1e-9)
    vertical = {**_Y, "min": low - spare, "max": high + spare, "splitNumber": 4}
    return {
        "animation": False,
        "textStyle": {"fontFamily": "system-ui, sans-serif", "fontSize": 11},
        "grid": {"left": 58, "right": 16, "top": top, "bottom": 24, "containLabel": False},
        "legend": {
            "show": top > 20, "left": 0, "top": 0, "itemWidth": 16, "itemHeight": 8, "itemGap": 12,
            "textStyle": {"color": "var(--ink-2)"}, "inactiveColor": "var(--line-2)", "icon": "roundRect",
        },
        "tooltip": _TOOLTIP,
        "xAxis": horizontal,
        "yAxis": vertical,
        "series": series,
    }  # fmt: skip
