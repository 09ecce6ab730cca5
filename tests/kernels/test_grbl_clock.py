"""The parts of GRBL's clock by hand and against plain implementations; `tests/timing` has recorded times."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from leafcut.kernels import grbl_clock as clock
from leafcut.kernels.grbl_clock import (
    BEGAN,
    BEGUN,
    CHANGED,
    DONE,
    ENDS,
    ENTRY2,
    FIXED,
    LEFT,
    MADE,
    MOST2,
    NOMINAL,
    NOW,
    OWNER,
    PER_MM,
    PLANNED,
    RATE,
    REST,
    RUNNING,
    SHARE,
    SPEED,
    STEPS,
    Board,
    new_board,
)
from plain_python import plain_python

#: Steps per mm, maximum speed, and acceleration of each axis.
LIMITS = np.array([[10.0, 10.0, 40.0], [80.0, 60.0, 20.0], [500.0, 400.0, 100.0]])


@pytest.fixture(autouse=True)
def _plain_kernels() -> Iterator[None]:
    """Run all kernels as plain Python, so that a part can be replaced."""
    with plain_python():
        yield


def board(n: int = 3, byte_s: float = 0.001, lock_s: float = 0.25, pace: float = 1.0) -> Board:
    """Return a board at rest."""
    return new_board(n, byte_s, lock_s, pace)


def test_a_new_board_is_at_rest_and_has_done_nothing() -> None:
    new = new_board(4, 0.1, 0.2, 0.3)
    assert (new.byte_s, new.lock_s, new.pace) == (0.1, 0.2, 0.3)
    assert new.done.tolist() == [-1.0] * 4
    assert (new.ring.shape, new.ends.shape, new.unit.shape, new.steps.shape) == ((16, 7), (5,), (2, 3), (3,))
    assert [k for k in range(7) if new.state[k]] == [SHARE]
    assert new.state[SHARE] == 1.0
    assert not new.counts.any() and not new.ring.any() and not new.ends.any()


def test_the_program_works_more_slowly_while_the_motors_run() -> None:
    b = board(pace=2.0)
    b.state[SHARE] = 0.25
    clock._spend_time(b, 3.0)
    assert b.state[NOW] == 6.0
    b.counts[RUNNING] = 1
    clock._spend_time(b, 3.0)
    assert b.state[NOW] == 30.0


def test_a_segment_is_free_when_the_fifth_before_it_has_ended() -> None:
    b = board()
    b.ends[:] = [5.0, 6.0, 2.0, 3.0, 4.0]
    for made, when in ((2, 2.0), (7, 2.0), (9, 4.0), (10, 5.0)):
        b.counts[MADE] = made
        assert clock._next_free_segment(b) == when


@pytest.mark.parametrize(
    ("time", "ticks", "tick"),
    [
        (0.0005, 1, 801),  # 5 steps in 0.5 ms: 1600 cycles a step, and half of them, see below
        (0.001, 1, 1601),
        (0.00125, 2, 1001),
        (0.002, 2, 1601),
        (0.0025, 4, 1001),
        (0.004, 4, 1601),
        (0.005, 8, 1001),
        (0.25, 8, 50_001),
        (0.5, 8, 65_536),
    ],
)
def test_steps_of_a_segment_are_whole_ticks_of_the_timer(time: float, ticks: int, tick: int) -> None:
    """Ten steps of one axis; a step of 1600 cycles of 16 MHz takes 0.1 ms. A tick has one cycle more, as in GRBL."""
    b = board()
    b.counts[[DONE, MADE]] = 2, 6
    b.ring[2, [PER_MM, OWNER, LEFT]] = 10.0, 1, 4.0
    b.state[[ENDS, STEPS, REST]] = 7.0, 40.0, 0.0
    clock._queue_segment(b, 3.0, 33.0, time)
    assert b.state[ENDS] == pytest.approx(7.0 + 10 * ticks * tick / 16e6, abs=1e-12)
    assert b.state[SHARE] == pytest.approx(max(1.0 - 22e-6 * 16e6 / tick, 0.1))
    assert b.state[[SPEED, STEPS, REST]].tolist() == [33.0, 30.0, 0.0]
    assert b.ends.tolist() == [0.0, b.state[ENDS], 0.0, 0.0, 0.0]
    assert (b.counts[MADE], b.counts[DONE], b.ring[2, LEFT], b.done.max()) == (7, 2, 3.0, -1.0)


def test_a_partial_step_is_left_to_the_next_segment_and_the_last_one_ends_the_block() -> None:
    """From 40 to 33.6 steps: six whole steps are run; the time of 0.4 steps of 1 ms is left."""
    b = board()
    b.counts[BEGUN] = 1
    b.ring[0, [PER_MM, OWNER]] = 10.0, 2
    b.state[STEPS] = 40.0
    clock._queue_segment(b, 3.36, 5.0, 0.0064)
    assert b.state[STEPS] == 34.0
    assert b.state[REST] == pytest.approx(0.0004)
    assert b.state[ENDS] == pytest.approx(6 * 8 * 2001 / 16e6)
    # The rest of 33.6 steps, in 33.6 ms and the time left before: 1 ms for each of 34 steps.
    clock._queue_segment(b, 0.0, 0.0, 0.0336)
    assert b.state[STEPS] == 0.0
    assert b.state[REST] == pytest.approx(0.0)
    assert b.state[ENDS] == pytest.approx(40 * 8 * 2001 / 16e6)
    assert b.done.tolist() == [-1.0, -1.0, b.state[ENDS]]
    assert b.counts[[DONE, BEGUN, MADE]].tolist() == [1, 0, 2]


class Profile:
    """A move with constant acceleration to a speed, at that speed, and with the same deceleration."""

    def __init__(self, length: float, rate: float, nominal: float, entry: float, exit_: float) -> None:
        peak = math.sqrt(0.5 * (2.0 * rate * length + entry**2 + exit_**2))
        self.peak = max(min(nominal, peak), entry, exit_)
        self.rate, self.entry, self.exit, self.length = rate, entry, exit_, length
        self.up, self.down = (self.peak - entry) / rate, (self.peak - exit_) / rate
        moved = 0.5 * (self.peak + entry) * self.up + 0.5 * (self.peak + exit_) * self.down
        self.level = max(length - moved, 0.0) / self.peak
        self.time = self.up + self.level + self.down

    def at(self, t: float) -> tuple[float, float]:
        """Return the remaining length and the speed after a time."""
        left = max(self.time - t, 0.0)
        if left <= self.down:
            return left * (self.exit + 0.5 * self.rate * left), self.exit + self.rate * left
        if t < self.up:
            return self.length - t * (self.entry + 0.5 * self.rate * t), self.entry + self.rate * t
        return (left - self.down) * self.peak + 0.5 * (self.peak + self.exit) * self.down, self.peak


@pytest.mark.parametrize(
    ("length", "rate", "nominal", "entry", "exit_", "per_mm"),
    [
        (40.0, 500.0, 50.0, 0.0, 0.0, 80.0),  # a trapezoid
        (3.0, 500.0, 50.0, 0.0, 0.0, 80.0),  # a triangle
        (5.0, 500.0, 50.0, 20.0, 50.0, 80.0),  # speeds up to the next block
        (5.0, 500.0, 50.0, 50.0, 10.0, 80.0),  # slows down
        (7.0, 300.0, 40.0, 40.0, 40.0, 80.0),  # no change
        (4.0, 300.0, 40.0, 30.0, 20.0, 80.0),  # up and down
        (0.5, 100.0, 3.0, 0.0, 0.0, 10.0),  # so slow that a segment of 10 ms has less than a step
        (150.0, 400.0, 40.0, 0.0, 0.0, 20.0),  # long: segments at constant speed are one
        (90.0, 400.0, 40.0, 0.0, 0.0, 20.0),
        (81.0, 400.0, 40.0, 40.0, 40.0, 20.0),
        (79.0, 400.0, 40.0, 40.0, 40.0, 20.0),
        (0.05, 400.0, 40.0, 0.0, 3.0, 80.0),  # less than a segment
    ],
)
def test_segments_follow_the_profile_of_constant_acceleration(
    length: float,
    rate: float,
    nominal: float,
    entry: float,
    exit_: float,
    per_mm: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each lasts 10 ms, or as many times 10 ms as 1.25 steps take. At constant speed, all of the time but for the last
    second are one segment, if that is more than another second.
    """
    b, profile, cut = board(), Profile(length, rate, nominal, entry, exit_), []
    b.counts[[DONE, PLANNED]] = 15, 17
    b.ring[15, [LEFT, RATE, NOMINAL, ENTRY2, PER_MM]] = length, rate, nominal, entry**2, per_mm
    b.ring[0, ENTRY2] = exit_**2
    if exit_ == 0.0:
        b.counts[PLANNED] = 16  # the last block ends at rest, whatever the ring holds after it
        b.ring[0, ENTRY2] = 99.0

    def note(_: Board, remaining: float, speed: float, time: float) -> None:
        cut.append((remaining, speed, time))
        b.ring[15, LEFT], b.state[SPEED] = remaining, speed

    monkeypatch.setattr(clock, "_queue_segment", note)
    while not cut or cut[-1][0] > 0.0:
        clock._prepare_next_segment(b)
        if len(cut) == 1:
            assert (b.counts[BEGUN], b.state[STEPS], b.state[REST]) == (1, math.ceil(length * per_mm - 1e-6), 0.0)
        b.state[STEPS] = -1.0
    at = 0.0
    for remaining, speed, time in cut:
        before, began = profile.at(at)
        least = max(before - 1.25 / per_mm, 0.0)
        cruise = profile.up + profile.level - at - 1.0
        lasts = 0.01
        if cruise > 1.0 and began >= profile.peak * (1.0 - 1e-9):
            lasts = math.floor(cruise / 0.01) * 0.01
        while profile.at(at + lasts)[0] > least + 1e-9 and at + lasts < profile.time:
            lasts += 0.01
        assert time == pytest.approx(min(lasts, profile.time - at), abs=1e-6)
        at += time
        assert (remaining, speed) == pytest.approx(profile.at(at), abs=1e-5)
    assert at == pytest.approx(profile.time)
    assert cut[-1][0] == 0.0


