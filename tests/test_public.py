"""The public names: all that the library takes and returns can be named by who uses it, and stands in the reference."""

from __future__ import annotations

import dataclasses
import inspect
import re
import subprocess
import sys
import types
import typing
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut.processes import registry

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "library.md").read_text(encoding="utf-8")


def functions() -> dict[str, Callable[..., Any]]:
    """Return the public functions by their names."""
    return {name: one for name in leafcut.__all__ if inspect.isfunction(one := getattr(leafcut, name))}


def own_classes(hint: Any) -> Iterator[type]:
    """Yield the classes of leafcut that an annotation names."""
    if isinstance(hint, list):
        for one in hint:
            yield from own_classes(one)
    elif typing.get_origin(hint) is not None:
        yield from own_classes(typing.get_origin(hint))
        yield from own_classes(list(typing.get_args(hint)))
    elif isinstance(hint, type) and hint.__module__.split(".")[0] == "leafcut":
        yield hint


def hints(thing: Any) -> list[Any]:
    """Return the annotations of a function, or of the fields of a dataclass."""
    if not inspect.isfunction(thing) and not dataclasses.is_dataclass(thing):
        return []
    found = typing.get_type_hints(thing)
    names = found if inspect.isfunction(thing) else [field.name for field in dataclasses.fields(thing)]
    return [found[name] for name in names]


def details() -> set[type]:
    """Return what the processes find out, each for itself: the classes that say which report tells of them."""
    packages = [place.rpartition(".")[0] for place in registry.BUILT_IN.values()]
    models = [import_module(f"{one}.model") for one in packages if find_spec(f"{one}.model")]
    return {one for model in models for one in vars(model).values() if isinstance(one, type) and hasattr(one, "report")}


def handled() -> set[type]:
    """Return the classes of all that public functions take and return, and of all that their fields hold."""
    found = details()
    waiting: list[Any] = [*functions().values(), *found]
    while waiting:
        for one in {c for hint in hints(waiting.pop()) for c in own_classes(hint)} - found:
            found.add(one)
            waiting.append(one)
    return found


def test_the_functions_are_there() -> None:
    assert set(functions()) == {
        "cut_stock", "cutting_data", "nest", "optimize", "read_part", "simulate", "solve_file", "solve_part",
        "verify_programs",
    }  # fmt: skip


def test_every_class_that_is_taken_or_returned_has_a_public_name() -> None:
    classes = handled()
    assert len(classes) > 50
    assert {c.__name__ for c in details()} == {"DrillingDetail", "SheetDetail", "PocketDetail", "ProgramDetail"}
    assert {c.__name__ for c in classes} >= {"Outcome", "Certificate", "SheetDetail", "Issue", "Snapshot", "Source"}
    assert [c for c in classes if getattr(leafcut, c.__name__, None) is not c] == []


def test_every_public_name_stands_in_the_reference() -> None:
    """Each by its home, where its docstring is; what is no class and no function by a title of its own."""
    members = re.search(r"members: \[(.*)\]", PAGE)
    assert members
    shown = set(re.findall(r"^::: (\S+)$", PAGE, flags=re.MULTILINE))
    shown |= {f"leafcut.errors.{name}" for name in members[1].split(", ")}
    missing = []
    for name in set(leafcut.__all__) - {"__version__"}:
        thing = getattr(leafcut, name)
        if isinstance(thing, type | types.FunctionType):
            if f"{thing.__module__}.{thing.__qualname__}" not in shown and name != "ReadOptions":
                missing.append(name)
        elif f"`{name}`" not in PAGE:
            missing.append(name)
    assert missing == []
    assert "::: leafcut.options.ReadOptions" in PAGE


def test_a_name_that_is_none_is_an_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'optimise'"):
        leafcut.optimise  # noqa: B018
    assert set(dir(leafcut)) == set(leafcut.__all__)


def test_a_type_checker_knows_the_public_names(tmp_path: Path, mypy_cache: Path) -> None:
    """Each of them, what the functions return, and that there are no others."""
    file = tmp_path / "uses.py"
    lines = ["import leafcut", *(f"leafcut.{name}" for name in leafcut.__all__), "leafcut.nonsense", "a: int"]
    lines += ['a = leafcut.simulate("a.nc").measure', 'a = leafcut.verify_programs("a", "b").differences[0]']
    lines += ['a = leafcut.solve_file("a.tsp").solution', 'a = leafcut.optimize("a.nc").issues[0]']
    file.write_text("\n".join(lines) + "\n")
    words = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(mypy_cache), str(file)]
    said = subprocess.run(words, capture_output=True, text=True, check=False, cwd=tmp_path).stdout
    wrong = re.findall(r"error: (.*?)  \[", said)
    assert wrong[0] == 'Module has no attribute "nonsense"'
    types_ = [re.search(r'expression has type "(\w+)"', line) for line in wrong[1:]]
    assert [found and found[1] for found in types_] == ["Measure", "Difference", "Solution", "Issue"]
