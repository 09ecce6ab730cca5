"""The judge of a part finds each error of a program: depth, side, missing cut, tabs, tool, order."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import leafcut
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind, Toolpath
from leafcut.processes.part.model import Edge, Engraving, PartHole, PartRequest, PocketArea, PocketMill, TabRules
from leafcut.processes.part.proof.part import judge_part
from leafcut.proof.program import interpret_written_program

RADIUS, THICKNESS, BOTTOM = 2.0, 3.0, -3.5
SQUARES = [[(a, a), (100 - a, a), (100 - a, 100 - a), (a, 100 - a)] for a in (0, 30)]
SVG = '<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="100mm" viewBox="0 0 100 100">{}</svg>'
REQUEST = PartRequest(
    (
        Edge(Polyline.of_points(SQUARES[0], closed=True), inside=False, name="outline", tabs=2),
        Edge(Polyline.of_points(SQUARES[1], closed=True), inside=True, within=(0,), name="window"),
    ),
    (),
    tool=1,
    radius=RADIUS,
    thickness=THICKNESS,
    bottom=BOTTOM,
    tabs=TabRules(2, 5.0, 1.0),
)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A square of 100 mm with a window of 40 mm, milled with two tabs each."""
    source = tmp_path_factory.mktemp("part") / "part.svg"
    rings = "".join(f'<path d="M{" L".join(f"{x},{100 - y}" for x, y in one)} Z"/>' for one in SQUARES)
    source.write_text(SVG.format(rings))
    return leafcut.part(
        source,
        thickness=THICKNESS,
        tool_diameter=2 * RADIUS,
        tabs=2,
        tab_width=5.0,
        tab_height=1.0,
        preset="fast",
        threads=1,
    ).text


def judged(text: str) -> list[Difference]:
    return judge_part(REQUEST, interpret_written_program(text, load_dialect("linuxcnc")))


def test_the_program_as_written_has_no_difference(program: str) -> None:
    assert judged(program) == []


def _blocks(path: Toolpath) -> tuple[list[int], list[int], list[int], list[int]]:
    """Return the rows before the first cut, of each of both cuts from its approach on, and after the last cut."""
    travel = [row for row in np.flatnonzero(path.kind == Kind.RAPID).tolist() if not path.end[row, 2] < 0.0]
    moved = [row for row in travel if not np.array_equal(path.end[row, :2], path.before[row, :2])]
    first, second, end = moved[0], moved[1], travel[-1]
    rows = list(range(len(path)))
    return rows[:first], rows[first:second], rows[second:end], rows[end:]


def test_a_cut_that_is_left_out_is_found(program: str) -> None:
    path = interpret_written_program(program, load_dialect("linuxcnc"))
    head, window, outline, tail = _blocks(path)
    for kept in (window, outline):
        assert "not cut" in {one.what for one in judge_part(REQUEST, path.take([*head, *kept, *tail]))}


@pytest.mark.hazard
def test_an_outline_before_its_window_is_found(program: str) -> None:
    path = interpret_written_program(program, load_dialect("linuxcnc"))
    head, window, outline, tail = _blocks(path)
    assert judge_part(REQUEST, path.take([*head, *window, *outline, *tail])) == []
    swapped = judge_part(REQUEST, path.take([*head, *outline, *window, *tail]))
    assert [one.what for one in swapped] == ["order"] and str(swapped[0].text) == "window is milled after outline"


@pytest.mark.hazard
def test_a_cut_through_the_tabs_is_found(program: str) -> None:
    """A cut around the outline, 5 mm beside its path, goes through the material that the tabs hold on to."""
    beside = "X-7 Y-7\nG1 Z-3.5 F9\nX107\nY107\nX-7\nY-7\nG0 Z5"
    found = judged(program.replace("G53 G0 Z0", f"G0 Z5\n{beside}", 1))
    assert sum("goes through a tab" in str(difference.text) for difference in found) == 2