def test_a_segment_within_a_block_begins_at_the_speed_of_the_last_one(monkeypatch: pytest.MonkeyPatch) -> None:
    b, cut = board(), []
    b.counts[[PLANNED, BEGUN]] = 1, 1
    b.ring[0, [LEFT, RATE, NOMINAL, ENTRY2, PER_MM]] = 30.0, 100.0, 50.0, 9.0, 80.0
    b.state[[SPEED, STEPS, REST]] = 20.0, 5.0, 0.125
    monkeypatch.setattr(clock, "_queue_segment", lambda *given: cut.append(given[1:]))
    clock._prepare_next_segment(b)
    assert cut == [(pytest.approx(30.0 - 0.01 * (20.0 + 0.5)), pytest.approx(21.0), pytest.approx(0.01))]
    assert b.state[[STEPS, REST]].tolist() == [5.0, 0.125]


def planned(b: Board, blocks: list[tuple[float, float, float]]) -> list[float]:
    """Return the largest entry speeds² of blocks (length, rate, limit²) that keep the limits and end at rest."""
    speeds = [0.0] + [limit for *_, limit in blocks[1:]] + [0.0]
    for i in reversed(range(1, len(blocks))):
        speeds[i] = min(speeds[i], speeds[i + 1] + 2.0 * blocks[i][0] * blocks[i][1])
    for i in range(len(blocks)):
        speeds[i + 1] = min(speeds[i + 1], speeds[i] + 2.0 * blocks[i][0] * blocks[i][1])
    return speeds[:-1]


