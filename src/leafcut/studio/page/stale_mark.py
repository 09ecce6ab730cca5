"""The notice above an outdated result, with the choices that have changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui.elements.mixins.text_element import TextElement

from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.page_state import View
from leafcut.studio.page.staleness import differences, edited_by_hand

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

_MAX_LINES = 3


class StaleMark:
    """Marks a result, its badges and its programs as outdated while the page's choices differ from its run."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        self._record: JobRecord | None = None
        self._shown_changes: list[str] = []
        self._badges: list[tuple[TextElement, str]] = []
        self._programs: list[tuple[TextElement, str, str]] = []

    def draw(self, record: JobRecord) -> None:
        """Add the empty notice to the current container. Badges and programs are added later."""
        self._record = record
        self._badges, self._programs = [], []
        self.place = box("div", "stale", role="status", aria_live="polite")

    def leave(self) -> None:
        """Remove the notice, because no result is visible."""
        self._record = None
        if self._shown_changes:
            self._shown_changes = []
            self.page.run.tell_earlier("")

    def add_badge(self, badge: TextElement) -> None:
        """Add a badge to the marked elements."""
        self._badges.append((badge, badge.text))

    def add_program(self, anchor: TextElement, title: str) -> None:
        """Add a download link of a program to the marked elements. `title` is its normal tooltip."""
        self._programs.append((anchor, anchor.text, title))

    def refresh(self) -> None:
        """Compare the choices with the choices of the run, and update the notice."""
        record, w = self._record, self.view.words
        if record is None:
            return
        changes = [difference.line(w) for difference in differences(record, self.view)]
        if changes == self._shown_changes:
            return
        self._shown_changes = changes
        # If only the order was edited, the drawing already shows the edited order.
        drawn = changes != [edited_by_hand(w).line(w)]
        self.page.run.tell_earlier(w("stale.title") if changes and drawn else "")
        lines = changes[:_MAX_LINES] + (
            [w("open.more", number=len(changes) - _MAX_LINES)] if len(changes) > _MAX_LINES else []
        )
        self.place.clear()
        if changes:
            with self.place:
                self._show_changes(lines, drawn)
        for badge, words in self._badges:
            badge.set_text(w("stale.of_earlier", name=words) if changes else words)
            badge.classes(**{"add" if changes else "remove": "earlier"})
        for anchor, words, title in self._programs:
            anchor.set_text(w("stale.of_earlier", name=words) if changes else words)
            anchor.classes(**{"remove" if changes else "add": "primary"})
            anchor.props["title"] = f"{title}: {w('stale.title')}. {'. '.join(lines)}" if changes else title
            anchor.update()

    def _show_changes(self, lines: list[str], chosen: bool) -> None:
        """Show the differences, with a button that restores `chosen` options. An order is restored in its editor."""
        w = self.view.words
        text("b", w("stale.title"))
        with box("ul"):
            for line in lines:
                text("li", line, "", dir="auto")
        with box("div", "ends"):
            button(w("stale.again"), self._run_again, "small")
            if chosen:
                button(w("stale.back"), self._back, "small plain", title=w("stale.back_text"))

    def _run_again(self) -> None:
        self.page.input.page_run()

    async def _back(self) -> None:
        if self._record is not None:
            await self.page.input.restore(self._record.task)
