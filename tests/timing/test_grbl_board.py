"""GRBL's clock: rules by hand, recorded times of the real firmware, and its times on a simulated board."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks import grbl_time
from grbl_board import needed_board
from leafcut.api import simulate
from leafcut.errors import OptionError
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.model.toolpath import Toolpath, ToolpathBuilder
from leafcut.read.machine import load_machine, machine_template
from leafcut.timing.grbl import count_line_bytes_and_words
from leafcut.timing.profile import trapezoid_time
from leafcut.timing.toolpath import measure_toolpath, rows_waiting_for_serial_line

RECORDED = grbl_time.recorded()

MILL = Machine(
    "mill",
    "",
    "grbl",
    (100.0, 100.0, 50.0),
    (500.0, 500.0, 250.0),
    80.0,
    (-400.0, -200.0, -300.0),
    (0.0, 0.0, 0.0),
)


def limit_of(name: str) -> float:
    return grbl_time.WORST_STARVED if name.startswith(grbl_time.STARVED) else grbl_time.WORST


@pytest.mark.parametrize("name", sorted(RECORDED))
def test_no_program_is_farther_off_than_is_said_from_what_the_firmware_needed_for_it(name: str) -> None:
    machine, lines_of = grbl_time.PROGRAMS[name]
    try:
        lines = lines_of()
    except FileNotFoundError:
        if grbl_time.DATA.is_dir():
            raise
        pytest.skip("the shared data is not here; set LEAFCUT_DATA")
    assert grbl_time.our_seconds(lines, machine) == pytest.approx(RECORDED[name], rel=limit_of(name))


@pytest.fixture(scope="module")
def board(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the simulated board."""
    needed_board()
    return grbl_time.build_board(tmp_path_factory.mktemp("board"))


@pytest.mark.external
@pytest.mark.parametrize("name", ["dwells", "starved: small circles"])
def test_the_firmware_agrees_with_leafcut_and_with_its_recorded_time(board: Path, name: str) -> None:
    machine, lines_of = grbl_time.PROGRAMS[name]
    lines = lines_of()
    truth = grbl_time.board_seconds(board, lines, machine)
    assert truth == pytest.approx(RECORDED[name], rel=0.002)
    assert grbl_time.our_seconds(lines, machine) == pytest.approx(truth, rel=0.01)


@pytest.mark.external
def test_the_firmware_agrees_for_short_moves_that_it_joins(board: Path) -> None:
    """A quarter of the recorded program; the board takes twice the time of its moves."""
    machine, _ = grbl_time.PROGRAMS["moves of 1 mm at 4000 mm/min"]
    lines = grbl_time.wave(1, 4000, 100)
    truth = grbl_time.board_seconds(board, lines, machine)
    assert truth > 2.0
    assert grbl_time.our_seconds(lines, machine) == pytest.approx(truth, rel=0.01)


def line(*ends: float, feed: float = 50.0, stop: bool = False) -> Toolpath:
    """Return feeds along x, with another coolant before each if they shall `stop`."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    for i, x in enumerate(ends):
        if stop:
            builder.coolant(1 + i % 2)
        builder.feed(x, 0.0, feed=feed)
    return builder.build()


def seconds(path: Toolpath, machine: Machine = MILL) -> float:
    return measure_toolpath(path, machine).time_s


def test_a_stop_costs_the_time_for_which_the_motors_are_held_and_some_reading() -> None:
    """Two moves from rest to rest with 0.1 s between, and at most 15 lines of about 2 ms before the second starts."""
    each = [trapezoid_time(d, 50.0, 500.0) for d in (20.0, 30.0)]
    held = replace(MILL, motor_lock_s=0.1)
    assert sum(each) + 0.1 < seconds(line(20.0, 50.0, stop=True), held) < sum(each) + 0.1 + 0.03


def test_a_word_that_changes_nothing_does_not_stop_grbl() -> None:
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.spindle(1000.0)
    builder.feed(20.0, 0.0, feed=50.0)
    builder.spindle(1000.0)
    builder.feed(50.0, 0.0, feed=50.0)
    assert seconds(builder.build()) == pytest.approx(trapezoid_time(50.0, 50.0, 500.0), rel=2e-3)


def test_a_dwell_is_whole_twentieths_of_a_second_and_no_spindle_is_waited_for() -> None:
    """0.01 s and 0.11 s are 0.05 s and 0.15 s; GRBL does not wait for the spindle's own 2 s."""
    for asked, real in ((0.01, 0.05), (0.11, 0.15), (0.15, 0.15)):
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 0.0)
        builder.dwell(asked)
        assert measure_toolpath(builder.build(), MILL).by_kind["dwell"] == pytest.approx(real)
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    builder.spindle(1000.0)
    assert measure_toolpath(builder.build(), replace(MILL, spindle_start_s=2.0)).by_kind["spindle"] == 0.0


