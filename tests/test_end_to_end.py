"""Whole drilling runs: independent readers find each hole of the drawing once in the program."""

from __future__ import annotations

import re
from pathlib import Path

import ezdxf
import numpy as np
import pytest

import leafcut
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.cycles import expand_cycles
from leafcut.model.kinds import Head
from leafcut.model.toolpath import Kind
from leafcut.options import SolveOptions
from leafcut.read.machine import load_machine, machine_names
from rs274_moves import moves_of_rs274, moves_of_toolpath, run_rs274

BOARDS = ["custom_pads_test", "test_pads_inside_pads", "ecc83-pp", "sonde_xilinx", "StickHub", "complex_hierarchy",
          "pic_programmer", "flat_hierarchy", "carte_test", "kit-dev-coldfire-xilinx_5213"]  # fmt: skip
DRILLING = [name for name in machine_names() if load_machine(name).head is Head.SPINDLE]
DRAWINGS = ["deepnestport_6", "deepnestport_10", "dxfjs_array-rotated",
            "dxfjs_arrayed-holes", "dxfjs_blocks1", "dxfjs_issue42", "ezdxf_forms"]  # fmt: skip
PLATES = ["plate_10", "plate_27", "plate_45", "plate_65", "plate_70", "plate_8x8_10", "plate_8x8_21",
          "plate_15x15_35", "plate_15x15_70", "board_97", "board_121",
          pytest.param("board_200", marks=pytest.mark.slow)]  # fmt: skip


def drilled(text: str, dialect_name: str) -> np.ndarray:
    """Return the drilled places of a program, sorted, float64[n, 2]."""
    path = interpret_own_program(text, load_dialect(dialect_name))
    places = [m.end[:2] for m in path if m.kind is Kind.DRILL]
    return np.array(sorted((round(x, 3), round(y, 3)) for x, y in places)).reshape(-1, 2)


def circles(drawing: Path) -> np.ndarray:
    """Return the centres of the circles of one of leafcut's drawings, in mm, sorted, read by ezdxf alone."""
    found = [e.dxf.center * 25.4 for e in ezdxf.readfile(drawing).modelspace().query("CIRCLE")]
    return np.array(sorted((round(c.x, 3), round(c.y, 3)) for c in found))


@pytest.mark.parametrize("name", PLATES)
def test_every_circle_of_our_plates_is_drilled_once(name: str, examples: Path) -> None:
    drawing = examples / f"{name}.dxf"
    outcome = leafcut.optimize(drawing, thickness="0.25in", preset="fast")
    assert len(outcome.part.holes) == int(name.rsplit("_", 1)[1])
    assert np.allclose(drilled(outcome.text, outcome.dialect), circles(drawing), atol=0.0011)
    assert outcome.after.time_s < outcome.nearest.time_s <= outcome.before.time_s


def excellon_holes(board: Path) -> list[tuple[float, float]]:
    """Return the holes of a KiCad drill file by a few lines of our own: every XY line that is no route."""
    text = re.sub(r"^G00.*?^G05", "", board.read_text(), flags=re.MULTILINE | re.DOTALL)
    return sorted((float(x), float(y)) for x, y in re.findall(r"^X([-\d.]+)Y([-\d.]+)$", text, flags=re.MULTILINE))


@pytest.mark.parametrize("name", BOARDS)
def test_every_hole_of_a_real_board_is_drilled_once(name: str, data: Path) -> None:
    """Each board on another machine."""
    board = data / "boards" / f"{name}.drl"
    holes = np.array(excellon_holes(board))
    machine = DRILLING[BOARDS.index(name) % len(DRILLING)]
    rpm = load_machine(machine).spindle_max_rpm  # the assumed speed of some drills is out of range
    outcome = leafcut.optimize(board, machine=machine, thickness="1.6mm", algorithm="2opt", spindle_speed=rpm)
    assert outcome.verified
    assert sum(len(o.hole_order) for o in outcome.operations if not o.slots) == len(holes)
    if load_dialect(outcome.dialect).cycles:
        assert np.allclose(drilled(outcome.text, outcome.dialect), holes.round(3), atol=0.0006)
    assert outcome.after.time_s <= outcome.before.time_s + 1e-9


