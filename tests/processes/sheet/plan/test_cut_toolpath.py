"""The motions of cuts, and the time norm that is added up from them."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from cut_sheets import LASER, PLASMA, cutting_of, part_in_hole, sheet_of, square, two_squares
from leafcut.errors import PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import CutPlan, CutTimes
from leafcut.model.toolpath import Kind, Toolpath, ToolpathBuilder
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.costs import measure_cuts, part_areas
from leafcut.processes.sheet.plan.cutting import drawing_order
from leafcut.processes.sheet.plan.toolpath import TorchSetup, follow_path, generate_cuts
from leafcut.read.machine import load_machine
from leafcut.timing.toolpath import measure_toolpath, seconds_by_row

TABLE = load_machine("plasma-table")


def laid(sheet, data=PLASMA, switches=True, **options):
    cutting = cutting_of(sheet, data, **options)
    cuts = tuple(cutting.cut(s) for s in drawing_order(cutting))
    path, rows = generate_cuts(cuts, TorchSetup(data, 10.0, safe_z=TABLE.safe_z, switches=switches))
    return cuts, path, rows


def kinds(path: Toolpath, first: int, last: int) -> list[Kind]:
    return [Kind(k) for k in path.kind[first:last].tolist()]


def test_a_cut_pierces_waits_goes_down_cuts_and_rises() -> None:
    cuts, path, rows = laid(two_squares())
    first = kinds(path, rows[0].start, rows[0].stop)
    assert first[:5] == [Kind.RAPID, Kind.RAPID, Kind.SPINDLE, Kind.DWELL, Kind.FEED]
    assert first[-2:] == [Kind.SPINDLE, Kind.RAPID]
    ends = path.end[rows[0].start : rows[0].stop]
    assert ends[0].tolist() == pytest.approx([*cuts[0].path.start, 10.0])
    assert ends[1, 2] == 3.8  # pierce height
    assert path.value[rows[0].start + 3] == 0.5  # pierce delay
    assert ends[4, 2] == 1.5  # cut height
    assert ends[-1, 2] == 10.0
    assert path.value[rows[0].stop - 2] == 0.0


def test_the_torch_is_only_on_between_pierce_and_rise_and_never_in_a_rapid() -> None:
    _, path, _ = laid(part_in_hole())
    burning = False
    for row in path:
        if row.kind is Kind.SPINDLE:
            burning = row.value > 0.0
        if row.kind is Kind.RAPID:
            assert not burning
        if row.kind in (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW):
            assert burning


def test_the_motions_are_as_long_as_the_paths() -> None:
    cuts, path, _ = laid(part_in_hole(), lead_in="line")
    down = len(cuts) * (PLASMA.pierce_height - PLASMA.cut_height)
    assert measure_toolpath(path, TABLE).cut_mm == pytest.approx(sum(c.path.length for c in cuts) + down, abs=1e-6)


def test_every_cut_ends_where_its_path_ends() -> None:
    cuts, path, rows = laid(part_in_hole())
    for cut, row in zip(cuts, rows, strict=True):
        assert path.end[row.stop - 1, :2] == pytest.approx(cut.path.end, abs=1e-9)


def test_a_small_hole_is_cut_at_held_height_and_overcut_with_the_torch_off() -> None:
    sheet = sheet_of((square(0, 0, 100), 0, -1, 1), (Polyline.circle(50, 50, 8), 1, 0, 1))
    _, path, rows = laid(sheet)
    hole = kinds(path, rows[0].start, rows[0].stop)
    assert hole.count(Kind.HEIGHT) == 2
    switched = [v for k, v in zip(hole, path.value[rows[0].start : rows[0].stop], strict=True) if k is Kind.TORCH]
    assert switched == [0.0, 1.0]
    fed = path.value[rows[0].start : rows[0].stop][[k in (Kind.ARC_CW, Kind.ARC_CCW) for k in hole]]
    assert fed == pytest.approx(0.6 * PLASMA.feed)
    assert Kind.TORCH not in kinds(path, rows[1].start, rows[1].stop)


def test_the_beam_goes_off_at_joints_on_the_move_or_at_rest() -> None:
    cuts, path, rows = laid(two_squares(), LASER, micro_joints=2)
    assert kinds(path, rows[0].start, rows[0].stop).count(Kind.TORCH) == 4
    _, path, rows = laid(two_squares(), LASER, switches=False, micro_joints=2)
    switched = path.value[rows[0].start : rows[0].stop][path.kind[rows[0].start : rows[0].stop] == Kind.SPINDLE]
    assert (switched > 0).tolist() == [True, False, True, False, True, False]
    assert len(cuts[0].joints) == 2


def test_a_clearance_below_the_pierce_height_is_refused() -> None:
    cutting = cutting_of(two_squares())
    cuts = [cutting.cut(s) for s in drawing_order(cutting)]
    with pytest.raises(PlanError, match="--clearance-height"):
        generate_cuts(cuts, TorchSetup(PLASMA, 3.8))


def test_the_seconds_of_the_rows_add_up_to_the_measure() -> None:
    _, path, _ = laid(part_in_hole())
    whole = measure_toolpath(path, TABLE)
    each = seconds_by_row(path, TABLE)
    waiting = path.value[path.kind == Kind.DWELL].sum()
    assert each.sum() + waiting == pytest.approx(whole.time_s)
    assert whole.by_kind["dwell"] + whole.by_kind["spindle"] == pytest.approx(
        len(cutting_of(part_in_hole()).contours) * 0.5
    )


def test_switching_the_torch_on_the_move_does_not_stop_the_machine() -> None:
    sheet = sheet_of((square(0, 0, 100), 0, -1, 1), (Polyline.circle(50, 50, 8), 1, 0, 1))
    _, path, _ = laid(sheet)
    keep = ~np.isin(path.kind, [Kind.TORCH, Kind.HEIGHT])
    without = replace(
        path, kind=path.kind[keep], end=path.end[keep], value=path.value[keep], ref=path.ref[keep], line=path.line[keep]
    )
    assert measure_toolpath(path, TABLE).time_s == pytest.approx(measure_toolpath(without, TABLE).time_s)


def test_areas_are_without_holes_and_parts_in_holes_count_for_themselves() -> None:
    areas = part_areas(part_in_hole())
    assert areas[1] == pytest.approx(160**2 - math.pi * 60**2)
    assert areas[2] == pytest.approx(40**2 - math.pi * 9**2)


def test_parts_add_up_to_the_sheet_and_sheets_to_the_batch() -> None:
    sheet = part_in_hole()
    cutting = cutting_of(sheet)
    cuts = tuple(cutting.cut(s) for s in drawing_order(cutting))
    options = CutOptions(cutting_rate=36.0, pierce_cost=0.5)
    seconds = [(10.0, 1.0, 2.0), (20.0, 1.0, 3.0), (30.0, 1.0, 4.0), (40.0, 1.0, 5.0)]
    norm = measure_cuts(CutPlan(sheet, PLASMA, cuts), seconds, 120.0, options, shop_rate=72.0, quantity=10)
    assert (norm.sheet.cut_s, norm.sheet.pierce_s, norm.sheet.total_s) == (100.0, 4.0, 120.0)
    assert norm.sheet.rapid_s == 16.0  # 14 between the cuts, 2 at the start and the end
    assert [p.times.cut_s for p in norm.parts] == [70.0, 30.0]
    assert norm.batch.total_s == 1200.0
    assert norm.sheet.pierces == 4
    # Gas for 104 s at 36 an hour, the machine for 120 s at 72 an hour, four pierces.
    assert norm.cost == pytest.approx(104 * 0.01 + 120 * 0.02 + 4 * 0.5)
    assert norm.batch_cost == pytest.approx(10 * norm.cost)
    assert norm.utilisation == pytest.approx((160**2 - math.pi * (60**2 + 9**2) + 40**2) / 200**2)
    perimeters = 4 * 160 + 2 * math.pi * (60 + 9) + 4 * 40
    ways = sum(math.dist(a.path.end, b.path.start) for a, b in itertools.pairwise(cuts))
    assert norm.sheet.length_mm == pytest.approx(perimeters + ways)
    assert CutTimes().total_s == 0.0


@pytest.mark.parametrize("turn", [0.02, math.radians(90.0), -math.radians(200.0), 2.0 * math.pi - 1e-4])
def test_no_arc_has_ends_that_the_decimals_of_a_program_cannot_tell_apart(turn) -> None:
    """An arc with ends 0.001 mm apart, as a start beside a corner leaves it, is a line; nearly a circle, two arcs."""
    chord = 0.001
    path = Polyline(np.array([[0.0, 0.0, 0.0], [10.0, 0.0, math.tan(0.25 * turn)], [10.0 + chord, 0.0, 0.0]]))
    builder = ToolpathBuilder()
    builder.rapid(z=1.0)
    builder.rapid(0.0, 0.0)
    follow_path(builder, path, 10.0)
    laid_path = builder.build()
    arcs = [k for k in range(len(laid_path.kind)) if laid_path.kind[k] in (Kind.ARC_CW, Kind.ARC_CCW)]
    for k in arcs:
        assert math.dist(laid_path.end[k - 1, :2], laid_path.end[k, :2]) > 2 * 0.00254
    assert laid_path.end[-1, :2].tolist() == pytest.approx([10.0 + chord, 0.0])
    assert len(arcs) == (2 if turn > 6.0 else 0)


@pytest.mark.parametrize("bulge", [0.0, 0.4])
@pytest.mark.parametrize("steps", [(5.0, 0.001, 5.0), (0.001, 5.0), (5.0, 0.001), (5.0, *[0.001] * 40, 5.0)])
def test_no_step_is_so_short_that_a_program_takes_its_ends_for_one_place(steps, bulge) -> None:
    """A program in inches with four decimals has steps of 0.00254 mm; no part of the path is lost."""
    x = np.concatenate([[0.0], np.cumsum(steps)])
    path = Polyline(np.column_stack([x, np.zeros(len(x)), np.where(np.append(steps, 0.0) > 1.0, bulge, 0.0)]))
    builder = ToolpathBuilder()
    builder.rapid(z=1.0)
    builder.rapid(0.0, 0.0)
    follow_path(builder, path, 10.0)
    ends = builder.build().end[1:, :2]
    assert (np.hypot(*np.diff(ends, axis=0).T) > math.sqrt(2.0) * 0.00254).all()
    assert ends[-1].tolist() == pytest.approx([x[-1], 0.0])
    assert len(ends) - 1 >= sum(s > 1.0 for s in steps)
