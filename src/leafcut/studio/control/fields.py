"""Form fields of the machine panel. They keep their values when the panel is redrawn."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui.element import Element

from leafcut.errors import OptionError
from leafcut.studio.page.elements import Form
from leafcut.studio.page.forms import plain_field, plain_group
from leafcut.studio.wording import Words


class MachineForm(Form):
    """A form that remembers the values of its fields. An empty field stands for the default.

    Text fields report every keystroke, because the user may press the jog pad while a field still has the focus.
    """

    def __init__(self, words: Words) -> None:
        super().__init__(words, self._store_value)
        self._values: dict[str, Any] = {}
        self._fields: dict[str, dict[str, Any]] = {}
        self._hidden: set[str] = set()
        #: Called when the user changes a field.
        self.on_change: Callable[[], Any] = lambda: None
        self.props.update(live=True, prefix="machine")

    def add_field(self, name: str, label: str, value: str = "", kind: str = "text", **given: Any) -> None:
        """Add a field (see `plain_field`). If the field already exists, replace it but keep its value."""
        self._fields[name] = plain_field(name, label, kind, **given)
        self._values.setdefault(name, value)
        self.draw()

    def hide_only(self, *names: str) -> None:
        """Hide the named fields and show all other fields."""
        if set(names) != self._hidden:
            self._hidden = set(names)
            self.draw()

    def draw(self) -> None:
        """Show the fields and their values."""
        fields = (field for name, field in self._fields.items() if name not in self._hidden)
        self.show(self._values, groups=[plain_group(*fields)])

    def _store_value(self, name: str, value: Any, _: str) -> Any:
        self._values[name] = value
        self.props["values"] = dict(self._values)
        return self.on_change()

    def set_value(self, name: str, value: str) -> None:
        """Set the value of a field."""
        self._values[name] = value
        self.draw()

    def is_on(self, name: str) -> bool:
        """Return whether a flag is on."""
        return self._values[name] is True

    def text(self, name: str) -> str:
        """Return the text of a field, or the default if the field is empty."""
        return str(self._values[name]).strip() or str(self._fields[name]["default"])

    def number(self, name: str) -> float:
        """Return the number in a field.

        A decimal comma is allowed. Raises `OptionError` if the text is not a number.
        """
        text = self.text(name)
        try:
            return float(text.replace(",", "."))
        except ValueError:
            raise OptionError("{}: '{}' is not a number", self._fields[name]["label"], text) from None

    def whole_number(self, name: str) -> int | None:
        """Return the whole number in a field, or None if the field is empty.

        Raises `OptionError` if the text is not a whole number.
        """
        text = self.text(name)
        if text and (not text.isdecimal() or len(text) > 9):
            raise OptionError("{}: '{}' is not a whole number", self._fields[name]["label"], text)
        return int(text) if text else None


class JogPad(Element, component="../static/jog.js"):
    """Buttons and keys that jog a machine.

    `on_jog` receives the axis, the sign, and whether the user is holding a key down.
    """

    def __init__(
        self, label: str, hint: str, on_jog: Callable[[str, int, bool], Any], on_release: Callable[[], Any]
    ) -> None:
        super().__init__()
        self.props.update(label=label, hint=hint, off=True)
        self.on("jog", lambda e: on_jog(str(e.args["axis"]), int(e.args["sign"]), bool(e.args["held"])))
        self.on("release", on_release)

    def set_enabled(self, enabled: bool) -> None:
        """Enable or disable the buttons and keys."""
        if self.props["off"] == enabled:
            self.props["off"] = not enabled
            self.update()


def set_button_enabled(element: Element, enabled: bool) -> None:
    """Enable or disable a button."""
    disabled = element.props.get("disabled") is not None
    if disabled == enabled:
        if enabled:
            element.props.pop("disabled", None)
        else:
            element.props["disabled"] = ""
        element.update()
