"""Shows the progress of a run (cost over time, gap, workers, fireflies). Users can pause, stop or go step by step."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

from nicegui import ui

from leafcut.model.snapshot import Snapshot
from leafcut.studio.drawing.canvas import Canvas
from leafcut.studio.drawing.scene import path_scene, pheromone_scene
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.jobs import LiveJob
from leafcut.studio.jobs.search_watch import Watch
from leafcut.studio.page.charts import (
    Chart,
    SwitchedChart,
    bar_chart,
    brightness_chart,
    convergence_chart,
    learning_chart,
)
from leafcut.studio.page.elements import Form, box, button, text
from leafcut.studio.page.forms import plain_field, plain_group
from leafcut.studio.page.lesson import explain_step
from leafcut.studio.page.page_state import View
from leafcut.studio.wording import Words
from leafcut.units import format_time

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Maximum number of points in the convergence chart, and maximum number of workers on the page.
_MAX_POINTS, _MAX_WORKERS = 300, 8
#: Speeds of a search: no limit, steps per second, or step by step.
PACES = {"full": None, "20": 20.0, "5": 5.0, "1": 1.0, "step": None}

#: Minimum interval between explanations of a search that is not paused, s. It gives users enough time to read them.
_EVERY = 1.0


def watch_at_pace(pace: str) -> Watch:
    """Create a watch with one of the `PACES`."""
    return Watch(PACES[pace], paused=pace == "step")


def watch_pace(watch: Watch) -> str:
    """Return the current speed of a search as a key of `PACES`."""
    speeds = [pace for pace, speed in PACES.items() if speed is not None and speed == watch.speed]
    return speeds[0] if speeds else "step" if watch.paused else "full"


class LivePanel:
    """Shows a running job inside and below the drawing."""

    def __init__(self, view: View, page: Page, canvas: Canvas) -> None:
        self.view, self.page, self.canvas = view, page, canvas
        w = view.words
        self._number = 0
        #: Lowest brightness of any firefly so far. The bars start at this value.
        self._floor: float | None = None
        self._shown_figures: tuple[object, ...] = ()
        with box("div", "progress", aria_label=w("run.progress")) as self.place:
            with box("div", "line"):
                self.what = text("span", "", "what")
                self.cost = text("b", "", "figure")
                self.gap = text("span", "", "quiet figure gap")
                self.time = text("span", "", "quiet figure")
            with box("div", "charts"):
                self.chart = Chart()
                self.learning = SwitchedChart(w.section("chart"), "chart learned")
                with box("div", "swarm", aria_label=w("run.brightness")) as self.swarm:
                    text("h3", w("run.brightness"))
                    self.brightness = Chart("flies")
                with box("div", "workers", aria_label=w("result.workers")) as self.crew:
                    text("h3", w("result.workers"))
                    self.workers = box("div")
            self.track = box("progress", "", max="1", value="0", aria_label=w("run.progress"))
            with box("div", "ends", data_focus_after=".left [data-key~=r]"):
                button(w("run.stop"), self._stop_job, "", data_key="s esc")
                button(w("run.cancel"), self._cancel_job, "plain", data_sure=w("run.sure"))
                with box("div", "study", role="group", aria_label=w("run.study")) as self.study:
                    self.iteration = text("span", "", "quiet figure")
                    self.hold = button(w("run.pause"), self._toggle_pause, "", data_key="p")
                    button(w("run.step"), self._make_step, "", data_key="n")
                    self.pace = Form(w, self._set_pace, [pace_field(view)])
            self.lesson = LessonPanel(w)
        self.clear()

    def clear(self) -> None:
        """Hide the display."""
        self.place.set_visibility(False)
        for part in (self.chart.place, self.learning.place, self.swarm, self.crew, self.study):
            part.set_visibility(False)
        self.lesson.clear()
        self.canvas.hide("live")
        self.canvas.hide("pheromone")
        self._number, self._floor, self._shown_figures = 0, None, ()

    def show(self, live: LiveJob) -> None:
        """Update the display for an unfinished job."""
        number, snapshot = live.watch.poll()
        seconds = time.perf_counter() - live.began if live.began else 0.0
        now = (live.state, live.latest, live.latest_s, int(seconds))
        figures = (*now, watch_pace(live.watch), live.watch.paused, live.watch.can_pause)
        if figures != self._shown_figures:
            self._shown_figures = figures
            self._show_figures(live, seconds)
        if snapshot is not None and number != self._number:
            self._number = number
            self._draw_snapshot(snapshot)
        self.lesson.show(snapshot, live.watch.paused)

    def _show_figures(self, live: LiveJob, seconds: float) -> None:
        w, latest = self.view.words, live.latest
        self.place.set_visibility(True)
        self.what.set_text(
            w.translate(latest.step) or w("run.waiting" if live.state is JobState.WAITING else "run.reading")
        )
        unit = live.call.objective_unit
        self.cost.set_text("" if latest.cost is None else f"{latest.cost:,.2f} {unit}".strip())
        self.gap.set_text("" if latest.gap is None else w("run.gap", percent=f"{100 * latest.gap:.2f}"))
        self.time.set_text(format_time(seconds) if seconds >= 1 else "")
        self.track.props(f"value={latest.share:.4f}")
        self.study.set_visibility(live.watch.can_pause)
        self.pace.show({"pace": watch_pace(live.watch)})
        self.hold.set_text(w("run.go_on" if live.watch.paused else "run.pause"))
        bound = None if latest.gap is None or latest.cost is None else latest.cost / (1.0 + latest.gap)
        picture = live.watch.picture  # the job's thread replaces the watch at the end
        rows = picture.iterations if picture is not None else []
        words = w.section("chart")
        self.learning.place.set_visibility(bool(rows))
        if rows:
            self.chart.place.set_visibility(False)
            self.learning.show(lambda by: learning_chart(rows, bound, unit, words, by))
            return
        points = [(seconds, cost) for seconds, cost, step in live.points if step == latest.step]
        self.chart.place.set_visibility(bool(points))
        if points:
            start_s = points[0][0]
            shown = [(seconds - start_s, cost) for seconds, cost in points[:: len(points) // _MAX_POINTS + 1]]
            shown.append((points[-1][0] - start_s, points[-1][1]))
            self.chart.show(*convergence_chart(shown, bound, unit, words, live.latest_s - start_s))

    def _draw_snapshot(self, snapshot: Snapshot) -> None:
        if len(snapshot.path):
            self.canvas.show(path_scene(snapshot.path), "live")
        pheromone = snapshot.pheromone
        if pheromone is None:
            self.canvas.hide("pheromone")
        else:
            self.canvas.show(pheromone_scene(pheromone.points, pheromone.edges, pheromone.strength), "pheromone")
        w = self.view.words
        self.iteration.set_text(w("run.iteration", number=f"{snapshot.iteration:,}"))
        self._show_workers(snapshot)
        values = snapshot.brightness
        self.swarm.set_visibility(values is not None)
        if values is not None and len(values):
            darkest = float(values.min())
            self._floor = darkest if self._floor is None else min(self._floor, darkest)
            spread = max(float(values.max()) - self._floor, 1e-300)
            shown = ((values - self._floor) / spread * 0.95 + 0.05).tolist()
            self.brightness.show(*brightness_chart(shown, w.section("chart")))

    def _show_workers(self, snapshot: Snapshot) -> None:
        w = self.view.words
        workers = [worker for worker in snapshot.workers if worker.ants][:_MAX_WORKERS]
        self.crew.set_visibility(len(workers) > 1)
        if len(workers) > 1:
            best = min(worker.best for worker in workers)
            rows = (
                (f"{w('canvas.worker')} {o.worker}", o.seconds, w("run.ants", number=f"{o.ants:,}"), o.best <= best)
                for o in workers
            )
            bar_chart(self.workers, rows)

    def _live_job(self) -> LiveJob | None:
        return self.view.studio.jobs.find_live_job(self.view.job or "")

    def _stop_job(self) -> None:
        if self.view.job is not None:
            self.view.studio.jobs.stop(self.view.job)
            self.page.show_message(self.view.words("run.stopping"), stays=True)

    def _cancel_job(self) -> None:
        live = self._live_job()
        if live is not None and not live.state.is_over:
            self.view.studio.jobs.cancel(live.id)
            self.page.show_message(self.view.words("run.cancelling"), stays=True)

    def _toggle_pause(self) -> None:
        live = self._live_job()
        if live is not None:
            live.watch.pause(not live.watch.paused)

    def _make_step(self) -> None:
        live = self._live_job()
        if live is not None:
            live.watch.step()

    def _set_pace(self, _: str, value: str, __: str) -> None:
        self.view.pace = value
        live = self._live_job()
        if live is not None and not live.state.is_over:
            live.watch.go(PACES[value])
            live.watch.pause(value == "step")
        self.page.input.draw_pace()


def pace_field(view: View) -> dict[str, object]:
    """Return a form group with a field for the speed of a search."""
    w = view.words
    return plain_group(plain_field("pace", w("run.pace"), choices=[[pace, w(f"pace.{pace}")] for pace in PACES]))


class LessonPanel:
    """The card that explains the latest step of a search."""

    def __init__(self, words: Words) -> None:
        self.words = words
        self._shown: tuple[Snapshot | None, float] = (None, -math.inf)
        with box("section", "lesson", aria_label=words("lesson.title")) as self.place:
            self.title = text("h3", words("lesson.title"))
            self.content = ui.html("", sanitize=False)

    def clear(self) -> None:
        """Hide the explanation."""
        self._shown = (None, -math.inf)
        self.place.set_visibility(False)

    def show(self, snapshot: Snapshot | None, paused: bool) -> None:
        """Explain the current step of a search.

        While the search is not paused, explain at most one step every `_EVERY` seconds.
        """
        seen, shown_at = self._shown
        now = time.monotonic()
        if snapshot is None or snapshot.step is None or snapshot is seen or (now < shown_at + _EVERY and not paused):
            return
        self._shown = (snapshot, now)
        self.place.set_visibility(True)
        self.title.set_text(self.words("lesson.step", number=f"{snapshot.iteration:,}"))
        self.content.set_content(explain_step(snapshot.step, self.words))
