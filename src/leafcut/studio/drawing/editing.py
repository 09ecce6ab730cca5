"""Manual changes of an order, with undo.

The result is an order file for holes or a plan file for the cuts of a sheet.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.geometry.arrays import Point
from leafcut.read.order_file import identify_drawing, order_file_text

State = TypeVar("State")
#: Maximum number of undo steps in a stored order, and maximum number of characters in all steps together.
_MAX_STEPS, _MAX_LETTERS = 30, 300_000


@dataclass(frozen=True)
class OrderStop:
    """A hole or a cut in an edited order.

    Attributes
    ----------
    name
        Number of the stop in the initial order, from 1.
    place
        Position, mm.
    held
        Whether the rank of the stop is fixed. If it is not, the search chooses the rank.
    sign
        Mark for a changed direction: ``↻`` for clockwise, ``↺`` for counter-clockwise, ``⇄`` for any other change. It
        is empty if the direction is unchanged.
    moved
        Whether the position has changed since the toolpath was created.
    """

    name: int
    place: Point
    held: bool = True
    sign: str = ""
    moved: bool = False


class UndoableState(Generic[State]):
    """A state that supports undo and redo.

    `OrderStop.name` identifies a stop, and `option` is the option that receives the file.
    """

    option: str

    def __init__(self, state: State) -> None:
        self.state = state
        self._before: list[State] = []
        self._after: list[State] = []

    def change(self, state: State) -> None:
        """Change the state. The user can undo this step."""
        if state != self.state:
            self._before.append(self.state)
            self._after.clear()
            self.state = state

    @property
    def changed(self) -> bool:
        """Whether the state has changed since the start."""
        return bool(self._before) and self.state != self._before[0]

    def as_plain(self) -> dict[str, Any]:
        """Return the state and all undo and redo steps as plain values for JSON."""
        max_steps = min(_MAX_STEPS, _MAX_LETTERS // len(json.dumps(self.state)))
        before, after = (
            steps[len(steps) - max_steps :] if len(steps) > max_steps else steps
            for steps in (self._before, self._after)
        )
        return {"state": self.state, "before": list(before), "after": list(after)}

    def restore_plain(self, plain: Mapping[str, Any]) -> None:
        """Restore the result of `as_plain`. If a state is invalid or consists of different parts, nothing changes."""
        steps = [_as_tuples(plain.get(name)) for name in ("before", "after")]
        state = _as_tuples(plain.get("state"))
        try:
            fits = all(self.parts(candidate) == self.parts(self.state) for candidate in (state, *steps[0], *steps[1]))
        except (TypeError, ValueError, KeyError):
            return
        if fits:
            # The initial state is always the first undo step, even if the oldest steps were dropped.
            first = [self.state] if self.state != (steps[0] or [state])[0] else []
            self.state, self._before, self._after = state, [*first, *steps[0]], list(steps[1])

    def parts(self, state: State) -> Any:
        """Return the parts of a state in a fixed order. Two states are compatible if their parts are equal."""
        raise NotImplementedError

    def undo(self) -> bool:
        """Undo the last step. Return whether there was a step to undo."""
        return self._move_step(self._before, self._after)

    def redo(self) -> bool:
        """Redo the last undone step. Return whether there was a step to redo."""
        return self._move_step(self._after, self._before)

    def _move_step(self, source: list[State], target: list[State]) -> bool:
        if not source:
            return False
        target.append(self.state)
        self.state = source.pop()
        return True


def _as_tuples(plain: Any) -> Any:
    return tuple(_as_tuples(value) for value in plain) if isinstance(plain, list | tuple) else plain


#: The holes of each operation in order, and the number of holes at the start whose order is fixed.
HoleOrders = tuple[tuple[tuple[int, ...], int], ...]


class HoleOrder(UndoableState[HoleOrders]):
    """The order of the holes in each operation.

    `operations` contains the holes of each operation. `xy` contains the positions, float64[holes, 2] in mm.
    """

    def __init__(self, operations: dict[int, tuple[int, ...]], xy: NDArray[np.float64]) -> None:
        super().__init__(tuple((holes, len(holes)) for _, holes in sorted(operations.items())))
        self._numbers, self._xy = sorted(operations), xy
        self._stops = [(k, hole) for k, (holes, _) in enumerate(self.state) for hole in holes]

    def parts(self, state: HoleOrders) -> Any:
        """Return the holes of each operation, sorted."""
        return [sorted(holes) for holes, n_fixed in state if 0 <= n_fixed <= len(holes)]

    def _operation_and_hole(self, stop: int) -> tuple[int, int]:
        if not 1 <= stop <= len(self._stops):
            raise OptionError("this hole is not in the order")
        return self._stops[stop - 1]

    def _set_operation_order(self, k: int, holes: list[int], n_fixed: int) -> None:
        self.change((*self.state[:k], (tuple(holes), n_fixed), *self.state[k + 1 :]))

    def move(self, stop: int, onto: int) -> None:
        """Move a hole to the rank of another hole in the same operation."""
        (k, hole), (target_k, target) = self._operation_and_hole(stop), self._operation_and_hole(onto)
        if k != target_k:
            raise OptionError("these holes use different tools; the order can be changed only within one tool")
        holes, n_fixed = list(self.state[k][0]), self.state[k][1]
        old_rank, new_rank = holes.index(hole), holes.index(target)
        holes.remove(hole)
        holes.insert(new_rank, hole)
        # A hole inserted among the fixed ones becomes fixed, and vice versa.
        self._set_operation_order(k, holes, n_fixed + (new_rank < n_fixed) - (old_rank < n_fixed))

    def move_to_end(self, stop: int, first: bool) -> None:
        """Move a hole to the start or the end of its operation.

        A move to the end fixes the order of all holes in the operation.
        """
        k, hole = self._operation_and_hole(stop)
        holes, n_fixed = self.state[k]
        rest = [h for h in holes if h != hole]
        if first:
            self._set_operation_order(k, [hole, *rest], n_fixed + (holes.index(hole) >= n_fixed))
        else:
            self._set_operation_order(k, [*rest, hole], len(holes))

    def reverse(self, stop: int) -> None:
        """Reverse the order of the holes in an operation."""
        k, _ = self._operation_and_hole(stop)
        self._set_operation_order(k, list(reversed(self.state[k][0])), len(self.state[k][0]))

    def move_start(self, stop: int, to: Point) -> None:
        """Raise `OptionError`, because holes cannot be moved."""
        raise OptionError(
            "hole positions are fixed; to change the drilling order, drop a hole onto the hole that it should replace "
            "in the order"
        )

    def fix_order_up_to(self, stop: int) -> None:
        """Fix the order of an operation up to this hole. The search may reorder all later holes."""
        k, hole = self._operation_and_hole(stop)
        self._set_operation_order(k, list(self.state[k][0]), self.state[k][0].index(hole) + 1)

    def stops(self) -> list[OrderStop]:
        """Return all holes in their current order."""
        names = {stop: name for name, stop in enumerate(self._stops, 1)}
        return [
            OrderStop(names[k, hole], (float(self._xy[hole, 0]), float(self._xy[hole, 1])), rank < n_fixed)
            for k, (holes, n_fixed) in enumerate(self.state)
            for rank, hole in enumerate(holes)
        ]

    def file_text(self) -> str:
        """Return the text of the order file."""
        fixed = {n: order[:fixed] for n, (order, fixed) in zip(self._numbers, self.state, strict=True)}
        return order_file_text(fixed, identify_drawing(self._xy.tolist()))


_OPPOSITE = {
    "clockwise": "counter-clockwise",
    "counter-clockwise": "clockwise",
    "forward": "backward",
    "backward": "forward",
}

_SIGNS = {"clockwise": "↻", "counter-clockwise": "↺"}


class CutOrder(UndoableState[tuple[str, ...]]):
    """The cuts of a plan file. It keeps every manual change, and the search completes the rest."""

    def __init__(self, text: str) -> None:
        self._plan: dict[str, Any] = json.loads(text)
        # Rows carry their initial number, because their order changes.
        rows = [json.dumps({**row, "number": k}) for k, row in enumerate(self._plan["cuts"], 1)]
        super().__init__(tuple(rows))
        self._starts = {row["number"]: row["start"] for row in self._rows() if "start" in row}

    def parts(self, state: tuple[str, ...]) -> Any:
        """Return the number and the contours of each cut, sorted by number."""
        rows = sorted((json.loads(row) for row in state), key=lambda row: int(row["number"]))
        return [(row["number"], row["contours"]) for row in rows]

    def _rows(self) -> list[dict[str, Any]]:
        return [json.loads(row) for row in self.state]

    def _change_rows(self, rows: list[dict[str, Any]]) -> None:
        self.change(tuple(json.dumps(row) for row in rows))

    def _find_row(self, rows: list[dict[str, Any]], stop: int) -> dict[str, Any]:
        for row in rows:
            if row["number"] == stop:
                return row
        raise OptionError("this cut is not in the plan")

    @staticmethod
    def _add_fixed_word(row: dict[str, Any], word: str) -> None:
        row["fixed"] = sorted({*row["fixed"], word})

    def move(self, stop: int, onto: int) -> None:
        """Move a cut to the rank of another cut. This fixes the entire order."""
        rows = self._rows()
        row, target = self._find_row(rows, stop), self._find_row(rows, onto)
        rank = rows.index(target)
        rows.remove(row)
        rows.insert(rank, row)
        for changed in rows:
            self._add_fixed_word(changed, "order")
        self._change_rows(rows)

    def move_to_end(self, stop: int, first: bool) -> None:
        """Move a cut to the start or the end. This fixes the entire order."""
        numbers = [row["number"] for row in self._rows()]
        self.move(stop, numbers[0] if first else numbers[-1])

    def reverse(self, stop: int) -> None:
        """Reverse the direction of a cut."""
        rows = self._rows()
        row = self._find_row(rows, stop)
        if row.get("direction") not in _OPPOSITE:
            raise OptionError("the plan has no direction for this cut")
        row["direction"] = _OPPOSITE[row["direction"]]
        self._add_fixed_word(row, "direction")
        self._change_rows(rows)

    def move_start(self, stop: int, to: Point) -> None:
        """Start a cut at the point of its contour that is closest to `to`."""
        rows = self._rows()
        row = self._find_row(rows, stop)
        row["start"] = [round(v, 3) for v in to]
        self._add_fixed_word(row, "start")
        self._change_rows(rows)

    def fix_order_up_to(self, stop: int) -> None:
        """Fix the order up to this cut. The search may reorder all later cuts."""
        rows = self._rows()
        at = rows.index(self._find_row(rows, stop))
        for row in rows:
            row["fixed"] = [word for word in row["fixed"] if word not in ("order", "ahead")]
        for row in rows[: at + 1]:
            self._add_fixed_word(row, "order")
        self._add_fixed_word(rows[at], "ahead")
        self._change_rows(rows)

    def stops(self) -> list[OrderStop]:
        """Return all cuts in their current order, at their start points.

        If no cut has a fixed rank, all cuts count as fixed.
        """
        rows = self._rows()
        free = any("order" in row["fixed"] for row in rows)
        return [
            OrderStop(
                row["number"],
                (float(row["start"][0]), float(row["start"][1])),
                not free or "order" in row["fixed"],
                _SIGNS.get(row.get("direction", ""), "⇄") if "direction" in row["fixed"] else "",
                row["start"] != self._starts[row["number"]],
            )
            for row in rows
        ]

    def file_text(self) -> str:
        """Return the text of the plan file."""
        cuts = [{key: value for key, value in row.items() if key != "number"} for row in self._rows()]
        return json.dumps({**self._plan, "cuts": cuts}, indent=1) + "\n"


#: An order that the user edits.
Edited = HoleOrder | CutOrder


def has_only_single_cuts(text: str) -> bool:
    """Return whether every row of a plan file is a single cut with a start point."""
    return all(
        "start" in row and not row.get("bridge") and len(row["contours"]) == 1 for row in json.loads(text)["cuts"]
    )
