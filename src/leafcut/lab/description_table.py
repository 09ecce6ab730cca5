"""A table of an experiment file, with type-checked access."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from leafcut.errors import OptionError, nearest


def value_text(value: Any) -> str:
    """Return a level or a figure as text."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def number_of(value: Any) -> float | None:
    """Return a number, None if the value is not a number."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


@dataclass(frozen=True)
class DescriptionTable:
    """A table of the file and its path in it; each access checks the type."""

    content: Mapping[str, Any]
    experiment: str
    place: str

    @property
    def name(self) -> str:
        """The last part of the path."""
        return self.place.rpartition(".")[2]

    def wrong(self, words: str) -> OptionError:
        """Return an error that names the experiment and the table."""
        return OptionError(f"experiment '{self.experiment}'{f', [{self.place}]' if self.place else ''}: {words}")

    def check(self, known: set[str]) -> None:
        """Refuse unknown keys."""
        for key in self.content:
            if key not in known:
                raise self.wrong(f"unknown key '{key}'{nearest(key, sorted(known))}")

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text; without a default, the key is required."""
        value = self.content.get(key, default)
        if not isinstance(value, str):
            raise self.wrong(f"{key}: a text is needed" + ("" if value is None else f", not {value!r}"))
        return value

    def flag(self, key: str) -> bool:
        """Return true or false."""
        value = self.content.get(key, False)
        if not isinstance(value, bool):
            raise self.wrong(f"{key}: give true or false, not {value!r}")
        return value

    def as_number(self, key: str, value: Any) -> float:
        """Return a number."""
        number = number_of(value)
        if number is None:
            raise self.wrong(f"{key}: a number is needed, not {value!r}")
        return number

    def texts(self, key: str) -> list[str]:
        """Return a list of texts, or of numbers as texts."""
        value = self.content.get(key, [])
        if not isinstance(value, list) or any(isinstance(item, dict | list) for item in value):
            raise self.wrong(f"{key}: a list of texts is needed")
        return [value_text(item) for item in value]

    def table(self, key: str) -> dict[str, Any]:
        """Return a table unchanged."""
        value = self.content.get(key, {})
        if not isinstance(value, dict):
            raise self.wrong(f"{key}: a table is needed")
        return value

    def dicts(self, key: str) -> dict[str, dict[str, Any]]:
        """Return a table of tables."""
        tables = self.table(key)
        for name, entry in tables.items():
            if not isinstance(entry, dict):
                raise self.wrong(f"{key}.{name}: a table is needed")
        return tables

    def tables(self, key: str) -> list[DescriptionTable]:
        """Return the tables of a table, in order."""
        return [
            DescriptionTable(content, self.experiment, f"{key}.{name}") for name, content in self.dicts(key).items()
        ]

    def list_of_tables(self, key: str) -> list[DescriptionTable]:
        """Return the tables of a list of tables."""
        value = self.content.get(key, [])
        if not isinstance(value, list) or any(not isinstance(item, dict) for item in value):
            raise self.wrong(f"{key}: tables [[{key}]] are needed")
        return [DescriptionTable(item, self.experiment, f"{key} {k}") for k, item in enumerate(value, 1)]
