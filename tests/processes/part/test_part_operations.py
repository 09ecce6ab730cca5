"""Operations by layer: the material after the program is the drawing, and files that do not suit it are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

import leafcut
from leafcut.errors import LeafcutError, PlanError
from leafcut.model.toolpath import Kind
from leafcut.processes.part.report import PartReport
from leafcut.report.page import report_page_html
from rs274_moves import run_rs274

EXAMPLES = Path(__file__).parents[3] / "examples"
NAMEPLATE = EXAMPLES / "nameplate.dxf"
THICKNESS, DIAMETER, CELL = 6.0, 3.0, 0.2
FAST = {"thickness": THICKNESS, "preset": "fast", "threads": 1}
MILL = {"tool_diameter": DIAMETER, "feed": "600mm/min", "spindle_speed": 5000, "step_down": 1.5}
RULES = """[layer]
"OUTLINE" = "profile"
"TEXT" = "engrave 0.3mm"
"HOLES" = "bore"
"POCKET_3" = "pocket 3mm"
"NOTES" = "ignore"
"""
TOOLS = """
[[tool]]
number = 4
diameter = "5 mm"
spindle_speed = "2000 rpm"
feed = "300 mm/min"
[[tool]]
number = 5
kind = "end-mill"
diameter = "1 mm"
spindle_speed = "6000 rpm"
feed = "300 mm/min"
[[tool]]
number = 7
kind = "end-mill"
diameter = "3 mm"
spindle_speed = "5000 rpm"
feed = "600 mm/min"
"""


def milled(folder: Path, rules: str = RULES, **options: Any) -> leafcut.ProgramResult:
    (folder / "rules.toml").write_text(rules)
    return leafcut.part(NAMEPLATE, folder / "part.ngc", operations=folder / "rules.toml", **{**FAST, **MILL, **options})


def with_tools(folder: Path, rules: str = RULES) -> leafcut.ProgramResult:
    (folder / "tools.toml").write_text(TOOLS)
    options = {"tools": folder / "tools.toml", "tool_number": 7, "step_down": 1.5}
    (folder / "rules.toml").write_text(rules)
    return leafcut.part(NAMEPLATE, folder / "part.ngc", operations=folder / "rules.toml", **FAST, **options)


def field_after(program: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return X and Y of the cells, and the heights of the material after a program."""
    field = leafcut.stock(program, workpiece="-6,-6,-7,86,56,0", cell=CELL, tool_diameter=DIAMETER).field
    rows, columns = field.heights.shape
    x, y = np.meshgrid(field.x + CELL * np.arange(columns), field.y + CELL * np.arange(rows))
    return x, y, field.heights


def drawn(layer: str) -> list[Any]:
    """Return the closed shapes of a layer of the name plate, as ezdxf draws them."""
    shapes = []
    for entity in ezdxf.readfile(NAMEPLATE).modelspace().query(f'*[layer=="{layer}"]'):
        path = ezdxf.path.make_path(entity)
        shapes.append(shapely.Polygon([(v.x, v.y) for v in path.flattening(0.002)]))
    return shapes


def pocket() -> Any:
    """Return the area of the pocket without its island."""
    outline, island = sorted(drawn("POCKET_3"), key=lambda shape: -shape.area)
    return outline - island


def letters() -> Any:
    """Return the engraved lines: an L, a C open to the right, and an O."""
    angles = np.radians(np.linspace(45.0, 315.0, 200))
    return shapely.union_all(
        [
            shapely.LineString([(18, 44), (18, 36), (23, 36)]),
            shapely.LineString(np.column_stack([32 + 4 * np.cos(angles), 40 + 4 * np.sin(angles)])),
            shapely.Point(45, 40).buffer(4, quad_segs=128).exterior,
        ]
    )


