"""Paths with stations. A station is a distance along the path, measured from its start."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import shapely

from leafcut.geometry.arrays import Points, consecutive_segments


@dataclass(frozen=True, eq=False)
class StationedPath:
    """A path through points, float64[n, 2], mm. A station is the distance along the path from the first point, mm."""

    points: Points

    @cached_property
    def stations(self) -> Points:
        """The station of each point of the path, float64[n], mm."""
        stations: Points = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.points, axis=0).T))])
        return stations

    def positions_at(self, stations: Points) -> Points:
        """Return the positions at the given stations, float64[m, 2], mm."""
        return np.column_stack([np.interp(stations, self.stations, self.points[:, k]) for k in range(2)])

    @cached_property
    def _steps(self) -> Any:
        steps: Any = shapely.linestrings(consecutive_segments(self.points))
        return shapely.STRtree(steps)

    def nearest_stations(self, places: Points) -> tuple[Points, Points]:
        """Find the nearest point on the path for each of the positions `places`, float64[m, 2], mm.

        Return the distance from each position to its nearest point, and the station of this point, both float64[m],
        mm.
        """
        (row, step), away = self._steps.query_nearest(shapely.points(places), return_distance=True, all_matches=False)
        along = (self.points[1:] - self.points[:-1])[step]
        long = np.maximum((along**2).sum(axis=1), 1e-18)
        share = np.clip(((places[row] - self.points[step]) * along).sum(axis=1) / long, 0.0, 1.0)
        return away, self.stations[step] + share * np.sqrt(long)


@dataclass(frozen=True, eq=False)
class Ring(StationedPath):
    """A closed path of the tool centre that is `level` step-overs away from the wall.

    The last point repeats the first point.
    """

    level: int

    @classmethod
    def from_open_points(cls, points: Points, level: int) -> Ring:
        """Create a ring from points, float64[n, 2], that do not include the closing point."""
        return cls(np.vstack([points, points[:1]]), level)

    @cached_property
    def line(self) -> Any:
        """The ring as a closed shapely LineString."""
        return shapely.LineString(self.points)

    @property
    def length(self) -> float:
        """Length of the ring, mm."""
        return float(self.stations[-1])

    def position_at(self, station: float) -> Points:
        """Return the position at a station, float64[2], mm. The station may exceed the length of the ring."""
        place: Points = self.positions_at(np.array([station]))[0]
        return place

    def positions_at(self, stations: Points) -> Points:
        """Return the positions at several stations, float64[n, 2], mm. A station may exceed the length of the ring."""
        return super().positions_at(stations % self.length)

    def points_between(self, start: float, end: float) -> Points:
        """Return the points of the ring from station `start` to station `end` ≥ `start`, float64[m, 2], mm."""
        points, own = self.points[:-1], self.stations[:-1]
        lap, last = math.floor(start / self.length), math.floor(end / self.length)
        parts = [self.position_at(start)[None]]
        while lap <= last:
            a, b = np.searchsorted(own, (start + 1e-9 - lap * self.length, end - 1e-9 - lap * self.length))
            parts.append(points[a:b])
            lap += 1
        return np.vstack([*parts, self.position_at(end)[None]])

    def nearest_station(self, place: Points) -> float:
        """Return the station at which the ring is closest to a position, mm."""
        return float(self.nearest_stations(np.asarray(place)[None, :2])[1][0])