def test_blocks_are_planned_as_fast_as_their_corners_and_the_stop_at_the_end_allow() -> None:
    """Added one by one; blocks before `FIXED` change no more, however many follow."""
    for seed in range(12):
        rng, b = np.random.default_rng(seed), board()
        blocks: list[tuple[float, float, float]] = []
        history = []
        for at in range(15):
            length, rate = float(rng.uniform(0.05, 4.0)), float(rng.uniform(50.0, 400.0))
            limit = float(rng.choice([0.0, 4.0, 100.0, 900.0])) if at else 0.0
            blocks.append((length, rate, limit))
            b.ring[at, [LEFT, RATE, MOST2, ENTRY2]] = length, rate, limit, 0.0
            b.counts[PLANNED] = at + 1
            first = int(b.counts[FIXED])
            assert clock._replan_blocks(b) == at - first
            assert b.ring[: at + 1, ENTRY2].tolist() == pytest.approx(planned(b, blocks))
            history.append((int(b.counts[FIXED]), b.ring[: at + 1, ENTRY2].tolist()))
        assert b.counts[CHANGED] == 0
        for fixed, speeds in history:
            assert b.ring[: fixed + 1, ENTRY2].tolist() == speeds[: fixed + 1]
        # Fixed is the last block that starts as fast as it ever can.
        ever = max(
            i
            for i in range(15)
            if i == 0
            or b.ring[i, ENTRY2] == b.ring[i, MOST2]
            or b.ring[i, ENTRY2] == pytest.approx(b.ring[i - 1, ENTRY2] + 2.0 * blocks[i - 1][0] * blocks[i - 1][1])
        )
        assert b.counts[FIXED] == ever