@pytest.mark.hazard
@pytest.mark.parametrize("finish", [0.0, 0.3])
def test_the_material_after_the_program_is_the_drawing(finish: float, tmp_path: Path) -> None:
    """Cells within a cell of an edge are not compared. Tabs lie in the path around the outline alone."""
    milled(tmp_path, rules=RULES.replace("0.3mm", "0.8mm"), tabs=0, finish=finish)
    x, y, heights = field_after(tmp_path / "part.ngc")
    outline, window = sorted(drawn("OUTLINE"), key=lambda shape: -shape.area)
    slug = window.buffer(-DIAMETER - finish)
    regions = {
        -THICKNESS: [
            outline.buffer(DIAMETER + finish, quad_segs=64) - outline,
            window.buffer(-0.5 * DIAMETER).buffer(0.5 * DIAMETER, quad_segs=64) - slug,
            *drawn("HOLES"),
        ],
        -0.8: [letters().buffer(0.5 * DIAMETER, quad_segs=64)],
        -3.0: [pocket().buffer(-0.5 * DIAMETER).buffer(0.5 * DIAMETER, quad_segs=64)],
    }
    touched = np.zeros(heights.shape, dtype=bool)
    for height, shapes in regions.items():
        for shape in shapes:
            own = shapely.contains_xy(shape.buffer(-CELL), x, y)
            touched |= shapely.contains_xy(shape.buffer(CELL), x, y)
            assert own.any()
            reached = np.round(heights[own], 3)
            assert (reached <= height if height == -THICKNESS else reached == height).all(), shape
    assert (heights[~touched] == 0.0).all()


@pytest.mark.hazard
def test_each_path_is_engraved_once_before_the_outline(tmp_path: Path) -> None:
    outcome = with_tools(tmp_path, RULES.replace("0.3mm", "0.3mm T5"))
    path = outcome.written
    assert [operation.tool.number for operation in outcome.operations] == [4, 5, 7]
    cut = np.isin(path.kind, [Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW])
    engraved = cut & (path.end[:, 2] == -0.3) & (path.before[:, 2] == -0.3)
    through = cut & (path.end[:, 2] < -THICKNESS)
    assert np.flatnonzero(engraved).max() < np.flatnonzero(through).min()
    assert outcome.after.cut_mm > letters().length
    ends = {
        tuple(sorted([tuple(start), tuple(end)]))
        for start, end in zip(
            path.before[engraved][:, :2].round(3).tolist(), path.end[engraved][:, :2].round(3).tolist(), strict=True
        )
    }
    assert len(ends) == engraved.sum()


def test_the_report_lists_the_work_of_each_layer(tmp_path: Path) -> None:
    outcome = with_tools(tmp_path, RULES.replace("0.3mm", "0.3mm T5"))
    works = {row.layer: (row.shapes, row.operation, row.depth, row.tool[:2]) for row in outcome.detail.layers}
    assert works == {
        "OUTLINE": (2, "profile", 6.5, "T7"),
        "POCKET_3": (1, "pocket", 3.0, "T7"),
        "TEXT": (3, "engrave", 0.3, "T5"),
        "HOLES": (4, "drill", 6.5, "T4"),
        "NOTES": (1, "ignore", 0.0, ""),
    }
    page = report_page_html(PartReport(outcome))
    assert all(
        f'<th scope="row"><bdi>{layer}</bdi></th><td class="n">{works[layer][0]}</td>' in page for layer in works
    )


@pytest.mark.hazard
def test_holes_without_a_drill_are_bored_and_leave_no_slug(tmp_path: Path) -> None:
    outcome = milled(tmp_path)
    assert ("HOLES", "bore") in {(row.layer, row.operation) for row in outcome.detail.layers}
    assert sum("slug" in str(issue) for issue in outcome.issues) == 1  # the window


def test_a_layer_of_profiles_is_milled_even_if_the_library_has_the_drill(tmp_path: Path) -> None:
    outcome = with_tools(tmp_path, RULES.replace('"bore"', '"profile"'))
    assert [operation.tool.number for operation in outcome.operations] == [7]


def test_lines_that_two_drawn_paths_share_are_engraved_for_both(tmp_path: Path) -> None:
    """Letters and their shadow have common lines; the squares share a side."""
    source = rectangles(tmp_path, OUTLINE=(0, 0, 60, 50), A=(10, 10, 25, 30), B=(25, 10, 40, 30), C=(10, 10, 25, 20))
    (tmp_path / "rules.toml").write_text('[layer]\n"OUTLINE" = "profile"\n"?" = "engrave 0.3mm"\n')
    outcome = leafcut.part(source, operations=tmp_path / "rules.toml", **FAST, **MILL)
    assert [row.shapes for row in outcome.detail.layers] == [1, 1, 1, 1]


