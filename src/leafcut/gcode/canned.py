"""Convert the words of canned cycles to `DrillCycle` rows. `model.cycles` expands cycles into single motions.

In RS274/NGC (3.5.16), Z is the bottom of the hole, and R is the plane where rapid changes to feed. Q is the peck depth,
and P is the dwell. In the Fagor 8055, Z is the plane, I is the bottom, and K is the dwell.

The tool may have to rise for the next hole of a series, because of G98 after G99 or because of a higher R. LinuxCNC
then moves to the hole on a slant (`DrillCycle.approach`). Other controllers cross at the current height, or rise to R
first.
"""

from __future__ import annotations

import math

from leafcut.gcode.state import CycleValues, InterpreterState, parse_whole_number
from leafcut.gcode.words import BlockError, UnclearBlock, Word
from leafcut.message import Message
from leafcut.model.cycles import DWELLING, PECKING
from leafcut.model.toolpath import DrillCycle

#: Maximum number of repeats or pecks. A larger number is an error in the program, and would exhaust the memory.
MAX_REPEATS = 9_999
#: Maximum number of holes of all repeated cycles in a program.
MAX_REPEATED_HOLES = 1_000_000
MAX_PECKS = 10_000


def activate_cycle(state: InterpreterState, number: int) -> None:
    """Activate a canned cycle. In RS274/NGC, a different cycle clears the words of the previous cycle."""
    if state.cycle != number and state.dialect.groups == "rs274":
        state.cycle_values = CycleValues()
    elif state.cycle != number:
        state.cycle_values.spare.clear()
    state.cycle = number


def end_cycle(state: InterpreterState) -> None:
    """End the active canned cycle after G80 or a move."""
    state.cycle = None
    state.cycle_values = CycleValues()
    state.path.end_cycles()


def drill_cycle_holes(state: InterpreterState, letters: dict[str, Word]) -> None:
    """Drill the hole of a block in a canned cycle. If the block states a number of repeats, drill that many holes."""
    if state.plane != 17:
        raise UnclearBlock("leafcut understands canned cycles only in the XY plane (G17)")
    if state.feed_mode == 93:
        raise BlockError("a canned cycle cannot be used in inverse time mode (G93)")
    x, y = state.path.position[:2]
    step_x, step_y = _hole_coordinate(state, letters, "X", x), _hole_coordinate(state, letters, "Y", y)
    cycle = _build_cycle(state, letters)
    repeats = _repeat_count(state, letters)
    feed = state.feed_for(letters, math.nan)
    if repeats > 1:
        state.repeated_holes += repeats
        if state.repeated_holes > MAX_REPEATED_HOLES:
            raise BlockError("repeated cycles drill more than {:,} holes; split the program", MAX_REPEATED_HOLES)
    for _ in range(repeats):
        x, y = (x + step_x, y + step_y) if state.incremental else (step_x, step_y)
        if math.isnan(x) or math.isnan(y):
            raise UnclearBlock("the position of the hole is unknown, because X and Y are not both given")
        state.path.drill(x, y, cycle, feed=feed, line=state.line)


def _hole_coordinate(state: InterpreterState, letters: dict[str, Word], letter: str, here: float) -> float:
    """Return the coordinate of a hole on an axis. With G91, return the step to the hole instead."""
    word = letters.pop(letter, None)
    if word is None:
        return 0.0 if state.incremental else here
    return state.mm(word)


def _repeat_count(state: InterpreterState, letters: dict[str, Word]) -> int:
    letter = state.dialect.repeat_letter
    if state.stores_cycles and letter == "K" and "K" not in letters:
        letter = "L"  # older Fanuc controls
    word = letters.pop(letter, None) if letter else None
    repeats = 1 if word is None else parse_whole_number(word, MAX_REPEATS)
    if repeats == 0 and not state.stores_cycles:
        raise BlockError("{}: a cycle with no repeats", word)
    return repeats


