"""Result of cutting a sheet: its cuts in three orders, each with its time and its cost."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.cutting import CutMeasures, CutPlan


@dataclass(frozen=True)
class SheetDetail:
    """The cuts of a sheet in three orders.

    Attributes
    ----------
    plans
        The given order, nearest neighbour (None without one) and the order as written, each with its time and its cost.
    """

    plans: tuple[CutPlan, CutPlan | None, CutPlan]

    @property
    def plan(self) -> CutPlan:
        """The cuts in order as written."""
        return self.plans[-1]

    @property
    def norms(self) -> tuple[CutMeasures, CutMeasures | None, CutMeasures]:
        """The measures of `plans`."""
        before, nearest, after = self.plans
        return before.measures, None if nearest is None else nearest.measures, after.measures
