"""Interpreting foreign programs: blocks, the state before each block, and blocks kept unchanged."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.toolpath import Kind

HEAD = "G21 G90 G17\nG0 Z10\nX0 Y0\nF100\n"


def run(*lines: str, words: str = "linuxcnc", head: str = HEAD) -> Program:
    """Return the program of these lines after a head of four."""
    return interpret_program(head + "\n".join(lines) + "\n", load_dialect(words))


def kinds(program: Program, block: int) -> list[Kind]:
    """Return the kinds of the rows of a block; negative: from the end."""
    block = range(program.n_blocks)[block]
    return [Kind(k) for k in program.path.kind[program.first[block] : program.first[block + 1]].tolist()]


def place(program: Program, row: int = -1) -> list[float]:
    """Return the end of a row."""
    return program.path.end[row].tolist()


def check_structure(program: Program) -> None:
    """Check that blocks, rows and states fit together."""
    n, first = program.n_blocks, program.first
    assert len(first) == len(program.before) == n + 1
    assert first[0] == 0 and first[-1] == len(program.path) and (np.diff(first) >= 0).all()
    assert len(set(program.modals)) == len(program.modals)
    assert n == 0 or (program.line.min() >= 1 and program.line.max() <= len(program.lines))
    assert (np.repeat(program.line, np.diff(first)) == program.path.line).all()
    assert all(0 <= block < n and reason for block, reason in program.fixed.items())
    assert 0 <= program.last_line <= len(program.lines)


def test_blocks_are_the_lines_with_words() -> None:
    """Blank lines, remarks and percent signs are none; rows and lines belong to their blocks."""
    text = "%\r\n(head)\r\nG21 G90\r\n\r\nN5 G0 X1 Y2 Z3 ; go\r\nM3 S5\nG81 Z-1 R1 F60\nX2 M8\nM2\nleft over ("
    program = interpret_program(text, load_dialect("linuxcnc"))
    check_structure(program)
    assert program.line.tolist() == [3, 5, 6, 7, 8, 9]
    assert program.last_line == 9
    assert "".join(program.lines) == text
    assert [kinds(program, b) for b in range(6)] == [
        [],
        [Kind.RAPID],
        [Kind.SPINDLE],
        [Kind.DRILL],
        [Kind.COOLANT, Kind.DRILL],
        [Kind.END],
    ]
    assert not program.fixed


def test_every_block_knows_what_was_active_before_it() -> None:
    """Motion, cycle with its words, feed, spindle, tool, offsets, modes: as written, before and after."""
    program = run(
        "T3 M6",
        "G43 H3 Z5",
        "M4 S900 M8",
        "G1 X1 F250",
        "G98 G83 X2 Z-3 R1 Q1.5",
        "G99 X3 R2",
        "G80",
        "G20 G1 Y1",
        "G18 G91 G93 G55",
        "G64 P0.1",
        "G41 D2",
        "T5",
        "G90.1 G94 F7",
    )
    check_structure(program)
    m = [program.modal(b) for b in range(program.n_blocks + 1)]
    assert (m[0].unit, m[0].motion, m[0].tool, m[1].unit) == (None, None, None, 1.0)
    assert (m[5].tool, m[5].next_tool) == (3, 3)
    assert (m[6].length, m[6].motion) == (3, 0)
    assert (m[7].rpm, m[7].spindle, m[7].coolant) == (900.0, -1, 2)
    assert (m[8].motion, m[8].feed) == (1, 250.0)
    assert (m[9].motion, m[9].cycle, m[9].to_initial) == (None, 83, True)
    assert dict(m[9].cycle_words) == {"Z": -3.0, "R": 1.0, "Q": 1.5}
    assert dict(m[10].cycle_words) == {"Z": -3.0, "R": 2.0, "Q": 1.5} and not m[10].to_initial
    assert (m[11].cycle, m[11].cycle_words, m[11].motion) == (None, (), None)
    assert (m[12].unit, m[12].feed) == (25.4, pytest.approx(250.0 / 25.4))
    assert (m[13].plane, m[13].incremental, m[13].feed_mode, m[13].feed, m[13].frame) == (18, True, 93, 0.0, 550)
    assert (m[14].blending, m[14].tolerance) == (640, pytest.approx(2.54))
    assert m[15].radius == 41
    assert (m[16].tool, m[16].next_tool) == (3, 5)
    assert (m[17].absolute_centres, m[17].feed_mode, m[17].feed) == (True, 94, 7.0)


@pytest.mark.parametrize(
    "line, kind, after",
    [
        ("G55", Kind.FRAME, (math.nan,) * 3),
        ("G92 X7", Kind.SHIFT, (7.0, 0.0, 10.0)),
        ("G92.1", Kind.SHIFT, (math.nan,) * 3),
        ("G52 Y1", Kind.SHIFT, (0.0, math.nan, 10.0)),
        ("G10 L2 P1 X3", Kind.SHIFT, (math.nan, 0.0, 10.0)),
        ("G10 L2 P0 Z3", Kind.SHIFT, (0.0, 0.0, math.nan)),
        ("G10 L2 P4 X3", Kind.SHIFT, (0.0, 0.0, 10.0)),
        # A work offset that is turned moves all of X and Y, and Z only where it is named.
        ("G10 L2 P1 R30", Kind.SHIFT, (math.nan, math.nan, 10.0)),
        ("G10 L2 P1 R30 Z3", Kind.SHIFT, (math.nan,) * 3),
        ("G10 L20 P1 X3 Z1", Kind.SHIFT, (3.0, 0.0, 1.0)),
        ("G43.1 Z4", Kind.SHIFT, (math.nan,) * 3),
        ("G10 L1 P1 Z3", Kind.FOREIGN, (0.0, 0.0, math.nan)),
        ("G28.1", Kind.FOREIGN, (0.0, 0.0, 10.0)),
        ("G38.2 Z-5", Kind.FOREIGN, (0.0, 0.0, math.nan)),
        ("G33 Z-5 K1", Kind.FOREIGN, (0.0, 0.0, math.nan)),
        ("G5 X5 Y5 I1 J1 P1 Q1", Kind.FOREIGN, (math.nan, math.nan, 10.0)),
        ("G76 P1 Z-2 I1 J1 K1", Kind.FOREIGN, (0.0, 0.0, math.nan)),
        ("G87 X1 Z-2 R1", Kind.FOREIGN, (math.nan, 0.0, math.nan)),
        ("G1 X5 A90", Kind.FOREIGN, (math.nan, 0.0, 10.0)),
        ("G0 U1", Kind.FOREIGN, (0.0, 0.0, 10.0)),
        ("G1 X5 P3", Kind.FOREIGN, (math.nan, 0.0, 10.0)),
        ("G1 X5 M199", Kind.FOREIGN, (math.nan, 0.0, 10.0)),
        ("G65 P9810 Z3", Kind.FOREIGN, (math.nan,) * 3),
        ("G187 P1", Kind.FOREIGN, (math.nan,) * 3),
        ("M199 P3 Q4", Kind.FOREIGN, (0.0, 0.0, 10.0)),
        ("M62 P1", Kind.FOREIGN, (0.0, 0.0, 10.0)),
        ("M6", Kind.FOREIGN, (0.0, 0.0, 10.0)),
        ("G53 G1 X3", Kind.FOREIGN, (math.nan, 0.0, 10.0)),
        ("G18 G81 X1 Y-2 R1", Kind.FOREIGN, (math.nan,) * 3),
        ("$H", Kind.FOREIGN, (math.nan,) * 3),
        ("$J=G91 X5 F100", Kind.FOREIGN, (math.nan,) * 3),
        *((f"${number}=200", Kind.FOREIGN, (math.nan,) * 3) for number in (3, 32, 100, 113, 140)),
        *((f"${number}=200", Kind.FOREIGN, (0.0, 0.0, 10.0)) for number in (30, 31, 110, 121, 132)),
        ("$110=x", Kind.FOREIGN, (math.nan,) * 3),
        ("$X", Kind.FOREIGN, (0.0, 0.0, 10.0)),
        ("$N", Kind.FOREIGN, (0.0, 0.0, 10.0)),
        ("$N0=G20 G91", Kind.FOREIGN, (math.nan,) * 3),
        ("$C", Kind.FOREIGN, (math.nan,) * 3),
        ("$#", Kind.FOREIGN, (0.0, 0.0, 10.0)),
    ],
)
def test_what_moves_the_origin_or_is_not_understood_is_one_row_with_the_place_that_is_then_known(
    line: str, kind: Kind, after: tuple[float, float, float]
) -> None:
    """An axis is NaN until it is programmed again; a block that is not understood has a reason.

    A tool length that is in no register (G43.1, G43.2) also has its own row.
    """
    program = run(line, "G90 G17 G0 X1", "Y1 Z1")
    check_structure(program)
    assert kinds(program, 4) == [kind, *[Kind.OFFSET for _ in "1" if line[:5] in ("G43.1", "G43.2")]]
    assert np.array_equal(program.path.end[program.first[4]], after, equal_nan=True)
    assert (4 in program.fixed) == (kind is Kind.FOREIGN)
    assert place(program)[1:] == [1.0, 1.0]


@pytest.mark.parametrize(("switch", "known"), [("M5", True), ("S900 M3", False)])
def test_a_new_range_of_the_spindle_speed_keeps_the_state_only_if_the_spindle_is_off(switch: str, known: bool) -> None:
    program = run(switch, "$30=12000", "G1 X5")
    assert bool(np.isfinite(program.path.end[program.first[5]]).all()) is known
    assert program.modal(6).radius == (40 if known else -40)


@pytest.mark.parametrize("line", ["G38.3 Z1", "G33 Z1 K1", "G88 X1 Z1 R1", "G5.2 X1 Y1 P1 L3", "G150 X1"])
def test_a_motion_that_is_not_understood_stays_active_until_another_one(line: str) -> None:
    """`X5` after a probe would probe again: it is kept, too."""
    program = run(line, "X5 Y5", "M8", "G1 X6 Y6 Z0", "X7")
    assert [kinds(program, b) for b in range(4, 9)] == [
        [Kind.FOREIGN],
        [Kind.FOREIGN],
        [Kind.COOLANT],
        [Kind.FEED],
        [Kind.FEED],
    ]


def test_all_between_a_rotation_and_its_end_is_kept() -> None:
    """G68 turns what follows: its moves are not where they say; G69 ends it."""
    program = run("G69 G50 G15", "G68 X0 Y0 R30", "G0 X5", "G1 X6 Y7 Z1", "M8", "G69", "G0 X1 Y1 Z1", words="linuxcnc")
    assert [kinds(program, b) for b in range(4, 11)] == [
        [],
        [Kind.FOREIGN],
        [Kind.FOREIGN],
        [Kind.FOREIGN],
        [Kind.COOLANT],
        [Kind.SHIFT],
        [Kind.RAPID],
    ]
    assert place(program) == [1.0, 1.0, 1.0]


def test_q_of_g64_is_for_short_moves_and_is_p_where_it_is_not_said() -> None:
    program = run("G64 P0.1", "G64 P0.1 Q0.02", "G64 Q0.02 P0.1", "G64 P0.1")
    rows = program.path.kind == Kind.BLENDING
    assert program.path.value[rows].tolist() == [0.1, 0.1, 0.1]
    assert program.path.end[rows, 0].tolist() == [0.1, 0.02, 0.1]


def test_only_a_change_of_the_mode_is_a_row() -> None:
    """G54 and G40 at the start of every operation, and the same G64 again, divide nothing."""
    program = run("G54 G40 G64 P0.1", "G54 G40 G64 P0.1", "G41 D1", "G40", "G40")
    assert [kinds(program, b) for b in range(4, 9)] == [[Kind.BLENDING], [], [Kind.RADIUS], [Kind.RADIUS], []]
    assert program.path.ref[program.path.kind == Kind.RADIUS].tolist() == [41, 40]


def test_another_length_offset_leaves_the_height_open() -> None:
    """How long the next tool is, the program does not say: Z is not known before it is programmed again."""
    program = run("T1 M6", "G43 H1", "X5", "Z3", "G43 H1", "X6", "G49", "X7", "G98 G81 X8 Z-1 R1")
    rows = program.path.end[program.path.kind == Kind.RAPID][-4:, 2]
    assert np.array_equal(rows, [math.nan, 3.0, 3.0, math.nan], equal_nan=True)
    assert kinds(program, -1) == [Kind.FOREIGN]
    assert "height" in program.fixed[program.n_blocks - 1]


def test_blocks_that_depend_on_more_than_their_text_are_fixed() -> None:
    """Loops, subprograms, conditions, settings, switches, messages; others, and what reads parameters, are not."""
    program = run(
        "o1 repeat [2]",
        "G1 X1",
        "o1 endrepeat",
        "G1 X2",
        "#1=3",
        "X#1",
        "X[3+1]",
        "/X5",
        "/2 X6",
        "X7 (MSG, look)",
        "(debug, here)",
        "(a remark)",
        "M98 P7",
        "X8",
        "M2",
        "O7",
        "X9",
        "M99",
    )
    check_structure(program)
    plain = [int(program.line[b]) for b in range(4, program.n_blocks) if b not in program.fixed]
    assert plain == [8, 10, 11, 18, 19]
    assert program.line.tolist()[4:9] == [5, 6, 7, 6, 7]
    reasons = {int(program.line[b]): reason for b, reason in program.fixed.items()}
    assert "loop" in reasons[6] and "parameters" in reasons[9]
    assert "switch" in reasons[12] and "switch" in reasons[13] and "message" in reasons[14] and 16 not in reasons
    assert program.last_line == 19
    assert program.path.end[program.path.kind == Kind.FEED, 0].tolist() == [1, 1, 2, 3, 4, 5, 6, 7, 9, 8]


def test_lines_that_are_jumped_over_stand_between_fixed_blocks() -> None:
    """A subroutine's text and the branch not taken have no blocks, but their first and last O-words have."""
    program = run("o1 sub", "G1 X1", "o1 endsub", "o2 if [0]", "G1 X2", "o2 else", "G1 X3", "o2 endif", "G1 X4", "M2")
    lines = program.line.tolist()[4:]
    assert lines == [5, 7, 8, 11, 12, 13, 14]
    assert {5, 7, 8, 12} <= {int(program.line[b]) for b in program.fixed}