def _build_cycle(state: InterpreterState, letters: dict[str, Word]) -> DrillCycle:
    fagor = state.dialect.cycle_words == "fagor"
    name = f"G{state.cycle}"
    words = state.cycle_values
    _store_plane_words(state, letters, words, ("Z", "I") if fagor else ("R", "Z"))
    if "Q" in letters and (name in PECKING or not fagor):
        _record_spare_word(state, words, letters["Q"], name in PECKING)
        words.peck = _peck_in_mm(state, letters.pop("Q"))
    dwelling = name in (*state.dialect.dwell_cycles, "G86", "G89") or (fagor and name in ("G81", "G85"))
    if (dwelling or not fagor) and state.dialect.dwell_letter in letters:
        _record_spare_word(state, words, letters[state.dialect.dwell_letter], dwelling)
        words.dwell = state.dwell_seconds(letters.pop(state.dialect.dwell_letter))
        state.last_dwell = words.dwell if dwelling else state.last_dwell
    if fagor and name == "G81" and words.dwell is not None:
        name = "G82"
    elif fagor and name == "G85" and words.dwell:
        raise UnclearBlock("G85 with a dwell is not understood")
    r_plane, bottom = _plane_heights(state, words, fagor)
    peck = _checked_peck_depth(words, name, r_plane - bottom, state.stores_cycles)
    if name == "G82" and words.dwell is None and not state.stores_cycles:
        raise BlockError("G82 needs its dwell, {}", state.dialect.dwell_letter)
    dwell = words.dwell or 0.0
    if name == "G84" and words.dwell is None and state.dialect.groups == "rs274":
        # LinuxCNC 2.9 (rs274): a tap without P uses the dwell of the last cycle with P, even across G80.
        dwell = state.last_dwell
    # Unused words count: some controls dwell, and verification must notice that.
    waits = name in DWELLING or "P" in words.spare
    return DrillCycle(name, r_plane, bottom, state.to_initial, peck, dwell if waits else 0.0)


def _record_spare_word(state: InterpreterState, words: CycleValues, word: Word, used: bool) -> None:
    if not used:
        state.policy.handle_unknown(Message("{} has no meaning in this block", word))
        words.spare.add("Q" if word.letter == "Q" else "P")


def _peck_in_mm(state: InterpreterState, word: Word) -> float:
    """Return the peck depth Q of a cycle, mm.

    On many Fanuc controls, Q without a decimal point means thousandths even if X does not.
    """
    if state.dialect.point_required and "." not in word.text:
        raise UnclearBlock("{} has no decimal point: its unit differs between controls", word)
    return state.mm(word)


def _store_plane_words(
    state: InterpreterState, letters: dict[str, Word], words: CycleValues, names: tuple[str, str]
) -> None:
    """Store the words of the R plane and the bottom in the cycle.

    Earlier words are refused if their meaning has changed.
    """
    given = [name in letters for name in names]
    known = words.r is not None or words.z is not None
    changed = words.incremental != state.incremental or words.unit != state.unit
    if known and changed and not all(given):
        # RS274/NGC interprets the old numbers in the new mode, other controls in the old mode.
        if words.unit != state.unit:
            raise BlockError("units changed inside a cycle; give {} and {} again", names[0], names[1])
        raise UnclearBlock("G90/G91 changed inside a cycle; give {} and {} again", names[0], names[1])
    words.incremental, words.unit = state.incremental, state.unit
    if given[0]:
        words.r = state.mm(letters.pop(names[0]))
    if given[1]:
        words.z = state.mm(letters.pop(names[1]))


def _plane_heights(state: InterpreterState, words: CycleValues, fagor: bool) -> tuple[float, float]:
    """Return the heights of the R plane and of the bottom of the hole, mm.

    With G91, R is relative to the initial plane, and Z is relative to R.
    """
    initial = state.path.position[2] if state.path.initial_plane is None else state.path.initial_plane
    r, z = words.r, words.z
    if r is None and fagor and not math.isnan(initial):
        # "If not programmed, it assumes as reference plane the current position": manual, 9.7.
        r = 0.0 if state.incremental else initial
    if r is None or z is None:
        missing = (
            (Message("Z, its reference plane") if r is None else Message("I, its depth"))
            if fagor
            else ("R" if r is None else "Z")
        )
        raise BlockError("the cycle lacks {}", missing)
    if state.to_initial and math.isnan(initial):
        raise UnclearBlock("G98 returns to an unknown height; move Z before the cycle, or use G99")
    if state.incremental:
        if math.isnan(initial):
            raise UnclearBlock("R is incremental (G91), but the height of the tool is unknown")
        r += initial
        z += r
    if r < z:
        raise BlockError(
            "the cycle drills upwards, because its R plane at {:g} mm is below its bottom at {:g} mm", r, z
        )
    return r, z


def _checked_peck_depth(words: CycleValues, name: str, depth: float, may_lack: bool) -> float:
    if name not in PECKING:
        return words.peck or 0.0 if "Q" in words.spare else 0.0
    if words.peck is None or not words.peck > 0.0:
        raise (UnclearBlock if words.peck is None and may_lack else BlockError)(
            Message("{} needs a peck depth, a Q larger than 0", name)
        )
    if depth / words.peck > MAX_PECKS:
        raise BlockError("{} would peck {:.0f} times; Q is too small", name, depth / words.peck)
    return words.peck