def test_deep_engraving_takes_several_passes(tmp_path: Path) -> None:
    outcome = milled(tmp_path, RULES.replace("0.3mm", "2.5mm"))
    assert {-1.25, -2.5} <= set(outcome.written.end[:, 2].round(3).tolist())


@pytest.mark.hazard
def test_a_pocket_is_cleared_within_its_walls_before_the_outline(tmp_path: Path) -> None:
    path = milled(tmp_path).written
    cut = np.isin(path.kind, [Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW])
    floor = np.flatnonzero(cut & (path.end[:, 2] == -3.0) & (path.before[:, 2] == -3.0))
    outside = shapely.distance(pocket(), shapely.points(path.end[floor][:, :2]))
    from_wall = shapely.distance(pocket().boundary, shapely.points(path.end[floor][:, :2]))
    assert outside.max() == 0.0 and from_wall.min() >= 0.5 * DIAMETER - 0.02
    x, y = path.end[:, 0], path.end[:, 1]
    around = np.flatnonzero(cut & (path.end[:, 2] < 0.0) & ((x < 0.0) | (x > 80.0) | (y < 0.0) | (y > 50.0)))
    assert floor.max() < around.min()


def test_an_opening_in_a_pocket_is_milled_through_its_floor(tmp_path: Path) -> None:
    source = rectangles(tmp_path, OUTLINE=(0, 0, 60, 50), POCKET=(10, 10, 50, 40), HOLES=(20, 20, 40, 30))
    rules = '[layer]\n"OUTLINE" = "profile"\n"HOLES" = "profile"\n"POCKET" = "pocket 3mm"\n'
    (tmp_path / "rules.toml").write_text(rules)
    options = {"operations": tmp_path / "rules.toml", "tabs": 2, "tab_width": 3, **FAST, **MILL}
    outcome = leafcut.part(source, **options)
    assert (outcome.detail.openings, outcome.detail.tabs) == (1, 4)
    with pytest.raises(LeafcutError, match=r"is so deep that the tabs of .* would be thinner than 4 mm"):
        leafcut.part(source, tab_height=4, **options)


@pytest.mark.hazard
def test_openings_in_a_pocket_are_milled_after_it(tmp_path: Path) -> None:
    """The mill enters each opening above the floor of the pocket."""
    source = rectangles(
        tmp_path, OUTLINE=(0, 0, 80, 60), POCKET=(10, 10, 70, 50), A=(18, 20, 33, 40), B=(45, 20, 60, 40)
    )
    rules = '[layer]\n"OUTLINE" = "profile"\n"?" = "profile"\n"POCKET" = "pocket 3mm"\n'
    (tmp_path / "rules.toml").write_text(rules)
    outcome = leafcut.part(source, operations=tmp_path / "rules.toml", tabs=0, **FAST, **MILL)
    path = outcome.written
    level = (path.kind == Kind.FEED) & (path.before[:, 2] == path.end[:, 2])
    floor, through = (np.flatnonzero(level & (path.end[:, 2] == z)) for z in (-3.0, -6.5))
    assert outcome.detail.openings == 2 and floor.max() < through.min()


def rectangles(folder: Path, **by_layer: tuple[float, float, float, float]) -> Path:
    """Return a drawing with a rectangle on each layer: x and y of two corners."""
    document = ezdxf.new(units=4)
    for layer, (x0, y0, x1, y1) in by_layer.items():
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    document.saveas(folder / "drawing.dxf")
    return folder / "drawing.dxf"


@pytest.mark.hazard
@pytest.mark.parametrize("wall, refused", [(0.0, True), (1.4, True), (1.6, False)])
def test_a_deep_pocket_leaves_a_wall_for_the_tabs(wall: float, refused: bool, tmp_path: Path) -> None:
    """A tab 1.5 mm high would hang on a floor of 0.5 mm."""
    source = rectangles(tmp_path, OUTLINE=(0, 0, 60, 50), POCKET=(wall, 10, 50, 40))
    file = tmp_path / "rules.toml"
    file.write_text('[layer]\n"OUTLINE" = "profile"\n"POCKET" = "pocket 5.5mm"\n')
    if refused:
        with pytest.raises(LeafcutError, match=r"so deep that the tabs of outline .* would be thinner than 1.5 mm"):
            leafcut.part(source, operations=file, **FAST, **MILL)
        return
    assert leafcut.part(source, operations=file, **FAST, **MILL).detail.tabs == 4


