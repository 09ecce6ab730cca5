"""Chains: several outlines with one pierce, and the torch burning from one to the next only through scrap."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest
import shapely
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from cut_sheets import (
    PLASMA,
    assert_bridges_in_scrap,
    assert_leads_in_scrap,
    assert_nothing_is_gouged,
    bridges_of,
    chained,
    cutting_of,
    part_in_hole,
    ring,
    rules_of,
    runs_clockwise,
    sheet_of,
    square,
    two_squares,
)
from leafcut.errors import OptionError
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Cut
from leafcut.processes.sheet.plan import chains
from leafcut.processes.sheet.plan.cutting import Cutting, drawing_order

KERF = PLASMA.kerf


def cuts_of(cutting: Cutting) -> list[Cut]:
    return [cutting.cut(s) for s in drawing_order(cutting)]


def lower_in_the_middle():
    """Three parts in a row; from the top of the lower one in the middle both others can be reached."""
    return sheet_of((square(20, 20, 50), 0, -1, 1), (square(85, 20, 20), 0, -1, 2), (square(120, 20, 50), 0, -1, 3))


def test_two_squares_are_cut_with_one_pierce_and_the_shortest_bridge() -> None:
    """20 mm between the squares are 20 − 1.5 mm between the kerfs."""
    cutting = chained(cutting_of(two_squares()))
    (cut,) = cuts_of(cutting)
    assert sorted(cut.contours) == [0, 1]
    (bridge,) = bridges_of(cut)
    assert bridge.length == pytest.approx(18.5, abs=0.3)
    assert [c.bridge for c in cut.choices] == [False, True]
    assert_nothing_is_gouged(cutting.sheet, [cut], KERF)
    assert_bridges_in_scrap(cutting.sheet, [cut], KERF)


def test_the_path_of_a_chain_is_lead_in_contours_bridges_and_lead_out() -> None:
    """Two outlines half a kerf beside squares of 50 mm are 2 · (200 + 2π · 0.75) mm long."""
    cutting = chained(cutting_of(two_squares()))
    start = cutting.starts[0]
    cut = cutting.cut(start)
    leads = start.lead_in.length + start.then[-1].lead_out.length
    both = 2 * (200 + math.tau * 0.5 * KERF)
    bridge = sum(high - low for low, high in cut.bridges)
    assert cut.path.length == pytest.approx(leads + both + bridge, abs=0.05)
    assert cut.lead_in == pytest.approx(start.lead_in.length)
    assert cut.bridges[0][0] == pytest.approx(cut.lead_in + 0.5 * both, abs=0.05)
    assert cutting.cutting_time(start) == pytest.approx(cut.path.length / PLASMA.feed + PLASMA.pierce_delay, rel=1e-4)
    for low, high in itertools.pairwise([cut.lead_in, *itertools.chain(*cut.bridges), cut.lead_out]):
        length = high - low
        assert length == pytest.approx(0.5 * both, abs=0.05) or length == pytest.approx(bridge, abs=0.05)


def test_a_bridge_that_takes_longer_than_a_pierce_is_not_made() -> None:
    """A pierce of 0.5 s, 0.5 s down and up and leads of 6 + 6 mm cost 1.6 s, 32 mm at 20 mm/s; rapids 2.8 mm more."""
    near, far = cutting_of(two_squares(33.0)), cutting_of(two_squares(38.0))
    assert len(chained(near).first_contours) == 1
    assert chained(far) is far


def test_three_in_a_row_have_one_pierce_when_piercing_takes_long() -> None:
    """The middle one is left where it was come to: its bridges meet there and are at least 40 degrees apart."""
    cutting = chained(cutting_of(lower_in_the_middle()), overhead=6.0)
    (cut,) = cuts_of(cutting)
    assert sorted(cut.contours) == [0, 1, 2]
    first, second = bridges_of(cut)
    (a, b), (c, d) = ((bridge.coords[0], bridge.coords[-1]) for bridge in (first, second))
    assert math.dist(b, c) < 0.01
    across = sum((p - q) * (r - s) for p, q, r, s in zip(a, b, d, c, strict=True))
    angle = math.acos(across / first.length / second.length)
    assert angle >= math.radians(40.0)
    assert_bridges_in_scrap(cutting.sheet, [cut], KERF)


def test_a_chain_has_no_more_contours_than_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chains, "MOST_CONTOURS", 2)
    cutting = chained(cutting_of(lower_in_the_middle()), overhead=6.0)
    assert sorted(len(c.contours) for c in cuts_of(cutting)) == [1, 2]


def test_a_part_in_a_hole_is_chained_with_the_hole_which_comes_last() -> None:
    """The hole lets the scrap around the part go; the part around the hole comes after both."""
    cutting = chained(cutting_of(part_in_hole()), overhead=6.0)
    order = [c.contours for c in cuts_of(cutting)]
    assert order == [(3,), (2, 1), (0,)]
    cuts = cuts_of(cutting)
    assert_nothing_is_gouged(cutting.sheet, cuts, KERF)
    assert_bridges_in_scrap(cutting.sheet, cuts, KERF)
    # Each contour keeps its direction: the part clockwise, the hole around it the other way.
    chain = cuts[1]
    spans = [chain.lead_in, *itertools.chain(*chain.bridges), chain.lead_out]
    pieces = [chain.path.piece(low, high) for low, high in zip(spans[::2], spans[1::2], strict=True)]
    turning = [Cut((0,), p, 0.0, p.length, p.length, ((0.0, 1.0),), chain.choice) for p in pieces]
    assert [runs_clockwise(t) for t in turning] == [True, False]


def test_a_hole_is_never_chained_with_the_outline_around_it() -> None:
    cutting = cutting_of(ring())
    assert chained(cutting, overhead=100.0) is cutting


def test_no_bridge_crosses_a_part_or_a_clamp_between_two_parts() -> None:
    wall = Polyline.of_points([(78, -100), (82, -100), (82, 200), (78, 200)], closed=True)
    between = sheet_of((square(20, 20, 50), 0, -1, 1), (square(90, 20, 50), 0, -1, 2), (wall, 0, -1, 3))
    cut = next(c for c in cuts_of(chained(cutting_of(between), overhead=6.0)) if len(c.contours) > 1)
    assert set(itertools.pairwise(cut.contours)).isdisjoint({(0, 1), (1, 0)})
    clamped = sheet_of(
        (square(20, 20, 50), 0, -1, 1), (square(90, 20, 50), 0, -1, 2), zones=[(79.0, -100.0, 81.0, 200.0)]
    )
    plain = cutting_of(clamped)
    assert chained(plain, overhead=1.0) is plain


def test_leads_of_other_cuts_keep_away_from_bridges(monkeypatch: pytest.MonkeyPatch) -> None:
    """A small part beside a bridge has leads on the sides that face away from it only."""
    sheet = sheet_of(
        (square(20, 20, 50), 0, -1, 1), (square(90, 20, 50), 0, -1, 2), (Polyline.circle(80, 100, 4), 0, -1, 3)
    )
    monkeypatch.setattr(chains, "MOST_CONTOURS", 2)
    cutting = chained(cutting_of(sheet))
    bridges = [b for s in cutting.starts if s.then for b in bridges_of(cutting.cut(s))]
    singles = [cutting.cut(s) for s in cutting.starts if not s.then]
    assert bridges
    assert singles
    assert_leads_in_scrap(sheet, singles, KERF)
    for cut in singles:
        line = shapely.LineString(cut.path.flattened(0.01))
        assert all(line.distance(b) >= KERF - 0.04 for b in bridges)


def test_what_a_plan_file_fixes_is_in_no_chain() -> None:
    cutting = replace(cutting_of(two_squares()), fixed={0: ("start",)})
    assert chained(cutting) is cutting


def test_a_joint_at_the_end_of_an_outline_is_left_in_a_chain_too() -> None:
    """A joint of 0.5 mm and the kerf's round ends of 1.5 mm stay: either body is 2 mm shorter than its contour."""
    cutting = chained(cutting_of(two_squares(), micro_joints=1))
    (cut,) = cuts_of(cutting)
    spans = [cut.lead_in, *itertools.chain(*cut.bridges), cut.lead_out]
    whole = 200 + math.tau * 0.5 * KERF
    for low, high in zip(spans[::2], spans[1::2], strict=True):
        assert high - low == pytest.approx(whole - 2.0, abs=0.05)


