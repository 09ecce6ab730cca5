"""The names of arrays and places: what a signature calls them, defined once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: A place in the plane: x and y, mm where nothing else is said.
Point = tuple[float, float]
#: A place in space: x, y and z, mm where nothing else is said.
Point3 = tuple[float, float, float]
#: Places, float64[n, 2] (or [n, 3] where z comes with them).
Points = NDArray[np.float64]
#: Numbers of any shape.
Floats = NDArray[np.float64]
#: Numbers of nodes and clusters, as kernels want them: orders, tours, clusters.
Ints = NDArray[np.int32]
#: Numbers of rows, by which NumPy takes from other arrays.
Indices = NDArray[np.int64]
#: Which rows are meant.
Mask = NDArray[np.bool_]