DRILLED = replace(REQUEST, holes=(PartHole(10.0, 10.0, 4, -4.4), PartHole(90.0, 10.0, 4, -4.4)))
DRILLING = [(x, 10.0, z) for x in (10.0, 90.0) for z in (-4.4,)]


@pytest.mark.hazard
@pytest.mark.parametrize(
    "plunges, late, what",
    [
        (DRILLING, False, None),
        (DRILLING[:1], False, "hole"),
        ([*DRILLING, DRILLING[0]], False, "hole"),
        ([DRILLING[0], (90.0, 10.0, -4.0)], False, "depth"),
        ([*DRILLING, (50.0, 10.0, -4.4)], False, "hole not drawn"),
        ([DRILLING[0], (90.1, 10.0, -4.4)], False, "hole not drawn"),
        (DRILLING, True, "order"),
    ],
)
def test_errors_of_drilled_holes_are_found(
    plunges: list[tuple[float, float, float]], late: bool, what: str | None, program: str
) -> None:
    cycles = [f"G99 G81 X{x} Y{y} Z{z} R2 F100" for x, y, z in plunges]
    drilling = ["T4 M6", "G43 H4 Z10", *cycles, "G80", "G0 Z10"]
    lines = program.splitlines()
    at = lines.index("M5") - 1 if late else lines.index("G53 G0 Z0") + 1
    lines[at:at] = drilling
    differences = judge_part(DRILLED, interpret_written_program("\n".join(lines), load_dialect("linuxcnc")))
    assert (what in {one.what for one in differences}) if what else differences == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "change, what",
    [
        (lambda text: text.replace("Z-3.5", "Z-2.9"), "tabs"),
        (lambda text: text.replace("Z-3.5", "Z-3.8"), "depth"),
        (lambda text: re.sub(r"Z-2\b(?!\.)", "Z-3.5", text), "tabs"),
        (lambda text: re.sub(r"Z-2\b(?!\.)", "Z-1.5", text), "not cut"),
        (lambda text: re.sub(r"X(-?[\d.]+)", lambda x: f"X{float(x[1]) + 1.0:.3f}", text), "gouge"),
        (lambda text: text.replace("T1 M6", "T2 M6").replace("H1", "H2"), "tool"),
        (
            lambda text: text.replace("G53 G0 Z0", "G0 Z5\nX200 Y200\nG1 Z-1 F9\nX210\nG0 Z5", 1),
            "cut not drawn",
        ),
    ],
)
def test_an_error_in_the_program_is_found(change: Callable[[str], str], what: str, program: str) -> None:
    changed = change(program)
    assert changed != program
    assert what in {difference.what for difference in judged(changed)}


LINE = Polyline.of_points([(10.0, 10.0), (25.0, 10.0), (25.0, 20.0)])
ENGRAVED = replace(REQUEST, engravings=(Engraving(LINE, 0.4, 1, "the line"),))
CUT = ["G0 X10 Y10 Z2", "G1 Z-0.4 F90", "X25", "Y20", "G0 Z5"]


@pytest.mark.hazard
@pytest.mark.parametrize(
    "lines, late, what",
    [
        (CUT, False, None),
        (["G0 X25 Y20 Z2", "G1 Z-0.4 F90", "Y10", "X10", "G0 Z5"], False, None),
        ([], False, "not cut"),
        ([line.replace("-0.4", "-0.3") for line in CUT], False, "not cut"),
        ([line.replace("-0.4", "-0.5") for line in CUT], False, "gouge"),
        ([line.replace("Y20", "Y19") for line in CUT], False, "not cut"),
        ([line.replace("Y20", "Y21") for line in CUT], False, "gouge"),
        ([line.replace("Y10", "Y10.1") for line in CUT], False, "cut not drawn"),
        ([*CUT[:4], "Y10", "X10", "G0 Z5"], False, "cut twice"),
        (CUT, True, "order"),
    ],
)
def test_errors_of_an_engraved_path_are_found(lines: list[str], late: bool, what: str | None, program: str) -> None:
    differences = judge_part(
        ENGRAVED, interpret_written_program(inserted(lines, program, late=late), load_dialect("linuxcnc"))
    )
    assert (what in {one.what for one in differences}) if what else differences == []


