"""Translation of leafcut's English messages by templates with gaps."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache, lru_cache
from itertools import pairwise
from typing import NamedTuple

from leafcut.message import Message, quoted_gaps

#: Maximum depth of messages within messages.
_DEEPEST = 6
#: Maximum number of positions at which a line is split.
_MAX_PARTS = 8
_GAP = "{}"
#: Template of joined messages. The table has some of them as a whole.
_JOINED = "{}{}"
#: Separators between the parts of a message: file and problem, problem and advice, remark.
_BETWEEN = re.compile(r"; |: | \(")
_WORD = re.compile(r"\w+")
_WORDS = re.compile(r"[^\W\d_]{2}")
#: A file name, which is never translated.
_FILE = re.compile(r"[^:;,()]{1,80}\.[A-Za-z][A-Za-z0-9]{0,4}")


class _Pattern(NamedTuple):
    """A message template with gaps, as a regular expression, and its translation.

    `size` is the number of letters of the template. `given` marks gaps in quotes, which contain user input and are
    not translated.
    """

    line: str
    words: frozenset[str]
    size: int
    given: tuple[bool, ...]
    translation: str


class _Translation(NamedTuple):
    text: str
    known: int


class Messages:
    """Message templates and their translations: ``the file has {} MiB`` = ``el archivo tiene {} MiB``."""

    def __init__(self, table: Mapping[str, str]) -> None:
        self.table = table
        self._whole = {line: translation for line, translation in table.items() if _GAP not in line}
        patterns = [_pattern(line, translation) for line, translation in table.items() if _GAP in line]
        often = Counter(word for pattern in patterns for word in pattern.words)
        #: Patterns by their rarest word ("" if they have none), so that only a few patterns are tried per line.
        self._by_word: dict[str, list[_Pattern]] = {}
        for pattern in patterns:
            rarest = min(pattern.words, key=lambda word: (often[word], word), default="")
            self._by_word.setdefault(rarest, []).append(pattern)
        self._matched = lru_cache(maxsize=4096)(self._match)

    def translate(self, line: str) -> str:
        """Return a message in the language of the table; an unknown text remains English.

        A text without templates, or with a template that the table lacks, is matched with all templates.
        """
        if isinstance(line, Message):
            return self._filled(line) if self._knows(line) else self._matched(line.text)
        return self._matched(line)

    def _filled(self, message: Message) -> str:
        values = (
            value if not isinstance(value, Message) and (quoted or _FILE.fullmatch(value)) else self.translate(value)
            for value, quoted in zip(message.values, quoted_gaps(message.template), strict=True)
        )
        return self.table.get(message.template, message.template).format(*values)

    def _knows(self, message: Message) -> bool:
        """Return whether the table has all templates of a message; a template without words needs no translation."""
        if message.template not in self.table and (_WORDS.search(message.template) or message.template == _JOINED):
            return False
        return all(self._knows(value) for value in message.values if isinstance(value, Message))

    def _match(self, line: str) -> str:
        return self._translated(line, 0, {}).text

    def _translated(self, line: str, depth: int, seen: dict[str, _Translation]) -> _Translation:
        """Translate a line as a whole or in two parts, whichever recognizes more of it."""
        if line in seen:
            return seen[line]
        best = _Translation(line, 0)
        if depth > _DEEPEST or (depth > 0 and _FILE.fullmatch(line)) or not any(c.isalpha() for c in line):
            return best
        if line in self._whole:
            best = _Translation(self._whole[line], len(line))
        for pattern, gaps in self._matches(line) if best.known == 0 else ():
            filled = [
                _Translation(gap, 0) if given else self._translated(gap, depth + 1, seen)
                for gap, given in zip(gaps, pattern.given, strict=True)
            ]
            known = pattern.size + sum(gap.known for gap in filled)
            if known > best.known:
                best = _Translation(pattern.translation.format(*(gap.text for gap in filled)), known)
        for between in list(_BETWEEN.finditer(line))[:_MAX_PARTS] if best.known < len(line) else ():
            head, tail = line[: between.start()], line[between.end() :]
            if head and tail:
                first, second = self._translated(head, depth + 1, seen), self._translated(tail, depth + 1, seen)
                # A file name before the colon must not become part of a gap.
                known = first.known + second.known
                if known > best.known or (known == best.known > 0 and between[0] == ": "):
                    best = _Translation(first.text + between[0] + second.text, known)
        seen[line] = best
        return best

    def _matches(self, line: str) -> Iterator[tuple[_Pattern, tuple[str, ...]]]:
        """Yield the longest matching patterns, each with the contents of its gaps."""
        words = {"", *_WORD.findall(line)}
        likely = [pattern for word in words for pattern in self._by_word.get(word, ()) if pattern.words <= words]
        size = 0
        for pattern in sorted(likely, key=lambda pattern: (-pattern.size, pattern.line)):
            if pattern.size < size:
                return
            if match := _compile_pattern(pattern.line).fullmatch(line):
                yield pattern, match.groups()
                size = pattern.size


def _pattern(line: str, translation: str) -> _Pattern:
    fixed_parts = line.split(_GAP)
    quoted = tuple(before.endswith("'") and after.startswith("'") for before, after in pairwise(fixed_parts))
    text = re.escape(fixed_parts[0])
    for (before, after), given in zip(pairwise(fixed_parts), quoted, strict=True):
        if given:
            gap = r"((?:(?!'[ ;:,)]).)+?)"
        else:
            # A gap next to a word or another gap may be empty: "nothing is left to cut{}", "{}{}".
            gap = r"(|\W.*?)" if text and not before else "(.*?)" if before[-1:].isalnum() else "(.+?)"
        text += gap + re.escape(after)
    return _Pattern(text, _words(fixed_parts), len("".join(fixed_parts)), quoted, translation)


@cache
def _compile_pattern(text: str) -> re.Pattern[str]:
    """Return the compiled pattern. Compiling all patterns at once would take a fifth of a second."""
    return re.compile(text, re.DOTALL)


def _words(fixed_parts: list[str]) -> frozenset[str]:
    """Return the words of a template, except words that touch a gap and could be parts of longer words."""
    text = "\0".join(fixed_parts)
    words = _WORD.finditer(text)
    return frozenset(word[0] for word in words if "\0" not in text[max(word.start() - 1, 0) : word.end() + 1])
