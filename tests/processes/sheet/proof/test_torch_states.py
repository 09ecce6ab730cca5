"""The state of the torch at each move, from a short toolpath by hand, for each kind of controller."""

from __future__ import annotations

import pytest

from leafcut.gcode.dialects import load_dialect
from leafcut.model.difference import Difference
from leafcut.model.toolpath import SPEED_ALONE, Arc, Kind, Toolpath, ToolpathBuilder
from leafcut.processes.sheet.proof.cut_motion import _TorchTracker, check_cut_motion

Row = tuple[Kind, tuple[float, ...]]
MARKS = 1

#: Two cuts, the first in three parts: dark in the middle; a third of it compensated.
ROWS: list[Row] = [
    (Kind.RAPID, (0.0, 3.8)), (Kind.BLENDING, (640, 0.1)), (Kind.DWELL, (0.5,)), (Kind.SPINDLE, (1000.0, 0)),
    (Kind.DWELL, (0.4,)), (Kind.FEED, (10.0,)), (Kind.DWELL, (0.3,)), (Kind.TORCH, (0.0,)), (Kind.FEED, (20.0,)),
    (Kind.TORCH, (1.0,)), (Kind.HEIGHT, (0.0,)), (Kind.FEED, (30.0,)), (Kind.RADIUS, (41, 1.5)), (Kind.FEED, (40.0,)),
    (Kind.RADIUS, (40, 0.0)), (Kind.SPINDLE, (0.0, 0)), (Kind.RAPID, (60.0,)), (Kind.SPINDLE, (200.0, MARKS)),
    (Kind.FEED, (70.0,)), (Kind.SPINDLE, (0.0, 0)), (Kind.RAPID, (90.0,)),
]  # fmt: skip
MOVES = [1, 6, 9, 12, 14, 17, 19, 21]


def path_of(rows: list[Row]) -> Toolpath:
    """A toolpath along y 0; the lines are those of the list."""
    builder = ToolpathBuilder()
    for line, (kind, values) in enumerate(rows, 1):
        match kind:
            case Kind.RAPID:
                builder.rapid(values[0], 0.0, *values[1:], line=line)
            case Kind.FEED:
                builder.feed(values[0], 0.0, *values[1:], feed=25.0, line=line)
            case Kind.SPINDLE:
                builder.spindle(values[0], line, int(values[1]))
            case Kind.RADIUS:
                builder.radius(int(values[0]), values[1], line)
            case Kind.BLENDING:
                builder.blending(int(values[0]), values[1], line=line)
            case Kind.TORCH:
                builder.torch(bool(values[0]), line)
            case Kind.HEIGHT:
                builder.height_control(bool(values[0]), line)
            case Kind.DWELL:
                builder.dwell(values[0], line)
            case Kind.OFFSET:
                builder.offset(int(values[0]), line)
    return builder.build()


