"""The bytes of scenes, read here by nothing but their description."""

from __future__ import annotations

import json
import math
import struct
from pathlib import Path
from typing import Any

import pytest
from canvas_scenes import ARC_LINE, CUT_LINE, MACHINE, PART, PLACES, TEXT, grid_of_holes, grid_path, grid_program
from parts_to_nest import svg

from leafcut import api
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue
from leafcut.model.part import Hole, Part, Slot
from leafcut.model.pocket import Pocket
from leafcut.model.toolpath import Arc, Toolpath, ToolpathBuilder
from leafcut.studio.drawing.scene import outcome_scene, part_scene, pheromone_scene, toolpath_scene
from leafcut.studio.jobs.link import Link
from leafcut.studio.jobs.preview import read_preview
from leafcut.studio.jobs.run_job import run_task
from leafcut.studio.jobs.task import ReadyTask
from leafcut.timing.toolpath import measure_toolpath

_SIZES = {"f4": "f", "i4": "i", "u4": "I", "u1": "B"}


def unpacked(scene: bytes) -> tuple[dict[str, Any], dict[str, list[Any]]]:
    """Return the header and the blocks, each as rows (or numbers, where a row is one)."""
    magic, size, none = struct.unpack_from("<8sII", scene)
    assert magic == b"LCSCENE1" and size % 8 == 0 and none == 0
    header = json.loads(scene[16 : 16 + size])
    blocks = {}
    for name, (kind, offset, count, width) in header["blocks"].items():
        assert offset % 8 == 0
        numbers = struct.unpack_from(f"<{count}{_SIZES[kind]}", scene, 16 + size + offset)
        blocks[name] = list(numbers) if width == 1 else list(zip(*[iter(numbers)] * width, strict=True))
    return header, blocks


def test_a_part_has_its_holes_where_they_are() -> None:
    header, blocks = unpacked(grid_of_holes())
    ox, oy = header["origin"]
    assert [(x + ox, y + oy, d) for x, y, d in blocks["hole"]] == [(h.x, h.y, h.diameter) for h in PART.holes]
    assert header["extents"] == pytest.approx([10 - 5 / 2, 10 - 3.75 / 2, 70 + 5.75 / 2, 50 + 5.75 / 2])


def test_outlines_are_their_vertices_with_kind_closing_and_part() -> None:
    square = Polyline.of_points([(0, 0), (10, 0), (10, 10), (0, 10)], closed=True)
    line = Polyline.of_points([(2, 2), (4, 2)])
    pocket = Pocket(Polyline.circle(50, 50, 20), (Polyline.circle(50, 50, 5, clockwise=True),))
    part = Part("p", contours=(Contour(square, part=3), Contour(line, "mark")), pockets=(pocket,))
    header, blocks = unpacked(part_scene(part))
    ox, oy = header["origin"]
    assert [row[2:] for row in blocks["outline"]] == [(16, 3), (1, 0), (16 + 3, 1), (16 + 4, 1)]
    first, count = blocks["outline"][2][:2]
    circle = [(x + ox, y + oy, bulge) for x, y, bulge in blocks["vertex"][first : first + count]]
    assert circle == [(70.0, 50.0, 1.0), (30.0, 50.0, 1.0)]


def test_far_away_places_keep_their_thousandths() -> None:
    """float32 has seven digits: 5,000,000.001 mm is kept by the origin that is taken off."""
    part = Part("far", (Hole(5e6, 0.0, 1.0), Hole(5e6 + 0.001, 0.0, 1.0)))
    _, blocks = unpacked(part_scene(part))
    assert blocks["hole"][1][0] - blocks["hole"][0][0] == pytest.approx(0.001, rel=1e-4)


def test_issues_stand_at_the_places_and_handles_they_name() -> None:
    issues = (
        Issue("L311", "gaps", "at (1.5, -2) and (3e+02, 4)"),
        Issue("L203", "odd", "handle 2F"),
        Issue("L102", "units", ""),
    )
    part = Part("p", (Hole(7.0, 8.0, 1.0, handle="2F"),), (Slot((0, 0), (1, 0), 1.0),), issues)
    header, blocks = unpacked(part_scene(part))
    ox, oy = header["origin"]
    places = [(round(x + ox, 3), round(y + oy, 3), k) for x, y, k in blocks["issue"]]
    assert places == [(1.5, -2.0, 0.0), (300.0, 4.0, 0.0), (7.0, 8.0, 1.0)]
    assert [row[0] for row in header["issues"]] == ["L311", "L203", "L102"]


def test_a_toolpath_is_where_it_goes_row_by_row() -> None:
    header, blocks = unpacked(grid_program())
    ox, oy = header["origin"]
    stops = [blocks["place"][row - 1][:2] for row in blocks["stop"]]
    assert [(x + ox, y + oy) for x, y in stops] == [*PLACES, (0.0, 70.0)]
    assert [blocks["line"][row] for row in blocks["stop"]] == [*range(2, 14), CUT_LINE]
    assert bytes(blocks["text"]).decode() == TEXT
    assert sum(blocks["seconds"]) == pytest.approx(measure_toolpath(grid_path(), MACHINE).time_s, rel=1e-5)
    assert header["seconds"] == pytest.approx(measure_toolpath(grid_path(), MACHINE).time_s, rel=1e-12)


