"""The proof of a cutting program: it accepts what is right, and every fault that breaks a part is caught."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from proved_sheets import STEEL, checked, laid, planned, program

from cut_sheets import part_in_notch, sheet_of, square, two_squares
from golden_differences import check_golden
from leafcut.gcode.dialects import dialect_names, load_dialect
from leafcut.geometry.polyline import Polyline, concatenate
from leafcut.model.contour import Contour
from leafcut.model.cutting import Cut, CutPlan
from leafcut.model.machine import Probe
from leafcut.model.sheet import Sheet
from leafcut.options import PostOptions
from leafcut.processes.sheet.options import CutOptions
from leafcut.processes.sheet.plan.cut_rules import resolve_rules
from leafcut.processes.sheet.plan.cutting import drawing_order, prepare_cutting
from leafcut.processes.sheet.plan.narrow_shapes import with_chambers
from leafcut.processes.sheet.proof.cut_motion import check_cut_motion, read_cut_program
from leafcut.processes.sheet.proof.sheet_shapes import build_targets

#: Golden differences of these proofs.
GOLDEN = "sheet_differences.toml"
KERF = 1.5
Cuts = tuple[Cut, ...]


def of_contour(cuts: Cuts, index: int) -> int:
    """The place in the order of the cut of a contour."""
    return next(k for k, c in enumerate(cuts) if c.contours == (index,))


def with_cut(cuts: Cuts, k: int, **changes: object) -> Cuts:
    """The same cuts with one changed."""
    return (*cuts[:k], replace(cuts[k], **changes), *cuts[k + 1 :])  # type: ignore[arg-type]


@pytest.mark.hazard
@pytest.mark.parametrize("words", [*dialect_names(torch=True), "linuxcnc"])
@pytest.mark.parametrize("units", ["mm", "inch"])
def test_a_right_program_is_accepted_for_every_controller(words: str, units: str) -> None:
    plan, rules = planned(words)
    text = program(plan.cuts, words, PostOptions(output_units=units))
    written = read_cut_program(text, plan, load_dialect(words))
    assert check_cut_motion(laid(plan.cuts, words), written, load_dialect(words), units) == []
    assert checked(text, plan, rules, words) == []


@pytest.mark.parametrize(
    "options",
    [
        CutOptions(direction="counter-clockwise", lead_in="line", lead_out="none"),
        CutOptions(compensation="none", small_hole=0.0),
        CutOptions(corner_loops=True),
        CutOptions(micro_joints=1),
        CutOptions(overcut=0.0, lead_in="line"),
    ],
    ids=["other way round", "no compensation", "corner loops", "a joint", "no overcut"],
)
def test_a_right_program_is_accepted_by_every_rule(options: CutOptions) -> None:
    plan, rules = planned("qtplasmac", options)
    assert checked(program(plan.cuts), plan, rules) == []


def test_the_feed_may_be_that_of_the_controllers_own_material() -> None:
    plan, rules = planned()
    cuts = tuple(c for c in plan.cuts if c.kind == "cut")
    text = program(cuts, post=PostOptions(material_number=7))
    assert "M190 P7\nM66 P3 L3 Q1\n" in text
    assert "F#<_hal[plasmac.cut-feed-rate]>" in text
    assert {d.what for d in checked(text, replace(plan, cuts=cuts), rules, material=7)} == {"not marked", "not planned"}


def shifted(cuts: Cuts) -> Cuts:
    """One contour is a kerf to the side."""
    k = of_contour(cuts, 4)
    return with_cut(cuts, k, path=cuts[k].path.moved(KERF, 0.0))


def dropped(cuts: Cuts) -> Cuts:
    """One hole is left out."""
    k = of_contour(cuts, 5)
    return (*cuts[:k], *cuts[k + 1 :])


def repeated(cuts: Cuts) -> Cuts:
    """One contour is cut again at the end."""
    return (*cuts, cuts[of_contour(cuts, 4)])


def twice_round(cuts: Cuts) -> Cuts:
    """The torch goes round a contour twice in one run."""
    k = of_contour(cuts, 4)
    cut = cuts[k]
    lead, around = cut.path.piece(0.0, cut.lead_in), cut.path.piece(cut.lead_in, cut.lead_out)
    path = concatenate(lead, around, around, cut.path.piece(cut.lead_out, cut.path.length))
    return with_cut(cuts, k, path=path, torch_off_at=path.length)


def outer_first(cuts: Cuts) -> Cuts:
    """An outline comes before the hole in it."""
    a, b = of_contour(cuts, 5), of_contour(cuts, 4)
    order = list(cuts)
    order[a], order[b] = order[b], order[a]
    return tuple(order)


def hole_before_its_part(cuts: Cuts) -> Cuts:
    """A hole comes before the part inside it."""
    a, b = of_contour(cuts, 2), of_contour(cuts, 1)
    order = list(cuts)
    order[a], order[b] = order[b], order[a]
    return tuple(order)


def mark_last(cuts: Cuts) -> Cuts:
    """A mark comes when its part has fallen."""
    k = of_contour(cuts, 3)
    return (*cuts[:k], *cuts[k + 1 :], cuts[k])


def pierced_in_a_part(cuts: Cuts) -> Cuts:
    """A lead-in starts inside the part."""
    k = of_contour(cuts, 4)
    cut = cuts[k]
    begin, edge = (190.0, 75.0), cut.path.point_at(cut.lead_in)
    lead = Polyline.of_points([begin, edge])
    path = concatenate(lead, cut.path.piece(cut.lead_in, cut.path.length))
    moved = lead.length - cut.lead_in
    return with_cut(
        cuts, k, path=path, lead_in=lead.length, lead_out=cut.lead_out + moved, torch_off_at=cut.torch_off_at + moved
    )


def wrong_side(cuts: Cuts) -> Cuts:
    """A hole's kerf is outside the hole."""
    k = of_contour(cuts, 5)
    path = Polyline.circle(190, 50, 10 + KERF / 2).piece(0.0, math.tau * (10 + KERF / 2))
    return with_cut(cuts, k, path=path, lead_in=0.0, lead_out=path.length, torch_off_at=path.length)


