"""What is told of holes that are drilled: what is told of every path over holes, and how thick their plate is."""

from __future__ import annotations

import numpy as np

from leafcut.model.outcome import Outcome
from leafcut.model.shown_stock import ShownStock
from leafcut.processes.drilling.model import DrillingDetail
from leafcut.report.part_edge import near_edge
from leafcut.report.path_report import PathReport


class DrillingReport(PathReport[DrillingDetail]):
    """What holes show."""

    def __init__(self, outcome: Outcome[DrillingDetail]) -> None:
        super().__init__(outcome)

    def stock(self) -> ShownStock:
        """Return the tools, the edge of the plate as far as it is drawn, and its thickness as far as it is given."""
        outcome, found = self.outcome, super().stock()
        thickness, part = outcome.detail.thickness, outcome.part
        x0, y0, x1, y1 = part.extents
        edge = near_edge(part, np.array([x0, y0]), np.array([x1, y1]))
        around = (*edge.min(axis=0).tolist(), *edge.max(axis=0).tolist()) if len(edge) else None
        return ShownStock(found.tools, around=around, floor=None if thickness is None else -thickness)
