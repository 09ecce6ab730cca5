"""Detect blocks that LinuxCNC rejects although their meaning is clear (confirmed with rs274)."""

from __future__ import annotations

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.state import AXES, InterpreterState
from leafcut.gcode.word_groups import ENDS_TRANSFORM, GROUP_OF, NO_MOTION, OTHER_AXES, SortedBlock
from leafcut.gcode.words import Word

_FAMILIES = frozenset({"linuxcnc", "plasma", "qtplasmac"})
#: G codes of other controllers, in tenths. Of these, LinuxCNC only has G8 (lathes: radius mode).
_UNKNOWN_CODES = (NO_MOTION | ENDS_TRANSFORM) - {80}
_MOTIONS = frozenset(code for code, group in GROUP_OF.items() if group in ("motion", "cycle"))
#: Codes that use a P word, and codes that use a Q word: G codes in tenths, and M codes.
_TAKES_P = (
    frozenset({20, 30, 40, 50, 52, 100, 640, 740, 760, 820, 840, 860, 880, 890}),
    frozenset({19, 50, 51, 52, 53, 62, 63, 64, 65, 66, 98, *range(100, 200)}),
)
_TAKES_Q = frozenset({50, 100, 640, 730, 760, 830}), frozenset({19, 61, 66, 67, 68, *range(100, 200)})


def is_linuxcnc(dialect: Dialect) -> bool:
    """Return whether LinuxCNC reads a dialect."""
    return dialect.family in _FAMILIES


def linuxcnc_refuses_words(words: tuple[Word, ...]) -> bool:
    """Return whether a block contains the same G or M word twice, both M7 and M8, or N or O after another word."""
    codes = [(word.letter, word.value) for word in words if word.letter in "GM"]
    letters = [word.letter for word in words]
    numbered = letters[0] == "N"
    misplaced = "N" in letters[1:] or "O" in letters[1 + numbered :]
    return misplaced or len(set(codes)) < len(codes) or {("M", 7.0), ("M", 8.0)} <= set(codes)


def linuxcnc_refuses(state: InterpreterState, words: SortedBlock) -> bool:
    """Return whether LinuxCNC rejects a block, given the state before the block. Updates `state.feed_forgotten`."""
    g, letters = words.g, words.letters
    starts = g.get("radius", 400) != 400
    again = starts and state.radius != 40
    strange = any(round(word.value * 10) in _UNKNOWN_CODES for word in words.unknown if word.letter == "G")
    # G94 and G95 cancel F even if they are active already.
    state.feed_forgotten = "F" not in letters and (state.feed_forgotten or g.get("feed mode") in (940, 950))
    lacks_feed = (state.feed_forgotten or state.feed == 0.0) and "F" not in letters
    inverse = g.get("feed mode", 10 * state.feed_mode) == 930
    unfed = ("F" not in letters if inverse else lacks_feed) and _moves_at_feed(state, words)
    two = "motion" in g and g.get("non-modal") in (280, 300)  # both would use the axis words
    torn = _breaks_compensation(state, words, starts=starts)
    return again or strange or unfed or torn or two or _lacks_words(state, words) or _has_spare_words(state, words)


def _breaks_compensation(state: InterpreterState, words: SortedBlock, *, starts: bool) -> bool:
    """Return whether LinuxCNC rejects the words of a block because cutter compensation is active.

    `starts` means that the block itself starts the compensation. Compensation works in the XY and XZ planes.
    """
    g, letters = words.g, words.letters
    on, plane = state.radius in (41, 42), g.get("plane", 10 * state.plane)
    changed = not g.keys().isdisjoint(("length", "offset", "retract")) or (starts and "L" in letters)
    if (changed and (starts or on)) or (on and plane != 10 * state.plane) or (starts and plane == 190):
        return True
    sets_active_offset = g.get("non-modal") == 100 and "L" in letters and letters["L"].value in (2.0, 20.0)
    return on and (
        g.get("non-modal") in (280, 300, 520, 920)
        or (g.get("non-modal") == 530 and state.register != 0.0)
        or sets_active_offset
        or g.get("cycle", 800) != 800
        or ("path" in g and g["path"] != state.blending)
        or "tool change" in words.m
    )


def _lacks_words(state: InterpreterState, words: SortedBlock) -> bool:
    """Return whether a code in a block lacks a required word or state, or a word is out of range."""
    g, letters = words.g, words.letters
    radius, cycle = g.get("radius"), g.get("cycle")
    number = letters.get("D")
    if radius in (411, 421) and number is None:
        return True
    if radius in (410, 420) and number is not None and number.value != int(number.value):
        return True
    if cycle in (860, 890) and "P" not in letters and state.cycle != cycle // 10:
        return True
    # Taps need M3, and G86 stops a turning spindle.
    turning = {3: 1, 4: -1, 5: 0}[words.m["spindle"][0]] if "spindle" in words.m else state.spindle
    if (cycle == 840 and turning != 1) or (cycle == 860 and turning == 0):
        return True
    if g.get("motion") == 53 and state.unknown_motion != "G5.2":
        return True
    sets_offset = g.get("non-modal") == 100 and letters.keys() >= {"L", "P"} and letters["L"].value in (2.0, 20.0)
    return sets_offset and letters["P"].value > 9.0


def _has_spare_words(state: InterpreterState, words: SortedBlock) -> bool:
    """Return whether a block has a P or Q word that none of its codes uses."""
    unknown = words.unknown
    # The blocks after G5.2 are control points.
    if state.unknown_motion == "G5.2" or any(word.letter == "G" for word in unknown):
        return False
    active = state.cycle if state.cycle is not None else state.motion
    codes = set(words.g.values())
    if codes.isdisjoint(_MOTIONS) and not words.letters.keys().isdisjoint((*AXES, *OTHER_AXES, "I", "J", "K")):
        codes.add(10 * (active or 0))
    outputs = {code for group in words.m.values() for code in group} | {round(word.value) for word in unknown}
    return any(
        letter in words.letters and codes.isdisjoint(g_codes) and outputs.isdisjoint(m_codes)
        for letter, (g_codes, m_codes) in (("P", _TAKES_P), ("Q", _TAKES_Q))
    )


def _moves_at_feed(state: InterpreterState, words: SortedBlock) -> bool:
    g = words.g
    active = state.cycle if state.cycle is not None else state.motion
    chosen = g.get("cycle", g.get("motion", active))
    moving = not words.letters.keys().isdisjoint((*AXES, *OTHER_AXES))
    return g.get("motion") == 10 or (moving and chosen not in (None, 0, 800))
