"""Result of stock removal, which is the remaining stock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut.errors import count_of
from leafcut.material.stock_cut import StockCut
from leafcut.results.base import Kinds, Result

_MM3_PER_CM3 = 1000.0


@dataclass(frozen=True, repr=False, eq=False)
class StockResult(Result, StockCut):
    """The stock that a program leaves. `save` writes ``.png``, ``.stl``, ``.svg`` or ``.json``."""

    def _summary_line(self) -> str:
        dangers = len(self.rapids) + len(self.collisions)
        removed = f"{self.removed_mm3 / _MM3_PER_CM3:.2f} cm³ by {count_of(len(self.tools), 'tool')}"
        return f"{self.program}: {removed}, {count_of(dangers, 'collision')}"

    def _json_answer(self) -> dict[str, Any]:
        from leafcut.report.stock_report import stock_as_json

        return stock_as_json(self)

    def _svg(self) -> str:
        from leafcut.report.pictures import stock_picture

        return stock_picture(self)

    def _contents_by_extension(self) -> Kinds:
        from leafcut.report.stock_report import stock_file_data

        return super()._contents_by_extension() | {
            ".png": lambda: stock_file_data(self, ".png"),
            ".stl": lambda: stock_file_data(self, ".stl"),
        }
