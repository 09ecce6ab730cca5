"""The heights of a drawing are reported, and refused if they differ: all work starts from one surface."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api, read_part
from leafcut.errors import PlanError, ReadError
from leafcut.read import read_contours, read_pockets

FAST = {"iterations": 1, "threads": 1}


def drawn(folder: Path, draw: Callable[[Any], None], units: int = 4) -> Path:
    document = ezdxf.new(units=units)
    draw(document.modelspace())
    document.saveas(folder / "part.dxf")
    return folder / "part.dxf"


def circles(*heights: float) -> Callable[[Any], None]:
    def draw(space: Any) -> None:
        for k, z in enumerate(heights):
            space.add_circle((10.0 * k, 5.0, z), 2.0)

    return draw


def in_a_block(space: Any) -> None:
    """One circle at Z1 in a block that is inserted at Z0 and, twice as high, at Z3: heights 1 and 5."""
    block = space.doc.blocks.new("HOLE")
    block.add_circle((0, 0, 1), 2)
    space.add_blockref("HOLE", (0, 5, 0))
    space.add_blockref("HOLE", (10, 5, 3), dxfattribs={"zscale": 2})


def of_another_plane(space: Any) -> None:
    """An extrusion of (0, 0, -1) turns the plane over: Z-5 of its own is Z5."""
    space.add_circle((0, 5, 0), 2)
    space.add_circle((-10, 5, -5), 2, dxfattribs={"extrusion": (0, 0, -1)})


def of_arcs(space: Any) -> None:
    space.add_circle((0, 5, 0), 2)
    space.add_lwpolyline([(8, 5, 1), (12, 5, 1)], format="xyb", close=True, dxfattribs={"elevation": 5})


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (
            circles(5, -3, -3),
            r"1 at Z5 \(the first at 0, 5\), 2 at Z-3 \(the first at 10, 5\); all of them are drilled from Z0",
        ),
        (in_a_block, r"1 at Z5 \(the first at 10, 5\), 1 at Z1 \(the first at 0, 5\)"),
        (of_another_plane, r"1 at Z5 \(the first at 10, 5\), 1 at Z0 \(the first at 0, 5\)"),
        (of_arcs, r"1 at Z5 \(the first at 10, 5\), 1 at Z0"),
    ],
)
def test_holes_at_different_heights_are_refused_with_how_many_lie_where(
    draw: Callable[[Any], None], words: str, tmp_path: Path
) -> None:
    """On 0.1.0 all of them were drilled from Z0, without a word."""
    with pytest.raises(PlanError, match=words):
        api.optimize(drawn(tmp_path, draw), tmp_path / "out.nc", depth=2, **FAST)
    assert not (tmp_path / "out.nc").exists()


@pytest.mark.parametrize(("units", "height"), [(4, "Z5"), (1, "Z127")])
def test_one_height_of_all_holes_is_told_in_mm(units: int, height: str, tmp_path: Path) -> None:
    found = api.optimize(drawn(tmp_path, circles(5, 5), units), depth=2, **FAST)
    assert [i.message.split(":")[0] for i in found.issues if i.code == "L406"] == [f"all holes are drawn at {height}"]


def test_a_drawing_at_z0_says_nothing_of_heights(tmp_path: Path) -> None:
    found = api.optimize(drawn(tmp_path, circles(0, 1e-6, -1e-6)), depth=2, **FAST)
    assert "L406" not in {i.code for i in found.issues}


def test_a_table_may_have_a_column_z(tmp_path: Path) -> None:
    table = tmp_path / "holes.csv"
    table.write_text("x,y,z,diameter\n0,0,0,3\n10,0,-2,3\n")
    assert [(h.z, h.diameter) for h in read_part(table).holes] == [(0.0, 3.0), (-2.0, 3.0)]
    with pytest.raises(PlanError, match=r"1 at Z0 .*, 1 at Z-2"):
        api.optimize(table, depth=2, **FAST)
    api.solve(table, **FAST)  # a map of points has no surface


def squares(*heights: float) -> Callable[[Any], None]:
    def draw(space: Any) -> None:
        for k, z in enumerate(heights):
            x = 60.0 * k
            corners = [(x, 0), (x + 40, 0), (x + 40, 40), (x, 40)]
            space.add_lwpolyline(corners, close=True, dxfattribs={"elevation": z})

    return draw


def test_pockets_at_different_heights_are_refused_and_one_height_is_told(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match=r"1 at Z0 \(the first at 0, 0\), 1 at Z-4 \(the first at 60, 0\)"):
        read_pockets(drawn(tmp_path, squares(0, -4)))
    part = read_pockets(drawn(tmp_path, squares(-4, -4)))
    assert [i.message[:45] for i in part.issues if i.code == "L406"] == [
        "all outlines of pockets and islands are drawn"
    ]


def test_a_sheet_is_taken_as_seen_from_above_and_its_heights_are_told(tmp_path: Path) -> None:
    part = read_contours(drawn(tmp_path, squares(0, 6, 6)))
    words = "lines are drawn at different heights: 2 at Z6 (the first at 60, 0), 1 at Z0 (the first at 0, 0)"
    assert [i.message for i in part.issues if i.code == "L406"] == [f"{words}; they were projected onto the sheet"]
