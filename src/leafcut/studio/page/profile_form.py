"""The form of a machine or a tool, with a field for each TOML key. It preserves comments and the order (tomlkit)."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit
from tomlkit.items import AoT
from tomlkit.toml_document import TOMLDocument

from leafcut.errors import OptionError
from leafcut.read.machine_keys import PROFILE_KEYS, ProfileKey
from leafcut.read.tool_keys import HOLE_KEYS, TOOL_KEYS
from leafcut.studio.wording import Words
from leafcut.units import BARE_UNIT, add_default_unit

#: Arrays in a tool library, with the keys of their entries.
ARRAYS: dict[str, tuple[ProfileKey, ...]] = {"tool": TOOL_KEYS, "hole": HOLE_KEYS}
#: Text that becomes the source of a value that the user has typed.
BY_HAND = "set by hand"
#: Content of a new tool and of a new recipe.
_NEW: dict[str, dict[str, Any]] = {"tool": {"diameter": "6 mm"}, "hole": {"diameter": "6 mm"}}


def profile_keys(array: str) -> tuple[ProfileKey, ...]:
    """Return the keys of an array's entries. If `array` is empty, return the keys of a machine."""
    return ARRAYS[array] if array else PROFILE_KEYS


def parse_profile(text: str) -> dict[str, Any] | None:
    """Parse TOML text. Returns None if it is invalid."""
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError):
        return None


