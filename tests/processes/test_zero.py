"""One zero for all programs of a part: the corner of its outline in X and Y, and the top of a solid in Z."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely
from rich.console import Console

import leafcut
from leafcut.cli.app import run
from leafcut.errors import OptionError
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.issue import Severity
from leafcut.model.outcome import Outcome
from leafcut.model.part import TURNS, Hole, Part, ProgramZero
from leafcut.model.toolpath import Kind
from leafcut.options import PocketDrawingOptions, ReadOptions
from leafcut.processes.job import machine_issues
from leafcut.processes.placing import negative_axes, place_part
from leafcut.processes.registry import report_of
from leafcut.processes.settings import collect_settings
from leafcut.read import Source, read, read_contours, read_pockets
from leafcut.read.joining import read_drill_files
from leafcut.read.machine import load_machine
from leafcut.read.reference import closed_outlines
from leafcut.report.page import report_page_html
from leafcut.report.summary import print_summary

#: The lower left corner of the plate in its drawing, and its size.
X0, Y0, WIDE, HIGH = 12.0, 22.0, 120.0, 80.0
FAST: dict[str, Any] = {"preset": "fast", "threads": 1, "origin": "lower-left"}


def rectangle(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Draw a plate: outline, three holes, a pocket; below and left of it a text, a dimension and a title block."""
    document = ezdxf.new(units=4, setup=True)
    space = document.modelspace()
    corners = rectangle(X0, Y0, X0 + WIDE, Y0 + HIGH)
    for number, corner in enumerate(corners):
        space.add_line(corner, corners[(number + 1) % 4], dxfattribs={"layer": "OUTLINE"})
    for x, y in ((10, 10), (110, 10), (110, 70)):
        space.add_circle((X0 + x, Y0 + y), 3, dxfattribs={"layer": "DRILL"})
    pocket = rectangle(X0 + 30, Y0 + 20, X0 + 60, Y0 + 50)
    space.add_lwpolyline(pocket, close=True, dxfattribs={"layer": "POCKET"})
    space.add_text("LEAF", height=5, dxfattribs={"insert": (0, 0)})
    space.add_linear_dim(base=(0, 5), p1=(X0, Y0), p2=(X0 + WIDE, Y0)).render()
    space.add_lwpolyline(rectangle(-40, -30, 300, 200), close=True, dxfattribs={"layer": "Frame A3"})
    document.saveas(tmp_path_factory.mktemp("plate") / "plate.dxf")
    return Path(document.filename or "")


def numbers(text: str, letter: str) -> list[float]:
    """Return the numbers behind a letter in the blocks of a program, without its comments."""
    blocks = re.sub(r"\([^)]*\)", "", text)
    return [float(found) for found in re.findall(rf"{letter}(-?[\d.]+)", blocks)]


def facts(text: str) -> str:
    """Return the line of a program's header that states the zero."""
    return next(line for line in text.splitlines() if line.startswith("(zero: "))


STATED = "zero: lower left corner of the part, X12 Y22 of the drawing"


def drilled(plate: Path, **more: Any) -> Outcome:
    return leafcut.optimize(plate, process="drill", depth=2, **{**FAST, **more})


@pytest.mark.hazard
def test_all_programs_of_a_part_have_one_zero(plate: Path) -> None:
    """The holes lie at (10, 10), (110, 10), (110, 70) of the plate, the pocket from (30, 20) to (60, 50)."""
    drill = drilled(plate, layers="DRILL")
    assert drill.written is not None
    holes = drill.written.end[drill.written.kind == Kind.DRILL, :2]
    assert sorted(map(tuple, holes.tolist())) == [(10, 10), (110, 10), (110, 70)]
    cutter = {"tool_diameter": 6, "strategy": "contour", "stock": 0}
    pocket = leafcut.optimize(plate, process="pocket", depth=2, pocket_layers="POCKET", **cutter, **FAST)
    assert (min(numbers(pocket.text, "X")), max(numbers(pocket.text, "X"))) == pytest.approx((33, 57), abs=0.01)
    assert (min(numbers(pocket.text, "Y")), max(numbers(pocket.text, "Y"))) == pytest.approx((23, 47), abs=0.01)
    assert facts(drill.text) == facts(pocket.text) == f"({STATED})"


