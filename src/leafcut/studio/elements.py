"""The page's own elements: plain tags with text, the options form, and the opener of files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement

Fields = list[dict[str, Any]]


class Form(Element, component="static/form.js"):
    """Groups of labelled fields; `on_change` is told (name, value, what a file is called)."""

    def __init__(
        self,
        groups: Fields,
        words: dict[str, str],
        on_change: Callable[[str, Any, str], Any],
        on_refused: Callable[[str], Any],
    ) -> None:
        super().__init__()
        self._props.update(groups=groups, words=words, values={}, shown={}, errors={})
        self.on("change", lambda e: on_change(e.args["name"], e.args["value"], e.args["shown"]))
        self.on("refused", lambda e: on_refused(e.args["line"]))

    def show(
        self,
        values: dict[str, Any],
        shown: dict[str, str] | None = None,
        errors: dict[str, str] | None = None,
        groups: Fields | None = None,
    ) -> None:
        """Show values, what chosen files are called, what is wrong, and other fields."""
        self._props.update(values=dict(values), shown=dict(shown or {}), errors=dict(errors or {}))
        if groups is not None:
            self._props["groups"] = groups
        self.update()


class Opener(Element, component="static/opener.js"):
    """Opens a file by a dialogue or by dropping it on the page."""

    def __init__(
        self,
        words: dict[str, str],
        largest: int,
        on_opened: Callable[[dict[str, Any]], Any],
        on_refused: Callable[[str], Any],
    ) -> None:
        super().__init__()
        self._props.update(words=words, largest=largest, several=False)
        self.on("opened", lambda e: on_opened(e.args))
        self.on("refused", lambda e: on_refused(e.args["line"]))

    def set_several(self, several: bool) -> None:
        """Take all files that are opened at once, or the first alone."""
        if self._props["several"] != several:
            self._props["several"] = several
            self.update()


class PartsTable(Element, component="static/parts.js"):
    """The parts of a nest in rows; told are `on_change` (row, key, text), `on_remove` and `on_look` (row), from 0."""

    def __init__(
        self,
        words: dict[str, str],
        on_change: Callable[[int, str, str], Any],
        on_remove: Callable[[int], Any],
        on_look: Callable[[int], Any],
    ) -> None:
        super().__init__()
        self._props.update(words=words, rows=[], rotations="", version=0)
        self.on("change", lambda e: on_change(e.args["index"], e.args["key"], e.args["value"]))
        self.on("remove", lambda e: on_remove(e.args["index"]))
        self.on("look", lambda e: on_look(e.args["index"]))

    def show(self, rows: list[dict[str, Any]], rotations: str) -> None:
        """Show rows with ``id``, ``name``, ``quantity``, ``rotations`` and ``shown``, and the angles of the others."""
        self._props.update(rows=rows, rotations=rotations)
        self.update()

    def renew(self) -> None:
        """Put what was refused back to what it was."""
        self._props["version"] += 1
        self.update()


def box(tag: str = "div", classes: str = "", **attributes: str) -> Element:
    """Return an element that holds others; ``_`` in the name of an attribute stands for ``-``."""
    made = Element(tag)
    return _with(made, classes, attributes)


def text(tag: str, words: str, classes: str = "", **attributes: str) -> TextElement:
    """Return an element that holds a text, which is never taken as HTML."""
    made = TextElement(tag=tag, text=words)
    _with(made, classes, attributes)
    return made


def button(words: str, act: Callable[..., Any] | None = None, classes: str = "", **attributes: str) -> TextElement:
    """Return a button; `act` takes nothing, or the event."""
    made = text("button", words, f"button {classes}", type="button", **attributes)
    if act is not None:
        made.on("click", act)
    return made


def link(words: str, address: str, classes: str = "", **attributes: str) -> TextElement:
    """Return a link."""
    return text("a", words, classes, href=address, **attributes)


def _with(made: Element, classes: str, attributes: dict[str, str]) -> Element:
    if classes:
        made.classes(classes)
    for name, value in attributes.items():
        made._props[name.rstrip("_").replace("_", "-")] = value
    return made


def table(head: list[tuple[str, str]], rows: list[list[str]], label: str) -> Element:
    """Return a table; `head` are (words, classes of the column)."""
    with box("div", "scroll") as around, box("table", aria_label=label):
        with box("thead"), box("tr"):
            for words, classes in head:
                text("th" if words else "td", words, classes, **({"scope": "col"} if words else {}))
        with box("tbody"):
            for row in rows:
                with box("tr"):
                    for number, (cell, (_, classes)) in enumerate(zip(row, head, strict=True)):
                        text("td" if number else "th", cell, classes, **({} if number else {"scope": "row"}))
    return around


class Editor(Element, component="static/editor.js"):
    """A text under a name; `on_save` is told (name, text), `on_draft` the text as it is when it is left."""

    def __init__(
        self,
        name: str,
        words_in: str,
        words: dict[str, str],
        on_save: Callable[[str, str], Any] | None,
        on_draft: Callable[[str], Any],
        label: str,
    ) -> None:
        super().__init__()
        self._props.update(name=name, text=words_in, words=words, own=on_save is not None, label=label)
        if on_save is not None:
            self.on("save", lambda e: on_save(e.args["name"], e.args["text"]))
            self.on("draft", lambda e: on_draft(e.args["text"]))
