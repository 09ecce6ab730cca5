"""The boards that are measured, and a judge of tours that shares no code with leafcut.

A tour is checked to visit every node once, and its length is added up again with NumPy alone, rounded as the report of
TSPLIB says (G. Reinelt, TSPLIB 95, section 2).
"""

from __future__ import annotations

import csv
import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: The boards of the tables unless others are named: drilled boards, then large ones.
BOARDS = (
    "pcb442", "d1291", "fl1577", "u1817", "d2103", "u2319", "pcb3038", "fl3795", "rl5915", "rl11849", "pla85900",
    "mona-lisa100K", "uniform:1000000",
)  # fmt: skip

#: Best known lengths that are not proven, and who found them; the lower bound there is 5,757,084 (Concorde, 2012).
#: Source: https://www.math.uwaterloo.ca/tsp/data/ml/monalisa.html
BEST_KNOWN = {"mona-lisa100K": (5_757_191.0, "best known, Nagata 2009")}

#: The shortest tour of n random points on an area A tends to this times √(nA).
#: Source: D. S. Johnson, L. A. McGeoch and E. E. Rothberg, Asymptotic experimental analysis for the Held–Karp traveling
#: salesman bound, SODA 1996.
UNIFORM_CONSTANT = 0.7124

#: Side of the square of the random points.
SIDE = 1e6

#: What of a sum of a million rounded square roots may differ when it is added up in another order.
TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Board:
    """Points float64[n, 2], TSPLIB's rule of distance (or ``euclidean``), and the length to compare with."""

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
        """Return how far a length is above the reference, percent."""
        return 100.0 * (length / self.reference - 1.0)


def data_folder() -> Path:
    """Return the folder of the TSPLIB files: ``tsplib`` in LEAFCUT_DATA, or in ../shared/data beside the checkout."""
    root = os.environ.get("LEAFCUT_DATA") or Path(__file__).parents[2] / "shared" / "data"
    return Path(root) / "tsplib"


def load(name: str) -> Board:
    """Return the board of a TSPLIB file in the data folder, or of ``uniform:N[:SEED]``.

    Raises
    ------
    ValueError, OSError
        There is no such board, or nothing that its tours can be compared with.
    """
    if name.startswith("uniform:"):
        return uniform(*(int(word) for word in name.split(":")[1:]))
    keys, _, rest = (data_folder() / f"{name}.tsp").read_text(encoding="latin-1").partition("NODE_COORD_SECTION")
    rule = next(line.split(":")[1].strip() for line in keys.splitlines() if line.startswith("EDGE_WEIGHT_TYPE"))
    numbers = np.array(rest.replace("EOF", "").split(), dtype=np.float64).reshape(-1, 3)
    order = np.argsort(numbers[:, 0], kind="stable")
    reference, words = BEST_KNOWN.get(name) or (optimum(name), "optimal")
    return Board(name, np.ascontiguousarray(numbers[order, 1:]), rule, reference, words)


def optimum(name: str) -> float:
    """Return the optimal length that the list beside the files gives."""
    with (data_folder() / "optima.csv").open(encoding="utf-8", newline="") as file:
        lengths = {row["name"]: float(row["optimal_length"]) for row in csv.DictReader(file)}
    if name not in lengths:
        raise ValueError(f"{name}: no optimum is known to compare with")
    return lengths[name]


def uniform(n: int, seed: int = 1) -> Board:
    """Return n random points, uniform in a square, compared with what the shortest tour's length tends to."""
    xy = np.random.default_rng(seed).uniform(0.0, SIDE, (n, 2))
    words = f"{UNIFORM_CONSTANT}·√(nA)"
    return Board(f"uniform:{n}" + (f":{seed}" if seed != 1 else ""), xy, "euclidean",
                 UNIFORM_CONSTANT * math.sqrt(n) * SIDE, words)  # fmt: skip


def rounded(rule: str, distance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return Euclidean distances as a rule of TSPLIB rounds them.

    Raises
    ------
    ValueError
        The rule is not one of EUC_2D, CEIL_2D and ``euclidean`` (no rounding).
    """
    if rule == "EUC_2D":
        return np.floor(distance + 0.5)
    if rule == "CEIL_2D":
        return np.ceil(distance)
    if rule == "euclidean":
        return distance
    raise ValueError(f"EDGE_WEIGHT_TYPE {rule} is not measured here; only EUC_2D and CEIL_2D")


def matrix(board: Board, dtype: str) -> NDArray[Any]:
    """Return all distances, [n, n] of a whole-number type; row by row, so that no larger one is needed on the way."""
    whole: NDArray[Any] = np.empty((board.n, board.n), dtype=dtype)
    for row, place in zip(whole, board.xy, strict=True):
        row[:] = rounded(board.rule, np.hypot(*(board.xy - place).T))
    return whole


def checked_length(board: Board, tour: ArrayLike, stated: float | None = None) -> float:
    """Return the length of a tour, added up here; `stated` is what its maker says it is.

    Raises
    ------
    AssertionError
        The tour leaves out a node or visits one twice, or is not as long as stated.
    """
    order = np.asarray(tour, dtype=np.int64)
    if order.shape != (board.n,) or not np.array_equal(np.sort(order), np.arange(board.n)):
        raise AssertionError(f"{board.name}: the tour does not visit each of the {board.n} nodes once")
    steps = board.xy[np.roll(order, -1)] - board.xy[order]
    length = float(rounded(board.rule, np.sqrt(steps[:, 0] ** 2 + steps[:, 1] ** 2)).sum())
    if stated is not None and not math.isclose(length, stated, rel_tol=TOLERANCE):
        raise AssertionError(f"{board.name}: the tour is said to be {stated:.10g} long and is {length:.10g}")
    return length
