"""Blocks that LinuxCNC rejects although their meaning is clear (confirmed with rs274)."""

from __future__ import annotations

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.state import AXES, InterpreterState
from leafcut.gcode.word_groups import ENDS_TRANSFORM, NO_MOTION, OTHER_AXES, SortedBlock
from leafcut.gcode.words import Word

_FAMILIES = frozenset({"linuxcnc", "plasma", "qtplasmac"})
#: G codes of other controllers, in tenths. LinuxCNC has only G8 of them (lathes: radius mode).
_UNKNOWN_CODES = (NO_MOTION | ENDS_TRANSFORM) - {80}
#: Cycles that take P, and Q.
_TAKES_P, _TAKES_Q = frozenset({74, 76, 82, 84, 86, 88, 89}), frozenset({73, 76, 83})


def is_linuxcnc(dialect: Dialect) -> bool:
    """Return whether LinuxCNC reads programs of a dialect."""
    return dialect.family in _FAMILIES


def is_malformed(words: tuple[Word, ...]) -> bool:
    """Return whether a block has a G or M word twice, or N or O after another word."""
    codes = [(word.letter, word.value) for word in words if word.letter in "GM"]
    letters = [word.letter for word in words]
    numbered = letters[0] == "N"
    return "N" in letters[1:] or "O" in letters[1 + numbered :] or len(set(codes)) < len(codes)


def is_refused(state: InterpreterState, words: SortedBlock) -> bool:
    """Return whether LinuxCNC rejects a block, given the state before it. Changes: state.feed_forgotten."""
    g, letters = words.g, words.letters
    starts = g.get("radius", 400) != 400
    again = starts and state.radius != 40
    strange = any(round(word.value * 10) in _UNKNOWN_CODES for word in words.unknown or () if word.letter == "G")
    # G94 and G95 cancel F even if they are active already.
    state.feed_forgotten = "F" not in letters and (state.feed_forgotten or g.get("feed mode") in (940, 950))
    lacks_feed = (state.feed_forgotten or state.feed == 0.0) and "F" not in letters
    inverse = g.get("feed mode", 10 * state.feed_mode) == 930
    unfed = ("F" not in letters if inverse else lacks_feed) and _feeds(state, words)
    # Radius compensation allows no change of plane, length offset, work offset or return level of cycles.
    changed = not g.keys().isdisjoint(("length", "offset", "retract"))
    changed |= g.get("plane", 10 * state.plane) != 10 * state.plane
    torn = (changed or (starts and "L" in letters)) and (starts or state.radius in (41, 42))
    two = "motion" in g and g.get("non-modal") in (280, 300)  # both would use the axis words
    return again or strange or unfed or torn or two or _has_spare_words(state, words)


def _has_spare_words(state: InterpreterState, words: SortedBlock) -> bool:
    cycle, letters = words.g.get("cycle", 10 * (state.cycle or 0)) // 10, words.letters
    others = words.unknown or words.m or not words.g.keys().isdisjoint(("non-modal", "path"))
    if cycle in (0, 80) or others:
        return False
    return ("P" in letters and cycle not in _TAKES_P) or ("Q" in letters and cycle not in _TAKES_Q)


def _feeds(state: InterpreterState, words: SortedBlock) -> bool:
    g = words.g
    active = state.cycle if state.cycle is not None else state.motion
    chosen = g.get("cycle", g.get("motion", active))
    moving = not words.letters.keys().isdisjoint((*AXES, *OTHER_AXES))
    return g.get("motion") == 10 or (moving and chosen not in (None, 0, 800))