#: Controller → rows of power, height control, kerf, path control, its tolerance and the dwell after lighting, per move.
#: Planned: GRBL and QtPlasmaC wait by themselves; a Fanuc takes half of the kerf from register 1.
STATES = {
    "qtplasmac": {
        "beam": [0, 1, 0, 1, 1, 0, 2, 0], "power": [0] * 8, "follows": [1, 1, 1, 0, 0, 0, 0, 0],
        "kerf": [0, 0, 0, 0, 1.5, 0, 0, 0], "blends": [0, 1, 1, 1, 1, 1, 1, 1],
        "tolerance": [0, *[0.1] * 7], "lit_s": [0, 0, 0.3, 0, 0, 0, 0, 0],
    },
    "grbl-laser": {
        "beam": [0, 1, 0, 1, 1, 0, 1, 0], "power": [0, 1000, 0, 1000, 1000, 0, 200, 0], "follows": [1] * 8,
        "kerf": [0, 0, 0, 0, 1.5, 0, 0, 0], "blends": [0] * 8,
        "tolerance": [0] * 8, "lit_s": [0, 0, 0.3, 0, 0, 0, 0, 0],
    },
    "fanuc-laser": {
        "beam": [0, 1, 0, 1, 1, 0, 1, 0], "power": [0, 1000, 0, 1000, 1000, 0, 200, 0], "follows": [1] * 8,
        "kerf": [0, 0, 0, 0, 1.0, 0, 0, 0], "blends": [0, *[1] * 7],
        "tolerance": [0] * 8, "lit_s": [0, 0.4, 0.3, 0, 0, 0, 0, 0],
    },
    "plasma": {
        "beam": [0, 1, 0, 0, 0, 0, 2, 0], "power": [0] * 8, "follows": [1] * 8,
        "kerf": [0, 0, 0, 0, 1.5, 0, 0, 0], "blends": [0, *[1] * 7],
        "tolerance": [0, *[0.1] * 7], "lit_s": [0, 0.4, 0.3, 0, 0, 0, 0, 0],
    },
}  # fmt: skip
#: What a text states that is planned otherwise: nothing is left to the controller.
WRITTEN = {
    "qtplasmac": {"lit_s": [0, 0.4, 0.3, 0, 0, 0, 0, 0]},
    "grbl-laser": {"lit_s": [0, 0.4, 0.3, 0, 0, 0, 0, 0]},
    "fanuc-laser": {"tolerance": [0, *[0.1] * 7], "kerf": [0, 0, 0, 0, 1.5, 0, 0, 0]},
    "plasma": {},
}
NAMES = ("beam", "power", "follows", "side", "kerf", "blends", "tolerance", "pierces", "dark_s", "lit_s")


@pytest.mark.parametrize("words", STATES)
@pytest.mark.parametrize("planned", [True, False])
def test_the_state_at_each_move_is_what_the_controller_makes_of_the_rows(words: str, planned: bool) -> None:
    torch = load_dialect(words).torch
    assert torch is not None
    tracker = _TorchTracker(load_dialect(words), torch, 0.001, planned=planned)
    moves, states = tracker.moves_with_states(path_of(ROWS))
    expected = {
        **STATES[words], "side": [40, 40, 40, 40, 41, 40, 40, 40], "pierces": [0, 1, 0, 0, 0, 0, 1, 0],
        "dark_s": [0, 0.5, 0, 0, 0, 0, 0, 0], **({} if planned else WRITTEN[words]),
    }  # fmt: skip
    assert dict(zip(NAMES, states.T.tolist(), strict=True)) == expected
    assert moves.line.tolist() == MOVES


def test_only_the_first_dwell_between_lighting_and_a_move_is_the_controllers_own() -> None:
    torch = load_dialect("qtplasmac").torch
    assert torch is not None
    start: list[Row] = [(Kind.RAPID, (0.0, 3.8)), (Kind.SPINDLE, (1.0, 0))]
    for rows, waits in (
        ([(Kind.DWELL, (0.4,)), (Kind.DWELL, (0.2,)), (Kind.FEED, (9.0,))], [0.0, 0.2]),
        ([(Kind.DWELL, (0.4,)), (Kind.FEED, (9.0,)), (Kind.DWELL, (0.2,)), (Kind.FEED, (10.0,))], [0.0, 0.0, 0.2]),
        ([(Kind.FEED, (9.0,)), (Kind.DWELL, (0.4,)), (Kind.FEED, (10.0,))], [0.0, 0.0, 0.4]),
        ([(Kind.TORCH, (0.0,)), (Kind.DWELL, (0.4,)), (Kind.DWELL, (0.3,)), (Kind.FEED, (9.0,))], [0.0, 0.0]),
    ):
        tracker = _TorchTracker(load_dialect("qtplasmac"), torch, 0.001, planned=True)
        states = tracker.moves_with_states(path_of([*start, *rows]))[1]
        assert states[:, NAMES.index("lit_s")].tolist() == waits
        dark = [0.0, 0.3] if rows[0][0] is Kind.TORCH else [0.0] * len(waits)
        assert states[:, NAMES.index("dark_s")].tolist() == dark


