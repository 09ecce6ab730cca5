"""Result of an optimisation, which is a program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut.errors import count_of
from leafcut.model.outcome import Outcome
from leafcut.processes import registry
from leafcut.results.base import Kinds, Result
from leafcut.units import format_time


@dataclass(frozen=True, repr=False, eq=False)
class ProgramResult(Result, Outcome[Any]):
    """A program, with its measures before and after the search.

    `save` writes the program, or a report as ``.html``, ``.svg`` or ``.json``.
    """

    def _summary_line(self) -> str:
        before, after = format_time(self.before.time_s), format_time(self.after.time_s)
        times = f"{before} → {after}, {self.saved_percent:.1f} % saved"
        missing = f", {count_of(len(self.missing), 'issue')} of missing work" if self.missing else ""
        return f"{self.part.name}: {times}, {'' if self.verified else 'not '}verified{missing}"

    def _json_answer(self) -> dict[str, Any]:
        from leafcut.report.json_answer import program_as_json

        return program_as_json(registry.report_of(self))

    def _svg(self) -> str:
        from leafcut.report.page import path_svg

        return path_svg(registry.report_of(self), "after")

    def _contents_by_extension(self) -> Kinds:
        from leafcut.report.page import report_page_html

        program: Kinds = {
            "": lambda: self.text.encode(self.encoding),
            ".html": lambda: report_page_html(registry.report_of(self)),
        }
        return super()._contents_by_extension() | program
