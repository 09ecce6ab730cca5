"""Charts for teaching as elements of a NiceGUI page: learning curves and comparisons of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from nicegui.element import Element


class SavedChart(Element, component="../static/chart_element.js"):
    """A chart that can be saved as an image."""

    kind = ""

    def __init__(self, words: Mapping[str, str]) -> None:
        super().__init__()
        self.props.update(kind=self.kind, words=dict(words), data=None)

    def save(self, name: str) -> None:
        """Save the chart as PNG in the browser."""
        self.run_method("save", name)

    def _set(self, **data: Any) -> None:
        self.props["data"] = data
        self.update()


class Learning(SavedChart):
    """Best, mean and worst cost per iteration, overall best and λ-branching factor, by iteration or time."""

    kind = "Learning"

    def set(self, rows: Sequence[Sequence[float | None]], bound: float | None = None, unit: str = "") -> None:
        """Show rows of `model.study.Iteration` and the lower bound."""
        self._set(rows=[list(row) for row in rows], bound=bound, unit=unit)


class Runs(SavedChart):
    """Curves of several runs, by iteration or time, with the mean of each algorithm."""

    kind = "Runs"

    def set(self, curves: Sequence[Mapping[str, Any]], bound: float | None = None) -> None:
        """Show curves of `lab.tables.curves_as_json`."""
        self._set(curves=[dict(curve) for curve in curves], bound=bound)


class Boxes(SavedChart):
    """Box plot of the tour lengths of each algorithm."""

    kind = "Boxes"

    def set(self, algorithms: Sequence[Mapping[str, Any]], bound: float | None = None) -> None:
        """Show the summaries of `lab.tables.experiment_as_json`."""
        self._set(algorithms=[dict(summary) for summary in algorithms], bound=bound)
