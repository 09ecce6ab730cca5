"""`Message`: an English text for users that can be translated, because it keeps its template and its values."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable
from functools import cache, reduce
from itertools import pairwise
from string import Formatter
from typing import Any, Self

#: Placeholder for a value in a template.
GAP = "{}"
_WORDS = re.compile(r"[^\W\d_]{2}")


class Message(str):
    """A text built from a template and its values: ``Message("pocket {} of {}: {:.3g} mm", 2, 5, depth)``.

    The message itself is the English text. A catalogue translates the template. It also translates values that are
    messages, but no other values, such as the name of a file.

    Attributes
    ----------
    template
        The template with ``{}`` for each placeholder. This is the key in the catalogue.
    values
        The texts that replace the placeholders.
    """

    __slots__ = ("template", "values")
    template: str
    values: tuple[str, ...]

    def __new__(cls, template: str, *values: object) -> Self:
        """Fill the placeholders of a template in order. A placeholder is ``{}``, ``{:.3g}`` or ``{!r}``."""
        key, gaps = _split_template(template)
        # `format` of a message, or of an exception with a message, is the message.
        texts = tuple(
            format(value) if gap == GAP else gap.format(value) for gap, value in zip(gaps, values, strict=True)
        )
        return cls.of_parts(key.format(*texts), key, texts)

    @classmethod
    def of_text(cls, text: str) -> Message:
        """Convert a text without values to a message. A message is returned unchanged."""
        return text if isinstance(text, Message) else cls.of_parts(text, text.replace("{", "{{").replace("}", "}}"), ())

    @classmethod
    def of_parts(cls, text: str, template: str, values: tuple[str, ...]) -> Self:
        """Create a message from a text that was already built from the template and the values."""
        message = super().__new__(cls, text)
        message.template, message.values = template, values
        return message

    def __str__(self) -> str:
        """Return the message itself, so that `str` of an exception keeps the template and the values."""
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return self.of_parts, (self.text, self.template, self.values)

    def __add__(self, other: str) -> Message:
        """Append a text or another message."""
        return Message("{}{}", self, other)

    def __radd__(self, other: str) -> Message:
        return Message("{}{}", other, self)

    @property
    def text(self) -> str:
        """The English text alone."""
        return super().__str__()

    @classmethod
    def joined(cls, separator: str, parts: Iterable[object]) -> Message:
        """Join texts or messages with a separator that contains no words."""
        values = tuple(parts)
        return cls(separator.join(GAP for _ in values), *values)

    @classmethod
    def joined_by_and(cls, parts: Iterable[object]) -> Message:
        """Join one or more parts with "and" between them."""
        first, *others = parts
        return reduce(lambda message, part: cls("{} and {}", message, part), others, cls(GAP, first))

    def map(self, function: Callable[[str], str]) -> Self:
        """Apply a function to the text of the message and to every value. A quoted value includes its quotes."""
        values = (
            function(f"'{value}'")[1:-1] if quoted else map_text(value, function)
            for value, quoted in zip(self.values, quoted_gaps(self.template), strict=True)
        )
        return self.of_parts(function(self.text), self.template, tuple(values))


def map_text(text: str, function: Callable[[str], str]) -> str:
    """Apply a function to a text. If the text is a message, it keeps its template."""
    return text.map(function) if isinstance(text, Message) else function(text)


@cache
def quoted_gaps(template: str) -> tuple[bool, ...]:
    """Return, for each placeholder, whether it is in single quotes. A quoted value is the user's own text."""
    parts = template.replace("{{", "").replace("}}", "").split(GAP)
    return tuple(before.endswith("'") and after.startswith("'") for before, after in pairwise(parts))


def template_key(template: str) -> str:
    """Return a template with plain placeholders, which is its key in the catalogue."""
    return _split_template(template)[0]


def has_words(template: str) -> bool:
    """Return whether a template contains words, so that the catalogue needs to translate it."""
    return _WORDS.search(template) is not None


@cache
def _split_template(template: str) -> tuple[str, tuple[str, ...]]:
    """Split a template into a text with plain placeholders, and the placeholders with their formats."""
    key, gaps = "", []
    for literal, name, form, conversion in Formatter().parse(template):
        key += literal.replace("{", "{{").replace("}", "}}")
        if name is None:
            continue
        if name:
            raise ValueError(f"a gap with the name '{name}' in {template!r}")
        key += GAP
        gaps.append(f"{{{f'!{conversion}' if conversion else ''}{f':{form}' if form else ''}}}")
    return key, tuple(gaps)


def messages_to_json(plain: Any) -> Any:
    """Convert each message in nested dicts and lists to a dict, so that JSON keeps its template and values."""
    match plain:
        case Message():
            values = [messages_to_json(value) for value in plain.values]
            return {"text": plain.text, "template": plain.template, "values": values}
        case dict():
            return {key: messages_to_json(value) for key, value in plain.items()}
        case list() | tuple():
            return [messages_to_json(value) for value in plain]
    return plain


def messages_from_json(text: str | bytes) -> Any:
    """Parse a JSON text, and restore the messages that `messages_to_json` converted."""
    return json.loads(text, object_hook=_restore_message)


def _restore_message(plain: dict[str, Any]) -> Any:
    if plain.keys() == {"text", "template", "values"}:
        return Message.of_parts(plain["text"], plain["template"], tuple(plain["values"]))
    return plain
