"""Plates with steps and bosses: every hole at its height, every move clear of the part and as low as possible."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import LeafcutError, VerifyError
from leafcut.model.cycles import expand_cycles
from leafcut.model.toolpath import Kind, ToolpathBuilder
from leafcut.proof.surface import check_surface
from meshes import binary_stl, box_triangles
from rs274_moves import moves_of_rs274, run_rs274

#: Three steps, and four bosses on them.
STEPS = [(0, 0, -20, 40, 80, 0), (40, 0, -20, 80, 80, -6), (80, 0, -20, 120, 80, -12)]
BOSSES = [(15, 30, 0, 25, 50, 18), (55, 20, -6, 65, 35, 15), (55, 50, -6, 65, 62, 15), (95, 35, -12, 108, 48, 10)]
RADIUS = 2.5
#: File → number of drilled holes.
COUNTS = {"holes.csv": 24, "many_holes.csv": 40}
HOLES = [
    (x, y)
    for x in range(5, 120, 10)
    for y in range(5, 80, 10)
    if not any(b[0] - 4 < x < b[3] + 4 and b[1] - 4 < y < b[4] + 4 for b in BOSSES) and abs(x - 40) > 4 < abs(x - 80)
]
FAST: dict[str, Any] = {"preset": "fast", "threads": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the plate as STL, and its holes in shuffled tables."""
    made = tmp_path_factory.mktemp("plate")
    boxes = np.concatenate([box_triangles(*box) for box in (*STEPS, *BOSSES)])
    (made / "plate.stl").write_bytes(binary_stl(boxes))
    (made / "inches.stl").write_bytes(binary_stl(boxes / 25.4))
    order = np.random.default_rng(3).permutation(len(HOLES))
    for name, count in COUNTS.items():
        rows = "".join(f"{HOLES[k][0]},{HOLES[k][1]},{2 * RADIUS:g}\n" for k in order[:count])
        (made / name).write_text("x,y,diameter\n" + rows)
    return made


def drilled(folder: Path, holes: str = "holes.csv", **options: Any) -> Any:
    common = {"surface": str(folder / "plate.stl"), "depth": "through", "machine": "linuxcnc-mill", **FAST}
    return api.optimize(folder / holes, process="drill", **{**common, **options})


@pytest.fixture(scope="module")
def low(folder: Path) -> Any:
    """Return the outcome with the lowest possible moves."""
    return drilled(folder)


def top_at(x: float, y: float) -> float:
    return max(z for x0, y0, _, x1, y1, z in STEPS if x0 <= x <= x1 and y0 <= y <= y1)


def nearest_above(x: float, y: float, z: float) -> float:
    """Return the horizontal distance to the nearest part higher than z; exact for boxes."""
    higher = [box for box in (*STEPS, *BOSSES) if box[5] > z]
    away = [math.hypot(max(b[0] - x, x - b[3], 0.0), max(b[1] - y, y - b[4], 0.0)) for b in higher]
    return min(away, default=math.inf)


def test_every_hole_begins_at_its_height_and_goes_through_the_part(low: Any) -> None:
    """R is 2 mm above its step; the full diameter ends 0.5 mm below the underside of the part."""
    path = low.path_after
    point = RADIUS / math.tan(math.radians(59))
    found = {
        tuple(path.end[row, :2].tolist()): (path.cycles[path.ref[row]].r_plane, path.cycles[path.ref[row]].bottom)
        for row in np.flatnonzero(path.kind == Kind.DRILL)
    }
    assert len(found) == COUNTS["holes.csv"]
    for (x, y), (r_plane, bottom) in found.items():
        assert r_plane == top_at(x, y) + 2.0
        assert bottom == pytest.approx(-20.0 - 0.5 - point, abs=1e-5)