def test_an_arc_of_a_scene_ends_where_its_row_ends() -> None:
    _, blocks = unpacked(grid_program())
    (row,), (arc,) = blocks["arc_row"], blocks["arc"]
    x, y, radius, start, sweep = arc
    assert blocks["line"][row] == ARC_LINE and sweep == pytest.approx(math.pi)
    end = (x + radius * math.cos(start + sweep), y + radius * math.sin(start + sweep))
    assert end == pytest.approx(blocks["place"][row][:2], abs=1e-4)


def test_the_extents_have_what_of_an_arc_is_passed_and_no_more() -> None:
    """The half circle from (40, 70) round (60, 70), counter-clockwise, reaches y 50; the holes start at y 10."""
    path = ToolpathBuilder()
    path.rapid(40.0, 70.0, 2.0)
    path.arc(False, (80.0, 70.0, 2.0), Arc((60.0, 70.0, 0.0)), feed=10.0)
    header, _ = unpacked(toolpath_scene(path.build(), MACHINE))
    assert header["extents"] == pytest.approx([40.0, 50.0, 80.0, 70.0])


def test_nothing_is_a_scene_too() -> None:
    assert unpacked(part_scene(Part("empty")))[0]["extents"] is None
    header, blocks = unpacked(toolpath_scene(Toolpath.of_motions([]), MACHINE))
    assert header["extents"] is None and blocks["doing"] == []
    assert unpacked(pheromone_scene([], [], []))[0]["extents"] is None


def test_names_from_files_cannot_carry_control_characters() -> None:
    header, _ = unpacked(part_scene(Part("evil\x1b[2J</script>")))
    assert header["name"] == "evil\ufffd[2J</script>"


def test_pheromone_has_points_edges_and_strengths() -> None:
    header, blocks = unpacked(pheromone_scene([(0, 0), (10, 0), (10, 20)], [(0, 1), (1, 2)], [0.25, 1.0]))
    ox, oy = header["origin"]
    assert [(x + ox, y + oy) for x, y in blocks["point"]] == [(0, 0), (10, 0), (10, 20)]
    assert blocks["edge"] == [(0, 1), (1, 2)] and blocks["strength"] == [0.25, 1.0]


def test_a_map_without_a_unit_is_told_without_one(tmp_path: Path) -> None:
    """TSPLIB's coordinates are plain numbers: they have neither mm nor machine time."""
    file = tmp_path / "four.tsp"
    places = ["1 0 0", "2 30 0", "3 30 40", "4 0 40"]
    top = ["NAME: four", "TYPE: TSP", "DIMENSION: 4", "EDGE_WEIGHT_TYPE: EUC_2D", "NODE_COORD_SECTION"]
    file.write_text("\n".join([*top, *places, "EOF", ""]))
    seen = read_preview(str(file))
    assert seen.facts == (("points", "4"), ("size", "30 × 40"))
    assert unpacked(seen.scenes["part"])[0]["unitless"] is True
    made = run_task(Link(lambda _: None), ReadyTask("solve", (str(file),), "auto", {}), ("four.tsp",))
    assert unpacked(made.artefacts["scene-after"].data)[0]["unitless"] is True
    assert ReadyTask("solve", (str(file),), "auto", {}).objective_unit == ""


def test_a_size_is_told_without_powers_of_ten(tmp_path: Path) -> None:
    file = tmp_path / "far.csv"
    file.write_text("x,y\n0,0\n23456.7,0.5\n")
    assert dict(read_preview(str(file)).facts)["centres"] == "23,457 × 0.5 mm"


def test_a_size_is_that_of_outlines_or_else_between_centres() -> None:
    """For holes alone, the size of the plate is unknown."""
    plate = str(Path(__file__).parents[2] / "examples" / "plate_10.dxf")
    assert "centres" in dict(read_preview(plate, "drill").facts) and "size" not in dict(
        read_preview(plate, "drill").facts
    )
    assert "size" in dict(read_preview(plate, "cut").facts)


def test_what_a_search_costs_is_told_in_the_unit_of_what_is_made_small() -> None:
    assert ReadyTask("optimize", ("a.dxf",), "auto", {}).objective_unit == "s"
    assert ReadyTask("optimize", ("a.dxf",), "auto", {"objective": "distance"}).objective_unit == "mm"


def test_the_scene_of_a_pocket_holds_the_width_that_the_mill_clears(tmp_path: Path) -> None:
    drawing = tmp_path / "pocket.svg"
    drawing.write_bytes(svg(40, 30, '<path d="M5 5H35V25H5Z"/>'))
    outcome = api.optimize(str(drawing), process="pocket", tool_diameter="16", depth="2", strategy="contour")
    assert unpacked(outcome_scene(outcome, "after"))[0]["cleared"] == 16.0
    assert unpacked(grid_program())[0].get("cleared", 0.0) == 0.0


def test_the_path_over_one_level_has_no_time_of_its_own(examples: Path) -> None:
    """It is no program: the player shows how far along it is, beside the times of the programs in the table."""
    options: dict[str, Any] = {
        "machine": "linuxcnc-mill", "preset": "fast", "depth": 2, "tool_diameter": 20, "spindle_speed": 3000,
        "strategy": "contour",
    }  # fmt: skip
    call = ReadyTask("optimize", (str(examples / "pocket.dxf"),), "pocket", options)
    made = run_task(Link(lambda _: None), call, ("pocket.dxf",))
    ways = [unpacked(artefact.data)[0] for name, artefact in made.artefacts.items() if name.startswith("way-")]
    assert ways and all(header["untimed"] for header in ways)
    assert not unpacked(made.artefacts["scene-after"].data)[0].get("untimed")
