"""Whole programs in the languages of Heidenhain and Siemens, checked against their manuals by hand, and refusals."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from leafcut.errors import PostError
from leafcut.gcode.dialects import load_dialect
from leafcut.model.toolpath import Arc, DrillCycle, ToolpathBuilder
from leafcut.options import PostOptions
from leafcut.post.row_writer import Blocks
from leafcut.post.words import NumberFormat, coolant_words, cycle_words, dwell_word, format_peck, supports_cycle
from leafcut.post.writer import write_program

G81 = DrillCycle("G81", 2.0, -5.0)


def text_of(builder: ToolpathBuilder, name: str, *, header: tuple[str, ...] = (), names: bool = False) -> list[str]:
    builder.end()
    tools = {1: "drill 5 mm"} if names else {}
    return write_program(builder.build(), load_dialect(name), PostOptions(), header, tool_names=tools).splitlines()


def begun() -> ToolpathBuilder:
    builder = ToolpathBuilder()
    builder.tool(1)
    builder.rapid(z=50.0)
    builder.spindle(1500.0)
    builder.dwell(1.5)
    builder.coolant(2)
    builder.rapid(10.0, 5.0)
    return builder


def cycle_200(clearance: str, depth: str, feed: str, peck: str, surface: str, second: str) -> list[str]:
    return [
        f"  Q200={clearance} ;SET-UP CLEARANCE ~", f"  Q201={depth} ;DEPTH ~", f"  Q206={feed} ;FEED RATE FOR PLNGNG ~",
        f"  Q202={peck} ;PLUNGING DEPTH ~", "  Q210=+0 ;DWELL TIME AT TOP ~",
        f"  Q203={surface} ;SURFACE COORDINATE ~", f"  Q204={second} ;2ND SET-UP CLEARANCE ~",
        "  Q211=+0 ;DWELL TIME AT DEPTH",
    ]  # fmt: skip


def test_a_klartext_program_defines_each_cycle_once_and_calls_it_at_each_hole() -> None:
    """A cycle that would start below its R plane is written as moves. Above 0, the surface is half-way."""
    b = begun()
    b.drill(10.0, 5.0, G81, feed=2.0)
    b.drill(20.0, 5.0, G81, feed=2.0)
    b.drill(20.0, -6.0, G81, feed=3.0)
    b.drill(30.0, -6.0, DrillCycle("G82", 2.0, -7.5, True, 0.0, 0.5), feed=3.0)
    b.rapid(z=20.0)
    b.drill(0.0, 0.0, DrillCycle("G81", 12.0, 4.0), feed=3.0)
    b.rapid(z=50.0)
    b.rapid(1.0, 2.0)
    b.rapid(z=1.0)
    b.feed(z=-1.0, feed=1.0)
    b.feed(3.0, 4.0, feed=10.0)
    b.rapid(z=50.0)
    b.spindle(0.0)
    b.coolant(0)
    b.tool(2)
    b.rapid(z=50.0)
    b.spindle(-800.0)
    b.pause()
    b.pause(True)
    b.rapid(0.0, 0.0)
    b.spindle(0.0)
    assert text_of(b, "heidenhain", header=("plate.dxf", "second (line)"), names=True) == [
        "0 BEGIN PGM LEAFCUT MM",
        "1 BLK FORM 0.1 Z X-1 Y-7 Z-8.5",
        "2 BLK FORM 0.2 X+31 Y+6 Z+51",
        "3 ; plate.dxf",
        "4 ; second [line]",
        "5 ; Each tool's length must be in the tool table. BLK FORM is only the",
        "6 ; picture on the screen.",
        "7 ; Cycle 200 has Q211 here: controls older than the TNC 426 of",
        "8 ; software 280 476 do not know it.",
        "9 ; T1 drill 5 mm",
        "10 TOOL CALL 1 Z S1500",
        "11 L Z+50 R0 FMAX",
        "12 M3",
        "13 CYCL DEF 9.0 DWELL TIME",
        "14 CYCL DEF 9.1 DWELL 1.5",
        "15 M8",
        "16 L X+10 Y+5 R0 FMAX",
        "17 CYCL DEF 200 DRILLING ~",
        *cycle_200("+2", "-5", "120", "+5", "+0", "+2"),
        "18 L X+10 Y+5 R0 FMAX M99",
        "19 L X+20 R0 FMAX M99",
        "20 CYCL DEF 200 DRILLING ~",
        *cycle_200("+2", "-5", "180", "+5", "+0", "+2"),
        "21 L X+20 Y-6 R0 FMAX M99",
        "22 L X+30 R0 FMAX",
        "23 L Z-7.5 R0 F180",
        "24 CYCL DEF 9.0 DWELL TIME",
        "25 CYCL DEF 9.1 DWELL 0.5",
        "26 L Z+50 R0 FMAX",
        "27 L Z+20 R0 FMAX",
        "28 CYCL DEF 200 DRILLING ~",
        *cycle_200("+4", "-4", "180", "+4", "+8", "+4"),
        "29 L X+0 Y+0 R0 FMAX M99",
        "30 L Z+50 R0 FMAX",
        "31 L X+1 Y+2 R0 FMAX",
        "32 L Z+1 R0 FMAX",
        "33 L Z-1 R0 F60",
        "34 L X+3 Y+4 R0 F600",
        "35 L Z+50 R0 FMAX",
        "36 M5",
        "37 M9",
        "38 ; T2",
        "39 TOOL CALL 2 Z S800",
        "40 L Z+50 R0 FMAX",
        "41 M4",
        "42 M0",
        "43 M1",
        "44 L X+0 Y+0 R0 FMAX",
        "45 M5",
        "46 M30",
        "47 END PGM LEAFCUT MM",
    ]


def test_a_klartext_dwell_cycle_has_its_dwell_and_returns_to_its_height() -> None:
    b = begun()
    b.drill(10.0, 5.0, DrillCycle("G82", 2.0, -7.5, True, 0.0, 0.5), feed=3.0)
    lines = text_of(b, "heidenhain")
    assert "  Q204=+50 ;2ND SET-UP CLEARANCE ~" in lines and "  Q211=+0.5 ;DWELL TIME AT DEPTH" in lines


def test_a_siemens_program_calls_its_cycles_modally_and_ends_each_with_mcall() -> None:
    """Pecks of 4 mm from the R plane 2: to -2 first. A peck deeper than the hole: to its bottom at once."""
    b = begun()
    for cycle, feed in (
        (G81, 2.0),
        (DrillCycle("G82", 2.0, -5.0, False, 0.0, 0.25), 2.0),
        (DrillCycle("G83", 2.0, -10.0, False, 4.0), 2.5),
    ):
        b.drill(10.0, 5.0, cycle, feed=feed)
        b.drill(10.0, 7.0, cycle, feed=feed)
    b.rapid(z=20.0)
    b.drill(10.0, 5.0, DrillCycle("G73", 2.0, -10.0, True, 20.0), feed=2.5)
    b.rapid(z=25.0)
    b.machine(z=0.0)
    b.rapid(z=30.0)
    b.rapid(0.0, 0.0)
    b.machine(x=1.0, z=-5.0)
    b.tool(2)
    b.rapid(z=20.0)
    assert text_of(b, "siemens")[:-1] == [
        "G710",
        "G17 G90 G40",
        "G94 G54",
        "; T1",
        'T="1"',
        "M6",
        "G0 D1 Z50",
        "S1500 M3",
        "G4 F1.5",
        "M8",
        "X10 Y5",
        "F120",
        "MCALL CYCLE81(2,2,0,-5)",
        "G0 X10 Y5",
        "Y7",
        "MCALL",
        "MCALL CYCLE82(2,2,0,-5,,0.25)",
        "G0 X10 Y5",
        "Y7",
        "MCALL",
        "F150",
        "MCALL CYCLE83(2,2,0,-10,,-2,,0,0,0,1,1)",
        "G0 X10 Y5",
        "Y7",
        "MCALL",
        "G0 Z20",
        "MCALL CYCLE83(20,2,0,-10,,-10,,0,0,0,1,0)",
        "G0 X10 Y5",
        "MCALL",
        "G0 Z25",
        "G0 SUPA Z0 D0",
        "D1 Z30",
        "X0 Y0",
        "G0 SUPA X1 Z-5 D0",
        "; T2",
        'T="2"',
        "M6",
        "G0 D1 Z20",
    ]


def arc(b: ToolpathBuilder) -> None:
    b.rapid(z=1.0)
    b.arc(True, (12.0, 5.0, 1.0), Arc((11.0, 5.0, 1.0)), feed=1.0)


@pytest.mark.parametrize(
    ("name", "moves", "message"),
    [
        ("heidenhain", arc, "heidenhain: leafcut writes only drilling programs in this language, not arcs"),
        (
            "heidenhain",
            lambda b: b.machine(z=0.0),
            "heidenhain: leafcut writes only drilling programs in this language, not moves to machine zero",
        ),
        (
            "heidenhain",
            lambda b: b.torch(True),
            "heidenhain: leafcut writes only drilling programs in this language, not torch",
        ),
        ("heidenhain", lambda b: b.tool(2), "a tool is called while the spindle is running; stop it first"),
        (
            "heidenhain",
            lambda b: b.spindle(1600.0),
            "heidenhain: each tool has a single speed here, set by its TOOL CALL",
        ),
        (
            "heidenhain",
            lambda b: (b.spindle(0.0), b.tool(2), b.rapid(1.0, 2.0, 3.0)),
            "at the start, and after a change of tool, the first move must be in Z only",
        ),
        ("linuxcnc", lambda b: b.torch(True), "linuxcnc programs cannot state TORCH"),
        (
            "linuxcnc",
            lambda b: (b.tool(2), b.rapid(1.0, 2.0)),
            "the toolpath moves in X or Y while the height of the tool is unknown; at the start, and after a change "
            "of tool, the first move must be in Z only",
        ),
        (
            "linuxcnc",
            lambda b: (b.tool(2), b.feed(z=1.0, feed=1.0)),
            "the toolpath cuts before the height of the tool is known; at the start, and after a change of tool, the "
            "first move must be a rapid in Z alone",
        ),
        (
            "linuxcnc",
            lambda b: b.drill(1.0, 2.0, DrillCycle("G83", 2.0, -5.0), feed=1.0),
            "G83 needs a peck depth",
        ),
        (
            "linuxcnc",
            lambda b: b.drill(1.0, 2.0, DrillCycle("G83", 2.0, 1.999, peck=0.0004), feed=1.0),
            "a peck of 0.0004 mm is too small to write; use a larger peck",
        ),
        ("linuxcnc", lambda b: b.dwell(-1.0), "a dwell of -1 s is out of range"),
        ("linuxcnc", lambda b: b.dwell(float("nan")), "a dwell of nan s is out of range"),
        (
            "linuxcnc",
            lambda b: b.arc(True, (10.001, 5.0, 50.0), Arc((11.0, 5.0, 1.0)), feed=1.0),
            "the ends of an arc are less than two units of the last decimal place apart",
        ),
        (
            "grbl",
            lambda b: b.drill(1.0, 2.0, DrillCycle("G84", 2.0, -5.0), feed=1.0),
            "grbl has no tapping cycle (G84) known to leafcut, and tapping cannot be written as plain moves; leave the "
            "tapped holes out, or choose another machine",
        ),
    ],
)  # fmt: skip
def test_what_a_controller_cannot_do_is_refused_with_the_reason(
    name: str, moves: Callable[[ToolpathBuilder], object], message: str
) -> None:
    b = begun()
    moves(b)
    with pytest.raises(PostError) as refused:
        text_of(b, name)
    assert str(refused.value) == message


def test_coolant_words_state_what_is_switched() -> None:
    linuxcnc = load_dialect("linuxcnc")
    assert [coolant_words(mode, 0, linuxcnc) for mode in (0, 1, 2, 3)] == [["M9"], ["M7"], ["M8"], ["M7", "M8"]]
    assert coolant_words(3, 1, linuxcnc) == ["M7", "M8"] and coolant_words(0, 3, linuxcnc) == ["M9"]
    for mode, before in ((1, 3), (2, 3), (1, 2)):
        with pytest.raises(PostError) as refused:
            coolant_words(mode, before, linuxcnc)
        text = "a single coolant cannot be switched off while two are on; switch off both first"
        assert str(refused.value) == text


def test_a_controller_without_mist_refuses_it() -> None:
    without = next(d for d in map(load_dialect, ("grbl", "haas", "fanuc", "siemens")) if 7 not in d.m_codes)
    with pytest.raises(PostError) as refused:
        coolant_words(1, 0, without)
    assert str(refused.value) == f"{without.name} has no M7 (mist)"


@pytest.mark.parametrize(
    ("name", "seconds", "word"),
    [
        ("linuxcnc", 1.25, "P1.25"), ("linuxcnc", 0.0, "P0"), ("linuxcnc", 0.0004, "P0"), ("fanuc", 1.2345, "P1234"),
        ("fagor8055", 1.25, "K125"), ("haas", 2.0, "P2."), ("siemens", 1.5, "F1.5"),
    ],
)  # fmt: skip
def test_a_dwell_is_in_the_unit_of_the_controller(name: str, seconds: float, word: str) -> None:
    assert dwell_word(seconds, load_dialect(name)) == word


def test_cycles_have_their_words_in_order() -> None:
    mm = NumberFormat(False, 3, False)
    linuxcnc, fagor = load_dialect("linuxcnc"), load_dialect("fagor8055")
    assert cycle_words(G81, mm, linuxcnc) == ("G81", ["Z-5", "R2"])
    assert cycle_words(DrillCycle("G82", 2.0, -5.0, dwell=0.5), mm, linuxcnc) == ("G82", ["Z-5", "R2", "P0.5"])
    assert cycle_words(DrillCycle("G83", 2.0, -5.0, peck=3.0), mm, linuxcnc) == ("G83", ["Z-5", "R2", "Q3"])
    assert cycle_words(DrillCycle("G73", 2.0, -5.0, peck=3.0), mm, linuxcnc) == ("G73", ["Z-5", "R2", "Q3"])
    assert cycle_words(DrillCycle("G84", 2.0, -5.0), mm, linuxcnc) == ("G84", ["Z-5", "R2", "P0"])
    assert cycle_words(DrillCycle("G85", 2.0, -5.0), mm, linuxcnc) == ("G85", ["Z-5", "R2"])
    assert cycle_words(DrillCycle("G82", 2.0, -5.0, dwell=0.5), mm, fagor) == ("G81", ["Z2", "I-5", "K50"])
    assert cycle_words(G81, mm, fagor) == ("G81", ["Z2", "I-5"])
    assert [supports_cycle(DrillCycle(n, 2.0, -5.0, peck=1.0), load_dialect("grbl")) for n in ("G81", "G83")] == [
        False,
        False,
    ]
    assert supports_cycle(DrillCycle("G84", 2.0, -5.0, dwell=1.0), linuxcnc)


@pytest.mark.parametrize(
    ("peck", "text"),
    [(4.0, "4"), (10 / 3, "3.334"), (12.0, "12"), (5.9999, "6"), (1.42856, "1.428"), (1.4281, "1.428")],
)
def test_a_peck_is_rounded_to_the_same_number_of_pecks(peck: float, text: str) -> None:
    """From R2 to Z-8 are 10 mm."""
    cycle = DrillCycle("G83", 2.0, -8.0, peck=peck)
    assert format_peck(cycle, NumberFormat(False, 3, False)) == text


def test_blocks_leave_out_active_words_and_number_their_lines() -> None:
    out = Blocks(load_dialect("linuxcnc"), numbered=True)
    out.write(out.activate_modal_word("motion", "G0"), "", "X1")
    out.write(out.activate_modal_word("motion", "G0"))
    out.write(out.activate_modal_word("motion", "G1"), "X2")
    out.forget_modal_words(["motion", "unknown"])
    out.write(out.activate_modal_word("motion", "G1"), "X3")
    out._number = 99_980
    out.write("X4")
    out.write("X5")
    out.write_comment("a note")
    assert out.lines == ["N10 G0 X1", "N20 G1 X2", "N30 G1 X3", "N99990 X4", "N10 X5", "(a note)"]
    limit = load_dialect("linuxcnc").max_line
    plain = Blocks(load_dialect("linuxcnc"), numbered=False)
    plain.write("X" * limit)
    with pytest.raises(PostError) as refused:
        plain.write("X" * (limit + 1))
    assert str(refused.value) == f"a block is longer than linuxcnc accepts: {'X' * 60}…"


def test_a_controller_with_one_command_per_line_repeats_the_motion() -> None:
    single = next(d for d in map(load_dialect, ("marlin", "rrf", "grbl")) if d.one_command)
    out = Blocks(single, numbered=False)
    out.write("G90", "M3", "S5", out.activate_modal_word("motion", "G0"), "X1")
    out.write(out.activate_modal_word("motion", "G0"), "X2")
    out.write(out.activate_modal_word("F", "F5"), out.activate_modal_word("F", "F5"))
    assert out.lines == ["G90", "M3", "G0 S5 X1", "G0 X2", "F5"]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        (
            "heidenhain",
            PostOptions(output_units="inch"),
            "--output-units inch: heidenhain programs are in millimetres; leave it out",
        ),
        (
            "rrf",
            PostOptions(line_numbers=True),
            "--line-numbers: rrf does not support block numbers; leave it out",
        ),
    ],
)
def test_units_and_numbers_that_a_controller_lacks_are_refused(name: str, options: PostOptions, message: str) -> None:
    builder = begun()
    builder.end()
    assert write_program(builder.build(), load_dialect(name), PostOptions(output_units="mm"))
    with pytest.raises(PostError) as refused:
        write_program(builder.build(), load_dialect(name), options)
    assert str(refused.value) == message


def test_a_toolpath_has_one_end() -> None:
    builder = begun()
    builder.end()
    builder.rapid(z=60.0)
    for path, message in (
        (begun().build(), "the toolpath has no end (Kind.END)"),
        (builder.build(), "the toolpath continues after its end"),
    ):
        with pytest.raises(PostError) as refused:
            write_program(path, load_dialect("linuxcnc"), PostOptions())
        assert str(refused.value) == message


def test_the_next_tool_is_named_after_each_change_if_that_is_asked_for() -> None:
    builder = ToolpathBuilder()
    for number in (4, 7, 5):
        builder.tool(number)
        builder.rapid(z=10.0 + number)
    builder.end()
    for preselect, following in ((False, []), (True, ["T7", "T5"])):
        text = write_program(builder.build(), load_dialect("haas"), PostOptions(), preselect_tool=preselect)
        lines = text.splitlines()
        assert [line for line in lines if line in ("T4", "T7", "T5")] == following
        assert [line for line in lines if "M6" in line] == ["T4 M6", "T7 M6", "T5 M6"]
        assert not preselect or lines.index("T4 M6") < lines.index("T7") < lines.index("T7 M6") < lines.index("T5")


@pytest.mark.parametrize(
    ("name", "header", "head"),
    [
        ("fagor8055", ("Plate (a).dxf x", "b"), ["%PLATE A.DXF X,MX,", "(Plate [a].dxf x)", "(b)"]),
        ("fagor8055", ("a very long name of a plate",), ["%A VERY LONG NAME OF,MX,", "(a very long name of a plate)"]),
        ("fagor8055", (), ["%LEAFCUT,MX,", "G71"]),
        ("fanuc", ("Plate (a).dxf",), ["%", "O0001 (PLATE [A].DXF)", "(PLATE [A].DXF)"]),
        ("fanuc", ("n" * 40,), ["%", f"O0001 ({'N' * 32})", f"({'N' * 40})"]),
        ("fanuc", (), ["%", "O0001", "G21"]),
    ],
)
def test_a_program_starts_with_its_title_as_the_controller_reads_it(
    name: str, header: tuple[str, ...], head: list[str]
) -> None:
    """A Fagor has a name of 20 characters at most after the %, a Fanuc a number and a comment of 32."""
    builder = ToolpathBuilder()
    builder.rapid(z=1.0)
    lines = text_of(builder, name, header=header)
    assert lines[: len(head)] == head
    assert (lines[-1] == "%") is (name == "fanuc")