def test_a_block_that_is_being_run_is_planned_from_its_speed_now() -> None:
    """Block 20 has 2 mm left at 10 mm/s; the next may start with at most 10² + 2·100·2 = 500 (mm/s)²."""
    b = board()
    b.counts[[DONE, PLANNED, BEGUN]] = 20, 22, 1
    b.state[SPEED] = 10.0
    b.ring[4, [LEFT, RATE, ENTRY2]] = 2.0, 100.0, 7.0
    b.ring[5, [LEFT, RATE, MOST2]] = 30.0, 100.0, 800.0
    assert clock._replan_blocks(b) == 1
    assert b.ring[[4, 5], ENTRY2].tolist() == [100.0, 500.0]
    assert b.counts[[CHANGED, FIXED]].tolist() == [1, 21]
    # A single block that is being run is not planned again.
    b.counts[[DONE, PLANNED, CHANGED]] = 21, 22, 0
    assert clock._replan_blocks(b) == 0
    assert (b.counts[CHANGED], b.ring[5, ENTRY2]) == (0, 500.0)


def test_the_limit_along_a_direction_is_that_of_the_axis_that_reaches_it_first() -> None:
    limits = np.array([80.0, 60.0, 20.0])
    for unit, limit in (
        ((1.0, 0.0, 0.0), 80.0),
        ((0.0, -1.0, 0.0), 60.0),
        ((0.6, 0.8, 0.0), 75.0),
        ((0.8, -0.6, 0.0), 100.0),
        ((-0.8, 0.0, 0.6), 20.0 / 0.6),
        ((0.0, 0.0, 0.0), math.inf),
    ):
        assert clock._limit_along_direction(limits, np.array(unit)) == pytest.approx(limit)


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), math.inf),
        ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), 0.0),
        ((0.0, 0.6, 0.8), (0.0, -0.6, -0.8), 0.0),
        # At a right angle the bend is that of the diagonal, and half the angle has the sine √½.
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 400.0 * math.sqrt(2) * 0.02 * math.sqrt(0.5) / (1 - math.sqrt(0.5))),
        ((0.0, 0.0, -1.0), (-1.0, 0.0, 0.0), 100.0 * math.sqrt(2) * 0.02 * math.sqrt(0.5) / (1 - math.sqrt(0.5))),
        # 60 degrees between the moves; the bend (-0.5, √¾) has the length 1.
        ((1.0, 0.0, 0.0), (0.5, math.sqrt(0.75), 0.0), 400.0 / math.sqrt(0.75) * 0.02 / (math.sqrt(4 / 3) - 1)),
    ],
)  # fmt: skip
def test_the_speed_of_a_corner_is_that_of_a_circle_with_the_deviation(
    before: tuple[float, ...], after: tuple[float, ...], expected: float
) -> None:
    b = board()
    b.unit[:] = before, after
    assert clock._squared_corner_speed(b, LIMITS[2], 0.02) == pytest.approx(expected)


