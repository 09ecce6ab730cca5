"""The report about drilling. It contains the time that low travel moves save, and the stock for the 3D view."""

from __future__ import annotations

import numpy as np

from leafcut.message import Message
from leafcut.model.fact import Fact
from leafcut.model.shown_stock import ShownStock
from leafcut.processes.drilling.model import DrillingDetail
from leafcut.report.part_edge import edge_box_corners_near
from leafcut.report.path_report import PathReport
from leafcut.report.set_up import coordinate_words, height_facts, time_facts, tool_facts
from leafcut.units import to_fixed

#: The summary states a time saving of at least this, s. A smaller saving would be printed as 0.00 s.
_LEAST_SAVED = 0.005
#: The summary states a depth below the plate of at least this, mm.
_LEAST_BELOW = 0.005


class DrillingReport(PathReport[DrillingDetail]):
    """Facts and pictures of drilled holes. `PathReport` adds the gap to the lower bound."""

    def process_facts(self) -> list[Fact]:
        """Return facts about tools, heights, saved time, and the depth of the holes in a plate."""
        return [
            *tool_facts(self.outcome.operations),
            *self._depth_facts(),
            *self._height_facts(),
            *time_facts(self.outcome),
            *self.savings_facts(),
        ]

    def _depth_facts(self) -> list[Fact]:
        thickness, lowest = self.outcome.detail.thickness, float(self.outcome.path_after.extents[0][2])
        if self.outcome.detail.surface is not None or not self.outcome.operations:
            return []
        below = 0.0 if thickness is None else -thickness - lowest
        z = to_fixed(lowest, 2)
        if below < _LEAST_BELOW:
            words = Message("Z0 is the top; the lowest point is Z{}", z)
        else:
            words = Message("Z0 is the top; the lowest point is Z{}, {} mm below the plate", z, to_fixed(below, 2))
        return [Fact(sentence=words, name=Message("Depth"))]

    def _height_facts(self) -> list[Fact]:
        planes = self.outcome.detail.retract
        if planes is None:
            return []
        retract = " to ".join(dict.fromkeys(f"Z{coordinate_words(plane)}" for plane in planes))
        return height_facts(self.outcome.detail.clearance, retract)

    def savings_facts(self) -> list[Fact]:
        """Return the time that is saved by low travel moves over a surface. A negligible saving has no text."""
        saved = self.outcome.detail.low_travel_saved_s
        if saved is None or saved < _LEAST_SAVED:
            return [] if saved is None else [Fact("low_ways_saved_s", max(saved, 0.0), "s")]
        label = Message("saved compared with moves at the greatest height")
        return [Fact("low_ways_saved_s", saved, "s", label, Message("Low moves"))]

    def shown_stock(self) -> ShownStock:
        """Return the tools and the stock.

        The stock is the surface of the part. If there is no surface, it is the plate, as far as its size is known.
        """
        outcome, stock = self.outcome, super().shown_stock()
        if outcome.detail.surface is not None:
            return ShownStock(
                stock.tools, surface=outcome.detail.surface, finished=True, fixtures=outcome.detail.fixtures
            )
        thickness, part = outcome.detail.thickness, outcome.part
        x0, y0, x1, y1 = part.extents
        edge = edge_box_corners_near(part, np.array([x0, y0]), np.array([x1, y1]))
        bounds = (*edge.min(axis=0).tolist(), *edge.max(axis=0).tolist()) if len(edge) else None
        return ShownStock(stock.tools, around=bounds, floor=None if thickness is None else -thickness)
