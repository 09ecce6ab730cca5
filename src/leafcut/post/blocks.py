"""Text of a program under construction: blocks with line numbers, and a memory of modal words."""

from __future__ import annotations

from collections.abc import Iterable

from leafcut.errors import PostError
from leafcut.gcode.dialects import Dialect
from leafcut.post.comments import comment_lines

_STEP = 10
_LAST_NUMBER = 99_990


class Blocks:
    """Collects lines. Modal words are omitted while they are still active."""

    def __init__(self, dialect: Dialect, numbered: bool) -> None:
        self.lines: list[str] = []
        self._dialect = dialect
        self._numbered = numbered
        self._number = 0
        self._active: dict[str, str] = {}

    def say(self, *words: str) -> None:
        """Write one block; empty words are omitted, and so is an empty block."""
        kept = [word for word in words if word]
        if self._dialect.one_command:
            commands = [word for word in kept if word[0] in "GM"]
            for word in commands[:-1]:
                self._line(word)
            kept = [*commands[-1:], *(word for word in kept if word not in commands)]
        self._line(" ".join(kept))

    def _line(self, text: str) -> None:
        if not text:
            return
        if self._numbered:
            self._number = self._number % _LAST_NUMBER + _STEP
            text = f"N{self._number} {text}"
        if len(text) > self._dialect.max_line:
            raise PostError(f"a block is longer than {self._dialect.name} takes: {text[:60]}…")
        self.lines.append(text)

    def comment(self, text: str) -> None:
        """Write a text as one or more comment lines."""
        dialect = self._dialect
        self.lines += comment_lines(text, dialect.max_line, dialect.uppercase_comments, dialect.comments)

    def modal(self, group: str, word: str) -> str:
        """Return the word, or "" if it is already active in its group."""
        repeat = self._dialect.one_command and group == "motion"
        if self._active.get(group) == word and not repeat:
            return ""
        self._active[group] = word
        return word

    def forget(self, groups: Iterable[str]) -> None:
        """Forget the active words of these groups, so that the next ones are written."""
        for group in groups:
            self._active.pop(group, None)
