"""Places sorted into horizontal bands for the kernels that look for what is near a place."""

from __future__ import annotations

import numpy as np

from leafcut.geometry.arrays import Floats
from leafcut.kernels.bands import Bands


def bands_of(places: Floats, side: float) -> Bands:
    """Return places, float64[n, 2], in bands so high, mm; higher where there would be more bands than places."""
    x, y = places.T
    low, high = float(y.min()), float(y.max())
    side = max(side, (high - low) / len(places))
    band = np.floor((y - low) / side).astype(np.int64)
    order = np.lexsort((x, band))
    first = np.searchsorted(band[order], np.arange(int(band.max()) + 2))
    return Bands(x[order], y[order], order, first, low, side)
