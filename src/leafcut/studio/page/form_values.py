"""The values of the options form and the setter of each value."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from leafcut.processes.settings import all_options, group_of
from leafcut.studio.page.own_defaults import OwnDefaults


class Setter(StrEnum):
    """Who has set a value. An option without an entry has leafcut's default."""

    PERSON = "person"
    #: The user, for an earlier input.
    EARLIER = "earlier"
    #: The open input; the value is removed with it.
    INPUT = "input"
    #: The file of the user's own defaults.
    FILE = "file"
    #: The studio, while an algorithm of the literature is studied.
    STUDY = "study"


@dataclass(frozen=True)
class FormValue:
    """A value as typed. An empty value means that the option was reset to leafcut's default.

    Attributes
    ----------
    shown
        Displayed name of a chosen file.
    place
        File and line, if the value is one of the user's own defaults.
    """

    value: Any = ""
    setter: Setter = Setter.PERSON
    shown: str = ""
    place: str = ""


class FormValues(dict[str, FormValue]):
    """The entries of a form: option → value and setter."""

    def put(self, name: str, value: Any, shown: str = "", setter: Setter = Setter.PERSON) -> None:
        """Set a value. Setting leafcut's default resets the option."""
        reset = value in (None, "", group_of(name).defaults()[name])
        self[name] = FormValue(setter=setter) if reset else FormValue(value, setter, shown)

    @property
    def values_only(self) -> dict[str, Any]:
        """The values that are set: option → value."""
        return {name: entry.value for name, entry in self.items() if entry.value != ""}

    @property
    def shown(self) -> dict[str, str]:
        """Displayed names of chosen files: option → name."""
        return {name: entry.shown for name, entry in self.items() if entry.shown}

    @property
    def places(self) -> dict[str, str]:
        """Values from the user's own defaults: option → file and line."""
        return {name: entry.place for name, entry in self.items() if entry.setter is Setter.FILE}

    def set_by(self, *setters: Setter) -> set[str]:
        """Return the options whose values were set by one of the given setters."""
        return {name for name, entry in self.items() if entry.setter in setters and entry.value != ""}

    def follow_defaults(self, defaults: OwnDefaults) -> None:
        """Take the values of the user's own defaults, except for options that another setter has set."""
        for name in [name for name, entry in self.items() if entry.setter is Setter.FILE]:
            del self[name]
        for name, value in defaults.values.items():
            if name not in self and value != group_of(name).defaults()[name]:
                self[name] = FormValue(value, Setter.FILE, defaults.shown.get(name, ""), defaults.places[name])

    def leave_input(self) -> None:
        """Remove the values that apply only to the open input."""
        for name in [name for name, entry in self.items() if entry.setter is Setter.INPUT]:
            del self[name]

    def start_fresh(self) -> None:
        """Reset the options that describe a file, and mark the other values as those of an earlier input."""
        of_file = {name for _, name, spec in all_options() if spec.of_file}
        for name, entry in list(self.items()):
            if name in of_file:
                del self[name]
            elif entry.setter is Setter.PERSON and entry.value != "":
                self[name] = replace(entry, setter=Setter.EARLIER)

    def take_job(self, options: Mapping[str, Any], shown: Mapping[str, str], of_input: Iterable[str]) -> None:
        """Take the options of a job. Reset all others, so that the user's own defaults do not replace them."""
        self.clear()
        self.update({name: FormValue() for _, name, _ in all_options()})
        for name in options.keys() & self.keys():
            setter = Setter.INPUT if name in of_input else Setter.PERSON
            self[name] = FormValue(options[name], setter, shown.get(name, ""))

    def as_plain(self) -> dict[str, list[Any]]:
        """Return the entries as plain values."""
        return {name: [entry.value, entry.setter, entry.shown, entry.place] for name, entry in self.items()}

    @classmethod
    def of_plain(cls, plain: Any) -> FormValues:
        """Return the form values encoded by `as_plain`. Invalid entries are ignored."""
        options, table = {name for _, name, _ in all_options()}, cls()
        for name, entry in plain.items() if isinstance(plain, dict) else ():
            match entry:
                case [str() | bool() | int() | float() as value, str() as setter, str() as shown, str() as place] if (
                    name in options and setter in set(Setter)
                ):
                    table[name] = FormValue(value, Setter(setter), shown, place)
        return table
