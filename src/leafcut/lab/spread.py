"""How the results of several runs are spread: mean, standard deviation, quartiles, and what lies far outside."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

#: So many times the distance between the quartiles a value may lie outside them before it is an outlier (Tukey 1977).
WHISKER = 1.5


@dataclass(frozen=True)
class Spread:
    """Numbers of which the least is the best.

    Attributes
    ----------
    deviation
        The standard deviation of a sample, with n - 1; None of one number alone.
    lower, median, upper
        Quartiles, between two numbers in proportion (NumPy's `linear`, Python's `inclusive`).
    low, high
        The least and the largest number that is no outlier.
    outliers
        Numbers further than `WHISKER` times the distance of the quartiles from them.
    """

    count: int
    best: float
    mean: float
    deviation: float | None
    worst: float
    lower: float
    median: float
    upper: float
    low: float
    high: float
    outliers: tuple[float, ...]

    @classmethod
    def of(cls, numbers: Iterable[float]) -> Spread:
        """Return the spread of one or more numbers."""
        values = np.sort(np.fromiter(numbers, dtype=np.float64))
        lower, median, upper = (float(q) for q in np.percentile(values, (25, 50, 75)))
        reach = WHISKER * (upper - lower)
        inside = (values >= lower - reach) & (values <= upper + reach)
        return cls(
            count=len(values),
            best=float(values[0]),
            mean=float(values.mean()),
            deviation=float(values.std(ddof=1)) if len(values) > 1 else None,
            worst=float(values[-1]),
            lower=lower,
            median=median,
            upper=upper,
            low=float(values[inside][0]),
            high=float(values[inside][-1]),
            outliers=tuple(values[~inside].tolist()),
        )
