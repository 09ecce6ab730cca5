"""Drawing in, program out: what comes out drills every hole of the drawing once, by judges that are not ours."""

from __future__ import annotations

import re
from pathlib import Path

import ezdxf
import numpy as np
import pytest

import leafcut
from leafcut.gcode.dialects import dialect
from leafcut.gcode.interpreter import interpret
from leafcut.model import Kind
from leafcut.read.machine import machine_names
from rs274_moves import moves_of_rs274, moves_of_toolpath, run_rs274

BOARDS = ["custom_pads_test", "test_pads_inside_pads", "ecc83-pp", "sonde_xilinx", "StickHub", "complex_hierarchy",
          "pic_programmer", "flat_hierarchy", "carte_test", "kit-dev-coldfire-xilinx_5213"]  # fmt: skip
DRAWINGS = ["camotics_buildbotics_logo", "deepnestport_6", "deepnestport_10", "dxfjs_array-rotated",
            "dxfjs_arrayed-holes", "dxfjs_blocks1", "dxfjs_issue42", "ezdxf_forms"]  # fmt: skip
PLATES = ["plate_10", "plate_27", "plate_45", "plate_65", "plate_70", "plate_8x8_10", "plate_8x8_21",
          "plate_15x15_35", "plate_15x15_70", "board_97", "board_121", "board_200"]  # fmt: skip


def drilled(text: str, dialect_name: str) -> np.ndarray:
    """Return where a program drills, sorted, float64[n, 2]: the lowest point of every plunge that is no slot."""
    path = interpret(text, dialect(dialect_name))
    places = [m.end[:2] for m in path if m.kind is Kind.DRILL]
    return np.array(sorted((round(x, 3), round(y, 3)) for x, y in places)).reshape(-1, 2)


def circles(drawing: Path) -> np.ndarray:
    """Return the centres of the circles of one of our own drawings, in mm, sorted, read by ezdxf alone."""
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
def test_every_hole_of_real_boards_is_drilled_once_on_every_machine(name: str, data: Path) -> None:
    board = data / "boards" / f"{name}.drl"
    holes = np.array(excellon_holes(board))
    for machine in machine_names():
        outcome = leafcut.optimize(board, machine=machine, thickness="1.6mm", algorithm="2opt")
        assert outcome.verified
        assert sum(len(o.hole_order) for o in outcome.operations if not o.slots) == len(holes)
        if dialect(outcome.dialect).cycles:
            assert np.allclose(drilled(outcome.text, outcome.dialect), holes.round(3), atol=0.0006)
        assert outcome.after.time_s <= outcome.before.time_s + 1e-9


@pytest.mark.external
@pytest.mark.parametrize("name", [*BOARDS, *DRAWINGS])
def test_linuxcnc_accepts_the_program_and_makes_the_same_moves(
    name: str, data: Path, rs274: str, tmp_path: Path
) -> None:
    source = data / "boards" / f"{name}.drl" if name in BOARDS else data / "dxf" / f"{name}.dxf"
    outcome = leafcut.optimize(source, machine="linuxcnc-mill", thickness="1.6mm", algorithm="2opt")
    status, output = run_rs274(rs274, outcome.text, tmp_path)
    assert status == 0, output
    theirs, ours = moves_of_rs274(output), moves_of_toolpath(outcome.path_after)
    plunges = [[m[1:3] for m in moves if m[0] == "feed" and m[3] < 0] for moves in (ours, theirs)]
    assert len(plunges[0]) == len(outcome.part.holes) + 2 * len(outcome.part.slots)
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
    texts = {leafcut.optimize(board, threads=t, **options).text for t in (1, 2, 2)}
    assert len(texts) == 1


def test_a_program_in_inches_drills_the_same_holes(examples: Path) -> None:
    for machine in ("linuxcnc-mill", "haas-vf2", "mach3-router", "fagor-8055"):
        outcome = leafcut.optimize(
            examples / "plate_27.dxf", machine=machine, thickness="0.25in", output_units="inch", preset="fast"
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


def test_a_hundred_thousand_circles_become_a_program(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).uniform(0, 300, (100_000, 2)).round(3)
    circle = "0\nCIRCLE\n8\n0\n10\n{}\n20\n{}\n30\n0.0\n40\n0.2\n"
    text = "".join(circle.format(x, y) for x, y in rows.tolist())
    head = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n"
    drawing = tmp_path / "many.dxf"
    drawing.write_text(f"{head}0\nSECTION\n2\nENTITIES\n{text}0\nENDSEC\n0\nEOF\n")
    outcome = leafcut.optimize(drawing, machine="pcb-drill", objective="distance")
    distinct = len({(x, y) for x, y in rows.tolist()})
    assert 0.99 * distinct <= len(drilled(outcome.text, outcome.dialect)) <= distinct
    # The shortest tour of many random points is 0.7124 √(nA) long (Johnson and McGeoch 1996).
    shortest = 0.7124 * (len(outcome.part.holes) * 300.0**2) ** 0.5
    assert shortest * 0.99 < outcome.operations[0].solution.cost < shortest * 1.08
