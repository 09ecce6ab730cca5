"""Result of comparing two programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut.errors import count_of
from leafcut.model.certificate import Certificate
from leafcut.results.base import Result


@dataclass(frozen=True, repr=False, eq=False)
class VerificationResult(Result, Certificate):
    """The comparison of two programs. `save` writes ``.json``, but no picture."""

    def _summary_line(self) -> str:
        if not self.same:
            return f"{count_of(len(self.differences), 'difference')}; {self.differences[0]}"
        return f"same work: {count_of(self.after.holes, 'hole')}, {count_of(self.after.cuts, 'cut')}"

    def _json_answer(self) -> dict[str, Any]:
        from leafcut.report.json_answer import verification_as_json

        return verification_as_json(self)