@pytest.mark.parametrize("machine", ["linuxcnc-mill", "haas-vf2"])
def test_no_rapid_that_linuxcnc_makes_comes_near_to_what_stands(
    folder: Path, machine: str, rs274: str, tmp_path: Path
) -> None:
    """Tests positions 0.2 mm apart along each rapid that rs274 prints against the boxes of the plate.

    For a machine with unsynchronised axes, rs274 prints only the ends: there the whole box between them is tested.
    """
    text = drilled(folder, "many_holes.csv", machine=machine, dialect="linuxcnc").text
    status, output = run_rs274(rs274, text, tmp_path)
    assert status == 0, output
    place, rapids = (0.0, 0.0, 100.0), 0
    # The last move goes to machine Z0, which rs274 treats as program Z0.
    for move in moves_of_rs274(output)[:-1]:
        if move[0] not in ("rapid", "feed"):
            continue
        end = move[1:4]
        if move[0] == "rapid" and place[2] < 99.0:
            rapids += 1
            up = place[:2] == end[:2] and end[2] >= place[2]
            n = max(int(math.dist(place, end) / 0.2), 1)
            spots = [tuple(a + k / n * (b - a) for a, b in zip(place, end, strict=True)) for k in range(n + 1)]
            if machine == "haas-vf2":
                low = min(place[2], end[2])
                xs, ys = (np.linspace(place[axis], end[axis], 12) for axis in range(2))
                spots += [(x, y, low) for x in xs for y in ys]
            for x, y, z in spots:
                assert up or nearest_above(x, y, z - 0.5) > RADIUS, (place, end)
        place = end
    assert rapids > 2.5 * COUNTS["many_holes.csv"]


def test_low_moves_take_less_time_than_moves_above_the_highest_boss_and_have_a_gap(folder: Path, low: Any) -> None:
    high = drilled(folder, retract="initial")
    assert low.after.time_s < 0.95 * high.after.time_s
    assert low.operations[0].solution.lower_bound is not None
    assert 0.0 <= low.gap < 0.05
    assert low.verified


def test_the_search_counts_the_heights_of_moves(folder: Path, low: Any) -> None:
    """The order for low moves is faster with low moves than the order for a flat plate."""
    flat = drilled(folder, retract="initial").operations[0].hole_order
    one = {"operation": 1, "holes": [int(k) + 1 for k in flat]}
    (folder / "order.json").write_text(json.dumps({"leafcut_order": 1, "operations": [one]}))
    as_flat = drilled(folder, plan=str(folder / "order.json"))
    assert as_flat.operations[0].hole_order == flat
    assert low.after.time_s < as_flat.after.time_s


@pytest.mark.hazard
@pytest.mark.parametrize(("count", "samples"), [(120, 200), pytest.param(400, 800, marks=pytest.mark.slow)])
def test_the_proof_finds_exactly_the_moves_that_meet_the_part(count: int, samples: int) -> None:
    """Random moves at random heights, against exact distances to the boxes of the plate."""
    triangles = np.concatenate([box_triangles(*box) for box in (*STEPS, *BOSSES)])
    random, met, clear = np.random.default_rng(8), 0, 0
    for _ in range(count):
        (x0, y0), (x1, y1) = random.uniform((-10, -10), (130, 90), (2, 2)).tolist()
        z = float(random.uniform(-14, 20))
        path = ToolpathBuilder()
        path.tool(1)
        path.rapid(x0, y0, z)
        path.rapid(x1, y1)
        steps = np.linspace(0, 1, samples)
        nearest = min(nearest_above(x0 + s * (x1 - x0), y0 + s * (y1 - y0), z - 0.05) for s in steps.tolist())
        heights = {box[5] for box in (*STEPS, *BOSSES)}
        if abs(nearest - RADIUS) < 0.2 or any(abs(z - 0.05 - height) < 0.01 for height in heights):
            continue  # as near as the rounding of written places
        found = check_surface(path.build(), triangles, {1: RADIUS})
        assert bool(found) == (nearest < RADIUS), (x0, y0, x1, y1, z)
        met, clear = met + bool(found), clear + (not found)
    assert min(met, clear) > count / 8


def test_what_is_planned_too_low_is_not_written(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "leafcut.processes.drilling.plan.drill_toolpath.travel_heights",
        lambda relief, xy, dogleg: np.full(len(xy) - 1, -50.0),
    )
    with pytest.raises(VerifyError, match="touches the surface"):
        drilled(folder, algorithm="none")


@pytest.mark.parametrize("algorithm", ["acs", "firefly", "nn"])
def test_other_algorithms_find_safe_ways_too(folder: Path, algorithm: str) -> None:
    outcome = drilled(folder, algorithm=algorithm, iterations=2 if algorithm != "nn" else None)
    assert outcome.verified


