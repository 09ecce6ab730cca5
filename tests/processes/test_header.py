"""The header comments of a program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from leafcut._version import __version__
from leafcut.gcode.dialects import load_dialect
from leafcut.model.measure import Measure
from leafcut.model.part import Part, ProgramZero
from leafcut.model.plan import Candidate, Order
from leafcut.model.tool import Tool, ToolKind
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.options import Settings
from leafcut.order.stop import Deadline
from leafcut.processes.header import header_lines
from leafcut.processes.job import Job
from leafcut.processes.plan import Plan
from leafcut.processes.settings import collect_settings
from leafcut.read.machine import load_machine

#: Settings without options, and a part without features.
DEFAULTS, EMPTY = Settings(), Part("a")


def header_of(
    path: Toolpath, tools: Sequence[Tool] = (), settings: Settings = DEFAULTS, part: Part = EMPTY, **plan: Any
) -> list[str]:
    """Return the header of a program that takes 60 s, 75 s in the order before; without its digest line."""
    job = Job(settings, load_machine("linuxcnc-mill"), Deadline())
    work = Plan(job=job, part=part, dialect=load_dialect("linuxcnc"), work=None, kind="drill", tools=tools, **plan)
    given, best = (Candidate(Order(()), path, Measure(0.0, 0.0, seconds)) for seconds in (75.0, 60.0))
    return header_lines(work, given, best, "drill")[:-1]


def test_the_kind_of_a_tool_is_stated_once() -> None:
    """A library's name may start with the kind, literally or in other words."""
    drill = ToolKind.DRILL
    tools = [
        Tool(1, 6.35, drill, "Drill 1/4 in"), Tool(2, 3.0, drill, "carbide"),
        Tool(3, 2.0, ToolKind.SLOT_MILL, "slot mill 2"), Tool(4, 5.0, drill),
    ]  # fmt: skip
    lines = header_of(ToolpathBuilder().build(), tools)
    assert [line.partition(" mm")[0] for line in lines if line.startswith("T")] == [
        "T1 Drill 1/4 in 6.35",
        "T2 drill carbide 3",
        "T3 slot mill 2 2",
        "T4 drill 5",
    ]


@pytest.mark.parametrize(
    ("units", "size", "x", "y", "z"),
    [
        ("mm", "25.4 mm", "X 0 to 50.8 mm", "Y -12.7 to 0.125 mm", "Z 5 to 5 mm"),
        ("inch", "1.0000 in", "X 0 to 2 in", "Y -0.5 to 0.005 in", "Z 0.197 to 0.197 in"),
    ],
)
def test_the_header_is_complete(units: str, size: str, x: str, y: str, z: str) -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, -12.7, 5.0)
    builder.rapid(50.8, 0.125)
    lines = header_of(
        builder.build(),
        [Tool(3, 25.4, ToolKind.END_MILL, name="Cutter", spindle_rpm=1234.4, assumed=True)],
        collect_settings({"depth": "2 mm", "seed": 7, "output_units": units}),
        Part("plate", source="drawings/plate.dxf"),
        made_for="solid 1",
        box=(0.0, -12.7, 50.8, 0.0),
    )
    options = f"seed 7 --depth 2mm{' --output-units inch' * (units == 'inch')}"
    assert lines == [
        f"leafcut {__version__} drill",
        "source: plate.dxf",
        "part: solid 1",
        "machine: linuxcnc-mill",
        options,
        f"T3 end-mill Cutter {size}, 1234 rpm (assumed)",
        "the part reaches the negative side of the zero in Y",
        x,
        y,
        z,
        "estimated time 1 min 00 s, in the drawing's order 1 min 15 s",
    ]


@pytest.mark.parametrize(("units", "x"), [("mm", "25.4"), ("inch", "1")])
def test_the_header_states_the_zero_in_the_unit_of_the_program(units: str, x: str) -> None:
    builder = ToolpathBuilder()
    builder.rapid(z=-0.0001)
    zero = ProgramZero("a corner", 25.4, 0.0, "z", "top", 0.0)
    settings = collect_settings({"output_units": units})
    lines = header_of(builder.build(), settings=settings, part=Part("a", zero=zero), compared_with="before")
    assert lines[4:6] == [f"zero: a corner, X{x} Y0 of the solid", "Z0: top of the part, Z0 of the solid"]
    assert lines[8:] == [f"Z 0 to 0 {'mm' if units == 'mm' else 'in'}", "estimated time 1 min 00 s, before 1 min 15 s"]