@pytest.mark.parametrize("name", [*BOARDS, *DRAWINGS])
def test_linuxcnc_accepts_the_program_and_makes_the_same_moves(
    name: str, data: Path, rs274: str, tmp_path: Path
) -> None:
    source = data / "boards" / f"{name}.drl" if name in BOARDS else data / "dxf" / f"{name}.dxf"
    rpm = load_machine("linuxcnc-mill").spindle_max_rpm  # the assumed speed of some drills is out of range
    outcome = leafcut.optimize(source, machine="linuxcnc-mill", thickness="1.6mm", algorithm="2opt", spindle_speed=rpm)
    status, output = run_rs274(rs274, outcome.text, tmp_path)
    assert status == 0, output
    theirs, ours = moves_of_rs274(output), moves_of_toolpath(outcome.path_after)
    plunges = [[m[1:3] for m in moves if m[0] == "feed" and m[3] < 0] for moves in (ours, theirs)]
    # 2.1 mm deep: three passes, both with the 1.5 mm slot mill of one board and with the 1.016 mm mill of the other.
    assert len(plunges[0]) == len(outcome.part.holes) + 6 * len(outcome.part.slots)
    assert np.allclose(plunges[0], plunges[1], atol=0.00061)


def test_inch_and_millimetre_drawings_of_a_part_give_the_same_tour(tmp_path: Path) -> None:
    inches = np.random.default_rng(4).uniform(0, 12, (60, 2)).round(3)
    texts = []
    for units, scale in ((1, 1.0), (4, 25.4)):
        document = ezdxf.new("R2010", units=units)
        for x, y in inches:
            document.modelspace().add_circle((x * scale, y * scale), 0.125 * scale)
        document.saveas(tmp_path / f"{units}" / "part.dxf") if (tmp_path / f"{units}").mkdir() is None else None
        texts.append(leafcut.optimize(tmp_path / f"{units}" / "part.dxf", thickness=6, preset="fast").text)
    assert texts[0] == texts[1]


@pytest.mark.parametrize("algorithm", ["mmas", "acs"])
def test_the_same_seed_gives_the_same_bytes_on_one_thread_and_on_two(algorithm: str, examples: Path) -> None:
    board = examples / "board_97.dxf"
    options = {"thickness": 2, "algorithm": algorithm, "preset": "fast", "seed": 5}
    texts = {leafcut.optimize(board, threads=t, **options).text for t in (1, 2)}
    assert len(texts) == 1


def test_a_program_in_inches_drills_the_same_holes(examples: Path) -> None:
    for machine in ("linuxcnc-mill", "haas-vf2", "mach3-router", "fagor-8055"):
        outcome = leafcut.optimize(
            examples / "plate_27.dxf",
            machine=machine,
            thickness="0.25in",
            output_units="inch",
            preset="fast",
            spindle_speed=6000,
        )
        assert np.allclose(drilled(outcome.text, outcome.dialect), circles(examples / "plate_27.dxf"), atol=0.0026)


def test_precedence_holds_in_the_program(examples: Path, tmp_path: Path) -> None:
    """A tapped hole is centred, drilled and tapped in this order, at the same place, with the sample library."""
    document = ezdxf.new("R2010", units=4)
    document.layers.add("TAP_M8")
    for x in (10, 40, 70):
        document.modelspace().add_circle((x, 5), 4.0, dxfattribs={"layer": "TAP_M8"})
    document.saveas(tmp_path / "tapped.dxf")
    outcome = leafcut.optimize(tmp_path / "tapped.dxf", tools=examples / "tools.toml", thickness=8, preset="fast")
    kinds = [o.tool.kind.value for o in outcome.operations]
    assert kinds == ["centre-drill", "drill", "tap"]
    assert all(sorted(o.hole_order) == [0, 1, 2] for o in outcome.operations)


@pytest.mark.slow
def test_twenty_thousand_circles_become_a_program(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).uniform(0, 150, (20_000, 2)).round(3)
    circle = "0\nCIRCLE\n8\n0\n10\n{}\n20\n{}\n30\n0.0\n40\n0.2\n"
    text = "".join(circle.format(x, y) for x, y in rows.tolist())
    head = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n"
    drawing = tmp_path / "many.dxf"
    drawing.write_text(f"{head}0\nSECTION\n2\nENTITIES\n{text}0\nENDSEC\n0\nEOF\n")
    outcome = leafcut.optimize(
        drawing, machine="pcb-drill", depth=1, depth_to="tip", objective="distance", preset="fast", bound=False
    )
    distinct = len({(x, y) for x, y in rows.tolist()})
    assert 0.99 * distinct <= len(drilled(outcome.text, outcome.dialect)) <= distinct
    # The shortest tour of many random points is 0.7124 √(nA) long (Johnson and McGeoch 1996).
    shortest = 0.7124 * (len(outcome.part.holes) * 150.0**2) ** 0.5
    assert shortest * 0.99 < outcome.operations[0].solution.cost < shortest * 1.08


