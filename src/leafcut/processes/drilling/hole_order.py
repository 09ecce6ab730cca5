"""Holes in the order that a person wants: what the file says comes first, the rest is found around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from leafcut.errors import PlanError
from leafcut.geometry.arrays import Ints
from leafcut.model.problem import RoutingProblem
from leafcut.model.solution import Solution

if TYPE_CHECKING:
    from leafcut.processes.drilling.plan.drilling import DrillPlan


def wanted_nodes(plan: DrillPlan, path: Path | None) -> dict[int, Ints]:
    """Return operation → the nodes of its routing problem that come first, in this order.

    Raises
    ------
    ReadError
        It is no order file.
    PlanError
        It is the order of another drawing, or names what the program has not, or twice.
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


def solve_after(
    problem: RoutingProblem, first: Ints, search: Callable[[RoutingProblem], Solution], bound: Callable[..., Solution]
) -> Solution:
    """Return the path with the nodes `first` at its beginning, and the others as `search` finds best after them.

    `bound` certifies a solution of the whole problem: the bound of the rest alone says nothing of it.
    """
    from leafcut.order.instance import path_cost

    rest = np.setdiff1d(np.arange(problem.n_nodes, dtype=np.int32), first)
    nodes, told = first, Solution(first, 0.0, problem.metric.unit, "given", 0)
    if len(rest):
        x, y = problem.exit[first[-1]].tolist() if len(first) else problem.start or (None, None)
        told = search(
            RoutingProblem.of_points(
                problem.entry[rest], problem.metric, start=None if x is None else (x, y), end=problem.end,
                name=problem.name,
            )
        )  # fmt: skip
        nodes = np.concatenate([first, rest[told.nodes]]).astype(np.int32)
    cost = path_cost(problem, nodes)
    return bound(replace(told, nodes=nodes, cost=cost, history=((told.seconds, cost),), lower_bound=None))
