"""Parts a kerf apart in a drawing, cut with common lines: programs, time norm and report."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

from leafcut import api
from leafcut.errors import LeafcutError, PlanError
from leafcut.geometry.polyline import Polyline
from leafcut.processes.registry import report_of
from leafcut.processes.sheet.report.cut_words import cut_counts

KERF = 1.5
FAST: dict[str, Any] = {"process": "cut", "thickness": "6", "kerf": "1.5", "iterations": 10, "threads": 1}


def drawing(folder: Path, gap: float) -> Path:
    """Four squares of 60 mm with a hole and a mark each, on a sheet of 220 mm."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    for x, y in ((40 + i * (60 + gap), 40 + j * (60 + gap)) for j in range(2) for i in range(2)):
        corners = [(x, y), (x + 60, y), (x + 60, y + 60), (x, y + 60)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "CUT"})
        space.add_circle((x + 30, y + 30), 10, dxfattribs={"layer": "CUT"})
        space.add_line((x + 5, y + 5), (x + 15, y + 5), dxfattribs={"layer": "MARK"})
    space.add_lwpolyline([(0, 0), (220, 0), (220, 220), (0, 220)], close=True, dxfattribs={"layer": "SHEET"})
    file = folder / f"four_{gap:g}.dxf"
    document.saveas(file)
    return file


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("common")
    return api.optimize(drawing(folder, KERF), common_lines=True, report=folder / "four.html", **FAST)


def test_the_program_is_proved_and_quicker(outcome, tmp_path: Path) -> None:
    single = api.optimize(drawing(tmp_path, KERF), **FAST)
    assert outcome.verified
    assert outcome.after.time_s < single.after.time_s
    assert [i.message for i in outcome.issues if i.code == "L616"] == [
        "240 mm of edges shared by 4 parts are cut only once, in 3 lines"
    ]


def test_the_route_is_the_perimeters_less_the_common_edges_and_the_moves_between(outcome) -> None:
    """Four squares, holes and marks of 10 mm, 4 · 60 mm between the squares; pierces of holes, lines, one around."""
    norm = outcome.detail.plan.measures
    perimeters = 4 * 240 + 4 * math.tau * 10 + 4 * 10
    cuts = outcome.detail.plan.cuts
    moves = sum(math.dist(a.path.end, b.path.start) for a, b in itertools.pairwise(cuts))
    assert norm.sheet.common_mm == pytest.approx(240.0, abs=1e-6)
    assert norm.sheet.length_mm == pytest.approx(perimeters - 240 + moves, abs=0.01)
    assert norm.sheet.pierces == 4 + 3 + 1


def test_the_parts_share_what_their_lines_take(outcome) -> None:
    norm = outcome.detail.plan.measures
    assert sum(p.times.perimeter_mm for p in norm.parts) == pytest.approx(norm.sheet.perimeter_mm)
    assert sum(p.times.common_mm for p in norm.parts) == pytest.approx(240.0)
    assert sum(p.times.cut_s for p in norm.parts) == pytest.approx(norm.sheet.cut_s)
    assert sum(p.times.pierces for p in norm.parts) == 8


def test_the_summary_says_what_is_cut_once(outcome) -> None:
    words = {fact.name: fact.sentence for fact in report_of(outcome).facts}["Path length"]
    assert "perimeters − 240.0 mm of common edges" in words
    assert cut_counts(outcome.detail.plan)["contours"] == 8


def test_marks_and_holes_come_first_and_what_is_around_last(outcome) -> None:
    words = []
    for cut in outcome.detail.plan.cuts:
        hole = outcome.detail.plan.sheet.contours[cut.contours[0]].is_hole
        words.append("first" if cut.kind == "mark" or hole else "line" if cut.common else "around")
    assert words == ["first"] * 8 + ["line"] * 3 + ["around"]


@pytest.mark.parametrize("words", ["plasma", "linuxcnc"])
def test_other_controllers_cut_common_lines_too(words: str, tmp_path: Path) -> None:
    done = api.optimize(drawing(tmp_path, KERF), common_lines=True, dialect=words, ignore_layers="MARK", **FAST)
    assert done.verified
    assert done.detail.plan.measures.sheet.common_mm == pytest.approx(240.0, abs=1e-6)


def test_edges_that_coincide_are_cut_once_without_compensation(tmp_path: Path) -> None:
    done = api.optimize(drawing(tmp_path, 0.0), common_lines=True, compensation="none", **FAST)
    assert done.verified
    assert done.detail.plan.measures.sheet.common_mm == pytest.approx(240.0, abs=1e-3)


