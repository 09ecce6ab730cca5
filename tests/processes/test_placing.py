"""A drawing mirrored, rotated and moved is the drawing that a CAD would have mirrored, rotated and moved."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.math import Matrix44

import leafcut
from leafcut.errors import OptionError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.outcome import Outcome
from leafcut.model.part import Hole, Part, Slot
from leafcut.model.pocket import Pocket
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.processes.contours import prepare_sheet
from leafcut.processes.placing import place_part
from leafcut.processes.settings import collect_settings
from leafcut.read import read, read_contours, read_pockets


def options(**values: Any) -> ReadOptions:
    return collect_settings(values).read


def test_first_comes_the_mirror_then_the_turn_then_the_origin_by_hand() -> None:
    """(10, 4) → mirrored in x (−10, 4) → rotated by 90° (−4, −10); (2, 1) → (−2, 1) → (−1, −2).

    The lower left corner of both is (−4, −10), so they end at (0, 0) and (3, 8).
    """
    part = Part("p", (Hole(10, 4, 3), Hole(2, 1, 5)))
    moved = place_part(part, options(mirror="x", rotate="90", origin="lower-left"))
    assert [(h.x, h.y, h.diameter) for h in moved.holes] == [(0, 0, 3), (3, 8, 5)]
    assert [(h.x, h.y) for h in place_part(part, options(mirror="x", rotate="90")).holes] == [(-4, -10), (-1, -2)]
    assert place_part(part, options()).holes is part.holes


@pytest.mark.parametrize(
    "origin, first",
    [
        *[("lower-left", (8, 3)), ("lower-right", (0, 3)), ("upper-left", (8, 0)), ("upper-right", (0, 0))],
        *[("centre", (4, 1.5)), ("Center", (4, 1.5)), ("1,2.5", (9, 1.5)), ((1.0, 2.5), (9, 1.5))],
    ],
)
def test_the_origin_is_a_corner_of_what_is_worked_its_centre_or_a_point(
    origin: Any, first: tuple[float, float]
) -> None:
    """Of holes at (10, 4) and (2, 1)."""
    part = Part("p", (Hole(10, 4, 3), Hole(2, 1, 5)))
    assert (
        place_part(part, options(origin=origin)).holes[0].x,
        place_part(part, options(origin=origin)).holes[0].y,
    ) == first


def test_slots_keep_their_width_and_arcs_change_their_direction_in_a_mirror_only() -> None:
    """A quarter circle, counter-clockwise from (1, 0) to (0, 1), is clockwise from (−1, 0) to (0, 1) in a mirror."""
    arc = Polyline(np.array([[1.0, 0.0, math.tan(math.pi / 8)], [0.0, 1.0, 0.0]]))
    part = Part("p", slots=(Slot((0, 0), (4, 1), 2.0),), contours=(Contour(arc),))
    mirrored = place_part(part, options(mirror="x"))
    assert mirrored.slots == (Slot((0, 0), (-4, 1), 2.0),)
    path = mirrored.contours[0].path
    assert (path.start, path.end) == ((-1, 0), (0, 1)) and path.bulges[0] == -arc.bulges[0]
    assert path.segment(0).center == pytest.approx((0, 0), abs=1e-12)
    assert place_part(part, options(rotate="180deg")).contours[0].path.bulges[0] == arc.bulges[0]


def test_a_mirrored_pocket_still_has_its_outline_counter_clockwise_and_its_islands_clockwise() -> None:
    """So climb milling, and the side of the walls, are what they were."""
    outline = Polyline.of_points([(0, 0), (40, 0), (40, 30), (0, 20)], closed=True)
    pocket = Pocket(outline, (Polyline.circle(10, 10, 3, clockwise=True),))
    (mirrored,) = place_part(Part("p", pockets=(pocket,)), options(mirror="y", rotate="30")).pockets
    assert mirrored.outline.area == pytest.approx(outline.area) and outline.area > 0
    assert mirrored.islands[0].area == pytest.approx(-math.pi * 9)


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    """Draw holes, a part with a round end, a slot of two arcs, and a pocket, all asymmetric."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0, 0), (80, 0, 0.4), (80, 30, 0), (10, 45, 0)], format="xyb", close=True)
    space.add_circle((20, 15), 6)
    space.add_lwpolyline([(50, 10, 0), (65, 10, 1), (65, 16, 0), (50, 16, 1)], format="xyb", close=True)
    document.saveas(tmp_path / "drawing.dxf")
    return tmp_path / "drawing.dxf"


