"""The judge of drilling: place, tool, depth and number of holes, against the drawing and the options."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leafcut
from leafcut.errors import LeafcutError, VerifyError
from leafcut.gcode.dialects import load_dialect
from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.machine import Machine
from leafcut.model.mesh import Mesh
from leafcut.model.part import Hole, HoleStep, Part, Slot
from leafcut.model.tool import Recipe, Tool, ToolKind, ToolLibrary
from leafcut.options import PostOptions, ReadOptions
from leafcut.post.writer import write_program
from leafcut.processes.drilling import spec
from leafcut.processes.drilling.judge import DrillingRequest, judge_holes
from leafcut.processes.drilling.plan.drill_toolpath import drawing_order, generate_toolpath
from leafcut.processes.drilling.plan.drilling import DrillPlan, plan_drilling
from leafcut.processes.placing import place_part
from leafcut.proof.program import interpret_written_program, max_rounding_error
from meshes import box_triangles
from option_groups import drilling

MILL = Machine(
    "mill",
    "",
    "linuxcnc",
    (100.0, 100.0, 50.0),
    (500.0, 500.0, 250.0),
    40.0,
    (-400.0, -400.0, -300.0),
    (400.0, 400.0, 100.0),
    spindle_max_rpm=9000.0,
)
#: Point of a 118° drill of 1 mm diameter, mm: 0.5 / tan 59°.
POINT = 0.5 / math.tan(math.radians(59))
LIBRARY = ToolLibrary(
    (
        Tool(1, 3.15, ToolKind.CENTRE_DRILL, feed=1.0, spindle_rpm=3000, depth=1.5),
        Tool(3, 3.0, feed=2.0, spindle_rpm=2000),
        Tool(5, 5.0, feed=2.0, spindle_rpm=2000),
        Tool(6, 6.0, ToolKind.TAP, feed=500 / 60, spindle_rpm=500, pitch=1.0, point_angle=math.pi),
        Tool(9, 4.0, ToolKind.SLOT_MILL, feed=1.0, spindle_rpm=3000, point_angle=math.pi, peck=9.0),
    ),
    (Recipe(6.0, (1, 5, 6), "TAP*"),),
    "shop.toml",
)
HOLES = (Hole(3.25, 7.5, 3.0), Hole(33.125, 7.5, 5.0), Hole(33.125, 28.0, 3.0), Hole(-4.5, 28.0, 6.0, "TAPPED"))
PART = Part("part", HOLES, (Slot((10.0, 2.0), (18.0, 2.0), 4.0),))
PLAIN = replace(PART, holes=HOLES[:3])
PLAIN_HOLES = replace(PLAIN, slots=())


def request(part: Part = PART, library: ToolLibrary | None = LIBRARY, **options: Any) -> DrillingRequest:
    """Return a request; options of reading are those that place the part."""
    place = {name: options.pop(name) for name in ("mirror", "rotate", "origin", "z_zero") if name in options}
    job, ours = drilling(**{"thickness": 8.0, **options})
    return DrillingRequest(part, ReadOptions(**place), job, ours, library)


def program(asked: DrillingRequest, name: str, units: str) -> str:
    """Return the program that leafcut makes, holes in the order of the drawing."""
    part = place_part(asked.part, asked.reading)
    plan = plan_drilling(part, MILL, asked.library, asked.job, asked.options, drawn=asked.reading.z_zero == "drawn")
    path = generate_toolpath(plan, MILL, [drawing_order(one) for one in plan.operations])
    names = {tool.number: tool.label.split(" ", 1)[1] for tool in plan.tools}
    return write_program(path, load_dialect(name), PostOptions(output_units=units), ["judged"], tool_names=names)


def faults(asked: DrillingRequest, text: str, name: str = "linuxcnc", units: str = "mm") -> list[str]:
    """Return the judge's errors, or the reason why the controller refuses the text."""
    words = load_dialect(name)
    try:
        return [
            one.what
            for one in judge_holes(
                asked, text, interpret_written_program(text, words), max_rounding_error(words, units)
            )
        ]
    except LeafcutError as problem:
        return [str(problem)]


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"thickness": None, "depth": 4.0},
        {"thickness": None, "depth": 4.0, "depth_to": "tip"},
        {"break_through": 0.0, "peck": 1.5},
        {"mirror": "x", "rotate": math.radians(30.0), "origin": "lower-left"},
        {"mirror": "y", "rotate": -0.5 * math.pi, "origin": "centre"},
        {"origin": (100.0, -7.125)},
        {"z_zero": "drawn"},
    ],
)
def test_what_leafcut_drills_without_a_library_passes_the_judge(options: dict[str, Any]) -> None:
    part = PART
    if "z_zero" in options:
        part = replace(PART, holes=tuple(replace(hole, z=-1.25 * k) for k, hole in enumerate(HOLES)))
    asked = request(part, None, **options)
    for name, units in (("linuxcnc", "mm"), ("grbl", "inch"), ("siemens", "mm"), ("marlin", "mm")):
        assert faults(asked, program(asked, name, units), name, units) == []


