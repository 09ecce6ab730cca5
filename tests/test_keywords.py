"""The options as typed keywords: those that a function uses and no others, each with the values that it takes."""

from __future__ import annotations

import inspect
import re
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut.errors import OptionError
from leafcut.options.option_spec import OptionSpec
from leafcut.processes import registry
from leafcut.processes.settings import collect, used_by

#: Function → the kinds of work that it does.
FUNCTIONS: dict[Callable[..., Any], tuple[str, ...]] = {
    leafcut.optimize: ("drill", "cut", "pocket", "program"),
    leafcut.nest: ("nest",),
    leafcut.solve_part: ("solve",),
    leafcut.solve_file: ("solve",),
    leafcut.simulate: ("simulate",),
    leafcut.verify_programs: ("verify",),
}
#: A value of each type that a keyword may have.
SAMPLES = {"float": 1.0, "int": 1, "bool": True, "Path": Path("a.toml")}


def keywords_of(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the typed keywords of a function: name → type."""
    (unpacked,) = typing.get_args(typing.get_type_hints(function)["options"])
    return typing.get_type_hints(unpacked)


@pytest.mark.parametrize("function, works", list(FUNCTIONS.items()))
def test_the_keywords_of_a_function_are_the_options_that_its_work_uses(
    function: Callable[..., Any], works: tuple[str, ...]
) -> None:
    keywords = keywords_of(function)
    assert list(keywords) == [name for _, name, _ in used_by(*map(registry.work, works))]
    assert not keywords.keys() & inspect.signature(function).parameters.keys()


def values_of(hint: Any, spec: OptionSpec) -> Iterator[Any]:
    """Yield a value of each kind that a type allows."""
    for one in typing.get_args(hint):
        if one in spec.choices or one is type(None) or one is None:
            yield None if one is type(None) else one
        elif isinstance(one, type) and one.__name__ in SAMPLES:
            yield SAMPLES[one.__name__]


@pytest.mark.parametrize("function, works", list(FUNCTIONS.items()))
def test_the_options_take_what_the_types_allow(function: Callable[..., Any], works: tuple[str, ...]) -> None:
    """Every choice, None, and a number: one that is refused is out of bounds, and not of a wrong kind."""
    keywords = keywords_of(function)
    for _, name, spec in used_by(*map(registry.work, works)):
        for value in values_of(keywords[name], spec):
            try:
                collect({name: value})
            except OptionError as problem:
                assert re.search("is (below|above) the", str(problem)), problem
