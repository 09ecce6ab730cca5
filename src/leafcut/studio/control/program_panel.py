"""The program on the machine: users select, check, frame and run it, or step from hole to hole."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from leafcut.errors import LeafcutError
from leafcut.model.machine import XYZ
from leafcut.sender.job import SendJob, parse_accepted_codes
from leafcut.sender.jogging import bounding_box_of_cuts
from leafcut.sender.resuming import format_without_trailing_zeros
from leafcut.sender.run import Request
from leafcut.studio.control.fields import MachineForm, set_button_enabled
from leafcut.studio.control.line_words import explained_lines_of_hole
from leafcut.studio.control.link import ReadyProgram, RunOptions
from leafcut.studio.control.program import machines_to_send_to, program_from_file, program_from_job
from leafcut.studio.control.state import MachineState, MachineTask
from leafcut.studio.drawing.canvas import Canvas
from leafcut.studio.folder import OWN
from leafcut.studio.jobs.jobs import error_line
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_program import is_program
from leafcut.units import format_time

if TYPE_CHECKING:
    from nicegui.element import Element

    from leafcut.studio.control.panel import MachinePanel


_USUAL = "grbl-3018"
#: Ignores the second click of a double click on Start, which would otherwise confirm the dialog.
_ONE_CLICK = "(e) => { if (e.detail < 2) { e.target.closest('dialog').close(); emit(); } }"


class MachineProgramPanel:
    """The card with the running program, or with the next program to run."""

    def __init__(self, view: View, panel: MachinePanel, drawing: Element) -> None:
        self.view, self.panel, self.link = view, panel, panel.link
        self.job: SendJob | None = None
        #: Key of the loaded program. `problem` explains why the program cannot be sent.
        self._key: tuple[str, ...] = ()
        #: The program in the drawing. A running program comes first, even if another page has started it.
        self._drawn: SendJob | None = None
        self._box: tuple[XYZ, XYZ] | None = None
        self._tool: object = None
        self._next: tuple[float, float] | None = None
        self._asked: object = None
        self._ended: object = None
        #: The program that is waiting for confirmation, with its options.
        self._to_start: tuple[SendJob, RunOptions] | None = None
        self._asking = False
        w = view.words
        with drawing:
            self.canvas = Canvas(words=w.section("canvas"), layers={"issues": False})
            self.canvas.set_visibility(False)
            with box("div", "empty") as self.empty, box("div", "inviting"):
                self.empty_title = text("h2", w("machine.no_program"))
                self.empty_words = text("p", w("machine.no_program_hint"), "quiet")
        self._build_program_card()
        self._build_run_card()

    def _build_program_card(self) -> None:
        w = self.view.words
        with box("section", "card machine-card", aria_label=w("machine.program")) as self.choosing:
            text("h2", w("machine.program"))
            self.name = text("p", "", "name", dir="auto")
            self.machine = MachineForm(w)
            self.machine.add_field("machine", w("result.machine"), _USUAL, choices=[[_USUAL, _USUAL]])
            self.machine.on_change = self.load_open_program
            self.facts = text("p", "", "quiet small")
            self.problem = text("p", "", "error small", role="status")
            with box("ul", "warnings") as self.told:
                pass
            with box("div", "fields"):
                self.options = MachineForm(w)
                self.options.add_field("from-hole", w("flag.from_hole"), kind="whole")
                self.options.add_field("from-line", w("flag.from_line"), kind="whole")
                for name in ("by_hole", "alone"):
                    self.options.add_field(name, w(f"machine.{name}"), kind="flag")
                self.options.add_field("unhomed", w("flag.unhomed"), kind="flag")
                self.options.add_field("accept", w("flag.accept"))
            with box("div", "ends"):
                self.check = button(w("machine.check"), self._check_program, "")
                self.frame = button(w("machine.frame"), self._trace_frame, "")
            self.start = button(w("machine.start"), self._ask_to_start, "primary wide")
        self._build_confirm_dialog()

    def _build_confirm_dialog(self) -> None:
        w = self.view.words
        with box("dialog", "confirm", id="machine-confirm", aria_labelledby="machine-confirm-name") as self.confirm:
            self.confirm_name = text("h2", "", id="machine-confirm-name", dir="auto")
            self.confirm_facts = box("dl", "facts")
            self.confirm_issues = box("ul", "warnings")
            text("p", w("machine.confirm_hint"), "quiet small")
            with box("div", "ends"):
                button(w("run.cancel"), None, "", data_close="", autofocus="")
                go = button(w("machine.confirm_start"), None, "primary", id="machine-confirm-start")
        go.on("click", self._start_program, js_handler=_ONE_CLICK)

    def _build_run_card(self) -> None:
        w = self.view.words
        with box("section", "card machine-card", aria_label=w("machine.run")) as self.running:
            self.what = text("h2", "")
            self.bar = box("progress", "", max="1000", aria_label=w("machine.run"))
            with box("dl", "facts"):
                self.figures = {}
                for key in ("hole", "line", "done", "left", "ends", "feed"):
                    text("dt", w(f"machine.{key}_now"))
                    self.figures[key] = text("dd", "", id=f"machine-now-{key}")
            with box("div", "ends feeds", role="group", aria_label=w("machine.override")):
                for words, request in (("−10 %", Request.SLOWER), ("100 %", Request.NORMAL), ("+10 %", Request.FASTER)):
                    button(
                        words, lambda request=request: self.panel.send_request(self.link.send_request, request), "small"
                    )
            with box("div", "question") as self.question:
                pass
            with box("div", "ends holds"):
                self.hold = button(
                    w("machine.hold"), lambda: self.panel.send_request(self.link.send_request, Request.HOLD), "large"
                )
                self.resume = button(
                    w("machine.resume"),
                    lambda: self.panel.send_request(self.link.send_request, Request.RESUME),
                    "large primary",
                )

    # Selection of the program.

    def _open_job_and_source(self) -> tuple[str, str]:
        view = self.view
        record = view.studio.jobs.record(view.job) if view.job else None
        if record is not None and view.studio.history.artefact(record.id, "program") is not None:
            return record.id, ""
        return "", view.source if is_program(view) else ""

    def has_changed(self) -> bool:
        """Return whether the open program or the selected machine has changed since the program was loaded."""
        return (*self._open_job_and_source(), self.machine.text("machine")) != self._key[:3]

    async def load_open_program(self) -> None:
        """Load the open program for the selected machine."""
        view, w = self.view, self.view.words
        job, source = self._open_job_and_source()
        self._offer_machines(job)
        key = (job, source, self.machine.text("machine"), self.options.text("accept"))
        if key == self._key:
            return
        self._key = key
        job_read, problem = None, ""
        if job or source:
            try:
                job_read = await asyncio.to_thread(self._read_program, *key)
            except LeafcutError as refusal:
                problem = view.studio.folder.hide_paths(str(refusal))
            except Exception as fault:
                problem = error_line(fault)
        if key != self._key:
            return
        self.job = job_read
        self.name.set_text(job_read.file if job_read else view.name if source else w("machine.none"))
        self.problem.set_text(w.translate_for_page(problem))
        self.empty_title.set_text(w("empty.unseen", name=self.view.name) if problem else w("machine.no_program"))
        self.empty_words.set_text("" if problem else w("machine.no_program_hint"))
        self.facts.set_text(_program_facts(job_read, w) if job_read else "")
        self.told.clear()
        self._show_drawing()
        self._show_fields(self.link.state)
        self.panel.tick_now()

    def _offer_machines(self, job: str) -> None:
        view = self.view
        machines = machines_to_send_to(view.studio.folder)
        names = {
            word: view.words("machines.own", name=word.removeprefix(OWN)) if word.startswith(OWN) else word
            for word in machines
        }
        value = self.machine.text("machine")
        record = view.studio.jobs.record(job) if job else None
        if record is not None and self._key[:1] != (job,):
            used = str(record.task.options.get("machine") or "")
            value = used if used in names else value
        self.machine.add_field("machine", view.words("result.machine"), choices=[list(pair) for pair in names.items()])
        self.machine.set_value("machine", value if value in names else _USUAL)

    def _read_program(self, job: str, source: str, machine: str, accept: str) -> SendJob:
        studio = self.view.studio
        codes = parse_accepted_codes(accept)
        if job:
            job_read = program_from_job(studio.history, studio.folder, job, machine, codes)
        else:
            units = self.view.values.get("units")
            job_read = program_from_file(
                studio.folder, source, machine, units if units in ("mm", "in") else None, codes
            )
        _ = job_read.seconds_by_line, job_read.holes  # computed now, because it is slow for a large program
        return job_read

    def _show_drawing(self) -> None:
        from leafcut.studio.drawing.scene import toolpath_scene

        job = self.link.job or self.job
        if job is self._drawn or (job is not None and self._drawn is not None and job.program is self._drawn.program):
            return
        self._drawn = job
        self._box = None if job is None else bounding_box_of_cuts(job)
        self.empty.set_visibility(job is None)
        self.canvas.set_visibility(job is not None)
        if job is None:
            self.canvas.clear()
            return
        text_of = "\n".join(job.program.lines)
        self.canvas.show(
            lambda: toolpath_scene(job.program.path, job.machine, name=job.file, text=text_of, beam=job.is_laser),
            "after",
        )
        self.canvas.fit()
        self._tool = None

    # Requests.

    def _run_options(self) -> RunOptions:
        holes = bool(self.job and self.job.holes)
        return RunOptions(
            from_hole=self.options.whole_number("from-hole") if holes else None,
            from_line=None if holes else self.options.whole_number("from-line"),
            by_hole=self.options.is_on("by_hole") and holes,
            unhomed=self.options.is_on("unhomed"),
            alone=self.options.is_on("alone"),
        )

    async def _ask_with_program(self, action: Callable[[str, SendJob], Any]) -> Any:
        await self.load_open_program()
        job = self.job
        if job is None:
            self.panel.show_message(self.problem.text or self.view.words("machine.no_program"), bad=True)
            return None
        return await self.panel.send_request(lambda key: action(key, job))

    async def _check_program(self) -> None:
        program = await self._ask_with_program(lambda key, job: self.link.check_program(key, job, self._run_options()))
        if program is not None:
            self._show_issues(self.told, program.told)
            self.panel.show_message(self.view.words("machine.checked"))

    async def _trace_frame(self) -> None:
        await self._ask_with_program(
            lambda key, job: self.link.trace_frame(key, job, self._run_options(), self.panel.jog_feed())
        )

    async def _ask_to_start(self) -> None:
        if self._asking:
            return
        self._asking = True
        try:
            wishes = self._run_options()
            program = await self._ask_with_program(lambda key, job: self.link.check_program(key, job, wishes))
        except LeafcutError as problem:
            self.panel.show_message(str(problem), bad=True)
            return
        finally:
            self._asking = False
        if program is None or self.job is None:
            return
        self._to_start = (self.job, wishes)
        self._open_confirm_dialog(program)
        self.confirm.run_method("showModal")

    def _open_confirm_dialog(self, ready: ReadyProgram) -> None:
        w, job = self.view.words, ready.job
        self.confirm_name.set_text(w("machine.confirm_title", name=job.file))
        facts = {}
        if ready.box is not None:
            (x0, y0, z0), (x1, y1, z1) = ready.box
            facts["box"] = w(
                "machine.confirm_xy",
                x0=_rounded_millimetres_text(x0),
                x1=_rounded_millimetres_text(x1),
                y0=_rounded_millimetres_text(y0),
                y1=_rounded_millimetres_text(y1),
            )
            facts["z"] = w(
                "machine.confirm_range", low=_rounded_millimetres_text(z0), high=_rounded_millimetres_text(z1)
            )
        if not job.is_laser:
            facts["tool"] = " → ".join(name or w("machine.confirm_no_tool") for name in ready.tools)
        if ready.line:
            facts["from"] = f"{ready.line}: {job.line_text(ready.line)}"
        self.confirm_facts.clear()
        with self.confirm_facts:
            for key, words in facts.items():
                text("dt", w(f"machine.confirm_{key}"))
                text("dd", words, id=f"machine-confirm-{key}", dir="auto")
        self._show_issues(self.confirm_issues, ready.told)

    async def _start_program(self) -> None:
        if self._to_start is None:
            return
        (job, wishes), self._to_start = self._to_start, None
        program = await self.panel.send_request(lambda key: self.link.run_program(key, job, wishes))
        if program is not None:
            self._show_issues(self.told, program.told)
            self.panel.show_message("")

    def _show_issues(self, place: Element, lines: Sequence[str]) -> None:
        place.clear()
        with place:
            for line in lines:
                text("li", self.view.words.translate_for_page(line), dir="auto")

    # Display.

    def show(self, state: MachineState, commands: bool) -> None:
        """Enable the actions that are currently possible, and show the progress of the program."""
        runs = state.progress is not None
        self.choosing.set_visibility(not runs)
        self.running.set_visibility(runs)
        ready = commands and self.job is not None and state.doing in (MachineTask.NOTHING, MachineTask.ASKING)
        ready = ready and state.status == "Idle"
        for action in (self.check, self.frame, self.start):
            set_button_enabled(action, ready)
        self._show_fields(state)
        self._show_drawing()
        self._show_progress(state, commands)
        self._show_question(state, commands)
        self._show_tool_position(state)
        if state.ended != self._ended:
            self._ended = state.ended
            if state.ended is not None:
                goes_on = not state.ended.complete
                hole, line = (state.ended.go_on_hole, state.ended.line) if goes_on else (0, 0)
                self.options.set_value("from-hole", str(hole) if hole else "")
                self.options.set_value("from-line", str(line) if line and not hole else "")

    def _show_fields(self, state: MachineState) -> None:
        holes = bool(self.job and self.job.holes)
        hidden = ["from-line"] if holes else ["from-hole", "by_hole"]
        if self.job is None:
            hidden = ["from-line", "from-hole", "by_hole"]
        self.options.hide_only(*hidden, *([] if state.is_connected and not state.homing else ["unhomed"]))

    def _show_progress(self, state: MachineState, commands: bool) -> None:
        progress = state.progress
        if progress is None:
            return
        on_hold = state.status in ("Hold", "Door")
        total_s = progress.done_s + progress.left_s
        self.what.set_text(progress.name)
        share = str(round(1000.0 * progress.done_s / total_s)) if total_s > 0.0 else "0"
        if self.bar.props.get("value") != share:
            self.bar.props["value"] = share
            self.bar.update()
        ends = time.strftime("%H:%M:%S", time.localtime(time.time() + progress.left_s))
        asked = state.question is not None
        texts = {
            "hole": f"{progress.hole} / {progress.holes}" if progress.holes else "–",
            "line": f"{progress.line} / {progress.lines}",
            "done": format_time(progress.done_s),
            "left": format_time(progress.left_s),
            "ends": "–" if on_hold or asked else ends,
            "feed": f"{progress.feed:.0f} mm/min · {progress.override} %",
        }
        for key, words in texts.items():
            if self.figures[key].text != words:
                self.figures[key].set_text(words)
        self.hold.set_visibility(not on_hold and not asked)
        self.resume.set_visibility(on_hold and not asked)
        set_button_enabled(self.hold, commands)
        set_button_enabled(self.resume, commands)

    def _show_question(self, state: MachineState, commands: bool) -> None:
        asked = state.question
        if (asked, commands) == self._asked:
            return
        self._asked = (asked, commands)
        w = self.view.words
        self.question.clear()
        self.question.set_visibility(asked is not None)
        self._next = None
        if asked is None:
            self.canvas.clear_selection()
            return
        with self.question:
            if asked.kind == "hole":
                self._show_next_hole(asked.hole)
            else:
                text("p", w.translate_for_page(asked.words), "large")
                text("p", w("machine.at_pause"), "quiet small")
            for line in asked.replies:
                text("p", w.translate_for_page(line), "quiet small")
            with box("div", "ends"):
                words = w("machine.drill", hole=asked.hole) if asked.kind == "hole" else w("machine.go_on")
                go = button(
                    words,
                    lambda: self.panel.send_request(self.link.answer_question, ""),
                    "primary large",
                    id="machine-go",
                )
                set_button_enabled(go, commands)
                if asked.kind == "hole":
                    to_end = button(
                        w("machine.to_end"), lambda: self.panel.send_request(self.link.answer_question, "all"), ""
                    )
                    set_button_enabled(to_end, commands)

    def _show_next_hole(self, number: int) -> None:
        w = self.view.words
        job = self._drawn
        text("h3", w("machine.next_hole", hole=number))
        if job is None or number > len(job.holes):
            return
        hole = job.holes[number - 1]
        with box("ol", "explained"):
            for line, code, words in explained_lines_of_hole(job, hole, w):
                with box("li"):
                    text("span", str(line), "quiet n")
                    text("code", code)
                    text("span", words)
        self._next = (hole.x, hole.y)
        self.canvas.show_line(hole.last)

    def _show_tool_position(self, state: MachineState) -> None:
        place = state.work if state.is_connected else None
        cuts = state.progress is not None and place is not None and place[2] < 0.0
        at = None if place is None or self._drawn is None else (round(place[0], 3), round(place[1], 3))
        if (at, cuts, self._next) != self._tool:
            self._tool = (at, cuts, self._next)
            self.canvas.set_tool(at, cuts=cuts, going_to=self._next)
        self.canvas.set_placement(self._travel_in_program(state), movable=False)

    def _travel_in_program(self, state: MachineState) -> dict[str, Any] | None:
        if state.travel is None or state.machine is None or state.work is None or not state.homing:
            return None
        zero = [round(a - b, 3) for a, b in zip(state.machine, state.work, strict=True)]
        low, high = state.travel
        travel_box = [low[0] - zero[0], low[1] - zero[1], high[0] - zero[0], high[1] - zero[1]]
        if not all(math.isfinite(v) for v in travel_box):
            return None
        name = self._drawn.machine.name if self._drawn else ""
        extents = self._box
        fits = extents is None or all(
            travel_box[k] <= extents[0][k] + 0.005 and extents[1][k] - 0.005 <= travel_box[k + 2] for k in range(2)
        )
        return {"box": travel_box, "known": True, "fits": fits, "machine": name}


def _rounded_millimetres_text(value: float) -> str:
    return format_without_trailing_zeros(round(value, 3))


def _program_facts(job: SendJob, w: Any) -> str:
    feed_s, other_s = job.seconds_by_line
    parts = [format_time(float(feed_s.sum() + other_s.sum())), w("machine.lines", number=job.steps[-1].number)]
    if job.holes:
        parts.append(w("machine.holes", number=len(job.holes)))
    return " · ".join(parts)
