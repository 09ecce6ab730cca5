"""The left column of the page with the input, the kind of work, and the options."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Awaitable, Callable
from copy import copy
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import run, ui
from nicegui.element import Element

from leafcut.errors import LeafcutError
from leafcut.options.removed import removal_message
from leafcut.studio.folder import BUILT_IN, LARGEST_UPLOAD
from leafcut.studio.jobs.jobs import error_line
from leafcut.studio.jobs.preview import Preview
from leafcut.studio.jobs.sheets import SheetOfNest, upload_sheet
from leafcut.studio.jobs.task import Task, nested_parts, source_display_name
from leafcut.studio.page import forms
from leafcut.studio.page.elements import Form, Opener, box, button, link, text
from leafcut.studio.page.form_values import Setter
from leafcut.studio.page.forms import plain_field, plain_group
from leafcut.studio.page.page_state import OF_READING, View
from leafcut.studio.page.panel_layers import LayersPanel
from leafcut.studio.page.panel_live import pace_field
from leafcut.studio.page.panel_parts import PartsPanel
from leafcut.studio.page.panel_reading import PreviewReading
from leafcut.studio.page.panel_recent import RecentPanel
from leafcut.studio.wording import Words
from leafcut.units import parse_quantity

if TYPE_CHECKING:
    from leafcut.studio.page.pages import Page

#: Maximum number of issues that the page lists before a run.
_MAX_ISSUES = 30
#: Time after which the process of an obsolete reading is killed, s.
_GRACE_SECONDS = 1.0


class InputPanel:
    """The column in which users open and preview inputs and set options."""

    def __init__(self, view: View, page: Page) -> None:
        self.view, self.page = view, page
        #: Number of the current reading. The results of older readings are discarded.
        self._turn = 0
        self.newest: PreviewReading | None = None
        #: Whether an input is being read or is waiting to be read.
        self.reading = False
        #: Whether the user has pressed Run during the reading. The run starts when the reading is complete.
        self._run_wanted = False
        w = view.words
        with box("div", "scrolls"):
            with box("section", "part", aria_label=w("open.title")):
                self._draw_opener()
                self.parts = PartsPanel(view, page)
                self.about = box("div", "about-part")
            self.second = box("div", "second")
            with box("section", "choose", aria_label=w("choose.title")):
                self.works = WorkChoice(w("choose.work"), lambda work: self._choose_work_or_process("work", work, ""))
                self.work = Form(w, self._choose_work_or_process)
                self.layers = LayersPanel(view, page)
                self.options = Form(w, self.set_option, on_refused=self._show_refusal, searchable=True)
                self.kept = Form(w, self._load_options_file, [self._options_field()], self._show_refusal)
                self.pace = Form(w, self._set_pace, [pace_field(view)])
                self.without_local_search = text("p", w("choose.no_local_search"), "hint", role="note")
        with box("footer", "foot"):
            with box("div", "command"):
                self.command = box("code", "", id="command", tabindex="0", aria_label=w("command.title"))
                self.copy = button(
                    w("command.copy"), None, "plain small", data_copy="command", data_said=w("command.copied")
                )
            self.begin = button(w("run.begin"), self.request_run, "primary wide", data_key="r")
        self.draw()

    def _draw_opener(self) -> None:
        w = self.view.words
        mib = LARGEST_UPLOAD >> 20
        self.opener = Opener(
            {
                "open": w("open.file"),
                "add": w("open.add"),
                "busy": w("open.busy"),
                "drop": w("open.drop"),
                "release": w("open.release"),
                "large": w("open.large", mib=mib),
            },
            LARGEST_UPLOAD,
            self._opened,
            self._show_refusal,
        )
        with box("details", "built-in") as self.built_in:
            text("summary", w("open.built_in"))
            self.example = Form(w, self._open_example)
            self.random = {"points": "200", "seed": "1"}
            with box("div", "random"):
                self.map = Form(w, self._set_random_value, self._random_fields())
                self.map.show(self.random)
                button(w("open.make"), lambda: self.open(self._random_name(), ""), "small")
                self.saved_map = link(w("open.save_map"), self._map_address(), "button small", download="")
        self._draw_examples()
        self.recent = RecentPanel(self.view, self.page)
        self.recent.draw()

    def _draw_examples(self) -> None:
        from leafcut.read.examples import EXAMPLE_NAMES

        names = [["", self.view.words("open.pick")], *([name, name] for name in EXAMPLE_NAMES)]
        field = plain_field("example", self.view.words("open.example"), choices=names)
        self.example.show({}, groups=[plain_group(field)])

    def _random_fields(self) -> list[dict[str, Any]]:
        w = self.view.words
        return [plain_group(plain_field("points", w("open.points")), plain_field("seed", w("open.seed")))]

    def _options_field(self) -> dict[str, Any]:
        w = self.view.words
        return plain_group(plain_field("options", w("form.options"), file=True, default=w("form.toml")))

    def _load_options_file(self, _: str, value: str, name: str) -> Awaitable[None] | None:
        view = self.view
        before = view.values
        try:
            view.load_options_file(value)
        except LeafcutError as problem:
            self.page.show_message(str(problem), True)
            return None
        finally:
            view.studio.folder.delete_inputs([value])
        self.draw()
        line = view.words("form.taken", name=name)
        if not view.source or not any(before.get(option) != view.values.get(option) for option in OF_READING):
            self.page.show_message(line)
            return None
        self._begin_reading()
        return self._read_and_report(line)

    async def _read_and_report(self, line: str) -> None:
        if await self.read_input(self.view.work) and self.view.seen is not None and not self.view.seen.error:
            self.page.show_message(line)

    def _show_refusal(self, line: str) -> None:
        self.page.show_message(line, True)

    async def _open_example(self, _: str, value: str, __: str) -> None:
        if value:
            await self.open(f"example:{value}", value)

    def _set_random_value(self, name: str, value: str, _: str) -> None:
        self.random[name] = value
        self.map.show(self.random)
        self.saved_map.props["href"] = self._map_address()
        self.saved_map.update()

    def _map_address(self) -> str:
        return f"/api/points.csv?source={quote(self._random_name())}"

    def _random_name(self) -> str:
        return f"random:{self.random['points']}:{self.random['seed']}"

    def _opened(self, kept: dict[str, Any]) -> Awaitable[None]:
        if self.view.work != "nest":
            self._begin_reading()  # at once, because Run may be pressed before the reading starts
        return self.open(kept["id"], kept["name"])

    def open(self, source: str, name: str) -> Awaitable[None]:
        """Open and preview an input, and suggest suitable kinds of work. If the input is invalid, nothing changes."""
        self._run_wanted = False  # the request was for the previous input
        return self._open(source, name)

    async def _open(self, source: str, name: str) -> None:
        view = self.view
        if view.work == "nest" and await self.parts.add_part_or_list(source, name):
            return
        before = {k: copy(v) if isinstance(v, dict | list) else v for k, v in vars(view).items()}
        edit, shown = self.page.run.edit.order_to_store(), self.page.result.kept()
        self.page.memory.prepare_step()
        view.switch_input(source, name or source)
        self.page.run.leave_job()
        taken = dict(view.table)
        if not await self.read_input(""):
            return
        broken = not view.source or (view.seen is not None and view.seen.broken)
        if not broken or not before["source"]:
            if not broken and (left := view.reset_unsuitable_options()):
                if not await self.read_input(view.work):
                    return
                self.page.show_message(left)
            self.page.update_address()
            self.page.run.canvas.fit()
            if not broken:
                view.studio.recent.add(view.source, view.name)
                self.recent.draw()
            return
        line = self.page.message_line.text
        typed = {name: entry for name, entry in view.table.items() if taken.get(name) != entry}
        vars(view).update(before)
        view.table.update(typed)
        self.page.run.edit.store_order(edit)
        self.page.memory.cancel_step()
        if view.seen is None and not self._is_cancelled(line):  # this input has interrupted the reading
            await self.read_input("")
        self.draw()
        self.page.run.show_job_again()
        self.page.run.edit.resume_stored_order()
        self.page.result.show_again(shown)
        self._show_problem(line)

    async def open_sheet(self, sheet: SheetOfNest) -> None:
        """Open a sheet of a nest for cutting."""
        view, self._run_wanted = self.view, False
        try:
            source = upload_sheet(view.studio.jobs, sheet)
        except LeafcutError as problem:
            self.page.show_message(str(problem), True)
            return
        self.page.memory.prepare_step()
        view.switch_input(source, sheet.file, sheet.origin)
        self.page.run.leave_job()
        view.table.set_value("quantity", str(sheet.count) if sheet.count > 1 else "", setter=Setter.INPUT)
        view.work = "cut"
        self.page.update_address()
        if await self.read_input("cut"):
            self.page.run.canvas.fit()

    async def read_preview(self, view: View, work: str) -> tuple[Preview | None, str, bool]:
        """Read an input outside the event loop.

        Return its preview, its error, and whether this is the newest reading.
        """
        turn = self._begin_reading()
        if self.newest is not None:
            self.newest.cancel(_GRACE_SECONDS)
        self.newest = reading = PreviewReading(view.studio.workers, view.name)
        thread = asyncio.ensure_future(run.io_bound(_read_or_error, view, work, reading))
        waiting = asyncio.ensure_future(reading.cancelled.wait())
        await asyncio.wait((thread, waiting), return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        if reading.cancelled.is_set():
            seen, line = None, self.view.words("open.cancelled")
        else:
            seen, line = thread.result() or (None, "")
        newest = turn == self._turn
        if newest:
            self.newest = None
            self._end_reading(worked=not line and seen is not None and not seen.error)
        return seen, line, newest

    def cancel_reading(self) -> None:
        """Cancel the current reading, if there is one."""
        if self.newest is not None:
            self.newest.cancel()

    def abandon_reading(self) -> None:
        """Cancel the reading of a page that has been closed. No message is shown."""
        self._turn += 1
        self.cancel_reading()

    def _is_cancelled(self, line: str) -> bool:
        return line == self.view.words("open.cancelled")

    def _show_problem(self, line: str) -> None:
        """Show why an input was not read. If the user has cancelled the reading, the message is not an error."""
        self.page.show_message(line, not self._is_cancelled(line))

    def _begin_reading(self) -> int:
        """Record that the input will be read, and enable Run in the meantime. Return the number of this reading."""
        self._turn += 1
        self.reading = True
        self.show_ready(True)
        return self._turn

    def _end_reading(self, worked: bool) -> None:
        """Record that the newest reading has ended.

        If the user has pressed Run in the meantime, start the run as soon as the input is visible.
        """
        self.reading = False
        run_wanted, self._run_wanted = self._run_wanted and worked, False
        if run_wanted:
            with self.begin:
                ui.timer(0.0, self.page.run.start, once=True)

    async def read_input(self, work: str) -> bool:
        """Read the input for a kind of work and show it. Return False if another input was read in the meantime."""
        view = self.view
        self.page.show_message(view.words("open.reading", name=view.name), stays=True)
        seen, line, newest = await self.read_preview(view, work)
        if not newest:
            return False
        if self._is_cancelled(line) and work and view.seen is not None:  # keep the previous choices
            seen = Preview(view.seen.format, view.seen.works, error=line)
        view.seen = seen
        if line and not work:
            view.source = view.name = ""
        if seen is not None:
            line = "" if seen.pixels else seen.error  # the drawing asks for the size of a picture
            fits = work in (*seen.works, "nest")
            if not work and seen.whole.machine and not view.values.get("machine"):
                view.table.set_value("machine", seen.whole.machine, setter=Setter.INPUT)
            view.work = work if fits else seen.work or (view.work if view.work in seen.works else seen.works[0])
        self._show_problem(line)
        self.draw()
        self.page.run.draw()
        self.page.result.draw()
        if work:  # not a new input
            self.page.update_address()
        return True

    def _choose_work_or_process(self, name: str, value: str, _: str) -> Awaitable[None] | None:
        view = self.view
        if name == "process":
            view.process = value
            self.work.show({"process": value})
            self._show_command()
            return None
        view.work = value
        # A program is read identically for all kinds of work.
        read_again = bool(view.source) and (view.seen is None or view.seen.format != "gcode")
        if read_again:
            self._begin_reading()
        return self._switch_work(value, read_again)

    async def _switch_work(self, work: str, read_again: bool) -> None:
        if read_again and not await self.read_input(work):
            return
        if work == "nest":
            self.parts.add_open_drawing()
            self.view.reset_unsuitable_options()  # a nest has no machine
        self.draw()

    def set_option(self, name: str, value: Any, shown: str) -> Awaitable[bool] | None:
        """Set an option. If it affects how the input is read, read it again."""
        view = self.view
        view.table.set_value(name, value, shown)
        self._show_values()
        if name not in OF_READING or not view.source or name in view.errors:
            return None
        self._begin_reading()  # at once, because Run may be pressed before the reading starts
        return self.read_input(view.work)

    def scale_picture(self, width: str) -> Awaitable[bool] | None:
        """Set the pixel size of the open picture from its width. The width may have a unit."""
        seen = self.view.seen
        if seen is None or seen.pixels is None:
            return None
        try:
            size = parse_quantity(width, "mm") / seen.pixels[0]
        except LeafcutError as problem:
            self.page.show_message(str(problem), True)
            return None
        self.view.table.set_value("pixel_size", f"{size:.6g}mm", setter=Setter.INPUT)
        self._show_values()
        if "pixel_size" in self.view.errors:
            self.page.show_message(self.view.errors["pixel_size"], True)
            return None
        self._begin_reading()
        return self.read_input(self.view.work)

    def move_zero(self, x: float, y: float) -> Awaitable[bool] | None:
        """Move program zero by (x, y), mm. This changes the option `origin`."""
        zero = self.view.program_zero
        if zero is None:
            return None
        return self.set_option("origin", ",".join(f"{round(v, 4):g}" for v in (zero[0] + x, zero[1] + y)), "")

    def _show_values(self) -> None:
        view = self.view
        view.turn_off_local_search_for_study()
        off = view.work == "solve" and view.is_study and view.values.get("local_search") is False
        self.without_local_search.set_visibility(off)
        self.options.show(view.values, view.table.file_names, view.field_errors(), view.options_form())
        self.layers.draw()
        self.draw_pace()
        self._show_command()

    def draw_pace(self) -> None:
        """Show the field for the speed of the search, if users can watch this search."""
        self.pace.set_visibility(self.view.is_study)
        self.pace.show({"pace": self.view.pace})

    def _set_pace(self, _: str, value: str, __: str) -> None:
        self.view.pace = value
        self.draw_pace()

    async def restore_task(self, task: Task) -> bool:
        """Show the input and the choices of a task. Return False if another input was read in the meantime."""
        view = self.view
        names = [self._input_display_name(word) for word in task.inputs]
        view.source, view.name, view.seen = task.inputs[0].partition(":")[0], names[0], None
        if task.inputs[0].startswith(BUILT_IN):
            view.source = task.inputs[0]
        view.second, view.second_name = (task.inputs[1], names[1]) if task.command == "verify" else ("", "")
        if task.command == "nest":
            view.parts = list(nested_parts(task))
            view.part_names = {part.input: name for part, name in zip(view.parts, names, strict=True)}
        view.origin = task.origin
        view.process, view.work = task.process, task_work(task, view.name)
        removed = {name: line for name in task.options if (line := removal_message(name))}
        options = {name: value for name, value in task.options.items() if name not in removed}
        shown = {name: self._input_display_name(value) for name, value in options.items() if isinstance(value, str)}
        view.table.apply_job_options(options, shown, of_input=("plan", "quantity") if task.origin else ("plan",))
        newest = await self.draw_and_reread()
        if removed:
            self._show_problem("; ".join(removed.values()))
        return newest

    async def draw_and_reread(self) -> bool:
        """Show the choices and read the input again. Return False if another input was read in the meantime."""
        view, self._run_wanted = self.view, False
        self.draw()
        if not view.source:
            return True
        seen, line, newest = await self.read_preview(view, view.work)
        if not newest:
            return False
        view.seen = seen
        if line:
            self._show_problem(line)
        self.draw()
        return True

    def _input_display_name(self, word: str) -> str:
        if word.startswith(BUILT_IN):
            return source_display_name(word)
        try:
            return self.view.studio.folder.input_path(word.partition(":")[0]).name
        except LeafcutError:
            return ""

    def draw(self) -> None:
        """Show the input and the choices."""
        view, w = self.view, self.view.words
        kinds_of_work = view.works() if view.work in view.works() else (*view.works(), view.work)
        self.works.show(work_cards(kinds_of_work, view.seen, w), view.work, suggestion_words(view.seen, w))
        fields = []
        if view.work == "program":
            kinds = [[process, w.item_name("process", process)] for process in forms.program_processes()]
            fields.append(plain_field("process", w("choose.process"), choices=kinds))
        self.work.set_visibility(bool(fields))
        self.work.show({"process": view.process}, groups=[plain_group(*fields)])
        self.opener.allow_several(view.work == "nest")
        self.built_in.set_visibility(view.work != "nest")  # built-in sources are not drawings of parts
        self.parts.draw()
        self._draw_part()
        self._draw_second_program()
        self._show_values()

    def _draw_part(self) -> None:
        view, w = self.view, self.view.words
        self.about.clear()
        with self.about:
            if not view.source:
                return
            text("h2", view.name, "name", dir="auto")
            if view.seen is None:
                return
            with box("dl", "facts"):
                for key, value in view.seen.facts:
                    text("dt", w(f"fact.{key}"))
                    text("dd", value)
            if view.seen.issues:
                with box("details", "issues"):
                    text("summary", w("open.issues", number=len(view.seen.issues)))
                    with box("ul"):
                        for issue in view.seen.issues[:_MAX_ISSUES]:
                            meaning = w.explain_issue(issue["code"])
                            with box("li", issue["severity"]):
                                if meaning:
                                    text("b", f"{meaning}.")
                                words = (w.translate_for_page(issue[key]) for key in ("message", "place"))
                                message = " ".join(words).strip()
                                text("span", message, "", lang=w.language_of(issue["message"]))
                        if len(view.seen.issues) > _MAX_ISSUES:
                            text("li", w("open.more", number=len(view.seen.issues) - _MAX_ISSUES))

    def _draw_second_program(self) -> None:
        view, w = self.view, self.view.words
        self.second.clear()
        if view.work != "verify":
            return
        with self.second:
            field = plain_field("second", w("open.second"), file=True, default=w("form.none"))
            form = Form(w, self._set_second_program, [plain_group(field)], self._show_refusal)
            form.show({"second": view.second}, {"second": view.second_name})

    def _set_second_program(self, _: str, value: str, shown: str) -> None:
        self.view.second, self.view.second_name = value, shown
        self._draw_second_program()
        self._show_command()

    def _show_command(self) -> None:
        view = self.view
        line = view.command_line()
        missing = "parts.none" if view.work == "nest" else "command.later" if view.source else "command.none"
        self.command.clear()
        with self.command:
            for word in re.findall(r"\S+\s*", line or view.words(missing)):
                text("span", word)
        self.copy.set_visibility(bool(line))
        self.show_ready(view.has_all_inputs)
        self.page.store_changed_choices()

    def show_ready(self, ready: bool) -> None:
        """Show whether the run can start. The Run button always stays enabled, and reports a missing input when it is
        pressed.

        A disabled button would lose the focus. It would also ignore a click if it was disabled between press and
        release.
        """
        can_start = ready or (self.reading and not self.page.run.running)
        self.begin.props(f'aria-disabled="{"false" if can_start else "true"}"')

    def request_run(self) -> None:
        """Start the run. If a reading is in progress, the run starts after the reading."""
        view, w = self.view, self.view.words
        if self.page.run.running:
            self.page.show_message(w("run.going"))
        elif self.reading:
            self._run_wanted = True
            self.page.show_message(w("run.when_read", name=view.name), stays=True)
        elif not view.has_all_inputs:
            self.page.show_message(w(self._missing_input_key()))
        elif view.edited:  # run the visible order
            self.page.run.edit.run_edited_order()
        else:
            self.page.run.start()

    def _missing_input_key(self) -> str:
        view = self.view
        if view.work == "nest":
            return "parts.none"
        return "open.second_missing" if view.source and view.work == "verify" else "command.none"


def _read_or_error(view: View, work: str, reading: PreviewReading) -> tuple[Preview | None, str]:
    try:
        return view.read_preview(work, reading.work, reading.record_progress), ""
    except Exception as problem:
        return None, error_line(problem)


def task_work(task: Task, name: str) -> str:
    """Return the kind of work that a task belongs to."""
    if task.command != "optimize":
        return "solve" if task.command == "study" else task.command  # leafcut 0.2 had studies
    if task.process in forms.works_with_form() and task.process != "drill":
        return task.process
    from leafcut.read.registry import BUILT_IN as FORMATS

    programs = next(f.extensions for f in FORMATS if f.name == "gcode")
    program = name.lower().endswith(programs) and not name.startswith(BUILT_IN)
    return "program" if program or task.process not in ("auto", "drill") else "drill"


class WorkChoice(Element, component="../static/works.js"):
    """A group of radio buttons with thumbnails. `on_choose` receives the selected kind of work."""

    def __init__(self, label: str, on_choose: Callable[[str], Any]) -> None:
        super().__init__()
        self.props.update(label=label, works=[], chosen="", why="", turn=0)
        self.on("choose", lambda e: on_choose(e.args))

    def show(self, works: list[dict[str, Any]], chosen: str, why: str) -> None:
        """Show `works` (``name``, ``title``, ``picture``), the selected kind of work, and why it was suggested."""
        self.props.update(works=works, chosen=chosen, why=why, turn=self.props["turn"] + 1)
        self.update()


def work_cards(kinds: tuple[str, ...], seen: Preview | None, words: Words) -> list[dict[str, Any]]:
    """Return a card for each kind of work. Its thumbnail emphasizes the objects that this kind of work machines."""
    pictures = seen.whole.pictures if seen is not None else {}
    return [{"name": work, "title": words.item_name("work", work), "picture": pictures.get(work)} for work in kinds]


def suggestion_words(seen: Preview | None, words: Words) -> str:
    """Explain which kind of work is suggested for a drawing, and why. The text is empty if there is only one."""
    if seen is None or len(seen.whole.suits) < 2:
        return ""
    work, best = next(iter(seen.whole.suits.items()))
    reason = words.item_name("guess", best.reason).format(**best.figures)
    return words("choose.suggested", work=words.item_name("work", work), why=reason)
