"""Under a search that is studied: what its algorithm just did."""

from __future__ import annotations

import math
import time

from nicegui import ui

from leafcut.model.snapshot import Snapshot
from leafcut.studio.page.elements import box, text
from leafcut.studio.page.lesson import lesson
from leafcut.studio.wording import Words

#: Seconds between two lessons of a search that is not held: who reads one must be able to.
_EVERY = 1.0


class LessonPanel:
    """Tells of the steps of a search, the newest that is seen."""

    def __init__(self, words: Words) -> None:
        self.words = words
        self._shown: tuple[Snapshot | None, float] = (None, -math.inf)
        with box("section", "lesson", aria_label=words("lesson.title")) as self.place:
            self.title = text("h3", words("lesson.title"))
            self.told = ui.html("", sanitize=False)

    def clear(self) -> None:
        """Tell of no step."""
        self._shown = (None, -math.inf)
        self.place.set_visibility(False)

    def show(self, snapshot: Snapshot | None, paused: bool) -> None:
        """Tell of the step that a search stands at."""
        seen, when = self._shown
        now = time.monotonic()
        if snapshot is None or snapshot.step is None or snapshot is seen or (now < when + _EVERY and not paused):
            return
        self._shown = (snapshot, now)
        self.place.set_visibility(True)
        self.title.set_text(self.words("lesson.step", number=f"{snapshot.iteration:,}"))
        self.told.set_content(lesson(snapshot.step, self.words))
