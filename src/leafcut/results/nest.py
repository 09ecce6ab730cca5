"""Result of nesting."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from leafcut.errors import count_of
from leafcut.model.nest import NestOutcome
from leafcut.processes import registry
from leafcut.results.base import Result


@dataclass(frozen=True, repr=False, eq=False)
class NestResult(Result, NestOutcome):
    """Parts nested on sheets.

    `save` writes the best nest as ``.dxf``, ``.svg`` or ``.json``. If it needs several DXF files, it numbers them.
    """

    def _summary_line(self) -> str:
        best = self.nests[0]
        used = f"{100.0 * best.utilisation_of_used:.1f} % used"
        return f"{count_of(best.n_placed, 'part')} on {count_of(best.n_sheets, 'sheet')}, {used}, by {best.method}"

    def _json_answer(self) -> dict[str, Any]:
        answer: dict[str, Any] = registry.command_function("nest_answer")(self)
        return answer

    def _svg(self) -> str:
        from leafcut.report.pictures import nest_picture

        return nest_picture(self)

    def _extensions(self) -> Iterable[str]:
        return (".dxf", *super()._extensions())

    def _files_to_save(self, file: Path) -> Iterable[tuple[str, str | bytes]]:
        if file.suffix.lower() != ".dxf":
            return super()._files_to_save(file)
        return zip(self.names(file)[0], self.drawings[0], strict=True)