@pytest.mark.hazard
def test_a_sheet_is_cut_from_the_zero_that_its_holes_are_drilled_from(plate: Path) -> None:
    """A line 0.65 mm beside the outline, half of the kerf, goes from −0.65 to 120.65."""
    asked = {"cut_layers": "OUTLINE", "thickness": 3, "machine": "plasma-table", "kerf": 1.3}
    sheet = leafcut.optimize(plate, process="cut", lead_in="none", **asked, **FAST)
    for axis, size in (("X", WIDE), ("Y", HIGH)):
        found = numbers(sheet.text, axis)
        assert (min(found), max(found)) == pytest.approx((-0.65, size + 0.65), abs=0.01)
    assert facts(sheet.text) == facts(drilled(plate).text)


@pytest.mark.hazard
@pytest.mark.parametrize(
    "asked",
    [{}, {"layers": ("DRILL",)}, {"min_diameter": "5mm"}, {"max_diameter": "6mm", "concentric": "largest"}],
)
def test_filters_of_layers_and_holes_do_not_move_the_zero(plate: Path, asked: dict[str, Any]) -> None:
    options = collect_settings({"origin": "lower-left", **asked}).read
    part = place_part(read(plate, options), options)
    assert part.hole_xy.tolist() == [[10, 10], [110, 10], [110, 70]]
    assert part.zero == ProgramZero("lower left corner of the part", X0, Y0)


@pytest.mark.parametrize("layers", [(), ("OUTLINE",), ("POCKET",)])
def test_chosen_contours_and_pockets_do_not_move_the_zero(plate: Path, layers: tuple[str, ...]) -> None:
    options = collect_settings({"origin": "upper-right", "layers": layers}).read
    cut = place_part(read_contours(plate, options), options)
    assert cut.zero == ProgramZero("upper right corner of the part", X0 + WIDE, Y0 + HIGH)
    if layers != ("OUTLINE",):
        chosen = PocketDrawingOptions(pocket_layers=("POCKET",))
        pockets = place_part(read_pockets(plate, options, chosen), options).pockets
        assert pockets[0].outline.extents == pytest.approx((30 - WIDE, 20 - HIGH, 60 - WIDE, 50 - HIGH))


def test_the_zero_of_a_mirrored_and_rotated_part_is_stated_in_the_drawing(plate: Path) -> None:
    """Mirrored in X and turned by 90 degrees, the lower left corner is the upper right one of the drawing.

    (x, y) goes to (−x, y) and then to (−y, −x): the least of both is at the greatest y and x.
    """
    options = collect_settings({"origin": "lower-left", "mirror": "x", "rotate": "90deg"}).read
    zero = place_part(read(plate, options), options).zero
    assert zero is not None
    assert (zero.x, zero.y) == pytest.approx((X0 + WIDE, Y0 + HIGH))


def boxes(part: Part) -> tuple[float, ...]:
    return closed_outlines(part).extents


def test_the_corner_is_that_of_the_union_of_all_closed_outlines() -> None:
    """GEOS finds the same box around random triangles; open lines outside of them are ignored."""
    rng = np.random.default_rng(4)
    triangles = [rng.uniform(0, 100, (3, 2)) for _ in range(20)]
    contours = [Contour(Polyline.of_points(corners, closed=True)) for corners in triangles]
    stray = Contour(Polyline.of_points([(-50, 20), (150, 20)]))
    wanted = shapely.union_all([shapely.Polygon(corners) for corners in triangles]).bounds
    assert boxes(Part("p", contours=(*contours, stray))) == pytest.approx(wanted)


def test_without_a_closed_outline_all_of_the_geometry_counts() -> None:
    lines = [Contour(Polyline.of_points(ends)) for ends in ([(5, 1), (50, 1)], [(9, 40), (9, -3)])]
    assert boxes(Part("p", contours=tuple(lines))) == (5, -3, 50, 40)
    assert boxes(Part("p", (Hole(10, 10, 4), Hole(2, 30, 0)))) == (2, 8, 12, 30)


def test_an_outline_with_a_gap_is_still_the_outline() -> None:
    """Its ends are 1 mm apart: so it is not closed, but it lies around the holes."""
    gap = Contour(Polyline.of_points([(0, 1), (0, 80), (120, 80), (120, 0), (0, 0)]))
    assert boxes(Part("p", (Hole(10, 10, 6), Hole(110, 70, 6)), contours=(gap,))) == (0, 0, 120, 80)