@pytest.mark.hazard
def test_a_step_at_the_edge_is_a_pocket_that_crosses_the_outline(tmp_path: Path) -> None:
    """The step is cleared up to the edge of the part; the material beside it keeps its height."""
    source = rectangles(tmp_path, OUTLINE=(0, 0, 60, 50), STEP=(50, -5, 66, 55))
    (tmp_path / "rules.toml").write_text('[layer]\n"OUTLINE" = "profile"\n"STEP" = "pocket 2mm"\n')
    leafcut.part(source, tmp_path / "part.nc", operations=tmp_path / "rules.toml", **FAST, **MILL)
    x, y, heights = field_after(tmp_path / "part.nc")
    part = (x > CELL) & (x < 60 - CELL) & (y > CELL) & (y < 50 - CELL)
    step = part & (x > 50 + CELL)
    assert (np.round(heights[step], 3) == -2.0).all()
    assert (heights[part & (x < 50 - CELL)] == 0.0).all()


@pytest.mark.parametrize("pocket, island", [((10, 10, 40, 20), (25, 14.25, 3)), ((10, 10, 40, 13), None)])
def test_a_pocket_with_a_passage_as_wide_as_the_mill_or_narrower_is_milled(
    pocket: tuple[float, float, float, float], island: tuple[float, float, float] | None, tmp_path: Path
) -> None:
    """The island leaves a gap of 2.75 mm, and the slot is 3 mm wide."""
    source = rectangles(tmp_path, OUTLINE=(0, 0, 60, 50), POCKET=pocket)
    if island:
        document = ezdxf.readfile(source)
        document.modelspace().add_circle(island[:2], island[2], dxfattribs={"layer": "POCKET"})
        document.saveas(source)
    (tmp_path / "rules.toml").write_text('[layer]\n"OUTLINE" = "profile"\n"POCKET" = "pocket 2mm"\n')
    outcome = leafcut.part(source, operations=tmp_path / "rules.toml", **FAST, **MILL)
    assert {row.operation for row in outcome.detail.layers} == {"profile", "pocket"}


def test_a_text_on_a_layer_of_pockets_is_reported(tmp_path: Path) -> None:
    source = rectangles(tmp_path, OUTLINE=(0, 0, 60, 50), POCKET=(5, 5, 30, 30))
    document = ezdxf.readfile(source)
    document.modelspace().add_text("ABO", height=8, dxfattribs={"layer": "POCKET"}).set_placement((35, 5))
    document.saveas(source)
    (tmp_path / "rules.toml").write_text('[layer]\n"OUTLINE" = "profile"\n"POCKET" = "pocket 2mm"\n')
    outcome = leafcut.part(source, operations=tmp_path / "rules.toml", **FAST, **MILL)
    assert [issue.message for issue in outcome.issues if issue.code == "L210"] == [
        "texts are engraved only on mark layers; the program leaves out 1 on layer POCKET"
    ]


