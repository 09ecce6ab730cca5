"""The middle: the drawing, and while something runs how far it is, with the ways to end it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from leafcut.errors import OptionError
from leafcut.option_spec import flag_name
from leafcut.studio.canvas import LAYERS, Canvas, Convergence
from leafcut.studio.elements import box, button, text
from leafcut.studio.history import State
from leafcut.studio.jobs import line_of
from leafcut.studio.view import View
from leafcut.units import format_time

if TYPE_CHECKING:
    from leafcut.studio.pages import Page

#: Most points of the convergence that are sent at once.
_MOST_POINTS = 300


class RunPanel:
    """Begins, watches and ends runs."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        w = view.words
        self.watching = False
        self._shown: tuple[object, ...] = ()
        with box("div", "frame"):
            self.canvas = Canvas(words=w.section("canvas"))
            with box("div", "empty") as self.empty:
                text("h2", w("empty.title"))
                text("p", w("empty.text"), "quiet")
        with box("div", "progress", aria_label=w("run.progress")) as self.progress:
            with box("div", "line"):
                self.what = text("span", "", "what")
                self.cost = text("b", "", "figure")
                self.gap = text("span", "", "quiet figure")
                self.time = text("span", "", "quiet figure")
            self.chart = Convergence(words=w.section("canvas"))
            self.chart.classes("chart")
            self.track = box("progress", "", max="1", value="0", aria_label=w("run.progress"))
            with box("div", "ends"):
                button(w("run.stop"), self.stop, "", data_key="s")
                button(w("run.cancel"), self.cancel, "plain", data_key="esc")
        self._drawn: object = None
        self.progress.set_visibility(False)
        self.draw()

    def begin(self) -> None:
        """Begin the run that is asked for."""
        view = self.view
        if view.job is not None and view.job in view.studio.jobs.running():
            return
        try:
            if view.errors:
                name, line = next(iter(view.errors.items()))
                raise OptionError(f"{flag_name(name)}: {line}")
            view.job = view.studio.jobs.start(view.task())
        except Exception as problem:
            self.page.say(line_of(problem), True)
            return
        self.page.say("")
        self.page.remember()
        self.watch()

    def watch(self) -> None:
        """Show how the job goes on, from now on."""
        self.watching, self._shown = True, ()
        self.tick()

    def stop(self) -> None:
        """Stop and keep the best."""
        if self.view.job is not None:
            self.view.studio.jobs.stop(self.view.job)
            self.page.say(self.view.words("run.stopping"))

    def cancel(self) -> None:
        """Stop and keep nothing."""
        if self.view.job is not None:
            self.view.studio.jobs.cancel(self.view.job)

    def tick(self) -> None:
        """Show what is new; when the job is over, its outcome."""
        if not self.watching or self.view.job is None:
            return
        live = self.view.studio.jobs.live(self.view.job)
        if live is not None and not live.state.over:
            now = (live.state, live.latest)
            if now != self._shown:
                self._shown = now
                self._show()
            return
        self.watching = False
        self.progress.set_visibility(False)
        self._tell_end()
        self.draw()
        self.page.result.draw()
        self.page.input.ready(True)

    def _show(self) -> None:
        live = self.view.studio.jobs.live(self.view.job or "")
        if live is None:
            return
        w, latest = self.view.words, live.latest
        self.progress.set_visibility(True)
        self.page.input.ready(False)
        self.what.set_text(latest.what or w("run.waiting" if live.state is State.WAITING else "run.reading"))
        self.cost.set_text("" if latest.cost is None else f"{latest.cost:,.2f}")
        self.gap.set_text("" if latest.gap is None else w("run.gap", percent=f"{100 * latest.gap:.2f}"))
        self.time.set_text(format_time(latest.seconds) if latest.seconds >= 1 else "")
        self.track.props(f"value={latest.share:.4f}")
        points = [(seconds, cost) for seconds, cost, what in live.points if what == latest.what]
        self.chart.set_visibility(len(points) > 1)
        if len(points) > 1:
            began = points[0][0]
            bound = None if latest.gap is None or latest.cost is None else latest.cost / (1.0 + latest.gap)
            shown = [(seconds - began, cost) for seconds, cost in points[:: len(points) // _MOST_POINTS + 1]]
            self.chart.set([*shown, (points[-1][0] - began, points[-1][1])], bound, "", latest.seconds - began)

    def _tell_end(self) -> None:
        record = self.view.studio.jobs.record(self.view.job or "")
        w = self.view.words
        if record is None:
            return
        if record.state is State.FAILED:
            self.page.say(record.line, True)
        elif record.state is State.STOPPED:
            self.page.say(w("run.kept"))
        elif record.state is State.DONE:
            self.page.say("")
        else:
            self.page.say(w(f"state.{record.state.value}"))

    def draw(self) -> None:
        """Draw the outcome of the job, else what was opened."""
        view = self.view
        scenes = self._scenes()
        now = view.job if view.job and scenes else view.seen
        if now is self._drawn and scenes:
            return
        self._drawn = now
        self.empty.set_visibility(not scenes)
        self.canvas.set_visibility(bool(scenes))
        for layer in LAYERS:
            if layer in scenes:
                self.canvas.show(scenes[layer], layer)
            else:
                self.canvas.hide(layer)

    def _scenes(self) -> dict[str, bytes]:
        view = self.view
        history = view.studio.history
        names = history.artefacts(view.job) if view.job else {}
        if "scene-after" in names:
            kept = {layer: history.artefact(view.job or "", f"scene-{layer}") for layer in LAYERS}
            return {layer: found.data for layer, found in kept.items() if found is not None}
        return view.seen.scenes if view.seen is not None else {}
