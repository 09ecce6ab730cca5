"""The middle column of the page with the drawing and the progress of a run."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.events import GenericEventArguments

from leafcut.errors import OptionError
from leafcut.studio.drawing.canvas import LAYERS, SOLIDS, Canvas, Shown
from leafcut.studio.drawing.solid import translate_refusal
from leafcut.studio.jobs.history import JobRecord, JobState
from leafcut.studio.jobs.jobs import error_line
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_edit import EditPanel
from leafcut.studio.page.panel_live import LivePanel, watch_at_pace
from leafcut.studio.page.panel_reading import ReadingPanel
from leafcut.studio.page.panel_recent import RecentPanel

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Examples that an empty page suggests.
_TRIED = ("plate-27", "plate-70", "board-200")
_SHEET = (
    '<svg class="plate" viewBox="0 0 96 64" aria-hidden="true"><rect x="1.5" y="1.5" width="93" height="61" rx="7"/>'
    '<path d="M18 18 46 14 76 20 68 46 42 50 20 44"/><circle cx="18" cy="18" r="4.5"/><circle cx="46" cy="14" r="4.5"/>'
    '<circle cx="76" cy="20" r="4.5"/><circle cx="68" cy="46" r="4.5"/><circle cx="42" cy="50" r="4.5"/>'
    '<circle cx="20" cy="44" r="4.5"/></svg>'
)
#: Options that affect the position of a drawing.
PLACED_BY = ("origin", "mirror", "rotate", "units")
#: Layers that a search does not change.
_STILL = tuple(layer for layer in LAYERS if layer not in ("live", "pheromone"))


class RunPanel:
    """The column in which users start, watch and stop runs."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        w = view.words
        self.watching = False
        self._n_announced = 0
        with box("div", "frame") as self.frame:
            self.canvas = Canvas(
                words=w.section("canvas"),
                on_select=self._forward_selection,
                on_drag=self._forward_drag,
                on_origin=self._move_zero,
            )
            self.empty = box("div", "empty")
        with page.progress_place:
            self.reading = ReadingPanel(w, page.input.cancel_reading)
            self.live = LivePanel(view, page, self.canvas)
        self.edit = EditPanel(view, page, self.canvas)
        self._drawn: object = None
        #: Name and error message of an input that cannot be drawn.
        self._unseen: tuple[str, str] | None = None
        self.draw()

    def redraw_suggestions(self) -> None:
        """Redraw the suggestions on an empty page."""
        self._unseen = None
        self._show_why_empty()

    def _show_why_empty(self) -> None:
        view = self.view
        unseen = (view.name, view.seen.error) if view.source and view.seen is not None and view.seen.error else ("", "")
        if unseen == self._unseen:
            return
        self._unseen = unseen
        self.empty.clear()
        with self.empty:
            if not unseen[0]:
                self._draw_suggestions()
                return
            if view.seen is not None and view.seen.pixels is not None:
                self._draw_width_question(*view.seen.pixels)
                return
            with box("div", "inviting"):
                text("h2", view.words("empty.unseen", name=unseen[0]), "", dir="auto")
                text("p", view.words.translate_for_page(unseen[1]), "quiet")

    def _draw_width_question(self, width: int, height: int) -> None:
        w = self.view.words
        with box("div", "inviting"):
            text("h2", w("empty.how_wide"))
            text("p", w("empty.pixels", width=f"{width:,}", height=f"{height:,}"), "quiet")
            if self.view.seen is not None:
                text("p", w.translate_for_page(self.view.seen.error), "quiet small")
            with box("form", "to-place") as form:
                text("label", w("empty.width"), for_="picture-width")
                with box("span", "box"):
                    box("input", "", id="picture-width", type="text", inputmode="decimal", autocomplete="off")
                    text("span", "mm", "unit", aria_hidden="true")
                button(w("empty.use_width"), None, "primary").props("type=submit")
            form.on(
                "submit",
                lambda event: self.page.input.scale_picture(str(event.args)),
                js_handler="(e) => { e.preventDefault(); emit(e.target.querySelector('input').value); }",
            )

    def _draw_suggestions(self) -> None:
        w = self.view.words
        with box("div", "inviting"):
            ui.html(_SHEET, sanitize=False)
            text("h2", w("empty.title"))
            text("p", w("empty.drop"), "quiet")
            text("label", w("open.file"), "button primary", for_="open-file")
            with box("div", "try", role="group", aria_label=w("open.built_in")):
                text("span", w("empty.try"), "quiet")
                for name in _TRIED:
                    button(name, lambda name=name: self.page.input.open(f"example:{name}", name), "small")
                button(w("empty.random"), lambda: self.page.input.open("random:200:1", ""), "small")
        RecentPanel(self.view, self.page).draw_short()
        text("p", w("empty.text"), "quiet small")

    def _forward_selection(self, event: GenericEventArguments) -> None:
        self.edit.remember_selected_stop(event)
        if event.args and "layer" in event.args:
            self.page.input.layers.select_layer(str(event.args["layer"]))

    def _forward_drag(self, event: GenericEventArguments) -> None:
        self.edit.drag(event)

    def _move_zero(self, event: GenericEventArguments) -> Any:
        return self.page.input.move_zero(float(event.args["x"]), float(event.args["y"]))

    @property
    def running(self) -> bool:
        """Whether the visible job is still waiting or running."""
        return self.view.job is not None and self.view.job in self.view.studio.jobs.unfinished_ids()

    def start(self) -> None:
        """Start a run with the current choices."""
        view = self.view
        if self.running:
            return
        try:
            if view.invalid_values:
                raise OptionError(next(iter(view.invalid_values.values())))
            view.job = view.studio.jobs.start(view.build_task(), watch_at_pace(view.pace if view.is_study else "full"))
        except Exception as problem:
            self.page.show_message(error_line(problem), True)
            return
        self.page.show_message("")
        self.page.update_address()
        self.watch_job()
        self.page.result.draw()

    def watch_job(self) -> None:
        """Start to watch the page's job."""
        self.watching, self._n_announced = True, 0
        self.view.sheet = (1, 1)
        self.edit.discard()
        self.live.clear()
        self.draw()
        self.tick()

    def leave_job(self) -> None:
        """Stop showing a job. If it is running, it continues."""
        self.view.job, self.watching = None, False
        self.edit.discard()
        self.live.clear()

    def show_job_again(self) -> None:
        """Show the page's job again, with its progress or its result."""
        self.watching, self._n_announced = self.running, 0
        self.edit.end()
        self.live.clear()
        self.draw()

    def show_outdated_notice(self, line: str) -> None:
        """Show a notice that the drawing belongs to earlier choices. If the text is empty, remove the notice."""
        self.frame.props["data-earlier"] = line
        self.frame.update()

    def release_drawn(self) -> None:
        """Release the drawn objects."""
        self._drawn = None

    def tick(self) -> None:
        """Update the progress of the reading and the job. When the job ends, show its result."""
        self.reading.show(self.page.input.newest)
        if not self.watching or self.view.job is None:
            return
        live = self.view.studio.jobs.find_live_job(self.view.job)
        if live is not None and not live.state.is_over:
            self.page.input.show_ready(False)
            self.live.show(live)
            if live.said != self._n_announced:
                self._n_announced = live.said
                self.page.result.draw()
            return
        self.watching = False
        self.live.clear()
        record = self.view.studio.jobs.record(self.view.job)
        if record is not None:
            self._announce_end(record)
        if record is not None and record.state.has_result:
            self.draw()
            self.page.result.show_new_result(record)
        else:
            if not self.edit.undo_failed_run():
                self.draw()
            self.page.result.draw()
        self.page.input.show_ready(self.view.has_all_inputs)

    def _announce_end(self, record: JobRecord) -> None:
        w = self.view.words
        if record.state is JobState.FAILED:
            self.page.show_message(record.line, True)
        elif record.state is JobState.STOPPED:
            self.page.show_message(w("run.kept"))
        elif record.state is JobState.DONE:
            self.page.show_message("")
        else:
            self.page.show_message(w(f"state.{record.state.value}"))

    def draw(self) -> None:
        """Draw the result of the job. Without a job, draw the opened input."""
        now, scenes = self._scenes()
        seen = self.view.seen
        machine_travel = (
            seen.travel if seen is not None and self.view.work != "nest" else None
        )  # a nest has no machine yet
        travel = machine_travel.as_shown() if machine_travel is not None else None
        # Program zero can be dragged only in the opened drawing, not in a result.
        self.canvas.set_placement(travel, movable=now is seen and self.view.program_zero is not None)
        if scenes and (now is self._drawn or (isinstance(now, str) and now == self._drawn)):
            return
        self._drawn = now
        self.edit.end()
        self._show_why_empty()
        self.empty.set_visibility(not scenes)
        self.canvas.set_visibility(bool(scenes))
        for layer in _STILL:
            if layer in scenes:
                self.canvas.show(scenes[layer], layer)
            else:
                self.canvas.hide(layer)

    def _background_layer(self) -> dict[str, bytes]:
        """Return the layer that shows the entire drawing of the job's input.

        There is no such layer if the page has a different input, or if the drawing has been moved since the run.
        """
        view = self.view
        record = view.studio.jobs.record(view.job or "")
        if record is None or view.seen is None or record.task.inputs != (view.source,):
            return {}
        if any(record.task.options.get(name) != view.values.get(name) for name in PLACED_BY):
            return {}
        return {"whole": view.seen.scenes["whole"]} if "whole" in view.seen.scenes else {}

    def _scenes(self) -> tuple[object, dict[str, Shown]]:
        view = self.view
        history = view.studio.history
        names = history.artefacts(view.job) if view.job else {}
        if "scene-1-1" in names:
            variant, number = view.sheet
            name = f"scene-{variant}-{number}"
            sheet_scene = history.artefact(view.job or "", name if name in names else "scene-1-1")
            return f"{view.job}/{name}", {} if sheet_scene is None else {"part": sheet_scene.data}
        if "scene-after" in names:
            kept = {layer: history.artefact(view.job or "", f"scene-{layer}") for layer in _STILL}
            scenes: dict[str, Shown] = {
                layer: artefact.data for layer, artefact in kept.items() if artefact is not None
            }
            for layer in SOLIDS:
                if (artefact := kept[layer]) is not None:
                    scenes[layer] = translate_refusal(artefact.data, view.words.translate_for_page)
            background = self._background_layer()
            return f"{view.job}{'/whole' if background else ''}", scenes | background
        seen = view.seen
        if seen is None:
            return seen, {}
        return seen, {**seen.scenes, "solid_after": self._in_page_language(seen.stock)} if seen.stock else dict(
            seen.scenes
        )

    def _in_page_language(self, make: Callable[[], bytes]) -> Callable[[], bytes]:
        """Return a function that calls `make` for the scene of the stock.

        If the scene contains a refusal, it is translated.
        """
        return lambda: translate_refusal(make(), self.view.words.translate_for_page)
