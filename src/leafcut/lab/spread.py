"""Spread of the results of several runs: mean, standard deviation, quartiles and outliers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

#: Distance from the quartiles beyond which a value is an outlier, in interquartile ranges (Tukey 1977).
WHISKER = 1.5


@dataclass(frozen=True)
class Spread:
    """Statistics of a sample in which smaller is better.

    Attributes
    ----------
    deviation
        Sample standard deviation (n - 1); None for a single number.
    lower, median, upper
        Quartiles, linearly interpolated (NumPy's `linear`, Python's `inclusive`).
    low, high
        Smallest and largest number that is not an outlier.
    outliers
        Numbers more than `WHISKER` interquartile ranges outside the quartiles.
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
        """Return the statistics of one or more numbers."""
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