def mirrored(cuts: Cuts) -> Cuts:
    """An outline is cut in the opposite direction."""
    k = of_contour(cuts, 4)
    cut = cuts[k]
    return with_cut(cuts, k, path=cut.path.reversed(), torch_off_at=cut.path.length)


def not_closed(cuts: Cuts) -> Cuts:
    """The torch goes off 1.5 mm before the contour is closed; a lead-in that comes along it reaches less far back."""
    k = of_contour(cuts, 4)
    cut = cuts[k]
    path = cut.path.piece(0.0, cut.lead_out - 1.5)
    return with_cut(cuts, k, path=path, torch_off_at=path.length, lead_out=path.length)


def too_wide(cuts: Cuts) -> Cuts:
    """A part comes out 0.05 mm too small on every side."""
    k = of_contour(cuts, 2)
    small = replace(cuts[k].path, vertices=np.array(cuts[k].path.vertices))
    middle, scale = np.array([85.0, 85.0]), 1.0 - 0.05 / (15.0 + KERF / 2)
    small.vertices[:, :2] = middle + (small.vertices[:, :2] - middle) * scale
    return with_cut(cuts, k, path=small)


def off_the_sheet(cuts: Cuts) -> Cuts:
    """A lead-out leaves the sheet."""
    k = of_contour(cuts, 4)
    cut = cuts[k]
    x, y = cut.path.end
    path = concatenate(cut.path, Polyline.of_points([(x, y), (x, -5.0)]))
    return with_cut(cuts, k, path=path, torch_off_at=path.length)


MUTATIONS: list[tuple[Callable[[Cuts], Cuts], set[str]]] = [
    (shifted, {"not cut", "cuts into a part"}),
    (dropped, {"not cut"}),
    (repeated, {"cut twice"}),
    (twice_round, {"cut twice"}),
    (outer_first, {"out of order"}),
    (hole_before_its_part, {"out of order"}),
    (mark_last, {"out of order"}),
    (pierced_in_a_part, {"cuts into a part"}),
    (wrong_side, {"cuts into a part"}),
    (mirrored, {"direction"}),
    (not_closed, {"incomplete"}),
    (too_wide, {"cuts into a part"}),
    (off_the_sheet, {"off the sheet"}),
]


@pytest.mark.hazard
@pytest.mark.parametrize("mutate, whats", MUTATIONS, ids=[m.__name__ for m, _ in MUTATIONS])
def test_a_wrong_cut_is_caught(mutate: Callable[[Cuts], Cuts], whats: set[str]) -> None:
    """The program has the wrong cuts; it is compared with the correct plan."""
    plan, rules = planned()
    found = checked(program(mutate(plan.cuts)), plan, rules)
    assert whats <= {d.what for d in found}
    check_golden(GOLDEN, "cuts", mutate.__name__, found)


