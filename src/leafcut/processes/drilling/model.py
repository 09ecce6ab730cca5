"""What drilling alone finds out in a run: nothing that not every process does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar


@dataclass(frozen=True)
class DrillingDetail:
    """Drilling: all that there is to tell is of every outcome."""

    report: ClassVar[str] = "leafcut.report.path_report:PathReport"
