"""Create a machine profile from a few questions.

This is for controllers that do not export their settings, such as Haas and Centroid. Each question suggests the value
of a known machine with the same controller, and unanswered questions become estimates. When the user completes an
imported profile, the dialogue only asks about missing or estimated values.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, OptionError, name_suggestion, printable
from leafcut.files.schemas import MACHINE_ANSWERS
from leafcut.files.whole_files import key_line_number, parse_toml, read_toml_text
from leafcut.gcode.dialects import dialect_names
from leafcut.model.kinds import Head
from leafcut.read.controllers.importing import ImportedMachine, profile_text, values_of_profile
from leafcut.read.controllers.values import FASTEST, HARDEST, LONGEST, Value, ValueOrigin, Values, format_axes
from leafcut.read.machine import load_profile_values, machine_from_profile_text
from leafcut.read.machine_keys import PROFILE_KEYS, UNKNOWN
from leafcut.units import add_default_unit, parse_quantity

#: Maps a controller to the machine that supplies the suggested values.
_SIMILAR_MACHINES = {
    "haas": "haas-vf2", "fanuc": "haas-vf2", "grbl": "grbl-3018", "linuxcnc": "linuxcnc-mill", "mach3": "mach3-router",
    "mach4": "mach4-router", "fagor8055": "fagor-8055", "qtplasmac": "plasma-table", "plasma": "plasma-table",
    "uccnc": "uccnc-router", "edingcnc": "edingcnc-router", "masso": "masso-router", "centroid": "centroid-mill",
    "marlin": "marlin-mpcnc", "rrf": "duet-router",
    "siemens": "siemens-828d", "siemens-iso": "siemens-828d", "heidenhain": "heidenhain-tnc",
    "fanuc-laser": "laser-table", "grbl-laser": "grbl-laser-20w", "flame": "flame-table", "waterjet": "water-table",
}  # fmt: skip
_DEFAULT_MACHINE = "linuxcnc-mill"
#: Function that asks the user a question. It takes the question and a suggestion ("" for none), and returns the typed
#: answer.
Ask = Callable[[str, str], str]
#: If a travel limit is above this value, mm, the travel counts up from machine zero. Overtravel is only a few
#: centimetres.
_UPWARDS = 50.0
#: The dialogue ends after this number of wrong answers to the same question.
_MOST_TRIES = 5


@dataclass(frozen=True)
class Question:
    """A question about a machine.

    Attributes
    ----------
    keys
        The profile keys that the answer sets.
    unit
        Unit of the answer: a key of `units.FACTORS`, or "" for an answer without a unit.
    required
        Whether a run without dialogue needs the answer, because there is no plausible default.
    """

    name: str
    keys: tuple[str, ...]
    text: str
    unit: str = ""
    required: bool = False


QUESTIONS: tuple[Question, ...] = (
    Question("name", ("name",), "name of the machine", required=True),
    Question(
        "controller", ("controller",), "its controller, such as haas, centroid, fanuc, linuxcnc, grbl", required=True
    ),
    Question("process", ("process",), f"kind of tool: {', '.join(Head)}"),
    Question("units", ("units",), "units of a program that does not state them: mm or in"),
    Question(
        "rapid",
        ("rapid.velocity",),
        "speed of rapids, one or x,y,z: 25 m/min or 1000 ipm (its data sheet)",
        "mm/s",
        True,
    ),
    Question("acceleration", ("rapid.acceleration",), "acceleration, one or x,y,z: 0.25 g or 500 mm/s2", "mm/s²"),
    Question("travel", ("travel.min", "travel.max"), "travel of x,y,z: 762 mm, 406 mm, 508 mm, or unknown", "mm"),
    Question("max-feed", ("max_feed",), "highest feed rate", "mm/s"),
    Question("spindle-speed", ("spindle.max_speed",), "highest spindle speed", "rpm"),
    Question("tool-changer", ("tool_change.automatic",), "whether the machine changes tools itself: yes or no"),
    Question("tool-change-time", ("tool_change.time",), "time of one tool change", "s"),
)
_BY_NAME = {question.name: question for question in QUESTIONS}


def load_answers(file: Path) -> tuple[dict[str, Any], dict[str, str]]:
    """Read answers from a TOML file.

    Returns
    -------
    dict
        Answers by name.
    dict
        File and line of each answer by name.

    Raises
    ------
    OptionError
        The file does not exist.
    DataError
        The file cannot be read, or is not TOML.
    """
    text = read_toml_text(file)
    given = parse_toml(text, str(file), MACHINE_ANSWERS)
    places = {}
    for name in given:
        line = key_line_number(text, "", name)
        places[name] = f"{file}:{line}" if line else str(file)
    return given, places


def machine_from_answers(
    given: Mapping[str, Any],
    ask: Ask | None = None,
    base: str | None = None,
    places: Mapping[str, str] | None = None,
) -> ImportedMachine:
    """Create a machine from answers.

    Parameters
    ----------
    given
        Answers by the names in `QUESTIONS`, as strings or bools.
    ask
        Function that asks the user for a missing answer. If None, suggestions replace missing answers.
    base
        Name or path of a profile to complete. The dialogue only asks for values that this profile lacks or estimates.

    Raises
    ------
    OptionError
        An answer is unknown, wrong or missing, or the base cannot be read.
    DataError
        An answer in a file is wrong; the message includes the line number.
    """
    places = places or {}
    for name in given:
        if name not in _BY_NAME:
            problem = OptionError(f"unknown answer '{printable(name, 40)}'{name_suggestion(name[:80], _BY_NAME)}")
            raise _error_with_place(problem, places.get(name))
    answers = _Answers(dict(given), ask, base)
    if ask is None:
        missing = [
            f"--{question.name}" for question in QUESTIONS if question.required and not answers.is_answered(question)
        ]
        if missing:
            raise OptionError(f"machine new needs {' and '.join(missing)} because it cannot ask (no terminal)")
    for question in QUESTIONS:
        try:
            answers.obtain_answer(question)
        except OptionError as problem:
            raise _error_with_place(problem, places.get(question.name)) from None
    return answers.build_machine()


def _error_with_place(problem: OptionError, place: str | None) -> OptionError:
    return problem if place is None else DataError(f"{place}: {problem}")


class _Answers:
    def __init__(self, given: dict[str, Any], ask: Ask | None, base: str | None) -> None:
        self.given, self.ask = given, ask
        known = values_of_profile(load_profile_values(base)) if base is not None else ()
        self.values = Values("machine new", "", {value.key: value for value in known})
        self.suggestions: dict[str, Any] = {}
        self.similar_machine = ""

    def is_answered(self, question: Question) -> bool:
        """Return whether the user answered a question, or the base profile has a value for it, even an estimate."""
        return question.name in self.given or self._has_value(question)

    def _is_known_without_estimate(self, question: Question) -> bool:
        stated = [self.values.entries.get(key) for key in question.keys]
        return all(value is not None and value.how is not ValueOrigin.ASSUMED for value in stated)

    def _has_value(self, question: Question) -> bool:
        return all(key in self.values.entries for key in question.keys)

    def obtain_answer(self, question: Question) -> None:
        if question.name in self.given:
            value = self.given[question.name]
            typed = value if isinstance(value, str) else {True: "yes", False: "no"}.get(value) or str(value)
            self._store_answer(question, typed, "answered")
        elif not self._is_known_without_estimate(question):
            self._ask_user(question)
        if question.name == "controller":
            self._load_suggestions()

    def _ask_user(self, question: Question) -> None:
        suggested, origin = self._suggested_answer(question)
        for _ in range(_MOST_TRIES if self.ask else 0):
            typed = self.ask(question.text, suggested).strip() if self.ask else ""
            if not typed and suggested:
                break
            try:
                self._store_answer(question, typed, "answered")
                return
            except OptionError as problem:
                # The next question starts with the error message.
                question = Question(question.name, question.keys, f"{problem}; {question.text}", question.unit)
        else:
            if self.ask:
                raise OptionError(f"--{question.name}: {_MOST_TRIES} wrong answers; nothing was written")
        if suggested and not self._has_value(question):  # keep an estimate of the base
            self._store_answer(question, suggested, origin, assumed=True)

    def _suggested_answer(self, question: Question) -> tuple[str, str]:
        known = [self.values.entries.get(key) for key in question.keys]
        if question.name == "travel":
            return "as it is" if self._has_value(question) else UNKNOWN, "not known"
        if known[0] is not None:
            return _answer_text(known[0].value), known[0].source
        if question.name == "max-feed":
            rapid = self.values.entries.get("rapid.velocity")
            if rapid is not None:
                rapids = [rapid.value] if isinstance(rapid.value, str) else rapid.value[:2]
                slower = min(rapids, key=lambda rapid_text: parse_quantity(rapid_text, "mm/s"))
                return slower, "the slower rapid of x and y"
        table, _, key = question.keys[0].rpartition(".")
        value = (self.suggestions.get(table, {}) if table else self.suggestions).get(key)
        if value is None:
            default = next(profile_key for profile_key in PROFILE_KEYS if profile_key.name == question.keys[0])
            return _answer_text(default.default), default.why
        source = str(self.suggestions.get("sources", {}).get(question.keys[0], "")).removeprefix("estimate: ")
        return _answer_text(value), f"as {self.similar_machine}" + (f": {source}" if source else "")

    def _load_suggestions(self) -> None:
        """Load the suggestions from a machine with the same controller.

        If no such machine is known, use a default machine without motion values.
        """
        controller = self.values.entries["controller"].value
        self.similar_machine = _SIMILAR_MACHINES.get(controller, _DEFAULT_MACHINE)
        self.suggestions = {
            key: value
            for key, value in load_profile_values(self.similar_machine).items()
            if key not in ("name", "description")
        }
        for key in (
            ()
            if controller not in _SIMILAR_MACHINES
            else ("rapid.style", "corners.style", "corners.deviation", "acceleration_factor", "spindle.start_time")
        ):
            table, _, inner = key.rpartition(".")
            value = (self.suggestions.get(table, {}) if table else self.suggestions).get(inner)
            if value is not None and key not in self.values.entries:
                source = str(self.suggestions.get("sources", {}).get(key, "")).removeprefix("estimate: ")
                self.values.assume(key, value, f"as {self.similar_machine}: {source}")

    def _store_answer(self, question: Question, typed: str, why: str, assumed: bool = False) -> None:
        try:
            entries = _TAKERS.get(question.name, _parse_text_answer)(question, typed)
            entries = self._travel_limits(entries) if question.name == "travel" else entries
        except OptionError as problem:
            raise OptionError(f"--{question.name}: {problem}") from None
        for key, value in entries.items():
            self.values.entries[key] = Value(key, value, ValueOrigin.ASSUMED if assumed else ValueOrigin.TAKEN, why)
        if not entries:
            for key in question.keys:
                self.values.entries.pop(key, None)

    def _travel_limits(self, entries: dict[str, Any]) -> dict[str, Any]:
        """Convert the given lengths to travel limits.

        The limits count up or down from 0, in the same direction as on the machine that supplies the suggestions.
        """
        lengths = entries.get("travel.max")
        if lengths is None:
            return {}
        suggested = self.suggestions.get("travel", {}).get("max", ["0 mm"] * 3)
        counts_up = [
            parse_quantity(suggested if isinstance(suggested, str) else suggested[axis], "mm") > _UPWARDS
            for axis in range(3)
        ]
        directions = list(zip(counts_up, lengths, strict=True))
        return {
            "travel.min": format_axes([0.0 if rises else -length for rises, length in directions], "mm"),
            "travel.max": format_axes([length if rises else 0.0 for rises, length in directions], "mm"),
        }

    def build_machine(self) -> ImportedMachine:
        entries = self.values.entries
        if "description" not in entries:
            self.values.derive("description", f"{entries['name'].value} ({entries['controller'].value})", "answered")
        sorted_values = tuple(entries[key.name] for key in PROFILE_KEYS if key.name in entries)
        text = profile_text(sorted_values, "Machine profile by answers (leafcut machine new).")
        machine = machine_from_profile_text(text, "machine new")
        return ImportedMachine("new", "answers", machine, sorted_values, tuple(self.values.notes), text)


def _answer_text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else "" if value is None else str(value)


def _parse_text_answer(question: Question, typed: str) -> dict[str, Any]:
    if not typed.strip() or not typed.isprintable():
        raise OptionError(f"'{printable(typed, 30)}' is not an answer")
    text = typed.strip()
    if question.unit:
        value = parse_quantity(text, question.unit)
        if not (value > 0 or (question.unit == "s" and value == 0)):
            raise OptionError(f"{printable(text, 30)} is not above 0")
        return {question.keys[0]: add_default_unit(text, question.unit)}
    return {question.keys[0]: text}


def _choice_parser(known: Sequence[str]) -> Callable[[Question, str], dict[str, Any]]:
    def parse(question: Question, typed: str) -> dict[str, Any]:
        word = typed.strip().lower()
        if word not in known:
            raise OptionError(f"'{printable(typed, 30)}' is unknown{name_suggestion(word[:80], known)}")
        return {question.keys[0]: word}

    return parse


def _parse_controller_answer(question: Question, typed: str) -> dict[str, Any]:
    return _choice_parser(dialect_names())(question, typed)


def _parse_axes_answer(question: Question, typed: str) -> dict[str, Any]:
    parts = [part.strip() for part in typed.split(",")]
    if len(parts) not in (1, 3):
        raise OptionError(f"'{printable(typed, 40)}' is {len(parts)} values, but must be one, or x,y,z")
    written = [add_default_unit(part, question.unit) for part in parts]
    numbers = [parse_quantity(part, question.unit) for part in written]
    if not all(number > 0 for number in numbers):
        raise OptionError(f"{printable(typed, 40)}: must be above 0")
    limit = HARDEST if question.unit == "mm/s²" else FASTEST
    if max(numbers) > limit:
        raise OptionError(f"{printable(typed, 40)}: no machine has more than {limit:g} {question.unit}")
    return {question.keys[0]: written[0] if len(written) == 1 else written}


def _parse_lengths_answer(question: Question, typed: str) -> dict[str, Any]:
    """Parse the lengths of the axes x, y and z, in mm."""
    if typed.strip().lower() == UNKNOWN:
        return {}
    parts = [part.strip() for part in typed.split(",")]
    if len(parts) != 3:
        raise OptionError(f"'{printable(typed, 40)}' must be lengths of x,y,z, or {UNKNOWN}")
    lengths = [parse_quantity(part, question.unit) for part in parts]
    if not all(0 < length <= LONGEST for length in lengths):
        raise OptionError(f"{printable(typed, 40)}: lengths must be above 0 and at most {LONGEST / 1000:g} m")
    return {"travel.max": lengths}


def _parse_yes_no_answer(question: Question, typed: str) -> dict[str, Any]:
    word = typed.strip().lower()
    if word not in ("yes", "y", "no", "n"):
        raise OptionError(f"'{printable(typed, 30)}' is not yes or no")
    return {question.keys[0]: word.startswith("y")}


_TAKERS: dict[str, Callable[[Question, str], dict[str, Any]]] = {
    "controller": _parse_controller_answer,
    "process": _choice_parser(tuple(Head)),
    "units": _choice_parser(("mm", "in")),
    "rapid": _parse_axes_answer,
    "acceleration": _parse_axes_answer,
    "travel": _parse_lengths_answer,
    "tool-changer": _parse_yes_no_answer,
}