@pytest.mark.parametrize("options", [{}, {"centre_drill": True}, {"thickness": None, "depth": 4.0}])
def test_what_leafcut_drills_with_a_library_passes_the_judge(options: dict[str, Any]) -> None:
    asked = request(**options)
    for name, units in (("haas", "mm"), ("fanuc", "inch"), ("linuxcnc", "mm")):
        assert faults(asked, program(asked, name, units), name, units) == []


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("drawn", "tolerance", "accepted"),
    [(3.0, 0.0, True), (3.04, 0.05, True), (3.05, 0.05, True), (3.051, 0.05, False), (2.949, 0.05, False),
     (3.04, 0.039, False), (2.96, 0.05, True), (3.01, 0.0, False)],
)  # fmt: skip
def test_an_assumed_drill_may_differ_from_the_hole_by_the_tolerance_and_no_more(
    drawn: float, tolerance: float, accepted: bool
) -> None:
    """The program uses drills of 3 mm, whatever the drawing has; on a board, no difference is allowed."""
    text = program(request(PLAIN_HOLES, None), "linuxcnc", "mm")
    holes = tuple(replace(hole, diameter=drawn if hole.diameter == 3.0 else 5.0) for hole in PLAIN_HOLES.holes)
    asked = request(replace(PLAIN_HOLES, holes=holes), None, diameter_tolerance=tolerance)
    assert faults(asked, text) == ([] if accepted else ["wrong tool", "wrong tool"])
    board = replace(asked, part=replace(asked.part, format="excellon"))
    assert faults(board, text) == ([] if drawn == 3.0 else ["wrong tool", "wrong tool"])


def test_slots_and_holes_of_nearly_catalogue_sizes_pass_the_judge() -> None:
    holes = tuple(replace(hole, diameter=hole.diameter + 0.013 * k) for k, hole in enumerate(HOLES))
    part = replace(PART, holes=holes, slots=(replace(PART.slots[0], width=3.97),))
    for options in ({}, {"depth": 4.0, "thickness": None}, {"diameter_tolerance": 0.0}):
        asked = request(part, None, **options)
        for name, units in (("linuxcnc", "mm"), ("grbl", "inch"), ("siemens", "mm")):
            assert faults(asked, program(asked, name, units), name, units) == []


BY_HAND = """G21 G17 G90 G94
(T1 drill D3)
T1 M6
G43 H1 G0 Z10
S2000 M3
G99 G81 X0 Y20.5 Z{z3} R2 F100
X29.875 Y0
G80
(T2 drill D5)
T2 M6
G43 H2 G0 Z10
S2000 M3
X29.875 Y20.5
G1 Z{z5} F100
G0 Z10
M5
M2
"""


