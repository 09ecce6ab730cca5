"""`Mesh`: the surface of a solid as triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import PlanError
from leafcut.message import Message


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of a surface, float64[n, 3, 3] (triangle, corner, x y z), mm.

    The mesh is `closed` if every edge belongs to two triangles, so that the surface encloses a volume.
    """

    triangles: NDArray[np.float64]
    name: str = ""
    closed: bool = True

    def __post_init__(self) -> None:
        if self.triangles.ndim != 3 or self.triangles.shape[1:] != (3, 3) or not len(self.triangles):
            raise PlanError("{}: a mesh needs triangles of shape (n, 3, 3)", self.name or Message("a mesh"))
        if not np.isfinite(self.triangles).all():
            raise PlanError("{}: a corner has a coordinate that is not a number", self.name or Message("a mesh"))

    @property
    def low(self) -> NDArray[np.float64]:
        """Lowest x, y and z, float64[3], mm."""
        return np.asarray(self.triangles.min(axis=(0, 1)))

    @property
    def high(self) -> NDArray[np.float64]:
        """Highest x, y and z, float64[3], mm."""
        return np.asarray(self.triangles.max(axis=(0, 1)))