@pytest.mark.hazard
@pytest.mark.parametrize("step, what", [(1.76, None), (1.6, "too deep")])
def test_an_edge_that_is_cut_too_deep_at_once_is_found(step: float, what: str | None, program: str) -> None:
    """The program cuts 3.5 mm in two levels of 1.75 mm."""
    path = interpret_written_program(program, load_dialect("linuxcnc"))
    found = {one.what for one in judge_part(replace(REQUEST, steps={1: step}), path)}
    assert found == ({what} if what else set())


@pytest.mark.hazard
def test_a_level_that_is_left_out_is_found(program: str) -> None:
    path = interpret_written_program(program, load_dialect("linuxcnc"))
    upper = (path.end[:, 2] == -1.75) & (path.before[:, 2] == -1.75)
    found = judge_part(replace(REQUEST, steps={1: 1.76}), path.take(np.flatnonzero(~upper)))
    assert {one.what for one in found} == {"too deep"}


@pytest.mark.hazard
@pytest.mark.parametrize(
    "heights, what",
    [
        (["-0.5", "-1"], None),
        (["-1"], "too deep"),
        (["-0.3", "-1"], "too deep"),
        (["-0.5", "-1", "-0.5"], None),
    ],
)
def test_a_path_that_is_engraved_too_deep_at_once_is_found(heights: list[str], what: str | None) -> None:
    request = replace(REQUEST, edges=(), engravings=(Engraving(LINE, 1.0, 1, "the line"),), steps={1: 0.5})
    lines = [line for z in heights for line in [CUT[0], f"G1 Z{z} F90", *CUT[2:]]]
    text = "\n".join(["G21 G90 G17 G94", "T1 M6", *lines, "M2"])
    found = judge_part(request, interpret_written_program(text, load_dialect("linuxcnc")))
    assert {one.what for one in found} == ({what} if what else set())


def inserted(lines: list[str], program: str, *, late: bool) -> str:
    """Return the program with further lines before its first cut, or after its last one."""
    written = program.splitlines()
    at = written.index("M5") - 1 if late else next(k for k, line in enumerate(written) if line.startswith("G43")) + 1
    written[at:at] = [*lines, "G0 X32 Y32"]
    return "\n".join(written)


POCKETED = replace(
    REQUEST, pockets=(PocketArea(Polyline.of_points([(10, 10), (30, 10), (30, 17), (10, 17)], closed=True), (), 1.0),)
)
CLEARED = ["G0 X12 Y12 Z2", "G1 Z-1 F90", "X28", "Y15", "X12", "Y12", "G0 Z5"]


@pytest.mark.hazard
@pytest.mark.parametrize(
    "lines, late, what",
    [
        (CLEARED, False, None),
        ([*CLEARED, "G0 Z-0.5", "G0 Z5"], False, None),
        ([], False, "not cut"),
        ([*CLEARED[:3], "G0 Z5"], False, "not cut"),
        ([line.replace("Z-1", "Z-0.9") for line in CLEARED], False, "not cut"),
        ([line.replace("Z-1", "Z-1.1") for line in CLEARED], False, "gouge"),
        ([line.replace("X28", "X28.1") for line in CLEARED], False, "gouge"),
        ([CLEARED[0], "G0 Z-0.5", *CLEARED[1:]], False, "rapid into the part"),
        ([*CLEARED[:-1], "G0 X20", "G0 Z5"], False, "rapid into the part"),
        (CLEARED, True, "order"),
    ],
)
def test_errors_of_a_pocket_are_found(lines: list[str], late: bool, what: str | None, program: str) -> None:
    differences = judge_part(
        POCKETED, interpret_written_program(inserted(lines, program, late=late), load_dialect("linuxcnc"))
    )
    assert (what in {one.what for one in differences}) if what else differences == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    "step, feed, what",
    [(1.0, 1.5, None), (0.6, 1.5, "too deep"), (1.0, 1.4, "feed")],
)
def test_a_pocket_that_is_cut_too_deep_or_too_fast_is_found(
    step: float, feed: float, what: str | None, program: str
) -> None:
    """The pocket is cleared in one level of 1 mm with 90 mm/min."""
    (pocket,) = POCKETED.pockets
    request = replace(POCKETED, pockets=(replace(pocket, mill=PocketMill(1, RADIUS, step, feed)),))
    differences = judge_part(
        request, interpret_written_program(inserted(CLEARED, program, late=False), load_dialect("linuxcnc"))
    )
    assert (what in {str(one.what) for one in differences}) if what else differences == []


