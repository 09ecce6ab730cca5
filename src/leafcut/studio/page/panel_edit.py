"""Lets users change the order of a result (drag, reverse, or move stops to the start) and run it again."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui.events import GenericEventArguments

from leafcut.errors import LeafcutError, OptionError
from leafcut.studio.drawing.canvas import Canvas
from leafcut.studio.drawing.editing import CutOrder, Edited, HoleOrder, OrderStop, has_only_single_cuts
from leafcut.studio.drawing.scene import edited_scene
from leafcut.studio.jobs.history import History, JobRecord
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.form_values import FormValue, Setter
from leafcut.studio.page.page_state import View
from leafcut.studio.wording import Words
from leafcut.units import format_length

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Tolerance for equal lengths, mm.
_SAME = 1e-6
_EDITABLE = ("order", "plan")


def load_edited_order(history: History, job: str) -> Edited | None:
    """Return the order of a job's result, or None if users cannot edit it."""
    order, holes, plan = (history.artefact(job, name) for name in ("order", "holes", "plan"))
    if order is not None and holes is not None:
        rows = json.loads(order.data)["operations"]
        operations = {row["operation"] - 1: tuple(hole - 1 for hole in row["holes"]) for row in rows}
        return HoleOrder(operations, np.array(json.loads(holes.data), dtype=np.float64).reshape(-1, 2))
    if plan is not None and has_only_single_cuts(plan.data.decode()):
        return CutOrder(plan.data.decode())
    return None


@dataclass(frozen=True)
class TriedOrder:
    """A run with an edited order, and the state before this run. If the run fails, that state is restored."""

    edited: Edited
    #: The job whose result was edited, its visible sheet, and the job that runs the edited order.
    base: str | None
    sheet: tuple[int, int]
    job: str | None
    #: The previous value of the option that now contains the edited order.
    plan: FormValue | None


