"""Benchmark boards, and a check of tours that shares no code with leafcut.

The check verifies that a tour visits every node once. It computes the length only with NumPy, rounded by the rules of
TSPLIB (G. Reinelt, TSPLIB 95, section 2).
"""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchmarks import data_folder

#: Default boards: drilling patterns, then large maps.
BOARDS = (
    "pcb442", "d1291", "fl1577", "u1817", "d2103", "u2319", "pcb3038", "fl3795", "rl5915", "rl11849", "pla85900",
    "mona-lisa100K", "uniform:1000000",
)  # fmt: skip

#: Best known lengths that are not proved optimal, with their source; the lower bound is 5,757,084 (Concorde, 2012).
#: Source: https://www.math.uwaterloo.ca/tsp/data/ml/monalisa.html
BEST_KNOWN = {"mona-lisa100K": (5_757_191.0, "best known, Nagata 2009")}

#: Factor on √(nA) that the length of the shortest tour of n random points on an area A approaches.
#: Source: D. S. Johnson, L. A. McGeoch and E. E. Rothberg, Asymptotic experimental analysis for the Held–Karp traveling
#: salesman bound, SODA 1996.
UNIFORM_CONSTANT = 0.7124

#: Side length of the square that contains the random points.
SIDE = 1e6

#: Relative rounding error of a sum of a million square roots in any order.
TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Board:
    """Points float64[n, 2], the distance rule of TSPLIB (or ``euclidean``), and the reference length."""

    name: str
    xy: NDArray[np.float64]
    rule: str
    reference: float
    reference_words: str

    @property
    def n(self) -> int:
        """Number of nodes."""
        return len(self.xy)

    def gap_percent(self, length: float) -> float:
        """Return the gap between a length and the reference, in percent."""
        return 100.0 * (length / self.reference - 1.0)


def load(name: str) -> Board:
    """Return the board from a TSPLIB file in the data folder, or from ``uniform:N[:SEED]``.

    Raises
    ------
    ValueError, OSError
        The board or its reference length is unknown.
    """
    if name.startswith("uniform:"):
        return uniform(*(int(word) for word in name.split(":")[1:]))
    text = (data_folder() / "tsplib" / f"{name}.tsp").read_text(encoding="latin-1")
    keys, _, rest = text.partition("NODE_COORD_SECTION")
    rule = next(line.split(":")[1].strip() for line in keys.splitlines() if line.startswith("EDGE_WEIGHT_TYPE"))
    numbers = np.array(rest.replace("EOF", "").split(), dtype=np.float64).reshape(-1, 3)
    order = np.argsort(numbers[:, 0], kind="stable")
    reference, words = BEST_KNOWN.get(name) or (optimum(name), "optimal")
    return Board(name, np.ascontiguousarray(numbers[order, 1:]), rule, reference, words)


def optimum(name: str) -> float:
    """Return the optimal length from the list in the data folder."""
    with (data_folder() / "tsplib" / "optima.csv").open(encoding="utf-8", newline="") as file:
        lengths = {row["name"]: float(row["optimal_length"]) for row in csv.DictReader(file)}
    if name not in lengths:
        raise ValueError(f"{name}: optima.csv has no optimal length")
    return lengths[name]


def uniform(n: int, seed: int = 1) -> Board:
    """Return n random points, uniformly distributed in a square; the reference is the asymptotic length of the shortest
    tour.
    """
    xy = np.random.default_rng(seed).uniform(0.0, SIDE, (n, 2))
    words = f"{UNIFORM_CONSTANT}·√(nA)"
    return Board(
        f"uniform:{n}" + (f":{seed}" if seed != 1 else ""),
        xy,
        "euclidean",
        UNIFORM_CONSTANT * math.sqrt(n) * SIDE,
        words,
    )


def rounded(rule: str, distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Euclidean distances, rounded by a TSPLIB rule.

    Raises
    ------
    ValueError
        The rule is neither EUC_2D, CEIL_2D nor ``euclidean`` (no rounding).
    """
    if rule == "EUC_2D":
        return np.floor(distance + 0.5)
    if rule == "CEIL_2D":
        return np.ceil(distance)
    if rule == "euclidean":
        return distance
    raise ValueError(f"EDGE_WEIGHT_TYPE {rule} is not supported; use EUC_2D or CEIL_2D")


def matrix(board: Board, dtype: str) -> NDArray[Any]:
    """Return all distances, [n, n], in an integer type; they are computed row by row to save memory."""
    whole: NDArray[Any] = np.empty((board.n, board.n), dtype=dtype)
    for row, place in zip(whole, board.xy, strict=True):
        row[:] = rounded(board.rule, np.hypot(*(board.xy - place).T))
    return whole


def checked_length(board: Board, tour: ArrayLike, stated: float | None = None) -> float:
    """Check a tour and return its independently computed length; `stated` is the length that the solver reports.

    Raises
    ------
    AssertionError
        The tour misses or repeats a node, or its length differs from `stated`.
    """
    order = np.asarray(tour, dtype=np.int64)
    if order.shape != (board.n,) or not np.array_equal(np.sort(order), np.arange(board.n)):
        raise AssertionError(f"{board.name}: the tour does not visit each of the {board.n} nodes once")
    steps = board.xy[np.roll(order, -1)] - board.xy[order]
    length = float(rounded(board.rule, np.sqrt(steps[:, 0] ** 2 + steps[:, 1] ** 2)).sum())
    if stated is not None and not math.isclose(length, stated, rel_tol=TOLERANCE):
        raise AssertionError(f"{board.name}: the tour is {length:.10g} long, the solver reports {stated:.10g}")
    return length