def test_a_turn_of_less_than_a_thousandth_is_straight_or_a_reversal() -> None:
    """The limit of the cosine is 0.999999, an angle of 0.001414."""
    found = []
    for angle in (0.0014, 0.00143, math.pi - 0.00143, math.pi - 0.0014):
        b = board()
        b.unit[:] = (1.0, 0.0, 0.0), (math.cos(angle), math.sin(angle), 0.0)
        found.append(clock._squared_corner_speed(b, LIMITS[2], 0.02))
    assert found[0] == math.inf
    assert 1e6 < found[1] < math.inf
    assert 0.0 < found[2] < 0.1
    assert found[3] == 0.0


def test_a_move_becomes_a_block_with_the_limits_of_its_direction(monkeypatch: pytest.MonkeyPatch) -> None:
    """10 steps/mm in x and y; times of a block, of each axis, of a corner, and of three replanned blocks."""
    monkeypatch.setattr(clock, "_replan_blocks", lambda _: 3)
    b, spent = board(), 0.0

    def add(x: float, y: float, z: float, feed: float, owner: int, seconds: float) -> None:
        nonlocal spent
        clock._add_block(b, np.array([x, y, z]), feed, LIMITS, 0.02, owner)
        spent += seconds
        assert b.state[NOW] == pytest.approx(spent, abs=1e-12)

    block, axis, corner, plan = 0.27e-3, 0.19e-3, 0.37e-3, 3 * 55e-6
    add(6.04, 8.04, 0.0, 50.0, 4, block + 2 * axis + plan)
    assert b.ring[0].tolist() == pytest.approx([10.0, 500.0, 50.0, 0.0, 0.0, 8.0, 4.0])
    assert b.steps.tolist() == [60.0, 80.0, 0.0]
    assert b.unit[0].tolist() == pytest.approx([0.6, 0.8, 0.0])
    assert b.counts[PLANNED] == 1
    # Less than half a step away: dropped.
    add(6.049, 8.0, 0.01, 50.0, 5, 0.0)
    assert (b.counts[PLANNED], b.steps.tolist()) == (1, [60.0, 80.0, 0.0])
    # Half a step is a step. A rapid is as fast as its axis, and the corner depends on both directions.
    add(6.05, 8.0, 0.0, math.inf, 6, block + axis + corner + plan)
    half = math.sqrt(0.5 * (1.0 + 0.6))
    size = math.hypot(0.4, 0.8)
    corner2 = min(500.0 * size / 0.4, 400.0 * size / 0.8) * 0.02 * half / (1.0 - half)
    assert b.ring[1].tolist() == pytest.approx([0.1, 500.0, 80.0, min(corner2, 2500.0), 0.0, 10.0, 6.0])
    # Straight on: no corner; the speed is that of the slower of the two blocks.
    add(20.0, 8.0, 0.0, 30.0, 7, block + axis + plan)
    assert b.ring[2].tolist() == pytest.approx([13.9, 500.0, 30.0, 900.0, 0.0, 10.0, 7.0])
    add(30.0, 8.0, 0.0, 70.0, 8, block + axis + plan)
    assert b.ring[3].tolist() == pytest.approx([10.0, 500.0, 70.0, 900.0, 0.0, 10.0, 8.0])
    # Slower than a millimetre a minute is a millimetre a minute.
    add(30.0, 8.0, -5.0, 0.001, 9, block + axis + corner + plan)
    assert b.ring[4, [LEFT, RATE, NOMINAL, PER_MM, OWNER]].tolist() == pytest.approx([5.0, 100.0, 1 / 60, 40.0, 9.0])
    assert b.ring[4, MOST2] == pytest.approx(1 / 3600)
    # After the machine has stopped there is no corner.
    b.counts[DONE] = 5
    add(30.0, 9.0, -5.0, 50.0, 10, block + axis + plan)
    assert b.ring[5].tolist() == pytest.approx([1.0, 400.0, 50.0, 0.0, 0.0, 10.0, 10.0])


