"""STEP: holes of generated solids, reports of other sides and steps, and refusals of invalid files."""

from __future__ import annotations

import json
import math
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert, BRepBuilderAPI_Transform
from OCP.gp import gp_Ax1, gp_Dir, gp_Pnt, gp_Trsf

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import LeafcutError, OptionError, ReadError
from leafcut.model.toolpath import Kind
from leafcut.options import ReadOptions
from leafcut.read import read
from leafcut.read.meshes import load_mesh
from leafcut.read.step_solid import RoundWall, column_to_hole, hole_columns, join_wall_pieces
from made_solids import DOWN, UP, box, cone, cut, cylinder, saved

pytestmark = pytest.mark.usefixtures("opencascade_at_hand")

FAST: dict[str, Any] = {"preset": "fast", "threads": 1}
#: Heights of the solid.
DRAWN = ReadOptions(z_zero="drawn")


def test_through_blind_flat_and_pointed_holes_have_their_heights_and_depths(tmp_path: Path) -> None:
    block = cut(
        box(0, 0, -30, 80, 40, 5.125),
        cylinder((10.25, 10, 5.125), DOWN, 2.55, 35.125),
        cylinder((30, 10.75, 5.125), DOWN, 3, 12.2),
        cylinder((50, 10, 5.125), DOWN, 4, 20.3),
        cone((50, 10, -15.175 - 4 / math.tan(math.radians(59))), 0, 4, 4 / math.tan(math.radians(59))),
    )
    part = read(saved(tmp_path / "block.step", block), DRAWN)
    told = [(h.x, h.y, h.z, h.diameter, h.depth, h.through, h.flat) for h in part.holes]
    assert sorted(told) == [
        (10.25, 10.0, 5.125, 5.1, 35.125, True, False),
        (30.0, 10.75, 5.125, 6.0, 12.2, False, True),
        (50.0, 10.0, 5.125, 8.0, 20.3, False, False),
    ]


def test_counterbores_and_countersinks_are_steps_of_one_hole(tmp_path: Path) -> None:
    block = cut(
        box(0, 0, -20, 80, 40, 0),
        cylinder((10, 10, 0), DOWN, 3, 20),
        cylinder((10, 10, 0), DOWN, 5, 6),
        cylinder((40, 10, 0), DOWN, 2, 20),
        cone((40, 10, -3), 2, 5, 3),
    )
    part = read(saved(tmp_path / "block.step", block))
    assert [(h.x, h.z, h.diameter, h.depth, h.through) for h in part.holes] == [
        (10.0, 0.0, 6.0, 20.0, True),
        (40.0, 0.0, 4.0, 20.0, True),
    ]
    assert not [issue for issue in part.issues if issue.code == "L217"]
    bore, sink = part.holes[0].steps[0], part.holes[1].steps[0]
    assert (bore.diameter, bore.depth, bore.angle, bore.tip, bore.open) == pytest.approx((10, 6, math.pi, 6, True))
    # The cone of 90 degrees is 4 mm wide 3 mm deep, and would meet its tip 2 mm below.
    assert (sink.diameter, sink.depth, sink.angle) == pytest.approx((10, 3, math.pi / 2))
    assert (sink.tip, sink.narrow, sink.open) == pytest.approx((5, 4, True))


def test_bosses_fillets_and_slot_ends_are_no_holes(tmp_path: Path) -> None:
    block = BRepAlgoAPI_Fuse(box(0, 0, -10, 80, 40, 0), cylinder((60, 20, 0), (0, 0, 1), 8, 12)).Shape()
    slot = BRepAlgoAPI_Fuse(box(10, 7, -10, 25, 13, 0), cylinder((10, 10, 0), DOWN, 3, 10)).Shape()
    slot = BRepAlgoAPI_Fuse(slot, cylinder((25, 10, 0), DOWN, 3, 10)).Shape()
    part = read(saved(tmp_path / "block.step", cut(block, slot, cylinder((60, 20, 12), DOWN, 2, 22))), DRAWN)
    assert [(h.x, h.y, h.z, h.depth, h.through) for h in part.holes] == [(60.0, 20.0, 12.0, 22.0, True)]


