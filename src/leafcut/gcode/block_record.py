"""What a foreign program did, block by block, in columns: the making of a `Program`."""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field, fields

import numpy as np

from leafcut.gcode.foreign_state import ForeignState
from leafcut.gcode.lines import Lines
from leafcut.gcode.obeyed import Obeyed
from leafcut.gcode.program import Modal, Program

_PIERCED = "the controller makes only a pierce of it (#<pierce-only>=1)"
_MOTION = [f.name for f in fields(Modal)].index("motion")
_FEED = [f.name for f in fields(Modal)].index("feed")
_SPEED = [f.name for f in fields(Modal)].index("rpm")


@dataclass
class BlockRecord:
    """The blocks so far. `current` is the number of the state that is active now."""

    state: ForeignState
    line: array[int] = field(default_factory=lambda: array("i"))
    first: array[int] = field(default_factory=lambda: array("i"))
    before: array[int] = field(default_factory=lambda: array("i"))
    fixed: dict[int, str] = field(default_factory=dict)
    obeyed: tuple[Obeyed, ...] = ()
    said: dict[int, str] = field(default_factory=dict)
    current: int = 0
    calls: list[tuple[int, int]] = field(default_factory=list)
    _numbers: dict[tuple, int] = field(default_factory=dict)
    _plain: dict[tuple[int, float, float], int] = field(default_factory=dict)
    _called: int = 0

    def __post_init__(self) -> None:
        self.look()

    def look(self) -> None:
        """Take note of the state that is active now."""
        values = self.state.modal_values()
        self.current = self._numbers.setdefault(values, len(self._numbers))
        self._plain = {}

    def add(self, line: int, rows: int, reason: str) -> None:
        """Add a block on `line` whose rows begin at `rows`, and then look at the state; `reason`: why it is fixed."""
        if reason:
            self.fixed[len(self.line)] = reason
        self.line.append(line)
        self.first.append(rows)
        self.before.append(self.current)
        self.look()

    def say(self, said: str) -> None:
        """Note what the block that comes next says."""
        self.said[len(self.line)] = said

    def note_depth(self, before: int, after: int) -> None:
        """Note how many calls deep the program is before and after the block that was added last."""
        if before == 0 and after:
            self._called = len(self.line) - 1
        elif before and after == 0:
            self.calls.append((self._called, len(self.line)))

    def current_of(self, motion: int, feed: float, speed: float) -> int:
        """Return the number of the state that differs from that of the last look by motion, feed and speed only."""
        number = self._plain.get((motion, feed, speed))
        if number is None:
            values = list(self.state.modal_values())
            values[_MOTION], values[_FEED], values[_SPEED] = motion, feed, speed
            number = self._plain[motion, feed, speed] = self._numbers.setdefault(tuple(values), len(self._numbers))
        return number

    def program(self, lines: tuple[str, ...], last_line: int, assumed: bool = False, title: int = 0) -> Program:
        """Return the program."""
        path = self.state.path.build()
        return Program(
            Lines(lines),
            path,
            np.array(self.line, dtype=np.int32),
            np.array(self.first + array("i", [len(path)]), dtype=np.int32),
            np.array(self.before + array("i", [self.current]), dtype=np.int32),
            tuple(Modal(*values) for values in self._numbers),
            self._fixed(),
            last_line,
            self.obeyed,
            self.said,
            assumed,
            dark_rapids=(torch := self.state.dialect.torch) is not None and torch.dark_rapids,
            title_lines=title,
            calls=tuple(self.calls),
        )

    def _fixed(self) -> dict[int, str]:
        """Return why blocks stay; where the controller makes pierces of all cuts to come, every one does."""
        start = next((said.line for said in self.obeyed if said.pierces_only), None)
        if start is None:
            return self.fixed
        after = [block for block, line in enumerate(self.line) if line > start]
        return {**dict.fromkeys(after, _PIERCED), **self.fixed}
