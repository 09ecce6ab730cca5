"""`reorder --low-retracts --air`: moves over named obstacles, cycles that stay at their R plane, arcs in the air."""

from __future__ import annotations

import math
import random
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.cycles import expand_cycles
from leafcut.model.outcome import Outcome
from leafcut.model.toolpath import Kind, Toolpath, arc_radius_start_sweep
from leafcut.processes.program import pace
from leafcut.processes.program.plan import heights
from pace_programs import BLOCK, HEAD, TAIL, body, reordered
from rs274_moves import assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274
from stepped_stock import SteppedStock

#: Over x 30 to 40 at y 5 to 15 stands a clamp, and rapids pass it at 12 or above.
CLAMP = {"keep_out": "30 5 40 15", "clearance_height": 12}


def told(outcome: Outcome) -> list[str]:
    """Return the messages about speeds and heights that stay."""
    return [str(issue) for issue in outcome.issues if issue.code == "L513"]


def test_a_way_over_a_named_clamp_keeps_its_height_and_the_others_do_not(tmp_path: Path) -> None:
    text = HEAD + ("G0 X10 Y10 Z15\nG1 Z-2 F60\nG0 Z15\nG0 X60\nG0 Z2\nG1 Z-2 F60\nG0 Z15\nG0 Y40\nG0 Z2\nG1 Z-2 F60\n")
    found = reordered(tmp_path, text + TAIL, low_retracts=True, workpiece=BLOCK, **CLAMP)
    changed = [
        (k, b) for k, (a, b) in enumerate(zip(text.splitlines(), found.text.splitlines(), strict=False)) if a != b
    ]
    assert changed == [(10, "G0 Z2.0")]
    assert told(found) == ["L513 a rapid over a --keep-out zone keeps its height (line 8)"]


def moves_of_cut(path: Toolpath, row: int) -> list[np.ndarray]:
    """Return places along a straight cut or an arc in the plane."""
    begin, end = path.before[row], path.end[row]
    if path.kind[row] == Kind.FEED:
        return [begin, end]
    radius, start, sweep = arc_radius_start_sweep(path, row)
    centre = path.arcs[int(path.ref[row])].center
    angles = start + sweep * np.linspace(0.0, 1.0, 60)
    heights = np.linspace(begin[2], end[2], 60)
    return list(np.column_stack([centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles), heights]))


def check_ways(path: Toolpath) -> None:
    """Check that no rapid across comes nearer than the clearance to a block that is cut place by place."""
    stock = SteppedStock((0, 0, -10), (70, 50, 0))
    moves = expand_cycles(path)
    for row in np.flatnonzero((moves.kind >= Kind.RAPID) & (moves.kind <= Kind.ARC_CCW)).tolist():
        begin, end = moves.before[row], moves.end[row]
        if not np.isfinite([begin, end]).all():
            continue
        if moves.kind[row] != Kind.RAPID:
            for a, b in pairwise(moves_of_cut(moves, row)):
                stock.cut(a, b, 3.0)
        elif np.abs(end - begin)[:2].max() > 0:
            assert stock.highest(begin, end, 3.0 + 1.0 - 0.18) <= -1.0 + 0.03, f"{begin} to {end}"


#: Holes at Y10, to both sides of the clamp, and at Y40, far from it.
HOLES = HEAD + "G0 X10 Y10\nG0 Z15\nG98 G81 X10 Y10 R2 Z-3 F100\nX20\nX60\nY40\nX40\nX20\nG80\n" + TAIL


def test_the_holes_of_a_series_are_reached_at_the_r_plane_where_nothing_stands_between(
    tmp_path: Path, rs274: str
) -> None:
    """The last hole rises to the initial height as before; LinuxCNC makes the same moves."""
    found = reordered(tmp_path, HOLES, low_retracts=True, workpiece=BLOCK)
    assert body(found) == [
        "G0 X10 Y10",
        "G0 Z15",
        "G99 G81 X10 Y10 R1.0 Z-3 F100",
        "X20",
        "X60",
        "Y40",
        "X40",
        "G98 X20",
        "G80",
    ]
    assert found.detail.pace.lowered == 6
    assert found.detail.pace.retracts_s == pytest.approx(found.before.time_s - found.after.time_s, rel=1e-4)
    path = interpret_program(found.text, load_dialect("linuxcnc")).path
    assert path.end[path.kind == Kind.DRILL, 2].tolist() == [1, 1, 1, 1, 1, 15]
    status, said = run_rs274(rs274, found.text, tmp_path)
    assert status == 0
    assert_same_moves(moves_of_toolpath(path), moves_of_rs274(said), 1e-4)


