"""Travel moves over a square that is cut free: counted by route, with their lines and places, worked out by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely

from leafcut.model.difference import Difference
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.processes.sheet.proof.sheet import check_detached_parts, detached_part_crossings

#: Corners of the parts: the run that ends in line 10 detaches the first, and the run that ends in line 20 the second.
FIRST, SECOND = shapely.box(10, 10, 30, 30), shapely.box(50, 10, 70, 30)
FLAT = SimpleNamespace(moves_z=False)


def laid(*, crossed: int | None = 0, close: int = 0, **changed: Any) -> Any:
    """Return three runs that end in lines 10, 20 and 30; `changed` are values of the first claim, target or cut."""
    parts = [
        {"marks": False, "depth": 0, "detaches": True, "common": 0.0, "lines": [0], "shape": part}
        for part in (FIRST, SECOND)
    ]
    parts[0] |= changed
    claims = [
        SimpleNamespace(
            run=run,
            detaches=part["detaches"],
            target=SimpleNamespace(
                edge=(FIRST, SECOND)[run].exterior,
                shape=part["shape"],
                marks=part["marks"],
                source=SimpleNamespace(depth=part["depth"]),
            ),
        )
        for run, part in enumerate(parts)
    ]
    runs = [
        SimpleNamespace(
            row_line=np.array([line - 4, line]), lines=lambda k=k: (parts[k] if k < 2 else parts[1])["lines"]
        )
        for k, line in enumerate((10, 20, 30))
    ]
    cuts = [SimpleNamespace(common=part["common"]) for part in parts]
    plan = SimpleNamespace(crossings=crossed, close=close, cuts=cuts)
    return SimpleNamespace(plan=plan, runs=runs, claims=claims, detaches=lambda claim: claim.detaches)


def path_of(*moves: tuple[int, float, float]) -> Toolpath:
    """Return rapids (line, x, y), from X0 Y0; a negative line is a feed move."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, line=1)
    for line, x, y in moves:
        if line > 0:
            builder.rapid(x, y, line=line)
        else:
            builder.feed(x, y, feed=1.0, line=-line)
    return builder.build()


@pytest.mark.parametrize(
    ("moves", "found"),
    [
        ([(15, 40, 40)], [(15, (40, 40))]),
        ([(5, 40, 40)], []),
        ([(10, 40, 40)], []),
        ([(-15, 40, 40)], []),
        ([(11, 0, 10.29), (12, 40, 10.29)], []),
        ([(11, 0, 10.31), (12, 40, 10.31)], [(12, (40, 10.31))]),
        ([(11, 29.71, 0), (12, 29.71, 40)], []),
        ([(11, 29.69, 0), (12, 29.69, 40)], [(12, (29.69, 40))]),
        # A move that ends inside the part crosses it; a later one of its route is not counted again.
        ([(11, 20, 20)], [(11, (20, 20))]),
        ([(11, 20, 20), (12, 0, 40), (13, 40, 0)], [(11, (20, 20))]),
        # The second part is free for the third route alone.
        ([(15, 0, 20), (16, 90, 20)], [(16, (90, 20))]),
        ([(15, 40, 0), (16, 40, 20), (17, 90, 20)], []),
        ([(15, 40, 0), (25, 40, 20), (26, 90, 20)], [(26, (90, 20))]),
        ([(15, 40, 40), (25, 0, 0), (35, 40, 40)], [(15, (40, 40)), (25, (0, 0)), (35, (40, 40))]),
        ([(15, 0, 40), (16, 0, 40)], []),
    ],
)
def test_a_route_over_a_part_that_is_free_is_counted_once(
    moves: list[tuple[int, float, float]], found: list[tuple[int, tuple[float, float]]]
) -> None:
    assert detached_part_crossings(laid(), path_of(*moves)) == found


@pytest.mark.parametrize(
    "changed",
    [
        {"detaches": False}, {"common": 0.1}, {"marks": True}, {"depth": 1}, {"depth": 3}, {"shape": None},
        {"lines": [0, 1]},
    ],
)  # fmt: skip
def test_only_an_outline_that_is_cut_free_at_once_is_a_free_part(changed: dict[str, Any]) -> None:
    assert detached_part_crossings(laid(**changed), path_of((15, 40, 40))) == []
    assert detached_part_crossings(laid(**changed), path_of((24, 40, 0), (25, 90, 40)))
    assert detached_part_crossings(laid(depth=2), path_of((15, 40, 40)))


@pytest.mark.parametrize(
    ("moves", "near"),
    [
        # 1.8 mm are within a head of 2 mm radius, less the leeway.
        ([(11, 0, 8.21), (12, 40, 8.21)], True), ([(11, 0, 8.19), (12, 40, 8.19)], False),
        ([(11, 31.79, 0), (12, 31.79, 40)], True), ([(11, 31.81, 0), (12, 31.81, 40)], False),
        # Near its ends a route may come near.
        ([(11, 20, 0), (12, 20, 9)], False), ([(11, 20, 0), (12, 20, 9), (13, 20, 0)], True),
        ([(11, 20, 0), (12, 22, 9), (13, 24, 9)], True), ([(11, 40, 0), (12, 40, 20), (13, 31, 20)], False),
    ],
)  # fmt: skip
def test_a_head_comes_near_a_part_away_from_the_ends_of_its_route(
    moves: list[tuple[int, float, float]], near: bool
) -> None:
    assert bool(detached_part_crossings(laid(), path_of(*moves), 2.0)) is near
    assert detached_part_crossings(laid(), path_of(*moves)) == []


def test_a_move_from_an_unknown_place_is_not_counted() -> None:
    builder = ToolpathBuilder()
    builder.rapid(x=40.0, line=15)
    builder.rapid(40.0, 20.0, line=16)
    assert detached_part_crossings(laid(), builder.build()) == []
    builder.rapid(0.0, 20.0, line=17)
    assert detached_part_crossings(laid(), builder.build()) == [(17, (0, 20))]
    assert detached_part_crossings(laid(), ToolpathBuilder().build()) == []
    assert math.isnan(builder.build().before[0, 0])


@pytest.mark.parametrize(
    ("crossed", "close", "nozzle", "text"),
    [
        (None, 0, 0.0, ""), (2, 0, 0.0, ""),
        (1, 0, 0.0, "2 travel moves over detached parts, but only 1 reported; the first leads to X40.000 Y40.000"),
        (1, 9, 9.0, "2 travel moves over detached parts, but only 1 reported; the first leads to X40.000 Y40.000"),
        (2, 0, 4.0, "a nozzle of 4 mm passes over detached parts on 3 travel moves, but only 2 reported; the first "
         "leads to X40.000 Y40.000"),
        (2, 1, 4.0, ""), (2, 0, 3.0, ""),
    ],
)  # fmt: skip
def test_more_routes_over_parts_than_reported_are_a_fault(
    crossed: int | None, close: int, nozzle: float, text: str
) -> None:
    """Two routes cross a part, and a third passes it by 1.7 mm."""
    path = path_of((15, 40, 40), (25, 0, 0), (35, 0, 8.3), (36, 40, 8.3))
    expected = [Difference("travel over a detached part", 0, 15, text)] if text else []
    assert check_detached_parts(laid(crossed=crossed, close=close), path, FLAT, nozzle) == expected  # type: ignore[arg-type]
    lifted: Any = SimpleNamespace(moves_z=True)
    assert check_detached_parts(laid(crossed=crossed, close=close), path, lifted, nozzle) == []
