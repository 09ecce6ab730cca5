"""The trials of a run: strategies of a pocket, or variants of a nest."""

from __future__ import annotations

from leafcut.studio.jobs.jobs import LiveJob
from leafcut.studio.page.elements import box, text
from leafcut.studio.wording import Words


class TriedPanel:
    """A row per trial with its result. The best trial and running trials are marked."""

    def __init__(self, words: Words, live: LiveJob) -> None:
        self.words, self.live = words, live
        self._rows: list[tuple[str, str, float | None]] = []
        self.place = box("div", "tried")
        self.tick()

    def tick(self) -> None:
        """Update the rows if they have changed."""
        rows = [(name, *figures) for name, figures in list(self.live.tried.items())]
        if rows == self._rows:
            return
        self._rows = rows
        best = min((cost for _, _, cost in rows if cost is not None), default=None)
        w = self.words
        self.place.clear()
        with self.place:
            text("h3", w("run.tried"))
            with box("ul", aria_label=w("run.tried")):
                for name, figure, cost in rows:
                    first = best is not None and cost == best
                    with box("li", "best" if first else "" if figure else "going"):
                        text("span", self._named(name))
                        text("span", w("run.best"), "tag done") if first else None
                        text("b", figure or w("run.trying"), "figure")

    def _named(self, name: str) -> str:
        """Return the label of a trial: ``by shapes · 3`` for the third variant of a nest by shapes."""
        method, _, number = name.partition(" ")
        known = self.words.table.get(f"nest.{method}")
        return f"{known} · {number}" if known and number.isdigit() else name
