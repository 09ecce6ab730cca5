"""Conditions for the use of an option, with their error messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

#: Text of an option's flag.
_Flag = Callable[[str], str]


@dataclass(frozen=True)
class Condition:
    """A condition for the use of an option.

    One of the options `names` must have a value in `values`, or be on or given if `values` is empty. Without names, the
    format of the input must be in `values`. If `wanted` is False, the opposite must be true.
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
