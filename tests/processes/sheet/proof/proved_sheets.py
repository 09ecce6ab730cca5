"""A sheet with typical difficulties of cutting programs, its plan, and its program; without a search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.cutting import Cut, CutData, CutPlan
from leafcut.model.difference import Difference
from leafcut.model.machine import Machine, Probe
from leafcut.model.sheet import Sheet
from leafcut.model.toolpath import Toolpath
from leafcut.options import PostOptions
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.cut_rules import CutRules, resolve_rules
from leafcut.processes.sheet.plan.cutting import drawing_order, prepare_cutting
from leafcut.processes.sheet.plan.toolpath import TorchSetup, generate_cuts
from leafcut.processes.sheet.post import write_cut_program
from leafcut.processes.sheet.proof.cut_motion import read_cut_program
from leafcut.processes.sheet.proof.matched_runs import CutRequest
from leafcut.processes.sheet.proof.sheet import check_sheet
from leafcut.read.machine import load_machine

CLEARANCE = 10.0
STEEL = CutData("plasma", "mild_steel", 6.0, 25.0, 1.5, 45.0, 3.8, 0.5, 1.5)


def square(x: float, y: float, side: float) -> Polyline:
    """A square by its lower left corner."""
    return Polyline.of_points([(x, y), (x + side, y), (x + side, y + side), (x, y + side)], closed=True)


def plate() -> Sheet:
    """Two squares; the first has a round hole with a square inside, and a mark, the second a small hole."""
    paths = [
        (square(20, 20, 120), "cut", 0, -1, 1),
        (Polyline.circle(85, 85, 40), "cut", 1, 0, 1),
        (square(70, 70, 30), "cut", 2, 1, 2),
        (Polyline.of_points([(25, 25), (45, 25)]), "mark", 0, 0, 1),
        (square(160, 20, 60), "cut", 0, -1, 3),
        (Polyline.circle(190, 50, 10), "cut", 1, 4, 3),
    ]
    contours = tuple(Contour(p, kind, depth=d, parent=parent, part=part) for p, kind, d, parent, part in paths)
    return Sheet("plate", contours, Polyline.of_points([(0, 0), (240, 0), (240, 160), (0, 160)], closed=True))


def machine_for(words: str) -> Machine:
    """The table that a dialect is for."""
    return load_machine("laser-table" if "laser" in words else "plasma-table", (0.0, 0.0, -60.0))


@cache
def planned(words: str = "qtplasmac", options: CutOptions | None = None) -> tuple[CutPlan, CutRules]:
    """The plate's cuts in an order that is allowed, for a controller."""
    torch = load_dialect(words).torch
    rules = resolve_rules(
        STEEL, options or CutOptions(), switches=torch is not None and torch.can_switch_off_along_path
    )
    sheet = plate()
    if torch is None or not torch.mark_on:
        sheet = Sheet(sheet.name, tuple(c for c in sheet.contours if c.kind != "mark"), sheet.outline)
        sheet = Sheet(sheet.name, _renumbered(sheet.contours), sheet.outline)
    cutting = prepare_cutting(sheet, rules)
    return CutPlan(sheet, STEEL, tuple(cutting.cut(s) for s in drawing_order(cutting))), rules


def _renumbered(contours: Sequence[Contour]) -> tuple[Contour, ...]:
    """The same contours after the mark, the fourth, has gone."""
    return tuple(replace(c, parent=c.parent - 1 if c.parent > 3 else c.parent) for c in contours)


def laid(cuts: Sequence[Cut], words: str = "qtplasmac", probe: Probe | None = None) -> Toolpath:
    """The motions of some cuts."""
    torch = load_dialect(words).torch
    switches = torch is not None and torch.can_switch_off_along_path
    made = TorchSetup(
        STEEL,
        CLEARANCE,
        safe_z=machine_for(words).safe_z,
        switches=switches,
        power=1000.0 if torch is not None else 1.0,
        mark_power=200.0,
        tolerance=0.1 if torch is not None else 0.0,
        probe=probe,
        mark_tool=torch.mark_tool if torch is not None else None,
    )
    return generate_cuts(cuts, made)[0]


def program(
    cuts: Sequence[Cut], words: str = "qtplasmac", post: PostOptions | None = None, probe: Probe | None = None
) -> str:
    """The text of some cuts."""
    plan = CutPlan(plate(), STEEL, tuple(cuts))
    return write_cut_program(plan, laid(cuts, words, probe), load_dialect(words), post or PostOptions(), ["plate"])


def checked(
    text: str,
    plan: CutPlan,
    rules: CutRules,
    words: str = "qtplasmac",
    probe: Probe | None = None,
    power: float | None = None,
    material: int | None = None,
) -> list[Difference]:
    """Return the errors of a program text for this plan."""
    asked = CutRequest(rules.half, rules.joints, rules.joint_width, CLEARANCE, probe, power, material)
    written = read_cut_program(text, plan, load_dialect(words), material)
    return check_sheet(plan.sheet, plan, text, written, load_dialect(words), machine_for(words), asked)
