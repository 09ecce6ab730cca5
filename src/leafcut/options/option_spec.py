"""Definition of an option (kind, unit, bounds, help, conditions for its use), and conversion of its values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar

from leafcut.errors import OptionError, name_suggestion, printable
from leafcut.files.plugins import entry_names
from leafcut.message import Message
from leafcut.units import BARE_UNIT, FACTORS, parse_point, parse_quantity, replace_decimal_comma

#: Text of an option's flag.
_Flag = Callable[[str], str]


@dataclass(frozen=True)
class Condition:
    """A condition for the use of an option.

    At least one of the options `names` must have a value in `values`; if `values` is empty, it must be on or given. If
    `names` is empty, the format of the input must be in `values`. If `wanted` is False, the opposite is required.
    """

    names: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    wanted: bool = True

    def holds(self, value_of: Callable[[str], Any], input_format: str) -> bool:
        """Return whether the options and the format of the input meet the condition."""
        values = [value_of(name) for name in self.names] if self.names else [input_format]
        return self.wanted == any(value in self.values if self.values else bool(value) for value in values)

    def refusal(self, option: str, flag: _Flag) -> str:
        """Return the reason why an option is not used, and the remedy: "only used with --keep-out; add
        --keep-out …".
        """
        value_text, own = " or ".join(", ".join(self.values).rsplit(", ", 1)), flag(option)
        if not self.names:
            return (
                f"{'only' if self.wanted else 'not'} used for a {value_text.replace('step', 'STEP file')}; leave it out"
            )
        *flags, last = map(flag, self.names)
        if flags:
            return f"only used with {', '.join(flags)} or {last}; add one of them or leave out {own}"
        if self.values:
            return (
                f"only used {'with' if self.wanted else 'without'} {last} {value_text}; set {last} or leave out {own}"
            )
        if self.wanted:
            return f"only used with {last}; add {last} or leave out {own}"
        return f"not used with {last}; leave out {last} or {own}"


#: Conditions of an option, all of which must be met.
Conditions = tuple[Condition, ...]


def when_given(*names: str) -> Condition:
    """Return the condition that at least one of the options is given or on."""
    return Condition(names)


def when_absent(name: str) -> Condition:
    """Return the condition that an option is neither given nor on."""
    return Condition((name,), wanted=False)


def when_one_of(name: str, *values: str) -> Condition:
    """Return the condition that an option has any of the values."""
    return Condition((name,), values)


def when_input_is(*formats: str) -> Condition:
    """Return the condition that the input has any of the formats."""
    return Condition((), formats)


def when_input_is_not(*formats: str) -> Condition:
    """Return the condition that the input has another format."""
    return Condition((), formats, wanted=False)


@dataclass(frozen=True)
class OptionSpec:
    """Definition of an option, apart from its name and default.

    `kind` is one of ``quantity`` (a float in `unit`), ``number``, ``share`` (0.6 or 60%), ``whole``, ``flag``,
    ``text``, ``names`` (a comma-separated list), ``point`` (two or three lengths), ``place`` (a name of `PLACES` or two
    lengths), ``percent`` and ``path``.
    """

    help: str
    kind: str
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    #: Words that are accepted instead of a number.
    words: tuple[str, ...] = ()
    #: Entry point group through which installed packages add choices.
    group_of_plugins: str = ""
    #: Description of the default, if the value None stands for something else, such as a recommendation.
    default_words: str = ""
    #: Extension that marks a text as the path of a file; headers of programs contain only the file name.
    may_be_path: str | tuple[str, ...] = ""
    #: False for options that cannot change the program, such as the number of threads; they are left out of the header.
    changes_program: bool = True
    #: Conditions for the use of the option.
    needs: Conditions = ()
    #: Example of a point with three numbers: ``-400,-200,-300``. Without an example, a point has two or three numbers
    #: or is "free".
    example: str = ""
    #: Whether the value belongs to one input file and is reset for the next. Other values belong to the shop.
    of_file: bool = False

    def names_file(self, value: object) -> bool:
        """Return whether a value is the path of a file."""
        ending = self.may_be_path
        return self.kind == "path" or bool(ending and isinstance(value, str) and value.lower().endswith(ending))

    @property
    def names_input(self) -> bool:
        """Whether the option names an input file. Output files do not count, because they do not change the program."""
        return self.kind == "path" and self.changes_program

    @property
    def is_output(self) -> bool:
        """Whether the option names an output file."""
        return self.kind == "path" and not self.changes_program

    @property
    def all_choices(self) -> tuple[str, ...]:
        """The choices, including choices of installed packages; empty if any text is allowed."""
        return tuple(dict.fromkeys((*self.choices, *entry_names(self.group_of_plugins))))


#: Name → position in a box, as fractions of its width and height, 0 to 1.
PLACES = {
    "lower-left": (0.0, 0.0),
    "lower-right": (1.0, 0.0),
    "upper-left": (0.0, 1.0),
    "upper-right": (1.0, 1.0),
    "centre": (0.5, 0.5),
}

#: Upper limit for coordinates of machines, mm.
_FARTHEST = 1e6


def option(kind: str, default: Any, help: str, **spec: Any) -> Any:
    """Return the field of an option dataclass with its default and its `OptionSpec`."""
    return field(default=default, metadata={"option": OptionSpec(help=help, kind=kind, **spec)})


class OptionGroup:
    """Base class of the option dataclasses, which converts and checks every field."""

    #: Name of the table of these options in a TOML file, and heading of the group.
    section: ClassVar[str] = ""
    title: ClassVar[str] = ""
    #: Whether every option of the group belongs to one file (`OptionSpec.of_file`).
    of_file: ClassVar[bool] = False

    def __post_init__(self) -> None:
        for name, spec in self.specs().items():
            object.__setattr__(self, name, convert_value(name, spec, getattr(self, name)))

    @classmethod
    def specs(cls) -> Mapping[str, OptionSpec]:
        """Return the specification of every field, by field name."""
        return _specs(cls)  # type: ignore[arg-type]  # the class, which has a hash

    @classmethod
    def defaults(cls) -> dict[str, Any]:
        """Return the default of every field, by field name."""
        return {f.name: f.default for f in fields(cls)}  # type: ignore[arg-type]

    @classmethod
    def as_typed(cls, values: Mapping[str, Any]) -> dict[str, Any]:
        """Return values with plain numbers as text, so that ``feed = 300`` is in mm/min like ``--feed 300``."""
        specs = cls.specs()
        return {
            name: repr(float(value)) if specs[name].kind == "quantity" and _is_float(value) else value
            for name, value in values.items()
        }

    @classmethod
    def check(cls, name: str, value: Any) -> None:
        """Raise OptionError if a value is invalid for an option, regardless of the other options."""
        convert_value(name, cls.specs()[name], cls.as_typed({name: value})[name])

    def changed(self) -> dict[str, Any]:
        """Return the options that differ from their defaults, in internal units."""
        return {
            name: getattr(self, name) for name, default in self.defaults().items() if getattr(self, name) != default
        }


@cache
def _specs(group: type) -> Mapping[str, OptionSpec]:
    specs = {f.name: f.metadata["option"] for f in fields(group)}
    if getattr(group, "of_file", False):
        specs = {name: replace(spec, of_file=True) for name, spec in specs.items()}
    return MappingProxyType(specs)


def _is_float(value: Any) -> bool:
    """Return whether a value is a number in the range of a float."""
    return isinstance(value, int | float) and not isinstance(value, bool) and not _is_too_long(value)


def _is_too_long(value: Any) -> bool:
    """Return whether a value is an integer of more than 64 bits, which no option needs and messages cannot print."""
    return isinstance(value, int) and not -(2**63) <= value < 2**63


def convert_value(name: str, spec: OptionSpec, value: Any) -> Any:
    """Return a typed value in internal units; None stays None. Raises OptionError if the value is invalid."""
    if value is None:
        return None
    flag = flag_name(name)
    if isinstance(value, str) and value.strip() in spec.words:
        return value.strip()
    if _is_too_long(value):
        raise OptionError("{}: the number is out of range (more than 64 bits)", flag)
    try:
        result = _CONVERTERS[spec.kind](spec, value)
    except (OptionError, TypeError, ValueError, OverflowError) as problem:
        kind = _KIND_WORDS[spec.kind]
        if spec.words:
            kind = Message("{} or one of {}", kind, ", ".join(spec.words))
        detail = str(problem) if isinstance(problem, OptionError) else Message("'{}' is not {}", value, kind)
        raise OptionError("{}: {}", flag, detail) from None
    if spec.choices:
        items = result if isinstance(result, tuple) else (result,)
        for word in items:
            if word not in spec.choices and word not in spec.all_choices:
                raise OptionError("{}: unknown value '{}'{}", flag, word, name_suggestion(str(word), spec.all_choices))
    _check_bounds(flag, spec, result)
    return result


def _check_bounds(flag: str, spec: OptionSpec, value: Any) -> None:
    if isinstance(value, str | tuple | bool | Path):
        return
    if spec.minimum is not None and value < spec.minimum:
        advice = (
            Message("; write it without the minus sign, {}", _bound_text(spec, -value))
            if -value > spec.minimum >= 0
            else ""
        )
        raise OptionError(
            "{}: {} is below the minimum of {}{}",
            flag,
            _bound_text(spec, value),
            _bound_text(spec, spec.minimum),
            advice,
        )
    if spec.maximum is not None and value > spec.maximum:
        raise OptionError(
            "{}: {} is above the maximum of {}", flag, _bound_text(spec, value), _bound_text(spec, spec.maximum)
        )


def _bound_text(spec: OptionSpec, value: float) -> str:
    """Return a number in the unit in which users type it, because they do not type radians or mm/s."""
    if not spec.unit:
        return str(value) if isinstance(value, int) else f"{value:g}"
    unit = BARE_UNIT[spec.unit]
    return f"{value / FACTORS[spec.unit][unit]:g} {unit}"


def _to_integer(_: OptionSpec, value: Any) -> int:
    if isinstance(value, bool) or float(value) != int(value):
        raise ValueError(value)
    return int(value)


def _to_number(_: OptionSpec, value: Any) -> float:
    if isinstance(value, bool):
        raise ValueError(value)
    return (
        parse_quantity(value, "rad")
        if not isinstance(value, str)
        else _require_finite(float(replace_decimal_comma(value)))
    )


def _to_fraction(spec: OptionSpec, value: Any) -> float:
    """Return a fraction. A text may also be a percentage: 60% is 0.6."""
    if isinstance(value, str) and value.strip().endswith("%"):
        return _to_number(spec, value.strip().removesuffix("%")) / 100.0
    return _to_number(spec, value)


def _require_finite(value: float) -> float:
    if value - value != 0.0:
        raise OptionError("'{}' is not a finite number", value)
    return value


def _to_bool(_: OptionSpec, value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(value)
    return value


def split_names(value: Any) -> tuple[str, ...]:
    """Return the names of a comma-separated list or of any other list."""
    words = value.split(",") if isinstance(value, str) else value
    return tuple(str(word).strip() for word in words if str(word).strip())


def _parse_coordinates(value: Any) -> tuple[float, ...]:
    numbers = parse_point(value)
    is_far = next((number for number in numbers if abs(number) > _FARTHEST), None)
    if is_far is not None:
        raise OptionError("{:g} mm is out of range for any machine", is_far)
    return numbers


def _to_point(spec: OptionSpec, value: Any) -> tuple[float, ...] | None:
    if value == "free" and not spec.example:
        return None
    expected = (
        Message("x,y,z, such as '{}'", spec.example)
        if spec.example
        else Message("a point such as '10,20' or '10,20,5'")
    )
    if isinstance(value, str) and "," not in value:
        raise OptionError("'{}' is not {}", printable(value), expected)
    numbers = _parse_coordinates(value)
    if len(numbers) not in ((3,) if spec.example else (2, 3)):
        raise OptionError("'{}' is not {}", value, expected)
    return numbers


def _to_side_or_point(_: OptionSpec, value: Any) -> str | tuple[float, ...]:
    if isinstance(value, str) and "," not in value:
        name = value.strip().lower().replace("center", "centre")
        if name not in PLACES:
            raise OptionError(
                "unknown position '{}'{}; or give a point such as '10,20'", value, name_suggestion(name, PLACES)
            )
        return name
    numbers = _parse_coordinates(value)
    if len(numbers) != 2:
        raise OptionError("'{}' is not a point such as '10,20'", value)
    return numbers


def _to_text(_: OptionSpec, value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(value)
    return value


_CONVERTERS: dict[str, Any] = {
    "quantity": lambda spec, value: parse_quantity(value, spec.unit),
    "number": _to_number,
    "share": _to_fraction,
    "whole": _to_integer,
    "flag": _to_bool,
    "text": _to_text,
    "names": lambda _, value: split_names(value),
    "point": _to_point,
    "place": _to_side_or_point,
    "percent": lambda spec, value: _to_number(spec, value.removesuffix("%") if isinstance(value, str) else value),
    "path": lambda _, value: Path(value),
}
_KIND_WORDS = {
    "quantity": Message("a number with a unit"),
    "number": Message("a number"),
    "share": Message("a fraction such as 0.6 or 60%"),
    "whole": Message("a whole number"),
    "flag": Message("true or false"),
    "text": Message("a string"),
    "names": Message("a list of names"),
    "point": Message("a point"),
    "place": Message("a position such as lower-left, or a point"),
    "percent": Message("a percentage"),
    "path": Message("a path"),
}


def typed_text(spec: OptionSpec, value: Any) -> str:
    """Return the value of an option as a user would type it, with its shop unit."""
    if value is None:
        return "free"
    if spec.kind == "flag":
        return ""
    if spec.kind == "quantity" and not isinstance(value, str):
        unit = BARE_UNIT[spec.unit]
        return f"{value / FACTORS[spec.unit][unit]:.6g}{unit}"
    if spec.kind == "percent":
        return f"{value:g}%"
    if spec.kind in ("names", "point", "place") and not isinstance(value, str):
        return ",".join(f"{v:.6g}" if isinstance(v, float) else v for v in value)
    if spec.names_file(value):
        return Path(value).name
    return f"{value:g}" if isinstance(value, float) else str(value)


def flag_name(name: str) -> str:
    """Return the command-line flag of a field: ``n_ants`` → ``--n-ants``."""
    return "--" + name.replace("_", "-")
