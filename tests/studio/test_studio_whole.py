"""The studio shows the complete drawing under the machined parts, in thumbnails, with zero and the machine."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_scene import unpacked

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.part import Hole, Part
from leafcut.processes.settings import collect_settings
from leafcut.studio.drawing.scene import part_scene
from leafcut.studio.drawing.thumbnail import HEIGHT, WIDTH, Thumbnails
from leafcut.studio.jobs.preview import READY, read_preview
from leafcut.studio.jobs.whole import machine_travel_around
from leafcut.studio.page.fitting_machines import machine_head, offered_machines, unsuitable_reason
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_input import InputPanel, suggestion_words, work_cards
from leafcut.studio.studio import Studio
from leafcut.studio.wording import LANGUAGES, words

ROOT = Path(__file__).parents[2]
EXAMPLES, MACHINES = ROOT / "examples", ROOT / "src" / "leafcut" / "machines"
PLATE = str(EXAMPLES / "plate_10.dxf")
EN = words("en")


def places(scene: bytes, block: str) -> list[tuple[float, float]]:
    """Return the places of a block of a part, mm."""
    header, blocks = unpacked(scene)
    ox, oy = header["origin"]
    return [(round(row[0] + ox, 3), round(row[1] + oy, 3)) for row in blocks[block]]


@pytest.mark.parametrize(("name", "work"), [("bracket.dxf", "cut"), ("sheet.dxf", "cut"), ("pocket.dxf", "pocket")])
def test_a_drawing_opens_as_what_it_suits(name: str, work: str) -> None:
    seen = read_preview(str(EXAMPLES / name))
    assert (seen.work, seen.error) == (work, "") and seen.works == ("drill", "cut", "nest", "pocket", "part")


@pytest.mark.parametrize(
    ("name", "machine", "work"),
    [
        ("bracket.dxf", "shapeoko-router", "part"),
        ("bracket.dxf", "plasma-table", "cut"),
        ("plate_70.dxf", "shapeoko-router", "drill"),
        ("plate_70.dxf", "plasma-table", "drill"),  # its outline alone is little work
        ("pocket.dxf", "shapeoko-router", "pocket"),
    ],
)
def test_the_chosen_machine_decides_between_works_that_suit_well(name: str, machine: str, work: str) -> None:
    seen = read_preview(str(EXAMPLES / name), options={"machine": machine})
    assert next(iter(seen.whole.suits)) == seen.work == work


@pytest.mark.parametrize("count", [2_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_a_preview_shows_every_line_of_a_drawing_and_thumbnails_of_bounded_size(count: int, tmp_path: Path) -> None:
    """The lines are apart, so that none can be joined; positions in the scene are float32."""
    drawn = [(5.0 * (k % 400), 5.0 * (k // 400), 1.0 + k % 3, k % 2 + 0.25) for k in range(count)]
    lines = "".join(f"0\nLINE\n8\n0\n10\n{x}\n20\n{y}\n11\n{x + u}\n21\n{y + v}\n" for x, y, u, v in drawn)
    file = tmp_path / "lines.dxf"
    header = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n"
    file.write_text(f"{header}0\nSECTION\n2\nENTITIES\n{lines}0\nENDSEC\n0\nEOF\n")
    seen = read_preview(str(file))
    assert (seen.error, dict(seen.facts)["contours"]) == ("", f"{count:,}")
    for scene in seen.scenes.values():
        header, blocks = unpacked(scene)
        shown = np.array(blocks["vertex"])[:, :2] + header["origin"]
        expected = [((x, y), (x + u, y + v)) for x, y, u, v in drawn]
        assert [row[1] for row in blocks["outline"]] == [2] * count
        assert np.allclose(shown.reshape(-1, 2, 2), expected, atol=1e-3)
    assert seen.whole.pictures
    for picture in seen.whole.pictures.values():
        assert 0 < (picture["strong"] + picture["faint"]).count("M") <= 1_500


def test_what_is_not_worked_is_beneath() -> None:
    """The edge of a plate that is drilled, and what options leave out."""
    seen = read_preview(PLATE, "drill", {"layers": "HOLES"})
    header, blocks = unpacked(seen.scenes["whole"])
    assert header["layers"] == ["HOLES", "OUTLINE"]
    assert (blocks["hole_layer"], blocks["outline_layer"]) == ([1] * 10, [2])
    assert unpacked(seen.scenes["part"])[1]["outline"] == []
    filtered = read_preview(PLATE, "drill", {"max_diameter": 1.0})
    assert filtered.error and "whole" not in filtered.scenes and filtered.whole.pictures


@pytest.mark.parametrize(
    "options", [{}, {"mirror": "x"}, {"rotate": "30deg"}, {"origin": "upper-right"}, {"origin": "12,-7"}]
)
def test_the_whole_lies_as_the_part_does(options: dict[str, str]) -> None:
    seen = read_preview(PLATE, "drill", options)
    whole, holes = places(seen.scenes["whole"], "hole"), places(seen.scenes["part"], "hole")
    assert len(whole) == len(holes) == 10
    assert all(min(math.dist(hole, one) for one in whole) < 2e-3 for hole in holes)


def test_a_named_zero_is_known_by_its_place() -> None:
    """The outline of the plate starts at the zero of the drawing; its lowest, leftmost hole does not."""
    assert read_preview(PLATE, "drill").zero == (0.0, 0.0)
    assert read_preview(PLATE, "drill", {"origin": "lower-left"}).zero == pytest.approx((0.0, 0.0))
    assert read_preview(PLATE, "drill", {"origin": "3,4"}).zero == (3.0, 4.0)


def test_layers_of_holes_and_outlines_are_told() -> None:
    part = Part(
        "p",
        (Hole(0, 0, 1, "b"), Hole(1, 0, 1)),
        contours=(Contour(Polyline.circle(0, 0, 5), layer="a"), Contour(Polyline.circle(9, 0, 5), layer="b")),
    )
    header, blocks = unpacked(part_scene(part))
    assert header["layers"] == ["a", "b"]
    assert (blocks["hole_layer"], blocks["outline_layer"]) == ([2, 0], [1, 2])


def test_a_picture_is_strong_where_it_is_worked_and_lies_in_its_box() -> None:
    seen = read_preview(str(EXAMPLES / "pocket.dxf"))
    for work, strong in (("pocket", 3), ("drill", 1), ("cut", 3)):
        drawn = seen.whole.pictures[work]
        assert drawn["strong"].count("M") == strong and drawn["faint"].count("M") == 3 - strong
        places = [(float(x), float(y)) for x, y in re.findall(r"[ML]([-\d.]+) ([-\d.]+)", drawn["strong"])]
        assert all(0 <= x <= WIDTH and 0 <= y <= HEIGHT for x, y in places)


def test_a_picture_of_very_many_outlines_and_holes_stays_small() -> None:
    import numpy as np

    contours = tuple(Contour(Polyline.circle(k % 400, k // 400, 0.3)) for k in range(8_000))
    part = Part("p", tuple(Hole(c.path.start[0], 0.0, 0.2) for c in contours), contours=contours)
    every = np.ones(8_000, dtype=np.bool_)
    assert len(Thumbnails(part).picture(every, every, "holes")["strong"]) < 100_000


@pytest.mark.parametrize("language", LANGUAGES)
def test_it_is_said_what_is_suggested_and_why(language: str) -> None:
    w = words(language)
    for name in ("bracket.dxf", "sheet.dxf", "pocket.dxf", "plate_10.dxf"):
        seen = read_preview(str(EXAMPLES / name))
        line = suggestion_words(seen, w)
        assert w.item_name("work", seen.work) in line and "{" not in line
    assert suggestion_words(read_preview("example:plate-10"), w) == "" == suggestion_words(None, w)
    assert {card["name"] for card in work_cards(seen.works, seen, w) if card["picture"]} == {
        "drill",
        "cut",
        "pocket",
        "part",
    }


def test_machines_that_cannot_do_the_work_are_not_offered(studio: Studio) -> None:
    studio.folder.save_own("machines", "my-laser", (MACHINES / "laser-table.toml").read_text())
    machines = {name: name for name in ("haas-vf2", "laser-table", "plasma-table", "mine:my-laser")}
    assert list(offered_machines(machines, "drill", "", studio.folder)) == ["haas-vf2"]
    assert list(offered_machines(machines, "cut", "", studio.folder)) == [
        "laser-table",
        "plasma-table",
        "mine:my-laser",
    ]
    assert list(offered_machines(machines, "simulate", "", studio.folder)) == list(machines)


def test_a_machine_that_was_chosen_for_other_work_says_why_not(studio: Studio) -> None:
    view = View(studio, EN, work="drill")
    view.table.set_value("machine", "laser-table")
    assert view.field_errors()["machine"] == "laser-table works with a laser; choose a machine with a spindle"
    field = next(f for group in view.options_form() for f in group["fields"] if f["name"] == "machine")
    assert ["laser-table", "laser-table"] in field["choices"]
    view.work = "cut"
    assert view.invalid_values == {}
    assert unsuitable_reason("haas-vf2", "cut", studio.folder, words("es")).startswith(
        "haas-vf2 trabaja con un husillo; elija"
    )


def test_a_profile_beside_the_studio_is_no_machine_of_it(studio: Studio, tmp_path: Path) -> None:
    """A page sends a name, never a path to open."""
    outside = tmp_path / "outside.toml"
    outside.write_text((MACHINES / "plasma-table.toml").read_text())
    assert machine_head("plasma-table", studio.folder) is not None
    assert machine_head(str(outside), studio.folder) is None


def test_a_program_is_looked_at_with_the_options_that_it_is_run_with(tmp_path: Path) -> None:
    """A program without G20 and G21 is 25.4 times as large in inches."""
    program = tmp_path / "plain.nc"
    program.write_text("G90 G94\nG0 X0 Y0 Z1\nG1 Z-1 F10\nX10 Y5\nM2\n")
    sizes = [dict(read_preview(str(program), "", {"units": unit}).facts)["size"] for unit in ("mm", "in")]
    assert sizes == ["10 × 5 mm", "254 × 127 mm"]


def test_a_drill_file_is_for_a_machine_for_circuit_boards(tmp_path: Path) -> None:
    board = tmp_path / "board.drl"
    board.write_text("M48\nMETRIC,TZ\nT1C0.800\n%\nG90\nT1\nX10.0Y10.0\nX20.0Y10.0\nM30\n")
    assert read_preview(str(board)).whole.machine == "pcb-drill"
    assert read_preview(PLATE).whole.machine == ""


def test_travel_is_around_the_part_until_the_machine_knows_its_zero() -> None:
    """linuxcnc-mill goes 800 × 400 mm."""
    free = machine_travel_around(collect_settings({}), (100.0, 100.0, 300.0, 200.0))
    assert free is not None and (free.known, free.fits) == (False, True)
    assert free.box == pytest.approx((-200.0, -50.0, 600.0, 350.0))
    held = machine_travel_around(collect_settings({"work_offset": "-790,-390,0"}), (0.0, 0.0, 300.0, 200.0))
    assert held is not None and held.known and held.fits
    assert held.box == pytest.approx((-5.0, -5.0, 795.0, 395.0))
    wide = machine_travel_around(collect_settings({}), (0.0, 0.0, 300.0, 401.0))
    assert wide is not None and not wide.fits


def test_no_travel_is_outlined_of_a_machine_whose_travel_is_unknown(tmp_path: Path) -> None:
    file = tmp_path / "my.toml"
    file.write_text('controller = "grbl"\nrapid.velocity = "3 m/min"\n')
    assert machine_travel_around(collect_settings({"machine": str(file)}), (0.0, 0.0, 300.0, 200.0)) is None


def test_zero_that_is_dragged_is_an_option(studio: Studio) -> None:
    """It is relative to the current zero, and stored in coordinates of the drawing."""
    view = View(studio, EN, work="drill")
    view.seen = replace(read_preview(PLATE, "drill", {"origin": "lower-left"}), zero=(19.05, 19.05))
    panel = InputPanel.__new__(InputPanel)
    panel.view = view
    put: list[tuple[str, str]] = []
    panel.set_option = lambda name, value, _: put.append((name, value))  # type: ignore[method-assign,assignment,return-value]
    panel.move_zero(10.0, -19.05)
    assert put == [("origin", "29.05,0")]
    view.work = "solve"
    assert view.program_zero is None
    panel.move_zero(1.0, 1.0)
    assert len(put) == 1


def test_what_is_loaded_in_advance_is_read_to_its_end() -> None:
    """It is there to load what others need: where it is refused, it loads nothing."""
    drawing, program = (read_preview(source) for source in READY)
    assert (drawing.error, dict(drawing.facts)["holes"]) == ("", "1")
    assert (program.error, program.format) == ("", "gcode")


def test_holes_alone_are_pictured_with_their_widths() -> None:
    """Two concentric circles have the same centre: the larger determines the extent."""
    whole = Part("disc", (Hole(5.0, 5.0, 20.0), Hole(5.0, 5.0, 4.0)))
    drawn = Thumbnails(whole).picture(None, np.array([True, True]), "holes")["strong"]
    numbers = [float(number) for number in re.findall(r"[-\d.]+", drawn.split("a")[0])]
    assert 0.0 <= numbers[0] <= WIDTH
    assert 0.0 <= numbers[1] <= HEIGHT
    radii = [float(number) for number in re.findall(r"a([\d.]+)", drawn)]
    assert max(radii) / min(radii) == pytest.approx(5.0, rel=0.05)
    assert 2 * max(radii) <= HEIGHT


def test_what_another_task_chose_and_cannot_be_used_is_left(studio: Studio) -> None:
    view = View(studio, EN, work="pocket")
    view.table.set_value("machine", "plasma-table")
    view.table.set_value("pixel_size", "0.5")
    view.seen = read_preview(str(EXAMPLES / "pocket.dxf"), "pocket")
    assert view.reset_unsuitable_options() == "plasma-table cannot do this task: linuxcnc-mill is chosen."
    assert not view.values.get("machine")
    assert not view.values.get("pixel_size")
    view.table.set_value("machine", "haas-vf2")
    assert view.reset_unsuitable_options() == ""
    assert view.values["machine"] == "haas-vf2"


def test_what_looks_like_a_program_is_none_of_the_broken_files(tmp_path: Path) -> None:
    """It can be read as text; a letter cannot be taken for one."""
    program, letter = tmp_path / "fusion.nc", tmp_path / "letter.nc"
    program.write_text("G21 G90\nG0 X0 Y0 Z5\nG81 X1 Y1 Z-1 R1 F50\nG80\nZ15.\nM30\n")
    letter.write_text("Dear Sir,\nthe plate is late.\n")
    assert (bool(read_preview(str(program)).error), read_preview(str(program)).broken) == (True, False)
    assert read_preview(str(letter)).broken