def test_a_series_rises_over_a_named_clamp_and_that_is_told(tmp_path: Path, rs274: str) -> None:
    found = reordered(tmp_path, HOLES, low_retracts=True, workpiece=BLOCK, **CLAMP)
    path = interpret_program(found.text, load_dialect("linuxcnc")).path
    assert path.end[path.kind == Kind.DRILL, 2].tolist() == [1, 15, 1, 1, 1, 15]
    assert told(found) == ["L513 a rapid over a --keep-out zone keeps its height (line 9)"]
    status, said = run_rs274(rs274, found.text, tmp_path)
    assert status == 0
    assert_same_moves(moves_of_toolpath(path), moves_of_rs274(said), 1e-4)


def test_a_series_rises_over_what_stands_between_two_holes(tmp_path: Path) -> None:
    """Two slots, 5 deep, with the block's top between them: R is below it."""
    slots = "".join(f"G0 X{x} Y5\nG0 Z2\nG1 Z-5 F60\nG1 Y45 F600\nG1 X{x + 5}\nG1 Y5\nG0 Z15\n" for x in (10, 40))
    series = "G98 G81 X12.5 Y20 R-3 Z-8 F100\nY30\nX42.5\nY20\nG80\n"
    found = reordered(tmp_path, HEAD + slots + series + TAIL, low_retracts=True, workpiece=BLOCK)
    path = interpret_program(found.text, load_dialect("linuxcnc")).path
    heights = path.end[path.kind == Kind.DRILL, 2].tolist()
    assert heights == [-4.0, 15.0, -4.0, 15.0]
    check_ways(path)


@pytest.mark.parametrize(
    "series",
    [
        "G98 G84 X10 Y10 R5 Z-3 F100\nX20\nX30\n",  # a tap's R plane has to do with its pitch
        "G98 G81 X10 Y10 R5 Z-3 F100\nG91 X10 Z-3 R-10\nG90\n",
        "G98 G81 X10 Y10 R14.9 Z-3 F100\nX20\n",  # hardly lower
    ],
)
def test_a_series_stays_as_it_is_where_its_words_or_its_cycle_forbid_it(tmp_path: Path, series: str) -> None:
    text = HEAD + "G0 X10 Y10\nG0 Z15\n" + series + "G80\n" + TAIL
    assert "G99" not in reordered(tmp_path, text, low_retracts=True, workpiece=BLOCK).text


def test_an_arc_in_the_air_goes_as_fast_as_the_machine_cuts(tmp_path: Path) -> None:
    """Around the block's corner, which the chord would cut; the arc into the material keeps its feed."""
    text = HEAD + "G0 X60 Y-10 Z5\nG0 Z-2\nG3 X80 Y10 I0 J20 F100\nG3 X70 Y20 I-10 J0\nG1 X60\n" + TAIL
    found = reordered(tmp_path, text, air=True, workpiece=BLOCK)
    path = interpret_program(found.text, load_dialect("linuxcnc")).path
    arcs = path.value[path.kind == Kind.ARC_CCW]
    assert arcs.tolist() == [pytest.approx(found.machine.max_feed), pytest.approx(100 / 60)]
    assert found.detail.pace.air_s == pytest.approx(10 * math.pi / (100 / 60), rel=0.1)
    freely = reordered(tmp_path, text.replace("G64 P0.02", "G64"), air=True, workpiece=BLOCK)
    assert "G3 X80 Y10 I0 J20 F100" in body(freely)


def random_series(chance: random.Random) -> str:
    """Return slots, series of holes at their bottoms and on the top, by several cycles, and arcs in and over them."""
    lines, deep = [], []
    for x in (12, 35, 58):
        if chance.random() < 0.6:
            z = -chance.choice([3, 5, 6])
            lines += [f"G0 X{x} Y8", "G0 Z2", f"G1 Z{z} F60", "G1 Y42 F600", f"G1 X{x + 5}", "Y8", "G0 Z15"]
            deep.append((x + 2.5, z))
    for _ in range(chance.randint(1, 4)):
        cycle = chance.choice(["G81 {}", "G82 {} P0.1", "G83 {} Q1.5", "G73 {} Q2"])
        if deep and chance.random() < 0.5:
            across, plane = [x for x, _ in deep], max(z for _, z in deep) + chance.choice([1.5, 4])
            bottom = min(z for _, z in deep) - 1.5
        else:
            across, plane, bottom = [5, 22, 30, 48, 66], chance.choice([1, 2.5, 6]), -1.5
        places = [f"X{chance.choice(across)} Y{chance.choice([14, 25, 36])}" for _ in range(chance.randint(1, 6))]
        first, *more = dict.fromkeys(places)
        lines += [f"{chance.choice(['G98', 'G98', 'G99'])} {cycle.format(first)} R{plane} Z{bottom} F100", *more]
        lines += ["G80", f"G0 Z{chance.choice([15, 20])}"]
        if chance.random() < 0.6:
            x, y, z = chance.randint(5, 30), chance.randint(5, 25), chance.choice([-2, 0.5, 3])
            lines += [f"G0 X{x} Y{y}", "G1 Z4 F500", f"G1 Z{z} F80"]
            code, radius = chance.choice("23"), chance.randint(25, 40)
            lines += [f"g{code}x{x + chance.randint(5, 30)}y{y + chance.randint(-4, 20)}r{radius}", "G0 Z15"]
    return HEAD + "G0 X0 Y0 Z20\n" + "\n".join(lines) + "\n" + TAIL


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 7, 8])
def test_random_series_keep_clear_of_the_material_on_all_their_ways(seed: int, tmp_path: Path, rs274: str) -> None:
    text = random_series(random.Random(seed))
    found = reordered(tmp_path, text, low_retracts=True, air=True, workpiece=BLOCK, cell=0.2)
    assert not told(found)
    assert found.after.time_s <= found.before.time_s * (1 + 1e-9)
    path = interpret_program(found.text, load_dialect("linuxcnc")).path
    status, said = run_rs274(rs274, found.text, tmp_path)
    assert status == 0
    assert_same_moves(moves_of_toolpath(path), moves_of_rs274(said), 1e-4)
    holes = path.kind == Kind.DRILL
    old = interpret_program(text, load_dialect("linuxcnc")).path
    assert (path.end[holes] <= old.end[old.kind == Kind.DRILL] + 1e-9).all()
    check_ways(path)