@pytest.mark.hazard
def test_a_program_written_by_hand_is_judged_by_the_drawing_and_the_options_alone() -> None:
    """Mirrored in y the centres are 3.25, −7.5; 33.125, −7.5 and 33.125, −28. Their corner 3.25, −28 becomes zero."""
    asked = request(PLAIN_HOLES, None, mirror="y", origin="lower-left", thickness=8.0)
    right = {"z3": f"{-8.5 - 3.0 * POINT:.3f}", "z5": f"{-8.5 - 5.0 * POINT:.3f}"}
    text = BY_HAND.format(**right)
    assert faults(asked, text) == []
    assert faults(asked, text.replace(right["z5"], f"{-8.5:.3f}")) == ["wrong depth"]
    assert faults(asked, text.replace("X29.875 Y0\n", "")) == ["missing hole"]
    assert faults(asked, text.replace("X29.875 Y0\n", "X29.875 Y0\nX29.875 Y0\n")) == ["hole twice"]
    assert faults(asked, text.replace("X29.875 Y0\n", "X29.89 Y0\n")) == ["missing hole", "hole not drawn"]
    assert faults(asked, text.replace("drill D5", "drill D5.5")) == ["wrong tool"]
    assert faults(asked, text.replace("(T2 drill D5)\n", "")) == ["wrong tool"]
    assert faults(asked, text.replace("T2 M6\nG43 H2", "T1 M6\nG43 H1")) == ["wrong tool"]
    assert faults(asked, text.replace("M5", "G3 I1 F100\nM5")) == ["not drilling"]


def test_work_of_unknown_depth_is_refused_in_one_line() -> None:
    asked = request(PLAIN_HOLES, None, thickness=8.0)
    text = program(asked, "linuxcnc", "mm")
    slotted = replace(asked.part, holes=(), slots=(Slot((0.0, 0.0), (9.0, 0.0), 3.0),))
    for part, what in ((asked.part, "the hole at X"), (slotted, "the slot from X")):
        (refusal,) = faults(replace(asked, part=part, job=replace(asked.job, thickness=None)), text)
        assert what in refusal
        assert refusal.endswith("is unknown; give --depth or --thickness")


# Mutants of the plan.

Mutant = Callable[[DrillPlan], DrillPlan]


def each(change: Callable[[Any], dict[str, Any]], only: int | None = None) -> Mutant:
    """Return a mutant with changed fields of all operations, or of one."""

    def mutated(plan: DrillPlan) -> DrillPlan:
        operations = tuple(
            replace(one, **change(one)) if only in (None, k) else one for k, one in enumerate(plan.operations)
        )
        return replace(plan, operations=operations)

    return mutated


def deeper(by: float, only: int | None = None) -> Mutant:
    return each(lambda one: {"cycle": replace(one.cycle, bottom=one.cycle.bottom - by)}, only)


def moved(change: Callable[[Hole], Hole], only: int | None = None) -> Mutant:
    def mutated(plan: DrillPlan) -> DrillPlan:
        holes = tuple(change(hole) if only in (None, k) else hole for k, hole in enumerate(plan.part.holes))
        return replace(plan, part=replace(plan.part, holes=holes))

    return mutated


def other_tools(plan: DrillPlan) -> DrillPlan:
    tools = [one.tool for one in plan.operations][::-1]
    return replace(
        plan, operations=tuple(replace(one, tool=tool) for one, tool in zip(plan.operations, tools, strict=True))
    )