PLACED = {"mirror": "x", "rotate": "30deg", "origin": "-7,12"}


@pytest.fixture
def transformed(drawing: Path) -> Path:
    """Return the same drawing as ezdxf itself mirrors, rotates and moves it."""
    document = ezdxf.readfile(drawing)
    matrix = Matrix44.chain(
        Matrix44.scale(-1, 1, 1), Matrix44.z_rotate(math.radians(30)), Matrix44.translate(7, -12, 0)
    )
    for entity in document.modelspace():
        entity.transform(matrix)
    document.saveas(drawing.parent / "transformed.dxf")
    return drawing.parent / "transformed.dxf"


def shapes(paths: list[Polyline]) -> list[np.ndarray]:
    """Return properties that do not depend on the start of a path: extents, area, length, arcs by direction."""
    rows = [[*p.extents, p.area, p.length, (p.bulges > 0).sum(), (p.bulges < 0).sum()] for p in paths]
    return sorted((np.round(row, 6) for row in rows), key=tuple)


def test_what_is_read_and_placed_is_what_ezdxf_makes_of_the_drawing(drawing: Path, transformed: Path) -> None:
    placing = options(**PLACED)
    ours, theirs = place_part(read(drawing), placing), read(transformed)
    assert ours.hole_xy == pytest.approx(theirs.hole_xy)
    cut = [
        prepare_sheet(part, SheetOptions())
        for part in (place_part(read_contours(drawing), placing), read_contours(transformed))
    ]
    assert np.allclose(*(shapes([c.path for c in sheet.contours]) for sheet in cut))
    assert [c.depth for c in cut[0].contours] == [c.depth for c in cut[1].contours]
    as_pocket = PocketDrawingOptions(outline="pocket")
    pockets = [place_part(read_pockets(drawing, None, as_pocket), placing), read_pockets(transformed, None, as_pocket)]
    assert np.allclose(*(shapes([p.outline for p in part.pockets]) for part in pockets))


def test_a_mirrored_sheet_is_cut_on_the_same_side_of_its_lines(drawing: Path, transformed: Path) -> None:
    """Proved against the placed drawing, and compared with a drawing mirrored in CAD: same length and direction of
    cuts.

    A torch with clockwise swirl cuts outlines clockwise and holes counter-clockwise.
    """
    given = {"process": "cut", "thickness": 6, "iterations": 2, "threads": 1}
    ours, theirs = leafcut.optimize(drawing, **given, **PLACED), leafcut.optimize(transformed, **given)
    assert ours.verified and theirs.verified
    assert ours.after.cut_mm == pytest.approx(theirs.after.cut_mm, rel=1e-3)
    assert turns(ours) == turns(theirs) == turns(leafcut.optimize(drawing, **given))
    assert len(turns(ours)) == 3 and len(set(turns(ours))) == 2


def turns(outcome: Outcome) -> list[float]:
    """Return the direction of the cuts, +1 for counter-clockwise."""
    assert outcome.detail.plan is not None
    return sorted(math.copysign(1.0, Polyline(cut.path.vertices, closed=True).area) for cut in outcome.detail.plan.cuts)


@pytest.mark.parametrize("compensation", ["geometry", "controller"])
def test_the_controller_compensates_a_mirrored_sheet_to_the_same_side(drawing: Path, compensation: str) -> None:
    """G41 stays G41: the tool is on the left of its way, and the way is chosen after the mirror."""
    given = {"process": "cut", "thickness": 6, "compensation": compensation, "iterations": 1, "threads": 1}
    texts = [leafcut.optimize(drawing, **given, **more).text for more in ({}, {"mirror": "y"})]
    for text in texts:
        assert ("G41" in text) == (compensation == "controller")
        assert "G42" not in text