def test_holes_from_below_and_from_the_sides_are_told_and_not_drilled(tmp_path: Path) -> None:
    block = cut(
        box(0, 0, -20, 80, 40, 0),
        cylinder((10, 10, -20), (0, 0, 1), 3, 8),
        cylinder((30, 0, -10), (0, 1, 0), 2, 40),
        cylinder((50, 0, -10), (0, 1, 0), 2, 15),
        cylinder((70, 20, 0), DOWN, 3, 20),
    )
    part = read(saved(tmp_path / "block.step", block))
    assert [(h.x, h.y) for h in part.holes] == [(70.0, 20.0)]
    told = [str(issue) for issue in part.issues if issue.code == "L218"]
    assert any("1 hole open only from below" in line for line in told)
    assert any("2 holes along 0, 1, 0 will not be drilled" in line for line in told)


@pytest.mark.slow
def test_without_any_hole_to_drill_the_reasons_are_told(tmp_path: Path) -> None:
    block = cut(
        box(0, 0, -20, 80, 40, 0), cylinder((10, 10, -20), (0, 0, 1), 3, 8), cylinder((30, 0, -10), (0, 1, 0), 2, 40)
    )
    with pytest.raises(LeafcutError) as refused:
        api.optimize(saved(tmp_path / "block.step", block), process="drill", **FAST)
    told = str(refused.value)
    assert told.startswith("block: there are no holes to drill: 1 hole open only from below")
    assert "1 hole along 0, 1, 0 will not be drilled" in told
    assert "\n" not in told


ALL, WEST, EAST = frozenset(range(-180, 180)), frozenset(range(-180, 0)), frozenset(range(180))


def test_walls_in_halves_make_one_hole_though_a_slope_cuts_them_at_other_heights() -> None:
    halves = [RoundWall(5, 5, -10, 0, 2, 2, WEST), RoundWall(5.0000004, 5, -10, 1, 2, 2, EAST)]
    quarter = RoundWall(9, 9, -10, 0, 2, 2, frozenset(range(90)))
    (whole,) = join_wall_pieces([*halves, quarter])
    assert (whole.low, whole.high, whole.covers) == (-10, 1, ALL)
    twice = [RoundWall(5, 5, -10, 0, 2, 2, WEST), RoundWall(5, 5, -10, 0, 2, 2, WEST)]
    assert join_wall_pieces(twice) == []
    assert column_to_hole([RoundWall(5, 5, -10, 0, 0, 4, ALL)]) is None


def test_what_is_between_two_walls_of_an_axis_makes_them_two_holes() -> None:
    above, below = RoundWall(5, 5, -10, 0, 2, 2, ALL), RoundWall(5, 5, -20, -12, 2, 2, ALL)
    assert list(hole_columns([below, above], lambda upper, lower: True)) == [[above], [below]]
    assert list(hole_columns([below, above], lambda upper, lower: False)) == [[above, below]]


def holes(tmp_path: Path, solid: Any) -> list[tuple[float, float, float, bool, bool]]:
    part = read(saved(tmp_path / "solid.step", solid), DRAWN)
    return [(h.z, h.diameter, h.depth or 0.0, h.through, h.flat) for h in part.holes]


def plate() -> Any:
    return box(0, 0, -20, 80, 40, 0)


@pytest.mark.parametrize("unit", ["INCH", "M"])
def test_a_small_file_in_another_unit_has_the_same_hole(tmp_path: Path, unit: str) -> None:
    """OpenCASCADE writes the same solid with numbers in the unit of the file."""
    block = cut(box(0, 0, 0, 30, 20, 5), cylinder((12.7, 10, 5), DOWN, 2, 5))
    part = read(saved(tmp_path / "block.step", block, unit=unit), DRAWN)
    ((x, y, z, diameter, depth),) = [(h.x, h.y, h.z, h.diameter, h.depth) for h in part.holes]
    assert (x, y, z, diameter, depth) == pytest.approx((12.7, 10.0, 5.0, 4.0, 5.0), abs=1e-4)