def test_the_surface_needs_the_right_unit(folder: Path, low: Any) -> None:
    with pytest.raises(
        LeafcutError,
        match=r"inches\.stl is 4\.724 mm long .*in inches, the surface would contain the holes; give --surface-unit",
    ):
        drilled(folder, surface=str(folder / "inches.stl"))
    inches = drilled(folder, surface=str(folder / "inches.stl"), surface_unit="in")
    planes = [sorted(cycle.r_plane for cycle in one.path_after.cycles) for one in (inches, low)]
    assert planes[0] == pytest.approx(planes[1], abs=1e-4)


def test_the_surface_is_placed_as_the_drawing_is(folder: Path) -> None:
    """Turned by 90 degrees about zero, with the lower left hole as the origin: the same heights at the same holes."""
    outcome = drilled(folder, rotate=90, origin="lower-left")
    path = outcome.path_after
    x0, y0 = min(-y for _, y in HOLES), min(x for x, _ in HOLES)
    for row in np.flatnonzero(path.kind == Kind.DRILL):
        x, y = path.end[row, :2]
        assert path.cycles[path.ref[row]].r_plane == top_at(y + y0, -(x + x0)) + 2.0


@pytest.mark.hazard
def test_moves_pass_above_a_fixture_and_a_hole_under_a_fixture_is_refused(folder: Path, low: Any) -> None:
    high = drilled(folder, keep_out="48 0 52 12 30,30 38 36 42 25")
    assert float(high.path_after.end[:, 2][np.isfinite(high.path_after.end[:, 2])].max()) == 30.0 + 10.0
    assert high.after.time_s > low.after.time_s
    x, y = next(iter(HOLES))
    with pytest.raises(LeafcutError, match="in a keep-out zone"):
        drilled(folder, keep_out=f"{x + 1} {y + 1} {x + 9} {y + 9} 5")


#: A clamp: a foot beside the plate and an arm over it, 30 mm high, at the second step.
CLAMP = [(48, -20, -20, 52, -5, 30), (48, -20, 20, 52, 12, 30)]


@pytest.fixture(scope="module")
def clamp(folder: Path) -> Path:
    (folder / "clamp.stl").write_bytes(binary_stl(np.concatenate([box_triangles(*box) for box in CLAMP])))
    return folder / "clamp.stl"


def nearest_to_clamp(x: float, y: float, z: float) -> float:
    away = [math.hypot(max(b[0] - x, x - b[3], 0.0), max(b[1] - y, y - b[4], 0.0)) for b in CLAMP if b[5] > z]
    return min(away, default=math.inf)


def test_ways_go_round_or_over_a_fixture_of_a_file(folder: Path, clamp: Path) -> None:
    """Every place of every rapid is clear of the clamp's boxes; as a file it costs what two boxes of its size cost."""
    outcome = drilled(folder, fixture=str(clamp))
    boxes = drilled(folder, keep_out=",".join(f"{a} {b} {c} {d} {top}" for a, b, _, c, d, top in CLAMP))
    assert outcome.after.time_s == pytest.approx(boxes.after.time_s, rel=1e-3)
    path, before = outcome.written, outcome.written.before
    for row in np.flatnonzero(path.kind == Kind.RAPID):
        if not np.isfinite([*before[row], *path.end[row]]).all():
            continue
        for share in np.linspace(0.0, 1.0, 60):
            x, y, z = (1.0 - share) * before[row] + share * path.end[row]
            assert nearest_to_clamp(x, y, z) >= RADIUS
    told = [str(issue) for issue in outcome.issues if issue.code == "L444"]
    assert told == ["L444 clamp.stl measures 4 × 32 × 50 mm, and its lower corner is at (48, -20), Z-20"]


def test_the_box_around_a_fixture_that_is_not_closed_counts(folder: Path, clamp: Path) -> None:
    """The arm without its top: only the bounding box shows its height."""
    triangles = np.concatenate([box_triangles(*box) for box in CLAMP])
    topless = triangles[~(triangles[:, :, 2] == 30).all(axis=1)]
    (folder / "open.stl").write_bytes(binary_stl(topless))
    outcome = drilled(folder, fixture=str(folder / "open.stl"))
    whole = drilled(folder, keep_out="48 -20 52 12 30")
    assert outcome.after.time_s == pytest.approx(whole.after.time_s, rel=1e-3)
    assert [issue.severity for issue in outcome.issues if issue.code == "L443"][-1] == "warning"