PLAN_MUTANTS: dict[str, tuple[Mutant, str]] = {
    "all holes 0.01 mm deeper": (deeper(0.01), "wrong depth"),
    "all holes 0.01 mm less deep": (deeper(-0.01), "wrong depth"),
    "one tool 10 mm deeper": (deeper(10.0, 1), "wrong depth"),
    "tip instead of shoulder": (
        each(lambda one: {"cycle": replace(one.cycle, bottom=one.cycle.bottom + one.tool.point_length)}),
        "wrong depth",
    ),
    "no break-through": (deeper(-0.5), "wrong depth"),
    "one hole deeper": (lambda plan: replace(plan, deeper=np.array([0.0, 0.0, 0.5])), "wrong depth"),
    "one hole begins higher": (lambda plan: replace(plan, tops=np.array([1.0, 0.0, 0.0])), "wrong depth"),
    "a hole is missing": (each(lambda one: {"targets": one.targets[1:]}, 0), "missing hole"),
    "a tool is missing": (lambda plan: replace(plan, operations=plan.operations[1:]), "missing hole"),
    "a hole twice": (each(lambda one: {"targets": np.append(one.targets, one.targets[0])}, 0), "hole twice"),
    "a hole by a second tool, too": (each(lambda one: {"targets": np.append(one.targets, 0)}, 1), "hole twice"),
    "a tool twice": (lambda plan: replace(plan, operations=(*plan.operations, plan.operations[0])), "hole twice"),
    "tools exchanged": (other_tools, "wrong tool"),
    "one tool for all": (each(lambda one: {"tool": replace(one.tool, diameter=3.0, number=1)}), "wrong tool"),
    "a tool of another diameter": (each(lambda one: {"tool": replace(one.tool, diameter=5.1)}, 1), "wrong tool"),
    "a hole 0.01 mm beside": (moved(lambda hole: replace(hole, x=hole.x + 0.01), 0), "missing hole"),
    "all holes 0.01 mm beside": (moved(lambda hole: replace(hole, y=hole.y + 0.01)), "missing hole"),
    "another zero": (moved(lambda hole: replace(hole, x=hole.x + 12.0, y=hole.y + 22.0)), "missing hole"),
    "mirrored back": (moved(lambda hole: replace(hole, x=-hole.x)), "missing hole"),
    "turned": (moved(lambda hole: replace(hole, x=-hole.y, y=hole.x)), "missing hole"),
}


@pytest.mark.hazard
@pytest.mark.parametrize("mutant", PLAN_MUTANTS)
def test_a_plan_that_is_not_the_drawing_is_refused_before_a_program_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mutant: str
) -> None:
    change, what = PLAN_MUTANTS[mutant]
    drawing, output = tmp_path / "plate.csv", tmp_path / "plate.ngc"
    drawing.write_text("x,y,diameter\n0,0,3\n30,0,5\n30,20,3\n")
    options: dict[str, Any] = {
        "units": "mm", "thickness": "8", "mirror": "x", "origin": "-31,-3", "algorithm": "none", "bound": False,
    }  # fmt: skip
    assert leafcut.optimize(drawing, **options).verified
    right = spec.plan_drilling
    monkeypatch.setattr(spec, "plan_drilling", lambda *given, **more: change(right(*given, **more)))
    with pytest.raises(VerifyError, match=f"^the program was not written: {what}"):
        leafcut.optimize(drawing, output, **options)
    assert not output.exists()


# Mutants of the text.

_WORD = re.compile(r"[XYZT]-?[\d.]+")


def mutants(text: str) -> Iterator[tuple[str, str]]:
    """Yield (description, text) of every wrong hole, slot and tool.

    Blocks of holes and slots, and the last rapid before each, are left out; blocks of holes are repeated; each digit of
    X, Y and Z in them, and of each T, is changed.
    """
    lines = text.splitlines()
    relevant: dict[int, str] = {}
    mode, rapid = "", 0
    for k, line in enumerate(lines):
        found = re.search(r"\b(G0|G1|G80|G8[1-5])\b", line)
        mode = found.group(1) if found else mode
        if line.startswith("T"):
            relevant[k] = "tool"
        elif mode == "G0" and re.search("[XY]", line):
            rapid = k
        elif mode == "G1" and line[0] in "GXYZ":
            relevant[rapid] = relevant[k] = "cut"
        elif mode.startswith("G8") and mode != "G80":
            relevant[k] = "cut" if found else "hole"
    for k, what in sorted(relevant.items()):
        line = lines[k]
        if what != "tool":
            yield f"without '{line}'", "\n".join([*lines[:k], *lines[k + 1 :]]) + "\n"
        if what == "hole":
            yield f"'{line}' twice", "\n".join([*lines[:k], line, *lines[k:]]) + "\n"
        for word in _WORD.finditer(line):
            for place in range(word.start() + 1, word.end()):
                if line[place].isdigit():
                    changed = line[:place] + str((int(line[place]) + 1) % 10) + line[place + 1 :]
                    yield f"'{changed}' for '{line}'", "\n".join([*lines[:k], changed, *lines[k + 1 :]]) + "\n"


