"""Charts of an experiment. Matplotlib draws them as SVG, and they use the colours of the report's style sheet."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from leafcut.report.svg import title_element

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: A convergence curve, as a sequence of points (iteration or seconds, cost).
Course = Sequence[tuple[float, float]]

#: Placeholder colours for Matplotlib. CSS variables replace them, because a page may be light or dark.
_INK, _SOFT, _LINE = "#010101", "#020202", "#030303"
_HUES = tuple(f"#0404{k:02x}" for k in range(1, 9))
_IN_PAGE = {_INK: "var(--ink)", _SOFT: "var(--ink-2)", _LINE: "var(--line)"}
_IN_PAGE |= {hue: f"var(--t{k})" for k, hue in enumerate(_HUES)}
_DASHES = ("-", "--", ":", "-.")
_WIDTH, _HEIGHT = 6.6, 3.4
_STEPS = 120
_ID = re.compile(r'\s+id="([^"]*)"')


def box_plots(groups: Mapping[str, Sequence[float]], heading: str, description: str) -> str:
    """Draw box plots with a dot for each value.

    The whiskers extend to 1.5 times the interquartile range (Tukey 1977).
    """
    axes = _new_axes(max(_WIDTH, 0.55 * len(groups)))
    values = [list(group) for group in groups.values()]
    boxes = axes.boxplot(values, widths=0.55, showfliers=False, patch_artist=True, whis=1.5)
    for part in ("boxes", "whiskers", "caps", "medians"):
        for artist in boxes[part]:
            artist.set_color(_HUES[0])
    for box in boxes["boxes"]:
        box.set_facecolor("none")
    for position, sample in enumerate(values, 1):
        x = position + 0.18 * np.linspace(-1.0, 1.0, len(sample)) if len(sample) > 1 else [position]
        axes.plot(x, sample, "o", color=_HUES[1], markersize=2.6, alpha=0.7, markeredgewidth=0)
    _label_x_axis(axes, list(groups))
    return _labelled_chart(axes, "", heading, description)


def chart_of_means(
    series: Mapping[str, Sequence[tuple[float, float, float, float]]],
    x_label: str,
    heading: str,
    description: str,
    ideal: Sequence[tuple[float, float]] = (),
) -> str:
    """Draw a chart of means with error bars.

    Parameters
    ----------
    series
        Maps a name to its points (x, mean, low, high).
    x_label, heading, description
        Texts of the chart.
    ideal
        Points of a dotted line.
    """
    axes = _new_axes()
    if ideal:
        axes.plot(*zip(*ideal, strict=True), color=_SOFT, linewidth=1, linestyle=":", label="ideal")
    for k, (name, points) in enumerate(series.items()):
        x, mean, low, high = (np.array(column) for column in zip(*points, strict=True))
        colour, dash = _line_style(k)
        axes.errorbar(
            x,
            mean,
            yerr=[np.maximum(mean - low, 0), np.maximum(high - mean, 0)],
            color=colour,
            linestyle=dash,
            marker="o",
            markersize=3.5,
            capsize=2.5,
            linewidth=1.4,
            label=name,
        )
    return _labelled_chart(axes, x_label, heading, description, len(series) + bool(ideal))


def convergence_chart(variants: Mapping[str, Sequence[Course]], x_label: str, heading: str, description: str) -> str:
    """Draw the mean convergence curve of each variant, with a band from its best to its worst run."""
    axes = _new_axes()
    last = max(curve[-1][0] for curves in variants.values() for curve in curves)
    places = np.linspace(0.0, last, _STEPS)
    for k, (name, curves) in enumerate(variants.items()):
        table = np.array([_evaluate_step_curve(curve, places) for curve in curves])
        colour, dash = _line_style(k)
        axes.fill_between(places, table.min(axis=0), table.max(axis=0), color=colour, alpha=0.13, linewidth=0)
        axes.plot(places, table.mean(axis=0), color=colour, linestyle=dash, linewidth=1.5, label=name)
    return _labelled_chart(axes, x_label, heading, description, len(variants))


def line_chart(series: Mapping[str, Course], x_label: str, heading: str, description: str) -> str:
    """Draw a line chart. `series` maps a name to its points (x, y)."""
    axes = _new_axes()
    for k, (name, points) in enumerate(series.items()):
        colour, dash = _line_style(k)
        axes.plot(*zip(*points, strict=True), color=colour, linestyle=dash, linewidth=1.5, label=name)
    return _labelled_chart(axes, x_label, heading, description, len(series))


def time_to_target_chart(variants: Mapping[str, Sequence[float | None]], x_label: str, description: str) -> str:
    """Draw time-to-target plots, which show the percentage of runs that have reached the target by a given time.

    `variants` maps a name to the time of each run. The time is None if a run has missed the target. Such a run still
    counts toward the total.

    Source: Aiex, Resende and Ribeiro 2007, *TTT plots*.
    """
    axes = _new_axes()
    last = max((t for times in variants.values() for t in times if t is not None), default=1.0) or 1.0
    for k, (name, times) in enumerate(variants.items()):
        reached = sorted(t for t in times if t is not None)
        shares = [100.0 * (n + 1) / len(times) for n in range(len(reached))]
        colour, dash = _line_style(k)
        axes.step(
            [0.0, *reached, 1.02 * last],
            [0.0, *shares, shares[-1] if shares else 0.0],
            where="post",
            color=colour,
            linestyle=dash,
            linewidth=1.5,
            label=name,
        )
    axes.set_ylim(-2, 103)
    return _labelled_chart(axes, x_label, "runs at the target, %", description, len(variants))


def pareto_chart(
    points: Mapping[str, tuple[float, float]], front: Sequence[str], x_label: str, heading: str, description: str
) -> str:
    """Draw a scatter plot of two responses. A line connects the variants on the Pareto front, and labels name them."""
    axes = _new_axes()
    dominated = [point for name, point in points.items() if name not in front]
    if dominated:
        axes.plot(*zip(*dominated, strict=True), "o", color=_SOFT, markersize=4, alpha=0.7)
    best = sorted((points[name], name) for name in front)
    axes.plot(*zip(*(point for point, _ in best), strict=True), "o-", color=_HUES[0], markersize=5, linewidth=1.2)
    names_at: dict[tuple[float, float], list[str]] = {}
    for point, name in best:
        names_at.setdefault(point, []).append(name)
    for point, names in names_at.items():
        label = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
        axes.annotate(label, point, xytext=(5, 5), textcoords="offset points", fontsize=8, color=_INK)
    axes.margins(0.15)
    return _labelled_chart(axes, x_label, heading, description)


def scatter_chart(
    series: Mapping[str, Sequence[tuple[float, float]]], x_label: str, heading: str, description: str
) -> str:
    """Draw a scatter plot. `series` maps a name to its points (x, y)."""
    axes = _new_axes()
    for k, (name, points) in enumerate(series.items()):
        axes.plot(*zip(*points, strict=True), "os^D"[k % 4], color=_HUES[k % len(_HUES)], markersize=5, label=name)
    axes.axhline(0.0, color=_SOFT, linewidth=0.8)
    return _labelled_chart(axes, x_label, heading, description, len(series))


def tuning_trials_chart(costs: Sequence[tuple[float, float]], heading: str, description: str) -> str:
    """Plot the cost of each trial relative to the defaults, and the lowest cost so far as a step line."""
    axes = _new_axes()
    x, y = (np.array(column, dtype=np.float64) for column in zip(*costs, strict=True))
    axes.plot(x, y, "o", color=_HUES[1], markersize=3.5, alpha=0.8, markeredgewidth=0, label="trial")
    best = np.minimum.accumulate(np.minimum(y, 1.0))
    axes.step(x, best, where="post", color=_HUES[0], linewidth=1.6, label="least so far")
    axes.axhline(1.0, color=_SOFT, linewidth=1, linestyle=":", label="defaults")
    return _labelled_chart(axes, "trial", heading, description, 3)


def _evaluate_step_curve(curve: Course, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Evaluate a step curve at the given positions. The cost is the value of the last step before each position."""
    x, y = (np.array(column, dtype=np.float64) for column in zip(*curve, strict=True))
    costs: NDArray[np.float64] = y[np.maximum(np.searchsorted(x, places, side="right") - 1, 0)]
    return costs