def test_the_centre_of_an_arc_has_no_height_where_the_controller_moves_z() -> None:
    def arc(x: float, z: float) -> Toolpath:
        builder = ToolpathBuilder()
        builder.rapid(0.0, 0.0, 3.8)
        builder.arc(True, (10.0, 0.0, 3.8), Arc((x, 0.0, z)), feed=25.0)
        return builder.build()

    for x, z, kinds in ((5.0, 0.0, []), (5.0004, 3.8, []), (5.01, 3.8, ["arc"])):
        found = check_cut_motion(arc(5.0, 3.8), arc(x, z), load_dialect("qtplasmac"), "mm")
        assert [d.what for d in found] == kinds


def differences(rows: list[Row], words: str = "qtplasmac") -> list[tuple[str, int, str]]:
    """Return kind, line and text of the differences; QtPlasmaC's own pierce delay is not written."""
    planned = path_of(ROWS)
    return [(d.what, d.new, d.text) for d in check_cut_motion(planned, path_of(rows), load_dialect(words), "mm")]


OWN_DELAY = [*ROWS[:4], (Kind.OFFSET, (0.0,)), *ROWS[5:]]


def changed(index: int, *rows: Row) -> list[Row]:
    return [*OWN_DELAY[:index], *rows, *OWN_DELAY[index + 1 :]]


def at(x: int, what: str, rapid: bool = False) -> str:
    return f"at {'rapid' if rapid else 'feed'} to X{x}.000 Y0.000 and an unknown Z: {what}"


@pytest.mark.parametrize(
    ("index", "row", "line", "text"),
    [
        (1, (Kind.BLENDING, (640, 0.2)), 6, at(10, "tolerance of corners 0.1 became 0.2")),
        (1, (Kind.BLENDING, (610, 0.1)), 6, at(10, "path control 1 became 0")),
        (2, (Kind.DWELL, (0.502,)), 6, at(10, "dwell before the torch is lit 0.5 became 0.502")),
        (3, (Kind.SPINDLE, (1000.0, MARKS)), 6, at(10, "torch (0 dark, 1 cuts, 2 marks) 1 became 2")),
        (3, (Kind.SPINDLE, (0.0, 0)), 6, at(10, "torch (0 dark, 1 cuts, 2 marks) 1 became 0")),
        (4, (Kind.DWELL, (0.2,)), 6, at(10, "dwell after the torch is lit 0 became 0.2")),
        (6, (Kind.DWELL, (0.29,)), 9, at(20, "dwell after the torch is lit 0.3 became 0.29")),
        (7, (Kind.TORCH, (1.0,)), 9, at(20, "torch (0 dark, 1 cuts, 2 marks) 0 became 1")),
        (9, (Kind.TORCH, (0.0,)), 12, at(30, "torch (0 dark, 1 cuts, 2 marks) 1 became 0")),
        (10, (Kind.HEIGHT, (1.0,)), 12, at(30, "height control 0 became 1")),
        (12, (Kind.RADIUS, (42, 1.5)), 14, at(40, "side of the kerf 41 became 42")),
        (12, (Kind.RADIUS, (41, 1.6)), 14, at(40, "kerf 1.5 became 1.6")),
        (15, (Kind.SPINDLE, (500.0, 0)), 17, at(60, "torch (0 dark, 1 cuts, 2 marks) 0 became 1", rapid=True)),
        (17, (Kind.SPINDLE, (200.0, 0)), 19, at(70, "torch (0 dark, 1 cuts, 2 marks) 2 became 1")),
    ],
)  # fmt: skip
def test_another_row_is_a_difference_at_the_first_move_in_another_state(
    index: int, row: Row, line: int, text: str
) -> None:
    assert differences(OWN_DELAY) == []
    assert differences(changed(index, row))[0] == ("torch", line, text)