def test_a_hole_that_widens_below_is_drilled_with_its_narrow_diameter(tmp_path: Path) -> None:
    """A drill of 6 mm would cut away the wall of the upper 4 mm hole. The wider part is a closed step of the hole."""
    block = cut(box(0, 0, -9, 20, 20, 0), cylinder((10, 10, 0), DOWN, 2, 9), cylinder((10, 10, -9), UP, 3, 4))
    (hole,) = read(saved(tmp_path / "block.step", block)).holes
    assert (hole.z, hole.diameter, hole.depth, hole.through) == (0.0, 4.0, 5.0, True)
    assert [(step.diameter, step.depth, step.open) for step in hole.steps] == [(6.0, 9.0, False)]


def test_of_holes_from_both_sides_the_upper_is_drilled_and_the_lower_reported(tmp_path: Path) -> None:
    block = cut(box(0, 0, -9, 20, 20, 0), cylinder((10, 10, 0), DOWN, 2, 3), cylinder((10, 10, -9), UP, 3, 4))
    part = read(saved(tmp_path / "block.step", block))
    ((z, diameter, depth, through, flat),) = [(h.z, h.diameter, h.depth, h.through, h.flat) for h in part.holes]
    assert (z, diameter, depth, through, flat) == (0.0, 4.0, 3.0, False, True)
    (issue,) = part.issues
    assert (issue.code, issue.severity) == ("L218", "missing")
    assert str(issue) == "L218 1 hole open only from below will not be drilled; turn the part over (--up -z)"


def test_an_island_in_a_round_pocket_leaves_no_hole(tmp_path: Path) -> None:
    pocket = cut(cylinder((10, 10, 0), DOWN, 6, 4), cylinder((10, 10, 0), DOWN, 2, 4))
    part = read(saved(tmp_path / "ring.step", cut(box(0, 0, -9, 20, 20, 0), pocket)))
    assert not part.holes
    (issue,) = part.issues
    assert "1 round wall with material inside, above or closed around it (an" in str(issue)
    assert issue.severity == "missing"


@pytest.mark.slow
def test_a_hole_that_something_opens_into_goes_on_below_it(tmp_path: Path) -> None:
    hole = cylinder((40, 20, 0), DOWN, 3, 20)
    across = cut(plate(), hole, cylinder((40, 0, -10), (0, 1, 0), 4, 40))
    groove = cut(plate(), hole, cylinder((40, 20, -8), DOWN, 5, 3))
    pieces = cut(plate(), cylinder((40, 20, 0), DOWN, 3, 12), cylinder((40, 20, -12), DOWN, 3, 8))
    for solid in (across, groove, pieces):
        assert holes(tmp_path, solid) == [(0.0, 6.0, 20.0, True, False)]


@pytest.mark.slow
def test_a_wider_part_below_is_told_and_never_drilled_through_the_narrow_one(tmp_path: Path) -> None:
    hole = cylinder((40, 20, 0), DOWN, 2, 20)
    for wide in (cylinder((40, 20, -20), (0, 0, 1), 4, 10), cone((40, 20, -20), 5, 2, 3)):
        (one,) = holes(tmp_path, cut(plate(), hole, wide))
        assert one[:2] == (0.0, 4.0)
        assert one[3]


@pytest.mark.slow
def test_holes_from_both_sides_are_two_and_one_of_them_is_told(tmp_path: Path) -> None:
    solid = cut(plate(), cylinder((40, 20, 0), DOWN, 3, 5), cylinder((40, 20, -20), (0, 0, 1), 3, 5))
    assert holes(tmp_path, solid) == [(0.0, 6.0, 5.0, False, True)]


