"""Elements of the page: plain tags with text, the options form, the file opener, tables, and editors."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any

from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement
from nicegui.events import GenericEventArguments

from leafcut.message import Message, messages_from_json
from leafcut.studio.wording import Words

#: Maximum time to wait for an answer from the browser, s.
_PATIENCE = 20.0
#: Texts that a form needs.
_ROW_HANDLER = """(event) => {
  const form = event.currentTarget, at = event.type === "pointerover" ? event.target : document.activeElement;
  const row = (form.contains(at) && at.closest("[data-group]")?.dataset.group) || "";
  if (form.dataset.row === row || (event.type === "focusout" && form.matches(":hover"))) return;
  form.dataset.row = row;
  emit(row);
}"""
_FORM_TEXTS = ("choose", "remove", "help", "open", "find", "none_found", "found")


def _handle_and_confirm(element: Element, event: GenericEventArguments, act: Callable[..., Any], *names: str) -> Any:
    """Call the handler of a changed field, then confirm the change.

    Until then, the browser shows the text that was typed.
    """
    element.props["answered"] = event.args["number"]
    result = act(*(event.args[name] for name in names))
    element.update()
    return result


class Form(Element, component="../static/form.js"):
    """Groups of fields with labels.

    Parameters
    ----------
    on_change
        Called with the name, the value and the displayed file name of a changed field.
    on_refused
        Called with the error message if a selected file was refused.
    searchable
        Whether the form has a field that searches the names and help texts of the options.
    fixed
        Whether the form is read-only.
    """

    def __init__(
        self,
        words: Words,
        on_change: Callable[[str, Any, str], Any],
        groups: Sequence[dict[str, Any]] = (),
        on_refused: Callable[[str], Any] = lambda _: None,
        *,
        searchable: bool = False,
        fixed: bool = False,
    ) -> None:
        super().__init__()
        texts = {name: words(f"form.{name}") for name in _FORM_TEXTS}
        self.props.update(groups=list(groups), words=texts, values={}, shown={}, errors={}, searchable=searchable)
        self.props.update(fixed=fixed, answered=0)
        self.on("change", lambda e: _handle_and_confirm(self, e, on_change, "name", "value", "shown"))
        self.on("refused", lambda e: on_refused(_upload_error(e.args)))

    def on_row(self, act: Callable[[str], Any]) -> None:
        """Call `act` with the key of the group that has the focus or the pointer, or with "" if there is none."""
        for event in ("focusin", "focusout", "pointerover", "pointerleave"):
            self.on(event, lambda e: act(str(e.args)), js_handler=_ROW_HANDLER)

    def show(
        self,
        values: dict[str, Any],
        shown: dict[str, str] | None = None,
        errors: dict[str, str] | None = None,
        groups: list[dict[str, Any]] | None = None,
    ) -> None:
        """Show values, displayed file names and errors. If `groups` is given, it replaces the fields."""
        self.props.update(values=dict(values), shown=dict(shown or {}), errors=dict(errors or {}))
        if groups is not None:
            self.props["groups"] = groups
        self.update()

    def set_errors(self, errors: dict[str, str]) -> None:
        """Show the errors of the fields by name."""
        self.props["errors"] = errors
        self.update()


def _upload_error(answer: dict[str, Any]) -> str:
    """Return the error of a refused upload. It is a `Message` if the server has sent a template and values."""
    message = messages_from_json(json.dumps(answer.get("parts")))
    return message if isinstance(message, Message) else str(answer["line"])


class Opener(Element, component="../static/opener.js"):
    """Lets users open files in a dialog or drop them on the page."""

    def __init__(
        self,
        words: dict[str, str],
        largest: int,
        on_opened: Callable[[dict[str, Any]], Any],
        on_refused: Callable[[str], Any],
    ) -> None:
        super().__init__()
        self.props.update(words=words, largest=largest, several=False)
        self.on("opened", lambda e: on_opened(e.args))
        self.on("refused", lambda e: on_refused(_upload_error(e.args)))

    def allow_several(self, several: bool) -> None:
        """Set whether the user may open several files at once. If not, only the first file is accepted."""
        if self.props["several"] != several:
            self.props["several"] = several
            self.update()


class PartsTable(Element, component="../static/parts.js"):
    """A table with a row for each part of a nest.

    Parameters
    ----------
    on_change
        Called with the row id, the key and the new text.
    on_remove, on_look
        Called with the row id.
    """

    def __init__(
        self,
        words: dict[str, str],
        on_change: Callable[[str, str, str], Any],
        on_remove: Callable[[str], Any],
        on_look: Callable[[str], Any],
    ) -> None:
        super().__init__()
        self.props.update(words=words, rows=[], rotations="", answered=0)
        self.on("change", lambda e: _handle_and_confirm(self, e, on_change, "id", "key", "value"))
        self.on("remove", lambda e: on_remove(e.args["id"]))
        self.on("look", lambda e: on_look(e.args["id"]))

    def show(self, rows: list[dict[str, Any]], rotations: str) -> None:
        """Show rows with ``id``, ``name``, ``quantity``, ``rotations`` and ``shown``, and the default angles."""
        self.props.update(rows=rows, rotations=rotations)
        self.update()


def box(tag: str = "div", classes: str = "", **attributes: str) -> Element:
    """Create a container element. A ``_`` in the name of an attribute becomes ``-``."""
    element = Element(tag)
    return _add_attributes(element, classes, attributes)


def text(tag: str, words: str, classes: str = "", **attributes: str) -> TextElement:
    """Create an element with text, which is never interpreted as HTML."""
    element = TextElement(tag=tag, text=words)
    _add_attributes(element, classes, attributes)
    return element


def button(words: str, act: Callable[..., Any] | None = None, classes: str = "", **attributes: str) -> TextElement:
    """Create a button. `act` takes either no argument or the event."""
    element = text("button", words, f"button {classes}", type="button", **attributes)
    if act is not None:
        element.on("click", act)
    return element


def link(words: str, address: str, classes: str = "", **attributes: str) -> TextElement:
    """Create a link."""
    return text("a", words, classes, href=address, **attributes)


def _add_attributes(element: Element, classes: str, attributes: dict[str, str]) -> Element:
    if classes:
        element.classes(classes)
    for name, value in attributes.items():
        element.props[name.rstrip("_").replace("_", "-")] = value
    return element


def table(head: list[tuple[str, str]], rows: list[list[str]], label: str) -> Element:
    """Create a table. `head` contains the text and the CSS classes of each column."""
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


class Editor(Element, component="../static/editor.js"):
    """An editor for a TOML file (CodeMirror).

    `on_draft` receives the text shortly after each change. If `on_draft` is None, the editor is read-only.
    """

    def __init__(self, content: str, on_draft: Callable[[str], Any] | None, label: str) -> None:
        super().__init__()
        self.props.update(text=content, own=on_draft is not None, label=label, line=0, problem="")
        if on_draft is not None:
            self.on("draft", lambda e: on_draft(e.args["text"]))

    def show(self, content: str, line: int, problem: str) -> None:
        """Show a text, and mark the line that contains an error. Line 0 means that no error is marked."""
        self.props.update(text=content, line=line, problem=problem)
        self.update()


class BrowserState(Element, component="../static/browser_state.js"):
    """The part of a page's state that the browser stores: the steps of its history, with the choices of each step.

    When the user goes back or forward, `on_went` is called with the query of the address (key → text), the choices of
    the step, and whether the browser had recorded all steps. If a step was missing, the browser records it after the
    call.
    """

    def __init__(self, on_went: Callable[[dict[str, Any], str, bool], Any]) -> None:
        super().__init__()
        self._number = 0
        self.props["steps"] = []
        self.on("went", lambda e: on_went(e.args["address"], str(e.args["choices"]), e.args["done"] == self._number))
        self.on("took", lambda e: self._forget(e.args))

    def add_step(self, step: str, address: str, choices: str) -> None:
        """Add an address and its choices to the history. `step` is ``pushState`` or ``replaceState``."""
        self._number += 1
        steps = self.props["steps"]
        if step == "replaceState" and steps and steps[-1][1] == step:
            steps = steps[:-1]
        self.props["steps"] = [*steps, [self._number, step, address, choices]]
        self.update()

    def _forget(self, number: int) -> None:
        self.props["steps"] = [step for step in self.props["steps"] if step[0] > number]

    async def read_choices(self) -> str:
        """Return the choices of the current step, or an empty string."""
        return await self._call_browser("read")

    async def read_last_choices(self) -> str:
        """Return the choices of the page that was closed last, or an empty string."""
        return await self._call_browser("readLast")

    async def _call_browser(self, method: str) -> str:
        """Return the browser's answer, or an empty string if the page was closed before the browser answered."""
        try:
            return str(await self.run_method(method, timeout=_PATIENCE) or "")
        except TimeoutError:
            return ""