@pytest.mark.hazard
@pytest.mark.parametrize("name, units, least", [("linuxcnc", "mm", 60), ("haas", "inch", 100), ("grbl", "mm", 45)])
def test_the_judge_misses_no_mutant_of_a_text(name: str, units: str, least: int) -> None:
    """GRBL has no cycle for a tap: there all holes are drilled."""
    asked = request(PLAIN) if name == "grbl" else request()
    text = program(asked, name, units)
    every = list(mutants(text))
    assert len(every) > least
    assert [what for what, wrong in every if not faults(asked, wrong, name, units)] == []


@pytest.mark.hazard
def test_a_slot_is_cut_once_to_its_bottom_in_passes_that_its_mill_can_take() -> None:
    """A mill of 4 mm without a peck takes 4 mm at once: 8.5 mm in three passes."""
    asked = request(replace(PART, holes=()), None)
    text = program(asked, "grbl", "mm")
    assert faults(asked, text, "grbl") == []
    assert re.findall(r"Z-[\d.]+", text) == ["Z-2.833", "Z-5.667", "Z-8.5"]
    assert faults(asked, text.replace("Z-5.667\n", ""), "grbl") == ["deep pass"]
    assert faults(asked, text.replace("Z-8.5\n", "Z-8\n"), "grbl") == ["missing slot"]
    assert faults(asked, text.replace("Z-8.5\n", "Z-9\n"), "grbl")[0] == "cut not drawn"
    assert "cut not drawn" in faults(asked, text.replace("X18\n", "X19\n", 1), "grbl")


def test_a_difference_names_the_tool_and_a_line_only_where_the_program_has_one() -> None:
    asked = request(replace(PART, holes=()), None)
    text = program(asked, "grbl", "mm").replace("Z-5.667\n", "")
    words = load_dialect("grbl")
    (deep,) = judge_holes(asked, text, interpret_written_program(text, words), max_rounding_error(words, "mm"))
    assert deep.what == "deep pass" and text.split("\n")[deep.new - 2] == "Z-8.5"
    assert "the maximum step-down of slot-mill 4 is 4 mm" in str(deep)

    asked = request(PLAIN_HOLES, None, mirror="y", origin="lower-left", thickness=8.0)
    text = BY_HAND.format(z3=f"{-8.5 - 3.0 * POINT:.3f}", z5=f"{-8.5 - 5.0 * POINT:.3f}").replace("X29.875 Y0\n", "")
    words = load_dialect("linuxcnc")
    (missing,) = judge_holes(asked, text, interpret_written_program(text, words), max_rounding_error(words, "mm"))
    assert (missing.what, missing.original, missing.new) == ("missing hole", 0, 0)
    text = text.replace("X29.875 Y20.5", "X28 Y20.5")
    found = judge_holes(asked, text, interpret_written_program(text, words), max_rounding_error(words, "mm"))
    lines = text.split("\n")
    (line,) = [lines[one.new - 1] for one in found if one.what == "hole not drawn"]
    assert line.startswith("G1 Z-10.002"), "the plunge at X28"


