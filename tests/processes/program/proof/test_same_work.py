"""The same work in any order: order is free, the work is not."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.gcode.program import Program
from leafcut.model.cycles import expand_cycles
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Arc, DrillCycle, Toolpath, ToolpathBuilder
from leafcut.processes.program.proof.certificate import certify

Hole = tuple[float, float, DrillCycle]
G81 = DrillCycle("G81", 2.0, -5.0)
G83 = DrillCycle("G83", 2.0, -12.0, peck=4.0)
G82 = DrillCycle("G82", 2.0, -1.0, dwell=0.5)
HOLES: list[Hole] = [(10.0 * i, 7.0 * (i % 3), cycle) for i, cycle in enumerate((G81, G83, G82, G81, G81, G83))]


def same_work(original: Toolpath, new: Toolpath, tolerance: float = 0.002) -> list[Difference]:
    """Return the differences between two programs of which only the motion is known."""

    def program(path: Toolpath) -> Program:
        # Every line states the plane and the return of cycles, whatever moves are on it.
        return Program.of_toolpath(path, ["G17 G99\n"] * (int(path.line.max(initial=0)) + 1))

    return list(certify(program(original), program(new), tolerance_mm=tolerance).differences)


def drill(
    holes: list[Hole], *, tool: int = 1, rpm: float = 3000.0, feed: float = 2.0, coolant: int = 0, clear: float = 10.0
) -> Toolpath:
    builder = ToolpathBuilder()
    builder.tool(tool)
    builder.spindle(rpm)
    builder.coolant(coolant)
    builder.rapid(0.0, 0.0, clear)
    for x, y, cycle in holes:
        builder.drill(x, y, cycle, feed=feed)
    builder.rapid(z=clear)
    path = builder.build()
    return replace(path, line=np.arange(1, len(path) + 1, dtype=np.int32))


def with_hole(which: int, hole: Hole) -> list[Hole]:
    return [*HOLES[:which], hole, *HOLES[which + 1 :]]


def retouched(which: int, **words: object) -> list[Hole]:
    x, y, cycle = HOLES[which]
    return with_hole(which, (x, y, replace(cycle, **words)))


MUTATIONS: dict[str, tuple[Toolpath, str]] = {
    "one depth": (drill(retouched(3, bottom=-5.1)), "depth -5 became -5.1"),
    "one feed": (drill(HOLES, feed=2.1), "feed in mm/min 120 became 126"),
    "one hole less": (drill(HOLES[:-1]), "G83 at X50.000 Y14.000 Z-12.000 with tool 1 is missing"),
    "one hole more": (drill([*HOLES, (99.0, 0.0, G81)]), "G81 at X99.000 Y0.000 Z-5.000 with tool 1 is new"),
    "one hole twice": (drill([*HOLES, HOLES[2]]), "G82 at X20.000 Y14.000 Z-1.000 with tool 1 is new"),
    "one hole moved": (drill(with_hole(0, (0.01, 0.0, G81))), "is now at X0.010 Y0.000"),
    "R plane lower": (drill(retouched(3, r_plane=1.0)), "R plane 2 was lowered to 1"),
    "another tool": (drill(HOLES, tool=2), "'change to tool 1' became 'change to tool 2'"),
    "another speed": (drill(HOLES, rpm=2500), "speed 3000 became 2500"),
    "backwards": (drill(HOLES, rpm=-3000), "speed 3000 became -3000"),
    "another peck": (drill(retouched(1, peck=12.0)), "peck 4 became 12"),
    "another dwell": (drill(retouched(2, dwell=0.0)), "dwell 0.5 became 0"),
    "another cycle": (drill(retouched(3, name="G85")), "G81 became G85"),
    "no coolant": (drill(HOLES, coolant=2), "coolant M9 became M8"),
}


@pytest.mark.hazard
@pytest.mark.parametrize("what", MUTATIONS)
def test_every_change_of_the_work_is_seen_and_said(what: str) -> None:
    new, words = MUTATIONS[what]
    found = [str(d) for d in same_work(drill(HOLES), new)]
    assert any(words in text for text in found), found
    assert all("\n" not in text for text in found)


@pytest.mark.parametrize("what", MUTATIONS)
def test_every_change_is_seen_when_one_program_has_no_cycles(what: str) -> None:
    new, _ = MUTATIONS[what]
    if what != "another cycle":  # feeding up instead of a rapid is a cut more, below
        assert same_work(drill(HOLES), expand_cycles(new))
        assert same_work(expand_cycles(drill(HOLES)), new)
    assert same_work(expand_cycles(drill(HOLES)), expand_cycles(new))


@given(st.randoms(use_true_random=False))
def test_order_is_free(rng: random.Random) -> None:
    shuffled = HOLES.copy()
    rng.shuffle(shuffled)
    assert same_work(drill(HOLES), drill(shuffled)) == []


def test_the_same_work_with_and_without_cycles_is_the_same() -> None:
    assert same_work(drill(HOLES), expand_cycles(drill(HOLES[::-1]))) == []
    assert same_work(expand_cycles(drill(HOLES)), drill(HOLES[::-1])) == []


def test_higher_planes_are_no_difference_but_lower_ones_are() -> None:
    high = [(x, y, replace(c, to_initial=True)) for x, y, c in HOLES]
    assert same_work(drill(HOLES), drill(high)) == []
    found = same_work(drill(high), drill(HOLES))
    assert any(d.what == "changed hole" for d in found)


def test_a_rapid_across_that_sinks_is_seen_without_cycles_too() -> None:
    """The same cuts, but between them the tool rises to 1 mm only, where it was raised to 4 before."""

    def slots(height: float) -> Toolpath:
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 10.0)
        for x in (0.0, 20.0):
            builder.rapid(x, 0.0)
            builder.rapid(z=1.0)
            builder.feed(z=-1.0, feed=1.0)
            builder.rapid(z=height)
        return builder.build()

    assert same_work(slots(4.0), slots(5.0)) == []
    found = same_work(slots(4.0), slots(1.0))
    assert {d.what for d in found} == {"lower retract", "lower approach"}
    assert any("Z1.000 instead of Z4.000" in str(d) for d in found)


def test_places_within_the_tolerance_are_the_same_wherever_they_lie() -> None:
    rng = np.random.default_rng(7)
    places = rng.uniform(0, 300, (500, 2))
    moved = places + rng.uniform(-0.0019, 0.0019, places.shape)
    holes = [(float(x), float(y), G81) for x, y in places]
    others = [(float(x), float(y), G81) for x, y in moved[rng.permutation(500)]]
    assert same_work(drill(holes), drill(others)) == []
    assert len(same_work(drill(holes), drill(others), 0.0005)) > 20


def cuts(order: int = 1, center: float = 5.0, turns: int = 1, end: float = 20.0, down: float = -1.0) -> Toolpath:
    """Two slots and an arc, forwards or in the other order."""
    builder = ToolpathBuilder()
    builder.tool(3)
    builder.spindle(9000)
    builder.rapid(0.0, 0.0, 5.0)
    parts: list[Callable[[], None]] = [
        lambda: builder.feed(x=end, feed=4.0),
        lambda: builder.arc(False, (30.0, 10.0, down), Arc((30.0, center, 0.0), turns=turns), feed=4.0),
    ]
    for x, part in list(zip((10.0, 30.0), parts, strict=True))[::order]:
        builder.rapid(x, 0.0)
        builder.feed(z=down, feed=1.0)
        part()
        builder.rapid(z=5.0)
    return builder.build()


def test_cuts_are_free_in_order_and_in_nothing_else() -> None:
    assert same_work(cuts(), cuts(-1)) == []
    for other in (cuts(-1, center=5.1), cuts(-1, turns=2), cuts(-1, end=21.0), cuts(-1, down=-1.1)):
        found = same_work(cuts(), other)
        assert found
        assert all("cut" in d.what for d in found)


def test_a_cut_the_other_way_round_is_another_cut() -> None:
    """Climb milling is not conventional milling."""
    forth, back = ToolpathBuilder(), ToolpathBuilder()
    for builder, ends in ((forth, (0.0, 9.0)), (back, (9.0, 0.0))):
        builder.rapid(ends[0], 0.0, 0.0)
        builder.feed(x=ends[1], feed=1.0)
    assert len(same_work(forth.build(), back.build())) == 2


def test_nothing_is_the_same_as_nothing() -> None:
    empty = ToolpathBuilder().build()
    assert same_work(empty, empty) == []
    for found in (same_work(empty, drill(HOLES)), same_work(drill(HOLES), empty)):
        (holes,) = [d for d in found if "hole" in d.what]
        assert 1 + len(holes.also) == len(HOLES)


def test_ten_thousand_holes_of_which_one_is_a_little_deeper() -> None:
    holes = [(0.5 * (i % 100), 0.5 * (i // 100), G81) for i in range(10_000)]
    others = holes[::-1].copy()
    x, y, _ = others[4321]
    others[4321] = (x, y, replace(G81, bottom=-5.003))
    found = same_work(drill(holes), drill(others))
    assert [d.what for d in found] == ["changed hole"]
