"""A part milled from a plate: the height field after the program is the drawn part, cell by cell, with its tabs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

import leafcut
from leafcut.errors import LeafcutError, OptionError, PlanError
from leafcut.model.toolpath import Kind

DIAMETER, THICKNESS, TABS, TAB_WIDTH, TAB_HEIGHT = 4.0, 3.0, 3, 5.0, 1.0
#: Side of a cell, mm.
CELL = 0.2
OUTLINE = [(0, 0), (80, 0), (80, 50), (40, 60), (0, 50)]
WINDOW = [(10, 10), (50, 10), (50, 40), (10, 40)]
HOLE = (65.0, 25.0, 5.0)
FAST = {"thickness": THICKNESS, "tool_diameter": DIAMETER, "preset": "fast", "threads": 1, "feed": "600mm/min"}


def drawing(folder: Path, *outlines: list[tuple[float, float]], circles: tuple[tuple[float, ...], ...] = ()) -> Path:
    document = ezdxf.new(units=4)
    for points in outlines:
        document.modelspace().add_lwpolyline(points, close=True)
    for x, y, radius in circles:
        document.modelspace().add_circle((x, y), radius)
    document.saveas(folder / "part.dxf")
    return folder / "part.dxf"


def plate(folder: Path, **options: Any) -> leafcut.ProgramResult:
    source = drawing(folder, OUTLINE, WINDOW, circles=(HOLE,))
    given = {"tabs": TABS, "tab_width": TAB_WIDTH, "tab_height": TAB_HEIGHT, **FAST, **options}
    return leafcut.part(source, folder / "part.ngc", **given)


@pytest.mark.hazard
@pytest.mark.parametrize("milling", ["climb", "conventional"])
@pytest.mark.parametrize("finish", [0.0, 0.4])
def test_the_material_after_the_program_is_the_drawn_part_with_its_tabs(
    milling: str, finish: float, tmp_path: Path
) -> None:
    """Cells within a cell of an edge, or of an end of a tab, are not compared."""
    plate(tmp_path, milling=milling, finish=finish)
    field = leafcut.stock(
        tmp_path / "part.ngc", workpiece=f"-10,-10,{-THICKNESS - 1},90,70,0", cell=CELL, tool_diameter=DIAMETER
    ).field
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))
    outline, window = shapely.Polygon(OUTLINE), shapely.Polygon(WINDOW)
    hole = shapely.Point(HOLE[:2]).buffer(HOLE[2], quad_segs=64)
    slug = window.buffer(-0.5 * DIAMETER - finish).buffer(-0.5 * DIAMETER)
    hole_slug = shapely.Point(HOLE[:2]).buffer(HOLE[2] - DIAMETER - finish, quad_segs=64)
    # Corners of the window keep the radius of the mill.
    cut = [
        outline.buffer(DIAMETER + finish, quad_segs=64) - outline,
        window.buffer(-0.5 * DIAMETER).buffer(0.5 * DIAMETER, quad_segs=64) - slug,
        hole - hole_slug,
    ]
    low = np.zeros(field.heights.shape, dtype=bool)
    for shape in cut:
        inner, outer = shape.buffer(-CELL), shape.buffer(CELL)
        own = shapely.contains_xy(inner, x, y)
        low |= shapely.contains_xy(outer, x, y)
        heights = np.round(field.heights[own], 3)
        through, top = heights <= -THICKNESS, heights == round(TAB_HEIGHT - THICKNESS, 3)
        assert (through | top).all()
        tabs = 0 if shape is cut[2] else TABS
        bridges = shapely.union_all(shapely.points(x[own][top], y[own][top])).buffer(1.5 * CELL)
        assert len(shapely.get_parts(bridges)) * (not bridges.is_empty) == tabs
        # The cuts on both sides of a tab end in half circles.
        area = tabs * (TAB_WIDTH + (1 - np.pi / 4) * DIAMETER) * (DIAMETER + finish - 2 * CELL)
        assert top.sum() * CELL**2 == pytest.approx(area, rel=0.06, abs=0.1)
    assert (field.heights[~low] == 0.0).all()


@pytest.mark.parametrize(
    "options, words",
    [
        ({"thickness": None}, "give --thickness"),
        ({"tool_diameter": None}, "give --tool-diameter"),
        (
            {"tab_height": 3.0},
            "--tab-height is 3 mm, but the plate is only 3 mm thick; give a smaller --tab-height, or --tabs 0",
        ),
        (
            {"mark_layers": "*"},
            "there is nothing to mill, because the drawing has no closed outlines except those that are marked "
            "or left out; check --mark-layers, --cut-layers, --min-diameter and --max-diameter",
        ),
        ({"tab_width": 60.0}, "has no room for 2 tabs of 60 mm; give --tab-width 41.8mm, or --tabs 0"),
        ({"tabs": 0}, "only used with --tabs; add --tabs or leave out --tab-"),
        ({"machine": "plasma-table"}, "cannot mill"),
        (
            {"tool_diameter": 70.0, "spindle_speed": 500, "tab_width": 30.0},
            "no room for 2 tabs of 30 mm; give --tab-width",
        ),
    ],
)
def test_a_part_that_cannot_be_milled_as_asked_is_refused_in_one_line(
    options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    with pytest.raises(LeafcutError) as refused:
        plate(tmp_path, **options)
    assert words in str(refused.value) and "\n" not in str(refused.value)
    assert not (tmp_path / "part.ngc").exists()


def test_a_hole_narrower_than_the_mill_is_named_as_missing_work(tmp_path: Path) -> None:
    source = drawing(tmp_path, OUTLINE, circles=((20.0, 20.0, 1.5), HOLE))
    outcome = leafcut.part(source, **FAST)
    (missing,) = [issue.missing for issue in outcome.issues if issue.missing is not None]
    assert (missing.what, missing.count) == ("opening", 1)
    assert outcome.detail.outlines == 1 and outcome.detail.openings == 1


def remaining_width(outcome: leafcut.ProgramResult, outline: list[tuple[float, float]], diameter: float) -> float:
    """Return the width of the narrowest bridge between a part and the plate after all cuts through the plate, mm."""
    path = outcome.written
    through = (path.kind == Kind.FEED) & (np.maximum(path.before[:, 2], path.end[:, 2]) <= -THICKNESS)
    ends = np.stack([path.before[through][:, :2], path.end[through][:, :2]], axis=1)
    plate = shapely.Polygon(outline).buffer(100.0).envelope
    rest = plate.difference(shapely.union_all(shapely.buffer(shapely.linestrings(ends), 0.5 * diameter)))

    def is_held(width: float) -> bool:
        pieces = shapely.get_parts(rest.buffer(-0.5 * width))
        outside, inside = shapely.Point(plate.exterior.coords[0]), shapely.Polygon(outline).representative_point()
        return min(pieces, key=outside.distance) is min(pieces, key=inside.distance)

    return max((width for width in np.arange(0.1, 10.0, 0.1).tolist() if is_held(width)), default=0.0)


@pytest.mark.hazard
@pytest.mark.parametrize("tabs, width, diameter", [(1, 1.0, 6.0), (4, 3.0, 6.0), (2, 6.0, 10.0)])
def test_a_tab_at_a_corner_has_its_width_between_the_cuts(
    tabs: int, width: float, diameter: float, tmp_path: Path
) -> None:
    """A wheel with 24 pointed teeth has no straight section for a tab."""
    teeth = [
        (r * np.cos(angle), r * np.sin(angle))
        for k in range(48)
        for r, angle in [(40.0 if k % 2 else 33.0, np.pi * k / 24)]
    ]
    options = FAST | {"tool_diameter": diameter, "spindle_speed": 2000}
    outcome = leafcut.part(drawing(tmp_path, teeth), tabs=tabs, tab_width=width, **options)
    assert remaining_width(outcome, teeth, diameter) >= width - 0.15


@pytest.mark.hazard
@pytest.mark.parametrize("side, tabs", [(9.0, 2), (12.0, 3), (24.0, 4)])
def test_a_small_part_has_as_many_tabs_as_it_has_room_for(side: float, tabs: int, tmp_path: Path) -> None:
    """A tab of 4 mm needs 18 mm of the path of a mill of 2 mm, which is 2π mm longer than the outline."""
    square = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]
    options = FAST | {"tool_diameter": 2.0, "spindle_speed": 4000, "tab_width": 4.0}
    outcome = leafcut.part(drawing(tmp_path, square), **options)
    assert outcome.detail.tabs == tabs and ("L709" in [issue.code for issue in outcome.issues]) == (tabs < 4)
    assert remaining_width(outcome, square, 2.0) >= 3.85


def test_a_tab_of_the_width_that_a_refusal_proposes_has_room(tmp_path: Path) -> None:
    source = drawing(tmp_path, OUTLINE, circles=((100.0, 20.0, 3.0),))
    options = FAST | {"tool_diameter": 2.0, "spindle_speed": 4000}
    with pytest.raises(PlanError, match=r"no room for 2 tabs of 6 mm; give --tab-width 2.1mm, or --tabs 0") as refused:
        leafcut.part(source, **options)
    width = str(refused.value).partition("--tab-width ")[2].partition(",")[0]
    assert leafcut.part(source, tab_width=width, **options).detail.tabs == 6


@pytest.mark.hazard
def test_a_tab_that_the_cut_of_a_neighbour_would_go_through_is_refused(tmp_path: Path) -> None:
    """The strip of 7 mm between two parts is narrower than both cuts together; a mill of 2 mm leaves 3 mm of it."""
    left, right = [(0, 0), (60, 0), (60, 90), (0, 90)], [(67, 0), (127, 0), (127, 60), (67, 60)]
    above, below = [(-20, 97), (150, 97), (150, 120), (-20, 120)], [(-20, -7), (150, -7), (150, -30), (-20, -30)]
    source = drawing(tmp_path, left, right, above, below)
    with pytest.raises(PlanError, match=r"would cut through a tab, .* move the parts at least 15 mm apart"):
        leafcut.part(source, **FAST | {"tool_diameter": 6.0})
    outcome = leafcut.part(source, tab_width=4.0, **FAST | {"tool_diameter": 2.0, "spindle_speed": 4000})
    assert remaining_width(outcome, left, 2.0) >= 2.9


@pytest.mark.hazard
def test_a_part_in_an_opening_without_tabs_is_refused(tmp_path: Path) -> None:
    """The path around the star has room for 20 tabs and that in the window around it has not."""
    window = [(x + 30.0, y + 30.0) for x, y in [(0, 0), (60, 0), (60, 60), (0, 60)]]
    star = [
        (60.0 + r * np.cos(angle), 60.0 + r * np.sin(angle))
        for k in range(24)
        for r, angle in [(24.0 if k % 2 else 10.0, np.pi * k / 12)]
    ]
    source = drawing(tmp_path, [(0, 0), (120, 0), (120, 120), (0, 120)], window, star)
    options = FAST | {"tool_diameter": 2.0, "spindle_speed": 4000, "tab_width": 2.0}
    with pytest.raises(LeafcutError, match="no tab connects the part at"):
        leafcut.part(source, tabs=20, **options)
    assert leafcut.part(source, tabs=4, **options).detail.tabs == 12


@pytest.mark.hazard
@pytest.mark.parametrize("tabs", [3, 4, 5])
def test_the_mill_never_plunges_into_the_plate(tabs: int, tmp_path: Path) -> None:
    """The mill goes straight down only to the height at which its ramp starts."""
    corners = [(40.0 * np.cos(np.pi * k / 4), 40.0 * np.sin(np.pi * k / 4)) for k in range(8)]
    path = leafcut.part(drawing(tmp_path, corners), tabs=tabs, **FAST | {"tool_diameter": 6.0}).written
    level = np.hypot(*(path.end - path.before)[:, :2].T) < 1e-6
    assert not ((path.kind == Kind.FEED) & level & (path.end[:, 2] < path.before[:, 2]) & (path.end[:, 2] < 0.0)).any()


TOOLS = """
[[tool]]
number = 4
diameter = "3 mm"
spindle_speed = "4000 rpm"
feed = "300 mm/min"
{peck}
[[tool]]
number = 7
kind = "end-mill"
diameter = "4 mm"
spindle_speed = "5000 rpm"
feed = "600 mm/min"
"""


TWO_MM_DRILL = """
[[tool]]
number = 5
diameter = "2 mm"
spindle_speed = "4000 rpm"
feed = "200 mm/min"
"""


@pytest.mark.parametrize("peck", ["", 'peck = "1 mm"'])
def test_a_hole_is_drilled_where_the_library_has_its_drill_and_milled_otherwise(peck: str, tmp_path: Path) -> None:
    (tmp_path / "tools.toml").write_text(TOOLS.format(peck=peck))
    centres = [(10.0, 10.0), (30.0, 40.0), (70.0, 20.0), (20.0, 30.0)]
    source = drawing(tmp_path, OUTLINE, circles=(*((x, y, 1.5) for x, y in centres), (50.0, 25.0, 5.0)))
    outcome = leafcut.part(source, thickness=THICKNESS, tools=tmp_path / "tools.toml", preset="fast", threads=1)
    assert [operation.tool.number for operation in outcome.operations] == [4, 7]
    assert (outcome.detail.holes, outcome.detail.openings, outcome.detail.outlines) == (4, 1, 1)
    drilled = outcome.written.kind == Kind.DRILL
    assert sorted(map(tuple, outcome.written.end[drilled][:, :2].tolist())) == sorted(centres)
    # The point of a drill of 118° with a diameter of 3 mm is 0.901 mm long; the full diameter ends 0.5 mm below.
    assert {cycle.bottom for cycle in outcome.written.cycles} == {-4.401}
    assert {cycle.peck for cycle in outcome.written.cycles} == ({1.0} if peck else {0.0})


def test_holes_of_two_drills_belong_to_the_drill_of_their_diameter(tmp_path: Path) -> None:
    (tmp_path / "tools.toml").write_text(TOOLS.format(peck="") + TWO_MM_DRILL)
    holes = [(x, 20.0, radius) for x, radius in ((10.0, 1.5), (20.0, 1.0), (30.0, 1.5), (40.0, 1.0))]
    source = drawing(tmp_path, OUTLINE, circles=tuple(holes))
    outcome = leafcut.part(source, thickness=THICKNESS, tools=tmp_path / "tools.toml", preset="fast", threads=1)
    for operation in outcome.operations:
        drawn = [outcome.part.holes[number].diameter for number in operation.holes]
        assert drawn == [operation.tool.diameter] * (2 if operation.tool.number in (4, 5) else 0)


@pytest.mark.hazard
def test_a_hole_around_another_part_is_milled(tmp_path: Path) -> None:
    (tmp_path / "tools.toml").write_text(TOOLS.format(peck="").replace("3 mm", "20 mm"))
    inner = [(x + 40.0, y + 30.0) for x, y in ((-3, -3), (3, -3), (3, 3), (-3, 3))]
    source = drawing(tmp_path, OUTLINE, inner, circles=((40.0, 30.0, 10.0),))
    outcome = leafcut.part(source, thickness=THICKNESS, tools=tmp_path / "tools.toml", tabs=0, preset="fast", threads=1)
    assert (outcome.detail.holes, outcome.detail.openings, outcome.detail.outlines) == (0, 1, 2)


@pytest.mark.hazard
@pytest.mark.parametrize("angle", [0.5, 3.0])
@pytest.mark.parametrize("step", [0.5, 1.0, 1.5])
def test_no_turn_around_an_edge_cuts_deeper_than_the_step_down(step: float, angle: float, tmp_path: Path) -> None:
    source = drawing(tmp_path, OUTLINE, circles=(HOLE,))
    outcome = leafcut.part(source, tabs=0, step_down=step, entry_angle=angle, **FAST)
    cut = outcome.path_after.end[outcome.path_after.kind == 1]
    for x, y in np.unique(cut[:, :2].round(3), axis=0):
        here = np.abs(cut[:, :2] - (x, y)).max(axis=1) < 1e-3
        depths = [0.0, *np.minimum(cut[here, 2], 0.0)]
        assert max(-np.diff(depths)) <= step + 1e-6


@pytest.mark.hazard
@pytest.mark.parametrize("tabs", [0, TABS])
@pytest.mark.parametrize("step", [0.5, 1.0, 1.5, 3.0])
def test_no_cut_into_the_stock_is_deeper_than_the_step_down(step: float, tabs: int, tmp_path: Path) -> None:
    """The stock model measures the depth of cut cell by cell; a ramp of 3 degrees falls by 0.01 mm in a cell."""
    plate(tmp_path, tabs=tabs, step_down=step, **{} if tabs else {"tab_width": None, "tab_height": None})
    block = f"-10,-10,{-THICKNESS - 1},90,70,0"
    stock = leafcut.stock(tmp_path / "part.ngc", workpiece=block, cell=CELL, tool_diameter=DIAMETER)
    assert stock.tools[0].deepest_mm <= step + 0.02


@pytest.mark.parametrize("step", [0.5, 1.0, 1.5, 3.0, 4.0])
@pytest.mark.parametrize("tabs", [0, TABS])
def test_a_long_edge_is_cut_in_as_few_turns_as_the_step_down_allows(tabs: int, step: float, tmp_path: Path) -> None:
    """Ramps add their own length once without tabs. With tabs, each level below them adds a ramp for each piece."""
    outcome = leafcut.part(drawing(tmp_path, OUTLINE), tabs=tabs, step_down=step, **FAST)
    around = shapely.Polygon(OUTLINE).buffer(0.5 * DIAMETER, quad_segs=64).length
    turns = np.ceil((THICKNESS + 0.5) / step)
    below = np.ceil((TAB_HEIGHT + 0.5) / step) if tabs else 0.0
    # If the first level is below the tops of the tabs, a turn at this height comes first.
    turns += tabs > 0 and (THICKNESS + 0.5) / turns > THICKNESS - TAB_HEIGHT
    ramps = (2.0 + (tabs + 1) * (below + 1.0)) * (step + 1.0) / np.tan(np.radians(3.0))
    assert turns * around < outcome.after.cut_mm < turns * around + ramps


@pytest.mark.hazard
def test_a_plate_of_another_thickness_than_its_solid_is_refused() -> None:
    pytest.importorskip("OCP")
    solid = Path(__file__).parents[3] / "examples" / "stepped_plate.step"
    with pytest.raises(OptionError, match="--thickness is 3 mm, but the solid is 38 mm high; give --thickness"):
        leafcut.part(solid, **FAST)


@pytest.mark.hazard
def test_a_mill_with_round_corners_goes_below_the_plate_by_their_radius(tmp_path: Path) -> None:
    (tmp_path / "tools.toml").write_text(f'{TOOLS.format(peck="")}corner_radius = "1 mm"')
    options = {"thickness": THICKNESS, "tools": tmp_path / "tools.toml", "preset": "fast", "threads": 1}
    with pytest.raises(PlanError, match=r"corner radius of 1 mm .* give --break-through 1mm or more"):
        leafcut.part(drawing(tmp_path, OUTLINE), **options)
    outcome = leafcut.part(drawing(tmp_path, OUTLINE), break_through=1.0, **options)
    assert outcome.path_after.end[:, 2][outcome.path_after.kind == Kind.FEED].min() == -THICKNESS - 1.0


@pytest.mark.hazard
def test_the_holder_of_a_tool_stays_above_the_plate(tmp_path: Path) -> None:
    """The mill stands out by 3 mm and has to reach 3.5 mm; the drill stands out by 4 mm and has to reach 4.401 mm."""
    tools, source = tmp_path / "tools.toml", drawing(tmp_path, OUTLINE, circles=((20.0, 20.0, 1.5),))
    options = {"thickness": THICKNESS, "tools": tools, "preset": "fast", "threads": 1}
    tools.write_text(f'{TOOLS.format(peck="")}stickout = "3 mm"')
    with pytest.raises(PlanError, match=r"cuts 3 mm deep at most, but 3.5 mm are needed"):
        leafcut.part(source, **options)
    for stickout, holes in ((4.0, 0), (4.5, 1)):
        tools.write_text(TOOLS.format(peck=f'stickout = "{stickout} mm"'))
        assert leafcut.part(source, **options).detail.holes == holes


NOTCH = [(0, 0), (80, 0), (80, 50), (42, 50), (42, 30), (39, 30), (39, 50), (0, 50)]
KEYHOLE = [(10, 10), (40, 10), (40, 20), (55, 20), (55, 23), (40, 23), (40, 40), (10, 40)]
TRIANGLE = [(10, 10), (50, 10), (30, 10 + 20 * 3**0.5)]


@pytest.mark.hazard
@pytest.mark.parametrize(
    "outlines, missing", [([NOTCH], 1), ([OUTLINE, KEYHOLE], 1), ([OUTLINE, TRIANGLE], 0), ([OUTLINE, WINDOW], 0)]
)
def test_a_notch_or_slot_narrower_than_the_mill_is_named_as_missing_work(
    outlines: list[list[tuple[float, float]]], missing: int, tmp_path: Path
) -> None:
    """The notch and the slot are 3 mm wide, and the mill has 4 mm. It leaves its radius in corners."""
    outcome = leafcut.part(drawing(tmp_path, *outlines), **FAST)
    assert sum(issue.missing.count for issue in outcome.issues if issue.missing is not None) == missing


def test_the_place_of_a_narrow_gap_is_named(tmp_path: Path) -> None:
    """The notch goes from (39, 30) to (42, 50)."""
    outcome = leafcut.part(drawing(tmp_path, NOTCH), **FAST)
    (issue,) = [issue for issue in outcome.issues if issue.missing is not None]
    x, y = (float(word) for word in issue.place.split("(")[1].split(")")[0].split(", "))
    assert 39 <= x <= 42 and 30 <= y <= 50


@pytest.mark.hazard
def test_tabs_that_reach_the_edge_of_the_sheet_are_refused(tmp_path: Path) -> None:
    """The mill of 4 mm cuts away the margin of the sheet, and a tab of 6 mm needs 3 mm more."""
    for margin, held in ((3.0, False), (6.0, False), (8.0, True)):
        x, y = -margin, -margin
        document = ezdxf.readfile(drawing(tmp_path, OUTLINE))
        sheet = [(x, y), (80 - x, y), (80 - x, 60 - y), (x, 60 - y)]
        document.modelspace().add_lwpolyline(sheet, close=True, dxfattribs={"layer": "SHEET"})
        document.saveas(tmp_path / "part.dxf")
        if held:
            assert leafcut.part(tmp_path / "part.dxf", **FAST).detail.tabs == 4
        else:
            with pytest.raises(PlanError, match="apart and 7 mm from the edge"):
                leafcut.part(tmp_path / "part.dxf", **FAST)


@pytest.mark.parametrize("choice", ["cut", "mark"])
def test_an_open_path_cannot_be_milled(choice: str, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="--open-paths drop"):
        leafcut.part(drawing(tmp_path, OUTLINE), open_paths=choice, **FAST)


@pytest.mark.hazard
@pytest.mark.parametrize("flat, holes", [(0.0, 1), (0.5, 0)])
def test_a_bore_with_a_flat_is_milled_and_not_drilled(flat: float, holes: int, tmp_path: Path) -> None:
    """The flat lies at 45°, so that the bore of 20 mm is equally wide in X and in Y."""
    (tmp_path / "tools.toml").write_text(TOOLS.format(peck="").replace("3 mm", "20 mm"))
    half = np.arccos(1.0 - flat / 10.0)
    angles = np.pi / 4 + np.linspace(half, 2.0 * np.pi - half, 73)[: None if flat else -1]
    bore = [(30.0 + 10.0 * np.cos(angle), 25.0 + 10.0 * np.sin(angle)) for angle in angles]
    source = drawing(tmp_path, OUTLINE, bore)
    outcome = leafcut.part(source, thickness=THICKNESS, tools=tmp_path / "tools.toml", preset="fast", threads=1)
    assert (outcome.detail.holes, outcome.detail.openings) == (holes, 1 - holes)


RECIPE = """
[[hole]]
diameter = "8 mm"
layer = "M8*"
steps = [4]
"""


@pytest.mark.hazard
def test_a_hole_with_a_recipe_is_not_milled_but_named_as_missing_work(tmp_path: Path) -> None:
    """A thread of 8 mm, milled to 8 mm, would spoil the part; the circle on another layer has no recipe."""
    (tmp_path / "tools.toml").write_text(TOOLS.format(peck="") + RECIPE)
    source = drawing(tmp_path, OUTLINE, circles=((20.0, 20.0, 4.0), (60.0, 20.0, 4.0)))
    document = ezdxf.readfile(source)
    document.modelspace().query("CIRCLE")[0].dxf.layer = "M8-tapped"
    document.saveas(source)
    outcome = leafcut.part(source, thickness=THICKNESS, tools=tmp_path / "tools.toml", preset="fast", threads=1)
    (missing,) = [issue.missing for issue in outcome.issues if issue.missing is not None]
    assert (missing.what, missing.count, outcome.detail.openings) == ("hole", 1, 1)
    cut = outcome.path_after.end[outcome.path_after.end[:, 2] < 0.0]
    assert np.hypot(*(cut[:, :2] - (20.0, 20.0)).T).min() > 15.0


@pytest.mark.hazard
def test_an_edge_in_a_gap_narrower_than_the_mill_is_named_and_not_milled(tmp_path: Path) -> None:
    """A part of 33 mm in an opening of 40 mm, 3.5 mm from its edge; the mill has 4 mm."""
    squares = [[(a, a), (100 - a, a), (100 - a, 100 - a), (a, 100 - a)] for a in (0.0, 30.0, 33.5)]
    outcome = leafcut.part(drawing(tmp_path, *squares), tabs=0, **FAST)
    missing = [(issue.missing.what, issue.missing.count) for issue in outcome.issues if issue.missing is not None]
    assert missing == [("edge", 2)] and outcome.detail.outlines == 1 and outcome.detail.openings == 0


def test_parts_closer_than_the_mill_are_named(tmp_path: Path) -> None:
    squares = [[(x, 0), (x + 50, 0), (x + 50, 50), (x, 50)] for x in (0.0, 53.0)]
    with pytest.raises(
        OptionError,
        match=r"the program does not mill 2 edges closer to another edge than the diameter of the mill, 4 mm.*\(51.5, "
        r".*move them",
    ):
        leafcut.part(drawing(tmp_path, *squares), **FAST)


@pytest.mark.parametrize("rule", ["profile", "engrave 0.3mm"])
@pytest.mark.parametrize("units", ["mm", "inch"])
def test_steps_of_a_drawing_finer_than_the_program_are_merged(rule: str, units: str, tmp_path: Path) -> None:
    """Corners of exported letters have points a few micrometres apart."""
    fine = [(40.0 + step, 60.0 - step / 4) for step in (0.00003, 0.0002, 0.0007, 0.0015, 0.003, 0.006)]
    source = drawing(tmp_path, [(0, 0), (80, 0), (80, 50), *reversed(fine), (40, 60), (0, 50)])
    (tmp_path / "rules.toml").write_text(f'[layer]\n"0" = "{rule}"\n')
    outcome = leafcut.part(source, operations=tmp_path / "rules.toml", output_units=units, **FAST)
    ends = outcome.written.end[outcome.written.kind == Kind.FEED][:, :2]
    assert np.hypot(*np.diff(ends, axis=0).T)[1:].max() > 1.0


@pytest.mark.hazard
def test_edges_inside_an_edge_are_milled_before_it(tmp_path: Path) -> None:
    """A part lies in the window of another part; the order of the drawing is the reverse."""
    squares = [[(a, a), (100 - a, a), (100 - a, 100 - a), (a, 100 - a)] for a in (0, 20, 35)]
    outcome = leafcut.part(drawing(tmp_path, *squares), tabs=0, **FAST)
    path = outcome.path_after
    cut = path.end[(path.end[:, 2] < 0.0) & (path.kind == 1)]
    distance = np.abs(cut[:, :2] - 50.0).max(axis=1)
    reached = [float(np.flatnonzero(np.abs(distance - half) < 0.01).mean()) for half in (17.0, 28.0, 52.0)]
    assert reached == sorted(reached)


def test_the_report_of_a_part_with_open_lines_is_written(tmp_path: Path) -> None:
    """Only closed outlines of missing work are hatched."""
    source = drawing(tmp_path, OUTLINE, circles=((20, 20, 1),))
    document = ezdxf.readfile(source)
    document.layers.add("MARK")
    document.modelspace().add_line((30, 30), (50, 30), dxfattribs={"layer": "MARK"})
    document.saveas(source)
    outcome = leafcut.part(source, tmp_path / "part.ngc", report=tmp_path / "part.html", **FAST)
    line, opening = (issue.missing for issue in outcome.missing)
    assert line is not None and opening is not None
    assert (line.count, len(line.where), line.outlines) == (1, 1, ())
    assert (opening.count, len(opening.outlines)) == (1, 1)
    assert "does not mill" in (tmp_path / "part.html").read_text()


def test_tabs_are_at_most_half_as_high_as_the_plate_unless_their_height_is_given(tmp_path: Path) -> None:
    def moves_level_at(height: float, **options: Any) -> bool:
        path = leafcut.part(drawing(tmp_path, OUTLINE), **FAST | options).written
        z = path.end[path.kind == Kind.FEED][:, 2]
        return bool(np.isclose(z[1:][z[1:] == z[:-1]], height).any())

    assert moves_level_at(-0.6, thickness=1.2)
    assert moves_level_at(-4.5, thickness=6.0)
    assert moves_level_at(-0.2, thickness=1.2, tab_height=1.0) and not moves_level_at(-0.2, thickness=1.2)


def test_a_material_without_cutting_data_is_refused_unless_feed_and_speed_are_given(tmp_path: Path) -> None:
    source, options = drawing(tmp_path, OUTLINE), {k: v for k, v in FAST.items() if k != "feed"}
    for given in ({}, {"feed": "600mm/min"}, {"spindle_speed": 5000}):
        with pytest.raises(
            OptionError, match="no cutting data of end mills for 'plywood', only for mild-steel, stainless-304"
        ):
            leafcut.part(source, material="plywood", **options, **given)
    leafcut.part(source, material="plywood", feed="600mm/min", spindle_speed=5000, **options)


@pytest.mark.parametrize(("name", "same"), [("aluminum", "aluminium"), ("Aluminium 6061", "aluminium")])
def test_names_of_one_material_have_the_same_cutting_data(name: str, same: str, tmp_path: Path) -> None:
    source, options = drawing(tmp_path, OUTLINE), {k: v for k, v in FAST.items() if k != "feed"}
    tools = [leafcut.part(source, material=word, **options).to_dict()["tools"] for word in (name, same)]
    assert tools[0] == tools[1]


def test_thickness_and_mill_are_asked_for_together(tmp_path: Path) -> None:
    source = drawing(tmp_path, OUTLINE, WINDOW)
    with pytest.raises(OptionError, match="the plate thickness and the end mill are missing"):
        leafcut.part(source, machine="shapeoko-router")
    with pytest.raises(OptionError, match="give --thickness, such as") as refused:
        leafcut.optimize(source, machine="shapeoko-router", tool_diameter=3.0)
    assert refused.value.__notes__ == ["leafcut part was chosen for this input; name another command if that is wrong"]