def test_a_pocket_in_the_slug_of_an_opening_is_refused(tmp_path: Path) -> None:
    source = rectangles(tmp_path, OUTLINE=(0, 0, 80, 60), WINDOW=(10, 10, 70, 50), POCKET=(20, 20, 60, 40))
    file = tmp_path / "rules.toml"
    file.write_text('[layer]\n"OUTLINE" = "profile"\n"WINDOW" = "profile"\n"POCKET" = "pocket 3mm"\n')
    with pytest.raises(LeafcutError, match=r"the pocket at \(20, 20\) on layer POCKET lies outside the parts"):
        leafcut.part(source, operations=file, **FAST, **MILL)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "shape, rule, words",
    [
        (
            (20, 20, 40, 30),
            "pocket 2mm",
            r"rules.toml:4: the pocket at .* on layer B overlaps the pocket at .* layer A",
        ),
        ((20, 20, 40, 30), "engrave 1mm", r"path at .* on layer B would be engraved in the pocket at .* on layer A"),
        (
            (70, 10, 90, 40),
            "pocket 3mm",
            "the pocket at .*on layer B lies outside the parts; move it, or choose 'ignore' for",
        ),
        ((25, 42, 27, 46), "pocket 2mm", r"the pocket at .* on layer B is narrower than the mill of 3 mm"),
    ],
)
def test_shapes_that_contradict_each_other_are_refused(
    shape: tuple[float, float, float, float], rule: str, words: str, tmp_path: Path
) -> None:
    source = rectangles(tmp_path, OUTLINE=(0, 0, 60, 50), A=(10, 10, 50, 40), B=shape)
    file = tmp_path / "rules.toml"
    file.write_text(f'[layer]\n"OUTLINE" = "profile"\n"A" = "pocket 3mm"\n"B" = "{rule}"\n')
    with pytest.raises(LeafcutError, match=words):
        leafcut.part(source, tmp_path / "part.ngc", operations=file, **FAST, **MILL)
    assert not (tmp_path / "part.ngc").exists()


def test_wildcards_name_the_other_layers(tmp_path: Path) -> None:
    exact = milled(tmp_path)
    other = milled(
        tmp_path,
        '[layer]\nOUTLINE = "profile"\ntext = "engrave 0.3mm"\n"H*" = "bore"\n"P*" = "pocket 3mm"\n"N*" = "ignore"',
    )
    np.testing.assert_array_equal(other.path_after.end, exact.path_after.end)


def test_a_name_with_brackets_is_the_name_of_a_layer(tmp_path: Path) -> None:
    source = rectangles(tmp_path, **{"OUTLINE": (0, 0, 60, 50), "P[3]": (10, 10, 30, 40), "P3": (35, 10, 50, 40)})
    file = tmp_path / "rules.toml"
    file.write_text('[layer]\n"OUTLINE" = "profile"\n"P[3]" = "pocket 3mm"\n"P3" = "pocket 2mm"\n')
    outcome = leafcut.part(source, operations=file, **FAST, **MILL)
    assert {(row.layer, row.depth) for row in outcome.detail.layers} >= {("P[3]", 3.0), ("P3", 2.0)}


@pytest.mark.hazard
@pytest.mark.parametrize(
    "old, new, words",
    [
        ('"OUTLINE"', '"OUTLIN"', "rules.toml:2: no shape of nameplate.dxf is on layer 'OUTLIN'; did you mean 'OUTL"),
        ('"profile"', '"mill"', "rules.toml:2: unknown operation 'mill'; choose one of profile, bore"),
        ('"profile"', "3", "rules.toml:2: '3' is not an operation"),
        ('"profile"', '"profile 3mm"', "rules.toml:2: 'profile' takes no depth; leave out '3mm'"),
        ('"bore"', '"bore T3"', "rules.toml:4: 'bore' takes no tool"),
        ("engrave 0.3mm", "engrave", "rules.toml:3: 'engrave' needs a depth, such as 'engrave 0.3mm'"),
        ("0.3mm", "0.3 miles", "rules.toml:3: "),
        ("0.3mm", "-0.3mm", "rules.toml:3: a depth of -0.3 mm is not below the top"),
        ("0.3mm", "0.001mm", "rules.toml:3: a depth of 0.001 mm is below the minimum of 0.01 mm"),
        ("0.3mm", "6mm", "rules.toml:3: a depth of 6 mm goes through the plate of 6 mm"),
        ("0.3mm", "0.3mm T5", "rules.toml:3: T5 needs a tool library; give --tools"),
        ('"NOTES" = "ignore"\n', "", "rules.toml: layer 'NOTES' of nameplate.dxf has no operation; add \"NOTES\" = "),
        ('"NOTES"', '"NOTES*" = "ignore"\n"N*"', "rules.toml:7: layer 'NOTES' is already named by 'NOTES*'"),
        ('"NOTES"', '"text" = "ignore"\n"NOTES"', "rules.toml:6: layer 'TEXT' is already named by 'TEXT'"),
        ("engrave 0.3mm", "profile", "rules.toml:3: 'profile' needs closed shapes, but layer 'TEXT' has an open path"),
        ('"OUTLINE" = "profile"', '"OUTLINE" = "bore"', "rules.toml:2: the shape at (5, 0) is not round, so"),
        ("[layer]", "[layers]", "rules.toml:1: unknown key 'layers'; did you mean 'layer'?"),
        ("[layer]", "[POCKET_3]", "rules.toml:1: unknown key 'POCKET_3'; write a table [layer] with lines such as"),
        (RULES, '[layer]\n"*" = "ignore"', "nameplate: there is nothing to mill, because --operations ignores"),
        (RULES, "[layer]\n", "rules.toml: no layer has an operation; write a table [layer]"),
        (RULES, '[layer]\n"TEXT" = "engrave 1mm"\n"TEXT" = "bore"', "rules.toml: not a TOML file"),
    ],
)  # fmt: skip
def test_a_file_that_does_not_suit_is_refused_in_one_line(old: str, new: str, words: str, tmp_path: Path) -> None:
    assert old in RULES
    with pytest.raises(LeafcutError) as refused:
        milled(tmp_path, RULES.replace(old, new))
    message = str(refused.value).replace(f"{tmp_path}/", "")
    assert words in message and "\n" not in message
    assert not (tmp_path / "part.ngc").exists()