def form_groups(words: Words, array: str, data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the fields of a machine by table, or the fields of an entry in an array, as required by `Form`."""
    stem = f"{array}." if array else ""
    tables = dict.fromkeys(key.table for key in profile_keys(array))
    sources = data.get("sources")
    return [
        {
            "key": table or "top",
            "title": words(f"profile.group.{array or table or 'machine'}"),
            "folded": False,
            "changed": 0,
            "fields": [
                _form_field(key, stem, words, sources if isinstance(sources, dict) else {})
                for key in profile_keys(array)
                if key.table == table
            ],
        }
        for table in tables
    ]


def _form_field(key: ProfileKey, stem: str, words: Words, sources: Mapping[str, Any]) -> dict[str, Any]:
    name = stem + key.name
    reason = words.translation("profile_why", name, key.why)
    bounds = words.translation("profile_bounds", name, key.bounds)
    source = sources.get(key.name)
    help_texts = [words.translation("profile_help", name, key.help), bounds and words("profile.bounds", bounds=bounds)]
    help_texts.append(words("profile.source", source=source) if isinstance(source, str) else "")
    shown = _shown_default(key)
    return {
        "name": key.name,
        "label": words(f"profile.{name}"),
        "flag": key.name,
        "kind": key.kind,
        "axes": list("xyz"[: key.size]) if key.kind == "axes" else [],
        "unit": BARE_UNIT.get(key.unit, ""),
        "help": ". ".join(filter(None, help_texts)),
        "choices": [[word, word] for word in key.choices],
        "offers": [],
        "default": shown or (words("profile.required") if key.required else reason),
        "rule": words("form.otherwise", rule=" · ".join(filter(None, (shown, reason))))
        if reason and not key.required
        else "",
        "on": key.default is True,
        "file": False,
    }


def _shown_default(key: ProfileKey) -> str:
    value = key.default[0] if isinstance(key.default, list) else key.default
    if value is None or isinstance(value, bool):
        return ""
    text = str(value)
    return text.partition(" ")[0] if key.unit and text.partition(" ")[2] in (BARE_UNIT[key.unit], "mm/s2") else text


def form_values(array: str, table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values for the fields of a machine or an entry in an array."""
    by_name = {}
    for key in profile_keys(array):
        inner = table.get(key.table, {}) if key.table else table
        if isinstance(inner, Mapping) and key.key in inner:
            by_name[key.name] = _shown_value(key, inner[key.key])
    return by_name


def _shown_value(key: ProfileKey, value: Any) -> Any:
    if key.kind == "flag" and isinstance(value, bool):
        return value
    if key.kind == "axes":
        return [str(item) for item in value] if isinstance(value, list) else [str(value)]
    return ", ".join(map(str, value)) if isinstance(value, list) else str(value)


def set_value(text: str, array: str, number: int, name: str, value: Any) -> str:
    """Set a key of a machine, or of entry `number` (from 0) in an array. Return the new text.

    An empty value removes the key. The source of the changed value becomes `BY_HAND`. Raises `OptionError` if the text
    is not valid TOML, if the entry does not exist, or if the text has a different value in place of the key's table.
    """
    document = _parse_document(text)
    key = next(key for key in profile_keys(array) if key.name == name)
    table: Any = document
    if array:
        listed, place = _array_and_index(document, array, number)
        table = listed[place]
    if key.table:
        if key.table not in table:
            table[key.table] = tomlkit.table()
        table = table[key.table]
        if not isinstance(table, Mapping):
            raise OptionError("'{}' is not a table; write [{}]", key.table, key.table)
    written = _value_to_write(key, value)
    if written is None:
        table.pop(key.key, None)
        if key.table and not table:
            document.pop(key.table)
    else:
        table[key.key] = written
    sources = document.get("sources")
    if not array and isinstance(sources, dict) and name in sources:
        sources[name] = BY_HAND
    return tomlkit.dumps(document)


def _value_to_write(key: ProfileKey, value: Any) -> Any:
    """Convert a typed value to TOML. Invalid text is kept, because the reader will report it later."""
    if isinstance(value, bool):
        return value
    if key.kind == "axes":
        parts = [str(item).strip() for item in value]
        given = [part for part in parts if part]
        if not given:
            return None
        if len(given) == 1 and parts[0]:
            return _with_unit_if_number(given[0], key.unit)
        return [_with_unit_if_number(part, key.unit) for part in parts]
    text = str(value).strip()
    if not text:
        return None
    if key.kind == "quantity":
        return _with_unit_if_number(text, key.unit)
    if key.kind == "wholes":
        return [_number_or_text(part.strip()) for part in text.split(",") if part.strip()]
    return _number_or_text(text) if key.kind in ("number", "whole") else text


def _with_unit_if_number(text: str, unit: str) -> str:
    try:
        return add_default_unit(text, unit)
    except OptionError:
        return text


def _number_or_text(text: str) -> int | float | str:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


def array_entries(data: Mapping[str, Any], array: str) -> list[Mapping[str, Any]]:
    """Return the entries of an array of a tool library."""
    items = data.get(array, [])
    return [item for item in items if isinstance(item, Mapping)] if isinstance(items, list) else []


def _array_and_index(document: Mapping[str, Any], array: str, number: int) -> tuple[list[Any], int]:
    """Return an array, and the index of table `number` in this array. The array may also contain other values."""
    items = document.get(array)
    listed = items if isinstance(items, list) else []
    places = [k for k, item in enumerate(listed) if isinstance(item, Mapping)]
    if number >= len(places):
        raise OptionError("'{}' has no entry {}", array, number + 1)
    return listed, places[number]


def add_entry(text: str, array: str) -> str:
    """Add a new tool or a new recipe, and return the new text. Raises `OptionError` if the text is invalid."""
    document = _parse_document(text)
    numbers = [tool.get("number") for tool in array_entries(document.unwrap(), "tool")]
    known = [number for number in numbers if isinstance(number, int)]
    entry_table = tomlkit.table()
    for key, value in _NEW[array].items():
        if not entry_table and array == "tool":
            entry_table["number"] = max(known, default=0) + 1
        entry_table[key] = value
    if array == "hole":
        entry_table["steps"] = known[:1]
    entry_table.add(tomlkit.nl())
    if array not in document:
        document[array] = tomlkit.aot()
    listed = document[array]
    if not isinstance(listed, AoT):
        raise OptionError("'{}' must be written as [[{}]], once for each entry", array, array)
    listed.append(entry_table)
    return tomlkit.dumps(document)


def remove_entry(text: str, array: str, number: int) -> str:
    """Remove entry `number` (from 0) from an array, and return the new text.

    Raises `OptionError` if the text is invalid or does not have this entry.
    """
    document = _parse_document(text)
    listed, place = _array_and_index(document, array, number)
    del listed[place]
    if not listed:
        document.pop(array)
    return tomlkit.dumps(document)


def rename_profile(text: str, shown: str, name: str) -> str:
    """If the name of a machine is `shown`, change it to `name`. Return the new text."""
    try:
        document = _parse_document(text)
    except OptionError:
        return text
    if document.get("name") == shown:
        document["name"] = name
    return tomlkit.dumps(document)


def entry_title(array: str, entry: Mapping[str, Any]) -> str:
    """Return the label that a list shows for a tool or a recipe."""
    parts: Sequence[Any]
    if array == "tool":
        parts = (
            f"T{entry.get('number', '?')}",
            entry.get("name") or entry.get("kind", "drill"),
            entry.get("diameter", ""),
        )
    else:
        parts = (f"Ø {entry.get('diameter', '?')}", entry.get("layer", "*"))
    return " · ".join(str(part) for part in parts if part)


def _parse_document(text: str) -> TOMLDocument:
    try:
        return tomlkit.parse(text)
    except (ValueError, RecursionError) as problem:
        raise OptionError("not a TOML file ({})", problem) from None