def test_the_dwell_of_a_tap_without_its_own_is_that_of_the_cycle_before() -> None:
    """Elsewhere it would dwell otherwise: it is fixed, but not one with its own P."""
    program = run("M3 S100", "G82 X1 Z-1 R1 P0.5", "G84 X2 Z-1 R1", "G84 X3 Z-1 R1 P0.2")
    assert [b - 4 for b in program.fixed] == [2]


def test_a_safe_start_line_may_have_g80_beside_a_motion() -> None:
    """`G0 G17 G40 G49 G80 G90`, as many posts write it, in all dialects; G0 is then active."""
    for words in ("linuxcnc", "grbl", "haas"):
        program = interpret_program("G21\nG0 G17 G40 G49 G69 G80 G90\nX1. Y2. Z3.\n", load_dialect(words))
        assert place(program) == [1.0, 2.0, 3.0]


def test_the_units_may_be_given_for_a_program_that_does_not_state_them() -> None:
    """Without, its first length is an error; with them, that is what it is in."""
    with pytest.raises(ReadError, match="before the units"):
        interpret_program("G0 X1\n", load_dialect("grbl"))
    assert place(interpret_program("G0 X1 Y1 Z1\n", load_dialect("grbl"), units="in")) == [25.4, 25.4, 25.4]


