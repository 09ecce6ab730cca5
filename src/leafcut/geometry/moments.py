"""Mean squared distances of points from their best line and their best circle, for all runs of points at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from leafcut.geometry.arrays import Floats

_TINY = 1e-12


class Moments(NamedTuple):
    """Means and central moments of x, y and z = x² + y² of the first n points of each row, for every n."""

    x: Floats
    y: Floats
    xx: Floats
    yy: Floats
    xy: Floats
    xz: Floats
    yz: Floats
    zz: Floats


def moments(points: Floats, weights: Floats) -> Moments:
    """Return the moments of the first 1, 2, 3 … points of each row of `points`, float64[rows, n, 2].

    The points should lie near the origin to preserve precision.
    """
    x, y = points[..., 0], points[..., 1]
    z = x * x + y * y
    total = np.maximum(np.cumsum(weights, axis=1), _TINY)

    def mean(values: Floats) -> Floats:
        return np.asarray(np.cumsum(weights * values, axis=1) / total)

    a, b, xx, yy, xy, xz, yz = mean(x), mean(y), mean(x * x), mean(y * y), mean(x * y), mean(x * z), mean(y * z)
    # Relative to the mean (a, b), z becomes z − 2ax − 2by + c with c = a² + b². Its mean is the covariance's trace.
    c = a * a + b * b
    trace = np.maximum(xx + yy - c, 0.0)
    zz = mean(z * z) + 4.0 * (a * a * xx + b * b * yy + 2.0 * a * b * xy - a * xz - b * yz) + 2.0 * c * (xx + yy)
    return Moments(
        a,
        b,
        np.maximum(xx - a * a, 0.0),
        np.maximum(yy - b * b, 0.0),
        xy - a * b,
        xz - 2.0 * (a * xx + b * xy) + c * a - a * trace,
        yz - 2.0 * (a * xy + b * yy) + c * b - b * trace,
        zz - 3.0 * c * c,
    )


def line_error(m: Moments) -> Floats:
    """Return the mean squared distance from the best line, which is the smaller eigenvalue of the covariance matrix."""
    half = 0.5 * (m.xx + m.yy)
    return np.maximum(half - np.sqrt(0.25 * (m.xx - m.yy) ** 2 + m.xy**2), 0.0)


def circle_error(m: Moments) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the approximate mean squared distance from the best circle, the coordinates of its centre, and its radius.

    The centre is relative to the mean of the points.

    Source: Taubin, "Estimation of planar curves …", IEEE Trans. PAMI 13 (1991); Newton's method from 0 for the root, as
    in Chernov, "Circular and linear regression" (2010), section 5.9.
    """
    trace, area = m.xx + m.yy, m.xx * m.yy - m.xy**2
    spread = m.zz - trace**2
    a3, a2 = 4.0 * trace, -3.0 * trace**2 - m.zz
    a1 = spread * trace + 4.0 * area * trace - m.xz**2 - m.yz**2
    a0 = m.xz * (m.xz * m.yy - m.yz * m.xy) + m.yz * (m.yz * m.xx - m.xz * m.xy) - spread * area
    root = np.zeros_like(trace)
    with np.errstate(all="ignore"):
        for _ in range(8):
            slope = a1 + root * (2.0 * a2 + 3.0 * a3 * root)
            step = (a0 + root * (a1 + root * (a2 + root * a3))) / slope
            root = root - np.where(np.isfinite(step), step, 0.0)
        root = np.where(np.isfinite(root) & (root >= 0.0), root, 0.0)
        # Three points always lie on a circle; the root is then 0 within rounding.
        down = 2.0 * (root * root - root * trace + area)
        x = (m.xz * (m.yy - root) - m.yz * m.xy) / down
        y = (m.yz * (m.xx - root) - m.xz * m.xy) / down
        return root, x, y, np.sqrt(x * x + y * y + trace)