@pytest.mark.hazard
@pytest.mark.parametrize("mutate, whats", MUTATIONS, ids=[m.__name__ for m, _ in MUTATIONS])
def test_a_wrong_plan_is_caught(mutate: Callable[[Cuts], Cuts], whats: set[str]) -> None:
    """A plan that is wrong itself helps nothing: what counts is the drawing."""
    plan, rules = planned()
    wrong = mutate(plan.cuts)
    found = checked(program(wrong), CutPlan(plan.sheet, plan.data, wrong), rules)
    assert whats <= {d.what for d in found}
    check_golden(GOLDEN, "plans", mutate.__name__, found)


@pytest.mark.hazard
@pytest.mark.parametrize("mouth, closed", [(0.5, True), (2.9, True), (3.2, False)])
def test_a_part_in_a_notch_that_is_cut_loose_before_it_is_caught(mouth: float, closed: bool) -> None:
    """The part lies outside of the drawn C, but inside of the edge of its kerf."""
    rules = resolve_rules(STEEL, CutOptions(), switches=True)
    cutting = prepare_cutting(part_in_notch(mouth), rules)
    cuts = tuple(cutting.cut(s) for s in sorted(drawing_order(cutting), key=lambda s: s.contour == 0))
    assert checked(program(cuts), CutPlan(cutting.sheet, STEEL, cuts), rules) == []
    late = (cuts[-1], *cuts[:-1])
    found = checked(program(late), CutPlan(cutting.sheet, STEEL, late), rules)
    assert [d.what for d in found] == ["out of order"] * (2 if closed else 0), found


@pytest.mark.hazard
def test_the_chamber_of_a_notch_that_is_cut_after_its_outline_is_caught() -> None:
    """The chamber lies outside of the drawn C, but inside of the edge of its kerf."""
    rules = resolve_rules(STEEL, CutOptions(), switches=True)
    cutting = prepare_cutting(with_chambers(sheet_of((part_in_notch(0.5).contours[0].path, 0, -1, 1)), rules), rules)
    chamber, outline = (cutting.cut(s) for s in drawing_order(cutting))
    assert (chamber.contours, outline.contours) == ((1,), (0,))
    assert checked(program((chamber, outline)), CutPlan(cutting.sheet, STEEL, (chamber, outline)), rules) == []
    found = checked(program((outline, chamber)), CutPlan(cutting.sheet, STEEL, (outline, chamber)), rules)
    assert [d.what for d in found] == ["out of order"], found


@pytest.mark.hazard
def test_a_chamber_that_is_cut_beyond_its_notch_is_caught_as_a_cut_into_the_part() -> None:
    rules = resolve_rules(STEEL, CutOptions(), switches=True)
    outline = Contour(part_in_notch(0.5).contours[0].path, depth=0, parent=-1, part=1)
    wide = Contour(square(39, 40, 60), depth=1, parent=-1, part=1, chamber=True)
    cutting = prepare_cutting(Sheet("C", (outline, wide)), rules)
    cuts = tuple(cutting.cut(s) for s in drawing_order(cutting))
    found = checked(program(cuts), CutPlan(cutting.sheet, STEEL, cuts), rules)
    assert [d.what for d in found] == ["cuts into a part"], found


@pytest.mark.hazard
@pytest.mark.parametrize("gap, fault", [(0.4, ["pierces in the air"]), (0.9, [])])
def test_a_pierce_within_half_a_kerf_of_an_earlier_cut_is_caught_also_without_compensation(
    gap: float, fault: list[str]
) -> None:
    rules = resolve_rules(STEEL, CutOptions(compensation="none", lead_in="none"), switches=True)
    cutting = prepare_cutting(two_squares(gap), rules)
    first = next(s for s in cutting.starts if s.contour == 0 and s.entry[0] < 21)
    second = next(s for s in cutting.starts if s.contour == 1 and s.entry[0] < 71 and 21 < s.entry[1] < 69)
    cuts = (cutting.cut(first), cutting.cut(second))
    found = checked(program(cuts), CutPlan(cutting.sheet, STEEL, cuts), rules)
    assert [d.what for d in found] == fault, found