def test_fanuc_programs_with_subprograms_repeats_and_stored_cycles() -> None:
    """O-numbers, M98 with L, K0 that only stores, G91 G28 beside G0, M5 at the end of its block."""
    text = (
        "%\nO1000 (PART)\nG21 G17 G40 G49 G80\nG0 G90 X0. Y0. Z20.\nS1000 M3\nG99 G81 Z-3. R1. F100. K0\nM98 P2000 L2\n"
        "G80\nG0 G91 G28 Z0. M5\nM30\nO2000\nG90 X10. Z-3. R1.\nG91 X5. Z-4. R-19. K2\nM99\n%\n"
    )
    program = interpret_program(text, load_dialect("fanuc"))
    check_structure(program)
    drilled = program.path.end[program.path.kind == Kind.DRILL, 0].tolist()
    assert drilled == [10.0, 15.0, 20.0, 10.0, 15.0, 20.0]
    assert kinds(program, -2) == [Kind.MACHINE, Kind.SPINDLE]
    assert program.last_line == 10


def test_a_length_that_a_controller_may_take_for_thousandths_is_refused_but_not_what_a_macro_computes() -> None:
    """The dialect requires a decimal point in written numbers."""
    for unit, least in (("G21", "X0.05"), ("G20", "X0.005")):
        said = f":2: X50 has no decimal point, so .* whether it means X50.0 or {least}; write it with a decimal point"
        with pytest.raises(ReadError, match=said):
            interpret_program(f"{unit} G0\nX50\n", load_dialect("haas"))
    assert place(interpret_program("G21 G0 #1=3.\nX#1 Y[1+1] Z1.\n", load_dialect("haas"))) == [3.0, 2.0, 1.0]


