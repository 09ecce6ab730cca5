"""Read leafcut's TOML files strictly: every wrong key or value raises an error with its position."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from leafcut.errors import DataError, OptionError, name_suggestion, printable
from leafcut.message import Message, map_text
from leafcut.units import BARE_UNIT, parse_quantity

T = TypeVar("T")


class TomlTable:
    """A table in a TOML file, with typed access to its values.

    Attributes
    ----------
    place
        Prefix of messages, such as the file, or "" for no prefix.
    section
        Name of the table, and its number in an array, from 1; ("", 0) for the whole file.
    """

    def __init__(self, values: Any, place: str, keys: Iterable[str], section: tuple[str, int] = ("", 0)) -> None:
        self.section, self.place = section, place
        name, number = section
        self._prefix = f"{name}." if name and not number else ""
        if not isinstance(values, Mapping):
            self.section, self._prefix = ("", 0), ""
            raise self._error(name, Message("'{}' is not a table; write [{}]", name, name))
        self.values: Mapping[str, Any] = values
        known = tuple(keys)
        for key in values:
            if key not in known:
                shown, suggestion = _printable_value(self._prefix + key), name_suggestion(key[:80], known)
                raise self._error(key, Message("unknown key '{}'{}", shown, suggestion))

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def value_error(self, key: str, reason: str, *values: object) -> DataError:
        """Create the error for the value of `key`. `reason` is a template, which `values` fill."""
        return self._error(key, Message(f"'{{}}' {reason}", self._prefix + key, *values))

    def _error(self, key: str, message: Message) -> DataError:
        message = Message("{}: {}", self.place, message) if self.place else message
        return DataError(message).at(*self.section, key)

    def table(self, key: str, keys: Iterable[str]) -> TomlTable:
        """Return the table `key`, or an empty table if the key is missing."""
        return TomlTable(self.values.get(key, {}), self.place, keys, (key, 0))

    def text(self, key: str, default: str | None = None, choices: Iterable[str] = ()) -> str:
        """Return a single-line string. The key is required unless the caller passes a `default`."""
        value = self._get(key, default)
        if not isinstance(value, str) or not value.isprintable():
            raise self.value_error(key, "is {}, but must be a string without line breaks", _printable_value(value))
        known = tuple(choices)
        if known and value not in known:
            suggestion = name_suggestion(value[:80], [choice for choice in known if choice])
            raise self.value_error(key, "is '{}'{}", _printable_value(value), suggestion)
        return value

    def texts(self, key: str, choices: Iterable[str] = ()) -> tuple[str, ...]:
        """Return a list of single-line strings. Blank strings raise an error."""
        value, known = self._get(key, None), tuple(choices)
        if not isinstance(value, list):
            raise self.value_error(key, "is {}, but must be a list of strings", _printable_value(value))
        for item in value:
            if not isinstance(item, str) or not item.isprintable() or not item.strip():
                raise self.value_error(
                    key, "has {}, but must be a list of strings without line breaks", _printable_value(item)
                )
            if known and item not in known:
                raise self.value_error(key, "has '{}'{}", _printable_value(item), name_suggestion(item[:80], known))
        return tuple(value)

    def flag(self, key: str, default: bool | None = None) -> bool:
        """Return a bool."""
        value = self._get(key, default)
        if not isinstance(value, bool):
            raise self.value_error(key, "is {}, but must be true or false", _printable_value(value))
        return value

    def integer(self, key: str, lowest: int = 0, highest: int = 9999) -> int:
        """Return an integer, and check that it is within bounds."""
        return self._checked_integer(key, self._get(key, None), lowest, highest)

    def integers(self, key: str, lowest: int, highest: int) -> tuple[int, ...]:
        """Return a list of one or more integers, and check that they are within bounds."""
        value = self._get(key, None)
        if not isinstance(value, list) or not value:
            raise self.value_error(key, "is {}, but must be a list such as [1, 2]", _printable_value(value))
        return tuple(self._checked_integer(key, item, lowest, highest) for item in value)

    def number(self, key: str, default: float) -> float:
        """Return a number without a unit."""
        value = self._get(key, default)
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.value_error(key, "is {}, but must be a number", _printable_value(value))
        return float(value)

    def quantity(self, key: str, unit: str, default: float | None = None) -> float:
        """Convert a quantity with a unit, such as "25.4 m/min", to the internal `unit`."""
        return default if default is not None and key not in self else self._quantity(key, unit, self._get(key, None))

    def with_value(self, key: str, value: Any) -> TomlTable:
        """Return the table with a different value for a key."""
        return TomlTable({**self.values, key: value}, self.place, {*self.values, key}, self.section)

    def optional(self, key: str, read: Callable[[str], T]) -> T | None:
        """Return ``read(key)``, or None if the key is missing."""
        return read(key) if key in self else None

    def vector(self, key: str, unit: str, size: int = 3) -> tuple[float, ...]:
        """Return a quantity for each axis. A single string applies to all axes."""
        value = self._get(key, None)
        if isinstance(value, str):
            value = [value] * size
        if not isinstance(value, list) or len(value) != size:
            raise self.value_error(
                key, "is {}, but must be {} strings, one for each axis", _printable_value(value), size
            )
        return tuple(self._quantity(key, unit, item) for item in value)

    def as_written(self, key: str, axis: int = 0) -> str:
        """Return a value as the user wrote it in the file, with its unit. In a list, `axis` selects the value."""
        value = self.values.get(key, "")
        return _printable_value(value[axis] if isinstance(value, list) else value)

    def _get(self, key: str, default: Any) -> Any:
        if key in self.values:
            return self.values[key]
        if default is None:
            raise self._error(key, Message("the key '{}' is missing", self._prefix + key))
        return default

    def _checked_integer(self, key: str, value: Any, lowest: int, highest: int) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not lowest <= value <= highest:
            raise self.value_error(
                key, "is {}, but must be a whole number from {} to {}", _printable_value(value), lowest, highest
            )
        return value

    def _quantity(self, key: str, unit: str, value: Any) -> float:
        if not isinstance(value, str):
            raise self.value_error(
                key, "is {}, but must be a string with a unit, such as '1 {}'", _printable_value(value), BARE_UNIT[unit]
            )
        try:
            return parse_quantity(value[:80], unit)
        except OptionError as problem:
            raise self.value_error(
                key, "is wrong: {}", map_text(str(problem), lambda text: " ".join(text.split()))
            ) from None


def _printable_value(value: Any) -> str:
    try:
        text = value if isinstance(value, str) else repr(value)
    except ValueError:  # the integer has more digits than Python prints
        text = Message("a very long number")
    return printable(text)
