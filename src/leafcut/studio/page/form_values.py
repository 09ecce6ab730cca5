"""The values of the options form, and who has set each value."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

from leafcut.processes.settings import all_options, group_of
from leafcut.studio.page.own_defaults import OwnDefaults


class Setter(StrEnum):
    """Who has set a value. An option without an entry has the default of leafcut."""

    PERSON = "person"
    #: The user has set this value for an earlier input.
    EARLIER = "earlier"
    #: The open input has set this value. The value is removed together with the input.
    INPUT = "input"
    #: The file with the user's own defaults contains this value.
    FILE = "file"
    #: The studio has set this value while the user studies an algorithm from the literature.
    STUDY = "study"


@dataclass(frozen=True)
class FormValue:
    """A value, as the user has typed it. An empty value resets the option to the default of leafcut.

    Attributes
    ----------
    shown
        Displayed name of the selected file.
    place
        File and line, if the value is one of the user's own defaults.
    """

    value: Any = ""
    setter: Setter = Setter.PERSON
    shown: str = ""
    place: str = ""


class FormValues(dict[str, FormValue]):
    """The entries of a form. Each option has a value and a setter."""

    def set_value(self, name: str, value: Any, shown: str = "", setter: Setter = Setter.PERSON) -> None:
        """Set a value. A value that equals the default of leafcut resets the option."""
        reset = value in (None, "", group_of(name).defaults()[name])
        self[name] = FormValue(setter=setter) if reset else FormValue(value, setter, shown)

    @property
    def values_only(self) -> dict[str, Any]:
        """The options that have a value, with their values."""
        return {name: entry.value for name, entry in self.items() if entry.value != ""}

    @property
    def file_names(self) -> dict[str, str]:
        """The displayed names of the files that options refer to."""
        return {name: entry.shown for name, entry in self.items() if entry.shown}

    @property
    def default_places(self) -> dict[str, str]:
        """The file and line of each value that comes from the user's own defaults."""
        return {name: entry.place for name, entry in self.items() if entry.setter is Setter.FILE}

    def names_set_by(self, *setters: Setter) -> set[str]:
        """Return the options that were set by any of the given setters."""
        return {name for name, entry in self.items() if entry.setter in setters and entry.value != ""}

    def apply_defaults(self, defaults: OwnDefaults) -> None:
        """Apply the user's own defaults, except to options that another setter has set."""
        for name in [name for name, entry in self.items() if entry.setter is Setter.FILE]:
            del self[name]
        for name, value in defaults.values.items():
            if name not in self and value != group_of(name).defaults()[name]:
                self[name] = FormValue(value, Setter.FILE, defaults.shown.get(name, ""), defaults.places[name])

    def remove_input_values(self) -> None:
        """Remove all values that apply only to the open input."""
        for name in [name for name, entry in self.items() if entry.setter is Setter.INPUT]:
            del self[name]

    def reset_for_new_input(self) -> None:
        """Reset the options that describe a file. All other values are marked as values from an earlier input."""
        of_file = {name for _, name, spec in all_options() if spec.of_file}
        for name, entry in list(self.items()):
            if name in of_file:
                del self[name]
            elif entry.setter is Setter.PERSON and entry.value != "":
                self[name] = replace(entry, setter=Setter.EARLIER)

    def apply_job_options(self, options: Mapping[str, Any], shown: Mapping[str, str], of_input: Iterable[str]) -> None:
        """Apply the options of a job.

        All other options are reset, so that the user's own defaults do not affect them.
        """
        self.clear()
        self.update({name: FormValue() for _, name, _ in all_options()})
        for name in options.keys() & self.keys():
            setter = Setter.INPUT if name in of_input else Setter.PERSON
            self[name] = FormValue(options[name], setter, shown.get(name, ""))

    def as_plain(self) -> dict[str, list[Any]]:
        """Convert the entries to plain values."""
        return {name: [entry.value, entry.setter, entry.shown, entry.place] for name, entry in self.items()}

    @classmethod
    def from_plain(cls, plain: Any) -> FormValues:
        """Convert the result of `as_plain` back to form values. Invalid entries are ignored."""
        options, table = {name for _, name, _ in all_options()}, cls()
        for name, entry in plain.items() if isinstance(plain, dict) else ():
            match entry:
                case [str() | bool() | int() | float() as value, str() as setter, str() as shown, str() as place] if (
                    name in options and setter in set(Setter)
                ):
                    table[name] = FormValue(value, Setter(setter), shown, place)
        return table
