"""Passes over an order of cuts: permitted changes, and invariants."""

from __future__ import annotations

from dataclasses import replace

import ezdxf
import pytest

from cut_sheets import cutting_of, part_in_hole
from leafcut.errors import PlanError
from leafcut.model.plan import Order
from leafcut.order.stop import Deadline
from leafcut.processes.course import check_order
from leafcut.processes.job import Job, machine_of
from leafcut.processes.ordering import find_order
from leafcut.processes.plan import Plan
from leafcut.processes.settings import collect_settings
from leafcut.processes.sheet.order_passes import PASSES, cached_motion, choose_fastest_order, cuts_in_order
from leafcut.processes.sheet.plan.cutting import CutSequence, drawing_order
from leafcut.processes.sheet.spec import plan_sheet
from leafcut.read.format import load_source


@pytest.mark.hazard
def test_a_sequence_that_leaves_a_cut_out_or_detaches_a_part_too_early_is_refused() -> None:
    cutting = cutting_of(part_in_hole())
    starts = tuple(drawing_order(cutting))
    assert CutSequence(cutting, starts).starts == starts
    for wrong in (starts[:-1], (*starts, starts[0])):
        with pytest.raises(PlanError, match="every contour once"):
            CutSequence(cutting, wrong)
    with pytest.raises(PlanError, match="would be cut before"):
        CutSequence(cutting, starts[::-1])


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Plan:
    """Return the plan of six squares so near to each other that leads of the first order meet."""
    document = ezdxf.new(units=4)
    for x in (0, 37, 74):
        for y in (0, 37):
            corners = [(x, y), (x + 30, y), (x + 30, y + 30), (x, y + 30)]
            document.modelspace().add_lwpolyline(corners, close=True)
    file = tmp_path_factory.mktemp("passes") / "squares.dxf"
    document.saveas(file)
    settings = collect_settings({"thickness": 6.0, "machine": "plasma-table", "heat_distance": 20.0, "algorithm": "nn"})
    return plan_sheet(Job(settings, machine_of(settings), Deadline()), load_source(file))


def test_each_pass_cuts_every_contour_once_and_the_last_motion_is_that_of_the_order(plan: Plan) -> None:
    order = find_order(plan.job, plan.stages)
    check_order(plan.stages, order)
    contours = sorted(s.contour for s in cuts_in_order(plan, order).starts)
    for improve in PASSES:
        order = improve(plan, order)
        assert sorted(s.contour for s in cuts_in_order(plan, order).starts) == contours, improve.__name__
    made = cached_motion(plan, order)
    assert [cut.path.start for cut in made.detail[0].cuts] == [s.entry for s in cuts_in_order(plan, order).starts]
    assert cached_motion(plan, order).path is made.path  # a path that a pass has measured is not generated again


def test_the_given_order_stays_if_it_takes_less_time_unless_heat_forbids_to_compare(plan: Plan) -> None:
    worse = plan.work.given.starts
    order = Order((CutSequence(plan.work.cutting, (*worse[::2], *worse[1::2])),))
    assert choose_fastest_order(plan, order) is order
    free = replace(plan, work=replace(plan.work, order_fixed=False))
    assert cached_motion(free, order).measure.time_s > cached_motion(free, Order((plan.work.given,))).measure.time_s
    assert choose_fastest_order(free, order).choices == (plan.work.given,)
