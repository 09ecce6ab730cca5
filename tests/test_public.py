"""Every class that the library takes or returns has a public name."""

from __future__ import annotations

import dataclasses
import inspect
import pkgutil
import typing
from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import pytest

import leafcut
from leafcut.processes import registry


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


def test_no_public_name_is_hidden_by_a_package() -> None:
    packages = {module.name for module in pkgutil.iter_modules(leafcut.__path__)}
    assert packages.isdisjoint(set(leafcut.__all__) - {"__version__"})
    assert all(getattr(leafcut, name) is not None for name in leafcut.__all__)


def test_an_unknown_name_is_an_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'optimise'"):
        leafcut.optimise  # noqa: B018
    assert set(dir(leafcut)) == set(leafcut.__all__)
