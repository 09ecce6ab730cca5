"""Calls that a type checker must accept or refuse. mypy reads this file (`make check`); nothing runs it.

An unused ``type: ignore`` is an error, so each marks a call that mypy must refuse.
"""

from __future__ import annotations

from pathlib import Path
from typing import assert_type

import leafcut

assert_type(leafcut.simulate("a.nc").measure, leafcut.Measure)
assert_type(leafcut.verify_programs("a", "b").differences[0], leafcut.Difference)
assert_type(leafcut.solve_file("a.tsp").solution, leafcut.Solution)
assert_type(leafcut.optimize("a.nc").issues[0], leafcut.Issue)
leafcut.nonsense  # type: ignore[attr-defined]  # noqa: B018

leafcut.optimize("a.dxf", thickness="0.25in", machine="haas-vf2", seed=7, preset="fast", strict=True)
leafcut.optimize("a.dxf", thickness=6, origin=(0.0, 5.0), layers=["A", "B"], tools=Path("tools.toml"), peck=None)
leafcut.nest(["a.dxf:2"], sheet="3000x1500", kerf=1.5, gap="5mm")
leafcut.solve_file("a.tsp", algorithm="mmas", iterations=3)
leafcut.simulate("a.nc", machine="grbl-3018", units="in", dialect="grbl")
leafcut.verify_programs("a.nc", "b.nc", allow_reverse=True)

leafcut.optimize("a.dxf", thicknes=6)  # type: ignore[call-arg]
leafcut.optimize("a.dxf", seed="seven")  # type: ignore[arg-type]
leafcut.optimize("a.dxf", preset="quick")  # type: ignore[arg-type]
leafcut.nest(["a.dxf"], peck=1)  # type: ignore[call-arg]
leafcut.simulate("a.nc", thickness=[6])  # type: ignore[arg-type]
