"""The text of a program in the making: blocks with line numbers, and the memory of what has been said."""

from __future__ import annotations

from collections.abc import Iterable

from leafcut.errors import PostError
from leafcut.gcode.dialects import Dialect
from leafcut.post.comments import comment_lines

_STEP = 10
_LAST_NUMBER = 99_990


class Blocks:
    """Collects lines. Words that are modal are left out while they still hold."""

    def __init__(self, dialect: Dialect, numbered: bool) -> None:
        self.lines: list[str] = []
        self._dialect = dialect
        self._numbered = numbered
        self._number = 0
        self._said: dict[str, str] = {}

    def say(self, *words: str) -> None:
        """Write one block; empty words are left out, and so is a block without words."""
        said = [word for word in words if word]
        if self._dialect.one_command:
            commands = [word for word in said if word[0] in "GM"]
            for word in commands[:-1]:
                self._line(word)
            said = [*commands[-1:], *(word for word in said if word not in commands)]
        self._line(" ".join(said))

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
        """Write a text as one or more lines of comment."""
        dialect = self._dialect
        self.lines += comment_lines(text, dialect.max_line, dialect.uppercase_comments, dialect.comments)

    def modal(self, group: str, word: str) -> str:
        """Return the word, or nothing when the last word of its group was the same."""
        repeat = self._dialect.one_command and group == "motion"
        if self._said.get(group) == word and not repeat:
            return ""
        self._said[group] = word
        return word

    def forget(self, groups: Iterable[str]) -> None:
        """Let the next word of these groups be said in any case."""
        for group in groups:
            self._said.pop(group, None)
