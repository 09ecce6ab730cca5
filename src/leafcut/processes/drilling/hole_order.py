"""Holes in the order of the user: those of the order file come first."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Ints

if TYPE_CHECKING:
    from leafcut.processes.drilling.plan.drilling import DrillPlan


def wanted_nodes(plan: DrillPlan, path: Path | None) -> dict[int, Ints]:
    """Return operation → the nodes of its routing problem that come first, in this order; {} without a file.

    Raises
    ------
    ReadError
        The file is not an order file.
    PlanError
        The order is of another drawing, or names an unknown hole or a hole twice.
    """
    from leafcut.read.order_file import drawing_of, load_order

    if path is None:
        return {}
    order, here = load_order(path), drawing_of(plan.part.hole_xy.tolist())
    if order.drawing is not None and order.drawing != here:
        has = "as many, in other places" if order.drawing.holes == here.holes else f"{here.holes}"
        raise PlanError(
            f"{path}: this is the order of another drawing, with {order.drawing.holes} holes; this one has {has}; "
            "make a new file for it, or remove 'drawing' from this one to use it anyway"
        )
    found = {}
    for number, holes in order.operations.items():
        what = f"{path}: operation {number + 1}"
        if number >= len(plan.operations):
            raise PlanError(f"{what}: there are {len(plan.operations)}; make a new file")
        operation = plan.operations[number]
        if operation.slots:
            raise PlanError(f"{what} mills slots; only holes can be given an order; remove it from the file")
        node_of = {int(hole): node for node, hole in enumerate(operation.targets)}
        for k, hole in enumerate(holes):
            if hole not in node_of:
                raise PlanError(f"{what}: hole {hole + 1} is not one that {operation.tool.label} drills")
            if hole in holes[:k]:
                raise PlanError(f"{what}: hole {hole + 1} is listed twice")
        found[number] = np.array([node_of[hole] for hole in holes], dtype=np.int32)
    return found
