"""Holes that start at their drawn heights: R planes, bottoms, and moves above the highest."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import LeafcutError
from leafcut.model.toolpath import ToolpathBuilder
from leafcut.proof.clearance import check_clearance
from rs274_moves import moves_of_rs274, run_rs274

#: A plate with steps at 0, -5 and 8.
HOLES = [(10.0, 10.0, 0.0), (30.0, 10.0, -5.0), (50.0, 30.0, 8.0), (20.0, 40.0, 8.0), (60.0, 10.0, -5.0)]
FAST = {"iterations": 1, "threads": 1, "units": "mm"}
#: How much deeper than the shoulder the point of a drill of 3 mm and 118 degrees goes.
POINT = 1.5 / math.tan(math.radians(59))


def table(folder: Path, holes: list[tuple[float, float, float]], diameter: float = 3.0) -> Path:
    file = folder / "plate.csv"
    file.write_text("x,y,z,diameter\n" + "".join(f"{x},{y},{z},{diameter}\n" for x, y, z in holes))
    return file


def drilled(file: Path, **options: Any) -> Any:
    return api.optimize(file, process="drill", depth=3, z_zero="drawn", **FAST, **options)


@pytest.mark.hazard
def test_each_hole_has_its_own_r_plane_and_bottom(tmp_path: Path) -> None:
    """2 mm over its top and 3 mm below it, to the shoulder; after each the tool is 10 mm over the highest top."""
    path = drilled(table(tmp_path, HOLES)).path_after
    found = {
        (x, y): (path.cycles[ref].r_plane, path.cycles[ref].bottom, z)
        for (x, y, z), ref, kind in zip(path.end.tolist(), path.ref.tolist(), path.kind.tolist(), strict=True)
        if kind == 4
    }
    assert found == {(x, y): (z + 2.0, pytest.approx(z - 3.0 - POINT, abs=1e-5), 18.0) for x, y, z in HOLES}


def test_a_drawing_with_circles_at_these_heights_is_the_same_program(tmp_path: Path) -> None:
    document = ezdxf.new(units=4)
    for place in HOLES:
        document.modelspace().add_circle(place, 1.5)
    document.saveas(tmp_path / "plate.dxf")
    common = {"header": False}
    drawn = drilled(tmp_path / "plate.dxf", **common)
    assert drawn.text == drilled(table(tmp_path, HOLES), **common).text
    assert [hole.z for hole in drawn.part.holes] == [z for _, _, z in HOLES]


@pytest.mark.parametrize("machine", ["linuxcnc-mill", "grbl-3018"])
def test_linuxcnc_crosses_over_the_highest_and_comes_down_fast_to_two_over_each_top(
    machine: str, tmp_path: Path, rs274: str
) -> None:
    """By its own interpreter: cycles are its own, or written out."""
    found = drilled(table(tmp_path, HOLES), machine=machine)
    text = found.text.replace("G53 G0 Z0\n", "")
    status, said = run_rs274(rs274, text, tmp_path)
    assert status == 0, said[-300:]
    top = {(x, y): z for x, y, z in HOLES}
    place, deepest = (0.0, 0.0, 0.0), dict[tuple[float, float], float]()
    for move in moves_of_rs274(said):
        if move[0] not in ("rapid", "feed"):
            continue
        end = move[1:4]
        if end[:2] != place[:2] and top.get(place[:2]) is not None:
            assert min(end[2], place[2]) >= 8.0 + 10.0 - 1e-6
        if move[0] == "rapid" and end[2] < place[2] and end[:2] in top:
            assert end[2] >= top[end[0], end[1]] + 2.0 - 1e-6
        if move[0] == "feed":
            deepest[end[0], end[1]] = min(end[2], deepest.get((end[0], end[1]), math.inf))
        place = end
    assert deepest == {(x, y): pytest.approx(z - 3 - POINT, abs=1e-3) for (x, y), z in top.items()}


def test_one_height_that_is_drawn_stays_that_height(tmp_path: Path) -> None:
    """Without the option, holes drawn at Z5 start at Z0, with a note; with it, at Z5, and the R plane is 7."""
    file = table(tmp_path, [(0.0, 0.0, 5.0), (20.0, 0.0, 5.0)])
    own = drilled(file)
    assert "R7" in own.text
    assert not [issue for issue in own.issues if issue.code == "L406"]
    other = api.optimize(file, process="drill", depth=3, **FAST)
    assert "R2" in other.text
    assert [issue.code for issue in other.issues if issue.code == "L406"] == ["L406"]


@pytest.mark.parametrize(
    ("holes", "options", "words"),
    [
        (HOLES, {"retract": "r"}, r"--retract r: the surface between holes at different heights is unknown"),
    ],
)
def test_what_cannot_be_known_is_refused(
    holes: list[tuple[float, float, float]], options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    with pytest.raises(LeafcutError, match=words):
        drilled(table(tmp_path, holes), **options)


def edges(folder: Path, *circles: tuple[float, float]) -> Path:
    """Return a drawing of circles with one centre: (height, diameter)."""
    document = ezdxf.new(units=4)
    for z, diameter in circles:
        document.modelspace().add_circle((10, 10, z), diameter / 2)
    document.saveas(folder / "edges.dxf")
    return folder / "edges.dxf"


def test_a_hole_whose_edges_are_both_drawn_begins_at_the_upper_one(tmp_path: Path) -> None:
    for order in ((2, -8), (-8, 2)):
        (hole,) = drilled(edges(tmp_path, *((z, 3) for z in order))).part.holes
        assert hole.z == 2


def test_a_hole_under_a_wider_one_begins_where_that_begins_as_nobody_drills_that(tmp_path: Path) -> None:
    """Down to the height of the small circle would be a rapid into the material; with both kept, nobody can know."""
    found = drilled(edges(tmp_path, (0, 8), (-5, 3)))
    (hole,) = found.part.holes
    assert (hole.diameter, hole.z) == (3, 0)
    assert any("starts at the highest" in issue.message for issue in found.issues)
    with pytest.raises(
        LeafcutError,
        match=r"with --z-zero drawn, only one hole may lie at \(10, 10\), but one is drawn at Z0 and another at Z-5; "
        r"select one of them with --layers or --max-diameter",
    ):
        drilled(edges(tmp_path, (0, 8), (-5, 3)), concentric="all")


def test_without_the_option_the_message_names_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["drill", str(table(tmp_path, HOLES)), "-o", str(tmp_path / "o.nc"), "--depth", "3"]) != 0
    assert "use --z-zero drawn" in capsys.readouterr().err


@pytest.mark.hazard
def test_the_proof_sees_a_rapid_below_the_top_of_the_hole_where_it_is() -> None:
    """At -5 the R plane may be -3; the same at a hole whose top is 8, or beside all holes, is a crash."""
    tops = np.array(HOLES)
    for x, y, low, what in (
        (30.0, 10.0, -3.0, []),
        (30.0, 10.0, -5.1, ["rapid into the part"]),
        (50.0, 30.0, -3.0, ["rapid into the part"]),
        (40.0, 20.0, 7.0, ["rapid into the part"]),
        (40.0, 20.0, 9.0, []),
    ):
        builder = ToolpathBuilder()
        builder.spindle(1000.0)
        builder.rapid(z=18.0)
        builder.rapid(x, y)
        builder.rapid(z=low)
        assert [one.what for one in check_clearance(builder.build(), tops=tops)] == what
    # Across no lower than the highest top.
    builder = ToolpathBuilder()
    builder.rapid(z=8.02)
    builder.rapid(10.0, 10.0)
    assert [one.what for one in check_clearance(builder.build(), tops=tops)] == ["rapid below clearance"]
