"""Validation of the TOML table of a dialect: types and values of its keys, and consistency of its words."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from leafcut.errors import printable
from leafcut.gcode.word_groups import GROUP_OF, M_GROUP_OF
from leafcut.message import Message
from leafcut.model.kinds import CutMethod

#: Allowed values by key.
_CHOICES: dict[str, tuple[str, ...]] = {
    "language": ("g-code", "sinumerik", "klartext"),
    "groups": ("rs274", "fanuc"),
    "percent": ("", "frame", "title"),
    "units_mm": ("G21", "G71", "G710", ""),
    "units_inch": ("G20", "G70", "G700", ""),
    "comments": ("()", ";"),
    "cycle_words": ("rs274", "fagor", "siemens", "klartext"),
    "dwell_unit": ("s", "ms", "point", "cs"),
    "tool_change": ("M6", "pause", "M0"),
    "stop_word": ("M0", "M226"),
    "length_offset": ("H", "D", "edge", ""),
    "length_offset_off": ("G49", "G44", "D0", ""),
    "machine_move": ("G53", "G28", "SUPA", ""),
    "end_word": ("M2", "M30", ""),
    "end_required": ("", "word", "percent"),
    "line_ends": ("", "lf", "any"),
    "torch.heights": ("program", "controller", "none"),
    "torch.compensation": ("", "G41", "G41.1"),
    "torch.probe": ("", "G38.2"),
}
#: Allowed items of lists by key.
_ITEMS: dict[str, tuple[str, ...]] = {
    "cycles": ("G81", "G82", "G83", "G73", "G84", "G85"),
    "dwell_cycles": ("G81", "G82", "G83", "G73", "G84", "G85"),
    "torch.cuts": tuple(CutMethod),
}
#: Pattern of a text, and its description.
_PATTERNS = {
    "extension": (r"\.[A-Za-z0-9]{1,8}", Message("a point and up to eight letters and digits, such as .nc")),
    "dwell_letter": (r"[A-Z]", Message("a capital letter")),
    "repeat_letter": (r"[A-Z]?", Message("a capital letter, or empty")),
    "description": (r".+", "a text"),
}
#: Limits of integers. With fewer decimals the verification of a program fails.
_BOUNDS = {"max_line": (40, 10_000), "decimals_mm": (2, 6), "decimals_inch": (3, 7)}
_ANY_BOUNDS = (0, 9999)

#: Values of keys that a language requires, because its writer and its reader know no others.
_REQUIRED = {"klartext": {"end_word": "M30", "stop_word": "M0"}, "sinumerik": {"length_offset": "edge"}}

#: Placeholders for the beam power and the material number in the words of a torch.
POWER, NUMBER = "{power}", "{number}"
_PLACES = {"on": POWER, "mark_on": POWER, "material": NUMBER}


def fault_of_value(key: str, value: Any, kind: Any) -> Message:
    """Return the error in the value of a key (or ``torch.key``) of type `kind`, or ""."""
    if kind is bool:
        return (
            Message("") if isinstance(value, bool) else Message("is {}, but must be true or false", _value_text(value))
        )
    if kind is int:
        low, high = _BOUNDS.get(key, _ANY_BOUNDS)
        right = isinstance(value, int) and not isinstance(value, bool) and low <= value <= high
        return (
            Message("")
            if right
            else Message("is {}, but must be a whole number from {} to {}", _value_text(value), low, high)
        )
    if kind is str:
        return _fault_of_text(key, value)
    if not isinstance(value, list):
        return Message("is {}, but must be a list of texts", _value_text(value))
    known = _ITEMS.get(key)
    for item in value:
        if not _is_text(item) or not item.strip():
            return Message("has {}, but must be a list of texts of one line", _value_text(item))
        if known is not None and item not in known:
            return Message("has '{}', but takes only {}", _value_text(item), ", ".join(known))
    return Message("")


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and value.isprintable()


def _fault_of_text(key: str, value: Any) -> Message:
    if key in ("g_words", "m_words"):  # these lists may span several lines
        return (
            Message("") if isinstance(value, str) else Message("is {}, but must be a text of words", _value_text(value))
        )
    if not _is_text(value):
        return Message("is {}, but must be a text of one line", _value_text(value))
    known = _CHOICES.get(key)
    if known is not None and value not in known:
        return Message(
            "is '{}', but must be one of {}",
            _value_text(value),
            Message.joined(", ", (word or Message("nothing") for word in known)),
        )
    pattern, words = _PATTERNS.get(key, ("", ""))
    if pattern and not re.fullmatch(pattern, value):
        return Message("is '{}', but must be {}", _value_text(value), words)
    return Message("")


def _value_text(value: Any) -> str:
    try:
        return printable(value if isinstance(value, str) else repr(value))
    except ValueError:  # the number has more digits than Python prints
        return Message("a very long number")


def faults_of_words(table: Mapping[str, Any]) -> Iterator[tuple[str, Message]]:
    """Yield the keys of a complete table with inconsistent words, and the errors: both the controller and leafcut must
    support every word that leafcut writes.
    """
    g_words, m_words = table["g_words"].split(), table["m_words"].split()
    for key, words, letter, known in (
        ("g_words", g_words, "G", {_code_text("G", code / 10) for code in GROUP_OF}),
        ("m_words", m_words, "M", {_code_text("M", code) for code in M_GROUP_OF}),
    ):
        for word in words:
            if word not in known:
                yield key, Message("has '{}', which is no {} word that leafcut understands", _value_text(word), letter)
    for key, value in _REQUIRED.get(table["language"], {}).items():
        if table[key] != value:
            yield key, Message("is '{}', but must be {} in the language {}", table[key], value, table["language"])
    known_words = {*g_words, *m_words}
    for key in ("units_mm", "units_inch", "end_word"):
        if table[key] and table[key] not in known_words:
            yield key, Message("is {}, which is not one of its words", table[key])
    written = {
        "opening": table["opening"],
        "preamble": table["preamble"],
        "cycles": [] if table["cycle_words"] != "rs274" else table["cycles"],
    }
    torch = table["torch"]
    if torch is not None:
        yield from _faults_of_torch(torch)
        written |= {f"torch.{key}": value for key, value in torch.items() if key not in ("cuts", "compensation")}
    for key, value in written.items():
        for word in re.findall(r"[GM]\d[\d.]*", _joined_text(value)):
            if word not in known_words:
                yield key, Message("has {}, which is not one of its words", word)


def _joined_text(value: Any) -> str:
    return " ".join(value) if isinstance(value, list | tuple) else str(value)


def _code_text(letter: str, number: float) -> str:
    return f"{letter}{number:g}"


def _faults_of_torch(torch: Mapping[str, Any]) -> Iterator[tuple[str, Message]]:
    for key, wanted in (("on", "M3 M4"), ("off", "M5"), ("mark_on", "M3 M4"), ("mark_off", "M5")):
        switches = [word for word in torch[key].split() if word.startswith("M")]
        if not torch[key] and key.startswith("mark"):
            continue
        if len(switches) != 1 or switches[0] not in wanted.split():
            yield (
                f"torch.{key}",
                (
                    Message("must have the word M3 or M4, and no other M word")
                    if key in ("on", "mark_on")
                    else Message("must have the word M5, and no other M word")
                ),
            )
    for key, value in torch.items():
        text = _joined_text(value)
        rest = text.replace(_PLACES[key], "") if key in _PLACES else text
        if "{" in rest or "}" in rest:
            yield (
                f"torch.{key}",
                Message("has a brace; only {} in on and mark_on and {} in material are numbers", POWER, NUMBER),
            )
    if (POWER in torch["on"]) != torch["power"]:
        yield "torch.on", Message("must have {} where power = true, and only there", POWER)