def test_a_hole_under_a_fixture_is_refused_and_one_over_it_is_not(folder: Path) -> None:
    """A base plate below the tips of the drills is in nobody's way; one that they would enter is."""
    x, y = next(iter(HOLES))
    above = box_triangles(x + 1, y + 1, 5, x + 9, y + 9, 9)
    for name, triangles in (("over", above), ("base", box_triangles(0, 0, -30, 120, 80, -20))):
        (folder / f"{name}.stl").write_bytes(binary_stl(triangles))
        with pytest.raises(LeafcutError, match="under the fixture"):
            drilled(folder, fixture=str(folder / f"{name}.stl"))
    (folder / "deep.stl").write_bytes(binary_stl(box_triangles(0, 0, -40, 120, 80, -23)))
    assert drilled(folder, fixture=str(folder / "deep.stl")).verified


def test_a_keep_out_zone_is_crossed_at_the_clearance_height(folder: Path) -> None:
    outcome = drilled(folder, keep_out="0 9 120 11")
    path = outcome.path_after
    before = path.before
    for row in np.flatnonzero(np.isin(path.kind, (int(Kind.RAPID), int(Kind.DRILL)))):
        y0, y1 = before[row, 1], path.end[row, 1]
        if np.isfinite(y0) and (y0 < 9.0) != (y1 < 9.0):
            assert max(before[row, 2], 0.0) >= 28.0


def test_a_fixture_of_another_size_or_far_away_is_refused(folder: Path) -> None:
    odd = [
        ((500, 0, 0, 540, 40, 30), "check its unit (--surface-unit) and its origin"),
        ((0, 0, 0, 1, 1, 1), "in inches, the fixture would lie next to the surface; save the"),
        ((0, 0, 0, 9000, 10, 10), "in mm, not inches,, the fixture would lie next to the surface; save the"),
    ]
    for k, (box, told) in enumerate(odd):
        (folder / f"odd{k}.stl").write_bytes(binary_stl(box_triangles(*box)))
        with pytest.raises(LeafcutError, match=re.escape(told)):
            drilled(folder, fixture=str(folder / f"odd{k}.stl"))


def test_a_fixture_or_a_surface_that_fits_in_another_unit_gives_a_warning(folder: Path, low: Any) -> None:
    """A clamp saved in inches, a small clamp in mm, and holes of 3 mm in the corner of a plate."""
    clamp = box_triangles(-30, -2, -12, 60, -1, 0)
    for name, triangles, codes in (("inch", clamp / 25.4, ["L445"]), ("small", clamp / 25.4 + (60, -5, 0), [])):
        (folder / f"{name}.stl").write_bytes(binary_stl(triangles))
        outcome = drilled(folder, fixture=str(folder / f"{name}.stl"))
        assert [issue.code for issue in outcome.issues if issue.code == "L445"] == codes
    assert not [issue for issue in low.issues if issue.code == "L445"]
    (folder / "corner.csv").write_text("x,y,diameter\n1,1,0.3\n4,2,0.3\n")
    given: dict[str, Any] = {"surface": str(folder / "plate.stl"), "depth": 0.5, "machine": "linuxcnc-sim", **FAST}
    outcome = api.optimize(folder / "corner.csv", process="drill", **given)
    (told,) = [str(issue) for issue in outcome.issues if issue.code == "L445"]
    assert "plate.stl is 120 mm long and the holes span 3 mm, in a corner of the surface" in told


