"""What cutting a sheet alone finds out: its cuts in three orders, each with its time and its cost."""

from __future__ import annotations

from dataclasses import dataclass

from leafcut.model.cutting import CutMeasures, CutPlan


@dataclass(frozen=True)
class SheetDetail:
    """A sheet in its order.

    Attributes
    ----------
    plans
        Its cuts in the three orders, before, nearest neighbour (None where there is none) and as written, each with its
        time and its cost.
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