class EditPanel:
    """The card below the drawing that is visible while the user edits an order."""

    def __init__(self, view: View, page: Page, canvas: Canvas) -> None:
        self.view, self.page, self.canvas = view, page, canvas
        self.edited: Edited | None = None
        self._stop = 0
        self._tried: TriedOrder | None = None
        #: Result of `kept`. When the result of its job is shown, the user can continue to edit this order.
        self._waiting: dict[str, Any] | None = None
        #: Length of the straight travel moves when the user started to edit, mm.
        self._before = 0.0
        w = view.words
        with box("div", "edit", role="group", aria_label=w("edit.title"), data_focus_after="#edit-begin") as self.place:
            with box("div", "line"):
                text("b", w("edit.title"))
                with box("span", "ways"):
                    self.length = text("span", "", "figure")
                    self.change = text("span", "", "figure quiet")
                self.hint = text("span", "", "what quiet")
                self.chosen = text("span", "", "chosen-stop quiet", role="status", aria_live="polite")
            with box("div", "ends"):
                self.keys = StopKeys(w, self._stops, self._choose_stop, self._change_order)
            with box("div", "ends"):
                button(w("edit.undo"), lambda: self._undo_or_redo(back=True), "", data_key="u")
                button(w("edit.redo"), lambda: self._undo_or_redo(back=False), "", data_key="y")
                for name, act in (
                    ("first", lambda e: e.move_to_end(self._stop, True)),
                    ("last", lambda e: e.move_to_end(self._stop, False)),
                    ("reverse", lambda e: e.reverse(self._stop)),
                    ("free", lambda e: e.fix_order_up_to(self._stop)),
                ):
                    button(w(f"edit.{name}"), lambda act=act: self._change_chosen_stop(act), "")
                button(w("edit.write"), self.run_edited_order, "primary")
                self.close = button(w("edit.close"), self._close, "plain")
        self.place.set_visibility(False)

    def start(self, record: JobRecord) -> None:
        """Start to edit the result of a job."""
        edited = load_edited_order(self.view.studio.history, record.id)
        if edited is None:
            self.page.show_message(self.view.words("edit.cannot"), True)
            return
        self._before = _fixed_order_length(edited.stops())
        self._open(edited)

    def order_to_store(self) -> dict[str, Any] | None:
        """Return the edited order as plain values for `hold`, or None if the user is not editing an order."""
        if self.edited is None:
            return self._waiting
        return {"job": self.view.job, **self.edited.as_plain()}

    def store_order(self, kept: dict[str, Any] | None) -> None:
        """Store the result of `kept` until the page shows the result of its job."""
        self._waiting = kept

    def resume_stored_order(self) -> None:
        """Continue to edit the stored order, if the page shows its result."""
        kept, self._waiting = self._waiting, None
        if kept is None or self.view.job is None or kept.get("job") != self.view.job:
            return
        edited = load_edited_order(self.view.studio.history, self.view.job)
        if edited is not None:
            self._before = _fixed_order_length(edited.stops())
            edited.restore_plain(kept)
            self._open(edited)

    def discard(self) -> None:
        """Stop editing and discard any stored order."""
        self._waiting = None
        self.end()

    def _open(self, edited: Edited) -> None:
        self.edited, self._stop, self._waiting = edited, 0, None
        self.canvas.clear_selection()
        self.place.set_visibility(True)
        self.canvas.set_editable(True)
        self.hint.set_text(self.view.words("edit.hint_cuts" if isinstance(self.edited, CutOrder) else "edit.hint"))
        self._draw()

    def end(self) -> None:
        """Stop editing."""
        if self.edited is None:
            return
        self.edited = None
        self.view.edited = False
        self.place.set_visibility(False)
        self.canvas.set_editable(False)
        self.canvas.hide("live")

    def _close(self) -> None:
        self.discard()
        self.page.store_changed_choices()

    def remember_selected_stop(self, event: GenericEventArguments) -> None:
        """Remember the stop that the user has selected in the drawing."""
        self._stop = int((event.args or {}).get("stop") or 0)
        self._show_chosen_stop(self._stops())

    def _stops(self) -> list[OrderStop]:
        return [] if self.edited is None else self.edited.stops()

    def _choose_stop(self, stop: int) -> None:
        self._stop = stop
        self.canvas.select_stop(stop)
        self._show_chosen_stop(self._stops())

    def _show_chosen_stop(self, stops: list[OrderStop]) -> None:
        w = self.view.words
        self.keys.set_chosen(self._stop)
        index = next((k for k, stop in enumerate(stops) if stop.name == self._stop), None)
        if index is None:
            self.chosen.set_text("")
            return
        x, y = stops[index].place
        place = {"x": f"{x:.1f}", "y": f"{y:.1f}"}
        numbers = {"number": index + 1, "count": len(stops)}
        self.chosen.set_text(
            w("edit.chosen", **numbers, **place) if stops[index].held else w("edit.chosen_free", **place)
        )

    def drag(self, event: GenericEventArguments) -> None:
        """Respond to a drag in the drawing. Either move a stop in the order, or move the start of a cut."""
        args: dict[str, Any] = event.args
        number, onto = int(args["number"]), args.get("onto")
        if onto is not None and int(onto) != number:
            self._change_order(lambda e: e.move(number, int(onto)))
        elif onto is None:
            x, y = args["to"]
            self._change_order(lambda e: e.move_start(number, (float(x), float(y))))

    def _change_chosen_stop(self, act: Any) -> None:
        if self._stop:
            self._change_order(act)
        else:
            self.page.show_message(self.view.words("edit.choose"), True)

    def _change_order(self, act: Any) -> None:
        if self.edited is None:
            return
        try:
            act(self.edited)
        except LeafcutError as problem:
            self.page.show_message(str(problem), True)
            return
        self.page.show_message("")
        self._draw()

    def _undo_or_redo(self, *, back: bool) -> None:
        if self.edited is None:
            return
        w = self.view.words
        done = self.edited.undo() if back else self.edited.redo()
        self.page.show_message("" if done else w("edit.nothing"))
        self._draw()

    def _draw(self) -> None:
        if self.edited is None:
            return
        stops, w = self.edited.stops(), self.view.words
        self._store_edited_state()
        self.canvas.show(edited_scene(stops), "live")
        self._show_chosen_stop(stops)
        length, n_fixed = _fixed_order_length(stops), sum(stop.held for stop in stops)
        if n_fixed < len(stops):
            # The length of a partial order is not comparable with the initial length.
            self.length.set_text(w("edit.held", held=n_fixed, count=len(stops), length=format_length(length)))
            self.change.set_text("")
            self.change.classes(replace="figure quiet")
            return
        difference = length - self._before
        self.length.set_text(w("edit.length", length=format_length(length)))
        changed = abs(difference) > _SAME and self._before > 0.0
        sign = "+" if difference > 0 else "−"
        figures = (
            {
                "more": f"{sign}{format_length(abs(difference))}",
                "percent": f"{sign}{abs(100.0 * difference / self._before):.1f}",
            }
            if changed
            else {}
        )
        self.change.set_text(w("edit.change", **figures) if changed else w("edit.unchanged"))
        self.change.classes(replace=f"figure {'quiet' if not changed else 'longer' if difference > 0 else 'shorter'}")

    def _store_edited_state(self) -> None:
        self.view.edited = self.edited is not None and self.edited.changed
        if self.view.edited:
            self.close.props["data-sure"] = self.view.words("edit.sure")
        else:
            self.close.props.pop("data-sure", None)
        self.close.update()
        self.page.store_changed_choices()

    def run_edited_order(self) -> None:
        """Run the edited order. The result is measured and verified as usual."""
        view, edited = self.view, self.edited
        if edited is None:
            return
        # The edited order must not have the file name of the result's own plan or order.
        name = f"{Path(view.name.replace(':', '-')).stem}_edited.json"
        input_id = view.studio.folder.add_input(name, edited.file_text().encode())
        base, sheet = view.job, view.sheet
        plan = view.table.get("plan")
        view.table.set_value("plan", input_id, name, Setter.INPUT)
        self.page.input.draw()
        self.page.run.start()
        self._tried = TriedOrder(edited, base, sheet, view.job, plan)
        if view.job == base:
            self.undo_failed_run()

    def undo_failed_run(self) -> bool:
        """Undo a failed run with an edited order. Return whether a run had failed.

        Otherwise, the next run would fail as well.
        """
        view, tried, self._tried = self.view, self._tried, None
        if tried is None or tried.job != view.job:
            return False
        view.job, view.sheet = tried.base, tried.sheet
        if tried.plan is None:
            view.table.pop("plan", None)
        else:
            view.table["plan"] = tried.plan
        self.page.update_address()
        self.page.input.draw()
        self.page.run.draw()
        self._open(tried.edited)
        return True