def test_a_hole_after_a_change_of_g90_inside_its_cycle_is_kept() -> None:
    """Controllers differ in the meaning of the old R and Z; repeated values are unambiguous."""
    program = run("G99 G81 X1 Y1 Z-2 R3", "G91 X5", "X5 Z-4 R-1", "G80", "G90 G0 X0 Y0 Z5", "G81 X1 Z-1 R2")
    assert [kinds(program, b) for b in (4, 5, 6, 9)] == [[Kind.DRILL], [Kind.FOREIGN], [Kind.FOREIGN], [Kind.DRILL]]


def test_bolt_circles_of_haas_are_not_units() -> None:
    """G70 and G71 are units elsewhere; G7x with words of its own is kept."""
    program = interpret_program("G21 G90 G0 X0. Y0. Z1.\nG70 I5. J15. L6\nG0 X1. Y1. Z2.\n", load_dialect("haas"))
    assert kinds(program, 1) == [Kind.FOREIGN]
    assert place(program) == [1.0, 1.0, 2.0]
    assert place(interpret_program("G70 G90 G0 X1 Y1 Z1\n", load_dialect("grbl"))) == [25.4, 25.4, 25.4]


def test_m99_in_the_program_itself_ends_it() -> None:
    """The controller then starts again from the top; a single pass shows everything."""
    program = run("G1 X1", "M99", "G1 X2")
    assert program.path.end[-2, 0] == 1.0 and program.path.kind[-1] == Kind.END