def test_a_move_of_less_than_half_a_step_takes_no_time() -> None:
    coarse = replace(MILL, steps_per_mm=(10.0, 10.0, 10.0))
    assert seconds(line(0.04), coarse) == 0.0
    assert seconds(line(0.06), coarse) > 0.0


def test_steps_come_no_more_slowly_than_the_longest_tick_of_the_timer() -> None:
    """At 10 steps/mm and 0.1 mm/s a step would take 1 s; eight ticks of 65536 cycles of 16 MHz are 32.8 ms."""
    coarse = replace(MILL, steps_per_mm=(10.0, 10.0, 10.0))
    assert seconds(line(10.0, feed=0.1), coarse) == pytest.approx(100 * 8 * 65536 / 16e6, rel=0.02)


def test_two_moves_of_a_right_angle_with_other_limits_of_z_by_hand() -> None:
    """Down 20 mm, then 30 mm in x: the corner pulls along the diagonal of x and z, of which z allows 250 √2."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 20.0)
    builder.feed(0.0, 0.0, 0.0, feed=40.0)
    builder.feed(30.0, 0.0, 0.0, feed=40.0)
    sine = math.sin(math.pi / 4)
    corner2 = 250 * math.sqrt(2) * 0.01 * sine / (1 - sine)
    ramps = [(80.0 - math.sqrt(corner2)) / a - (2 * 40.0**2 - corner2) / (2 * a) / 40.0 for a in (250.0, 500.0)]
    assert seconds(builder.build()) == pytest.approx(50.0 / 40.0 + sum(ramps), rel=2e-3)


def test_lines_that_come_too_slowly_are_found_where_they_are() -> None:
    """20 moves of 20 mm, 300 of 0.05 mm, which are late, and 20 of 20 mm, all at 80 mm/s."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0, line=1)
    x, row = 0.0, 1
    for count, step in ((20, 20.0), (300, 0.05), (20, 20.0)):
        for _ in range(count):
            x, row = x + step, row + 1
            builder.feed(x, 0.0, feed=80.0, line=row)
    path = builder.build()
    rows, lost = rows_waiting_for_serial_line(path, MILL)
    inside = (path.line[rows] > 21) & (path.line[rows] <= 321)
    assert lost[inside].sum() > 0.1
    assert lost[~inside].sum() < 0.1 * lost[inside].sum()
    assert not len(rows_waiting_for_serial_line(path, replace(MILL, controller="linuxcnc"))[0])


def test_comments_and_blanks_are_not_sent() -> None:
    sent = count_line_bytes_and_words(["G1 X1.5 (a comment) Y2\n", "; nothing\n", "\n", "m5\n"])
    assert sent.size.tolist() == [len("G1X1.5Y2") + 1, 0, 0, 3]
    assert sent.words.tolist() == [3, 0, 0, 1]


