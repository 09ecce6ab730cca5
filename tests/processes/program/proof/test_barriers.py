"""Barriers of a program in full, the dwells that belong to them, and the pairs of barriers of two programs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.gcode.block_description import BlockDescription
from leafcut.model.difference import Difference
from leafcut.model.toolpath import Kind
from leafcut.processes.program.proof.barriers import (
    MESSAGE,
    OBEYED,
    SKIPPED,
    Barrier,
    BarrierGroup,
    compare_barrier_groups,
    compare_unreached_settings,
    find_misplaced_barriers,
    group_barriers,
)
from leafcut.processes.program.proof.program_work import read_work
from rewriting import program_of

NAN = math.nan
HEAD = "G21 G90 G17 G40 G94"
TEXT = (
    f"{HEAD} / T3 M6 / M3 S900 / M8 / G0 X1 Y2 Z3 / M0 / G1 Z-1 F60 / M1 / G55 / G54 / G54 / G92 X0 / G10 L2 P1 X5 / "
    "G10 L20 P1 X0 / G53 G0 Z0 / G0 X5 / M0 / G53 G0 Z-5 X1 / M0 / /G0 X9 / (MSG,hello) / M199 P2 / #1=5 / "
    "G10 L2 P2 X[#1] / G43 H3 / G4 P1 / M5 / M9 / G49 / M2"
)
#: Spindle, coolant and radius compensation at a barrier; at the end, whether a length offset is left on.
ON, OFF = (1, 2, 40, False), (0, 0, 40, False)
#: Units, distance mode, work offset, length offset and tool, which a shift of the origin depends on.
SHIFTED = (1.0, False, 540, 0, 3)

#: Line, what, place, and the text of each barrier.
MARKS: list[tuple[int, tuple[object, ...], tuple[float, float, float], str]] = [
    (2, (Kind.TOOL, 3, "", (), (), *OFF), (NAN, NAN, NAN), "change to tool 3"),
    (6, (Kind.PAUSE, 0, "", (), (), *ON), (1, 2, 3), "pause M0"),
    (8, (Kind.PAUSE, 1, "", (), (), *ON), (1, 2, -1), "pause M1"),
    (9, (Kind.FRAME, 550, "", (), (), *ON), (1, 2, -1), "work offset G55"),
    (10, (Kind.FRAME, 540, "", (), (), *ON), (NAN, NAN, NAN), "work offset G54"),
    (12, (Kind.SHIFT, 0, "G92 X0", SHIFTED, (), *ON), (NAN, NAN, NAN), "G92X0"),
    (13, (Kind.SHIFT, 0, "G10 L2 P1 X5", SHIFTED, (), *ON), (0, NAN, NAN), "G10L2P1X5"),
    (14, (Kind.SHIFT, 0, "G10 L20 P1 X0", SHIFTED, (), *ON), (NAN, NAN, NAN), "G10L20P1X0"),
    (15, (Kind.MACHINE, 0, "", (), (0.0,), *ON), (0, NAN, NAN), "rapid in machine coordinates to Z0.000"),
    (17, (Kind.PAUSE, 0, "", (), (), *ON), (5, NAN, NAN), "pause M0"),
    (18, (Kind.MACHINE, 0, "", (), (1.0, -5.0), *ON), (5, NAN, NAN), "rapid in machine coordinates to X1.000 Z-5.000"),
    (19, (Kind.PAUSE, 0, "", (), (), *ON), (NAN, NAN, NAN), "pause M0"),
    (20, (SKIPPED, "/ G0 X9"), (NAN, NAN, NAN), "/G0 X9"),
    (21, (MESSAGE, "MSG,hello"), (NAN, NAN, NAN), "(MSG,hello)"),
    (22, (Kind.FOREIGN, 0, "M199 P2", None, (), *ON), (9, NAN, NAN), "M199P2"),
    (24, (Kind.SHIFT, 0, "G10 L2 P2 X5", SHIFTED, (), *ON), (9, NAN, NAN), "G10L2P2X[#1] = G10 L2 P2 X5"),
    (26, (Kind.DWELL, "head", False, 1.0, 1, 2), (9, NAN, NAN), "dwell of 1 s"),
    (30, (Kind.END, 0, "M2", (), (), *OFF), (9, NAN, NAN), "end of program M2"),
]


def marks_of(text: str) -> list[Barrier]:
    return read_work(program_of(text), written_out=False, beam=False).marks


def test_each_barrier_has_its_values_place_and_text() -> None:
    found = marks_of(TEXT)
    whole = [(*mark.values[:3], None, *mark.values[4:]) if mark.kind == Kind.FOREIGN else mark.values for mark in found]
    whole = [tuple(v.text if isinstance(v, BlockDescription) else v for v in what) for what in whole]
    assert [(mark.line, what, mark.text) for mark, what in zip(found, whole, strict=True)] == [
        (line, what, said) for line, what, _, said in MARKS
    ]
    np.testing.assert_array_equal([mark.place for mark in found], [place for _, _, place, _ in MARKS])
    assert [mark.kind for mark in found] == [what[0] for _, what, _, _ in MARKS]
    # A block that sets an offset from the tool position, and an unknown one, need the same position.
    assert [mark.line for mark in found if mark.fixed_place] == [12, 14, 22]
    # The height is unknown before the first move and after changes of the origin; at machine zero it is high.
    assert [mark.line for mark in found if mark.height_unknown] == [2, 10, 12, 13, 14, 18, 19, 22, 24, 30]
    assert [mark.key for mark in found if mark.key % 1] == [16.5, 17.5]


def test_an_unknown_block_depends_on_the_whole_state() -> None:
    """F and S of the block itself replace the feed and the speed."""
    (known,) = (mark.values[3] for mark in marks_of(TEXT) if mark.kind == Kind.FOREIGN)
    assert isinstance(known, tuple)
    for old, new, count in (
        ("F60", "F70", 1),
        ("S900", "S800", 1),
        ("G94", "G95", 1),
        ("M8", "M7", 1),
        ("G17", "G18", 1),
    ):
        (other,) = (mark.values[3] for mark in marks_of(TEXT.replace(old, new, 1)) if mark.kind == Kind.FOREIGN)
        assert isinstance(other, tuple) and len(other) == len(known)
        assert sum(a != b for a, b in zip(known, other, strict=True)) == count, old
    text = f"{HEAD} / M3 S900 / G0 X1 Y2 Z3 / G1 Z-1 F60 / G5.4 X3"
    for word, old, new in (("F9", "F60", "F70"), ("S9", "S900", "S800")):
        own = [marks_of(f"{one} {word} / M2")[0].values for one in (text, text.replace(old, new))]
        assert own[0] == own[1] != marks_of(f"{text} / M2")[0].values
    assert marks_of(f"{text} F9 / M2")[0].values != marks_of(f"{text.replace('S900', 'S800')} F9 / M2")[0].values


def test_a_text_that_ends_without_m2_has_an_end_with_a_length_offset_left_on() -> None:
    (mark,) = marks_of("G21 / G0 X1 / G43 H2")
    assert (mark.values, mark.line) == ((Kind.END, -1, "", (), (), 0, 0, 40, True), 3)
    assert mark.text == "end of the text, without M2 or M30"


CUT = "G0 X1 Y1 / G1 Z-1 F60 / X9"


@pytest.mark.parametrize(
    ("text", "dwells"),
    [
        # By seconds: the barrier before or after, or "cut".
        (f"M0 / G4 P1 / {CUT} / G0 Z5 / M0", ["head"]),
        ("M0 / G0 X1 Y1 / G4 P1 / G1 Z-1 F60 / X9 / G0 Z5 / M0", ["cut"]),
        (f"M0 / G0 Z9 / G4 P1 / G0 Z5 / {CUT} / G0 Z5 / M0", ["head"]),
        ("M0 / G4 P1 / G1 Z-1 F60 / X9 / G0 Z5 / M0", ["cut"]),
        (f"M0 / {CUT} / G0 Z5 / G4 P1 / M0", ["tail"]),
        (f"M0 / {CUT} / G4 P1 / G0 Z5 / M0", ["cut"]),
        (f"M0 / {CUT} / G0 Z5 / G4 P1 / {CUT} / G0 Z5 / M0", ["cut"]),
        ("M0 / G99 G81 X5 Y5 Z-1 R1 F60 / G80 / G4 P1 / M0", ["tail"]),
        ("M0 / G4 P1 / G99 G81 X5 Y5 Z-1 R1 F60 / G80 / M0", ["head"]),
        ("M0 / G0 X5 Y5 / G4 P1 / G99 G81 Z-1 R1 F60 / G80 / M0", ["cut"]),
        ("M0 / G4 P1 / M0", ["head"]),
        ("M0 / G0 X7 / G4 P1 / M0", ["tail"]),
        (f"M0 / G4 P1 / G4 P2 / {CUT} / G4 P3 / G0 Z5 / G4 P4 / G4 P5 / M0", ["head", "head", "cut", "tail", "tail"]),
    ],
)  # fmt: skip
def test_a_dwell_belongs_to_a_barrier_or_to_a_cut(text: str, dwells: list[str]) -> None:
    work = read_work(program_of(f"{HEAD} / M3 S900 / G0 X0 Y0 Z5 / {text} / M2"), written_out=False, beam=False)
    marks = {mark.values[3]: mark.values[1] for mark in work.marks if mark.kind == Kind.DWELL}
    cuts = work.features.of("dwell")[work.features.kind == Kind.DWELL].tolist()
    found: dict[object, object] = {**marks, **dict.fromkeys(cuts, "cut")}
    assert [found[float(k)] for k in range(1, len(dwells) + 1)] == dwells and len(found) == len(dwells)


@pytest.mark.parametrize(("text", "there"), [("M199 / G4 P1 / G0 X5", True), ("M199 / G0 Z9 / G4 P1 / G0 X5", False),
                                             ("M0 / G4 P1 / G0 X5", False)])  # fmt: skip
def test_after_an_unknown_block_it_matters_whether_the_tool_waits_there(text: str, there: bool) -> None:
    (dwell,) = (mark for mark in marks_of(f"{HEAD} / G0 X0 Y0 Z5 / {text} / {CUT} / M2") if mark.kind == Kind.DWELL)
    assert dwell.values == (Kind.DWELL, "head", there, 1.0, 0, 0)


def mark(what: tuple[object, ...], key: float, said: str, place: tuple[float, float, float] = (0, 0, 5)) -> Barrier:
    return Barrier(what, int(what[0]), key, int(key) + 100, place, False, said)  # type: ignore[call-overload]


def tool(number: int, key: float) -> Barrier:
    return mark((Kind.TOOL, number, "", (), (), 0, 0, 40, False), key, f"change to tool {number}")


def stop(key: float, number: int = 0, direction: int = 0, coolant: int = 0) -> Barrier:
    return mark((Kind.PAUSE, number, "", (), (), direction, coolant, 40, False), key, f"pause M{number}")


def wait(key: float, direction: int = 0, place: str = "head") -> Barrier:
    return mark((Kind.DWELL, place, False, 1.0, direction, 0), key, "dwell of 1 s")


def frame(key: float, tenths: int) -> Barrier:
    return mark((Kind.FRAME, tenths, "", (), (), 0, 0, 40, False), key, f"work offset G{tenths / 10:g}")


def message(key: float, said: str) -> Barrier:
    return mark((MESSAGE, said), key, said)


def setting(key: float, said: str) -> Barrier:
    return mark((OBEYED, said), key, said)


def test_barriers_without_work_between_them_are_one_wall() -> None:
    marks = [stop(0), tool(1, 1), stop(5), stop(9)]
    walls = group_barriers(marks, np.array([2, 3, 6, 7], dtype=np.int32))
    assert [(wall.marks, wall.after) for wall in walls] == [
        ((marks[0], marks[1]), 0),
        ((marks[2],), 2),
        ((marks[3],), 4),
    ]
    assert [wall.is_tool_change for wall in walls] == [True, False, False]
    assert walls[0].values == (marks[0].values, marks[1].values)
    assert not BarrierGroup((tool(1, 0), message(1, "(MSG,a)")), 0).is_tool_change
    assert BarrierGroup((tool(1, 0), wait(1), mark((Kind.MACHINE, 0), 2, "home")), 0).is_tool_change


def compared(before: list[tuple[Barrier, int]], after: list[tuple[Barrier, int]]) -> list[object]:
    """Compare walls of a single mark; return the groups, pairs of lines, differences, states and implied changes."""
    found = compare_barrier_groups(
        *([BarrierGroup((mark,), count) for mark, count in side] for side in (before, after))
    )
    pairs = {int(key): int(new.key) for key, new in found.mark_of.items()}
    return [found.before, found.after, pairs, found.differences, found.states, found.implied]


SAME = "the state of the spindle, the coolant or the tasks around"


def test_equal_barriers_are_paired_in_order() -> None:
    before, after = [(stop(1), 2), (stop(4, 1), 5)], [(stop(2), 2), (stop(6, 1), 5)]
    assert compared(before, after) == [[2, 5], [2, 5], {1: 2, 4: 6}, [], [], []]
    assert compared([], []) == [[], [], {}, [], [], []]


@pytest.mark.parametrize(
    ("before", "after", "differences"),
    [
        ([stop(1), stop(2, 1)], [stop(1)], [Difference("missing stop", 102, 0, "'pause M1' is missing")]),
        ([stop(1)], [stop(1), stop(2, 1)], [Difference("extra stop", 0, 102, "'pause M1' is new")]),
        ([stop(1), stop(2, 1)], [stop(3, 1), stop(4)],
         [Difference("order of barriers", 101, 103, "'pause M0' has moved in the order")]),
        ([stop(1)], [frame(3, 550)], [Difference("changed stop", 101, 103, "'pause M0' became 'work offset G55'")]),
        ([message(1, "(MSG,a)")], [message(2, "(MSG,b)")],
         [Difference("changed message", 101, 102, "'(MSG,a)' became '(MSG,b)'")]),
        ([message(1, "M64 P1")], [], [Difference("missing block", 101, 0, "'M64 P1' is missing")]),
        ([mark((SKIPPED, "a"), 1, "/G0")], [], [Difference("missing block", 101, 0, "'/G0' is missing")]),
        ([setting(1, "(o=1)")], [], [Difference("missing setting", 101, 0, "'(o=1)' is missing")]),
        ([mark((Kind.FOREIGN, 0), 1, "M199")], [], [Difference("missing block", 101, 0, "'M199' is missing")]),
        ([wait(1)], [wait(2, place="tail")],
         [Difference("changed dwell", 101, 102, f"{SAME} 'dwell of 1 s' has changed")]),
        ([stop(1), stop(2, 1), stop(3)], [stop(4), stop(5, 30), stop(6)],
         [Difference("changed stop", 102, 105, "'pause M1' became 'pause M30'")]),
        ([mark((Kind.SHIFT, 0), 1, "G92")], [],
         [Difference("missing shift of the origin", 101, 0, "'G92' is missing")]),
        ([mark((Kind.MACHINE, 0), 1, "G53")], [], [Difference("missing machine move", 101, 0, "'G53' is missing")]),
        ([mark((Kind.END, 0), 1, "M2")], [], [Difference("missing end of program", 101, 0, "'M2' is missing")]),
    ],
)  # fmt: skip
def test_barriers_that_differ_are_named(
    before: list[Barrier], after: list[Barrier], differences: list[Difference]
) -> None:
    found = compared([(one, 0) for one in before], [(one, 0) for one in after])
    assert found[3:5] == [differences, []]


@pytest.mark.parametrize(
    ("one", "other", "phrases"),
    [
        (stop(1), stop(2, 0, -1), ["direction of the spindle M5 became M4"]),
        (stop(1, 0, 1), stop(2, 0, 1, 2), ["coolant M9 became M8"]),
        (stop(1), stop(2, 0, 1, 2), ["direction of the spindle M5 became M3", "coolant M9 became M8"]),
        (wait(1), wait(2, 1), ["direction of the spindle M5 became M3"]),
        (mark((Kind.PAUSE, 0, "", (), (), 0, 0, 40, False), 1, "pause M0"),
         mark((Kind.PAUSE, 0, "", (), (), 0, 0, 41, False), 2, "pause M0"), ["radius compensation G40 became G41"]),
    ],
)  # fmt: skip
def test_barriers_that_differ_in_the_state_alone_are_named_with_it(
    one: Barrier, other: Barrier, phrases: list[str]
) -> None:
    noun = "dwell" if one.kind == Kind.DWELL else "stop"
    told = Difference(f"changed {noun}", 101, 102, f"at '{one.text}': {'; '.join(phrases)}")
    differences, states = compared([(one, 0)], [(other, 0)])[3:5]
    assert (differences, [difference for difference, _ in states]) == ([], [told])
    assert [{change.message for change in changes} for _, changes in states] == [set(phrases)]


def test_a_length_offset_left_on_is_another_state() -> None:
    on, off = (mark((Kind.END, 0, "", (), (), 0, 0, 40, left), 1, "M2") for left in (True, False))
    assert compared([(off, 0)], [(on, 0)])[3:5] == [
        [Difference("changed end of program", 101, 101, f"{SAME} 'M2' has changed")],
        [],
    ]


def test_a_removed_tool_change_joins_the_work_on_both_sides() -> None:
    before = [(tool(1, 0), 0), (stop(2), 3), (tool(1, 4), 5), (tool(2, 6), 7), (stop(8), 9)]
    after = [(tool(1, 1), 0), (stop(3), 3), (tool(2, 7), 7), (stop(9), 9)]
    assert compared(before, after) == [[3, 9], [3, 9], {2: 3, 8: 9, 0: 1, 6: 7}, [], [], []]


def test_another_tool_change_is_named_with_the_original_one_to_the_same_tool() -> None:
    away = BarrierGroup((stop(3), tool(2, 4)), 7)
    before = [BarrierGroup((tool(1, 0),), 0), BarrierGroup((tool(1, 2),), 3), BarrierGroup((tool(2, 6),), 7)]
    found = compare_barrier_groups(before, [BarrierGroup((tool(1, 1),), 0), away])
    assert found.differences == [
        Difference("tool change", 106, 103, "'change to tool 2' became 'pause M0, change to tool 2'")
    ]
    assert found.implied == [("tool", None, 2)]
    found = compare_barrier_groups(before, [BarrierGroup((tool(1, 1),), 0), BarrierGroup((tool(3, 5),), 7)])
    assert found.differences == [Difference("tool change", 0, 105, "'change to tool 3' is not in the original")]
    # A change in another group of work is another change.
    moved = compare_barrier_groups(
        [*before, BarrierGroup((stop(8),), 9)], [BarrierGroup((stop(8),), 9), BarrierGroup((tool(1, 9),), 10)]
    )
    assert [one.text for one in moved.differences] == ["'change to tool 1' is not in the original"]


def test_a_removed_or_added_tool_or_work_offset_implies_changes_of_cuts() -> None:
    assert compared([(frame(1, 550), 0)], [])[5] == [("frame", 550, None)]
    assert compared([], [(frame(1, 591), 0)])[5] == [("frame", None, 591)]
    assert compared([], [(tool(4, 1), 0)])[5] == [("tool", None, 4)]
    assert compared([(stop(1), 0)], [])[5] == []


@pytest.mark.parametrize(
    ("was", "now", "exactly", "fault"),
    [
        ((1, 2, 5), (1, 2, 5), True, None),
        ((1, 2, 5), (1.002, 2, 4.998), True, None),
        ((1, 2, 5), (1.0021, 2, 5), True, ("barrier at another position",
         "'pause M0' may start at the current position of the tool, which has changed from "
         "X1.000 Y2.000 Z5.000 to X1.002 Y2.000 Z5.000")),
        ((1, 2, 5), (1, 2, NAN), True, ("barrier at another position",
         "'pause M0' may start at the current position of the tool, which has changed from "
         "X1.000 Y2.000 Z5.000 to X1.000 Y2.000 and an unknown Z")),
        ((NAN, 2, 5), (NAN, 2, 5), True, None),
        ((1, 2, 5), (7, 2, 5), False, None),
        ((1, 2, 5), (1, 2, 4.998), False, None),
        ((1, 2, 5), (1, 2, 4.9979), False, ("lower retract", "at 'pause M0' the tool was at Z5.000, now at Z4.998")),
        ((1, 2, 5), (1, 2, 9), False, None),
        ((1, 2, NAN), (1, 2, 4), False, None),
    ],
)  # fmt: skip
def test_the_tool_is_as_high_at_a_barrier_as_before(
    was: tuple[float, float, float], now: tuple[float, float, float], exactly: bool, fault: tuple[str, str] | None
) -> None:
    old, new = stop(1)._replace(place=was, fixed_place=exactly), stop(2)._replace(place=now)
    found = list(find_misplaced_barriers([old, stop(7)], {1: new}, 0.002))
    assert found == ([] if fault is None else [Difference(fault[0], 101, 102, fault[1])])
    for kind in (SKIPPED, OBEYED, MESSAGE, Kind.DWELL):
        assert not list(find_misplaced_barriers([old._replace(kind=int(kind))], {1: new}, 0.002))


def test_a_height_that_is_no_longer_known_is_named() -> None:
    old, new = stop(1), stop(2)._replace(height_unknown=True)
    (found,) = find_misplaced_barriers([old], {1: new}, 0.002)
    assert found == Difference("unknown height", 101, 102, "at 'pause M0' the height of the tool is no longer known")
    assert not list(find_misplaced_barriers([old._replace(height_unknown=True)], {1: new}, 0.002))


SETTINGS = "G21 / (o=0, kw=1.5) / G0 X1 / #<holes>=2 / M3 $0 S1 / G1 X5 F60 / M5 / M2 / {}G0"
ONE, OTHER = "(o=0, kw=1) / #<holes>=3 / ", "G0 X1 / (o=0, kw=2) / "


def test_settings_of_the_controller_are_barriers() -> None:
    work = read_work(program_of(SETTINGS.format(""), "qtplasmac"), written_out=False, beam=False)
    first, second = work.marks[:2]
    assert first.values == (OBEYED, "comment", True, ("kw", 1.5), ("o", "0"), 1.0)
    assert (first.key, first.line, first.text) == (-0.5, 2, "(o=0, kw=1.5)")
    assert (second.values, second.key, second.line) == ((OBEYED, "holes", 2.0, 1.0), 0.5, 4)
    assert second.text == "#<holes>=2" and not second.fixed_place and np.isnan(second.place).all()


@pytest.mark.parametrize(
    ("before", "after", "lines", "words"),
    [
        (ONE, OTHER, (9, 10), "(o=0, kw=1), #<holes>=3 became (o=0, kw=2)"),
        (OTHER, ONE, (10, 9), "(o=0, kw=2) became (o=0, kw=1), #<holes>=3"),
        ("", ONE, (0, 9), "none became (o=0, kw=1), #<holes>=3"),
        (ONE, "", (9, 0), "(o=0, kw=1), #<holes>=3 became none"),
        (ONE, ONE, (0, 0), ""),
        ("", "", (0, 0), ""),
    ],
)
def test_settings_in_lines_that_never_run_are_compared(
    before: str, after: str, lines: tuple[int, int], words: str
) -> None:
    programs = [program_of(SETTINGS.format(text), "qtplasmac") for text in (before, after)]
    text = f"the controller settings in lines that are not executed differ: {words}"
    assert list(compare_unreached_settings(*programs)) == (
        [Difference("changed setting", *lines, text)] if words else []
    )
