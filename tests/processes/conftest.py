"""Outcomes made by hand, for the tests of reports."""

from __future__ import annotations

from made_outcomes import empty_outcome, every_outcome, outcome_of

__all__ = ["empty_outcome", "every_outcome", "outcome_of"]