def _line_style(k: int) -> tuple[str, str]:
    return _HUES[k % len(_HUES)], _DASHES[k // len(_HUES) % len(_DASHES)]


def _new_axes(width: float = _WIDTH) -> Axes:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, _HEIGHT), layout="constrained")
    axes = figure.add_subplot()
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("bottom", "left"):
        axes.spines[side].set_color(_SOFT)
    axes.tick_params(colors=_SOFT, labelsize=8)
    axes.grid(axis="y", color=_LINE, linewidth=0.7)
    axes.set_axisbelow(True)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set_color(_INK)
        axis.label.set_fontsize(9)
    return axes


def _label_x_axis(axes: Axes, names: Sequence[str]) -> None:
    long = max(len(name) for name in names) * len(names) > 70
    axes.set_xticks(range(1, len(names) + 1), names, rotation=30 if long else 0, ha="right" if long else "center")


def _labelled_chart(axes: Axes, x_label: str, heading: str, description: str, series: int = 0) -> str:
    """Add the labels of the axes, and a legend for several series, and return the chart as SVG."""
    axes.set_xlabel(x_label)
    axes.set_ylabel(heading)
    if series > 1:
        axes.legend(fontsize=8, frameon=False, labelcolor=_INK, ncols=1 + (series > 6))
    return _figure_as_svg(axes.figure, description)


def _figure_as_svg(figure: Any, description: str) -> str:
    """Convert a figure to SVG with the CSS colours of the page. `description` becomes its accessible title."""
    from matplotlib import rc_context

    output = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "leafcut"}):
        figure.savefig(output, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = output.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    for colour, name in _IN_PAGE.items():
        text = text.replace(colour, name)
    text = re.sub(r"(font: [^;\"]*?)'[^;\"]*(?=[;\"])", r"\1system-ui, sans-serif", text)
    references = set(re.findall(r"#([\w-]+)", text))
    text = _ID.sub(lambda match: match[0] if match[1] in references else "", text)
    head, _, rest = text.partition(">")
    head = re.sub(r'\s(width|height)="[^"]*"', "", head).replace("<svg", '<svg class="chart" role="img"', 1)
    return f"{head}>{title_element(description)}{rest}".strip()
