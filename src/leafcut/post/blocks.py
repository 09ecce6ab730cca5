"""Text of a program under construction: numbered blocks, without modal words that are already active."""

from __future__ import annotations

from collections.abc import Iterable

from leafcut.errors import PostError
from leafcut.gcode.dialects import Dialect
from leafcut.post.comments import comment_lines

_STEP = 10
_LAST_NUMBER = 99_990


class Blocks:
    """Collects the lines of a program, and tracks the active modal words."""

    def __init__(self, dialect: Dialect, numbered: bool) -> None:
        self.lines: list[str] = []
        self._dialect = dialect
        self._numbered = numbered
        self._number = 0
        self._active: dict[str, str] = {}

    def write(self, *words: str) -> None:
        """Write a block of words; empty words are left out, and a block without words is not written."""
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
            raise PostError("a block is longer than {} accepts: {}…", self._dialect.name, text[:60])
        self.lines.append(text)

    def comment(self, text: str) -> None:
        """Write a text as comment lines."""
        dialect = self._dialect
        self.lines += comment_lines(text, dialect.max_line, dialect.uppercase_comments, dialect.comments)

    def modal(self, group: str, word: str) -> str:
        """Activate a modal word in its group; return the word, or "" if it was active already."""
        repeat = self._dialect.one_command and group == "motion"
        if self._active.get(group) == word and not repeat:
            return ""
        self._active[group] = word
        return word

    def forget(self, groups: Iterable[str]) -> None:
        """Forget the active words of these groups; the next word of each group is then written in any case."""
        for group in groups:
            self._active.pop(group, None)