def test_an_empty_program_has_no_blocks() -> None:
    """Nothing but remarks, too."""
    for text in ("", "\n\n", "%\n(nothing)\n%\n", "; x", "(log this)\n(logo)\n", "\x1a", "\0\0\n"):
        program = interpret_program(text, load_dialect("linuxcnc"))
        check_structure(program)
        assert program.n_blocks == 0 and len(program.path) == 0


NUMBER = st.decimals(-50, 50, places=3).map(lambda d: f"{d.normalize():f}")
SMALL = st.sampled_from(["0", "1", ".5", "-2.", "+3", "-0", "00.10"])
PLAIN = st.builds(
    lambda g, gap, words: gap.join(filter(None, [g, *words])),
    st.sampled_from(["", "", "G0", "G1", "g01", "G00", "N7 G1", "N8"]),
    st.sampled_from(["", " "]),
    st.lists(st.builds(lambda a, n: a + n, st.sampled_from("XYZXYzFSs"), NUMBER | SMALL), max_size=4),
)
ROUND = st.builds(
    lambda g, r, axis, sign, f: f"{g}{axis}{2 * r * sign:g}{'I' if axis == 'X' else 'J'}{r * sign:g}{f}",
    st.sampled_from(["G2", "G3", "G03"]),
    st.sampled_from([0.5, 1, 7.25, 40.001]),
    st.sampled_from("XY"),
    st.sampled_from([1, -1]),
    st.sampled_from(["", "F90", "S300", "Z3", "P2", "K1"]),
)
ODD = st.sampled_from(
    [
        "",
        "(a)",
        "G91",
        "G90",
        "G20",
        "G21",
        "G18",
        "G17",
        "G80",
        "F0",
        "M3 S100",
        "M4",
        "M5",
        "G96",
        "G81 X1 Z-1 R1",
        "X5 (b)",
        "G93",
        "G94",
    ]
) | st.sampled_from(
    [
        "G90.1",
        "G91.1",
        "I1",
        "G2",
        "G92 X1",
        "G38.2 Z1",
        "A5",
        "G53 G0 Z0",
        "#1=2",
        "G1 X[#1]",
        "x1y2z3",
        "G4 P1",
        "G1.5",
    ]
)