@pytest.mark.parametrize(("mirror", "x"), [(None, 20), ("x", 10)])
def test_the_corner_of_an_outline_with_an_arc_is_that_of_its_box(mirror: str | None, x: int) -> None:
    """A square of 20 mm with a half circle on its left side extends from X−10 to X20; mirrored, from X−20 to X10."""
    outline = Polyline(np.array([(0, 0, 0), (20, 0, 0), (20, 20, 0), (0, 20, 1)], dtype=np.float64), True)
    drill = Tool(5, 5.0, ToolKind.DRILL, feed=2.0, spindle_rpm=900, point_angle=math.pi * 118 / 180)
    edge = Part("edge", (), contours=(Contour(outline),))
    part = Part("arc", (Hole(10.0, 5.0, 5.0),), reference=edge)
    given = {} if mirror is None else {"mirror": mirror}
    asked = request(part, ToolLibrary((drill,), (), "shop.toml"), thickness=8.0, origin="lower-left", **given)
    text = f"G21 G17 G90 G94 G99\nT5 M6\nG43 H5 G0 Z40\nS900 M3\nG81 X{x} Y5 Z-1 R2 F9\nM5\nM2\n"
    assert faults(asked, text) == ["wrong depth"]
    assert "missing hole" in faults(asked, text.replace(f"X{x}", f"X{x - 10}"))


def test_a_point_without_a_diameter_is_drilled_by_the_only_drill_of_the_library() -> None:
    drill = Tool(5, 5.0, ToolKind.DRILL, feed=2.0, spindle_rpm=900, point_angle=math.pi * 118 / 180)
    asked = request(Part("point", (Hole(7.0, 0.0, 0.0),)), ToolLibrary((drill,), (), "shop.toml"), thickness=8.0)
    text = "G21 G17 G90 G94 G99\nT{0} M6\nG43 H{0} G0 Z40\nS900 M3\nG81 X7 Y0 Z-1 R2 F9\nM5\nM2\n"
    assert faults(asked, text.format(5)) == ["wrong depth"]
    assert faults(asked, text.format(6)) == ["wrong tool"]


def judged(asked: DrillingRequest, drilled: list[tuple[float, float, float]]) -> list[str]:
    """Return the judge's errors for a hand-written program that drills at (x, y) to z."""
    blocks = "".join(f"G99 G81 X{x:g} Y{y:g} Z{z:.3f} R30 F100\n" for x, y, z in drilled)
    return faults(asked, f"G21 G17 G90 G94\n(T1 drill D5)\nT1 M6\nG43 H1 G0 Z40\nS900 M3\n{blocks}M5\nM2\n")


@pytest.mark.hazard
def test_on_a_surface_each_hole_begins_on_its_step_and_ends_below_the_part() -> None:
    """Steps at Z0 and Z−6 over an underside at Z−20, moved by 30 mm with the drawing; a point of 1.502 mm."""
    boxes = (box_triangles(0, 0, -20, 40, 40, 0), box_triangles(40, 0, -20, 80, 40, -6))
    part = Part("steps", (Hole(20.0, 20.0, 5.0), Hole(60.0, 20.0, 5.0)))
    asked = request(part, None, thickness=None, depth="through", origin=(30.0, 0.0))
    asked = replace(asked, surface=Mesh(np.concatenate(boxes), "steps"))
    through = -20.5 - 5.0 * POINT
    assert judged(asked, [(-10, 20, through), (30, 20, through)]) == []
    assert judged(asked, [(-10, 20, through), (30, 20, through - 0.01)]) == ["wrong depth"]
    blind = replace(asked, **dict(zip(("job", "options"), drilling(depth=4.0), strict=True)))
    right = [(-10.0, 20.0, -4.0 - 5.0 * POINT), (30.0, 20.0, -10.0 - 5.0 * POINT)]
    assert judged(blind, right) == []
    assert judged(blind, [right[0], (30.0, 20.0, right[0][2])]) == ["wrong depth"]


@pytest.mark.hazard
def test_a_hole_of_a_solid_is_as_deep_as_in_the_solid() -> None:
    """Through: 0.5 mm and the point below it. Blind: the full diameter to its depth; to a flat floor, the tip."""
    part = Part(
        "solid",
        (
            Hole(0.0, 0.0, 5.0, z=2.0, depth=12.0, through=True),
            Hole(20.0, 0.0, 5.0, z=0.0, depth=6.0),
            Hole(40.0, 0.0, 5.0, z=-1.0, depth=6.0, flat=True),
        ),
    )
    asked = request(part, None, thickness=None)
    right = [(0.0, 0.0, -10.5 - 5.0 * POINT), (20.0, 0.0, -6.0 - 5.0 * POINT), (40.0, 0.0, -7.0)]
    assert judged(asked, right) == []
    for k, (x, y, z) in enumerate(right):
        for wrong in (z - 0.01, z + 0.01, z + 0.5):
            assert judged(asked, [*right[:k], (x, y, wrong), *right[k + 1 :]]) == ["wrong depth"]


