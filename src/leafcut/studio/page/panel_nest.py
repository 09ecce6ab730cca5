"""The result of nesting: all variants with the totals of their cuts, and the sheets of the selected variant."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from leafcut.studio.jobs.history import JobRecord, JobState
from leafcut.studio.jobs.jobs import error_line
from leafcut.studio.jobs.sheets import GOING, SheetOfNest, compare_variants, sheets_in_answer, start_cut_planning
from leafcut.studio.page import headline
from leafcut.studio.page.elements import Form, box, button, link, text
from leafcut.studio.page.page_state import View
from leafcut.units import format_time

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Interval between updates while cuts are being planned, s.
_PACE = 0.5
_NO_TIME = {
    JobState.FAILED.value: "state.failed", JobState.CANCELLED.value: "state.cancelled",
    JobState.INTERRUPTED.value: "state.interrupted",
}  # fmt: skip


class NestPanel:
    """The card with the variants of a nest. Its buttons cut a sheet or plan the cuts of all sheets."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        self._record: JobRecord | None = None
        self._answer: dict[str, Any] = {}
        self._sheets: list[SheetOfNest] = []
        self._rows: list[dict[str, Any]] = []
        self._next = 0.0

    def draw(self, record: JobRecord, answer: dict[str, Any]) -> None:
        """Show the result of a nest in the current container."""
        w = self.view.words
        self._record, self._answer, self._sheets = record, answer, sheets_in_answer(record.id, answer)
        self._rows = compare_variants(self.view.studio.jobs, record.id)
        best = answer["variants"][0]
        text("p", f"{best['utilisation_of_used_percent']:.1f} %", "headline")
        text("p", w("nest.used"), "under")
        size = ", ".join(f"{sheet['length_mm']:g} × {sheet['width_mm']:g} mm" for sheet in answer["sheets"])
        text(
            "p",
            w("nest.spaced", size=size, spacing=f"{answer['spacing_mm']:g}", margin=f"{answer['margin_mm']:g}"),
            "quiet",
        )
        missing = headline.missing_words(answer, w)
        if missing:
            text("p", missing, "badge no")
        text("p", w("nest.verified_placed" if missing else "nest.verified"), "badge")
        self.variants = box("div", "variants")
        with box("section", "cuts", aria_label=w("group.cuts")):
            self.form = Form(w, self._set_option, on_refused=lambda line: self.page.show_message(line, True))
            button(w("nest.compare"), self._start_cut_planning, "primary wide")
            text("p", w("nest.compare_text"), "quiet small")
        self._show_form()
        self._draw_variants()

    def leave(self) -> None:
        """Stop updating the nest, because it is no longer visible."""
        self._record = None

    def tick(self) -> None:
        """Update the totals while cuts are being planned."""
        if self._record is None or time.monotonic() < self._next:
            return
        self._next = time.monotonic() + _PACE
        if not any(row["state"] in GOING for row in self._rows):
            return
        rows = compare_variants(self.view.studio.jobs, self._record.id)
        if rows != self._rows:
            self._rows = rows
            self._draw_variants()

    def _draw_variants(self) -> None:
        w = self.view.words
        timed = any(row["state"] != "none" for row in self._rows)
        self.variants.clear()
        with self.variants:
            with box("div", "scroll"), box("table", "nests", aria_label=w("nest.variants")):
                with box("thead"), box("tr"):
                    for key, classes in (
                        ("variant", ""),
                        ("percent", "n"),
                        ("sheets", "n"),
                        ("time" if timed else "last", "n"),
                    ):
                        text("th", w(f"nest.{key}"), classes, scope="col")
                with box("tbody"):
                    for number, variant in enumerate(self._answer["variants"], 1):
                        self._draw_variant(number, variant, timed)
            self._draw_sheets()

    def _draw_variant(self, number: int, variant: dict[str, Any], timed: bool) -> None:
        w, row = self.view.words, self._rows[number - 1]
        is_current = number == self.view.sheet[0]
        with box("tr", "here" if is_current else ""):
            with box("th", "", scope="row"):
                pressed = "true" if is_current else "false"
                words = f"{number} · {w('nest.' + variant['method'])}"
                button(
                    words,
                    lambda: self.show_sheet(number, 1),
                    "small",
                    aria_pressed=pressed,
                    title=w("nest.seed", seed=variant["seed"]),
                )
            text("td", f"{variant['utilisation_of_used_percent']:.1f}", "n")
            text("td", str(variant["sheets"]), "n")
            if timed:
                text(
                    "td",
                    self._time_text(row),
                    "n best" if row["quickest"] else "n",
                    title=w.translate_for_page(row["line"]),
                )
            else:
                text("td", f"{variant['used_length_of_last_mm']:,.0f} mm", "n")

    def _time_text(self, row: dict[str, Any]) -> str:
        w = self.view.words
        if row["time_s"] is not None:
            return format_time(row["time_s"])
        return "…" if row["state"] in GOING else w(_NO_TIME[row["state"]]) if row["state"] in _NO_TIME else "–"

    def _draw_sheets(self) -> None:
        w = self.view.words
        variant = self._answer["variants"][self.view.sheet[0] - 1]
        row = self._rows[self.view.sheet[0] - 1]
        sheets = [sheet for sheet in self._sheets if sheet.variant == self.view.sheet[0]]
        with box("ul", "sheets", aria_label=w("nest.sheets_of", number=self.view.sheet[0])):
            for sheet in sheets:
                self._draw_sheet(sheet, variant["layouts"][sheet.number - 1], row["jobs"][sheet.number - 1])
        if row["time_s"] is not None:
            figures = w("nest.cut", metres=f"{row['cut_mm'] / 1000.0:,.1f}", pierces=f"{row['pierces']:,}")
            cost = "" if row["cost"] is None else w("nest.cost", cost=f"{row['cost']:,.2f}")
            text("p", f"{figures}{cost}", "quiet small")
        if row["line"]:
            text("p", w.translate_for_page(row["line"]), "error small")
        if variant["cost"] is not None:
            text("p", w("nest.sheets_cost", cost=f"{variant['cost']:,.2f}"), "quiet small")
        if variant["unplaced"]:
            left = ", ".join(f"{count} × {name}" for name, count in list(variant["unplaced"].items())[:5])
            text("p", w("nest.unplaced", left=left), "error")

    def _draw_sheet(self, sheet: SheetOfNest, layout: dict[str, Any], job: str | None) -> None:
        w = self.view.words
        record = None if job is None else self.view.studio.jobs.record(job)
        with box("li", "here" if (sheet.variant, sheet.number) == self.view.sheet else ""):
            pressed = "true" if (sheet.variant, sheet.number) == self.view.sheet else "false"
            words = w("nest.sheet", number=sheet.number) + (f" × {sheet.count}" if sheet.count > 1 else "")
            parts = ", ".join(f"{count} × {name}" for name, count in layout["parts"].items())
            button(
                words,
                lambda: self.show_sheet(sheet.variant, sheet.number),
                "small plain",
                aria_pressed=pressed,
                title=parts,
            )
            text("span", w("nest.parts", number=sum(layout["parts"].values())), "quiet small")
            link(
                "DXF",
                f"/api/jobs/{sheet.job}/files/{sheet.drawing}",
                "button small",
                download=sheet.file,
                title=sheet.file,
            )
            if record is not None and record.state.has_result:
                button(w("nest.program"), lambda: self.page.open_job(record.id), "small")
            else:
                button(w("nest.take"), lambda: self.page.input.open_sheet(sheet), "small", title=w("nest.take_text"))

    def show_sheet(self, variant: int, number: int) -> None:
        """Show a sheet of a variant in the drawing."""
        self.view.sheet = (variant, number)
        self.page.run.draw()
        self._draw_variants()

    def _show_form(self) -> None:
        self.form.show(self.view.values, self.view.table.file_names, self.view.field_errors(), self.view.cut_form())

    def _set_option(self, name: str, value: Any, shown: str) -> None:
        self.view.table.set_value(name, value, shown)
        self._show_form()
        self.page.input.draw()

    def _start_cut_planning(self) -> None:
        view = self.view
        if self._record is None:
            return
        try:
            start_cut_planning(view.studio.jobs, self._record.id, view.cut_options())
        except Exception as problem:
            self.page.show_message(error_line(problem), True)
            return
        self.page.show_message("")
        self._rows = compare_variants(view.studio.jobs, self._record.id)
        self._draw_variants()
