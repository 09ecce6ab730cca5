"""The interpreter against readings by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.toolpath import Arc, DrillCycle, Kind, Motion, Toolpath, arc_radius_start_sweep

NAN = math.nan


def read(text: str, name: str = "linuxcnc") -> Toolpath:
    """Interpret lines separated by `/`, with an end after them."""
    return interpret_own_program(text.replace(" / ", "\n") + "\nM30\n", load_dialect(name))


def kinds(path: Toolpath) -> list[Kind]:
    """Return the kinds of all rows but the end's."""
    return [Kind(k) for k in path.kind.tolist()[:-1]]


def rows(path: Toolpath) -> list[Motion]:
    """Return all rows but the end's."""
    return list(path)[:-1]


def same(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Compare numbers to a billionth, NaN equal to NaN."""
    return np.allclose(one, other, rtol=0, atol=1e-9, equal_nan=True)


def test_positions_are_unknown_until_their_axis_moves() -> None:
    """Before the first word of an axis its coordinate is NaN."""
    path = read("G21 G90 / G0 Z5 / X1 / Y2")
    assert same(tuple(path.end[:3].ravel()), (NAN, NAN, 5, 1, NAN, 5, 1, 2, 5))


def test_lengths_and_feeds_are_converted_from_inches() -> None:
    """1 in is 25.4 mm and 60 in/min are 25.4 mm/s."""
    path = read("G20 / G0 X1 Y2 Z0 / G1 X2 F60")
    assert same(path[1].end, (50.8, 50.8, 0)) and path[1].value == pytest.approx(25.4)


def test_incremental_moves_add_up() -> None:
    """G91 counts from the last place, G90 from program zero."""
    path = read("G21 G0 X1 Y1 Z1 / G91 X1 Z-2 / Y.5 / G90 X0")
    assert same(path[3].end, (0, 1.5, -1)) and same(path[1].end, (2, 1, -1))


@pytest.mark.parametrize(
    "words, center, sweep",
    [
        ("G2 X10 Y0 I5 J0", (5, 0, 1), -math.pi),
        ("G3 X10 Y0 I5", (5, 0, 1), math.pi),
        ("G3 I5", (5, 0, 1), math.tau),
        ("G2 X0 Y0 I0 J-3 P3", (0, -3, 1), -3 * math.tau),
        ("G2 X10 Y0 R5", (5, 0, 1), -math.pi),
        ("G2 X5 Y5 R5", (5, 0, 1), -math.pi / 2),
        ("G3 X5 Y5 R5", (0, 5, 1), math.pi / 2),
        ("G2 X5 Y5 R-5", (0, 5, 1), -1.5 * math.pi),
        ("G3 X5 Y5 R-5", (5, 0, 1), 1.5 * math.pi),
        ("G90.1 G3 X10 Y0 I5 J0", (5, 0, 1), math.pi),
        ("G18 G3 X10 Z1 I5", (5, 0, 1), math.pi),
        ("G19 G2 Y8 Z1 J4 K0", (0, 4, 1), -math.pi),
    ],
)
def test_arcs_have_the_centre_and_the_sweep_of_the_drawing(words: str, center: tuple[float, ...], sweep: float) -> None:
    """From (0, 0, 1): half, quarter and full circles, worked out on paper."""
    path = read(f"G21 G0 X0 Y0 Z1 F60 / {words}")
    assert same(path.arcs[0].center, center)
    assert arc_radius_start_sweep(path, 1)[2] == pytest.approx(sweep)


def test_a_helix_keeps_its_height() -> None:
    """The axis square to the plane moves along with the arc."""
    path = read("G21 G0 X0 Y0 Z1 F60 / G3 X0 Y0 Z-2 I5 P2")
    assert path[1].kind is Kind.ARC_CCW and same(path[1].end, (0, 0, -2))
    assert path.arcs == (Arc((5, 0, 1), 17, 2),)


def test_feed_modes_become_millimetres_per_second() -> None:
    """G95 times the speed; G93 is one over the minutes that the cut takes, for lines and for arcs."""
    path = read("G21 G0 X0 Y0 Z0 S1200 M3 / G95 G1 X10 F0.1 / G94 G1 X20 F120 / G93 G1 X50 F2 / G93 G3 X60 Y0 I5 F1")
    values = [m.value for m in path if m.kind in (Kind.FEED, Kind.ARC_CCW)]
    assert values == pytest.approx([2.0, 2.0, 1.0, 5 * math.pi / 60])


@pytest.mark.parametrize(
    "words, expected",
    [
        ("G99 G81 X1 Y2 Z-3 R1", DrillCycle("G81", 1, -3)),
        ("G98 G81 X1 Y2 Z-3 R1", DrillCycle("G81", 1, -3, True)),
        ("G99 G82 X1 Y2 Z-3 R1 P0.5", DrillCycle("G82", 1, -3, False, 0, 0.5)),
        ("G99 G83 X1 Y2 Z-3 R1 Q2", DrillCycle("G83", 1, -3, False, 2)),
        ("G99 G73 X1 Y2 Z-3 R1 Q2", DrillCycle("G73", 1, -3, False, 2)),
        ("G99 G84 X1 Y2 Z-3 R1 P1", DrillCycle("G84", 1, -3, False, 0, 1)),
        ("G99 G85 X1 Y2 Z-3 R1", DrillCycle("G85", 1, -3)),
        ("G99 G91 G81 X1 Y2 Z-4 R-9", DrillCycle("G81", 1, -3)),
    ],
)
def test_a_cycle_becomes_one_row_with_all_its_words(words: str, expected: DrillCycle) -> None:
    """Planes are absolute in the row; the tool ends at R, or with G98 at the height from before."""
    path = read(f"G21 G90 G0 X0 Y0 Z10 F60 / {words}")
    assert path[1].kind is Kind.DRILL and path.cycles == (expected,)
    assert same(path[1].end, (1, 2, 10 if expected.to_initial else 1)) and path[1].value == 1.0


def test_words_of_a_cycle_stay_until_the_cycle_ends() -> None:
    """X alone drills on; Z and R may change; G80 and G0 end the cycle."""
    path = read("G21 G0 X0 Y0 Z5 F60 / G99 G81 X1 Z-1 R1 / X2 / X3 Z-2 / Y4 R2 / G80 / G0 X9 / G0 Y0")
    assert kinds(path) == [Kind.RAPID] + [Kind.DRILL] * 4 + [Kind.RAPID] * 2
    assert [path.cycles[m.ref].bottom for m in rows(path)[1:5]] == [-1, -1, -2, -2]
    assert [m.end[2] for m in rows(path)[1:5]] == [1, 1, 1, 2]


def test_g98_rises_to_the_height_before_the_series() -> None:
    """After holes with G99, G98 still goes back to where the series started; after G80 a new series starts."""
    path = read("G21 G0 X0 Y0 Z10 F60 / G99 G81 X1 Z-1 R2 / X2 / G98 X3 / G99 X4 / G80 / G98 G81 X5 Z-1 R1")
    assert [m.end[2] for m in rows(path)[1:]] == [2, 2, 10, 2, 2]


def test_repeats_step_in_incremental_mode_only() -> None:
    """G91 with L3 drills three holes in a row; G90 with L2 drills one position twice. Fanuc uses K."""
    path = read("G21 G0 X0 Y0 Z10 F60 / G99 G91 G81 X1 Y.5 Z-3 R-8 L3")
    assert same(tuple(path.end[1:4, :2].ravel()), (1, 0.5, 2, 1, 3, 1.5))
    assert same(tuple(read("G21 G0 X0 Y0 Z10 F60 / G99 G81 X4 Z-3 R1 L2").end[1:3, 0]), (4, 4))
    assert len(read("G21 G0 X0. Y0. Z10. F60 / G99 G91 G81 X1. Z-3. R-8. K5", "fanuc")) == 7


def test_tool_offset_spindle_and_coolant_become_rows() -> None:
    """T selects and M6 changes the tool; S alone only changes a running spindle; M7 and M8 add up."""
    path = read("S500 / T3 / M6 / G43 H3 / M3 / S800 / M4 / M5 / M7 / M8 / M9 / M7 M8 / G49")
    expected = [
        (Kind.TOOL, 0, 3),
        (Kind.OFFSET, 0, 3),
        (Kind.SPINDLE, 500, 0),
        (Kind.SPINDLE, 800, -1),
        (Kind.SPINDLE, -800, 0),
        (Kind.SPINDLE, 0, 0),
        (Kind.COOLANT, 0, 1),
        (Kind.COOLANT, 0, 3),
        (Kind.COOLANT, 0, 0),
        (Kind.COOLANT, 0, 3),
        (Kind.OFFSET, 0, 0),
    ]
    assert [(m.kind, m.value, m.ref) for m in rows(path)] == expected


def test_a_pause_with_a_tool_chosen_is_a_change_by_hand() -> None:
    """GRBL has no M6: T2 and the next M0 change the tool; other pauses stay pauses."""
    path = read("T2 / M0 / M0 / M1", "grbl")
    assert [(m.kind, m.ref) for m in rows(path)] == [(Kind.TOOL, 2), (Kind.PAUSE, 0), (Kind.PAUSE, 1)]
    assert kinds(read("T2 / M0", "linuxcnc")) == [Kind.PAUSE]


@pytest.mark.parametrize("text", ["G53 G0 Z0", "G91 G28 Z0", "G90 G0 Z3 / G28 Z3", "G91 G28 Z0 / G90"])
def test_machine_zero_is_one_row_however_it_is_said(text: str) -> None:
    """G53 and G28 give the same row, and afterwards Z is not known."""
    path = read(f"G21 G90 G0 X1 Y2 Z3 / {text} / G90 G0 X2")
    machine = next(m for m in path if m.kind is Kind.MACHINE)
    assert same(machine.end, (NAN, NAN, 0)) and same(rows(path)[-1].end, (2, 2, NAN))


def test_home_goes_over_the_point_that_is_programmed() -> None:
    """G28 with an intermediate point is a rapid to it, then machine zero; G28 alone homes all axes."""
    path = read("G21 G90 G0 X1 Y2 Z3 / G28 X5 Z9 / G28")
    assert kinds(path) == [Kind.RAPID, Kind.RAPID, Kind.MACHINE, Kind.MACHINE]
    assert same(path[1].end, (5, 2, 9)) and same(path[2].end, (0, NAN, 0)) and same(path[3].end, (0, 0, 0))


@pytest.mark.parametrize(
    "name, word, seconds",
    [
        ("linuxcnc", "G4 P1.5", 1.5),
        ("linuxcnc", "G4 P2", 2.0),
        ("grbl", "G4 P0.5", 0.5),
        ("mach3", "G4 P3", 3.0),
        ("fanuc", "G4 P500", 0.5),
        ("fanuc", "G4 X1.5", 1.5),
        ("haas", "G4 P500", 0.5),
        ("haas", "G4 P10.", 10.0),
        ("mach4", "G4 P500", 0.5),
        ("mach4", "G4 P0.5", 0.5),
        ("fagor8055", "G4 K150", 1.5),
    ],
)
def test_a_dwell_means_what_its_controller_takes_it_for(name: str, word: str, seconds: float) -> None:
    """Seconds, milliseconds, or by the decimal point; hundredths on a Fagor."""
    path = read(word, name)
    assert (path[0].kind, path[0].value) == (Kind.DWELL, pytest.approx(seconds))


def test_fagor_cycles_have_the_plane_in_z_and_the_depth_in_i() -> None:
    """As its manual has it: Z reference plane, I depth, K dwell in hundredths of a second."""
    path = read("G71 G90 G0 X0 Y0 Z10 F60 / G81 G99 X1 Y1 Z2 I-5 / X2 / G80 / G81 G98 X3 Z2 I-5 K50 / G80", "fagor8055")
    assert path.cycles == (DrillCycle("G81", 2, -5), DrillCycle("G82", 2, -5, True, 0, 0.5))
    assert [m.end[2] for m in rows(path)[1:]] == [2, 2, 2]
    incremental = read("G71 G90 G0 X0 Y0 Z10 F60 / G91 G81 G99 X1 Y0 Z-8 I-7", "fagor8055")
    assert incremental.cycles == (DrillCycle("G81", 2, -5),)


def test_fanuc_keeps_cycles_in_a_group_of_their_own() -> None:
    """G80 G0 in one block is right there; planes stay when the cycle changes; G0 comes back after G80."""
    path = read(
        "G21 G0 X0. Y0. Z10. F60. / G99 G81 X1. Z-1. R1. / G82 X2. P500 / G80 G0 Z9. / G81 X3. Z-1. R1. / G80 / Z5.",
        "fanuc",
    )
    assert kinds(path) == [Kind.RAPID, Kind.DRILL, Kind.DRILL, Kind.RAPID, Kind.DRILL, Kind.RAPID]
    assert path.cycles[1] == DrillCycle("G82", 1, -1, False, 0, 0.5)
    with pytest.raises(ReadError, match="G0 and G80 exclude each other"):
        read("G21 G80 G0 Z9")


def test_off_words_act_after_the_motion_of_their_block_where_the_controller_says_so() -> None:
    """G1 with M5: Haas cuts, then stops; LinuxCNC stops first."""
    text = "G21 G0 X0. Y0. Z0. / S100 M3 / G1 X1. F60. M5"
    assert kinds(read(text, "haas"))[2:] == [Kind.FEED, Kind.SPINDLE]
    assert kinds(read(text, "linuxcnc"))[2:] == [Kind.SPINDLE, Kind.FEED]


def test_the_frame_of_a_program_is_no_motion() -> None:
    """Percent signs, the O word, N words, comments, and what comes after the end do not count."""
    text = "%\nO0007 (part)\nN10 G21 (mm)\n\nN20 G0 X1.\nM30\n%\nnonsense ( after"
    path = interpret_own_program(text, load_dialect("haas"))
    assert [(m.kind, m.line) for m in path] == [(Kind.RAPID, 5), (Kind.END, 6)]
    assert len(interpret_own_program("%\nG21 G0 X1\n%\nG0 X5", load_dialect("linuxcnc"))) == 1


def test_a_length_before_the_units_is_an_error_unless_it_is_zero() -> None:
    with pytest.raises(ReadError, match="program:1: X1 comes before the units"):
        interpret_own_program("G0 X1\nM2", load_dialect("linuxcnc"))
    assert interpret_own_program("G0 X0\nM2", load_dialect("linuxcnc"))[0].end[0] == 0.0


def test_a_long_program_is_read_line_by_line() -> None:
    """Five thousand lines give five thousand rows with their line numbers."""
    text = "G21 G90 G0 X0 Y0\nG1 F600\n" + "".join(f"X{n % 100}.5\n" for n in range(5_000)) + "M2"
    path = interpret_own_program(text, load_dialect("linuxcnc"))
    assert len(path) == 5_002 and path.line[-1] == 5_003


def test_a_program_that_states_its_modes_is_the_same_whatever_another_left_over() -> None:
    for left_over in (False, True):
        path = interpret_own_program(STATED, load_dialect("linuxcnc"), left_over=left_over)
        assert [m.end for m in path if m.kind is Kind.DRILL] == [(1, 2, 5)]


@pytest.mark.parametrize("mode", ["G17 ", "G90 ", " G94", "G0 ", "G98 "])
def test_a_program_that_relies_on_the_modes_it_finds_is_found_out(mode: str) -> None:
    """Without G17, G94 or G0 it cannot be run then; without G90 the hole is elsewhere, without G98 the retract."""
    text = STATED.replace(mode, "", 1)
    assert text != STATED
    try:
        path = interpret_own_program(text, load_dialect("linuxcnc"), left_over=True)
    except ReadError:
        return
    assert [m.end for m in path if m.kind is Kind.DRILL] != [(1, 2, 5)]


STATED = "G21\nG17 G90 G94\nG0 Z5\nX1 Y2\nG98 G81 X1 Y2 Z-3 R1 F100\nM2\n"


def test_a_number_of_the_length_alone_changes_the_active_length_of_a_fagor() -> None:
    """D with G43 or G44 waits for that word; D before G43 only stores the number."""
    text = "G71\nG90 G17\nT1 D1 M6\nD4\nG0 G43 Z5\nD2\nG43 D3 Z6\nG44 D5\nD6\nM30\n"
    path = interpret_own_program(text, load_dialect("fagor8055"))
    offsets = path.kind == Kind.OFFSET
    assert list(zip(path.line[offsets].tolist(), path.ref[offsets].tolist(), strict=True)) == [
        (5, 4),
        (6, 2),
        (7, 3),
        (8, 0),
    ]
