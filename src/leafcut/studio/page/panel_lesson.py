"""Explanation of an algorithm's last step, below a search that is watched step by step."""

from __future__ import annotations

import math
import time

from nicegui import ui

from leafcut.model.snapshot import Snapshot
from leafcut.studio.page.elements import box, text
from leafcut.studio.page.lesson import lesson
from leafcut.studio.wording import Words

#: Minimum interval between two explanations of a search that is not paused, s: time to read.
_EVERY = 1.0


class LessonPanel:
    """The card that explains the latest step of a search."""

    def __init__(self, words: Words) -> None:
        self.words = words
        self._shown: tuple[Snapshot | None, float] = (None, -math.inf)
        with box("section", "lesson", aria_label=words("lesson.title")) as self.place:
            self.title = text("h3", words("lesson.title"))
            self.content = ui.html("", sanitize=False)

    def clear(self) -> None:
        """Hide the explanation."""
        self._shown = (None, -math.inf)
        self.place.set_visibility(False)

    def show(self, snapshot: Snapshot | None, paused: bool) -> None:
        """Explain the current step of a search.

        If it is not paused, at most one step per `_EVERY` seconds is explained.
        """
        seen, shown_at = self._shown
        now = time.monotonic()
        if snapshot is None or snapshot.step is None or snapshot is seen or (now < shown_at + _EVERY and not paused):
            return
        self._shown = (snapshot, now)
        self.place.set_visibility(True)
        self.title.set_text(self.words("lesson.step", number=f"{snapshot.iteration:,}"))
        self.content.set_content(lesson(snapshot.step, self.words))