@pytest.mark.parametrize("tool, words", [(9, "has no T9"), (4, "is a drill, not a milling tool")])
def test_a_tool_that_cannot_engrave_is_refused(tool: int, words: str, tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match=rf"rules.toml:3: .*{words}"):
        with_tools(tmp_path, RULES.replace("0.3mm", f"0.3mm T{tool}"))


def test_options_that_the_file_replaces_are_refused_with_it(tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match="--ignore-layers: not used with --operations"):
        milled(tmp_path, ignore_layers="NOTES")


@pytest.mark.parametrize("dialect", ["linuxcnc", "grbl"])
def test_linuxcnc_accepts_the_name_plate(rs274: str, dialect: str, tmp_path: Path) -> None:
    text = milled(tmp_path, dialect=dialect).text
    status, said = run_rs274(rs274, text, tmp_path)
    assert status == 0, said[-500:]


@pytest.mark.parametrize(
    "layer, name", [("OUTLINE", "outline"), ("HOLES", "opening"), ("TEXT", "path"), ("POCKET_3", "pocket")]
)
def test_a_clamp_on_the_work_is_refused_before_the_search(layer: str, name: str, tmp_path: Path) -> None:
    """The clamp is 0.2 mm wide, and lies on the middle of the first line of a layer."""
    line = shapely.get_geometry(letters(), 0) if layer == "TEXT" else drawn(layer)[0].exterior
    x, y = np.mean(line.coords[:2], axis=0)
    steps: list[str] = []
    with pytest.raises(PlanError, match=f"{name} at .* is in the keep-out zone") as refused:
        milled(
            tmp_path,
            keep_out=f"{x - 0.1} {y - 0.1} {x + 0.1} {y + 0.1} 5",
            progress=lambda progress: steps.append(str(progress.step)),
        )
    assert "move the clamp" in str(refused.value)
    assert {*steps} == {"reading"}


@pytest.mark.hazard
def test_a_pocket_that_is_milled_through_the_plate_is_reported(tmp_path: Path) -> None:
    def warnings(**options: Any) -> list[str]:
        issues = leafcut.part(tmp_path / "plate.dxf", **FAST, **MILL, **options).issues
        return [issue.message for issue in issues if issue.code == "L418"]

    drawing = ezdxf.new(units=ezdxf.units.MM)
    for (x0, y0, x1, y1), layer in (((0, 0, 60, 40), "OUTLINE"), ((10, 10, 30, 30), "Pocket_1")):
        corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
        drawing.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": layer})
    drawing.saveas(tmp_path / "plate.dxf")
    [words] = warnings()
    assert words.startswith("milled through the plate: 1 shape on layer 'Pocket_1', which is named for pockets")
    assert '"Pocket_1" = "pocket 3mm"' in words
    assert not warnings(cut_layers=["OUTLINE", "Pocket_1"])
    rules = tmp_path / "rules.toml"
    rules.write_text('[layer]\n"OUTLINE" = "profile"\n"Pocket_1" = "profile"\n')
    assert not warnings(operations=rules)
