"""Type-checked access to the tables of an experiment file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from leafcut.errors import OptionError, name_suggestion
from leafcut.message import Message


def value_text(value: Any) -> str:
    """Return the value of a level or a result as text."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def number_of(value: Any) -> float | None:
    """Return a value as float, or None if it is not a number."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


@dataclass(frozen=True)
class DescriptionTable:
    """A table of an experiment file and its path. Each access checks the type of the value."""

    content: Mapping[str, Any]
    experiment: str
    place: str

    @property
    def name(self) -> str:
        """Last part of the path of the table."""
        return self.place.rpartition(".")[2]

    def wrong(self, words: str) -> OptionError:
        """Return an error whose message names the experiment and the table."""
        return OptionError(f"experiment '{self.experiment}'{f', [{self.place}]' if self.place else ''}: {words}")

    def check(self, known: set[str]) -> None:
        """Raise an error for a key that is not in `known`."""
        for key in self.content:
            if key not in known:
                raise self.wrong(Message("unknown key '{}'{}", key, name_suggestion(key, sorted(known))))

    def text(self, key: str, default: str | None = None) -> str:
        """Return the text under a key. The key is required if there is no default."""
        value = self.content.get(key, default)
        if not isinstance(value, str):
            raise self.wrong(f"{key}: a text is needed" + ("" if value is None else f", not {value!r}"))
        return value

    def flag(self, key: str) -> bool:
        """Return the boolean under a key, or False if the key is missing."""
        value = self.content.get(key, False)
        if not isinstance(value, bool):
            raise self.wrong(f"{key}: give true or false, not {value!r}")
        return value

    def as_number(self, key: str, value: Any) -> float:
        """Return a value as float; if it is not a number, raise an error that names `key`."""
        number = number_of(value)
        if number is None:
            raise self.wrong(f"{key}: a number is needed, not {value!r}")
        return number

    def texts(self, key: str) -> list[str]:
        """Return the list under a key as strings; numbers are converted."""
        value = self.content.get(key, [])
        if not isinstance(value, list) or any(isinstance(item, dict | list) for item in value):
            raise self.wrong(f"{key}: a list of texts is needed")
        return [value_text(item) for item in value]

    def table(self, key: str) -> dict[str, Any]:
        """Return the table under a key, or an empty table."""
        value = self.content.get(key, {})
        if not isinstance(value, dict):
            raise self.wrong(f"{key}: a table is needed")
        return value

    def dicts(self, key: str) -> dict[str, dict[str, Any]]:
        """Return a table whose values are all tables."""
        tables = self.table(key)
        for name, entry in tables.items():
            if not isinstance(entry, dict):
                raise self.wrong(f"{key}.{name}: a table is needed")
        return tables

    def tables(self, key: str) -> list[DescriptionTable]:
        """Return the tables inside a table, in file order."""
        return [
            DescriptionTable(content, self.experiment, f"{key}.{name}") for name, content in self.dicts(key).items()
        ]

    def list_of_tables(self, key: str) -> list[DescriptionTable]:
        """Return the tables of an array of tables ([[key]])."""
        value = self.content.get(key, [])
        if not isinstance(value, list) or any(not isinstance(item, dict) for item in value):
            raise self.wrong(f"{key}: tables [[{key}]] are needed")
        return [DescriptionTable(item, self.experiment, f"{key} {k}") for k, item in enumerate(value, 1)]