@pytest.mark.slow
def test_a_floor_beside_the_axis_makes_a_hole_blind(tmp_path: Path) -> None:
    solid = cut(plate(), cylinder((40, 20, 0), DOWN, 5, 5), cylinder((41, 20, 0), DOWN, 2, 20))
    assert holes(tmp_path, solid) == [(0.0, 10.0, 5.0, False, True), (-5.0, 4.0, 15.0, True, False)]


@pytest.mark.slow
def test_a_round_pocket_with_an_island_or_under_an_overhang_is_no_hole(tmp_path: Path) -> None:
    round_ = cylinder((40, 20, 0), DOWN, 15, 8)
    boss, beside = cylinder((40, 20, 0), DOWN, 5, 8), box(44, 18, -8, 50, 22, 0)
    bore = cut(plate(), cylinder((40, 20, 0), DOWN, 6, 20))
    roof = BRepAlgoAPI_Fuse(box(42, 0, 5, 60, 40, 9), box(56, 0, 0, 60, 40, 5)).Shape()
    for solid in (
        cut(plate(), cut(round_, boss)),
        cut(plate(), cut(round_, beside)),
        BRepAlgoAPI_Fuse(bore, roof).Shape(),
    ):
        part = read(saved(tmp_path / "solid.step", solid))
        assert not part.holes
        assert [issue.severity for issue in part.issues] == ["missing"]


@pytest.mark.slow
def test_walls_of_a_free_form_are_told(tmp_path: Path) -> None:
    solid = BRepBuilderAPI_NurbsConvert(cut(plate(), cylinder((40, 20, 0), DOWN, 3, 20))).Shape()
    part = read(saved(tmp_path / "solid.step", solid))
    assert "7 faces with a free-form surface" in str(part.issues[0])


@pytest.mark.slow
def test_a_slope_that_cuts_two_half_walls_leaves_a_hole(tmp_path: Path) -> None:
    """The top rises by tan 4° along x; the rim is highest 3 mm beyond the axis."""
    turn = gp_Trsf()
    turn.SetRotation(gp_Ax1(gp_Pnt(0, 0, -6), gp_Dir(0, 1, 0)), math.radians(-4))
    slope = cut(plate(), BRepBuilderAPI_Transform(box(-50, -50, -6, 200, 100, 60), turn, True).Shape())
    drill = cylinder((40, 20, 20), DOWN, 3, 60)
    halves = [
        BRepAlgoAPI_Common(drill, box(-10, -30, -60, 40, 70, 60)).Shape(),
        BRepAlgoAPI_Common(drill, box(40, -30, -60, 90, 70, 60)).Shape(),
    ]
    ((z, diameter, depth, through, _),) = holes(tmp_path, cut(slope, *halves))
    assert z == pytest.approx(-6 + 43 * math.tan(math.radians(4)), abs=0.06)
    assert (diameter, through) == (6.0, True)
    assert z - depth == pytest.approx(-20.0, abs=1e-6)


@pytest.mark.slow
def test_what_lies_beside_the_drawing_is_not_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, examples: Path
) -> None:
    for module in ("json", "numpy", "OCP"):
        (tmp_path / f"{module}.py").write_text("open('ran', 'w').close()\nraise SystemExit(1)\n")
    file = (examples / "stepped_plate.step").resolve()
    monkeypatch.undo()  # a process of its own, as outside the tests
    monkeypatch.chdir(tmp_path)
    assert len(read(file).holes) == 36
    assert not Path("ran").exists()


@pytest.mark.slow
def test_a_lower_limit_of_memory_is_kept(examples: Path) -> None:
    words = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (6 << 30, 6 << 30)); from leafcut.read import read; "
    )
    words += f"print(len(read({str(examples / 'stepped_plate.step')!r}).holes))"
    done = subprocess.run([sys.executable, "-c", words], capture_output=True, text=True, check=False)
    assert done.stdout == "36\n", done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "factor"), [("INCH", 1.0), ("M", 1.0)])
