"""The recent files and the page that was closed last. Users can reopen them with one click."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui.element import Element

from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.page_state import View
from leafcut.studio.recent_files import RecentFile
from leafcut.studio.wording import day_and_time

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Number of files that an empty page shows.
_SHORT = 4


class RecentPanel:
    """The recent files: a collapsed list next to the button *Open*, or a row of buttons on an empty page."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        self.place: Element | None = None

    def draw(self) -> None:
        """Show the folded list. It stays in the container in which it was first drawn."""
        if self.place is None:
            self.place = box("div", "recent")
        w, rows = self.view.words, self.view.studio.recent.newest()
        self.place.clear()
        if not rows:
            return
        with self.place, box("details", "built-in"):
            text("summary", w("recent.title"))
            with box("ul"):
                for recent in rows:
                    with box("li"):
                        self._add_button(recent, "plain small")
                        text("span", day_and_time(recent.opened), "quiet small")
            button(w("recent.clear"), self._clear_list, "plain small", data_sure=w("recent.sure"))

    def draw_short(self) -> None:
        """Show the most recent files and the page that was closed last in the current container."""
        w, last = self.view.words, self.page.last
        rows = self.view.studio.recent.newest()[:_SHORT]
        if last is not None:
            with box("p", "continue"):
                button(w("recent.continue", name=str(last.get("name", ""))), lambda: self.page.restore_choices(last))
        if rows:
            with box("div", "try", role="group", aria_label=w("recent.title")):
                text("span", w("recent.title"), "quiet")
                for recent in rows:
                    self._add_button(recent, "small")

    def _add_button(self, recent: RecentFile, classes: str) -> None:
        opening = lambda: self.page.input.open(recent.source, recent.name)  # noqa: E731
        button(recent.name, opening, classes, title=day_and_time(recent.opened), dir="auto")

    def _clear_list(self) -> None:
        self.view.studio.recent.clear()
        self.draw()
