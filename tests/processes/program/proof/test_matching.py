"""Features of two programs: every change in words, at both sides of each tolerance, and pairs one to one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.model.toolpath import DrillCycle, Kind, ToolpathBuilder
from leafcut.processes.program.proof.features import (
    AMOUNT,
    EXACT,
    HEIGHT,
    PLACE,
    Features,
    feature_kind_name,
)
from leafcut.processes.program.proof.matching import (
    Feature,
    MatchTolerance,
    cells_around,
    feature_changes,
    match_features,
    match_one_by_one,
    sorted_into_cells,
)
from rewriting import features_in

ROOM = MatchTolerance(0.002)
G81, G83 = (int.from_bytes(name, "big") for name in (b"G81", b"G83"))
VALUES = {
    **dict.fromkeys((*EXACT, *PLACE, *AMOUNT, *HEIGHT), 0.0), "kind": int(Kind.FEED), "plane": 17, "turns": 1,
    "tool": 1, "coolant": 2, "length": 1, "frame": 540, "radius": 40, "blending": 640, "feed_mode": 94, "spindle": 1,
    "stated": 7, "obeyed": 0, "table": 0, "x": 10.0, "y": 20.0, "depth": -1.0, "feed": 10.0, "speed": 1000.0,
    "r_plane": 2.0, "retract": 5.0,
}  # fmt: skip


def feature(number: int = 0, group: int = 0, **values: float) -> Feature:
    """A cut to X10 Y20 Z-1 with tool 1, with other values where given (blanks as underscores)."""
    all_values = {**VALUES, **{name if name in VALUES else name.replace("_", " "): v for name, v in values.items()}}
    sides = [tuple(all_values[name] for name in names) for names in (EXACT, PLACE, AMOUNT, HEIGHT)]
    return Feature(number, number + 1, group, *sides)  # type: ignore[arg-type]


def told(before: dict[str, float], after: dict[str, float], room: MatchTolerance = ROOM) -> list[str]:
    return [change.message for change in feature_changes(feature(**before), feature(**after), room)]


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ({}, {"kind": Kind.ARC_CW}, ["cut became clockwise arc"]),
        ({"kind": Kind.ARC_CCW}, {}, ["counter-clockwise arc became cut"]),
        ({}, {"kind": Kind.RAPID}, ["cut became rapid under radius compensation"]),
        ({"kind": Kind.DWELL}, {"kind": G81}, ["dwell became G81"]),
        ({}, {"plane": 18}, ["plane G17 became G18"]),
        ({}, {"tool": 2}, ["tool 1 became 2"]),
        ({"coolant": 0}, {"coolant": 1}, ["coolant M9 became M7"]),
        ({}, {"coolant": 3}, ["coolant M8 became M7 M8"]),
        ({}, {"length": 2}, ["length offset 1 became 2"]),
        ({}, {"length": -3}, ["length offset 1 became unknown"]),
        ({}, {"table": 3}, ["number of blocks before the length offset that may change the tool table 0 became 3"]),
        ({}, {"frame": 591}, ["work offset G54 became G59.1"]),
        ({}, {"radius": 41}, ["radius compensation G40 became G41"]),
        ({}, {"radius": -40}, ["radius compensation G40 became unknown"]),
        ({}, {"blending": 611}, ["blending G64 became G61.1"]),
        ({}, {"blending": 0}, ["blending G64 became not stated"]),
        ({}, {"feed_mode": 93}, ["feed mode G94 became G93"]),
        ({}, {"spindle": -1}, ["direction of the spindle M3 became M4"]),
        ({}, {"spindle": 0}, ["direction of the spindle M3 became M5"]),
        ({}, {"obeyed": 2}, ["number of the preceding controller settings, (o=…) or #<…>, 0 became 2"]),
        ({}, {"turns": 2}, ["turns of the arc 1 became 2"]),
        ({}, {"stated": 6}, ["the units (G20, G21) are no longer stated"]),
        ({"stated": 6}, {}, ["the units (G20, G21) are now stated"]),
        ({}, {"stated": 5}, ["the spindle is no longer started after the tool change"]),
        ({"stated": 5}, {}, ["the spindle is now started after the tool change"]),
        ({}, {"stated": 3}, ["the length offset is no longer applied after the tool change or the machine move"]),
        ({"stated": 3}, {}, ["the length offset is now applied after the tool change or the machine move"]),
        ({}, {"x": 10.5, "y": 19.0, "depth": -2.0}, ["x 10 became 10.5", "y 20 became 19", "depth -1 became -2"]),
        ({}, {"depth": math.nan}, ["depth -1 became unknown"]),
        ({"depth": math.nan}, {"depth": math.nan}, []),
        ({}, {"peck": 1.0}, ["peck 0 became 1"]),
        ({}, {"dwell": 0.5}, ["dwell 0 became 0.5"]),
        ({}, {"feed": 10.5}, ["feed in mm/min 600 became 630"]),
        ({}, {"speed": 1100.0}, ["speed 1000 became 1100"]),
        ({}, {"register": 1.0}, ["D 0 became 1"]),
        ({}, {"tolerance": 0.1}, ["blending tolerance 0 became 0.1"]),
        ({}, {"joining": 0.1}, ["tolerance of short moves 0 became 0.1"]),
        ({}, {"r_plane": 1.0}, ["R plane 2 was lowered to 1"]),
        ({}, {"r_plane": 3.0}, ["R plane 2 was raised to 3"]),
        ({}, {"retract": 4.0}, ["retract 5 was lowered to 4"]),
        ({}, {"retract": 9.0}, []),
        ({}, {"retract": math.nan}, ["retract 5 was lowered to unknown"]),
        ({"retract": math.nan}, {"retract": math.nan}, []),
        ({}, {"start_x": 3.0}, ["start X0.000 Y0.000 Z0.000 became X3.000 Y0.000 Z0.000"]),
        ({}, {"start_y": 3.0, "start_z": 1.0}, ["start X0.000 Y0.000 Z0.000 became X0.000 Y3.000 Z1.000"]),
        ({}, {"start_z": 3.0}, ["start Z0 became Z3"]),
        ({}, {"centre_x": 3.0}, ["centre of the arc X0.000 Y0.000 Z0.000 became X3.000 Y0.000 Z0.000"]),
        ({}, {"centre_x": 3.0, "start_x": 3.0}, ["start X0.000 Y0.000 Z0.000 became X3.000 Y0.000 Z0.000"]),
        (
            {},
            {"centre_y": 3.0, "start_x": 3.0},
            [
                "centre of the arc X0.000 Y0.000 Z0.000 became X0.000 Y3.000 Z0.000",
                "start X0.000 Y0.000 Z0.000 became X3.000 Y0.000 Z0.000",
            ],
        ),
        ({"kind": Kind.ARC_CW}, {"tool": 2}, ["clockwise arc became cut", "tool 1 became 2"]),
    ],
)  # fmt: skip
def test_each_change_of_a_feature_is_described(
    before: dict[str, float], after: dict[str, float], words: list[str]
) -> None:
    assert told(before, after) == words


def test_with_a_beam_s_is_its_power() -> None:
    assert told({}, {"speed": 900.0}, MatchTolerance(0.002, beam=True)) == ["power 1000 became 900"]


@pytest.mark.parametrize(
    ("name", "value", "room"),
    [
        *((name, 0.0, 0.002) for name in PLACE),
        *((name, 0.0, 0.002) for name in ("peck", "tolerance", "joining")),
        ("dwell", 0.0, 1e-4),
        ("feed", 1.0, 1e-4),
        ("feed", 100.0, 5e-3),
        ("speed", 100.0, 1e-3),
        ("speed", -9000.0, 9e-3),
    ],
)
def test_each_value_may_differ_by_its_tolerance(name: str, value: float, room: float) -> None:
    for sign in (-1, 1):
        near, far = ({name.replace(" ", "_"): value + sign * room * part} for part in (0.98, 1.02))
        given = {name.replace(" ", "_"): value}
        assert told(given, near) == [] and len(told(given, far)) == 1


def test_heights_may_sink_by_the_tolerance() -> None:
    for name, value in (("r_plane", 2.0), ("retract", 5.0)):
        assert told({}, {name: value - 0.0019}) == [] and told({}, {name: value - 0.0021}) != []
    assert told({}, {"r_plane": 2.0019}) == [] and told({}, {"r_plane": 2.0021}) != []


def test_cells_are_four_tolerances_wide_and_neighbours_follow_only_near_an_edge() -> None:
    def cells(x: float, y: float, axes: int = 2) -> list[tuple[int, ...]]:
        return list(cells_around(feature(x=x, y=y, depth=0.004), 0.002, axes))

    assert cells(0.004, 0.012) == [(0, 1)]
    assert cells(0.0019, 0.004) == [(0, 0), (-1, 0)]
    assert cells(0.0061, 0.0019) == [(0, 0), (0, -1), (1, -1), (1, 0)]
    assert cells(0.004, 0.012, 3) == [(0, 1, 0)]
    assert cells(math.nan, 0.0019) == [(1 << 62, 0), (1 << 62, -1)]
    assert next(cells_around(feature(x=0.0, y=0.5e-6), 0.0, 2)) == (0, 0)


def test_features_are_sorted_into_their_own_cells_in_order() -> None:
    features = [feature(k, x=x) for k, x in enumerate((0.001, 0.02, 0.003))]
    assert [[f.number for f in cell] for cell in sorted_into_cells(features, 0.002, 1).values()] == [[0, 2], [1]]


@pytest.mark.parametrize("seed", range(6))
def test_pairs_are_equal_and_as_many_as_there_can_be(seed: int) -> None:
    """Few distinct places, some noise: what is left over on one side equals nothing on the other."""
    rng = np.random.default_rng(seed)

    def side(n: int) -> list[Feature]:
        return [
            feature(
                k,
                int(rng.integers(2)),
                x=float(rng.integers(3)) + float(rng.choice([0.0, 4e-4])),
                tool=int(rng.integers(2)),
            )
            for k in range(n)
        ]

    before, after = side(40), side(35)
    pairs, missing, extra = match_one_by_one(before, after, ROOM)

    def equal(a: Feature, b: Feature) -> bool:
        return a.group == b.group and a.exact == b.exact and feature_changes(a, b, ROOM) == []

    assert all(equal(a, b) for a, b in pairs)
    assert not any(equal(a, b) for a in missing for b in extra)
    assert sorted([a for a, _ in pairs] + missing) == before and sorted([b for _, b in pairs] + extra) == after
    assert extra == sorted(extra)


def test_equal_features_are_paired_in_order() -> None:
    before, after = [feature(k) for k in range(4)], [feature(k) for k in range(5)]
    pairs, missing, extra = match_one_by_one(before, after, ROOM)
    assert [(a.number, b.number) for a, b in pairs] == [(0, 0), (1, 1), (2, 2), (3, 3)]
    assert missing == [] and [f.number for f in extra] == [4]


def holes(*places: tuple[float, float], tool: int = 1) -> Features:
    builder = ToolpathBuilder()
    builder.tool(tool)
    builder.spindle(1000)
    builder.rapid(z=5.0)
    for k, (x, y) in enumerate(places):
        builder.drill(x, y, DrillCycle("G83", 2.0, -3.0, peck=1.0, dwell=0.5), feed=2.0, line=k + 1)
    path = builder.build()
    return features_in(path, path.kind == Kind.DRILL)


A, B, C, D = (0.0, 0.0), (10.0, 0.0), (20.0, 5.0), (30.0, 5.0)


@pytest.mark.parametrize(
    ("before", "after", "new_of", "missing", "extra"),
    [
        ([A, B, C], [A, B, C], [0, 1, 2], [], []),
        ([A, B, C], [C, A, B], [1, 2, 0], [], []),
        ([A, B, C], [A, C], [0, -1, 1], [1], []),
        ([A, C], [A, B, C], [0, 2], [], [1]),
        ([A, A, B, A], [A, B, A, A], [0, 2, 1, 3], [], []),
        ([A, B, C, D], [A, C, B, D], [0, 2, 1, 3], [], []),
        ([A, B], [A, (10.0, 0.003)], [0, -1], [1], [1]),
        ([A, B], [(0.0, 0.0015), B], [0, 1], [], []),
        ([A, B], [B, (0.0, 0.0015)], [1, 0], [], []),
        ([], [A], [], [], [0]),
        ([A], [], [-1], [0], []),
    ],
)
def test_features_are_matched_whatever_their_order(
    before: list[tuple[float, float]],
    after: list[tuple[float, float]],
    new_of: list[int],
    missing: list[int],
    extra: list[int],
) -> None:
    found = match_features(holes(*before), holes(*after), ROOM)
    assert found.new_of.tolist() == new_of
    assert [f.number for f in found.missing] == missing and [f.number for f in found.extra] == extra
    assert match_features(holes(*before), holes(*after, tool=2), ROOM).new_of.tolist() == [-1] * len(before)


def test_a_hole_has_the_values_of_its_cycle_and_state() -> None:
    made = holes(A, D)
    values = {name: made.of(name).tolist() for name in (*PLACE, *AMOUNT, *HEIGHT, "kind", "tool", "plane", "turns")}
    assert values == {
        "x": [0.0, 30.0],
        "y": [0.0, 5.0],
        "depth": [-3.0, -3.0],
        "start x": [0.0, 30.0],
        "start y": [0.0, 5.0],
        "start z": [0.0, 0.0],
        "centre x": [0.0, 0.0],
        "centre y": [0.0, 0.0],
        "centre z": [0.0, 0.0],
        "feed": [2.0, 2.0],
        "speed": [1000.0, 1000.0],
        "peck": [1.0, 1.0],
        "dwell": [0.5, 0.5],
        "register": [0.0, 0.0],
        "tolerance": [0.0, 0.0],
        "joining": [0.0, 0.0],
        "r_plane": [2.0, 2.0],
        "retract": [2.0, 2.0],
        "kind": [G83, G83],
        "tool": [1, 1],
        "plane": [0, 0],
        "turns": [0, 0],
    }
    assert made.several(("x", "y")).tolist() == [[0.0, 0.0], [30.0, 5.0]] and made.line.tolist() == [1, 2]
    assert len(made.pick(np.array([1]))) == 1 and made.pick(np.array([1])).of("x").tolist() == [30.0]
    assert [feature_kind_name(kind) for kind in (G83, int(Kind.FEED))] == ["G83", "cut"]