def test_a_mesh_that_is_open_at_a_hole_is_told_so(folder: Path) -> None:
    """The lowest step without its upper side."""
    triangles = np.concatenate([box_triangles(*box) for box in (*STEPS, *BOSSES)])
    gone = (triangles[:, :, 2] == -12).all(axis=1) & (triangles[:, :, 0] >= 80).all(axis=1)
    step = (triangles[:, :, 2] == -20).all(axis=1) & (triangles[:, :, 0] >= 80).all(axis=1)
    (folder / "hollow.stl").write_bytes(binary_stl(triangles[~gone & ~step]))
    with pytest.raises(LeafcutError, match=r"hollow\.stl is not closed, and has no surface at the hole at .*; repair"):
        drilled(folder, surface=str(folder / "hollow.stl"))


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"thickness": 6}, "--depth through and --thickness"),
        ({"fixture": "nothing.stl"}, "nothing.stl"),
        ({"surface": None}, "--depth through needs --surface; for a plate, give --thickness"),
        ({"surface": "nothing.stl"}, "nothing.stl"),
        ({"clearance_height": 1}, "is less than the 2 mm"),
    ],
)
def test_what_cannot_be_obeyed_is_refused_in_one_line(folder: Path, options: dict[str, Any], told: str) -> None:
    with pytest.raises(LeafcutError) as refused:
        drilled(folder, **options)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def library(file: Path, words: str) -> str:
    """Write a library with a drill of 5 mm and its parts above the flutes."""
    file.write_text(
        '[[tool]]\nnumber = 1\ndiameter = "5 mm"\nkind = "drill"\nfeed = "9 mm/s"\nspindle_speed = "1500 rpm"\n' + words
    )
    return str(file)


def meets_a_box(x: float, y: float, z: float, profile: list[tuple[float, float]], less: float) -> bool:
    """Return whether a tool with its tip at a place meets one of the boxes with its outline, narrower by some mm."""
    corners, radii = zip(*profile, strict=True)
    for box in (*STEPS, *BOSSES):
        away = math.hypot(max(box[0] - x, x - box[3], 0.0), max(box[1] - y, y - box[4], 0.0))
        # From the lower end of the outline to the top of the box.
        heights = np.linspace(corners[0], box[5] - z, 60)
        if box[5] - z > corners[0] and np.any(np.interp(heights, corners, radii) - less > away):
            return True
    return False


BODIES = [
    ('stickout = "30 mm"\nholder = "40 x 30"\n', [(30.0, 20.0), (99.0, 20.0)], {"depth": "through"}, True),
    ('stickout = "42 mm"\nholder = "40 x 30"\n', [(42.0, 20.0), (99.0, 20.0)], {"depth": "through"}, False),
    ('stickout = "26 mm"\nholder = "12 x 60"\n', [(26.0, 6.0), (99.0, 6.0)], {"depth": "through"}, True),
    ('stickout = "9 mm"\nholder = "9 x 60"\n', [(9.0, 4.5), (99.0, 4.5)], {"depth": 2}, False),
    (
        'stickout = "9 mm"\nholder = "9-28 x 12, 28 x 60"\n',
        [(9.0, 4.5), (21.0, 14.0), (99.0, 14.0)],
        {"depth": 2},
        True,
    ),
    (
        'stickout = "12 mm"\nholder = "6-10 x 20, 10 x 60"\n',
        [(12.0, 3.0), (32.0, 5.0), (99.0, 5.0)],
        {"depth": 2},
        False,
    ),
    ('flute_length = "8 mm"\nshank_diameter = "8 mm"\n', [(8.0, 4.0), (99.0, 4.0)], {"depth": 2}, False),
]


@pytest.mark.parametrize(
    ("words", "profile", "depth", "refused", "holes", "spacing"),
    [
        *((*body, "holes.csv", 1.0) for body in BODIES),
        *(pytest.param(*body, "many_holes.csv", 0.5, marks=pytest.mark.slow) for body in BODIES if not body[3]),
    ],
)
def test_a_shank_or_holder_is_refused_only_if_it_meets_the_part(
    folder: Path,
    tmp_path: Path,
    words: str,
    profile: list[tuple[float, float]],
    depth: dict[str, Any],
    refused: bool,
    holes: str,
    spacing: float,
) -> None:
    """Exact distances to the boxes of the plate judge, in each hole and at points along each move (`spacing`, mm)."""
    given = {"tools": library(tmp_path / "tools.toml", words), "holes": holes, **depth}
    bare = drilled(folder, **{"holes": holes, **depth}).path_after
    ends = [
        (*bare.end[row, :2].tolist(), bare.cycles[bare.ref[row]].bottom)
        for row in np.flatnonzero(bare.kind == Kind.DRILL)
    ]
    assert any(meets_a_box(*end, profile, 0.0) for end in ends) == refused
    if refused:
        with pytest.raises(LeafcutError, match=r"its holder, Ø .* mm, descends to Z.* and hits the surface beside"):
            drilled(folder, **given)
        return
    outcome = drilled(folder, **given)
    path, met = expand_cycles(outcome.written), 0
    for begin, end in zip(path.before, path.end, strict=True):
        if not np.isfinite((begin, end)).all():
            continue
        for share in np.linspace(0.0, 1.0, max(int(math.dist(begin, end) / spacing), 1) + 1):
            met += meets_a_box(*(begin + share * (end - begin)).tolist(), profile, 0.01)
    assert met == 0