def test_a_title_block_does_not_say_where_the_corner_of_a_sheet_is(tmp_path: Path) -> None:
    """A title block on an ignored layer, below and to the left of the part."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(100, 50), (180, 50), (180, 90), (100, 90)], close=True)
    space.add_lwpolyline([(0, 0), (20, 0), (20, 10), (0, 10)], close=True, dxfattribs={"layer": "TITLE"})
    document.saveas(tmp_path / "titled.dxf")
    given = {"process": "cut", "thickness": 6, "ignore_layers": "TITLE", "origin": "lower-left", "iterations": 1}
    outcome = leafcut.optimize(tmp_path / "titled.dxf", **given)
    (part,) = [contour for contour in outcome.part.contours if contour.layer != "TITLE"]
    assert part.path.extents == pytest.approx((0, 0, 80, 40))


@pytest.mark.parametrize(("milling", "left"), [("climb", True), ("conventional", False)])
def test_milling_of_a_mirrored_pocket_keeps_its_side(milling: str, left: bool, drawing: Path) -> None:
    """Climb milling has the material on its right: the tool moves counter-clockwise along the wall."""
    given = {"process": "pocket", "depth": 1, "tool_diameter": 8, "strategy": "contour", "threads": 1}
    given["outline"] = "pocket"
    passes = []
    for mirror in ({}, {"mirror": "x"}):
        outcome = leafcut.optimize(drawing, milling=milling, **given, **mirror)
        pieces = [p for plan in outcome.detail.plans for p in plan.result.path.pieces]  # type: ignore[union-attr]
        areas = [Polyline(p.path.vertices, closed=True).area for p in pieces if p.kind == "finish"]
        largest = max(areas, key=abs)
        passes.append((len(areas), largest > 0, round(abs(largest), 3)))
    assert passes[0] == passes[1] and passes[0][1] == left


def test_the_holes_of_a_board_are_drilled_from_the_back(tmp_path: Path) -> None:
    """As a hand that turns the board over sideways, with its right lower corner as zero, finds them."""
    board = tmp_path / "board.drl"
    board.write_text("M48\nMETRIC\nT1C0.8\n%\nT1\nX10.0Y5.0\nX30.0Y5.0\nX10.0Y25.0\nM30\n")
    outcome = leafcut.optimize(board, depth=2, mirror="x", origin="lower-left")
    assert sorted((h.x, h.y) for h in outcome.part.holes) == [(0, 0), (20, 0), (20, 20)]
    assert outcome.options["--mirror"] == "x" and outcome.options["--origin"] == "lower-left"
    assert outcome.verified


@pytest.mark.parametrize("given", [{"mirror": "x"}, {"rotate": "90"}, {"origin": "centre"}])
def test_a_program_is_neither_mirrored_nor_turned_nor_moved(given: dict[str, str], examples: Path) -> None:
    (name,) = given
    with pytest.raises(
        OptionError, match=f"^--{name}: this option does not apply to reordering a program, .*(CAM|work offset)"
    ):
        leafcut.optimize(examples / "cam_121.nc", **given)


@pytest.mark.parametrize(
    "given, words",
    [
        ({"origin": "lower left"}, "--origin: unknown position 'lower left'; did you mean 'lower-left'"),
        ({"origin": "1,2,3"}, "--origin: '1,2,3' is not a point"),
        ({"mirror": "z"}, "--mirror: unknown value 'z'"),
        ({"rotate": "400"}, "--rotate: 400 deg is above the maximum of 360 deg"),
    ],
)
def test_a_wrong_place_is_refused(given: dict[str, str], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        options(**given)


def test_the_places_of_a_program_are_told_in_json(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    from leafcut.cli.app import run

    board = tmp_path / "board.drl"
    board.write_text("M48\nMETRIC\nT1C0.8\n%\nT1\nX10.0Y5.0\nX30.0Y5.0\nM30\n")
    assert run(["optimize", str(board), "--rotate", "-90", "--origin=-5,1", "--depth", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verified"] is True