def test_the_board_s_settings_of_a_profile_are_read_and_refused_out_of_range(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(
        machine_template("grbl-3018")
        .replace('# steps_per_mm = "250 steps/mm"', 'steps_per_mm = ["80 steps/mm", "80 steps/mm", "400 steps/mm"]')
        .replace('# lock_time = "25 ms"', 'lock_time = "0 ms"')
        .replace('# arc_tolerance = "0.002 mm"', 'arc_tolerance = "0.01 mm"')
    )
    found = load_machine(str(file))
    assert (found.steps_per_mm, found.motor_lock_s, found.arc_tolerance) == ((80.0, 80.0, 400.0), 0.0, 0.01)
    for good, bad in (("0 ms", "2 s"), ('"80 steps/mm", "80', '"0 steps/mm", "80'), ('"0.01 mm"\n#', '"0 mm"\n#')):
        text = file.read_text()
        file.write_text(text.replace(good, bad, 1))
        assert text != file.read_text()
        with pytest.raises(OptionError, match="but must be"):
            load_machine(str(file))
        file.write_text(text)


def test_the_same_moves_of_a_laser_are_slower_without_laser_mode() -> None:
    machine, lines_of = grbl_time.PROGRAMS["S in every block, $32=1"]
    spindle = replace(machine, head=Head.SPINDLE, controller="grbl")
    lines = lines_of()
    assert grbl_time.our_seconds(lines, spindle) > grbl_time.our_seconds(lines, machine) + 40 * 0.025


@given(
    ends=st.lists(
        st.tuples(*[st.integers(-9000, 9000)] * 2, st.sampled_from([0, 0, 5, -700])), min_size=1, max_size=30
    ),
    steps=st.sampled_from([40.0, 80.0, 250.0, 800.0]),
    acceleration=st.sampled_from([10.0, 50.0, 200.0, 3000.0]),
)
def test_no_path_is_faster_than_its_feed_nor_slower_than_with_every_move_from_rest(ends, steps, acceleration) -> None:
    """Positions in µm; a stop costs less than 0.05 s for reading and holding."""
    machine = replace(MILL, steps_per_mm=(steps,) * 3, acceleration=(acceleration,) * 3)
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 0.0)
    for x, y, z in ends:
        builder.feed(x / 1000, y / 1000, z / 1000, feed=20.0)
    found = measure_toolpath(builder.build(), machine)
    lengths = np.linalg.norm(np.diff([(0, 0, 0), *ends], axis=0), axis=1) / 1000
    # Each end is up to half a step away from where it should be, in each axis.
    away = math.sqrt(3) / steps
    longest = [trapezoid_time(length + away, 20.0, acceleration) + 0.05 for length in lengths.tolist()]
    assert (lengths - away).sum() / 20.0 - 1e-9 <= found.time_s <= sum(longest)


def test_a_move_of_a_kilometre_is_timed_as_a_short_one_is() -> None:
    far = replace(MILL, travel_min=(-1e7, 0.0, 0.0))
    assert seconds(line(1e6), far) == pytest.approx(trapezoid_time(1e6, 50.0, 500.0), rel=2e-3)
    assert seconds(line(1e6, 1e6 + 30.0), far) == pytest.approx(trapezoid_time(1e6 + 30.0, 50.0, 500.0), rel=2e-3)


def test_simulate_says_in_which_lines_a_program_waits_for_lines_and_of_others_nothing(tmp_path: Path) -> None:
    """A lead of 40 mm, then moves of 0.05 mm at 100 mm/s from line 4 on."""
    file = tmp_path / "part.nc"
    file.write_text(
        "\n".join(["G21 G90 G94", "G0 X0 Y0", "G1 X40 F6000", *(f"X{40 + 0.05 * i:.2f}" for i in range(300))])
    )
    told = [i for i in simulate(file, machine="grbl-laser-5w").issues if i.code == "L415"]
    assert len(told) == 1
    first = int(told[0].place.removeprefix("line "))
    assert 4 <= first <= 40
    file.write_text("\n".join(["G21 G90 G94", "G0 X0 Y0", *(f"G1 X{10 * i} F6000" for i in range(1, 20))]))
    assert not [i for i in simulate(file, machine="grbl-laser-5w").issues if i.code == "L415"]