@pytest.mark.hazard
@pytest.mark.parametrize(("count", "samples"), [(120, 200), pytest.param(300, 800, marks=pytest.mark.slow)])
def test_the_proof_finds_exactly_the_moves_whose_holder_meets_the_part(count: int, samples: int) -> None:
    """Random plunges and moves, against exact distances to the boxes of the plate."""
    triangles = np.concatenate([box_triangles(*box) for box in (*STEPS, *BOSSES)])
    random, counted = np.random.default_rng(5), [0, 0]
    for _ in range(count):
        (x0, y0), (x1, y1) = random.uniform((0, 0), (120, 80), (2, 2)).tolist()
        z, plunge = float(random.uniform(-24, 6)), bool(random.integers(2))
        path = ToolpathBuilder()
        path.tool(1)
        path.rapid(x0, y0, 60.0 if plunge else z)
        path.feed(z=z, feed=5.0) if plunge else path.feed(x1, y1, feed=5.0)
        shares = [0.0] if plunge else np.linspace(0, 1, samples).tolist()
        places = [(x0 + s * (x1 - x0), y0 + s * (y1 - y0)) for s in shares]
        nearest = min(nearest_above(x, y, z + 15.0) for x, y in places)
        if abs(nearest - 10.0) < 0.2 or any(abs(z + 15.0 - box[5]) < 0.01 for box in (*STEPS, *BOSSES)):
            continue
        found = check_surface(path.build(), triangles, {}, {1: [(15.0, 10.0)]})
        assert [one.what for one in found if one.what != "rapid into the part"] == (
            ["shank or holder in the part"] if nearest < 10.0 else []
        )
        counted[nearest < 10.0] += 1
    assert min(counted) > count / 6


@pytest.mark.parametrize("dialect", ["linuxcnc", "grbl"])
def test_pecks_go_back_into_the_hole_by_a_rapid(folder: Path, dialect: str) -> None:
    """Written out as moves, too; into a hole that is not there they may not."""
    outcome = drilled(folder, peck=4, dialect=dialect)
    path = expand_cycles(outcome.written)
    down = (path.kind == Kind.RAPID) & (path.before[:, :2] == path.end[:, :2]).all(axis=1)
    assert np.nanmin(path.end[down, 2]) < -15.0
    kinds = np.where(path.kind == Kind.FEED, int(Kind.RAPID), path.kind)
    triangles = np.concatenate([box_triangles(*box) for box in (*STEPS, *BOSSES)])
    assert check_surface(path, triangles, {1: RADIUS}) == []
    assert check_surface(replace(path, kind=kinds), triangles, {1: RADIUS})


