"""The selection of the kind of work by thumbnails, with the reason for the suggested kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui.element import Element

from leafcut.studio.jobs.preview import Preview
from leafcut.studio.wording import Words


class WorkChoice(Element, component="../static/works.js"):
    """A group of radio buttons with thumbnails. `on_choose` receives the chosen kind of work."""

    def __init__(self, label: str, on_choose: Callable[[str], Any]) -> None:
        super().__init__()
        self.props.update(label=label, works=[], chosen="", why="", turn=0)
        self.on("choose", lambda e: on_choose(e.args))

    def show(self, works: list[dict[str, Any]], chosen: str, why: str) -> None:
        """Show `works` (``name``, ``title``, ``picture``), the chosen kind of work, and the reason for a suggestion."""
        self.props.update(works=works, chosen=chosen, why=why, turn=self.props["turn"] + 1)
        self.update()


def cards(kinds: tuple[str, ...], seen: Preview | None, words: Words) -> list[dict[str, Any]]:
    """Return a card for each kind of work, with a thumbnail that emphasizes its objects in the open drawing."""
    pictures = seen.whole.pictures if seen is not None else {}
    return [{"name": work, "title": words.named("work", work), "picture": pictures.get(work)} for work in kinds]


def why_suggested(seen: Preview | None, words: Words) -> str:
    """Return the suggested kind of work for a drawing, with the reason; empty without alternatives."""
    if seen is None or len(seen.whole.suits) < 2:
        return ""
    work, best = next(iter(seen.whole.suits.items()))
    reason = words.named("guess", best.reason).format(**best.figures)
    return words("choose.suggested", work=words.named("work", work), why=reason)