def test_a_single_common_line_is_counted_in_the_singular(tmp_path: Path) -> None:
    pair = ([(40, 40), (100, 40), (100, 100), (40, 100)], [(100, 40), (160, 40), (160, 100), (100, 100)])
    done = api.optimize(plates(tmp_path, *pair), compensation="none", **FAST)
    (issue,) = [i for i in done.issues if i.code == "L616"]
    assert issue.message == "60 mm of edges shared by 2 parts are cut only once, in 1 line"


def test_edges_drawn_once_for_two_parts_are_refused(tmp_path: Path) -> None:
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(40, 40), (160, 40), (160, 100), (40, 100)], close=True)
    space.add_line((100, 40), (100, 100))
    document.saveas(tmp_path / "once.dxf")
    with pytest.raises(LeafcutError) as refused:
        api.optimize(tmp_path / "once.dxf", common_lines=True, compensation="none", **FAST)
    assert "\n" not in str(refused.value)


def plate(folder: Path, name: str, points: list[tuple[float, float]]) -> str:
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline(points, close=True)
    document.saveas(folder / f"{name}.dxf")
    return f"{folder}/{name}.dxf"


@pytest.mark.parametrize("lead_in", ["auto", "none"])
def test_what_is_nested_in_blocks_is_cut_with_common_lines_all_of_them(lead_in: str, tmp_path: Path) -> None:
    """Twenty plates on a small sheet: nested without gaps as tight as they go, some could not be begun anywhere."""
    part = plate(tmp_path, "plate", [(0, 0), (120, 0), (120, 80), (0, 80)])
    nested, file = {"kerf": 0.22, "sheet": "500x500", "blocks": "grids", "variants": 1}, tmp_path / "nested.dxf"
    found = api.nest([f"{part}:20"], file, **nested)
    cut: dict[str, Any] = {**FAST, "thickness": 3, "machine": "laser-table", "common_lines": True, "lead_in": lead_in}
    del cut["kerf"]
    for name in found.files[0]:
        outcome = api.optimize(name, **cut)
        assert outcome.verified
        assert "L617" not in [i.code for i in outcome.issues]
        assert outcome.detail.plan.measures.sheet.common_mm > 200.0


def test_plates_that_are_too_near_are_told_the_kerf_to_be_nested_with(tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match="with that kerf"):
        api.optimize(drawing(tmp_path, 1.3), common_lines=True, **FAST)


# -- edges that touch, without compensation, and edges in corners ----------------------------------------------------

#: A plate with a notch from above, and one that fills the notch; beside its edges stays `gap`.
NOTCHED = [(40, 40), (160, 40), (160, 140), (130, 140), (130, 70), (70, 70), (70, 140), (40, 140)]
LASER: dict[str, Any] = {**FAST, "machine": "laser-table", "thickness": "3"}


def filling(gap: float) -> list[tuple[float, float]]:
    return [(70 + gap, 70 + gap), (130 - gap, 70 + gap), (130 - gap, 140), (70 + gap, 140)]


def plates(folder: Path, *outlines: list[tuple[float, ...]] | list[tuple[float, float]]) -> Path:
    document = ezdxf.new(units=4)
    for points in outlines:
        document.modelspace().add_lwpolyline(points, format="xyb"[: len(points[0])], close=True)
    document.saveas(folder / "plates.dxf")
    return folder / "plates.dxf"


def bodies(done: Any) -> list[Any]:
    """Return the cuts without leads, in chords."""
    return [shapely.LineString(c.path.piece(c.lead_in, c.lead_out).flattened(0.005)) for c in done.detail.plan.cuts]


@pytest.mark.parametrize("machine", ["plasma-table", "laser-table"])
@pytest.mark.parametrize("second", [filling(0.0), [(160, 40), (220, 40), (220, 90), (160, 90)]])
def test_edges_that_touch_are_cut_once_without_compensation_and_without_an_option(
    machine: str, second: list[tuple[float, float]], tmp_path: Path
) -> None:
    """The total cut length equals the length of the union of the drawn lines."""
    drawn = [shapely.Polygon(points).exterior for points in (NOTCHED, second)]
    done = api.optimize(plates(tmp_path, NOTCHED, second), compensation="none", **{**FAST, "machine": machine})
    assert done.verified
    assert sum(line.length for line in bodies(done)) == pytest.approx(shapely.union_all(drawn).length, abs=0.01)
    assert shapely.union_all(drawn).difference(shapely.union_all(bodies(done)).buffer(0.01)).length < 0.01
    assert "L617" not in [i.code for i in done.issues]


