"""Fields of the machine panel. They report input at once and are never redrawn while the user types."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nicegui.element import Element

from leafcut.errors import OptionError
from leafcut.studio.page.elements import box, text


class _Typed(Element, component="../static/machine_field.js"):
    def __init__(self, name: str, value: str, unit: str, *, numbers: bool, offered: str) -> None:
        super().__init__()
        self.props.update(field=f"machine-{name}", value=value, version=0, unit=unit)
        self.props.update(numbers=numbers, offered=offered, placeholder="")


class Field:
    """A labelled text field. `numbers` shows the numeric keyboard on phones.

    `offered` is the id of a list of suggestions. An empty field shows its default as a placeholder.
    """

    def __init__(
        self, name: str, label: str, value: str = "", unit: str = "", *, numbers: bool = True, offered: str = ""
    ) -> None:
        self.typed, self.usual, self.label = value, "", label
        with box("div", "field machine-field") as self.place:
            text("label", label, for_=f"machine-{name}")
            self.input = _Typed(name, value, unit, numbers=numbers, offered=offered)
        self.input.on("typed", self._take)

    @property
    def value(self) -> str:
        """The typed text, or the default."""
        return self.typed or self.usual

    def _take(self, event: Any) -> None:
        self.typed = str(event.args["value"])

    def put(self, value: str) -> None:
        """Set the text."""
        self.typed = value
        self.input.props.update(value=value, version=self.input.props["version"] + 1)
        self.input.update()

    def suggest(self, value: str) -> None:
        """Set the default for an empty field."""
        self.usual = self.input.props["placeholder"] = value
        self.input.update()

    def number(self) -> float:
        """Return the value as a number; a decimal comma is accepted. Raise `OptionError` if it is not a number."""
        try:
            return float(self.value.replace(",", "."))
        except ValueError:
            raise OptionError("{}: '{}' is not a number", self.label, self.value) from None

    def count(self) -> int | None:
        """Return the value as a whole number, None if empty; raise `OptionError` if it is not a whole number."""
        word = self.value.strip()
        if not word:
            return None
        if not word.isdecimal() or len(word) > 9:
            raise OptionError("{}: '{}' is not a whole number", self.label, word)
        return int(word)


class Menu:
    """A labelled menu. `choices` maps values to texts."""

    def __init__(self, name: str, label: str, choices: Mapping[str, str], value: str) -> None:
        self.value, self._choices = value, dict[str, str]()
        with box("div", "field machine-field") as self.place:
            text("label", label, for_=f"machine-{name}")
            self.select = box("select", "", id=f"machine-{name}")
        self.select.on("change", self._chosen, js_handler="(e) => emit(e.target.value)")
        self.on_change: Any = lambda: None
        self.offer(choices, value)

    def offer(self, choices: Mapping[str, str], value: str) -> None:
        """Replace the choices and the selected value."""
        if (dict(choices), value) == (self._choices, self.value):
            return
        self._choices, self.value = dict(choices), value
        self.select.clear()
        with self.select:
            for name, words in choices.items():
                text("option", words, value=name, **({"selected": ""} if name == value else {}))

    def _chosen(self, event: Any) -> Any:
        if str(event.args) in self._choices:
            self.value = str(event.args)
            return self.on_change()
        return None


class Switch:
    """A labelled on/off switch."""

    def __init__(self, name: str, label: str) -> None:
        self.on = False
        with box("label", "machine-switch") as self.place:
            self.input = box("input", "switch", type="checkbox", id=f"machine-{name}")
            text("span", label)
        self.input.on("change", self._on_switch, js_handler="(e) => emit(e.target.checked)")

    def _on_switch(self, event: Any) -> None:
        self.on = bool(event.args)


class JogPad(Element, component="../static/jog.js"):
    """Buttons and keys that move a machine. `on_jog` receives axis, sign, and whether a key is held down."""

    def __init__(
        self, label: str, hint: str, on_jog: Callable[[str, int, bool], Any], on_release: Callable[[], Any]
    ) -> None:
        super().__init__()
        self.props.update(label=label, hint=hint, off=True)
        self.on("jog", lambda e: on_jog(str(e.args["axis"]), int(e.args["sign"]), bool(e.args["held"])))
        self.on("release", on_release)

    def switch(self, enabled: bool) -> None:
        """Enable or disable the buttons and keys."""
        if self.props["off"] == enabled:
            self.props["off"] = not enabled
            self.update()


def enable(element: Element, enabled: bool) -> None:
    """Enable or disable a button."""
    disabled = element.props.get("disabled") is not None
    if disabled == enabled:
        if enabled:
            element.props.pop("disabled", None)
        else:
            element.props["disabled"] = ""
        element.update()