@pytest.mark.hazard
def test_a_slug_in_a_bore_is_found() -> None:
    """The mill of 4 mm goes around a hole of 9 mm, and leaves a slug of 1 mm."""
    hole = Edge(Polyline.circle(20.0, 20.0, 4.5), inside=True, name="hole", is_bore=True)
    text = "G21 G90 G17 G94\nT1 M6\nG0 X22.5 Y20 Z2\nG1 Z-3.5 F90\nG3 I-2.5\nG0 Z5\nM2\n"
    differences = judge_part(replace(REQUEST, edges=(hole,)), interpret_written_program(text, load_dialect("linuxcnc")))
    assert [str(one.what) for one in differences if "has a slug" in str(one.text)] == ["not cut"]


@pytest.mark.hazard
def test_a_slug_under_a_bore_that_is_cleared_above_is_found() -> None:
    """The hole of 9 mm is cleared to Z-2; below, a single turn leaves a slug."""
    hole = Edge(Polyline.circle(20.0, 20.0, 4.5), inside=True, name="hole", is_bore=True)
    wide, full = "G3 I-2.5", "G1 X20 Y20\nG1 X22.5"
    text = f"G21 G90 G17 G94\nT1 M6\nG0 X22.5 Y20 Z2\nG1 Z-2 F90\n{wide}\n{full}\nG1 Z-3.5\n{wide}\nG0 Z5\nM2\n"
    differences = judge_part(replace(REQUEST, edges=(hole,)), interpret_written_program(text, load_dialect("linuxcnc")))
    assert "not cut" in [str(one.what) for one in differences if "has a slug" in str(one.text)]


@pytest.mark.hazard
def test_a_small_place_in_a_wide_pocket_that_is_not_cleared_is_found() -> None:
    """Lines 3.5 mm apart clear an area of 200 mm × 200 mm, except for a piece of 8 mm of one of them."""
    corners = [(0, 0), (200, 0), (200, 200), (0, 200)]
    pocket = PocketArea(Polyline.of_points(corners, closed=True), (), 1.0)
    request = replace(REQUEST, edges=(), pockets=(pocket,))
    rows = [2.0, *np.arange(5.5, 198.0, 3.5), 198.0]
    cuts = [line for y in rows for line in (f"G0 X2 Y{y} Z2", "G1 Z-1 F90", "X198", "G0 Z2")]
    edges = ["G0 X2 Y2", "G1 Z-1", "Y198", "G0 Z2", "G0 X198 Y2", "G1 Z-1", "Y198", "G0 Z2"]
    whole = "\n".join(["G21 G90 G17 G94", "T1 M6", "G0 Z2", *cuts, *edges, "M2"])
    assert judge_part(request, interpret_written_program(whole, load_dialect("linuxcnc"))) == []
    gap = whole.replace("Y100.0 Z2\nG1 Z-1 F90\n", "Y100.0 Z2\nG1 Z-1 F90\nX96\nG0 Z2\nX104\nG1 Z-1\n")
    assert gap != whole
    assert [str(one.what) for one in judge_part(request, interpret_written_program(gap, load_dialect("linuxcnc")))] == [
        "not cut"
    ]