def test_edges_of_an_inner_corner_a_kerf_apart_are_one_common_line(tmp_path: Path) -> None:
    done = api.optimize(plates(tmp_path, NOTCHED, filling(KERF)), common_lines=True, **FAST)
    assert done.verified
    assert done.detail.plan.measures.sheet.common_mm == pytest.approx(2 * 68.5 + 57, abs=0.1)
    assert [len(c.contours) for c in done.detail.plan.cuts if not c.common] == [2]


def test_a_part_most_of_which_lies_a_kerf_from_another_is_refused_with_the_option_that_cuts_it(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"part 2: .* part 1: .* more than half of its length.*--common-lines"):
        api.optimize(plates(tmp_path, NOTCHED, filling(KERF)), **FAST)


def test_touching_parts_are_refused_by_name_where_an_option_keeps_them_from_sharing_the_cut(tmp_path: Path) -> None:
    with pytest.raises(PlanError, match=r"part 2: .* part 1: .*would be cut twice"):
        api.optimize(plates(tmp_path, NOTCHED, filling(0.0)), compensation="none", micro_joints=1, **LASER)


#: Pairs of outlines (x, y, bulge) with shared edges: an arc, an arc in two, line with arc and line, short lines.
WAVE = [(60 + 6 * math.sin(k / 60 * math.tau), 20 + k) for k in range(61)]
EIGHTH, SIXTEENTH = math.tan(math.pi / 8), math.tan(math.pi / 16)
DIAGONAL = 20 + 60 * math.sqrt(0.5)
BENT: dict[str, tuple[Any, Any]] = {
    "arc": (
        [(40, 40, 0), (100, 40, 0.5), (100, 100, 0), (40, 100, 0)],
        [(100, 40, 0), (160, 40, 0), (160, 100, 0), (100, 100, -0.5)],
    ),
    "divided arc": (
        [(20, 20, 0), (80, 20, EIGHTH), (20, 80, 0)],
        [
            (80, 20, 0), (120, 20, 0), (120, 120, 0), (20, 120, 0), (20, 80, -SIXTEENTH),
            (DIAGONAL, DIAGONAL, -SIXTEENTH),
        ],
    ),
    "line, arc and line": (
        [(20, 20, 0), (60, 20, 0), (60, 40, 0.3), (60, 80, 0), (60, 100, 0), (20, 100, 0)],
        [(60, 20, 0), (100, 20, 0), (100, 100, 0), (60, 100, 0), (60, 80, -0.3), (60, 40, 0)],
    ),
    "short lines": ([(20, 20), *WAVE, (20, 80)], [(100, 20), (100, 80), *WAVE[::-1]]),
}  # fmt: skip


@pytest.mark.parametrize("shape", BENT)
def test_bent_edges_that_coincide_are_cut_once_without_compensation(shape: str, tmp_path: Path) -> None:
    """The total cut length equals the length of the union of the drawn lines, and an arc stays an arc."""
    outlines = BENT[shape]
    done = api.optimize(plates(tmp_path, *outlines), compensation="none", **FAST)
    assert done.verified
    drawn = [Polyline(np.array([(*p, 0.0)[:3] for p in points]), closed=True) for points in outlines]
    edges = [shapely.LineString(path.flattened(0.002)) for path in drawn]
    shared = edges[0].intersection(edges[1].buffer(0.01)).length
    (line,) = (cut for cut in done.detail.plan.cuts if cut.common)
    assert line.common == pytest.approx(shared, abs=0.05)
    cut = bodies(done)
    assert sum(body.length for body in cut) == pytest.approx(sum(edge.length for edge in edges) - shared, abs=0.1)
    assert shapely.union_all(edges).difference(shapely.union_all(cut).buffer(0.02)).length < 0.01
    assert line.path.n_segments <= 4 or shape == "short lines"
    assert "L617" not in [i.code for i in done.issues]


def test_a_bent_edge_that_ends_along_another_edge_is_no_common_line(tmp_path: Path) -> None:
    """A half circle meets both sides of the other part at a tangent."""
    half, rest = [(10, 40, 0), (70, 40, 1.0)], [(10, 40, -1.0), (70, 40, 0), (70, 120, 0), (10, 120, 0)]
    with pytest.raises(PlanError, match=r"part 1: .* coincides with part 2"):
        api.optimize(plates(tmp_path, half, rest), compensation="none", **FAST)


