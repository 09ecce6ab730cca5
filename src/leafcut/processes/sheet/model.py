"""The result of planning a sheet: the cuts in up to three orders, with their times and costs."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.cutting import CutMeasures, CutPlan


@dataclass(frozen=True)
class SheetDetail:
    """The cuts of a sheet in up to three orders.

    These are the order of the input, the nearest-neighbour order (or None), and the order in the program.
    """

    plans: tuple[CutPlan, CutPlan | None, CutPlan]

    @property
    def plan(self) -> CutPlan:
        """The cuts in the order in which the program makes them."""
        return self.plans[-1]

    @property
    def norms(self) -> tuple[CutMeasures, CutMeasures | None, CutMeasures]:
        """Times, lengths and costs of the cuts in the three orders."""
        before, nearest, after = self.plans
        return before.measures, None if nearest is None else nearest.measures, after.measures
