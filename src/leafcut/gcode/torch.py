"""Outputs of a controller for a torch. They keep the arc off during a move, hold the height, or reduce the feed.

Source: LinuxCNC, M-code reference, M52 and M62 to M68; QtPlasmaC manual, outputs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from leafcut.errors import PostError
from leafcut.gcode.dialects import Dialect, Torch
from leafcut.gcode.state import InterpreterState, parse_whole_number
from leafcut.gcode.word_groups import SortedBlock
from leafcut.gcode.words import Block, BlockError, Word, parse_block, remove_word
from leafcut.message import Message
from leafcut.model.toolpath import MOTIONS, SPEED_ALONE, Kind, Motion, Toolpath
from leafcut.units import SECONDS_PER_MINUTE

#: Controller register that contains half the kerf width if G41 and G42 use a register.
KERF_REGISTER = 1
#: QtPlasmaC treats a feed override outside these limits as 100 %.
LEAST_PERCENT, MOST_PERCENT = 10.0, 100.0


def run_output_words(state: InterpreterState, words: SortedBlock) -> None:
    """Execute the words M52, M62 to M68 and M190 of a block."""
    letters = words.letters
    if "adaptive" in words.m:
        state.adaptive = parse_whole_number(letters.pop("P")) != 0 if "P" in letters else True
    if "material" in words.m:
        state.material = parse_whole_number(_take_required_word(letters, "P", 190))
        if state.material_feeds is not None and state.material not in state.material_feeds:
            raise BlockError("M190 P{} selects a material of the controller whose feed is not known", state.material)
    for code in words.m.get("output", ())[:1]:
        if code == 66:
            _remove_wait_words(letters)
        elif code >= 67:
            number, percent = (
                parse_whole_number(_take_required_word(letters, "E", code)),
                _take_required_word(letters, "Q", code).value,
            )
            set_feed_output(state, number, percent)
        else:
            _switch_output(state, parse_whole_number(_take_required_word(letters, "P", code)), code in (62, 64))


def parse_block_with_material_feed(state: InterpreterState, line: str, number: int) -> Block:
    """Parse the block of a line. F may refer to the feed of the material selected in the controller.

    Raises
    ------
    BlockError
        The line is invalid as in `words.parse_block`, no material is selected, or its feed is unknown.
    """
    word = "" if state.dialect.torch is None else state.dialect.torch.material_feed
    rest = remove_word(line, word)
    block = parse_block(line if rest is None else rest, number)
    if rest is None:
        return block
    if state.material is None or state.material not in (state.material_feeds or {}):
        chosen = (
            Message("no material is selected")
            if state.material is None
            else Message("the feed for material {} is unknown", state.material)
        )
        raise BlockError(
            "'{}' is the feed of the controller's material, but {}; select the material with M190 before this line",
            word,
            chosen,
        )
    if state.unit is None:
        raise BlockError("'{}' comes before the units are stated ({} for mm)", word, state.dialect.units_mm)
    feed = (state.material_feeds or {})[state.material] * SECONDS_PER_MINUTE / state.unit
    return replace(block, words=(*block.words, Word("F", feed, word[1:])))


def _take_required_word(letters: dict[str, Word], letter: str, code: int) -> Word:
    if letter not in letters:
        raise BlockError("M{} needs {}", code, letter)
    return letters.pop(letter)


def set_outputs_after_abort(state: InterpreterState) -> None:
    """Set the outputs as an aborted program may leave them: feed reduced, arc off, height held."""
    torch = state.dialect.torch
    if torch is None:
        return
    state.override = LEAST_PERCENT / 100.0
    if torch.arc_output is not None:
        _switch_output(state, torch.arc_output, True)
    if torch.height_output is not None:
        _switch_output(state, torch.height_output, True)


def take_spindle_number(letters: dict[str, Word]) -> int:
    """Remove the `$` word and return the spindle number.

    The number is 0 without the word, and for -1 (all spindles).
    """
    word = letters.pop("$", None)
    return 0 if word is None or word.value == -1.0 else parse_whole_number(word, 7)


def _remove_wait_words(letters: dict[str, Word]) -> None:
    """Remove the words of M66, which waits for an input and does not change the toolpath."""
    if ("P" in letters) == ("E" in letters):
        raise BlockError("M66 needs P or E")
    for letter in ("P", "E", "L", "Q"):
        letters.pop(letter, None)


def set_feed_output(state: InterpreterState, number: int, percent: float) -> None:
    """Set an analog output. If it is the feed output of the torch, the feed is reduced from now on."""
    torch = state.dialect.torch
    if torch is not None and number == torch.feed_output:
        state.override = percent / 100.0 if LEAST_PERCENT <= percent <= MOST_PERCENT else 1.0


def _switch_output(state: InterpreterState, number: int, high: bool) -> None:
    torch = state.dialect.torch
    if torch is None:
        return
    if number == torch.arc_output and state.dark != high:
        state.dark = high
        state.path.torch(not high, line=state.line)
    if number == torch.height_output and state.holds_height != high:
        state.holds_height = high
        state.path.height_control(not high, line=state.line)


def set_speed(state: InterpreterState, rpm: float) -> None:
    """Apply an S word, which sets the spindle speed or the power of a beam. Power 0 keeps the beam off."""
    state.rpm = rpm
    if not state.spindle:
        return
    torch, dark = state.dialect.torch, rpm == 0.0
    if torch is not None and torch.power and dark != state.dark:
        state.dark = dark
        state.path.torch(not dark, line=state.line)
    else:
        state.path.spindle(state.spindle * rpm, line=state.line, number=SPEED_ALONE)


def convert_torch_path_for_controller(path: Toolpath, dialect: Dialect) -> Toolpath:
    """Convert a cutting toolpath to the form that its controller accepts. Without a torch, nothing changes.

    If the controller probes, moves Z or waits by itself, these rows are left out. If the arc cannot be off during a
    move, the torch is switched off earlier. Words for height control and G64 are kept only if the controller supports
    them.

    Raises
    ------
    PostError
        The controller has no word for marking, or for moving with the arc off.
    """
    torch = dialect.torch
    if torch is None:
        return path
    rows: list[Motion] = []
    arcs = list(path.arcs)
    writer = _TorchWriter(torch, dialect, rows.append)
    before = path.before
    for number, motion in enumerate(path):
        writer.write(motion, before[number])
    if not dialect.has_z_words:
        arcs = [replace(arc, center=(arc.center[0], arc.center[1], math.nan)) for arc in arcs]
    return replace(Toolpath.of_motions(rows), arcs=tuple(arcs))


class _TorchWriter:
    def __init__(self, torch: Torch, dialect: Dialect, keep: Callable[[Motion], None]) -> None:
        self.torch, self.dialect, self.keep = torch, dialect, keep
        self.lit: Motion | None = None
        self.piercing = False
        self.displaced = False

    def write(self, row: Motion, before: np.ndarray) -> None:
        """Write a row of the toolpath. `before` is the position of the torch before the row."""
        torch, kind = self.torch, row.kind
        if kind is Kind.SPINDLE:
            self._switch_on(row)
        elif kind is Kind.TORCH:
            self._write_beam_switch(row)
        elif kind is Kind.HEIGHT:
            if torch.height_output is not None:
                self.keep(row)
        elif kind is Kind.DWELL and self.piercing and not torch.waits:
            self.piercing = False
        elif kind in (Kind.PROBE, Kind.SHIFT) and not self.dialect.has_z_words:
            return
        elif kind is Kind.RADIUS:
            by_register = row.ref != 40 and torch.compensation == "G41"
            self.keep(row._replace(value=float(KERF_REGISTER)) if by_register else row)
        elif kind is Kind.BLENDING:
            if 640 in self.dialect.g_codes:
                # G64 has no tolerance on Fanuc.
                self.keep(row._replace(value=0.0) if self.dialect.groups == "fanuc" else row)
        elif kind in MOTIONS and not self.dialect.has_z_words:
            self._write_move(row, before)
        else:
            # Another tool has a different offset.
            self.displaced |= kind is Kind.TOOL
            self.keep(row)
        self.piercing &= kind not in MOTIONS

    def _write_move(self, row: Motion, before: np.ndarray) -> None:
        """Write a move without its Z. A move in Z alone is left out."""
        x, y, _ = row.end
        if row.kind not in (Kind.RAPID, Kind.FEED) or self.displaced or not _is_same_place((x, y), before):
            self.keep(row._replace(end=(x, y, math.nan)))
            self.displaced = False

    def _switch_on(self, row: Motion) -> None:
        torch = self.torch
        if row.value == 0.0:
            if self.lit is not None:
                self.keep(row._replace(ref=self.lit.ref))
            self.lit = None
            return
        if row.ref and not torch.mark_on:
            raise PostError(
                "{} has no command for marking; leave the marks out (--ignore-layers), or choose another dialect",
                self.dialect.name,
            )
        if torch.mark_on == torch.on:  # the same beam, at another power
            row = row._replace(ref=0)
        self.lit, self.piercing = row, True
        self.keep(row if torch.power else row._replace(value=1.0))

    def _write_beam_switch(self, row: Motion) -> None:
        if self.torch.can_switch_off_along_path:
            self.keep(row)
        elif row.value:
            raise PostError(
                "{} cannot switch the torch off during a cut; leave out the micro-joints", self.dialect.name
            )
        elif self.lit is not None:
            self._switch_on(Motion(Kind.SPINDLE, row.end, 0.0, 0, row.line))


def _is_same_place(place: tuple[float, float], before: np.ndarray) -> bool:
    return all(a == b or math.isnan(a) for a, b in zip(place, before.tolist(), strict=False))
