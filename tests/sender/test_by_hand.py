"""Manual operation of a board in plain Python: probe, limits of a jog, pauses from hole to hole, Stop."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fake_grbl import FakeGrbl
from leafcut.errors import OptionError, SendError
from leafcut.sender.character_counting import SentLine
from leafcut.sender.conversation import Interrupted
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.jogging import check_jog, jog_command, probe_z
from leafcut.sender.lines import DrilledHole, Pause, insert_pauses_at_holes


class ProbedGrbl(FakeGrbl):
    """A board whose probe closes at Z -27.3, and comes to rest a little below."""

    touched = 1

    def _take(self, line: str) -> None:
        if "G38.2" in line:
            self.say(f"[PRB:-100.000,-100.000,-27.300:{self.touched}]")
            self.place = "-100.000,-100.000,-27.350"
        super()._take(line)


def talking(board: FakeGrbl) -> GrblConversation:
    talk = GrblConversation(board, clock=board.clock)
    talk.connect()
    return talk


def test_the_lower_side_of_the_plate_becomes_z0_although_the_probe_overshoots() -> None:
    """The tool stands 0.05 mm below the contact, in a plate of 1.5 mm: where it stands is Z 1.45."""
    board = ProbedGrbl()
    talk = talking(board)
    probe_z(talk, talk.read_facts_at_rest(), plate=1.5, feed=50.0, travel=15.0)
    assert board.taken == ["G91G21G38.2Z-15F50", "G90", "G54", "G10 L20 P1 Z1.45"]


def test_a_probe_that_did_not_touch_sets_no_zero() -> None:
    board = ProbedGrbl()
    board.touched = 0
    talk = talking(board)
    with pytest.raises(SendError, match="does not report the position of the contact"):
        probe_z(talk, talk.read_facts_at_rest(), plate=1.5, feed=50.0, travel=15.0)
    assert not any("G10" in line for line in board.taken)


@pytest.mark.parametrize(("plate", "feed", "travel"), [(-1.0, 50.0, 5.0), (1.0, 0.0, 5.0), (1.0, 50.0, -5.0)])
def test_a_probe_of_nonsense_is_refused(plate: float, feed: float, travel: float) -> None:
    board = ProbedGrbl()
    talk = talking(board)
    facts = talk.read_facts_at_rest()
    with pytest.raises(OptionError):
        probe_z(talk, facts, plate, feed, travel)
    with pytest.raises(SendError, match=r"can descend only 80\.000 mm here"):
        probe_z(talk, facts, 1.0, 50.0, 90.0)
    assert board.taken == []


def test_a_jog_is_written_in_mm_and_refused_out_of_the_travel_but_not_back_into_it() -> None:
    assert jog_command({"X": -0.1, "Z": 2.0}, 1500.0) == "$J=G91G21X-0.1Z2F1500"
    for moves, feed in (({}, 100.0), ({"A": 1.0}, 100.0), ({"X": float("nan")}, 100.0), ({"X": 1.0}, 0.0)):
        with pytest.raises(OptionError):
            jog_command(moves, feed)
    facts = talking(FakeGrbl()).read_facts_at_rest()  # from -200, -200, -100 to 0
    check_jog(facts, (-100.0, -100.0, -20.0), {"X": 100.0, "Z": -80.0})
    with pytest.raises(SendError, match="error 15"):
        check_jog(facts, (-100.0, -100.0, -20.0), {"X": 100.1})
    check_jog(facts, (50.0, 0.0, 0.0), {"X": -10.0})


@given(st.lists(st.integers(1, 4), max_size=12), st.integers(0, 12))
def test_before_the_first_line_of_each_hole_left_stands_one_pause(lengths: list[int], skipped: int) -> None:
    """Holes of several lines each, the first ones skipped as after an interruption; the rest keeps its order."""
    holes, line = [], 3
    for number, length in enumerate(lengths, 1):
        holes.append(DrilledHole(number, 0.0, 0.0, line, line + length - 1))
        line += length
    first = holes[skipped].first if skipped < len(holes) else 1
    steps = [SentLine("M5"), *(SentLine(f"X{k}", k) for k in range(first, line + 2))]
    made = insert_pauses_at_holes(steps, holes)
    assert [step for step in made if not isinstance(step, Pause)] == steps
    pauses = [k for k, step in enumerate(made) if isinstance(step, Pause)]
    asked = [hole for hole in holes if hole.first >= first]
    assert [made[k].hole for k in pauses] == [hole.number for hole in asked]  # type: ignore[union-attr]
    assert [made[k + 1].number for k in pauses] == [hole.first for hole in asked]


def test_whoever_waits_for_an_answer_can_be_interrupted_once_and_a_reset_never() -> None:
    board = FakeGrbl()
    talk = talking(board)
    talk.interrupt_wait()
    with pytest.raises(Interrupted):
        talk.ask("G0X1")
    talk.interrupt_wait()
    assert talk.stop().state == "Idle"  # a second Stop resets at once
    assert b"\x18" in board.realtime
    talk.ask("G0X1")