#: Options of a drilling run that change the words of the program.
DRILLING_OPTIONS: list[dict[str, object]] = [
    {"peck": "2mm"},
    {"cycle": "G73", "peck": "3mm", "retract": "initial"},
    {"dwell": "0.5s", "coolant": True, "line_numbers": True},
    {"cycle": "G85"},
    {"peck": "2mm", "output_units": "inch", "keep_out": ("20 20 60 60",)},
    {"retract": "initial", "output_units": "inch", "end_point": "free"},
    {"end_point": "-20,-20", "start_point": "free", "objective": "distance", "header": False},
]


@pytest.mark.parametrize(
    ("machine", "options"),
    [  # fast: every machine and every option in a third of their combinations
        pytest.param(machine, options, marks=[pytest.mark.slow] * ((row + column) % 3 > 0))
        for row, machine in enumerate(DRILLING)
        for column, options in enumerate(DRILLING_OPTIONS)
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_each_drilling_option_gives_a_verified_program_on_every_machine(
    machine: str, options: dict[str, object], tmp_path: Path
) -> None:
    unknown = {
        "marlin-mpcnc": {"line_numbers", "output_units"},
        "heidenhain-tnc": {"output_units"},
        "duet-router": {"line_numbers"},
    }
    drawing = _two_sizes(tmp_path)
    if options.keys() & unknown.get(machine, set()):
        with pytest.raises(leafcut.LeafcutError, match=r"^--(line-numbers|output-units inch): .*; leave it out$"):
            leafcut.optimize(drawing, machine=machine, thickness=6, algorithm="2opt", **options)
        return
    rpm = load_machine(machine).spindle_max_rpm  # routers turn too fast for the assumed speed
    outcome = leafcut.optimize(drawing, machine=machine, thickness=6, algorithm="2opt", spindle_speed=rpm, **options)
    assert outcome.verified
    plunges = [
        m.end
        for m in expand_cycles(interpret_own_program(outcome.text, load_dialect(outcome.dialect)))
        if m.kind is Kind.FEED
    ]
    places = {(round(x, 1), round(y, 1)) for x, y, _ in plunges}
    assert places == set(PLACES)
    # 6 mm of plate, 0.5 mm below it, and the point of the larger drill: 3 / tan 59°.
    assert min(z for _, _, z in plunges) == pytest.approx(-6.5 - 3 / np.tan(np.radians(59)), abs=0.002)


#: Centres of the holes of `_two_sizes`, mm.
PLACES = [(0, 0), (80, 0), (80, 80), (0, 80), (40, 5), (75, 40), (40, 75), (5, 40)]


def _two_sizes(folder: Path, **layers: str) -> Path:
    """Write a drawing of holes of 4 and 6 mm around a free middle, with circles of 8 mm around the holes of 4 mm."""
    document = ezdxf.new("R2010", units=4)
    for number, (x, y) in enumerate(PLACES):
        diameter = 4 if number % 2 else 6
        layer = layers.get(f"d{diameter}", "0")
        document.modelspace().add_circle((x, y), diameter / 2, dxfattribs={"layer": layer})
        if diameter == 4:
            document.modelspace().add_circle((x, y), 4, dxfattribs={"layer": "RINGS"})
    document.saveas(folder / "two.dxf")
    return folder / "two.dxf"


@pytest.mark.parametrize(
    ("options", "diameters"),
    [
        ({}, {4.0, 6.0}),
        ({"concentric": "largest"}, {6.0, 8.0}),
        ({"concentric": "all"}, {4.0, 6.0, 8.0}),
        ({"layers": "SM*"}, {4.0}),
        ({"layers": "rings,0"}, {6.0, 8.0}),
        ({"min_diameter": 5}, {6.0, 8.0}),
        ({"max_diameter": 5}, {4.0}),
    ],
)
def test_circles_are_chosen_by_centre_layer_and_diameter(
    options: dict[str, object], diameters: set[float], tmp_path: Path
) -> None:
    outcome = leafcut.optimize(_two_sizes(tmp_path, d4="SMALL"), depth=1, algorithm="nn", **options)
    assert {o.tool.diameter for o in outcome.operations} == diameters
    assert all(len(o.hole_order) == 4 for o in outcome.operations)


def test_no_rapid_crosses_a_clamp_low_between_operations_or_to_the_end(tmp_path: Path) -> None:
    """Every move that the interpreter finds over the clamp, the tool's 3 mm included, is at 10 mm or machine height."""
    options = {"keep_out": "20 20 60 60", "end_point": "40,100", "thickness": 6, "preset": "fast"}
    for machine in ("linuxcnc-mill", "linuxcnc-sim", "grbl-3018", "haas-vf2"):
        outcome = leafcut.optimize(_two_sizes(tmp_path), machine=machine, **options)
        path = expand_cycles(interpret_own_program(outcome.text, load_dialect(outcome.dialect)))
        x, y, z = 0.0, 0.0, np.inf
        for motion in path:
            if motion.kind is Kind.MACHINE:
                z = np.inf
            if motion.kind > Kind.FEED:
                continue
            end = [b if np.isnan(a) else a for a, b in zip(motion.end, (x, y, z), strict=True)]
            for part in np.linspace(0, 1, 201):
                place = x + part * (end[0] - x), y + part * (end[1] - y)
                if all(17.1 < v < 62.9 for v in place):
                    assert min(z, end[2]) >= 10.0, (machine, motion)
            x, y, z = end


def test_a_part_that_does_not_lie_in_the_travel_at_its_work_offset_is_refused(examples: Path) -> None:
    """The VF-2 goes from −762 to 0 in x: a plate of 254 mm with its zero at x −200 does not fit, at −400 it does."""
    options = {"machine": "haas-vf2", "thickness": "0.25in", "algorithm": "nn"}
    with pytest.raises(leafcut.LeafcutError, match="outside the machine's travel"):
        leafcut.optimize(examples / "plate_10.dxf", work_offset="-200,-350,-300", **options)
    placed = leafcut.optimize(examples / "plate_10.dxf", work_offset="-400,-350,-300", **options)
    assert "L403" not in [i.code for i in placed.issues]
    assert "L403" in [i.code for i in leafcut.optimize(examples / "plate_10.dxf", **options).issues]


def test_the_time_limit_is_one_for_the_searches_of_all_tools_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from leafcut.order import solve as room

    limits: list[float] = []
    inner = room.solve

    def spy(problem: object, options: SolveOptions, *rest: object, **words: object) -> object:
        if options.time_limit is not None:
            limits.append(options.time_limit)
        return inner(problem, options, *rest, **words)  # type: ignore[arg-type]

    monkeypatch.setattr(room, "solve", spy)
    leafcut.optimize(_two_sizes(tmp_path), depth=1, concentric="all", time_limit="900ms", iterations=1)
    assert len(limits) == 3
    left = 0.9 * 0.9  # a tenth is kept for lower bounds
    assert sum(limits[:2]) < left
    assert all(limit <= left for limit in limits)


def test_a_machine_profile_is_never_overwritten(examples: Path, tmp_path: Path) -> None:
    from importlib.resources import files

    profile = tmp_path / "mine.toml"
    profile.write_text((files("leafcut.machines") / "haas-vf2.toml").read_text())
    with pytest.raises(leafcut.LeafcutError, match="is an input"):
        leafcut.optimize(examples / "plate_10.dxf", profile, machine=str(profile), depth=1)


def test_a_program_of_ours_has_no_fault_for_simulate_whatever_the_safe_height(examples: Path, tmp_path: Path) -> None:
    from importlib.resources import files

    profile, program = tmp_path / "mine.toml", tmp_path / "p.nc"
    text = (files("leafcut.machines") / "haas-vf2.toml").read_text()
    profile.write_text(text.replace('safe_z = "0 mm"', 'safe_z = "-25 mm"'))
    leafcut.optimize(examples / "plate_10.dxf", program, machine=str(profile), depth=1, algorithm="nn")
    assert "G53 G0 Z-25." in program.read_text()
    assert leafcut.simulate(program, machine=str(profile)).issues == ()