class Segments:
    """Replaces the cutting of segments: each block has as many as given, of 1 s each."""

    def __init__(self, b: Board, counts: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
        self.left, self.cuts = dict(enumerate(counts)), []  # type: ignore[var-annotated]
        b.counts[PLANNED] = len(counts)
        monkeypatch.setattr(clock, "_prepare_next_segment", self.cut)

    def cut(self, b: Board) -> None:
        """Cut a segment."""
        at = int(b.counts[DONE])
        self.cuts.append((at, float(b.state[NOW])))
        b.counts[BEGUN] = 1
        b.state[ENDS] += 1.0
        b.ends[b.counts[MADE] % 5] = b.state[ENDS]
        b.counts[MADE] += 1
        self.left[at] -= 1
        if not self.left[at]:
            b.done[at] = b.state[ENDS]
            b.counts[DONE] += 1
            b.counts[BEGUN] = 0


#: Processor times of a started block, and of a segment, s.
LOAD, CUT = 0.27e-3, 0.33e-3


def test_a_start_prepares_five_segments_which_run_a_little_later(monkeypatch: pytest.MonkeyPatch) -> None:
    b = board(pace=2.0)
    segments = Segments(b, [2, 9], monkeypatch)
    b.state[NOW], b.ends[:] = 10.0, 99.0
    clock._start_motion(b)
    assert [block for block, _ in segments.cuts] == [0, 0, 1, 1, 1]
    assert b.counts[[RUNNING, MADE, DONE]].tolist() == [1, 5, 1]
    began = 10.0 + 5 * 2.0 * CUT
    assert b.state[BEGAN] == pytest.approx(began)
    assert b.state[ENDS] == pytest.approx(began + 5.0)
    assert b.state[NOW] == pytest.approx(10.0 + 2.0 * (5 * CUT + 2 * LOAD))
    # A start while the motors run, and one without blocks, do nothing.
    before = b.state.copy()
    clock._start_motion(b)
    assert b.state.tolist() == before.tolist()
    empty = board()
    clock._start_motion(empty)
    assert empty.counts[RUNNING] == 0
    # The start of the first motion stays.
    b.counts[RUNNING] = 0
    b.state[NOW] = 50.0
    clock._start_motion(b)
    assert b.state[BEGAN] == pytest.approx(began)


def test_a_replanned_block_takes_the_time_of_a_started_one(monkeypatch: pytest.MonkeyPatch) -> None:
    b = board()
    Segments(b, [9], monkeypatch)
    b.counts[[RUNNING, BEGUN, CHANGED]] = 1
    b.ends[:] = [-1.0, -1.0, 5.0, 5.0, 5.0]
    b.state[ENDS] = 5.0
    clock._prepare_segments(b)
    assert b.state[NOW] == pytest.approx(2 * CUT + LOAD)
    assert b.counts[[CHANGED, MADE]].tolist() == [0, 2]


def test_motors_that_have_no_segment_stop_and_stay_locked(monkeypatch: pytest.MonkeyPatch) -> None:
    b = board(lock_s=0.25)
    Segments(b, [1], monkeypatch)
    b.counts[RUNNING] = 1
    b.state[[NOW, ENDS]] = 3.0, 3.0
    b.ends[:] = 9.0
    clock._prepare_segments(b)
    assert (b.counts[RUNNING], b.state[NOW]) == (1, 3.0)
    b.state[NOW] = 3.5
    clock._prepare_segments(b)
    assert (b.counts[RUNNING], b.state[NOW], b.counts[MADE]) == (0, 3.75, 0)


def test_running_until_a_time_prepares_segments_as_they_become_free(monkeypatch: pytest.MonkeyPatch) -> None:
    b = board(pace=0.0)
    segments = Segments(b, [9], monkeypatch)
    clock._start_motion(b)
    clock._run_until(b, 2.5)
    # The first five at once; the sixth once the first has ended, after 1 s, the seventh after 2 s.
    assert [at for _, at in segments.cuts] == [0.0] * 5 + [1.0, 2.0]
    assert b.state[NOW] == 2.5
    clock._run_until(b, 2.0)
    assert b.state[NOW] == 2.5
    clock._run_until(b, 20.0)
    assert len(segments.cuts) == 9
    # The motors end after 9 s, and stay locked for 0.25 s, within the 20 s.
    assert (b.counts[RUNNING], b.state[NOW], b.state[ENDS]) == (0, 20.0, 9.0)
    # At rest, time passes.
    clock._run_until(b, 21.0)
    assert b.state[NOW] == 21.0


def test_the_lock_after_the_last_segment_may_end_later(monkeypatch: pytest.MonkeyPatch) -> None:
    b = board(pace=0.0, lock_s=0.25)
    Segments(b, [3], monkeypatch)
    clock._start_motion(b)
    clock._run_until(b, 3.1)
    assert (b.counts[RUNNING], b.state[NOW]) == (0, pytest.approx(3.25))


def test_waiting_for_rest_runs_all_blocks_and_the_lock(monkeypatch: pytest.MonkeyPatch) -> None:
    b = board(pace=0.0, lock_s=0.25)
    segments = Segments(b, [2, 7], monkeypatch)
    clock._wait_until_at_rest(b)
    assert [at for _, at in segments.cuts] == [0.0] * 5 + [1.0, 2.0, 3.0, 4.0]
    assert (b.counts[RUNNING], b.state[NOW]) == (0, 9.25)
    assert b.done[:2].tolist() == [2.0, 9.0]
    clock._wait_until_at_rest(b)
    assert b.state[NOW] == 9.25
    # A machine that has come to rest before waits for nothing.
    b.counts[RUNNING] = 1
    b.state[NOW] = 30.0
    clock._wait_until_at_rest(b)
    assert b.state[NOW] == 30.25


def test_a_full_planner_waits_for_its_oldest_block(monkeypatch: pytest.MonkeyPatch) -> None:
    b = board(n=20, pace=0.0)
    segments = Segments(b, [7] + [1] * 14, monkeypatch)
    clock._wait_for_free_block(b)
    # Fifteen blocks: the seventh segment of the first is cut when the second has ended.
    assert [at for _, at in segments.cuts] == [0.0] * 5 + [1.0, 2.0]
    assert (b.counts[DONE], b.state[NOW], b.counts[RUNNING]) == (1, 2.0, 1)
    few = board(n=20, pace=0.0)
    Segments(few, [7] + [1] * 13, monkeypatch)
    clock._wait_for_free_block(few)
    assert (few.counts[RUNNING], few.state[NOW]) == (0, 0.0)


class Program:
    """Runs the main program with moves that take no time, and keeps the points of their blocks."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.points: list[list[float]] = []
        self.given: list[tuple[Any, ...]] = []
        self.waited = 0

        def add(_: Board, end: np.ndarray, *given: Any) -> None:
            self.points.append(end.tolist())
            self.given.append(given)

        def wait(_: Board) -> None:
            self.waited += 1

        monkeypatch.setattr(clock, "_add_block", add)
        monkeypatch.setattr(clock, "_wait_for_free_block", wait)

    def run(self, b: Board, **given: Any) -> np.ndarray:
        """Run items; return the times of the answers to their lines."""
        n, m = len(b.done), len(given.get("feed", []))
        none = np.zeros((m, 3))
        columns: dict[str, Any] = {
            "move": np.full(n, -1), "size": np.zeros(n, dtype=np.int64), "words": np.zeros(n, dtype=np.int64),
            "stops": np.zeros(n, dtype=bool), "wait": np.zeros(n), "place": np.zeros((m + 1, 3)), "feed": np.zeros(m),
            "chords": np.ones(m, dtype=np.int64), "spin": np.zeros(m), "out": none, "across": none, "rise": none,
        }  # fmt: skip
        columns |= {name: np.array(values) for name, values in given.items()}
        answered = np.zeros(n)
        clock.simulate_board(b, *columns.values(), LIMITS, 0.02, answered, np.zeros(3))
        return answered


def test_lines_are_sent_while_the_board_has_room_for_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """1 ms a byte; 127 bytes may be on their way. A line is read once its last byte has come; its answer lets the
    sender send more after 0.6 ms.
    """
    size, words = [50, 60, 0, 40, 90, 5], [4, 5, 0, 3, 6, 1]
    answered = Program(monkeypatch).run(board(6), size=size, words=words)
    sent = now = freed = 0.0
    waiting: list[int] = []
    expected: dict[int, float] = {}
    for i, (n_bytes, n_words) in enumerate(zip(size, words, strict=True)):
        if not n_bytes:
            continue
        waiting.append(i)
        while sum(size[k] for k in waiting) > 127 and len(waiting) > 1:
            freed = expected[waiting.pop(0)]
        sent = max(sent, freed + 0.6e-3) + 0.001 * n_bytes
        now = max(now, sent) + 0.15e-3 + 0.09e-3 * n_words + 15e-6 * n_bytes
        expected[i] = now
    assert {i: answered[i] for i in expected} == pytest.approx(expected)
    assert answered[2] == 0.0


def test_exactly_the_room_of_the_board_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines of 100 and 27 bytes are on their way together; with one byte more, the second waits for the answer."""
    for last, waits in ((27, False), (28, True)):
        first, second = Program(monkeypatch).run(board(2), size=[100, last], words=[0, 0])
        read = 0.0006 + 0.1 + 0.15e-3 + 100 * 15e-6
        assert first == pytest.approx(read)
        arrives = (read + 0.0006 if waits else 0.1006) + 0.001 * last
        assert second == pytest.approx(max(arrives, read) + 0.15e-3 + last * 15e-6)


def test_the_rest_of_a_line_is_answered_with_its_last_item(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stop of 2 s that belongs to the line before it delays the answer of that line."""
    b = board(3)
    answered = Program(monkeypatch).run(
        b, size=[10, 0, 10], words=[1, 0, 1], stops=[False, True, False], wait=[0, 2, 9]
    )
    read = 0.0006 + 0.01 + 0.15e-3 + 0.09e-3 + 10 * 15e-6
    assert answered[0] == pytest.approx(read + 2.0)
    assert b.done.tolist() == [-1.0, pytest.approx(read + 2.0), -1.0]
    assert answered[2] == pytest.approx(read + 2.0 + read - 0.0106)


def test_arcs_become_chords_on_their_circle_which_end_at_the_given_place(monkeypatch: pytest.MonkeyPatch) -> None:
    """A straight move, a quarter of a circle of 10 mm in three chords that rises 3 mm, and another straight move."""
    b, program = board(3), Program(monkeypatch)
    program.run(
        b,
        move=[0, 1, 2],
        feed=[5.0, 6.0, math.inf],
        chords=[1, 3, 1],
        spin=[0.0, math.pi / 6, 0.0],
        place=[(0, 0, 0), (10, 0, 0), (0, 10.5, 3), (1, 1, 1)],
        out=[(0, 0, 0), (10, 0, 0), (0, 0, 0)],
        across=[(0, 0, 0), (0, 10, 0), (0, 0, 0)],
        rise=[(0, 0, 0), (0, 0, 1), (0, 0, 0)],
    )
    sine, cosine = 10 * math.sin(math.pi / 6), 10 * math.cos(math.pi / 6)
    expected = [[10, 0, 0], [cosine, sine, 1], [sine, cosine, 2], [0, 10.5, 3], [1, 1, 1]]
    assert np.array(program.points) == pytest.approx(np.array(expected))
    assert [(feed, deviation, owner) for feed, _, deviation, owner in program.given] == [
        (5.0, 0.02, 0),
        (6.0, 0.02, 1),
        (6.0, 0.02, 1),
        (6.0, 0.02, 1),
        (math.inf, 0.02, 2),
    ]
    assert all(limits is LIMITS for _, limits, *_ in program.given)
    assert program.waited == 5
    # Each chord of an arc takes 0.13 ms.
    assert b.state[NOW] == pytest.approx(3 * 0.13e-3)


def test_a_motion_starts_when_no_line_is_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first line's move runs while the second line is on its way; at the end all motion is over."""
    b = board(2, byte_s=0.1, lock_s=0.5, pace=1.0)
    Program(monkeypatch)
    segments = Segments(b, [4], monkeypatch)
    none = np.zeros((0, 3))
    clock.simulate_board(
        b,
        np.array([-1, -1]),
        np.array([10, 10]),
        np.array([0, 0]),
        np.zeros(2, dtype=bool),
        np.zeros(2),
        np.zeros((1, 3)),
        np.zeros(0),
        np.zeros(0, dtype=np.int64),
        np.zeros(0),
        none,
        none,
        none,
        LIMITS,
        0.02,
        np.zeros(2),
        np.zeros(3),
    )
    assert segments.cuts[0] == (0, 0.0)
    assert b.done[0] == pytest.approx(5 * CUT + 4.0)
    assert b.state[NOW] == pytest.approx(5 * CUT + 4.0 + 0.5)