def test_a_holder_that_is_planned_too_low_is_not_written(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("leafcut.processes.drilling.plan.work_surface.check_shank_and_holder", lambda *_: None)
    tools = library(tmp_path / "tools.toml", BODIES[0][0])
    with pytest.raises(VerifyError, match="the tool hits the surface above its flutes"):
        drilled(folder, tools=tools)


def test_a_hole_beside_the_surface_is_refused_with_its_place(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "holes.csv").write_text("x,y,diameter\n5,5,5\n119,40,5\n60,70,5\n100,10,5\n")
    with pytest.raises(LeafcutError, match=r"the hole at \(119, 40\) is beside the surface plate.stl, or on its edge"):
        api.optimize(
            tmp_path / "holes.csv", process="drill", surface=str(folder / "plate.stl"), depth="through", **FAST
        )


def spotted(folder: Path, tmp_path: Path, xy: str, depth: float) -> Any:
    """Drill a hole of 3.3 mm after a spot drill of 10 mm and 90 degrees that goes so deep."""
    (tmp_path / "tools.toml").write_text(
        '[[tool]]\nnumber = 1\ndiameter = "10 mm"\nkind = "centre-drill"\nfeed = "2 mm/s"\npoint_angle = "90 deg"\n'
        f'spindle_speed = "1500 rpm"\ndepth = "{depth} mm"\n'
        '[[tool]]\nnumber = 2\ndiameter = "3.3 mm"\nkind = "drill"\nfeed = "2 mm/s"\nspindle_speed = "1500 rpm"\n'
    )
    (tmp_path / "holes.csv").write_text(f"x,y,diameter\n{xy},3.3\n60,70,3.3\n")
    return drilled(
        folder,
        str(tmp_path / "holes.csv"),
        depth=6,
        tools=str(tmp_path / "tools.toml"),
        centre_drill=True,
    )


@pytest.mark.parametrize(("depth", "refused"), [(2.0, False), (2.8, False), (3.1, True), (5.0, True)])
def test_of_a_spot_drill_the_radius_at_its_depth_must_lie_on_the_part(
    folder: Path, tmp_path: Path, depth: float, refused: bool
) -> None:
    """The hole is 3 mm from the edge; a point of 90 degrees cuts a radius as large as its depth."""
    if refused:
        with pytest.raises(LeafcutError, match=r"the hole at \(3, 40\) is beside the surface"):
            spotted(folder, tmp_path, "3,40", depth)
    else:
        assert spotted(folder, tmp_path, "3,40", depth).verified


@pytest.mark.hazard
def test_the_full_radius_of_a_spot_drill_goes_down_above_what_stands_beside_the_hole(
    folder: Path, tmp_path: Path
) -> None:
    """A boss of 18 mm starts 4 mm from the hole: a point 2 mm deep does not reach it, the flutes do."""
    path = spotted(folder, tmp_path, "11,40", 2.0).path_after
    planes = {
        (int(path.tool[row]), tuple(path.end[row, :2].tolist())): path.cycles[path.ref[row]].r_plane
        for row in np.flatnonzero(path.kind == Kind.DRILL)
    }
    assert planes[1, (11.0, 40.0)] == 20.0
    assert planes[1, (60.0, 70.0)] == -4.0


def test_uneven_rims_and_other_drawn_heights_are_told(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "holes.csv").write_text("x,y,z,diameter\n5,5,0,5\n40,10,0,5\n60,70,-7,5\n")
    given = {"surface": str(folder / "plate.stl"), "depth": "through", "z_zero": "drawn", **FAST}
    outcome = api.optimize(tmp_path / "holes.csv", process="drill", **given)
    told = {issue.code: str(issue) for issue in outcome.issues}
    counts = "; R planes are measured from the highest point of the rim, depths from the drawing"
    assert f"at (40, 10), the rim is between Z-6.000 and Z0.000{counts}" in told["L441"]
    assert (
        "at (60, 70), the drawing has Z-7.000 and the surface Z-6.000; depths are measured from the drawing"
        in told["L442"]
    )
    outcome = api.optimize(tmp_path / "holes.csv", process="drill", **{**given, "z_zero": None})
    told = {issue.code: str(issue) for issue in outcome.issues}
    assert "the surface Z-6.000; the height of the surface is used" in told["L442"]


def test_the_command_line_gives_the_same_time(
    folder: Path, low: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [
        "drill",
        str(folder / "holes.csv"),
        "--surface",
        str(folder / "plate.stl"),
        "--depth",
        "through",
        "--preset",
        "fast",
    ]
    assert run([*words, "--machine", "linuxcnc-mill", "-o", str(tmp_path / "out.ngc"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["verified"]
    assert answer["after"]["time_s"] == pytest.approx(low.after.time_s)
    assert answer["low_ways_saved_s"] > 10.0
    assert run([*words, "--machine", "linuxcnc-mill", "-o", str(tmp_path / "out.ngc")]) == 0
    assert "saved compared with moves at the greatest height" in capsys.readouterr().out
