"""An order changed by hand: holes of a drilled part, cuts of a sheet; every change can be taken back.

What comes of it is a file that the command line takes, too: an order file, or a plan file.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError
from leafcut.geometry.arrays import Point
from leafcut.read.order_file import drawing_of, order_text

State = TypeVar("State")
#: So many steps can still be taken back of an order that was put away, and so many letters are written for them.
_MOST_STEPS, _MOST_LETTERS = 30, 1_000_000


@dataclass(frozen=True)
class OrderStop:
    """A stop of an order that is changed.

    Attributes
    ----------
    name
        What it is called in every change: its number in the order that was begun with, from 1.
    place
        Where it is, mm.
    held
        Whether its place in the order is what will be run; else the search orders it.
    sign
        What was changed of it beside the order: ``↻`` or ``↺`` for a direction clockwise or counter-clockwise, ``⇄``
        for another one; empty for nothing.
    moved
        Whether it is elsewhere than the toolpath has it.
    """

    name: int
    place: Point
    held: bool = True
    sign: str = ""
    moved: bool = False


class Edited(Protocol):
    """What the page needs of an order that is changed; stops are called as in `OrderStop.name`."""

    #: The option that takes the file.
    option: str

    def move(self, stop: int, onto: int) -> None:
        """Put a stop where another one is: before it, or behind it when it came before."""

    def to_end(self, stop: int, first: bool) -> None:
        """Put a stop first or last."""

    def reverse(self, stop: int) -> None:
        """Turn the order of a stop's operation round, or the direction of a cut."""

    def place(self, stop: int, to: Point) -> None:
        """Begin a cut elsewhere."""

    def free_after(self, stop: int) -> None:
        """Leave to the search what comes after a stop."""

    @property
    def changed(self) -> bool:
        """Whether it is otherwise than it was begun with."""

    def as_plain(self) -> dict[str, Any]:
        """Return it with what can be taken back, as plain values."""

    def take_plain(self, plain: Mapping[str, Any]) -> None:
        """Be what `as_plain` returned of an order of the same stops; of others, change nothing."""

    def undo(self) -> bool:
        """Take the last change back; return whether there was one."""

    def redo(self) -> bool:
        """Make the last change again that was taken back; return whether there was one."""

    def stops(self) -> list[OrderStop]:
        """Return all stops in the order as it is now."""

    def text(self) -> str:
        """Return the file."""


