"""A path as a line with stations: positions along it, and its nearest points to other positions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points, segments


@dataclass(frozen=True, eq=False)
class Track:
    """A line through points, float64[n, 2], mm; a station is the length from the first point."""

    points: Points

    @cached_property
    def stations(self) -> Points:
        """The station of each point, float64[n], mm."""
        stations: Points = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))])
        return stations

    def places(self, stations: Points) -> Points:
        """Return the positions at stations, float64[m, 2]."""
        return np.column_stack([np.interp(stations, self.stations, self.points[:, k]) for k in range(2)])

    @cached_property
    def _steps(self) -> Any:
        """Spatial index of the segments."""
        steps: Any = shapely.linestrings(segments(self.points))
        return shapely.STRtree(steps)

    def nearest(self, places: Points) -> tuple[Points, Points]:
        """Return the distances of positions, float64[m, 2], from the track, and the stations of its nearest points."""
        (row, step), away = self._steps.query_nearest(shapely.points(places), return_distance=True, all_matches=False)
        along = (self.points[1:] - self.points[:-1])[step]
        long = np.maximum((along**2).sum(axis=1), 1e-18)
        share = np.clip(((places[row] - self.points[step]) * along).sum(axis=1) / long, 0.0, 1.0)
        return away, self.stations[step] + share * np.sqrt(long)