@pytest.mark.parametrize(
    ("index", "row"),
    [
        (1, (Kind.BLENDING, (640, 0.1005))),
        (2, (Kind.DWELL, (0.5009,))),
        (6, (Kind.DWELL, (0.2991,))),
        (12, (Kind.RADIUS, (41, 1.5005))),
        (3, (Kind.SPINDLE, (900.0, 0))),
    ],
)
def test_rounding_and_a_power_that_the_controller_does_not_read_are_no_differences(index: int, row: Row) -> None:
    assert differences(changed(index, row)) == []


def test_the_power_of_a_laser_is_compared_to_a_revolution_and_s_alone_changes_it() -> None:
    def of_laser(*rows: Row) -> list[str]:
        return [text for _, _, text in differences([*ROWS[:3], *rows, *ROWS[5:]], "grbl-laser")]

    assert of_laser((Kind.SPINDLE, (1000.4, 0))) == [] == of_laser((Kind.SPINDLE, (-1000.0, 0)))
    assert of_laser((Kind.SPINDLE, (1000.6, 0)))[0] == at(10, "power 1000 became 1000.6")
    assert of_laser((Kind.SPINDLE, (500.0, 0)), (Kind.SPINDLE, (1000.0, SPEED_ALONE))) == []
    assert of_laser((Kind.SPINDLE, (1000.0, 0)), (Kind.SPINDLE, (500.0, SPEED_ALONE)))[0] == at(
        10, "power 1000 became 500"
    )


def test_a_second_pierce_and_a_missing_one_are_differences() -> None:
    again = changed(3, ROWS[3], (Kind.SPINDLE, (0.0, 0)), ROWS[3])
    assert differences(again)[0] == ("torch", 8, at(10, "number of pierces 1 became 2"))
    still_lit = changed(3, ROWS[3], (Kind.SPINDLE, (1000.0, 0)))
    assert differences(still_lit) == []


def test_tiny_moves_may_be_left_out_and_their_events_count_for_the_next_move() -> None:
    """Twice the rounding of 0.0005 mm is one thousandth."""
    tiny = changed(8, (Kind.FEED, (10.0009,)), (Kind.FEED, (20.0,)))
    assert differences(tiny) == []
    far = changed(8, (Kind.FEED, (10.002,)), (Kind.FEED, (20.0,)))
    assert differences(far)[0][0] == "order of moves"
    assert differences(changed(8, (Kind.FEED, (20.002,))))[0][0] == "place"


@pytest.mark.parametrize(("units", "near"), [("mm", 0.0005), ("inch", 0.00127)])
def test_positions_may_differ_by_half_of_the_last_decimal(units: str, near: float) -> None:
    for beyond, fine in ((0.99, True), (1.01, False)):
        rows = changed(8, (Kind.FEED, (20.0 + beyond * near,)))
        found = check_cut_motion(path_of(ROWS), path_of(rows), load_dialect("qtplasmac"), units)
        assert (found == []) is fine


def test_the_height_counts_where_the_program_moves_z() -> None:
    rows = [*ROWS[:8], (Kind.FEED, (20.0, 3.0)), *ROWS[9:]]
    assert {what for what, _, _ in differences(rows, "plasma")} == {"height"}
    assert differences([*rows[:4], (Kind.OFFSET, (0.0,)), *rows[5:]]) == []


def test_a_program_without_torch_words_is_compared_row_by_row() -> None:
    found = check_cut_motion(path_of(ROWS), path_of(OWN_DELAY), load_dialect("linuxcnc"), "mm")
    assert [d.what for d in found] == ["order of moves"]
    assert check_cut_motion(path_of(ROWS), path_of(ROWS), load_dialect("linuxcnc"), "mm") == []


def test_of_many_differences_fifty_are_listed() -> None:
    moves: list[Row] = [(Kind.RAPID, (0.0, 3.8)), *((Kind.FEED, (1.0 + k,)) for k in range(60))]
    lit = [moves[0], (Kind.SPINDLE, (1.0, 0)), *moves[1:]]
    found = check_cut_motion(path_of(moves), path_of(lit), load_dialect("qtplasmac"), "mm")
    assert len(found) == 51 and found[-1] == Difference("and more", 0, 0, "10 more differences")