@pytest.mark.hazard
def test_a_frame_counts_only_if_nothing_else_is_drawn() -> None:
    frame = Contour(Polyline.of_points(rectangle(-9, -9, 400, 290), closed=True), layer="FRAME")
    part = Contour(Polyline.of_points(rectangle(5, 6, 50, 60), closed=True), layer="0")
    assert boxes(Part("p", contours=(frame, part))) == (5, 6, 50, 60)
    assert boxes(Part("p", contours=(frame,))) == (-9, -9, 400, 290)


@pytest.mark.hazard
def test_all_holes_of_several_drill_files_set_their_zero(tmp_path: Path) -> None:
    """Those that are left out by their diameter, too."""
    sources = []
    for name, width, x in (("a", 0.8, 10.0), ("b", 3.2, 4.0)):
        text = f"M48\nMETRIC\nT1C{width}\n%\nT1\nX{x}Y5.0\nX30.0Y25.0\nM30\n"
        sources.append(Source(str(tmp_path / f"{name}.drl"), text.encode()))
    options = collect_settings({"origin": "lower-left", "max_diameter": "1mm"}).read
    with pytest.raises(leafcut.errors.ReadError):
        read(sources[1], options)
    both = collect_settings({"origin": "lower-left", "min_diameter": "1mm"}).read
    part = place_part(read_drill_files([sources[1], sources[1]], both), both)
    assert part.hole_xy.tolist() == [[0, 0], [26, 20]]


