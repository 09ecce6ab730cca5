"""Words that move the origin: G10, G52, G92 and related codes. The new position is known only if the word states it
(G92 X0, G10 L20 of the active frame); otherwise the axis is unknown until it is programmed again.
"""

from __future__ import annotations

from leafcut.gcode.state import AXES, InterpreterState, named_axes, whole
from leafcut.gcode.words import BlockError, UnclearBlock, Word

_G10, _G28_1, _G30_1, _G52, _G92 = 100, 281, 301, 520, 920
_G92_OFF = (921, 922, 923)


def chooses_origin(code: int) -> bool:
    """Return whether a G code, in tenths, moves the origin or stores a position."""
    return code in (_G10, _G28_1, _G30_1, _G52, _G92, *_G92_OFF)


def run_origin(state: InterpreterState, code: int, letters: dict[str, Word]) -> None:
    """Run a code that moves the origin: add a row SHIFT. Raises BlockError if a word is missing; UnclearBlock if the
    stored value is not in the program.
    """
    if code in _G92_OFF:
        # Before the first G92 of leafcut's own programs, there is nothing to cancel.
        if state.shift or state.keeps_unknown:
            state.move_origin((True, True, True))
    elif code in (_G92, _G52) and not any(named_axes(letters)):
        raise BlockError("G92 without an axis" if code == _G92 else "G52 without an axis")
    elif code == _G92:
        _, values = _take_axes(letters)
        state.move_origin((False, False, False), {axis: state.mm(word) for axis, word in values.items()})
    elif code in (_G28_1, _G30_1):
        raise UnclearBlock(f"G{code / 10:g} stores where the tool is")
    elif code == _G10:
        _set_table(state, letters)
    else:
        state.move_origin(_take_axes(letters)[0])


def _set_table(state: InterpreterState, letters: dict[str, Word]) -> None:
    """Run G10: L2 and L20 set a work offset; other tables are not supported."""
    if "L" not in letters:
        raise UnclearBlock("G10 without L is not understood")
    table = whole(letters.pop("L"), 999)
    if table not in (2, 20):
        raise UnclearBlock(f"G10 L{table} is not understood")
    if "P" not in letters:
        raise BlockError(f"G10 L{table} needs P, the work offset that it sets")
    number = whole(letters.pop("P"), 999)
    turned = letters.pop("R", None) is not None
    named, values = _take_axes(letters)
    active = {540 + 10 * n: n + 1 for n in range(6)} | {590 + n: n + 6 for n in range(1, 4)}
    if number not in (0, active.get(state.frame)):
        # Not the active offset: nothing moves until it is selected, but the row must not be lost.
        state.move_origin((False, False, False))
    elif turned:
        state.move_origin((True, True, named[2]))
    elif table == 20 and state.dialect.groups == "rs274":
        state.move_origin((False, False, False), {axis: state.mm(word) for axis, word in values.items()})
    else:
        state.move_origin(named)


def _take_axes(letters: dict[str, Word]) -> tuple[tuple[bool, bool, bool], dict[int, Word]]:
    """Remove X, Y and Z from `letters`; return which are stated, and their words."""
    named = named_axes(letters)
    return named, {axis: letters.pop(AXES[axis]) for axis in range(3) if named[axis]}
