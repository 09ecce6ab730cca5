"""The runs of an experiment grouped by cell, and the tables and sections of its report."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from leafcut.lab.description import Description
from leafcut.lab.store import Row

#: Maximum number of instances with their own charts.
MAX_CHARTS = 8

DesignCell = tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """A table of a report. The first `texts` columns contain text, and all other columns contain numbers."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    texts: int = 1
    title: str = ""


@dataclass(frozen=True)
class ReportBlock:
    """A section of a report, with a heading, sentences, tables, and charts (name and SVG)."""

    title: str
    words: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    drawn: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Results:
    """The runs of an experiment, grouped by cell. A cell combines an instance with one level of each factor."""

    description: Description
    rows: tuple[Row, ...]

    @classmethod
    def from_rows(cls, description: Description, rows: Iterable[Row]) -> Results:
        """Select the rows that have results and match the current description.

        Programs that were refused also count if their search has a result.
        """
        instances = {instance.name for instance in description.instances}
        levels = {factor.name: {level.name for level in factor.levels} for factor in description.factors}
        kept = [
            row
            for row in rows
            if has_any_result(row)
            and row.instance in instances
            and row.seed in description.seeds
            and row.levels.keys() == levels.keys()
            and all(row.levels[name] in levels[name] for name in levels)
        ]
        return cls(description, tuple(kept))

    @property
    def finished_rows(self) -> tuple[Row, ...]:
        """Runs that did not fail."""
        return tuple(row for row in self.rows if not row.failed)

    def missing_count(self, count: int) -> int:
        """Return how many runs are missing in a cell that has `count` results."""
        return len(self.description.seeds) - count

    def values_by_cell(self, response: str) -> dict[DesignCell, list[float]]:
        """Return the values of a response for each cell.

        The cells are in the order of the description. The values of each cell are sorted by seed.
        """
        by_cell: dict[DesignCell, list[float]] = {cell: [] for cell in self.cells()}
        for row in sorted(self.rows, key=lambda run: run.seed):
            value = row.responses.get(response)
            if value is not None and math.isfinite(value):
                by_cell[self.cell(row)].append(float(f"{value:.12g}"))  # the last digits depend on the order of sums
        return {cell: values for cell, values in by_cell.items() if values}

    def cells(self) -> Iterator[DesignCell]:
        """Yield all cells in the order of the description."""
        yield from dict.fromkeys(
            (plan.instance.name, *(level.name for level in plan.levels.values())) for plan in self.description.runs()
        )

    def cell(self, row: Row) -> DesignCell:
        """Return the cell that a run belongs to."""
        return (row.instance, *(row.levels[factor.name] for factor in self.description.factors))

    def values_by_level(self, response: str, factor: str) -> dict[DesignCell, dict[str, list[float]]]:
        """Group the values of a response by the level of a factor, for each combination of the instance and all other
        factors.
        """
        position = 1 + [item.name for item in self.description.factors].index(factor)
        by_rest: dict[DesignCell, dict[str, list[float]]] = {}
        for cell, values in self.values_by_cell(response).items():
            by_rest.setdefault(cell[:position] + cell[position + 1 :], {})[cell[position]] = values
        return by_rest


def has_any_result(row: Row) -> bool:
    """Return whether a run has any result. Even if a program was refused, its search may have a result."""
    return not row.failed or any(value is not None for value in row.responses.values())


def variant_name(description: Description, cell: DesignCell) -> str:
    """Return the name of a variant, which consists of the levels in a cell without the instance.

    The title of the factor precedes a numeric level.
    """
    levels = zip(description.factors, cell[1:], strict=True)
    return ", ".join(f"{factor.title} {level}" if factor.numeric else level for factor, level in levels) or "runs"


def five_digits(value: float) -> str:
    """Format a number with five significant digits."""
    if not math.isfinite(value):
        return "∞" if value > 0 else "–"
    if value == 0.0:
        return "0"
    if abs(value) < 1e-4:
        return f"{value:.1e}"
    places = 4 - math.floor(math.log10(abs(value)))
    return f"{value:,.{min(max(places, 0), 7)}f}"


def five_digits_or_dash(value: float | None) -> str:
    """Format a number, or return a dash for None."""
    return "–" if value is None else five_digits(value)


def p_value_words(p: float | None, name: str = "p ") -> str:
    """Format a p value, such as ``p = 0.012`` or ``p < 0.001``. `name` is the prefix."""
    if p is None:
        return "–"
    if p < 0.001:
        return f"{name}< 0.001"
    return f"{name}= {p:.3f}" if name else f"{p:.3f}"
