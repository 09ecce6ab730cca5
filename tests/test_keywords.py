"""The options as typed keywords: those that a function uses and no others, each with the values that it takes."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
import typing
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut.errors import OptionError
from leafcut.options import keywords
from leafcut.options.option_spec import OptionSpec
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings, options_used_by

#: Function → the kinds of work that it does.
FUNCTIONS: dict[Callable[..., Any], tuple[str, ...]] = {
    leafcut.optimize: ("drill", "cut", "pocket", "part", "program"),
    leafcut.drill: ("drill",),
    leafcut.cut: ("cut",),
    leafcut.pocket: ("pocket",),
    leafcut.part: ("part",),
    leafcut.reorder: ("program",),
    leafcut.nest: ("nest",),
    leafcut.solve: ("solve",),
    leafcut.simulate: ("simulate",),
    leafcut.stock: ("stock",),
    leafcut.tool_speeds: ("cutting-data",),
    leafcut.verify: ("verify",),
}
#: A value of each type that a keyword may have.
SAMPLES = {"float": 1.0, "int": 1, "bool": True, "Path": Path("a.toml")}


def keywords_of(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the options among the typed keywords of a function: name → type."""
    unpacked = list(inspect.signature(function).parameters.values())[-1].annotation
    found = typing.get_type_hints(vars(keywords)[unpacked.removeprefix("Unpack[").removesuffix("]")])
    return {name: hint for name, hint in found.items() if name not in keywords.RunKeywords.__annotations__}


@pytest.mark.parametrize("function, works", list(FUNCTIONS.items()))
def test_the_keywords_of_a_function_are_the_options_that_its_work_uses(
    function: Callable[..., Any], works: tuple[str, ...]
) -> None:
    names = keywords_of(function).keys()
    assert names == {name for _, name, _ in options_used_by(*map(registry.work, works))}
    assert not names & inspect.signature(function).parameters.keys()


def test_each_option_is_written_once() -> None:
    tree = ast.parse(Path(keywords.__file__).read_text(encoding="utf-8"))
    names = [ast.unparse(line.target) for line in ast.walk(tree) if isinstance(line, ast.AnnAssign)]
    assert len(names) == len(set(names)) > 100


def test_the_keywords_that_are_no_options_are_arguments_of_optimize() -> None:
    assert keywords.RunKeywords.__annotations__.keys() < inspect.signature(leafcut.optimize).parameters.keys()


def test_the_module_of_keywords_is_not_imported_at_run_time() -> None:
    code = "import sys, leafcut.api; print('leafcut.options.keywords' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


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
    types = keywords_of(function)
    for _, name, spec in options_used_by(*map(registry.work, works)):
        for value in values_of(types[name], spec):
            try:
                collect_settings({name: value})
            except OptionError as problem:
                assert re.search("is (below|above) the", str(problem)), problem