def can_be_edited(history: History, record: JobRecord, files: dict[str, str]) -> bool:
    """Return whether users can edit the result of a job."""
    if record.task.options.get("chains"):
        return load_edited_order(history, record.id) is not None  # a result with chains cannot be edited
    return any(name in files for name in _EDITABLE)


def _fixed_order_length(stops: list[OrderStop]) -> float:
    """Return the length of the straight moves between consecutive stops whose order is fixed, mm."""
    return sum(
        math.dist(stop.place, next_stop.place) for stop, next_stop in pairwise(stops) if stop.held and next_stop.held
    )


class StopKeys:
    """Buttons that select the previous or the next stop, and move the selected stop in the order.

    `choose` receives the name of the selected stop.
    """

    def __init__(
        self,
        words: Words,
        stops: Callable[[], list[OrderStop]],
        choose: Callable[[int], Any],
        change: Callable[[Callable[[Edited], Any]], Any],
    ) -> None:
        self._words, self._stops, self._choose, self._change = words, stops, choose, change
        self._chosen = 0
        w = words
        with box("div", "stops", role="toolbar", aria_label=w("edit.stops"), data_roving=""):
            for position, (name, pattern, act) in enumerate(
                (
                    ("previous", "‹ {}", lambda: self._choose_neighbour(-1)),
                    ("next", "{} ›", lambda: self._choose_neighbour(1)),
                    ("earlier", "{}", lambda: self._move_by(-1)),
                    ("later", "{}", lambda: self._move_by(1)),
                )
            ):
                short = pattern.format(w(f"edit.{name}_short"))
                button(short, act, "small", aria_label=w(f"edit.{name}"), tabindex="-1" if position else "0")
        with box("form", "to-place") as form:
            text("label", w("edit.to_short"), "quiet", for_="edit-to")
            with box("span", "box"):
                label = w("edit.to")
                box("input", "", id="edit-to", type="text", inputmode="numeric", autocomplete="off", aria_label=label)
            button(w("edit.move"), None, "small").props("type=submit")
        form.on(
            "submit",
            lambda event: self._move_to_typed_number(str(event.args).strip()),
            js_handler="(e) => { e.preventDefault(); emit(e.target.querySelector('input').value); }",
        )

    def set_chosen(self, chosen: int) -> None:
        """Set the selected stop, or 0 if no stop is selected."""
        self._chosen = chosen

    def _chosen_index(self) -> int:
        return next((k for k, stop in enumerate(self._stops()) if stop.name == self._chosen), -1)

    def _choose_neighbour(self, step: int) -> None:
        stops, index = self._stops(), self._chosen_index()
        if stops:
            target = (0 if step > 0 else len(stops) - 1) if index < 0 else min(max(index + step, 0), len(stops) - 1)
            self._choose(stops[target].name)

    def _move_by(self, step: int) -> None:
        self._move_to(self._chosen_index() + step if self._chosen_index() >= 0 else -1)

    def _move_to_typed_number(self, number: str) -> None:
        count = len(self._stops())
        target = int(number) - 1 if number.isdecimal() and len(number) < 10 else -1
        self._move_to(target if 0 <= target < count else -1, self._words("edit.places", count=count))

    def _move_to(self, target: int, refusal: str = "") -> None:
        stops, index = self._stops(), self._chosen_index()
        if index < 0 or (refusal and target < 0):
            self._change(_refusing_change(refusal if index >= 0 else self._words("edit.choose")))
        elif 0 <= target < len(stops) and target != index:
            name, onto = stops[index].name, stops[target].name
            self._change(lambda edited: edited.move(name, onto))


def _refusing_change(line: str) -> Callable[[Edited], None]:
    def act(_: Edited) -> None:
        raise OptionError(line)

    return act
