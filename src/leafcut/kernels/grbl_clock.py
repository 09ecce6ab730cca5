"""Simulate a GRBL 1.1 board to compute cycle times.

The board's processor reads lines, plans blocks, and divides the blocks into segments.

The main program does one thing at a time. It reads a line once the last byte of the line has arrived over the serial
connection. Each move of the line becomes a block in the planner, which holds 15 blocks. If the planner is full, the
line has to wait. At certain points, the main program prepares up to 5 segments of the oldest block in advance. A motion
starts when the planner is full, when no input is waiting, or when a command waits for the machine to stop. The last
planned block always ends at rest. If lines arrive slowly, the planner contains few blocks, and the machine only moves
as fast as it can still stop within these blocks.

Source: GRBL 1.1h (gnea/grbl: planner.c, stepper.c, motion_control.c, protocol.c, config.h). We compared the simulation
with this firmware on a simulated board (`python -m benchmarks grbl_time`). Units: mm, s.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.kernels import inner_kernel, kernel

#: The planner holds this many blocks (BLOCK_BUFFER_SIZE - 1) and this many prepared segments (SEGMENT_BUFFER_SIZE - 1).
BLOCKS, SEGMENTS = 15, 5
#: Size of the ring of blocks. A power of two makes the modulo fast.
PLACES = 16
#: A segment lasts this many seconds (ACCELERATION_TICKS_PER_SECOND) and has at least this many steps.
SEGMENT_S, SEGMENT_STEPS = 0.01, 1.25
#: The simulation merges the segments of a long move at constant speed, except in the last part of the move, which lasts
#: this many seconds.
SOON_S = 1.0
#: Clock frequency of the processor in Hz, and longest tick of its timer. Slow steps take 2, 4, or 8 ticks.
CLOCK, LONGEST_TICK = 16e6, 65535
#: A sender may have this many bytes in transit. The receive buffer holds 128 bytes.
ON_THE_WAY = 127
#: GRBL raises slower feeds to this value, mm/s (MINIMUM_FEED_RATE).
SLOWEST = 1.0 / 60.0
#: Cosine above which a move counts as a straight continuation. The negative value is the limit for a reversal.
STRAIGHT = 0.999999

#: Processor times in seconds. First line: per program line, per word of a line, per byte of a line, and per chord.
#: Second line: per block, per moving axis of a block, per corner, and per replanned block.
#: Third line: per started or replanned block, per segment, and per tick of the stepper timer.
LINE_S, WORD_S, BYTE_S, CHORD_S = 0.15e-3, 0.09e-3, 15e-6, 0.13e-3
BLOCK_S, AXIS_S, CORNER_S, PLAN_S = 0.27e-3, 0.19e-3, 0.37e-3, 55e-6
LOAD_S, CUT_S, TICK_S = 0.27e-3, 0.33e-3, 22e-6
#: Time from the board's answer until the sender's next line, in seconds. It includes four bytes of answer and the
#: sender's reaction time.
ANSWER_S = 0.6e-3

# Columns of the ring of blocks: remaining length, mm; acceleration; requested speed; squares of the maximum and of the
# planned entry speed; steps per mm of the dominant axis; and the item to which the block belongs.
LEFT, RATE, NOMINAL, MOST2, ENTRY2, PER_MM, OWNER = range(N_COLUMNS := 7)
# State: time of the main program; end of the last segment; speed and remaining steps at its end; time of the last
# partial step; share of the processor time that stepper interrupts leave; start of the first motion.
NOW, ENDS, SPEED, STEPS, REST, SHARE, BEGAN = range(N_STATE := 7)
# Counters: blocks that are segmented, planned, and finally planned; prepared segments; whether the motors run; whether
# the oldest block has started, and whether it is replanned.
DONE, PLANNED, FIXED, MADE, RUNNING, BEGUN, CHANGED = range(N_COUNT := 7)


class Board(NamedTuple):
    """Settings and memory of a running board.

    byte_s  float            time per byte over the serial line, s
    lock_s  float            time that the motors stay locked after a motion, s ($1)
    pace    float            factor on the processor times
    ring    float64[16, 7]   blocks
    state   float64[7]
    counts  int64[7]
    ends    float64[5]       ends of the last segments, s
    unit    float64[2, 3]    directions of the last block and of the next block
    steps   float64[3]       end of the last block
    done    float64[n]       end of each item, s
    """

    byte_s: float
    lock_s: float
    pace: float
    ring: NDArray
    state: NDArray
    counts: NDArray
    ends: NDArray
    unit: NDArray
    steps: NDArray
    done: NDArray


def new_board(n_items: int, byte_s: float, lock_s: float, pace: float) -> Board:
    """Create a board at rest, with memory for the end times of `n_items` items."""
    state, count = np.zeros(N_STATE), np.zeros(N_COUNT, dtype=np.int64)
    state[SHARE] = 1.0
    memory = (np.zeros((PLACES, N_COLUMNS)), state, count, np.zeros(SEGMENTS), np.zeros((2, 3)), np.zeros(3))
    return Board(byte_s, lock_s, pace, *memory, np.full(n_items, -1.0))


@inner_kernel
def _spend_time(board: Board, seconds: float) -> None:
    """Let the main program spend `seconds` of processor time. This takes longer while the motors are running."""
    board.state[NOW] += board.pace * seconds / (board.state[SHARE] if board.counts[RUNNING] else 1.0)


@inner_kernel
def _next_free_segment(board: Board) -> float:
    """Return the time in seconds at which another segment fits into the buffer."""
    when: float = board.ends[board.counts[MADE] % SEGMENTS]
    return when


@inner_kernel
def _queue_segment(board: Board, remaining: float, speed: float, time: float) -> None:
    """Prepare a segment of the oldest block. The segment is rounded to whole steps with equal ticks.

    remaining float  length of the block that remains after the segment, mm
    speed     float  speed at the end of the segment, mm/s
    time      float  intended duration, s
    """
    ring, state, count = board.ring, board.state, board.counts
    at = count[DONE] % PLACES
    exact = ring[at, PER_MM] * remaining
    whole = math.ceil(exact - 1e-6)
    per_step = (time + state[REST]) / max(state[STEPS] - exact, 1e-6)
    cycles = math.ceil(per_step * CLOCK)
    ticks = 1 if cycles < 2000 else 2 if cycles < 4000 else 4 if cycles < 8000 else 8
    tick = min(cycles // ticks, LONGEST_TICK) + 1
    state[ENDS] += (state[STEPS] - whole) * ticks * tick / CLOCK
    state[SHARE] = max(1.0 - TICK_S * CLOCK / tick, 0.1)
    state[SPEED], state[STEPS], state[REST] = speed, whole, (whole - exact) * per_step
    board.ends[count[MADE] % SEGMENTS] = state[ENDS]
    count[MADE] += 1
    ring[at, LEFT] = remaining
    if remaining == 0.0:
        board.done[int(ring[at, OWNER])] = state[ENDS]
        count[DONE] += 1
        count[BEGUN] = 0


@inner_kernel
def _prepare_next_segment(board: Board) -> None:
    ring, state, count = board.ring, board.state, board.counts
    at = count[DONE] % PLACES
    remaining, rate, per_mm = ring[at, LEFT], ring[at, RATE], ring[at, PER_MM]
    if not count[BEGUN]:
        count[BEGUN] = 1
        state[SPEED], state[STEPS], state[REST] = math.sqrt(ring[at, ENTRY2]), math.ceil(per_mm * remaining - 1e-6), 0.0
    speed = state[SPEED]
    exit2 = ring[(at + 1) % PLACES, ENTRY2] if count[DONE] + 1 < count[PLANNED] else 0.0
    exit_speed = math.sqrt(exit2)
    peak = min(ring[at, NOMINAL], math.sqrt(0.5 * (2.0 * rate * remaining + speed * speed + exit2)))
    peak = max(peak, speed, exit_speed)
    slow_from = 0.5 * (peak * peak - exit2) / rate
    min_remaining = max(remaining - SEGMENT_STEPS / per_mm, 0.0)
    time, limit, needed = 0.0, SEGMENT_S, 0.0
    cruise_s = (remaining - slow_from) / peak - SOON_S
    if cruise_s > SOON_S and speed >= peak * (1.0 - 1e-9):
        limit = math.floor(cruise_s / SEGMENT_S) * SEGMENT_S
    while remaining > 0.0:
        span = limit - time
        if speed < peak * (1.0 - 1e-9) and remaining > slow_from:
            needed = min((peak - speed) / rate, 2.0 * remaining / (peak + speed))
            if needed <= span:
                remaining = max(remaining - 0.5 * (speed + peak) * needed, slow_from)
                speed = peak
            else:
                remaining -= span * (speed + 0.5 * rate * span)
                speed += rate * span
        elif remaining > slow_from * (1.0 + 1e-9) + 1e-12:
            needed = (remaining - slow_from) / peak
            remaining = slow_from if needed <= span else remaining - peak * span
        else:
            needed = 2.0 * remaining / (speed + exit_speed) if speed + exit_speed > 0.0 else 0.0
            if needed <= span:
                remaining, speed = 0.0, exit_speed
            else:
                remaining -= span * (speed - 0.5 * rate * span)
                speed -= rate * span
        time += min(needed, span)
        if time >= limit - 1e-12:
            if remaining <= min_remaining:
                break
            limit += SEGMENT_S
    _queue_segment(board, remaining if remaining > 1e-9 else 0.0, speed, time)


@inner_kernel
def _prepare_segments(board: Board) -> None:
    """Prepare segments while the buffer has space for them, and detect whether the motors have run out of segments."""
    state, count = board.state, board.counts
    while count[RUNNING]:
        if state[NOW] > state[ENDS]:
            count[RUNNING] = 0
            state[NOW] += board.lock_s
        elif count[DONE] < count[PLANNED] and _next_free_segment(board) <= state[NOW]:
            starts_block = not count[BEGUN] or count[CHANGED]
            count[CHANGED] = 0
            _prepare_next_segment(board)
            _spend_time(board, CUT_S + LOAD_S if starts_block else CUT_S)
        else:
            break


@inner_kernel
def _start_motion(board: Board) -> None:
    count = board.counts
    if not count[RUNNING] and count[DONE] < count[PLANNED]:
        count[RUNNING] = 1
        board.ends[:] = -1.0
        board.state[ENDS] = board.state[NOW] + SEGMENTS * CUT_S * board.pace
        if count[MADE] == 0:
            board.state[BEGAN] = board.state[ENDS]
        _prepare_segments(board)


@inner_kernel
def _run_until(board: Board, until: float) -> None:
    state, count = board.state, board.counts
    _prepare_segments(board)
    while count[RUNNING] and state[NOW] < until:
        next_event = _next_free_segment(board) if count[DONE] < count[PLANNED] else state[ENDS] + 1e-9
        state[NOW] = max(state[NOW], min(next_event, until))
        _prepare_segments(board)
    state[NOW] = max(state[NOW], until)


@inner_kernel
def _wait_until_at_rest(board: Board) -> None:
    state, count = board.state, board.counts
    while count[DONE] < count[PLANNED]:
        _start_motion(board)
        if count[RUNNING] and count[DONE] < count[PLANNED]:
            state[NOW] = max(state[NOW], _next_free_segment(board))
        _prepare_segments(board)
    if count[RUNNING]:
        state[NOW] = max(state[NOW], state[ENDS]) + board.lock_s
        count[RUNNING] = 0


@inner_kernel
def _wait_for_free_block(board: Board) -> None:
    state, count = board.state, board.counts
    _prepare_segments(board)
    while count[PLANNED] - count[DONE] >= BLOCKS:
        _start_motion(board)
        if count[RUNNING] and count[PLANNED] - count[DONE] >= BLOCKS:
            state[NOW] = max(state[NOW], _next_free_segment(board))
        _prepare_segments(board)


@inner_kernel
def _replan_blocks(board: Board) -> int:
    """Replan after adding a block, and return the number of blocks visited.

    The backward pass starts at the last block, which ends at rest, and goes back to the first block that may change.
    The forward pass follows.
    """
    ring, state, count = board.ring, board.state, board.counts
    first, last = max(count[FIXED], count[DONE]), count[PLANNED] - 1
    count[FIXED] = first
    out2 = 0.0
    for i in range(last, first, -1):
        at = i % PLACES
        out2 = min(ring[at, MOST2], out2 + 2.0 * ring[at, RATE] * ring[at, LEFT])
        ring[at, ENTRY2] = out2
    if first == count[DONE] and count[BEGUN] and last > first:
        ring[first % PLACES, ENTRY2] = state[SPEED] * state[SPEED]
        count[CHANGED] = 1
    for i in range(first, last):
        at, after = i % PLACES, (i + 1) % PLACES
        reached2 = ring[at, ENTRY2] + 2.0 * ring[at, RATE] * ring[at, LEFT]
        if reached2 < ring[after, ENTRY2]:
            ring[after, ENTRY2] = reached2
            count[FIXED] = i + 1
        if ring[after, ENTRY2] == ring[after, MOST2]:
            count[FIXED] = i + 1
    visited: int = last - first
    return visited


@inner_kernel
def _limit_along_direction(limits: NDArray, unit: NDArray) -> float:
    """Compute the maximum velocity or acceleration along a unit vector that respects the limits of all axes."""
    result = math.inf
    for axis in range(3):
        if unit[axis] != 0.0:
            result = min(result, limits[axis] / abs(unit[axis]))
    return result


@inner_kernel
def _squared_corner_speed(board: Board, acceleration: NDArray, deviation: float) -> float:
    """Compute the square of the maximum speed at the corner between the last block and the next block, (mm/s)²."""
    before, after = board.unit[0], board.unit[1]
    cosine = -(before[0] * after[0] + before[1] * after[1] + before[2] * after[2])
    if cosine > STRAIGHT:
        return 0.0
    if cosine < -STRAIGHT:
        return math.inf
    size = 0.0
    for axis in range(3):
        size += (after[axis] - before[axis]) ** 2
    size = math.sqrt(size)
    limit = math.inf
    for axis in range(3):
        bend = abs(after[axis] - before[axis])
        if bend > 0.0:
            limit = min(limit, acceleration[axis] * size / bend)
    sine = math.sqrt(0.5 * (1.0 - cosine))
    return limit * deviation * sine / (1.0 - sine)


@inner_kernel
def _add_block(board: Board, end: NDArray, feed: float, limits: NDArray, deviation: float, owner: int) -> None:
    """Add a straight move to position `end` to the planner. Moves of less than one step are dropped.

    end     float64[3]      mm
    limits  float64[3, 3]   steps per mm, maximum speed, acceleration of each axis
    """
    ring, count, unit = board.ring, board.counts, board.unit
    n_steps, length2 = 0.0, 0.0
    for axis in range(3):
        steps = math.floor(end[axis] * limits[0, axis] + 0.5 + 1e-7)
        moved = steps - board.steps[axis]
        n_steps = max(n_steps, abs(moved))
        unit[1, axis] = moved / limits[0, axis]
        length2 += unit[1, axis] * unit[1, axis]
        board.steps[axis] = steps
    if n_steps == 0.0:
        return
    length = math.sqrt(length2)
    for axis in range(3):
        unit[1, axis] /= length
    fastest = _limit_along_direction(limits[1], unit[1])
    nominal = max(min(feed, fastest), SLOWEST)
    at, before = count[PLANNED] % PLACES, (count[PLANNED] - 1) % PLACES
    corner2, seconds = 0.0, BLOCK_S
    if count[DONE] < count[PLANNED]:
        corner2 = _squared_corner_speed(board, limits[2], deviation)
        seconds += CORNER_S if corner2 < math.inf else 0.0
        corner2 = min(corner2, nominal**2, ring[before, NOMINAL] ** 2)
    ring[at, LEFT] = length
    ring[at, RATE] = _limit_along_direction(limits[2], unit[1])
    ring[at, NOMINAL] = nominal
    ring[at, MOST2] = corner2
    ring[at, ENTRY2] = 0.0
    ring[at, PER_MM] = n_steps / length
    ring[at, OWNER] = owner
    for axis in range(3):
        seconds += AXIS_S if unit[1, axis] != 0.0 else 0.0
        unit[0, axis] = unit[1, axis]
    count[PLANNED] += 1
    _spend_time(board, seconds + PLAN_S * _replan_blocks(board))


@kernel
def simulate_board(
    board: Board,
    move: NDArray,
    size: NDArray,
    words: NDArray,
    stops: NDArray,
    wait: NDArray,
    place: NDArray,
    feed: NDArray,
    chords: NDArray,
    spin: NDArray,
    out: NDArray,
    across: NDArray,
    rise: NDArray,
    limits: NDArray,
    deviation: float,
    answered: NDArray,
    point: NDArray,
) -> None:
    """Simulate how the controller executes items (moves, stops, lines), and compute when each item ends.

    move       int64[n]           move of the item, or -1 for none
    size       int64[n]           number of bytes of the line that starts with the item, or 0 for none
    words      int64[n]           number of words of that line
    stops      bool[n]            the machine must stop before the item
    wait       float64[n]         dwell after the stop, s
    place      float64[m + 1, 3]  move i goes from position i to position i + 1, mm
    feed       float64[m]         mm/s; inf for a rapid
    chords     int64[m]           number of chords of the move
    spin       float64[m]         angle per chord of an arc, rad
    out        float64[m, 3]      vector from the centre of an arc to its start, mm
    across     float64[m, 3]      the same vector, rotated by a quarter turn, mm
    rise       float64[m, 3]      advance per chord of a helix along its axis, mm
    limits     float64[3, 3]      steps per mm, maximum speed, acceleration of each axis
    deviation  float              junction deviation, mm ($11)
    answered   float64[n]         work array: time of the answer to each line, s
    point      float64[3]         work array

    Changes: board, answered, point.
    Source: GRBL 1.1h, see above. Differs: double precision; processor times are means.
    """
    state = board.state
    line, oldest, bytes_waiting, sent, freed_at = 0, 0, 0, 0.0, 0.0
    for i in range(len(move)):
        if size[i] > 0:
            bytes_waiting += size[i]
            while bytes_waiting > ON_THE_WAY and oldest < i:
                bytes_waiting -= size[oldest]
                if size[oldest] > 0:
                    freed_at = answered[oldest]
                oldest += 1
            line = i
            sent = max(sent, freed_at + ANSWER_S * board.pace) + size[i] * board.byte_s
            if state[NOW] < sent:
                _start_motion(board)
                _run_until(board, sent)
            _prepare_segments(board)
            _spend_time(board, LINE_S + words[i] * WORD_S + size[i] * BYTE_S)
        if stops[i]:
            _wait_until_at_rest(board)
            state[NOW] += wait[i]
            board.done[i] = state[NOW]
        k = move[i]
        if k >= 0:
            for chord in range(1, chords[k] + 1):
                for axis in range(3):
                    if chord == chords[k]:
                        point[axis] = place[k + 1, axis]
                    else:
                        angle = spin[k] * chord
                        point[axis] = (
                            place[k, axis]
                            + out[k, axis] * (math.cos(angle) - 1.0)
                            + across[k, axis] * math.sin(angle)
                            + rise[k, axis] * chord
                        )
                _wait_for_free_block(board)
                _add_block(board, point, feed[k], limits, deviation, i)
                _spend_time(board, CHORD_S if chords[k] > 1 else 0.0)
        answered[line] = state[NOW]
    _wait_until_at_rest(board)
