"""Common lines: edges of two parts a kerf apart are cut once, before what is around the parts; lengths by hand."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely

from cut_sheets import FINE, LASER, PLASMA, materials, rectangle, sheet_of, split_rectangle, swept
from cut_sheets import cutting_of as every_cutting_of
from leafcut.errors import OptionError, PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.model.cutting import Cut, CutData
from leafcut.model.sheet import Sheet
from leafcut.processes.sheet.plan.cutting import Cutting, drawing_order

#: What lies at the ends of a line: from the middle of the path around to the parts.
HALF = 0.5 * PLASMA.kerf
#: Maximum distance of line ends from the middle of a kerf, mm.
END = 0.03


def outlines(*boxes: tuple[float, float, float, float]) -> Sheet:
    return sheet_of(*((rectangle(*box), 0, -1, n) for n, box in enumerate(boxes, 1)), size=500)


def grid(columns: int, rows: int, gap: float, side: float = 60.0) -> Sheet:
    pitch = side + gap
    return outlines(*((40 + i * pitch, 40 + j * pitch, side, side) for j in range(rows) for i in range(columns)))


def cutting_of(sheet: Sheet, data: CutData = PLASMA, **options: Any) -> Cutting:
    return every_cutting_of(sheet, data, common_lines=True, **options)


def cuts_of(cutting: Cutting) -> list[Cut]:
    return [cutting.cut(s) for s in drawing_order(cutting)]


def body(cut: Cut) -> Polyline:
    return cut.path.piece(cut.lead_in, cut.lead_out)


def line_of(cut: Cut) -> Any:
    return shapely.LineString(cut.path.flattened(FINE))


def assert_parts_are_cut_out(cutting: Cutting, cuts: list[Cut]) -> None:
    """The kerfs touch no part, and what is left of the sheet are the parts, each alone, and scrap."""
    kerf = cutting.rules.kerf
    parts = materials(cutting.sheet)
    for cut in cuts:
        for number, part in parts.items():
            assert swept(cut.path, kerf).intersection(part).area < 1e-3, f"cut of {cut.contours} gouges part {number}"
    burnt = shapely.union_all([line_of(c).buffer(0.5 * kerf + END) for c in cuts])
    left = [p for p in shapely.get_parts(shapely.box(0, 0, 500, 500).difference(burnt)) if p.area > 1.0]
    for part in parts.values():
        holders = [p for p in left if p.intersects(part)]
        assert len(holders) == 1
        assert holders[0].area == pytest.approx(part.area, rel=0.01)


def test_two_squares_have_one_line_from_kerf_to_kerf_and_one_path_around() -> None:
    """The line is 60 + 1.5 mm long; around go twice 121.5 + 60 mm and a circle of half a kerf."""
    cutting = cutting_of(grid(2, 1, PLASMA.kerf))
    line, around = cuts_of(cutting)
    assert line.contours == around.contours == (0, 1)
    assert line.common == pytest.approx(60.0, abs=1e-6)
    assert body(line).length == pytest.approx(61.5, abs=END)
    assert around.common == 0.0
    assert body(around).length == pytest.approx(2 * 181.5 + math.tau * HALF, abs=0.01)
    assert_parts_are_cut_out(cutting, [line, around])


def test_the_line_begins_in_the_scrap_with_a_lead_in_its_own_direction() -> None:
    line = cuts_of(cutting_of(grid(2, 1, PLASMA.kerf)))[0]
    x, y = line.path.start
    assert x == pytest.approx(100.75, abs=1e-6)
    assert y == pytest.approx(40 - HALF - line.lead_in, abs=END)
    assert line.lead_in == pytest.approx(6.0)


def test_three_in_a_row_have_two_lines() -> None:
    cutting = cutting_of(grid(3, 1, PLASMA.kerf))
    cuts = cuts_of(cutting)
    assert [c.contours for c in cuts] == [(0, 1), (1, 2), (0, 1, 2)]
    assert [c.common for c in cuts] == pytest.approx([60, 60, 0])
    assert body(cuts[-1]).length == pytest.approx(2 * (183 + 60) + math.tau * HALF, abs=0.01)
    assert_parts_are_cut_out(cutting, cuts)


def test_of_four_squares_a_plasma_cuts_one_line_through_and_two_that_end_at_it() -> None:
    """Whole 121.5 + 1.5 mm; the others 60 + 1.5 mm from the scrap to the middle of its kerf."""
    cutting = cutting_of(grid(2, 2, PLASMA.kerf))
    cuts = cuts_of(cutting)
    assert [c.common for c in cuts] == pytest.approx([120, 60, 60, 0])
    assert [body(c).length for c in cuts[:3]] == pytest.approx([123, 61.5, 61.5], abs=2 * END)
    through = line_of(cuts[0])
    for other in cuts[1:3]:
        assert shapely.Point(other.path.end).distance(through) < END
        assert shapely.Point(other.path.start).distance(through) > 60
    assert_parts_are_cut_out(cutting, cuts)


def test_a_laser_cuts_lines_across_each_other() -> None:
    cutting = cutting_of(grid(3, 3, LASER.kerf), LASER)
    cuts = cuts_of(cutting)
    assert [c.common for c in cuts] == pytest.approx([180, 180, 180, 180, 0])
    assert_parts_are_cut_out(cutting, cuts)


def test_a_plasma_does_not_cut_three_rows_as_one_group() -> None:
    """Of the square in the middle no straight line could be begun in the scrap; a line around its corner can."""
    cutting = cutting_of(grid(3, 3, PLASMA.kerf))
    cuts = cuts_of(cutting)
    assert max(len(c.contours) for c in cuts) < 9
    assert any(c.common and body(c).n_segments > 1 for c in cuts)
    assert any(i.code == "L617" for i in cutting.issues)
    for a, b in itertools.combinations([c for c in cuts if c.common], 2):
        met = line_of(a).intersection(line_of(b))
        assert met.is_empty or met.distance(shapely.Point(b.path.end)) < END


def test_a_plasma_does_not_cut_four_rows() -> None:
    with pytest.raises(PlanError, match=r"no lead fits into the scrap at part"):
        cutting_of(grid(4, 4, PLASMA.kerf))


def test_edges_of_different_length_share_what_faces_and_a_lead_comes_in_at_an_angle() -> None:
    """40 mm of an edge of 100 mm: the line ends at inner corners of the path around, to which no straight lead goes."""
    cutting = cutting_of(outlines((40, 40, 60, 100), (101.5, 60, 60, 40)))
    line, around = cuts_of(cutting)
    assert line.common == pytest.approx(40.0, abs=1e-6)
    assert body(line).length == pytest.approx(41.5, abs=END)
    assert line.path.start[0] > 100.75 + 2.0
    # Twice 121.5 + 100 mm, with arcs for six corners and two sharp corners inside.
    straight = 2 * (121.5 + 100) - 4 * HALF
    assert body(around).length == pytest.approx(straight + 1.5 * math.tau * HALF, abs=0.05)
    assert_parts_are_cut_out(cutting, [line, around])


def test_edges_that_face_only_in_part_share_that_part() -> None:
    cutting = cutting_of(outlines((40, 40, 60, 60), (101.5, 70, 60, 60)))
    line, around = cuts_of(cutting)
    assert line.common == pytest.approx(30.0, abs=1e-6)
    assert around.contours == (0, 1)
    assert_parts_are_cut_out(cutting, [line, around])


def test_slanting_edges_share_what_faces() -> None:
    """At 45 degrees and a kerf apart the ends of 60√2 mm are moved along by a kerf."""
    aside = PLASMA.kerf * math.sqrt(2)
    left = Polyline.of_points([(40, 40), (100, 40), (160, 100), (40, 100)], closed=True)
    right = Polyline.of_points([(100 + aside, 40), (220, 40), (220, 100), (160 + aside, 100)], closed=True)
    cutting = cutting_of(sheet_of((left, 0, -1, 1), (right, 0, -1, 2), size=500))
    line, around = cuts_of(cutting)
    assert line.common == pytest.approx(60 * math.sqrt(2) - PLASMA.kerf, abs=1e-6)
    assert max(s.radius for s in around.path.segments() if s.is_arc) < 1e5
    assert_parts_are_cut_out(cutting, [line, around])


def test_round_corners_stay_arcs_around_a_group() -> None:
    rows = [(0, 0, 0), (50, 0, math.tan(math.pi / 8)), (60, 10, 0), (60, 60, 0), (0, 60, 0)]
    left = Polyline(np.array([(100 - x, 40 + y, -b) for x, y, b in rows]), closed=True).reversed()
    right = Polyline(np.array([(101.5 + x, 40 + y, b) for x, y, b in rows]), closed=True)
    cutting = cutting_of(sheet_of((left, 0, -1, 1), (right, 0, -1, 2), size=500))
    line, around = cuts_of(cutting)
    assert line.common == pytest.approx(60.0, abs=1e-6)
    assert around.path.n_segments < 25
    assert sorted(round(s.radius, 2) for s in around.path.segments() if s.is_arc and s.radius > 8) == [10.75, 10.75]
    assert_parts_are_cut_out(cutting, [line, around])


@pytest.mark.parametrize("off, lines", [(0.015, 1), (-0.015, 1), (0.03, 0), (1.5, 0)])
def test_parts_share_a_line_when_they_are_a_kerf_apart_within_a_fiftieth_of_a_millimetre(
    off: float, lines: int
) -> None:
    cutting = cutting_of(grid(2, 1, PLASMA.kerf + off))
    assert sum(c.common > 0 for c in cuts_of(cutting)) == lines
    assert [i.code for i in cutting.issues if i.code == "L616"] == ["L616"]


def test_parts_nearer_than_a_kerf_by_more_than_the_proof_lets_pass_are_refused() -> None:
    with pytest.raises(PlanError, match=r"nearer to part 2 than the kerf of 1\.5 mm"):
        cutting_of(grid(2, 1, PLASMA.kerf - 0.025))


def test_without_the_option_every_outline_is_cut_for_itself() -> None:
    cutting = every_cutting_of(grid(2, 2, PLASMA.kerf))
    assert [c.contours for c in cuts_of(cutting)] == [(0,), (1,), (2,), (3,)]
    assert all(c.common == 0.0 and c.group == 0 for c in cuts_of(cutting))


def test_edges_that_coincide_are_cut_once_where_nothing_is_compensated() -> None:
    """Around go 4 · 120 mm; the lines are 120 mm and twice 60 mm."""
    cuts = cuts_of(cutting_of(grid(2, 2, 0.0), compensation="none"))
    assert [c.common for c in cuts] == pytest.approx([120, 60, 60, 0])
    assert body(cuts[-1]).length == pytest.approx(480, abs=1e-3)
    assert body(cuts[0]).length == pytest.approx(120, abs=END)


def test_edges_that_coincide_leave_no_room_for_a_kerf() -> None:
    with pytest.raises(PlanError, match=r"nearer to part 2 than the kerf"):
        cutting_of(grid(2, 1, 0.0))


def test_holes_and_marks_of_all_parts_come_before_the_lines_and_those_before_what_is_around() -> None:
    squares = [(rectangle(40 + 61.5 * i, 40, 60, 60), 0, -1, i + 1) for i in range(3)]
    holes = [(Polyline.circle(70 + 61.5 * i, 70, 12), 1, i, i + 1) for i in range(3)]
    marks = [(Polyline.of_points([(45 + 61.5 * i, 45), (55 + 61.5 * i, 45)]), i, i + 1) for i in range(3)]
    cutting = cutting_of(sheet_of(*squares, *holes, marks=marks, size=500))
    words = {
        k: "mark" if c.kind == "mark" else "hole" if c.hole else "line" if c.common else "around"
        for k, c in enumerate(cutting.contours)
    }
    pairs = {(words[a], words[b]) for a, b in cutting.contour_precedence}
    assert {("hole", "line"), ("mark", "line"), ("hole", "around"), ("line", "around")} <= pairs
    before = {b: {a for a, c in cutting.contour_precedence if c == b} for b in words}
    for k, word in words.items():
        if word == "line":
            assert sum(words[a] == "hole" for a in before[k]) == 3
            assert sum(words[a] == "mark" for a in before[k]) == 3


def test_scrap_that_a_group_encloses_makes_no_group_of_all() -> None:
    """Four rectangles around a square of scrap: its inside would need a cut of its own."""
    k = LASER.kerf
    boxes = ((40, 40, 100, 40), (140 + k, 40, 40, 100), (80 + k, 140 + k, 100, 40), (40, 80 + k, 40, 100))
    cutting = cutting_of(outlines(*boxes), LASER)
    cuts = cuts_of(cutting)
    assert max(len(c.contours) for c in cuts) < 4
    assert any(i.code == "L617" for i in cutting.issues)


@pytest.mark.parametrize(
    "options",
    [
        {"chains": True},
        {"micro_joints": 1},
        {"corner_loops": True},
        {"heat_distance": 50.0},
        {"compensation": "controller"},
        {"planned": True},
        {"save_plan": "new.json"},
    ],
)
def test_what_common_lines_do_not_go_with_is_refused(options: dict[str, Any]) -> None:
    with pytest.raises(OptionError, match=r"--common-lines cannot be combined with"):
        cutting_of(grid(2, 1, PLASMA.kerf), **options)


@pytest.mark.parametrize("process", ["laser_fiber_3kW", "plasma"])
@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=[pytest.mark.slow] if seed > 4 else []) for seed in range(10)]
)
def test_whatever_a_rectangle_is_split_into_is_cut_out_or_refused(process: str, seed: int) -> None:
    boxes = split_rectangle(seed, LASER.kerf)
    try:
        cutting = cutting_of(outlines(*boxes), replace(LASER, process=process), lead_in_length=2.0)
    except PlanError as refused:
        assert "no lead fits into the scrap" in str(refused)
        return
    cuts = cuts_of(cutting)
    assert_parts_are_cut_out(cutting, cuts)
    twice = [line_of(c).buffer(0.02) for c in cuts if c.common]
    for a, b in itertools.combinations(twice, 2):
        assert a.intersection(b).area < 0.01
