"""Prove by simulation that a reordered program leaves the same stock (as a height field) and collides no deeper.

This second proof is independent of the first proof (`certificate`), which compares the cuts. Both proofs only share the
interpretation of the programs.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from leafcut.errors import VerifyError, count_of
from leafcut.gcode.program import Program
from leafcut.material.cutting import Removed, collision_depths, simulate_cutting
from leafcut.material.height_field import HeightField
from leafcut.material.same_stock import stock_differences
from leafcut.material.straight_moves import StraightMoves, cutting_moves_for_cells
from leafcut.message import Message
from leafcut.model.cutter import BodyPart, Cutter
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Issue, Severity
from leafcut.model.tool import Tool
from leafcut.units import to_fixed

#: Tolerance for heights, mm. Rounding depends on the order of the cuts.
TOLERANCE = 0.01
#: Issue codes, by kind of collision with the material.
_KINDS = {"rapid": "L802", "shank": "L809", "holder": "L809"}


@dataclass(frozen=True)
class _ToolCollisions:
    """Collisions of a tool with the material: greatest depth, mm, line of the first collision, and number of moves."""

    deepest: float
    line: int
    count: int


@dataclass(frozen=True, eq=False)
class StockJudge:
    """Compares the stock and the collisions of programs with the original program.

    Attributes
    ----------
    tools
        Tools of the original program by number. The shape of each tool is known or assumed to be flat.
    cutters, bodies
        Shapes of the cutting edges, and of the shanks and holders, by tool number.
    stock, given
        Stock before the first cut, and whether the user described it. Otherwise, it is a block around the cuts.
    left, met
        Stock that the original program leaves, and its collisions by tool and kind.
    touched
        Whether the original program cuts at all.
    """

    tools: Mapping[int, Tool]
    cutters: Mapping[int, Cutter]
    bodies: Mapping[int, tuple[BodyPart, ...]]
    stock: HeightField
    given: bool
    left: HeightField
    met: Mapping[tuple[int, str], _ToolCollisions]
    touched: bool

    @classmethod
    def from_original(
        cls,
        original: Program,
        tools: Mapping[int, Tool],
        cutters: Mapping[int, Cutter],
        bodies: Mapping[int, tuple[BodyPart, ...]],
        stock: HeightField,
        given: bool,
        check_cancelled: Heartbeat = ignore_heartbeat,
    ) -> StockJudge:
        """Simulate the original program and create its judge.

        Raises
        ------
        PlanError
            The simulation has too many moves.
        """
        left, met, touched = _simulate(original, cutters, bodies, stock, check_cancelled)
        return cls(tools, cutters, bodies, stock, given, left, met, touched)

    def check(self, new: Program, check_cancelled: Heartbeat = ignore_heartbeat) -> None:
        """Check that a program leaves the same stock as the original program, without deeper collisions.

        Raises
        ------
        VerifyError
            The stock differs, or a collision is deeper.
        """
        left, met, _ = _simulate(new, self.cutters, self.bodies, self.stock, check_cancelled)
        differences = stock_differences(self.left, left, TOLERANCE)
        if differences:
            one = differences[0]
            more = Message(" (and {})", count_of(len(differences) - 1, "more place")) if len(differences) > 1 else ""
            raise VerifyError(
                "at X{} Y{} the new program leaves the stock at Z{}, not at Z{}{}",
                to_fixed(one.x, 3),
                to_fixed(one.y, 3),
                to_fixed(one.after, 3),
                to_fixed(one.before, 3),
                more,
            )
        for (tool, kind), found in met.items():
            before = self.met.get((tool, kind))
            if found.deepest > (before.deepest if before else 0.0) + TOLERANCE:
                raise VerifyError(
                    "{} {:.2f} mm deep into the stock, first in line {} of the new program",
                    Message("a rapid of T{} goes", tool)
                    if kind == "rapid"
                    else Message("the {} of T{} gets", kind, tool),
                    found.deepest,
                    found.line,
                )

    def issues(self) -> Iterator[Issue]:
        """Yield the collisions of the original program, as one issue per tool and kind of collision."""
        for (tool, kind), found in self.met.items():
            deep = Message("up to {:.2f} mm deep", found.deepest)
            if kind == "rapid":
                message = Message("{} of T{} in the stock, {}", count_of(found.count, "rapid"), tool, deep)
            else:
                message = Message(
                    "the {} of T{} is in the stock on {}, {}", kind, tool, count_of(found.count, "move"), deep
                )
            if not self.given:
                message = Message("{}, if the stock is a block around the cuts; give --workpiece", message)
            severity = Severity.DANGER if self.given else Severity.WARNING
            yield Issue(_KINDS[kind], message, Message("line {}", found.line), severity)


def _simulate(
    program: Program,
    cutters: Mapping[int, Cutter],
    bodies: Mapping[int, tuple[BodyPart, ...]],
    stock: HeightField,
    check_cancelled: Heartbeat,
) -> tuple[HeightField, dict[tuple[int, str], _ToolCollisions], bool]:
    field = stock.copy()
    moves = cutting_moves_for_cells(program.path, cutters, field.cell)
    removed = simulate_cutting(field, moves, cutters, os.cpu_count() or 1, check_cancelled, bodies=bodies)
    return field, _collisions_by_tool(moves, removed), bool(removed.cuts.any())


def _collisions_by_tool(moves: StraightMoves, removed: Removed) -> dict[tuple[int, str], _ToolCollisions]:
    found: dict[tuple[int, str], _ToolCollisions] = {}
    for kind, depth in collision_depths(moves, removed).items():
        there = np.flatnonzero(depth > 0.0)
        for tool in np.unique(moves.tool[there]).tolist():
            mine = there[moves.tool[there] == tool]
            line = int(moves.path.line[moves.row[mine[0]]])
            found[tool, kind] = _ToolCollisions(float(depth[mine].max()), line, len(mine))
    return found