def test_an_arc_whose_chord_is_in_the_air_too_is_a_rapid_along_that(tmp_path: Path, rs274: str) -> None:
    """Next to the block, 3 mm from it; the centre words are removed, and the next arc repeats its own motion word."""
    text = HEAD + "G0 X76 Y-4 Z5\nG0 Z-2\nG3 X76 Y4 I0 J4 F100 (lead)\nX70 Y10 I-6 J0\nG1 X60\n" + TAIL
    found = reordered(tmp_path, text, air=True, workpiece=BLOCK)
    assert body(found) == ["G0 X76 Y-4 Z5", "G0 Z-2", "G0 X76 Y4 F100 (lead)", "G3 X70 Y10 I-6 J0", "G1 X60"]
    assert found.detail.pace.rapids == 1
    assert run_rs274(rs274, found.text, tmp_path)[0] == 0
    near = reordered(tmp_path, text, air=True, workpiece="0,0,-10,72.5,50,0")
    assert "G3 X76 Y4 I0 J4" in near.text


def test_a_chord_over_a_clamp_stays_an_arc(tmp_path: Path) -> None:
    """The clamp, 1 mm wide, stands at the middle of the chord; the arc, 8 mm in radius, goes round it."""
    text = HEAD + "G0 X60 Y-10 Z15\nG0 Z2\nG3 X60 Y8 I0 J9 F100\nG1 X50\nG1 Z-1 F60\nX40\n" + TAIL
    clamp = {"keep_out": "59.5 -1.5 60.5 -0.5", "clearance_height": 12}
    free, held = (reordered(tmp_path, text, air=True, workpiece=BLOCK, **one) for one in ({}, clamp))
    assert "G0 X60 Y8" in free.text
    assert "G3 X60 Y8 I0 J9" in held.text
    assert not told(held)


def test_the_proof_refuses_a_series_that_stays_too_low(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What chose the heights is made to see nothing: two slots with the block's top between them."""
    slots = "".join(f"G0 X{x} Y5\nG0 Z2\nG1 Z-5 F60\nG1 Y45 F600\nG1 X{x + 5}\nG1 Y5\nG0 Z15\n" for x in (10, 40))
    text = HEAD + slots + "G98 G81 X12.5 Y20 R-3 Z-8 F100\nX42.5\nG80\n" + TAIL
    monkeypatch.setattr(heights.HeightLowering, "_can_stay_at_plane", lambda *_: True)
    found = reordered(tmp_path, text, low_retracts=True, workpiece=BLOCK)
    assert "G99" not in found.text
    assert len(told(found)) == 1
    assert "a lowered move comes too close to the material" in told(found)[0]


def test_the_proof_refuses_a_chord_through_the_material_or_over_a_clamp(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = HEAD + "G0 X60 Y-10 Z5\nG0 Z-2\nG3 X80 Y10 I0 J20 F100\nG1 X70\n" + TAIL
    over = HEAD + "G0 X60 Y-10 Z15\nG0 Z2\nG3 X60 Y8 I0 J9 F100\nG0 Z15\nX10\nG1 Z-1 F60\nX40\n" + TAIL
    clamp = {"keep_out": "59.5 -1.5 60.5 -0.5", "clearance_height": 12}
    monkeypatch.setattr(
        pace._PaceSteps, "arcs_as_chords", lambda _, program, __: np.flatnonzero(program.path.kind == Kind.ARC_CCW)
    )
    for program, options, words in ((text, {}, "too close to the material"), (over, clamp, "the speeds are unchanged")):
        found = reordered(tmp_path, program, air=True, workpiece=BLOCK, **options)
        assert "G3" in found.text
        assert [words in line for line in told(found)] == [True]