@pytest.mark.hazard
def test_summary_page_header_and_json_state_the_zero(plate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    outcome = drilled(plate)
    printed = StringIO()
    print_summary(report_of(outcome), Console(file=printed, width=120))
    assert re.search("zero +lower left corner of the part, X12 Y22 of the drawing", printed.getvalue())
    assert STATED in report_page_html(report_of(outcome))
    assert f"({STATED})" in outcome.text.splitlines()
    assert run(["drill", str(plate), "--depth", "2", "--preset", "fast", "--json", "--origin", "3,4"]) == 0
    told = json.loads(capsys.readouterr().out)["zero"]
    assert (told["place"], told["x"], told["y"]) == ("", 3.0, 4.0)


@pytest.mark.parametrize(
    ("zero", "scale", "words"),
    [
        (ProgramZero(), 1.0, ["X0 Y0 of the drawing"]),
        (ProgramZero("centre of the part", 25.4, -12.7), 25.4, ["centre of the part, X1 Y-0.5 of the drawing"]),
        (ProgramZero(up="z", level="top", z=-40), 1.0, ["X0 Y0 of the solid", "top of the part, Z-40 of the solid"]),
        (
            ProgramZero(up="-x", level="drawn"),
            1.0,
            ["X0 Y0 of the solid, turned with -X up", "Z0 of the solid, turned with -X up"],
        ),
        (
            ProgramZero(level="surface", z=-40),
            1.0,
            ["X0 Y0 of the drawing", "Z0 of the surface file, its top is at Z-40"],
        ),
    ],
)
def test_the_words_of_a_zero(zero: ProgramZero, scale: float, words: list[str]) -> None:
    assert [told for _, told in zero.facts(scale)] == words


@pytest.mark.parametrize(
    ("box", "table", "mill"),
    [
        ((0, 0, 100, 50), "", ""),
        ((-1, 2, 100, 50), "X", ""),
        ((-106, -63, 106, 2), "X and Y", ""),
        ((-106, -63, 0, 2), "X and Y", "X"),
        ((0, 0, 0, 50), "", ""),
        ((0, -230, 50, -191), "Y", "Y"),
        ((-50, -50, 50, 50), "X and Y", ""),
    ],
)
def test_the_negative_side_of_the_zero(box: tuple[float, ...], table: str, mill: str) -> None:
    """Tables start at 0, or some millimetres before it for leads; the travel of a mill ends at 0."""
    assert negative_axes(box, load_machine("pcb-drill")) == table
    assert negative_axes(box, load_machine("haas-vf2")) == mill
    assert negative_axes(box, replace(load_machine("pcb-drill"), work_offset=(300.0, 300.0, 0.0))) == ""
    assert negative_axes((-4, 0, 9, 9), load_machine("plasma-table")) == ""


@pytest.mark.hazard
@pytest.mark.parametrize("process", ["drill", "cut", "pocket"])
def test_a_part_on_the_negative_side_of_the_zero_is_stated_in_every_run(
    plate: Path, process: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The plate is 120 mm wide: with its zero beyond its right edge all of it is at negative X."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    given = {
        "drill": ["--depth", "2"],
        "cut": ["--thickness", "3", "--cut-layers", "OUTLINE"],
        "pocket": ["--depth", "2", "--pocket-layers", "POCKET", "--tool-diameter", "6", "--strategy", "zigzag"],
    }[process]
    program = tmp_path / "plate.nc"
    command = [process, str(plate), *given, "--preset", "fast", "--origin", "200,20", "-o", str(program)]
    for _ in range(2 if process == "drill" else 1):
        assert run(command) in (0, 3)
        told = " ".join(capsys.readouterr().out.split())
        assert "L403 the part reaches X-1" in told
    assert "(the part reaches the negative side of the zero in X)" in program.read_text()


@pytest.mark.hazard
@pytest.mark.parametrize(("zero_is_set", "severity"), [(False, Severity.WARNING), (True, Severity.NOTE)])
def test_a_negative_part_is_a_warning_unless_the_zero_was_chosen(zero_is_set: bool, severity: Severity) -> None:
    first, *_ = machine_issues(load_machine("haas-vf2"), (-50, 0, -10, 40), zero_is_set)
    assert first.severity is severity
    assert first.message.startswith(
        "the part reaches X-50: it extends from X-50 to -10 and from Y0 to 40 mm; set the work zero accordingly, "
        "or use --origin"
    )
    assert not any("reaches" in i.message for i in machine_issues(load_machine("haas-vf2"), (-50, 0, 10, 40)))


@pytest.mark.hazard
def test_holes_drawn_below_z0_are_stated(tmp_path: Path) -> None:
    """With drawn heights, Z0 is the zero of the drawing: the highest hole is 38 mm below it."""
    holes = tmp_path / "holes.csv"
    holes.write_text("x,y,z,diameter\n0,0,-40,6\n10,0,-38,6\n")
    outcome = leafcut.optimize(holes, process="drill", depth=2, z_zero="drawn", preset="fast", threads=1)
    assert "(Z0: Z0 of the drawing, the highest hole is at Z-38)" in outcome.text


# -- solids ----------------------------------------------------------------------------------------------------------


def test_each_turn_brings_its_direction_up_and_mirrors_nothing() -> None:
    for name, rows in TURNS.items():
        turn = np.array(rows)
        axis = np.zeros(3)
        axis["xyz".index(name[-1])] = -1.0 if name.startswith("-") else 1.0
        assert (turn @ axis).tolist() == [0, 0, 1]
        assert np.linalg.det(turn) == pytest.approx(1.0)


LOW = {"top": 0.0, "bottom": 20.0, "drawn": -40.0}


@pytest.fixture(scope="module")
def low(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a block of 80 × 40 mm at Z−60 to Z−40 with two through holes and a pocket of 5 mm."""
    pytest.importorskip("OCP")
    from made_solids import DOWN, box, cut, cylinder, saved

    holes = [cylinder((x, y, -40), DOWN, 3, 20) for x, y in ((15, 3), (75, 23))]
    block = cut(box(5, -7, -60, 85, 33, -40), *holes, box(25, 3, -45, 65, 23, -40))
    return saved(tmp_path_factory.mktemp("low") / "low.step", block)


@pytest.mark.hazard
@pytest.mark.usefixtures("opencascade_at_hand")
@pytest.mark.parametrize("z_zero", [None, *LOW])
def test_the_top_of_a_solid_is_z0_unless_its_bottom_or_its_own_is_asked_for(low: Path, z_zero: str | None) -> None:
    options = ReadOptions(z_zero=z_zero, origin="lower-left")
    part = place_part(read(low, options), options)
    assert [(h.x, h.y, h.z, h.depth) for h in part.holes] == [
        (pytest.approx(10.0), pytest.approx(10.0), LOW[z_zero or "top"], 20.0),
        (pytest.approx(70.0), pytest.approx(30.0), LOW[z_zero or "top"], 20.0),
    ]
    assert part.zero is not None
    assert (part.zero.x, part.zero.y, part.zero.level) == (pytest.approx(5.0), pytest.approx(-7.0), z_zero or "top")


@pytest.mark.hazard
@pytest.mark.usefixtures("opencascade_at_hand")
def test_pockets_of_a_solid_have_the_zero_of_its_holes(low: Path) -> None:
    options = ReadOptions(origin="lower-left")
    part = place_part(read_pockets(low, options), options)
    (pocket,) = part.pockets
    assert pocket.outline.extents == pytest.approx((20, 10, 60, 30))
    assert (pocket.top, pocket.depth) == (0.0, 5.0)
    assert part.zero == place_part(read(low, options), options).zero


@pytest.fixture(scope="module")
def side(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a block of 20 × 40 × 60 mm with two holes that go in from its side X20."""
    pytest.importorskip("OCP")
    from made_solids import box, cut, cylinder, saved

    holes = [cylinder((20, y, z), (-1, 0, 0), radius, 8) for y, z, radius in ((10, 10, 3), (30, 50, 2))]
    return saved(tmp_path_factory.mktemp("side") / "side.step", cut(box(0, 0, 0, 20, 40, 60), *holes))


@pytest.mark.hazard
@pytest.mark.usefixtures("opencascade_at_hand")
def test_a_turned_solid_is_drilled_from_its_side(side: Path) -> None:
    """X of the solid becomes Z, and Z becomes −X: a hole at Y10 Z10 lies at X−10 Y10, 50 mm from the corner at Z60."""
    options = ReadOptions(up="x", origin="lower-left")
    part = place_part(read(side, options), options)
    found = sorted((round(h.x, 6), round(h.y, 6), h.z, h.depth, h.diameter) for h in part.holes)
    assert found == [(10.0, 30.0, 0.0, 8.0, 4.0), (50.0, 10.0, 0.0, 8.0, 6.0)]
    upright = read(side, ReadOptions())
    assert not upright.holes
    assert ["turn the solid with --up x or --up -x" in issue.message for issue in upright.issues] == [True]


@pytest.mark.hazard
@pytest.mark.usefixtures("opencascade_at_hand")
def test_the_r_plane_lies_above_a_solid_that_is_drawn_below_z0(low: Path) -> None:
    """Z0 is the top: no rapid, and no R plane, is below it. In 0.2.0 the R plane was Z-38."""
    outcome = leafcut.optimize(low, process="drill", machine="linuxcnc-mill", preset="fast", threads=1)
    assert "(Z0: top of the part, Z-40 of the solid)" in outcome.text
    assert set(numbers(outcome.text, "R")) == {2.0}
    depth = 20 + 0.5 + 3 / math.tan(math.radians(59))
    assert min(numbers(outcome.text, "Z")) == pytest.approx(-depth, abs=0.01)
    moves = leafcut.optimize(low, process="drill", machine="linuxcnc-mill", z_zero="bottom", preset="fast", threads=1)
    assert set(numbers(moves.text, "R")) == {22.0}


@pytest.mark.hazard
@pytest.mark.slow
@pytest.mark.usefixtures("opencascade_at_hand")
def test_a_fixture_and_a_surface_are_turned_and_lifted_with_their_solid(low: Path, side: Path) -> None:
    """The solid named once more as its own surface is proved against its holes, turned and with its top at Z0."""
    for file, more in ((low, {}), (side, {"up": "x"})):
        outcome = leafcut.optimize(
            file, process="drill", surface=file, machine="linuxcnc-mill", preset="fast", threads=1, **more
        )
        assert outcome.verified
        assert outcome.detail.surface.high[2] == pytest.approx(0.0)
        assert outcome.detail.surface.low[2] == pytest.approx(-20.0)


@pytest.mark.usefixtures("opencascade_at_hand")
def test_the_material_of_a_program_keeps_its_own_z0_unless_asked(low: Path) -> None:
    from leafcut.processes.program.workpiece import stock_block
    from leafcut.read.step import ChosenSolid

    drawn, top = (stock_block(str(low), ChosenSolid.of(ReadOptions(z_zero=z))) for z in (None, "top"))
    assert (drawn.low[2], drawn.high[2]) == pytest.approx((-60, -40))
    assert (top.low[2], top.high[2]) == pytest.approx((-20, 0))


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"z_zero": "top"}, "--z-zero: dxf has no solids; remove the option, or use a STEP file"),
        ({"up": "x"}, "--up: only used for a STEP file; leave it out"),
    ],
)
def test_only_a_solid_is_turned_or_lifted(plate: Path, asked: dict[str, str], message: str) -> None:
    with pytest.raises(OptionError, match=message):
        drilled(plate, **asked)


def test_a_sheet_has_no_z0_to_choose(plate: Path) -> None:
    with pytest.raises(OptionError, match="--z-zero: this option does not apply to cutting a sheet"):
        leafcut.optimize(plate, process="cut", thickness=3, z_zero="top")


def test_a_direction_with_a_sign_is_read_from_the_command_line(plate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["drill", str(plate), "--depth", "2", "--up", "-x"]) == 2
    assert "--up: only used for a STEP file" in capsys.readouterr().err
