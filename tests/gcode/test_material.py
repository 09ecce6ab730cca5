"""Effects of the material in a program: words that the controller adds at every start of the torch."""

from __future__ import annotations

import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.material import Material, add_controller_moves, read_material_choices
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Kind
from leafcut.timing.profile import trapezoid_time
from leafcut.timing.toolpath import measure_toolpath

TABLE = Machine(
    name="table",
    description="",
    controller="qtplasmac",
    head=Head.TORCH,
    rapid_velocity=(100.0, 100.0, 50.0),
    acceleration=(1000.0, 1000.0, 1000.0),
    max_feed=100.0,
    travel_min=(0.0, 0.0, -100.0),
    travel_max=(1000.0, 1000.0, 0.0),
    corners="round",
)
STEEL = "(o=0, kw=1.5, ph=4, pd=0.5, ch=1.5, fr=1200)"
CUT = "M3 $0 S1\nM62 P2\nG1 X100 F1200\nM63 P2\nM5 $0\n"


def run(text: str, clearance: float = 10.0):
    program = interpret_program(f"G21 G90 G94 G61\n{text}M2\n", load_dialect("qtplasmac"))
    return add_controller_moves(program.path, program.lines, clearance)


def test_a_cut_by_hand() -> None:
    """Down 6 mm, 0.5 s, down 2.5 mm at 20 mm/s, 100 mm at 20 mm/s, up 8.5 mm; a second way of 50 mm, and a mark: down
    and up 8.5 mm without a wait."""
    path, unknown = run(f"{STEEL}\nG0 X0 Y0\n{CUT}G0 Y50\nM3 $1 S1\nG1 X0\nM5 $1\n")
    found = measure_toolpath(path, TABLE)
    assert unknown == 0
    rapids = [(6.0, 50.0), (8.5, 50.0), (50.0, 100.0), (8.5, 50.0), (8.5, 50.0)]
    assert found.by_kind["spindle"] == pytest.approx(0.5)
    assert found.by_kind["rapid"] == pytest.approx(sum(trapezoid_time(s, v, 1000.0) for s, v in rapids), abs=1e-6)
    feeds = [trapezoid_time(s, 20.0, 1000.0) for s in (2.5, 100.0, 100.0)]
    assert found.by_kind["feed"] == pytest.approx(sum(feeds), abs=1e-6)


def test_the_torch_goes_down_at_the_feed_that_the_cut_begins_with() -> None:
    """2.5 mm at 10 mm/s, then 10 mm at 10 and 10 mm at 20: holes are cut slower than the material's own feed."""
    path, _ = run(f"{STEEL}\nG0 X0 Y0\nM3 $0 S1\nM62 P2\nG1 X10 F600\nX20 F1200\nM5 $0\n")
    feeds = path.value[path.kind == Kind.FEED]
    assert feeds.tolist() == pytest.approx([10.0, 10.0, 20.0])
    assert not (run(f"{STEEL}\nG0 X0 Y0\nM3 $0 S1\nM5 $0\n")[0].kind == Kind.FEED).any()


def test_the_figures_are_in_the_units_of_the_program() -> None:
    assert read_material_choices(["G20", "(o=0, ph=0.1, pd=1.5, ch=0.05, fr=60)"]) == [
        (2, Material(pytest.approx(2.54), 1.5, pytest.approx(1.27), pytest.approx(25.4)))
    ]


def test_a_material_of_the_programs_own_table_is_chosen_by_its_number() -> None:
    lines = ["(o=1, nu=7, ph=3, pd=0.2, ch=1)", "M190 P8", "n20 m190 p7", "(o=0, ph=5)", "(only words, pd=9)"]
    assert read_material_choices(lines) == [
        (2, None),
        (3, Material(3.0, 0.2, 1.0, 0.0)),
        (4, Material(5.0, 0.0, 0.0, 0.0)),
    ]


def test_cuts_of_a_material_that_only_the_controller_knows_are_counted() -> None:
    path, unknown = run(f"M190 P3\nG0 X0 Y0\n{CUT}{STEEL}\nG0 X0\n{CUT}")
    assert unknown == 1
    assert (path.kind == Kind.DWELL).sum() == 1
    assert run("G0 X0 Y0\n" + CUT)[1] == 1


def test_an_arc_after_a_start_is_as_long_as_before() -> None:
    """Half a circle of 10 mm."""
    path, _ = run(f"{STEEL}\nG0 X0 Y0\nM3 $0 S1\nG3 X20 Y0 I10 J0 F1200\nM5 $0\n")
    assert measure_toolpath(path, TABLE).cut_mm == pytest.approx(2.5 + 31.4159, abs=1e-3)


def test_senseless_comments_cost_no_time_and_do_no_harm() -> None:
    odd = "(o=0, ph=, pd=1.2.3, ch=99999999999999)", "(o=0," + "pd=1" * 5000 + ")", "(o=9, pd=1)", "(o=0, pd=-4)"
    assert [m for _, m in read_material_choices(odd)] == [Material(0.0, 0.0, 0.0, 0.0)] * 2


HAL = "F#<_hal[plasmac.cut-feed-rate]>"


def test_a_feed_from_a_material_is_that_of_the_program_or_else_the_one_that_is_said() -> None:
    """1200 mm/min of the program's own material; 50 mm/s are 3000 mm/min, and of an inch program 118.110236."""
    text = f"G21\n(o=1, nu=7, fr=1200)\nM190 P7\nG1 X1 {HAL}\nM190 P8\nG1 X2 {HAL} ({HAL})\nG20\nX3 {HAL}\nM2\n"
    program = interpret_program(text, load_dialect("qtplasmac"), material_feed=50.0)
    said = [1200.000001, 3000.000001, 118.110237]
    assert program.feed_words == dict.fromkeys(said, HAL)
    feeds = program.path.value[program.path.kind == Kind.FEED]
    assert feeds.tolist() == pytest.approx([20.0, 50.0, 50.0], abs=1e-6)
    # The text is unchanged, and no block has to stay because of its feed.
    assert "".join(program.lines) == text
    assert not any("parameters" in reason for reason in program.fixed.values())


@pytest.mark.parametrize(("word", "units"), [("G20", "mm"), ("G21", "in")])
def test_the_unit_of_a_feed_from_a_material_is_that_of_its_own_block(word: str, units: str) -> None:
    """50 mm/s, whatever unit the machine has."""
    text = f"M190 P8\n{word} G1 X1 {HAL}\nM2\n"
    program = interpret_program(text, load_dialect("qtplasmac"), units=units, material_feed=50.0)
    assert program.path.value[program.path.kind == Kind.FEED].tolist() == pytest.approx([50.0], abs=1e-6)


def test_a_feed_from_a_material_is_not_known_where_nobody_says_it() -> None:
    program = interpret_program(f"G21\nG1 X1 {HAL}\nM2\n", load_dialect("qtplasmac"))
    assert any(program.fixed) and program.feed_words == {}