@pytest.mark.parametrize("radius", [1.0, 3.0, 5.0, 15.0])
def test_plates_with_round_corners_have_common_lines(radius: float, tmp_path: Path) -> None:
    def round_plate(x: float) -> list[tuple[float, ...]]:
        low, high, r, b = x, x + 60, radius, math.tan(math.pi / 8)
        return [
            (low + r, 40, 0), (high - r, 40, b), (high, 40 + r, 0), (high, 100 - r, b),
            (high - r, 100, 0), (low + r, 100, b), (low, 100 - r, 0), (low, 40 + r, b),
        ]  # fmt: skip

    done = api.optimize(plates(tmp_path, round_plate(40), round_plate(100 + KERF)), common_lines=True, **FAST)
    assert done.verified
    assert done.detail.plan.measures.sheet.common_mm == pytest.approx(60 - 2 * radius, abs=0.1)


def test_edges_one_kerf_apart_are_never_reported_as_missing(tmp_path: Path) -> None:
    """Strips before both ends of the gap leave its line no place to start."""
    pair = [[(x, 60), (x + 60, 60), (x + 60, 120), (x, 120)] for x in (40, 100 + KERF)]
    strips = [[(60, y), (140, y), (140, y + 20), (60, y + 20)] for y in (60 - KERF - 0.5 - 20, 120 + KERF + 0.5)]
    done = api.optimize(plates(tmp_path, *pair, *strips), common_lines=True, **FAST)
    (issue,) = [i for i in done.issues if i.code in ("L616", "L617")]
    assert issue.code == "L617"
    assert issue.message.startswith("60 mm of edges one kerf apart")


def test_without_compensation_the_message_does_not_deny_the_kerf_between_edges(tmp_path: Path) -> None:
    done = api.optimize(drawing(tmp_path, KERF), common_lines=True, compensation="none", **FAST)
    (issue,) = [i for i in done.issues if i.code == "L616"]
    assert "without compensation" in issue.message
    assert "kerf apart" not in issue.message


def test_a_head_that_stays_down_cuts_common_lines_before_the_path_around(tmp_path: Path) -> None:
    """Its travel moves cross the parts, which only the path around detaches: no change of the order avoids that."""
    corner = [(40, 40), (140, 40), (140, 70), (70, 70), (70, 140), (40, 140)]
    done = api.optimize(
        plates(tmp_path, corner, [(70, 70), (140, 70), (140, 140), (70, 140)]), compensation="none", **LASER
    )
    assert done.verified
    assert [c.common > 0 for c in done.detail.plan.cuts] == [True, True, False]


# -- where touching parts are pierced --------------------------------------------------------------------------------

#: Rows of three squares; one part between four others that share all of its edges; one between parts that come later.
SQUARES = [[(x, y), (x + 40, y), (x + 40, y + 40), (x, y + 40)] for x in (40, 80, 120) for y in (40, 80, 120)]


def rectangle(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, float]]:
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


ENCLOSED = [
    rectangle(*r)
    for r in (
        (156, 0, 240, 96),
        (0, 0, 120, 64),
        (120, 96, 240, 160),
        (0, 64, 36, 160),
        (120, 0, 156, 96),
        (36, 64, 120, 92.8),
        (36, 92.8, 120, 160),
    )
]
POCKET = [
    rectangle(*r)
    for r in (
        (0, 64, 72, 160),
        (122.4, 48, 181.2, 160),
        (181.2, 48, 240, 160),
        (122.4, 0, 240, 48),
        (0, 0, 72, 64),
        (72, 0, 122.4, 80),
        (72, 80, 122.4, 160),
    )
]


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("machine", "outlines"),
    [("plasma-table", SQUARES), ("plasma-table", ENCLOSED), ("laser-table", POCKET)],
    ids=["squares", "enclosed", "pocket"],
)
def test_touching_parts_are_pierced_in_metal_that_no_earlier_cut_has_burnt(
    machine: str, outlines: list[list[tuple[float, float]]], tmp_path: Path
) -> None:
    rules = {**FAST, "machine": machine, "thickness": "3", "lead_in": "none", "compensation": "none"}
    done = api.optimize(plates(tmp_path, *outlines), **rules)
    assert done.verified
    lines = bodies(done)
    for k, cut in enumerate(done.detail.plan.cuts):
        assert all(shapely.distance(line, shapely.Point(*cut.path.start)) > 0.75 for line in lines[:k])