def test_rules_that_do_not_go_with_chains_are_refused() -> None:
    for options in ({"heat_distance": 50.0}, {"compensation": "controller"}):
        with pytest.raises(OptionError, match="--chains"):
            rules_of(chains=True, **options)


@settings(max_examples=6, phases=(Phase.explicit, Phase.generate))
@given(
    columns=st.integers(2, 3),
    rows=st.integers(1, 2),
    gap=st.floats(4.0, 30.0),
    sides=st.lists(st.floats(15.0, 40.0), min_size=6, max_size=6),
)
def test_chains_of_any_grid_touch_no_part_and_cut_every_contour_once(columns, rows, gap, sides) -> None:
    cells = list(itertools.product(range(columns), range(rows)))
    sheet = sheet_of(
        *(
            (square(20 + c * (40 + gap), 20 + r * (40 + gap), side), 0, -1, k + 1)
            for k, ((c, r), side) in enumerate(zip(cells, sides, strict=False))
        )
    )
    cutting = chained(cutting_of(sheet), overhead=2.0)
    cuts = cuts_of(cutting)
    assert sorted(k for cut in cuts for k in cut.contours) == list(range(len(cells)))
    assert_nothing_is_gouged(sheet, cuts, KERF)
    assert_bridges_in_scrap(sheet, cuts, KERF)


def test_blocks_hold_every_contour_that_can_be_chained_once_and_are_not_too_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Five squares in bands of three and two; with two in a block at most, one is left alone, with none to join."""
    monkeypatch.setattr(chains, "BLOCK", 2)
    sheet = sheet_of(*((square(20 + 60 * k, 20, 40), 0, -1, k + 1) for k in range(5)))
    blocks = chains.chain_blocks(cutting_of(sheet), [[4, 3, 2], [1, 0]])
    assert blocks == [[3, 4], [0, 1]]
    monkeypatch.setattr(chains, "BLOCK", 400)
    assert chains.chain_blocks(cutting_of(sheet), [[4, 3, 2], [1, 0]]) == [[2, 3, 4], [0, 1]]
