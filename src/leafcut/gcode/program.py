"""`Program`: a program from any CAM system as a sequence of blocks, with its motions and modal states."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import NDArray

from leafcut.gcode.words import Word, parse_plain_block
from leafcut.model.toolpath import Kind, Toolpath, latest_marked_rows

if TYPE_CHECKING:
    from leafcut.gcode.active_comments import ControllerSetting
    from leafcut.gcode.block_description import BlockDescription


class Lines(Sequence[str]):
    """The lines of a program with their line ends. A slice is a tuple.

    All lines are stored in a single string, because separate strings would need five times the memory.
    """

    __slots__ = ("_starts", "_text")

    def __init__(self, lines: Sequence[str]) -> None:
        self._text = "".join(lines)
        self._starts = np.zeros(len(lines) + 1, dtype=np.int64)
        np.cumsum(np.fromiter(map(len, lines), dtype=np.int64, count=len(lines)), out=self._starts[1:])

    def __len__(self) -> int:
        return len(self._starts) - 1

    def __iter__(self) -> Iterator[str]:
        return (self._text[begin:end] for begin, end in pairwise(map(int, self._starts)))

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[str, ...]: ...
    def __getitem__(self, index: int | slice) -> str | tuple[str, ...]:
        if isinstance(index, slice):
            return tuple(self[k] for k in range(*index.indices(len(self))))
        at = range(len(self))[index]
        return self._text[int(self._starts[at]) : int(self._starts[at + 1])]

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Sequence)
            and len(self) == len(other)
            and all(a == b for a, b in zip(self, other, strict=True))
        )

    def __hash__(self) -> int:
        return hash(self._text)


@dataclass(slots=True, unsafe_hash=True)
class Modal:
    """Modal state between two blocks: everything that may affect the meaning of the next block.

    Treat `Program.modals` as immutable. The interpreter's own state is a subclass.

    Attributes
    ----------
    motion
        0 to 3 for G0 to G3. None after G80, before the first motion, and while a cycle is active.
    cycle
        Number of the active canned cycle (81 for G81), or None.
    cycle_words
        Letter and value of the modal words of the active cycle (R, Z, P, Q …), as written.
    unit
        Length of the program unit, mm; None before the program states its unit.
    incremental, absolute_centres, to_initial
        Whether G91, G90.1 and G98 are active.
    feed_mode, feed
        93, 94 or 95, and F as written: in units per minute, units per revolution, or 1/min; 0 without F.
    rpm, spindle, coolant
        Spindle speed S; direction of the spindle (1 for M3, -1 for M4, 0 for M5); coolant (0 off, 1 mist, 2 flood, 3
        both).
    tool, next_tool
        The tool in the spindle, and the tool of the last T word; None if unknown.
    length
        Register of the length offset (0: G49). After a block that may have changed the offset, this is minus the number
        of such blocks up to here.
    radius, register
        40, 41 or 42 for cutter compensation, and its D number. `radius` is negative after a block that may have changed
        it.
    frame
        Work offset in tenths (540 for G54, 591 for G59.1).
    shift
        Number of changes of the origin up to here (G52, G92 …).
    blending, tolerance, joining
        610, 611 or 640 (G61, G61.1, G64), or 0 before any of them; P of G64, mm, or 0 without P; Q of G64, mm, or P
        without Q.
    """

    motion: int | None = None
    cycle: int | None = None
    cycle_words: tuple[tuple[str, float], ...] = ()
    unit: float | None = None
    plane: int = 17
    incremental: bool = False
    absolute_centres: bool = False
    to_initial: bool = True
    feed_mode: int = 94
    feed: float = 0.0
    rpm: float = 0.0
    spindle: int = 0
    coolant: int = 0
    tool: int | None = None
    next_tool: int | None = None
    length: int = 0
    radius: int = 40
    register: float = 0.0
    frame: int = 540
    shift: int = 0
    blending: int = 0
    tolerance: float = 0.0
    joining: float = 0.0


#: The field of `Modal` that the `ref` of a row sets, by the kind of the row.
_FIELD_OF = {
    Kind.TOOL: "tool",
    Kind.OFFSET: "length",
    Kind.COOLANT: "coolant",
    Kind.FRAME: "frame",
    Kind.RADIUS: "radius",
    Kind.BLENDING: "blending",
}


@dataclass(frozen=True, eq=False)
class Program:
    """A program as a sequence of blocks in the order of execution.

    A block in a loop or subprogram appears once per execution.

    Attributes
    ----------
    lines
        The text in lines, with their line ends.
    line
        The line of each block, from 1, int32[m].
    first
        Rows of the blocks, int32[m + 1]. Block b has the rows ``first[b] … first[b + 1] - 1`` of `path`.
    before
        The row of `modals` before each block, int32[m + 1]. The last entry is the state at the end.
    switched_off
        Blocks that switch the spindle or coolant off, or change the tool, after their motion. Each block maps to the
        first row after the motion, and to the row of `modals` during the motion.
    fixed
        Reason for each block that must stay unchanged in its position. Such a block is unsupported, belongs to a loop
        or subprogram, has a computed number, or depends on the block-delete switch of the machine.
    descriptions
        Descriptions of the blocks with unknown effects or an active comment.
    calls
        Half-open block ranges of all subprogram calls in the main program, including the calling blocks.
    last_line
        The last line of the program. The text after it is ignored.
    feed_words
        Feeds that replace words such as F with a parameter of the controller's material, with these words.
    assumed_units
        Whether the program has lengths before it states its units, so that the option `units` supplied them.
    dark_rapids
        Whether the controller switches the beam off in every rapid, regardless of S.
    title_lines
        Number of title lines above the first percent sign, which are not G-code.
    obeyed
        Settings of the controller in comments and parameters, in the order of the text.
    """

    lines: Sequence[str]
    path: Toolpath
    line: NDArray[np.int32]
    first: NDArray[np.int32]
    before: NDArray[np.int32]
    modals: tuple[Modal, ...]
    fixed: dict[int, str] = field(default_factory=dict)
    last_line: int = 0
    obeyed: tuple[ControllerSetting, ...] = ()
    descriptions: dict[int, BlockDescription] = field(default_factory=dict)
    assumed_units: bool = False
    feed_words: dict[float, str] = field(default_factory=dict)
    calls: tuple[tuple[int, int], ...] = ()
    dark_rapids: bool = False
    title_lines: int = 0
    switched_off: dict[int, tuple[int, int]] = field(default_factory=dict)

    @classmethod
    def of_toolpath(cls, path: Toolpath, lines: Sequence[str]) -> Program:
        """Create the program of a toolpath.

        Each line that has rows in the toolpath becomes a block. The modal state follows from the rows.
        """
        line, first = np.unique(path.line, return_index=True)
        modal = Modal(unit=1.0)
        setting: dict[str, Any]
        numbers = {modal: 0}
        changes = np.full(len(line) + 1, -1)
        changes[0] = 0
        rows = np.flatnonzero(np.isin(path.kind, [Kind.SPINDLE, *_FIELD_OF]))
        blocks = first.searchsorted(rows, side="right") - 1
        for row, block in zip(rows.tolist(), blocks.tolist(), strict=True):
            kind, value = Kind(int(path.kind[row])), float(path.value[row])
            if kind is Kind.SPINDLE:
                setting = {"spindle": int(np.sign(value)), "rpm": abs(value) or modal.rpm}
            else:
                setting = {_FIELD_OF[kind]: int(path.ref[row])}
            if kind is Kind.RADIUS:
                setting["register"] = value
            elif kind is Kind.BLENDING:
                setting |= {"tolerance": value, "joining": float(path.end[row, 0])}
            modal = replace(modal, **setting)
            changes[block + 1] = numbers.setdefault(modal, len(numbers))
        return cls(
            lines,
            path,
            line.astype(np.int32),
            np.append(first, len(path)).astype(np.int32),
            changes[latest_marked_rows(changes >= 0)].astype(np.int32),
            tuple(numbers),
            last_line=int(line[-1]) if len(line) else 0,
        )

    @property
    def n_blocks(self) -> int:
        """Number of executed blocks."""
        return len(self.line)

    @cached_property
    def row_modal(self) -> NDArray[np.int32]:
        """Index in `modals` of the modal state that applies to each row of `path`, int32[n].

        All words of a block apply to its own motion, except words that switch a device off after the motion.
        """
        number: NDArray[np.int32] = self.before[np.minimum(self.row_block + 1, len(self.before) - 1)]
        for block, (end, during) in self.switched_off.items():
            number[self.first[block] : end] = during
        return number

    def modal_at_rows(self, field: str) -> NDArray[Any]:
        """Return the value of a field of `Modal` for each row of `path`, [n]."""
        values: NDArray[Any] = np.array([getattr(modal, field) for modal in self.modals])[self.row_modal]
        return values

    @cached_property
    def text_line(self) -> NDArray[np.int32]:
        """The line of each block, int32[m]. A block of a subprogram has the line of the call in the main program."""
        line = self.line.copy()
        for begin, end in self.calls:
            line[begin:end] = line[begin]
        return line

    @cached_property
    def row_block(self) -> NDArray[np.int32]:
        """The block of each row of `path`, int32[n]."""
        block = self.first.searchsorted(np.arange(len(self.path), dtype=self.first.dtype), side="right") - 1
        return block.astype(np.int32)

    def modal(self, block: int) -> Modal:
        """Return the modal state before a block. The block number `n_blocks` selects the state at the end."""
        return self.modals[int(self.before[block])]

    def words(self, block: int) -> tuple[Word, ...]:
        """Return the words of a block. If the block contains more than plain words, the result is empty."""
        plain = parse_plain_block(self.lines[int(self.line[block]) - 1])
        return () if plain is None else plain.words

    def is_plain(self, row: int) -> bool:
        """Return whether a row is the only effect of a plain block.

        A plain block is absolute, has no cutter compensation, and runs exactly once.
        """
        block = int(self.row_block[row])
        if block in self.fixed or block in self.descriptions or self.text_line[block] != self.line[block]:
            return False
        after = self.modal(block + 1)
        alone = int(self.first[block + 1]) - int(self.first[block]) == 1
        return alone and not after.incremental and after.radius == 40 and bool(self.words(block))