def test_the_unit_of_the_file_is_obeyed(tmp_path: Path, unit: str, factor: float) -> None:
    """OpenCASCADE writes the same solid with other numbers."""
    block = cut(box(0, 0, -20, 80, 40, 0), cylinder((10, 10, 0), DOWN, 3, 20))
    file = saved(tmp_path / "block.step", block, unit=unit)
    hole = read(file).holes[0]
    assert (hole.x, hole.y, hole.diameter, hole.depth) == pytest.approx((10.0, 10.0, 6.0, 20.0), abs=1e-4)


def test_the_example_has_the_holes_that_it_was_made_with(examples: Path) -> None:
    made = runpy.run_path(str(examples / "make_stepped_plate.py"))
    part = read(examples / "stepped_plate.step", DRAWN)
    wanted = {(x, y): (z, through) for x, y, z, through in made["holes"]()}
    assert {(h.x, h.y): (h.z, h.through) for h in part.holes} == {k: (float(z), t) for k, (z, t) in wanted.items()}
    assert {h.depth for h in part.holes if not h.through} == {6.0}
    assert all(h.depth == h.z + 20.0 for h in part.holes if h.through)


@pytest.mark.slow
def test_a_solid_is_drilled_at_its_own_heights_and_depths_with_low_ways(examples: Path) -> None:
    outcome = api.optimize(examples / "stepped_plate.step", process="drill", machine="linuxcnc-mill", **FAST)
    point = 2.5 / math.tan(math.radians(59))
    path, holes = outcome.path_after, {(h.x, h.y): h for h in outcome.part.holes}
    for row in np.flatnonzero(path.kind == Kind.DRILL):
        hole, cycle = holes[tuple(path.end[row, :2].tolist())], path.cycles[path.ref[row]]
        assert cycle.r_plane == hole.z + 2.0
        assert cycle.bottom == pytest.approx(hole.z - hole.depth - (0.5 if hole.through else 0.0) - point, abs=1e-5)
    assert outcome.detail.low_travel_saved_s > 20.0
    over = api.optimize(
        examples / "stepped_plate.step", process="drill", machine="linuxcnc-mill", retract="initial", **FAST
    )
    assert outcome.after.time_s < 0.95 * over.after.time_s


@pytest.mark.slow
def test_step_and_stl_are_the_same_surface(examples: Path) -> None:
    step, stl = load_mesh(examples / "stepped_plate.step"), load_mesh(examples / "stepped_plate.stl")
    assert step.low.tolist() == pytest.approx(stl.low.tolist(), abs=1e-4)
    assert step.high.tolist() == pytest.approx(stl.high.tolist(), abs=1e-4)
    assert step.closed == stl.closed
    given = {"process": "drill", "depth": 4, "machine": "linuxcnc-mill", **FAST}
    programs = [
        api.optimize(examples / "stepped_plate.step", surface=str(examples / f"stepped_plate.{kind}"), **given)
        for kind in ("step", "stl")
    ]
    assert programs[0].after.time_s == pytest.approx(programs[1].after.time_s, rel=1e-6)


