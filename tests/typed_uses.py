"""Calls that a type checker must accept or refuse. mypy reads this file (`make check`); nothing runs it.

An unused ``type: ignore`` is an error, so each marks a call that mypy must refuse.
"""

from __future__ import annotations

from pathlib import Path
from typing import assert_type

import leafcut
from leafcut.model.difference import Difference
from leafcut.model.measure import Measure
from leafcut.model.solution import Solution

assert_type(leafcut.simulate("a.nc").measure, Measure)
assert_type(leafcut.verify("a", "b").differences[0], Difference)
assert_type(leafcut.solve("a.tsp").solution, Solution)
assert_type(leafcut.optimize("a.nc").issues[0], leafcut.Issue)
leafcut.nonsense  # type: ignore[attr-defined]  # noqa: B018

leafcut.optimize("a.dxf", thickness="0.25in", machine="haas-vf2", seed=7, preset="fast", strict=True)
leafcut.optimize("a.dxf", thickness=6, origin=(0.0, 5.0), layers=["A", "B"], tools=Path("tools.toml"), peck=None)
leafcut.drill("a.dxf", "a.nc", peck="2mm", report="a.html")
leafcut.cut("a.dxf", cut_speed=1500, options_file=Path("a.toml"))
leafcut.pocket("a.png", tool_diameter=3)
leafcut.reorder("a.nc", process="laser", allow_reverse=True)
leafcut.stock("a.nc", workpiece="0,0,-5,10,10,0")
leafcut.tool_speeds("a.dxf", material="c45", objective="time")
leafcut.nest(["a.dxf:2"], sheet="3000x1500", kerf=1.5, gap="5mm")
leafcut.solve("a.tsp", algorithm="mmas", iterations=3)
leafcut.simulate("a.nc", machine="grbl-3018", units="in", dialect="grbl")
leafcut.verify("a.nc", "b.nc", allow_reverse=True)

leafcut.optimize("a.dxf", thicknes=6)  # type: ignore[call-arg]
leafcut.optimize("a.dxf", seed="seven")  # type: ignore[arg-type]
leafcut.optimize("a.dxf", preset="quick")  # type: ignore[arg-type]
leafcut.drill("a.dxf", pierce_cost=1)  # type: ignore[call-arg]
leafcut.cut("a.dxf", peck=1)  # type: ignore[call-arg]
leafcut.pocket("a.dxf", pierce_cost=1)  # type: ignore[call-arg]
leafcut.reorder("a.nc", peck=1)  # type: ignore[call-arg]
leafcut.nest(["a.dxf"], peck=1)  # type: ignore[call-arg]
leafcut.simulate("a.nc", thickness=[6])  # type: ignore[arg-type]