TEXTS = [
    ("qtplasmac", r"M5 \$0\n(G0 [^\n]*\nM3)", r"\1", "torch on in a rapid"),
    ("qtplasmac", r"M5 \$0\n(M65 P2)", r"\1", "torch on at the end"),
    ("qtplasmac", r"F1500", "F1400", "feed"),
    ("qtplasmac", r"M67 E3 Q60\n", "", "feed"),
    ("qtplasmac", r"M52 P1\n", "", "feed"),
    ("qtplasmac", r"M68 E3 Q0\n", "", "feed"),
    ("qtplasmac", r"M65 P3\n", "", "not cut"),
    ("qtplasmac", r"kw=1.5", "kw=1.2", "material"),
    ("qtplasmac", r"\(o=0.*\n", "", "material"),
    ("plasma", r"G4 P0.5\n", "G4 P0.3\n", "pierce delay"),
    ("plasma", r"Z3.8\n", "Z2.8\n", "pierce height"),
    ("plasma", r"Z1.5 ", "Z1 ", "cut height"),
    ("plasma", r"Z10\n(X)", r"Z3\n\1", "rapid too low"),
    ("plasma", r"M5\n", "", "torch on in a rapid"),
    ("grbl-laser", r"M5\n", "", "torch on in a rapid"),
    ("grbl-laser", r"M4 S200", "M4 S1000", "cuts into a part"),
]


@pytest.mark.hazard
@pytest.mark.parametrize("words, old, new, what", TEXTS, ids=[f"{w}: {o} → {n}" for w, o, n, _ in TEXTS])
def test_a_wrong_word_is_caught(words: str, old: str, new: str, what: str) -> None:
    plan, rules = planned(words)
    text = program(plan.cuts, words)
    wrong, count = re.subn(old, new, text, count=1)
    assert count == 1
    found = checked(wrong, plan, rules, words)
    assert what in {d.what for d in found}
    check_golden(GOLDEN, words, f"{old} → {new}", found)


PROBE = Probe(feed=2000 / 60, depth=20.0, switch_offset=3.0)


@pytest.mark.parametrize("units", ["mm", "inch"])
def test_a_program_that_finds_the_sheet_before_every_pierce_is_accepted(units: str) -> None:
    plan, rules = planned("plasma")
    text = program(plan.cuts, "plasma", PostOptions(output_units=units), PROBE)
    assert text.count("G38.2 ") == text.count("G92 ") == len(plan.cuts)
    written = read_cut_program(text, plan, load_dialect("plasma"))
    assert check_cut_motion(laid(plan.cuts, "plasma", PROBE), written, load_dialect("plasma"), units) == []
    assert checked(text, plan, rules, "plasma", PROBE) == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "before, after, words",
    [
        ("G38.2 Z-20 F2000\nG92 Z-3\n", "", "switched on without probing the sheet"),
        ("G92 Z-3\n", "G92 Z0\n", "not set to Z-3"),
        ("G92 Z-3\n", "", "not set to Z-3"),
        ("G38.2 Z-20 F2000\n", "G38.2 Z-2 F2000\n", "probe goes down to Z-2"),
        ("G38.2 Z-20 F2000\n", "G38.2 Z-20 F9000\n", "probing feed is 9000"),
        ("G38.2 Z-20 F2000\n", "", "Z0 is moved without a probe"),
        ("G38.2 Z-20 F2000\n", "M3 S1\nG38.2 Z-20 F2000\n", "torch is on during probing"),
    ],
)
def test_a_height_that_is_not_found_as_it_should_be_is_a_difference(before: str, after: str, words: str) -> None:
    plan, rules = planned("plasma")
    text = program(plan.cuts, "plasma", probe=PROBE)
    assert before in text
    found = checked(text.replace(before, after, 1), plan, rules, "plasma", PROBE)
    assert any(words in d.text for d in found if d.what == "probe"), found
    check_golden(GOLDEN, "probe", f"{before} → {after}", found)