@pytest.mark.slow
def test_the_point_of_a_drill_ends_at_a_flat_floor(tmp_path: Path) -> None:
    block = cut(box(0, 0, -20, 80, 40, 0), cylinder((10, 10, 0), DOWN, 3, 12), cylinder((40, 10, 0), DOWN, 3, 20))
    outcome = api.optimize(saved(tmp_path / "block.step", block), process="drill", **FAST)
    point = 3.0 / math.tan(math.radians(59))
    bottoms = sorted(cycle.bottom for cycle in outcome.path_after.cycles)
    assert bottoms == pytest.approx([-20.5 - point, -12.0], abs=1e-5)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda data: data[: len(data) // 2], "is truncated"),
        (lambda data: b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n", "STEP file"),
        (lambda data: data.replace(b"CYLINDRICAL_SURFACE", b"NOTHING_AT_ALL____X"), "has no solid"),
        (lambda data: data.replace(b"MANIFOLD_SOLID_BREP", b"GEOMETRIC_CURVE_SET"), "STEP file"),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(tmp_path: Path, change: Any, told: str) -> None:
    block = cut(box(0, 0, -20, 80, 40, 0), cylinder((10, 10, 0), DOWN, 3, 12))
    file = saved(tmp_path / "block.step", block)
    file.write_bytes(change(file.read_bytes()))
    with pytest.raises(ReadError, match=told) as refused:
        read(file)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_of_several_solids_one_is_chosen_by_its_number(tmp_path: Path) -> None:
    """The refusal lists them; holes and surface are those of the chosen solid, at its position."""
    left = cut(box(0, 0, 0, 30, 20, 9), cylinder((9, 9, 9), DOWN, 2, 9))
    right = cut(box(50, 5, -2, 90, 30, 4), cylinder((60, 10, 4), DOWN, 3, 6))
    file = saved(tmp_path / "two.step", left, right)
    with pytest.raises(ReadError) as refused:
        read(file)
    assert str(refused.value).endswith(
        "the STEP file has 2 solids (1: 30 × 20 × 9 mm at 0, 0, Z0; 2: 40 × 25 × 6 mm at 50, 5, Z-2); choose one with "
        "--solid"
    )
    assert [(h.x, h.z) for h in read(file, ReadOptions(solid=1, z_zero="drawn")).holes] == [(9.0, 9.0)]
    assert [(h.x, h.z) for h in read(file, ReadOptions(solid=2, z_zero="drawn")).holes] == [(60.0, 4.0)]
    with pytest.raises(ReadError, match="--solid 3: the STEP file has 2 solids"):
        read(file, ReadOptions(solid=3))
    assert load_mesh(file, which=2).low.tolist() == [50.0, 5.0, -2.0]
    assert load_mesh(file, which="all").low.tolist() == [0.0, 0.0, -2.0]
    outcome = api.optimize(file, process="drill", solid=2, machine="linuxcnc-mill", **FAST)
    assert outcome.written is not None
    assert float(np.nanmax(outcome.written.end[:, 2])) < 30.0


@pytest.mark.slow
def test_a_solid_is_chosen_of_a_step_file_only(tmp_path: Path, examples: Path) -> None:
    """With a drawing the option selects the solid of the surface; without a surface, or with STL, it is refused."""
    file = saved(tmp_path / "two.step", box(0, 0, 0, 9, 9, 9), box(20, 0, 0, 60, 40, 5))
    (tmp_path / "holes.csv").write_text("x,y,diameter\n30,10,4\n50,30,4\n")
    options: dict[str, Any] = {"process": "drill", "machine": "linuxcnc-mill", "depth": 2, **FAST}
    outcome = api.optimize(tmp_path / "holes.csv", surface=file, solid=2, **options)
    assert outcome.written is not None
    assert float(np.nanmin(outcome.written.end[:, 2])) < 5.0
    stl = {"surface": examples / "stepped_plate.stl"}
    for more, words in (
        ({}, "csv has no solids; remove the option, or"),
        (stl, "only STEP files have solids; leave it out"),
    ):
        with pytest.raises(OptionError, match=f"^--solid: {words}"):
            api.optimize(tmp_path / "holes.csv", solid=2, **more, **options)


def test_a_unit_cannot_be_asked_for(examples: Path) -> None:
    with pytest.raises(LeafcutError, match="defines its own unit"):
        api.optimize(examples / "stepped_plate.step", process="drill", units="in", **FAST)


@pytest.mark.slow
def test_json_stays_whole_whatever_opencascade_says(
    examples: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()  # a process of its own, as outside the tests
    words = ["drill", str(examples / "stepped_plate.step"), "--machine", "linuxcnc-mill", "--preset", "fast", "--json"]
    assert run([*words, "--dry-run"]) == 0
    assert json.loads(capfd.readouterr().out)["counts"]["holes"] == 36
