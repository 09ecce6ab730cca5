"""Every noun can be saved as JSON and loaded again, and is then the same."""

from __future__ import annotations

import dataclasses
import json
import math
from enum import Enum
from typing import Any

import numpy as np
import pytest

import leafcut
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, Severity
from leafcut.model.json_values import from_json, to_json
from leafcut.model.machine import Machine
from leafcut.model.outcome import Outcome
from leafcut.model.part import Grouping, Hole, Part, Slot
from leafcut.model.problem import Metric, RoutingProblem
from leafcut.model.solution import Solution, WorkerFigures
from leafcut.model.tool import Recipe, Tool, ToolKind, ToolLibrary
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.processes.drilling.model import DrillingDetail
from leafcut.read.machine import load_machine, machine_names


def assert_same(a: Any, b: Any) -> None:
    """Compare field by field, by type and value: arrays with their dtype and shape, NaN equal to NaN.

    A message is saved as its English text.
    """
    assert type(a) is (str if isinstance(b, Message) else type(b))
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    elif dataclasses.is_dataclass(a):
        for f in dataclasses.fields(a):
            assert_same(getattr(a, f.name), getattr(b, f.name))
    elif isinstance(a, tuple) and not isinstance(a, Enum):
        assert len(a) == len(b)
        for one, other in zip(a, b, strict=True):
            assert_same(one, other)
    elif isinstance(a, float) and math.isnan(a):
        assert math.isnan(b)
    else:
        assert a == b


def path() -> Toolpath:
    builder = ToolpathBuilder()
    builder.machine(z=0.0)
    builder.tool(3)
    builder.rapid(0.0, 1.0)
    builder.rapid(z=5.0)
    builder.drill(1.0, 2.0, DrillCycle("G83", 2.0, -5.0, True, 1.5), feed=1.25)
    builder.arc(True, (3.0, 2.0, 5.0), Arc((2.0, 2.0, 5.0), 17, 2), feed=2.0)
    builder.end()
    return builder.build()


NOUNS = [
    Part("empty"),
    Part(
        "all of it",
        (Hole(1.5, -2.25, 3.0, "0", "A1"), Hole(0.1, 1 / 3, 0.0)),
        (Slot((0.0, 0.5), (3.0, 0.5), 1.0, "ROUTE"),),
        (Issue("L301", "two", "plate.dxf:3", Severity.NOTE),),
        "plate.dxf",
        "dxf",
        "in",
        "EXPLICIT",
        np.array([[0.0, 2.0], [2.0, 0.0]]),
        4.0,
        (Contour(Polyline.circle(1.0, 2.0, 3.0), "mark", "SCRIBE", "B2", 4),),
        Grouping(np.array([0, 1], dtype=np.int32), np.array([[1, 0]], dtype=np.int32), 1),
    ),
    Tool(7, 6.0, ToolKind.TAP, "M6 – ½", math.pi, 8.0, 500.0, "G84", None, 0.2, 1.0, 20.0),
    ToolLibrary((Tool(1, 5.0), Tool(2, 6.0)), (Recipe(6.0, (1, 2), "TAP*"),), "shop.toml"),
    RoutingProblem.of_points([[0, 0], [1, 2.5]], Metric("linear", (1.0, 2.0), (3.0, 4.0)), start=(0.0, 1.0), name="p"),
    RoutingProblem.of_points([[0, 0], [1, 2]], Metric("EXPLICIT", matrix=np.array([[0.0, np.inf], [3.0, 0.0]]))),
    Solution(
        np.array([1, 0], dtype=np.int32), 1.5, "s", "mmas", 7, 3, 0.25, ((0.1, 2.0), (0.2, 1.5)),
        (WorkerFigures(0, 5, 0.2, 1.5), WorkerFigures(1, 0, 0.0, math.inf)), 1.25, True,
    ),
    path(),
]  # fmt: skip


@pytest.mark.parametrize("noun", NOUNS, ids=lambda noun: type(noun).__name__)
def test_a_noun_saved_and_loaded_is_the_same(noun: Any) -> None:
    assert_same(from_json(type(noun), to_json(noun)), noun)


@pytest.mark.parametrize("name", machine_names())
def test_a_machine_saved_and_loaded_is_the_same(name: str) -> None:
    machine = load_machine(name)
    assert from_json(Machine, to_json(machine)) == machine


def test_a_whole_outcome_saved_and_loaded_is_the_same() -> None:
    made = leafcut.optimize("random:30", thickness=2, preset="fast", machine="haas-vf2")
    outcome = Outcome(**{field.name: getattr(made, field.name) for field in dataclasses.fields(Outcome)})
    loaded = from_json(Outcome[DrillingDetail], to_json(outcome))
    assert_same(loaded, outcome)
    assert loaded.saved_percent == outcome.saved_percent


def test_a_library_loaded_finds_its_tools_by_number() -> None:
    assert from_json(ToolLibrary, to_json(NOUNS[3])).by_number[2].diameter == 6.0


def test_what_is_saved_is_json_that_any_program_reads() -> None:
    def refuse(word: str) -> None:
        raise AssertionError(word)

    for noun in NOUNS:
        assert isinstance(json.loads(to_json(noun), parse_constant=refuse), dict)


@pytest.mark.parametrize("text", ["", "[]", "3", '{"nam": 1}', '{"name": "x", "holes": [{"x": 1}]}'])
def test_what_is_no_such_noun_is_refused(text: str) -> None:
    with pytest.raises((ValueError, TypeError, KeyError)):
        from_json(Part, text)
