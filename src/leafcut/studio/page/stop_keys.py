"""Buttons and a number field that select and move the stops of an order, as an alternative to dragging."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from leafcut.errors import OptionError
from leafcut.studio.drawing.editing import Edited, OrderStop
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.wording import Words


class StopKeys:
    """Buttons that select the previous or next stop, and move the selected stop in the order.

    `choose` is called with the name of the selected stop.
    """

    def __init__(
        self,
        words: Words,
        stops: Callable[[], list[OrderStop]],
        choose: Callable[[int], Any],
        change: Callable[[Callable[[Edited], Any]], Any],
    ) -> None:
        self._words, self._stops, self._choose, self._change = words, stops, choose, change
        self._chosen = 0
        w = words
        with box("div", "stops", role="toolbar", aria_label=w("edit.stops"), data_roving=""):
            for position, (name, pattern, act) in enumerate(
                (
                    ("previous", "‹ {}", lambda: self._step(-1)),
                    ("next", "{} ›", lambda: self._step(1)),
                    ("earlier", "{}", lambda: self._shift(-1)),
                    ("later", "{}", lambda: self._shift(1)),
                )
            ):
                short = pattern.format(w(f"edit.{name}_short"))
                button(short, act, "small", aria_label=w(f"edit.{name}"), tabindex="-1" if position else "0")
        with box("form", "to-place") as form:
            text("label", w("edit.to_short"), "quiet", for_="edit-to")
            with box("span", "box"):
                self._to = box(
                    "input",
                    "",
                    id="edit-to",
                    type="text",
                    inputmode="numeric",
                    autocomplete="off",
                    aria_label=w("edit.to"),
                )
            button(w("edit.move"), None, "small").props("type=submit")
        self._number = ""
        self._to.on("input", self._note, js_handler="(e) => emit(e.target.value)")
        form.on("submit", self._put, js_handler="(e) => { e.preventDefault(); emit(); }")

    def show(self, chosen: int) -> None:
        """Set the selected stop; 0 for none."""
        self._chosen = chosen

    def _note(self, event: Any) -> None:
        self._number = str(event.args)

    def _at(self) -> int:
        return next((k for k, stop in enumerate(self._stops()) if stop.name == self._chosen), -1)

    def _step(self, step: int) -> None:
        stops, index = self._stops(), self._at()
        if stops:
            target = (0 if step > 0 else len(stops) - 1) if index < 0 else min(max(index + step, 0), len(stops) - 1)
            self._choose(stops[target].name)

    def _shift(self, step: int) -> None:
        self._move(self._at() + step if self._at() >= 0 else -1)

    def _put(self) -> None:
        number, count = self._number.strip(), len(self._stops())
        target = int(number) - 1 if number.isdecimal() and len(number) < 10 else -1
        self._move(target if 0 <= target < count else -1, self._words("edit.places", count=count))

    def _move(self, target: int, refusal: str = "") -> None:
        stops, index = self._stops(), self._at()
        if index < 0 or (refusal and target < 0):
            self._change(_refused(refusal if index >= 0 else self._words("edit.choose")))
        elif 0 <= target < len(stops) and target != index:
            name, onto = stops[index].name, stops[target].name
            self._change(lambda edited: edited.move(name, onto))


def _refused(line: str) -> Callable[[Edited], None]:
    def act(_: Edited) -> None:
        raise OptionError(line)

    return act