@pytest.mark.parametrize(
    "words, old, new, what",
    [
        ("plasma", "Z3.8\n", "Z3.801\n", None),
        ("plasma", "Z3.8\n", "Z3.803\n", "pierce height"),
        ("plasma", "Z3.8\n", "Z3.797\n", "pierce height"),
        ("plasma", "Z1.5 ", "Z1.501 ", None),
        ("plasma", "Z1.5 ", "Z1.503 ", "cut height"),
        ("plasma", "Z1.5 ", "Z1.497 ", "cut height"),
        ("plasma", "Z10\nX", "Z9.998\nX", None),
        ("plasma", "Z10\nX", "Z9.997\nX", "rapid too low"),
        ("plasma", "G4 P0.5\n", "G4 P0.498\n", "pierce delay"),
        ("plasma", "G4 P0.5\n", "G4 P0.6\n", None),
        ("qtplasmac", "kw=1.5", "kw=1.501", None),
        ("qtplasmac", "kw=1.5", "kw=1.502", "material"),
        ("qtplasmac", "ph=3.8", "ph=3.798", "material"),
        ("qtplasmac", "pd=0.5", "pd=0.502", "material"),
        ("qtplasmac", "ch=1.5", "ch=1.498", "material"),
        ("qtplasmac", "fr=1500", "fr=1507", None),
        ("qtplasmac", "fr=1500", "fr=1508", "material"),
    ],
)
def test_small_changes_are_rounding_up_to_a_tolerance(words: str, old: str, new: str, what: str | None) -> None:
    """Heights may differ by 2 µm, figures of the material by a thousandth, its feed by half a percent."""
    plan, rules = planned(words)
    text = program(plan.cuts, words)
    assert old in text
    found = {d.what for d in checked(text.replace(old, new, 1), plan, rules, words)}
    assert found == (set() if what is None else {what})


def test_a_sheet_that_was_found_elsewhere_is_not_found() -> None:
    plan, rules = planned("plasma")
    text = program(plan.cuts, "plasma", probe=PROBE)
    elsewhere, many = re.subn(r"(X\S+ Y\S+)\n(G38.2 Z-20 F2000\nG92 Z-3)\n", r"\2\nG0 Z10\n\1\n", text, count=1)
    assert many == 1
    found = checked(elsewhere, plan, rules, "plasma", PROBE)
    assert any("switched on without probing the sheet" in d.text for d in found), found


def test_a_probe_that_nobody_asked_for_is_a_difference() -> None:
    plan, rules = planned("plasma")
    text = program(plan.cuts, "plasma", probe=PROBE)
    assert {d.what for d in checked(text, plan, rules, "plasma")} == {"probe"}


@pytest.mark.parametrize("radius, wanted", [(1.47, False), (1.49, None), (1.5, None), (1.52, None), (1.53, True)])
def test_a_hole_wider_than_two_kerfs_must_be_cut_and_one_of_just_that_width_may(radius, wanted) -> None:
    hole = Polyline.circle(25, 25, radius)
    targets = build_targets(sheet_of((square(0, 0, 50), 0, -1, 1), (hole, 1, 0, 1)), 0.75)
    found = [t.may_stay for t in targets if t.index == 1]
    assert found == ([] if wanted is False else [wanted is None])


@pytest.mark.hazard
def test_a_clamp_is_in_the_way_of_the_kerf_whoever_compensates_it() -> None:
    """The first square has its left edge at x = 20; uncompensated, the middle of the kerf runs there."""
    plan, rules = planned("qtplasmac", CutOptions(compensation="none", small_hole=0.0))
    assert rules.half == 0.0
    clamp = (18.0, 60.0, 19.5, 70.0)
    held = replace(plan, sheet=replace(plan.sheet, zones=(clamp,)))
    assert "in a keep-out zone" in {d.what for d in checked(program(plan.cuts), held, rules)}


def test_what_does_not_pierce_begins_beside_the_sheet() -> None:
    plan, rules = planned()
    k = of_contour(plan.cuts, 4)
    cuts = with_cut(plan.cuts, k, pierce=False)
    found = checked(program(cuts), replace(plan, cuts=cuts), rules)
    assert "not pierced" in {d.what for d in found}


@pytest.mark.parametrize("words", ["grbl-laser", "fanuc-laser"])
def test_a_sheet_that_is_only_marked_is_marked_by_the_power_of_marks(words: str) -> None:
    plan, rules = planned(words)
    k = of_contour(plan.cuts, 3)
    sheet = replace(plan.sheet, contours=(replace(plan.sheet.contours[3], parent=-1, part=0),))
    mark = replace(plan.cuts[k], contours=(0,))
    alone = CutPlan(sheet, plan.data, (mark,))
    assert checked(program([mark], words), alone, rules, words, power=1000.0) == []
    assert checked(program([mark], words), alone, rules, words, power=200.0) != []
