"""The proof of chains: a bridge that the plan did not make, or that runs where it must not, is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from proved_sheets import CLEARANCE, STEEL, machine_for, square

from golden_differences import check_golden
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.model.contour import Contour
from leafcut.model.cutting import Cut, CutChoice, CutPlan
from leafcut.model.difference import Difference
from leafcut.model.sheet import Sheet
from leafcut.options import PostOptions
from leafcut.processes.sheet.plan.toolpath import TorchSetup, generate_cuts
from leafcut.processes.sheet.post import write_cut_program
from leafcut.processes.sheet.proof.cut_motion import read_cut_program
from leafcut.processes.sheet.proof.matched_runs import CutRequest
from leafcut.processes.sheet.proof.sheet import check_sheet

HALF = 0.5 * STEEL.kerf


def around(x: float, y: float, side: float, at: tuple[float, float]) -> Polyline:
    """Clockwise half a kerf beside a square, with round corners, from a place of its path and back to it."""
    b = -np.tan(np.pi / 8)
    low_x, low_y, high_x, high_y = x - HALF, y - HALF, x + side + HALF, y + side + HALF
    rows = [
        (x, high_y, 0), (x + side, high_y, b), (high_x, y + side, 0), (high_x, y, b),
        (x + side, low_y, 0), (x, low_y, b), (low_x, y, 0), (low_x, y + side, b),
    ]  # fmt: skip
    ring = Polyline(np.array(rows, dtype=np.float64), closed=True)
    places = np.linspace(0.0, ring.length, 20001)[:-1]
    near = min(places, key=lambda s: float(np.hypot(*(np.array(ring.point_at(s)) - at))))
    return ring.piece(near, near + ring.length)


def sheet(third: bool = False) -> Sheet:
    paths = [square(20, 20, 40), square(80, 20, 40), *([square(65, 60, 10)] if third else [])]
    return Sheet("row", tuple(Contour(p, depth=0, parent=-1, part=k + 1) for k, p in enumerate(paths)))


def chain(*via: tuple[float, float]) -> Cut:
    """Both squares in one run: from right of the first at y = 40, through some places, to the left of the second."""
    one, other = around(20, 20, 40, (60 + HALF, 40.0)), around(80, 20, 40, (80 - HALF, 40.0))
    lead = Polyline.of_points([(64, 46), one.start])
    bridge = Polyline.of_points([one.end, *via, other.start])
    path = concatenate(lead, one, bridge, other)
    begin = lead.length + one.length
    return Cut(
        (0, 1),
        path,
        lead.length,
        path.length,
        path.length,
        ((0.0, STEEL.feed),),
        CutChoice((0,), direction="clockwise"),
        bridges=((begin, begin + bridge.length),),
        chained=(CutChoice((1,), direction="clockwise", bridge=True),),
    )


def single(number: int, x: float, side: float, y: float = 20.0) -> Cut:
    """One square by itself, from below its middle."""
    ring = around(x, y, side, (x + side / 2, y - HALF))
    lead = Polyline.of_points([(x + side / 2, y - 6), ring.start])
    path = concatenate(lead, ring)
    speeds = ((0.0, STEEL.feed),)
    return Cut((number,), path, lead.length, path.length, path.length, speeds, CutChoice((number,)))


def found(cuts: list[Cut], plan: list[Cut] | None = None, third: bool = False) -> list[Difference]:
    whole = CutPlan(sheet(third), STEEL, tuple(plan or cuts))
    words = load_dialect("qtplasmac")
    machine = machine_for("qtplasmac")
    path, _ = generate_cuts(cuts, TorchSetup(STEEL, CLEARANCE, safe_z=machine.safe_z, switches=True, tolerance=0.1))
    text = write_cut_program(replace(whole, cuts=tuple(cuts)), path, words, PostOptions())
    return check_sheet(
        whole.sheet,
        whole,
        text,
        read_cut_program(text, whole, words),
        words,
        machine,
        CutRequest(HALF, safe_height=CLEARANCE),
    )


def test_a_chain_through_scrap_is_proved() -> None:
    assert found([chain()]) == []


@pytest.mark.hazard
def test_a_bridge_into_the_kerf_of_an_earlier_cut_is_found() -> None:
    """The bridge goes down to where the third square was cut before: 0.5 mm beside its kerf."""
    low = (70.0, 60.0 - HALF - 0.5)
    problems = found([single(2, 65, 10, 60), chain(low)], third=True)
    assert any(p.what == "chain" and "cross" in p.text for p in problems)
    check_golden("sheet_differences.toml", "chains", "into the kerf of an earlier cut", problems)


def test_a_later_cut_across_a_bridge_is_found() -> None:
    """The lead-in of the third square comes from y = 54; the bridge is led along there."""
    problems = found([chain((70.0, 54.0)), single(2, 65, 10, 60)], third=True)
    assert any(p.what in ("chain", "pierces in the air") for p in problems)
    check_golden("sheet_differences.toml", "chains", "a later cut across a bridge", problems)


def test_a_bridge_back_over_its_own_lead_in_is_found() -> None:
    problems = found([chain((64.0, 46.0))])
    assert any(p.what == "chain" and "its own" in p.text for p in problems)
    check_golden("sheet_differences.toml", "chains", "back over its own lead-in", problems)


def test_a_run_that_joins_what_the_plan_keeps_apart_is_found() -> None:
    problems = found([chain()], plan=[single(0, 20, 40), single(1, 80, 40)])
    assert any(p.what == "chain" and "instead of 1" in p.text for p in problems)
    check_golden("sheet_differences.toml", "chains", "joins what is kept apart", problems)


@pytest.mark.hazard
def test_a_bridge_through_a_part_is_found() -> None:
    problems = found([chain((60.0 - 5.0, 30.0))])
    assert any(p.what == "cuts into a part" for p in problems)
    check_golden("sheet_differences.toml", "chains", "through a part", problems)


@pytest.mark.parametrize("words", ["qtplasmac"])
def test_the_direction_of_every_contour_of_a_chain_is_checked(words: str) -> None:
    cut = chain()
    asked = replace(cut, chained=(replace(cut.chained[0], direction="counter-clockwise"),))
    assert [p.what for p in found([cut], plan=[asked])] == ["direction"]
