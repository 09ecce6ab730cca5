"""Policies of the interpreter.

A program from another CAM system may contain any word, and a block that is not understood is kept. leafcut's own
programs only contain supported words.
"""

from __future__ import annotations

from leafcut.gcode.dialects import Dialect
from leafcut.gcode.linuxcnc_refusals import is_linuxcnc, linuxcnc_refuses, linuxcnc_refuses_words
from leafcut.gcode.state import InterpreterState, parse_whole_number
from leafcut.gcode.word_groups import GROUP_OF, M_GROUP_OF, OUTPUT_CODES, PAUSE, SortedBlock
from leafcut.gcode.words import Block, BlockError, Word
from leafcut.message import Message
from leafcut.model.toolpath import UNKNOWN

#: Supported motions and cycles, in tenths. G76, G87 and G88 wait for the operator or move aside at the bottom.
_MOTIONS = frozenset({0, 10, 20, 30, 730, 810, 820, 830, 840, 850, 860, 890})


class Policy:
    """Policy for programs from other CAM systems.

    A block that is not understood is kept. Afterwards, any state that it may have changed is unknown.
    """

    def handle_unknown(self, message: str) -> None:
        """Handle an unknown or unexpected part of a block.

        Either raise an error, or return so that the block is kept.
        """

    def supported_codes(self, dialect: Dialect) -> tuple[frozenset[int], frozenset[int]]:
        """Return the supported G codes, in tenths, and the supported M codes."""
        m_codes = frozenset(M_GROUP_OF) - OUTPUT_CODES - {PAUSE}
        if dialect.cycle_words == "fagor":
            return dialect.g_codes, m_codes
        # G69 ends a rotation nearly everywhere. G70 and G71 are bolt circles on Haas, and lathe cycles in LinuxCNC.
        no_units = dialect.groups == "fanuc" or is_linuxcnc(dialect)
        other = {690, 700, 710} if no_units else {690}
        return frozenset(GROUP_OF) - (other - dialect.g_codes), m_codes

    def spindle_directions(self, dialect: Dialect) -> dict[int, int]:
        """Return the spindle direction of M3, M4 and M5: 1, -1 and 0."""
        # With a beam, M3 and M4 differ in whether the power follows the speed.
        return {3: 1, 4: -1, 5: 0}

    def is_refused(self, state: InterpreterState, block: Block, words: SortedBlock) -> bool:
        """Return whether the controller refuses a block although its meaning is clear.

        Updates `state.feed_forgotten`.
        """
        if not is_linuxcnc(state.dialect):
            return False
        malformed = linuxcnc_refuses_words(block.words)
        return linuxcnc_refuses(state, words) or malformed

    def set_initial_state(self, state: InterpreterState) -> None:
        """Set the state of the interpreter at the start of a program."""
        # The state at switch-on: Fanuc has G98, RS274/NGC G99 (seen with rs274).
        state.to_initial = state.dialect.groups == "fanuc"
        if state.to_initial:
            state.unknown_motion = Message("the motion mode at power-on")

    def is_known_motion(self, code: int) -> bool:
        """Return whether a motion or cycle is supported. `code` is its G code in tenths."""
        return code in _MOTIONS

    def is_known_spindle(self, number: float) -> bool:
        """Return whether the spindle selected by a $ word is supported."""
        return number in (0.0, -1.0)

    def adds_blending_row(self, state: InterpreterState, blending: tuple[int, float, float]) -> bool:
        """Return whether a path control word adds a row.

        `blending` is its mode, tolerance and joining, as in `Modal`.
        """
        return blending != (state.blending, state.tolerance, state.joining)

    def compensation_register(self, state: InterpreterState, code: int, word: Word | None) -> float:
        """Return the register number in the D word of cutter compensation. `code` is G41 to G42.1, in tenths."""
        return 0.0 if word is None else word.value

    def forget_height(self, state: InterpreterState) -> None:
        """Mark the height as unknown after a change of the length offset."""
        state.path.position[2] = UNKNOWN
        state.path.initial_plane = None

    def forget_xy_position(self, state: InterpreterState) -> None:
        """After G43, mark the position in X and Y as unknown if the offset may include X and Y."""

    def cancels_shift(self, state: InterpreterState) -> bool:
        """Return whether G92.1 to G92.3 may move the origin."""
        return True


class OwnPolicy(Policy):
    """Policy for leafcut's own programs. An unsupported word is an error, and positions match the planned toolpath."""

    def handle_unknown(self, message: str) -> None:
        """Raise an error."""
        raise BlockError(message)

    def supported_codes(self, dialect: Dialect) -> tuple[frozenset[int], frozenset[int]]:
        """Return the G and M codes of the dialect."""
        return dialect.g_codes, dialect.m_codes

    def spindle_directions(self, dialect: Dialect) -> dict[int, int]:
        """Return the spindle directions. M4 may also switch on a beam."""
        beam = {} if dialect.torch is None else {dialect.torch.on_code: 1}
        return {**super().spindle_directions(dialect), **beam}

    def is_refused(self, state: InterpreterState, block: Block, words: SortedBlock) -> bool:
        """Return False, because the controller supports all words of its dialect."""
        return False

    def set_initial_state(self, state: InterpreterState) -> None:
        """Keep the default state of the interpreter."""

    def is_known_motion(self, code: int) -> bool:
        """Accept all motions of the dialect."""
        return True

    def is_known_spindle(self, number: float) -> bool:
        """Accept all spindle numbers, because a torch has several tools."""
        return True

    def adds_blending_row(self, state: InterpreterState, blending: tuple[int, float, float]) -> bool:
        """Return whether G64 is or was active. Without a path control row, a toolpath stops after every move (G61)."""
        return 640 in (blending[0], state.blending)

    def compensation_register(self, state: InterpreterState, code: int, word: Word | None) -> float:
        """Return the kerf width, mm, or the number of the register that contains half of the kerf width."""
        torch = state.dialect.torch
        if torch is None or not torch.compensation:
            raise BlockError("radius compensation (G41, G42) is not understood")
        if word is None:
            raise BlockError("G{:g} needs D", code / 10)
        return state.mm(word) if code in (411, 421) else float(parse_whole_number(word, 9_999))

    def forget_height(self, state: InterpreterState) -> None:
        """Do nothing, because the height is known."""

    def forget_xy_position(self, state: InterpreterState) -> None:
        """Mark X and Y as unknown if the marking tool has offsets in X and Y.

        Only the controller's table contains these offsets.
        """
        if state.dialect.torch is not None and state.dialect.torch.mark_tool is not None:
            state.path.position[:2] = [UNKNOWN, UNKNOWN]

    def cancels_shift(self, state: InterpreterState) -> bool:
        """Return whether the origin has been moved before."""
        return bool(state.shift)