@pytest.mark.hazard
def test_wide_parts_of_holes_are_made_where_a_tool_of_the_library_fits() -> None:
    """A counterbore of 10 mm, 6 mm deep, by the end mill; a countersink of 90° by a cone with a flat tip of 1 mm."""
    bore = HoleStep(10.0, 6.0, math.pi, tip=6.0, narrow=5.0, open=True)
    sink = HoleStep(10.0, 2.5, 0.5 * math.pi, tip=5.0, narrow=5.0, open=True)
    part = Part(
        "wide",
        tuple(
            Hole(x, 0.0, 5.0, depth=9.0, through=True, steps=steps)
            for x, steps in ((0.0, (bore,)), (20.0, (sink,)), (40.0, (replace(sink, open=False),)))
        ),
    )
    mill = Tool(7, 10.0, ToolKind.END_MILL, feed=2.0, spindle_rpm=900, point_angle=math.pi)
    cone = Tool(8, 12.0, ToolKind.CHAMFER_MILL, feed=2.0, spindle_rpm=900, point_angle=0.5 * math.pi, tip_diameter=1.0)
    asked = request(part, ToolLibrary((*LIBRARY.tools, mill, cone), (), "shop.toml"), thickness=None)
    lines = "T5 M6\nG43 H5 G0 Z40\nS900 M3\n" + "".join(f"G81 X{x} Y0 Z-11.002 R2 F9\n" for x in (0, 20, 40))
    lines += "G80\nT7 M6\nG43 H7 G0 Z40\nS900 M3\nG81 X0 Y0 Z-6 R2 F9\n"
    lines += "G80\nT8 M6\nG43 H8 G0 Z40\nS900 M3\nG81 X20 Y0 Z-4.5 R2 F9\nM5\nM2\n"
    text = "G21 G17 G90 G94 G99\n" + lines
    assert faults(asked, text) == []
    assert faults(asked, text.replace("Z-6 ", "Z-6.5 ")) == ["wrong depth"]
    assert faults(asked, text.replace("Z-4.5 ", "Z-5 ")) == ["wrong depth"]
    assert faults(asked, text.replace("G81 X0 Y0 Z-6 R2 F9\n", "")) == ["missing hole"]
    assert faults(asked, text.replace("X20 Y0 Z-4.5", "X40 Y0 Z-4.5")) == ["missing hole", "hole twice"]
    for diameter, fits in ((10.0, True), (9.9, False)):
        tools = (*LIBRARY.tools, mill, replace(cone, diameter=diameter))
        asked = request(part, ToolLibrary(tools, (), "shop.toml"), thickness=None)
        assert (faults(asked, text) == []) is fits


@pytest.mark.hazard
def test_tools_of_a_recipe_come_in_its_order() -> None:
    asked = request(replace(PLAIN_HOLES, holes=HOLES[3:]))
    right = program(asked, "linuxcnc", "mm")
    first, second = right.index("(T1 "), right.index("(T5 ")
    third = right.index("(T6 ")
    swapped = right[:first] + right[second:third] + right[first:second] + right[third:]
    assert faults(asked, right) == []
    assert faults(asked, swapped) == ["wrong order"]


def test_layers_choose_recipes_and_a_tool_of_the_same_diameter_is_not_enough() -> None:
    """A hole of 6 mm on the layer TAPPED needs tools 1, 5 and 6; on another layer the library has none for it."""
    plain = request(Part("plain", (replace(HOLES[3], layer="0"),)))
    tapped = request(Part("tapped", HOLES[3:]))
    assert set(faults(plain, program(tapped, "linuxcnc", "mm"))) == {"wrong tool", "hole twice"}