class Undoable(Generic[State]):
    """States, with those before and those taken back."""

    def __init__(self, state: State) -> None:
        self.state = state
        self._before: list[State] = []
        self._after: list[State] = []

    def change(self, state: State) -> None:
        """Go to another state."""
        if state != self.state:
            self._before.append(self.state)
            self._after.clear()
            self.state = state

    @property
    def changed(self) -> bool:
        """Whether the state is another one than at the beginning."""
        return bool(self._before) and self.state != self._before[0]

    def as_plain(self) -> dict[str, Any]:
        """Return the state with those before and after, as plain values."""
        most = min(_MOST_STEPS, _MOST_LETTERS // len(json.dumps(self.state)))
        before, after = (
            steps[len(steps) - most :] if len(steps) > most else steps for steps in (self._before, self._after)
        )
        return {"state": self.state, "before": list(before), "after": list(after)}

    def take_plain(self, plain: Mapping[str, Any]) -> None:
        """Be what `as_plain` returned; what is no state of the same things changes nothing."""
        found = [_frozen(plain.get(name)) for name in ("before", "after")]
        state = _frozen(plain.get("state"))
        try:
            fits = all(self.parts(one) == self.parts(self.state) for one in (state, *found[0], *found[1]))
        except (TypeError, ValueError, KeyError):
            return
        if fits:
            # Where the oldest states were not kept, the one that was begun with is the first all the same.
            first = [self.state] if self.state != (found[0] or [state])[0] else []
            self.state, self._before, self._after = state, [*first, *found[0]], list(found[1])

    def parts(self, state: State) -> Any:
        """Return what a state orders, whatever its order: that of another outcome has others."""
        raise NotImplementedError

    def undo(self) -> bool:
        """Go back; return whether there was anything."""
        return self._go(self._before, self._after)

    def redo(self) -> bool:
        """Go forth again; return whether there was anything."""
        return self._go(self._after, self._before)

    def _go(self, there: list[State], back: list[State]) -> bool:
        if not there:
            return False
        back.append(self.state)
        self.state = there.pop()
        return True


def _frozen(plain: Any) -> Any:
    """Return plain values with tuples for lists, as states have them."""
    return tuple(_frozen(value) for value in plain) if isinstance(plain, list | tuple) else plain


#: Of every operation the holes in their order, and how many of them are held: the rest is left to the search.
HoleOrders = tuple[tuple[tuple[int, ...], int], ...]


class HoleOrder(Undoable[HoleOrders]):
    """The holes of every operation; `operations` is operation → holes, `xy` float64[holes, 2]."""

    option = "hole_order"

    def __init__(self, operations: dict[int, tuple[int, ...]], xy: NDArray[np.float64]) -> None:
        super().__init__(tuple((holes, len(holes)) for _, holes in sorted(operations.items())))
        self._numbers, self._xy = sorted(operations), xy
        self._stops = [(k, hole) for k, (holes, _) in enumerate(self.state) for hole in holes]

    def parts(self, state: HoleOrders) -> Any:
        """Return the holes of every operation."""
        return [sorted(holes) for holes, held in state if 0 <= held <= len(holes)]

    def _at(self, stop: int) -> tuple[int, int]:
        """Return the operation of a stop, and its hole."""
        if not 1 <= stop <= len(self._stops):
            raise OptionError("this hole is not in the order")
        return self._stops[stop - 1]

    def _with(self, k: int, holes: list[int], held: int) -> None:
        self.change((*self.state[:k], (tuple(holes), held), *self.state[k + 1 :]))

    def move(self, stop: int, onto: int) -> None:
        """Put a hole where another one of its operation is."""
        (k, hole), (other, target) = self._at(stop), self._at(onto)
        if k != other:
            raise OptionError("these holes use different tools; the order can be changed only within one tool")
        holes, held = list(self.state[k][0]), self.state[k][1]
        at, to = holes.index(hole), holes.index(target)
        holes.remove(hole)
        holes.insert(to, hole)
        # What comes among the held ones is held, what comes among the others is not.
        self._with(k, holes, held + (to < held) - (at < held))

    def to_end(self, stop: int, first: bool) -> None:
        """Put a hole first or last; to be last, it needs all others held before it."""
        k, hole = self._at(stop)
        holes, held = self.state[k]
        rest = [h for h in holes if h != hole]
        if first:
            self._with(k, [hole, *rest], held + (holes.index(hole) >= held))
        else:
            self._with(k, [*rest, hole], len(holes))

    def reverse(self, stop: int) -> None:
        """Turn the order of an operation round."""
        k, _ = self._at(stop)
        self._with(k, list(reversed(self.state[k][0])), len(self.state[k][0]))

    def place(self, stop: int, to: Point) -> None:
        """Holes stay where they are drawn."""
        raise OptionError("holes cannot be moved; drop one onto another to take its place in the order")

    def free_after(self, stop: int) -> None:
        """Hold the holes of an operation up to this one."""
        k, hole = self._at(stop)
        self._with(k, list(self.state[k][0]), self.state[k][0].index(hole) + 1)

    def stops(self) -> list[OrderStop]:
        """Return all holes in their order."""
        names = {stop: name for name, stop in enumerate(self._stops, 1)}
        return [
            OrderStop(names[k, hole], (float(self._xy[hole, 0]), float(self._xy[hole, 1])), at < held)
            for k, (holes, held) in enumerate(self.state)
            for at, hole in enumerate(holes)
        ]

    def text(self) -> str:
        """Return the order file."""
        held = {n: order[:held] for n, (order, held) in zip(self._numbers, self.state, strict=True)}
        return order_text(held, drawing_of(self._xy.tolist()))


_OTHER = {
    "clockwise": "counter-clockwise",
    "counter-clockwise": "clockwise",
    "forward": "backward",
    "backward": "forward",
}

_SIGNS = {"clockwise": "↻", "counter-clockwise": "↺"}


class CutOrder(Undoable[tuple[str, ...]]):
    """The cuts of a plan file; what is changed by hand is fixed in it, the rest is found around it."""

    option = "plan"

    def __init__(self, text: str) -> None:
        self._plan: dict[str, Any] = json.loads(text)
        # Rows know their number as drawn: they move.
        rows = [json.dumps({**row, "number": k}) for k, row in enumerate(self._plan["cuts"], 1)]
        super().__init__(tuple(rows))
        self._starts = {row["number"]: row["start"] for row in self._rows() if "start" in row}

    def parts(self, state: tuple[str, ...]) -> Any:
        """Return the cuts by their numbers, each with the contours that it is of."""
        rows = sorted((json.loads(row) for row in state), key=lambda row: int(row["number"]))
        return [(row["number"], row["contours"]) for row in rows]

    def _rows(self) -> list[dict[str, Any]]:
        return [json.loads(row) for row in self.state]

    def _keep(self, rows: list[dict[str, Any]]) -> None:
        self.change(tuple(json.dumps(row) for row in rows))

    def _find(self, rows: list[dict[str, Any]], stop: int) -> dict[str, Any]:
        for row in rows:
            if row["number"] == stop:
                return row
        raise OptionError("this cut is not in the plan")

    @staticmethod
    def _fix(row: dict[str, Any], word: str) -> None:
        row["fixed"] = sorted({*row["fixed"], word})

    def move(self, stop: int, onto: int) -> None:
        """Put a cut where another one is; the order of all is fixed: a cut between two others is nowhere else."""
        rows = self._rows()
        row, target = self._find(rows, stop), self._find(rows, onto)
        to = rows.index(target)
        rows.remove(row)
        rows.insert(to, row)
        for one in rows:
            self._fix(one, "order")
        self._keep(rows)

    def to_end(self, stop: int, first: bool) -> None:
        """Put a cut first or last; the order of all is fixed."""
        numbers = [row["number"] for row in self._rows()]
        self.move(stop, numbers[0] if first else numbers[-1])

    def reverse(self, stop: int) -> None:
        """Cut it the other way round."""
        rows = self._rows()
        row = self._find(rows, stop)
        if row.get("direction") not in _OTHER:
            raise OptionError("the plan has no direction for this cut")
        row["direction"] = _OTHER[row["direction"]]
        self._fix(row, "direction")
        self._keep(rows)

    def place(self, stop: int, to: Point) -> None:
        """Begin a cut elsewhere; as near to there on its contour as can be."""
        rows = self._rows()
        row = self._find(rows, stop)
        row["start"] = [round(v, 3) for v in to]
        self._fix(row, "start")
        self._keep(rows)

    def free_after(self, stop: int) -> None:
        """Fix no order of the cuts after this one, but that they come after it."""
        rows = self._rows()
        at = rows.index(self._find(rows, stop))
        for row in rows:
            row["fixed"] = [word for word in row["fixed"] if word not in ("order", "ahead")]
        for row in rows[: at + 1]:
            self._fix(row, "order")
        self._fix(rows[at], "ahead")
        self._keep(rows)

    def stops(self) -> list[OrderStop]:
        """Return all cuts in their order, each where it begins; while no order is fixed, that found is held."""
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

    def text(self) -> str:
        """Return the plan file."""
        cuts = [{key: value for key, value in row.items() if key != "number"} for row in self._rows()]
        return json.dumps({**self._plan, "cuts": cuts}, indent=1) + "\n"


def cuts_one_by_one(text: str) -> bool:
    """Return whether every row of a plan file is a cut of its own, with a place to begin."""
    return all(
        "start" in row and not row.get("bridge") and len(row["contours"]) == 1 for row in json.loads(text)["cuts"]
    )