@settings(max_examples=settings().max_examples * 2)
@given(st.lists(PLAIN | ROUND | ODD, max_size=30), st.sampled_from(["linuxcnc", "grbl-laser", "haas", "fagor8055"]))
def test_an_empty_comment_behind_a_line_changes_nothing(body: list[str], words: str) -> None:
    """Plain lines, which the reader takes apart at once, do bit for bit what the same lines with a comment do."""
    head = "G71 G90 G0 X0. Y0. Z0. F100" if words == "fagor8055" else "G21 G90 G0 X0. Y0. Z0. F100"

    def outcome(comment: str) -> Program | str:
        try:
            return interpret_program("\n".join([head, *(line + comment for line in body)]), load_dialect(words))
        except ReadError as problem:
            return str(problem)

    plain, commented = outcome(""), outcome("()")
    if isinstance(plain, str) or isinstance(commented, str):
        assert plain == commented
        return
    check_structure(plain)
    for name in ("kind", "end", "value", "ref", "line"):
        left, right = getattr(plain.path, name), getattr(commented.path, name)
        assert np.array_equal(left, right, equal_nan=name in ("end", "value"))
    for name in ("arcs", "cycles"):
        assert getattr(plain.path, name) == getattr(commented.path, name)
    assert plain.fixed == commented.fixed
    assert np.array_equal(plain.line, commented.line) and np.array_equal(plain.first, commented.first)
    states = [[p.modal(b) for b in range(p.n_blocks + 1)] for p in (plain, commented)]
    assert states[0] == states[1]


def test_every_line_of_a_lasers_picture_has_its_own_power() -> None:
    """S may precede or follow F."""
    rows = [f"X{0.1 * k:.1f} S{(k * 37) % 1000}" for k in range(50)]
    text = "\n".join(["G21 G90 G0 X0 Y0", "M4 S0", "G1 X1 F3000", *rows, "G1 X9 S20 F900", "G1X0F800S3.5", "S7", "M5"])
    program = interpret_program(text, load_dialect("grbl-laser"))
    cuts = program.path.kind == Kind.FEED
    assert [program.modal(b + 1).rpm for b in range(3, 53)] == [float((k * 37) % 1000) for k in range(50)]
    assert np.array_equal(program.path.value[cuts][-2:] * 60.0, [900.0, 800.0])
    assert program.modal(55).rpm == 3.5 and program.modal(56).rpm == 7.0


def test_the_lines_of_a_program_are_those_of_its_text() -> None:
    """One by one, from the end, in slices and joined, as of a tuple."""
    from leafcut.gcode.program import Lines

    for text in ("", "G0 X1\n", "\n\nG0 X1\r\n(é – 3 µm)\nM2", HEAD):
        plain = tuple(text.splitlines(keepends=True))
        lines = Lines(plain)
        assert (tuple(lines), len(lines), "".join(lines)) == (plain, len(plain), text)
        assert [lines[k] for k in range(-len(plain), len(plain))] == [plain[k] for k in range(-len(plain), len(plain))]
        assert all(lines[a:b] == plain[a:b] for a in range(-2, 5) for b in range(-2, 5))
        assert lines == plain and (not plain or lines != plain[1:])
        with pytest.raises(IndexError):
            lines[len(plain)]


@pytest.mark.hazard
@pytest.mark.parametrize("words", ["linuxcnc", "grbl", "haas"])
def test_words_after_a_closing_percent_sign_are_refused(words: str) -> None:
    """GRBL and Marlin skip the sign, so a rapid after it is run there."""
    head = "%\nG21 G90\nM3 S1000\nG0 X10. Y10.\n"
    for sign in ("%", "% note"):
        with pytest.raises(ReadError, match=r"6: the program continues after the percent sign in line 5"):
            interpret_program(f"{head}{sign}\nG0 Z-5.\nM30\n%\n", load_dialect(words))
    for end in ("M30\n%\n", "%\n", "%\n(done)\n\n%\n", "M30\n%\n%\nG0 X5.\nM30\n%\n"):
        assert len(interpret_program(head + end, load_dialect(words)).path) > 0


@pytest.mark.parametrize(
    "between, taken",
    [("X5", 1), ("T2 M6", 2), ("M0", 2), ("G10 L1 P1 Z2", 2), ("G53 G0 Z0", 2), ("G28", 2), ("G49", 3)],
)
def test_a_length_offset_taken_again_changes_nothing(between: str, taken: int) -> None:
    """If the tool, the table or the active offset may have changed, the height becomes unknown."""
    program = run("T1 M6", "G43 H1", "Z3", between, "G43 H1", "X6")
    assert np.count_nonzero(program.path.kind == Kind.OFFSET) == taken
