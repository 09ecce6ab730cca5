"""Outcomes made by hand: the report is tested without readers, planners and solvers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

from leafcut.model.machine import Machine
from leafcut.model.measure import Measure
from leafcut.model.outcome import OperationOutcome, Outcome
from leafcut.model.part import Hole, Part, Slot
from leafcut.model.solution import Solution, WorkerFigures
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import DrillCycle, Toolpath, ToolpathBuilder
from leafcut.processes.drilling.model import DrillingDetail

MACHINE = Machine(
    name="test-mill",
    description="a mill of no particular make",
    controller="fanuc",
    rapid_velocity=(400.0, 400.0, 400.0),
    acceleration=(1500.0, 1500.0, 1500.0),
    max_feed=100.0,
    travel_min=(0.0, 0.0, -300.0),
    travel_max=(700.0, 400.0, 0.0),
)
CYCLE = DrillCycle("G81", r_plane=2.0, bottom=-6.0)


def lay(part: Part, operations: Sequence[OperationOutcome], drawn: bool) -> Toolpath:
    """Lay the work in the operations' order, or in the drawing's when `drawn`."""
    path = ToolpathBuilder()
    path.rapid(z=10.0)
    path.rapid(x=0.0, y=0.0)
    for operation in operations:
        path.tool(operation.tool.number)
        for i in sorted(operation.hole_order) if drawn else operation.hole_order:
            if operation.slots:
                slot = part.slots[i]
                path.rapid(*slot.start)
                path.feed(z=-2.0, feed=3.0)
                path.feed(*slot.end, feed=5.0)
                path.rapid(z=10.0)
            else:
                path.drill(part.holes[i].x, part.holes[i].y, CYCLE, feed=3.0)
        path.rapid(z=10.0)
    path.end()
    return path.build()


def solved(n: int, **changes: object) -> Solution:
    """Return a solution of n nodes that was found in three steps by two workers."""
    solution = Solution(
        nodes=np.arange(n, dtype=np.int32),
        cost=42.0,
        unit="s",
        algorithm="mmas",
        seed=7,
        iterations=50,
        seconds=2.0,
        history=((0.01, 60.0), (0.1, 50.0), (1.0, 42.0)),
        workers=(WorkerFigures(0, 1200, 1.9, 42.0), WorkerFigures(1, 1100, 1.8, 43.5)),
        lower_bound=40.0,
    )
    return replace(solution, **changes)  # type: ignore[arg-type]


@pytest.fixture
def outcome_of() -> Callable[..., Outcome]:
    """Return a maker of outcomes: points per tool (its diameter is 2 mm times its number), slots, and any field."""

    def make(
        *points: Sequence[tuple[float, float]],
        slots: Sequence[Slot] = (),
        solution: dict[str, object] | None = None,
        part: dict[str, object] | None = None,
        **changes: object,
    ) -> Outcome:
        holes: list[Hole] = []
        operations = []
        for number, group in enumerate(points, start=1):
            order = tuple(range(len(holes), len(holes) + len(group)))[::-1]
            holes += [Hole(x, y, 2.0 * number, "DRILL", f"{i:X}") for i, (x, y) in enumerate(group)]
            tool = Tool(number, 2.0 * number, feed=3.0, spindle_rpm=1500.0, assumed=number == 1)
            operations.append(OperationOutcome(tool, "G81", order, False, solved(len(group), **(solution or {}))))
        if slots:
            tool = Tool(len(points) + 1, slots[0].width, ToolKind.SLOT_MILL, feed=5.0, spindle_rpm=3000.0)
            still = solved(len(slots), history=(), workers=(), lower_bound=None, algorithm="nn", cost=8.0)
            operations.append(OperationOutcome(tool, "slot", tuple(range(len(slots))), True, still))
        drawn = replace(Part("plate.dxf", tuple(holes), tuple(slots), source="plate.dxf", format="dxf"), **(part or {}))
        outcome = Outcome(
            part=drawn,
            machine=MACHINE,
            process="drill",
            operations=tuple(operations),
            before=Measure(9000.0, 560.0, 100.0, {"rapid": 60.0, "feed": 30.0, "tool_change": 10.0}),
            nearest=Measure(4000.0, 560.0, 70.0, {"rapid": 30.0, "feed": 30.0, "tool_change": 10.0}),
            after=Measure(3000.0, 560.0, 58.0, {"rapid": 18.0, "feed": 30.0, "tool_change": 10.0}),
            path_before=lay(drawn, operations, drawn=True),
            path_after=lay(drawn, operations, drawn=False),
            text="%\nO0001\nG21 G90\nM30\n%\n",
            dialect="fanuc",
            seed=7,
            verified=True,
            detail=DrillingDetail(),
            output="plate.nc",
            report="plate.html",
            options={"--thickness": "6.35mm"},
            version="1.2.3",
            seconds=1.25,
        )
        return replace(outcome, **changes)  # type: ignore[arg-type]

    return make


@pytest.fixture
def empty_outcome(outcome_of: Callable[..., Outcome]) -> Outcome:
    """Return the outcome of a drawing without holes."""
    nothing = Measure(0.0, 0.0, 0.0)
    return outcome_of(before=nothing, nearest=nothing, after=nothing, text="", output="", report="", options={})


@pytest.fixture
def every_outcome(outcome_of: Callable[..., Outcome], empty_outcome: Outcome) -> dict[str, Outcome]:
    """Return outcomes of all shapes, by name."""
    random = np.random.default_rng(3)
    many = [tuple(p) for p in random.uniform(0, 300, (200, 2)).tolist()]
    return {
        "empty": empty_outcome,
        "one hole": outcome_of([(10.0, 20.0)], solution={"history": (), "workers": (), "lower_bound": None}),
        "one point without size": outcome_of([(5.0, 5.0)], part={"holes": (Hole(5.0, 5.0, 0.0),)}),
        "ten holes": outcome_of([(10.0 * i, 7.0 * (i % 3)) for i in range(10)]),
        "many holes": outcome_of(many),
        "a long row": outcome_of([(20.0 * i, 0.0) for i in range(30)]),
        "several tools": outcome_of([(1.0, 2.0), (30.0, 4.0)], [(15.0, 20.0)], [(40.0, 40.0), (1.0, 40.0)]),
        "only slots": outcome_of(slots=[Slot((0.0, 0.0), (20.0, 10.0), 3.0)]),
        "holes and slots": outcome_of([(5.0, 30.0)], slots=[Slot((0, 0), (20, 10), 3.0), Slot((9, 1), (9, 1), 3.0)]),
        "distance as objective": outcome_of(many[:20], solution={"unit": "mm", "cost": 12345.0}),
        "slower than drawn": outcome_of(many[:5], after=Measure(1.0, 1.0, 120.0)),
    }
