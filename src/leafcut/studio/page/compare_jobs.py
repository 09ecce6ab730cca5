"""Comparison of two jobs: their results and options, with differences marked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from leafcut.processes.settings import all_options
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.page.forms import changed_values, value_words
from leafcut.studio.wording import Words
from leafcut.units import format_length, format_time

_NONE = "–"


@dataclass(frozen=True)
class ComparedRow:
    """A result or an option of two jobs, as displayed."""

    label: str
    one: str
    other: str

    @property
    def differs(self) -> bool:
        """Whether the two values differ."""
        return self.one != self.other


def _percent(value: float) -> str:
    return f"{value:.2f} %"


def _plain(value: Any) -> str:
    return f"{value:,.10g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)


#: (key of the label, path of the value in the answer, function that formats it).
_FIGURES: tuple[tuple[str, tuple[str, ...], Callable[[Any], str]], ...] = (
    ("result.before", ("before", "time_s"), format_time),
    ("result.after", ("after", "time_s"), format_time),
    ("compare.saved", ("saved_percent",), _percent),
    ("result.travel", ("after", "travel_mm"), format_length),
    ("result.cutting", ("after", "cut_mm"), format_length),
    ("result.time", ("time_s",), format_time),
    ("result.rapid", ("rapid_mm",), format_length),
    ("result.feed", ("feed_mm",), format_length),
    ("compare.length", ("length",), _plain),
    ("compare.gap", ("gap_percent",), _percent),
    ("result.lower_bound", ("lower_bound",), _plain),
    ("result.iterations", ("iterations",), _plain),
    ("result.machine", ("machine",), _plain),
    ("result.dialect", ("dialect",), _plain),
    ("result.algorithm", ("algorithm",), _plain),
    ("result.seed", ("seed",), _plain),
    ("result.computing", ("seconds",), format_time),
)


def compared_figures(answers: tuple[Mapping[str, Any], Mapping[str, Any]], words: Words) -> list[ComparedRow]:
    """Return a row for each result in any of the answers."""
    rows = []
    for label, path, format_value in _FIGURES:
        first, second = (_value_at(answer, path) for answer in answers)
        if first is not None or second is not None:
            rows.append(ComparedRow(words(label), *(_NONE if v is None else format_value(v) for v in (first, second))))
    return rows


def _value_at(answer: Mapping[str, Any], path: tuple[str, ...]) -> Any:
    value: Any = answer
    for key in path:
        value = value.get(key) if isinstance(value, Mapping) else None
    return value


def compared_options(records: tuple[JobRecord, JobRecord], folder: Folder, words: Words) -> list[ComparedRow]:
    """Return a row for each option that is set in any of the jobs. Jobs without the option show the default."""
    given = tuple(changed_values(record.task.options) for record in records)
    names = [name for _, name, _ in all_options() if name in given[0] or name in given[1]]

    def shown(record: JobRecord, options: Mapping[str, Any], name: str) -> str:
        return value_words(name, options.get(name), words, folder, record.task.process)

    return [
        ComparedRow(words.option(name), *(shown(*job, name) for job in zip(records, given, strict=True)))
        for name in names
    ]
