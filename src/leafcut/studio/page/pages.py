"""The layout of the studio's page with its views. Panels and rooms provide the content of the views."""

from __future__ import annotations

import logging
import math
import time
from contextlib import suppress
from functools import cache
from html import escape
from operator import itemgetter
from typing import Any, Protocol

from fastapi import FastAPI, Request
from nicegui import background_tasks, ui

from leafcut._version import __version__
from leafcut.studio.drawing.canvas import STATIC
from leafcut.studio.folder import Folder
from leafcut.studio.page.badge import Badge
from leafcut.studio.page.elements import box, button, link, text
from leafcut.studio.page.memory import KeptState, Memory, kept_state, restore_choices
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_input import InputPanel
from leafcut.studio.page.panel_jobs import JobsPanel
from leafcut.studio.page.panel_library import LibraryPanel
from leafcut.studio.page.panel_result import ResultPanel
from leafcut.studio.page.panel_run import RunPanel
from leafcut.studio.studio import Studio
from leafcut.studio.wording import LANGUAGES, Words, preferred_language, words

#: Time after which a message disappears, s. Errors remain visible.
_SAID_SECONDS = 6.0
#: A browser that reconnects within this time keeps its page, s. NiceGUI derives the interval and the timeout of its
#: pings from this value.
RECONNECT_SECONDS = 10.0
#: Interval between updates while jobs are running, s. It is short enough to show a result immediately.
_TICK = 0.05

LEAF = (
    '<svg viewBox="0 0 24 24" aria-hidden="true"><path d="M20 4C9 4 4 9 4 15c0 1.8.5 3.5 1 5 1.5.5 3.2 1 5 1 6 0 10-6 '
    '10-17z"></path><path d="M5 20 14 10"></path><path d="M20 4l-3.5 3.5"></path></svg>'
)

_FAVICON = LEAF.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg" fill="none" stroke="#1d6b41" stroke-width="2"')
_STYLES = ("colours.css", "studio.css", "room.css", "works.css", "figures.css", "drawing.css", "program.css")
#: Must run before the page is painted, because it selects the light or the dark theme.
_FIRST_SCRIPT = "shell.js"
_MODULES = ("focus.js", "badge.js", "picture.js")

#: Views of the page, with their keys.
VIEWS = (("work", "1"), ("jobs", "2"), ("machines", "3"), ("tools", "4"))
#: Other keys of the page, with the key of their description.
_KEYS: tuple[tuple[tuple[str, ...], str], ...] = (
    (("O",), "key.o"),
    (("R", "Ctrl+Enter"), "key.r"),
    (("S", "Esc"), "key.s"),
    (("Esc",), "key.cancel"),
    (("P",), "key.p"),
    (("N",), "key.n"),
    (("U",), "key.u"),
    (("Y",), "key.y"),
    (("[", "]"), "key.fold"),
    (("/",), "key.find"),
    (("F1",), "key.field"),
    (("T",), "key.t"),
    (("Esc", "Pause"), "key.machine_stop"),
    (("?",), "key.help"),
)
#: Keys that work in the drawing, with the key of their description.
_DRAWING_KEYS = (
    (("← ↑ → ↓",), "key.arrows"), (("+ −",), "key.zoom"), (("F",), "key.fit"), (("␣",), "key.play"),
    ((", .",), "key.block"), (("M",), "key.modes"), (("D",), "key.measure"), (("⇧A … ⇧W",), "key.layers"),
)  # fmt: skip


def add_pages(app: FastAPI, studio: Studio) -> None:
    """Add the pages of a studio to its server."""
    logging.getLogger("nicegui").setLevel(logging.ERROR)

    @ui.page("/", title="leafcut studio")
    def page(request: Request, lang: str = "", view: str = "", job: str = "") -> None:
        Page(studio, words(_language(studio.folder, request, lang)), job).build(view)
        ui.context.client.on_connect(studio.workers.start_spare_process)  # the page is visible, so this delays nobody

    # No compression over the loopback interface. Tailwind would run a compiler in the page.
    ui.run_with(
        app,
        title="leafcut studio",
        favicon=_FAVICON,
        tailwind=False,
        gzip_middleware_factory=None,
        show_welcome_message=False,
        reconnect_timeout=RECONNECT_SECONDS,
    )


class RoomView(Protocol):
    """The view of a room in a page."""

    async def show(self) -> None:
        """Show the current content of the view."""

    def tick(self, *, shown: bool) -> None:
        """Update the view.

        The page calls this method every `_TICK` seconds after the view was shown for the first time.
        """


def _language(folder: Folder, request: Request, asked: str) -> str:
    """Return the requested language, and save it for later.

    If no language is requested, use the saved language. Otherwise, use the language of the browser.
    """
    kept = folder.root / "language"
    if asked in LANGUAGES:
        with suppress(OSError):  # it is requested again next time
            kept.write_text(asked, encoding="utf-8")
        return asked
    with suppress(OSError, UnicodeDecodeError):
        saved = kept.read_text(encoding="utf-8")
        if saved in LANGUAGES:
            return saved
    return preferred_language(request.headers.get("accept-language", ""))


class Page:
    """An open page of the studio."""

    def __init__(self, studio: Studio, words: Words, job: str = "") -> None:
        self.studio, self.words = studio, words
        self.view = View(studio, words)
        self._keys = (*VIEWS, *sorted(((room.name, room.key) for room in studio.rooms.values()), key=itemgetter(1)))
        #: Error in the file with the user's own defaults.
        self._unread = self.view.apply_defaults()
        #: The job in the address. It opens if the browser has not stored any choices.
        self._asked = job
        #: Choices of the page that this browser closed last. They are offered while this page is empty.
        self.last: KeptState | None = None
        #: Time at which the current message disappears, on the monotonic clock, s.
        self._until = math.inf
        self.shown = ""
        self.built = False

    def build(self, view: str = "") -> None:
        """Build the page and show one of its views."""
        w = self.words
        lost = escape(w("help.lost") + "|" + w("help.again"))
        meta = f'<meta name="leafcut-language" content="{w.language}"><meta name="leafcut-lost" content="{lost}">'
        ui.add_head_html(meta + self._head_html())
        ui.add_body_html(loading_bar_html())
        ui.context.client.content.classes("all")
        with box("div", "studio loading", lang=w.language) as self.place:
            self._draw_top_bar()
            self.views = {}
            with box("div", "work", id="view-work") as self.views["work"]:
                with box("aside", "left", id="column-left", aria_label=w("left.title")):
                    self.input = InputPanel(self.view, self)
                middle = box("section", "middle", aria_label=w("middle.title"))
                with box("aside", "right", id="column-right", aria_label=w("right.title")) as right:
                    self.progress_place = box("div", "running")
                with middle:
                    self.run = RunPanel(self.view, self)
                with right:
                    self.result = ResultPanel(self.view, self)
            with box("div", "sheet", id="view-jobs") as self.views["jobs"]:
                self.jobs = JobsPanel(self.view, self)
            for kind in ("machines", "tools"):
                with box("div", "sheet", id=f"view-{kind}") as self.views[kind]:
                    self.__dict__[kind] = LibraryPanel(self.view, self, kind)
            #: Views of rooms that were shown on this page. Most pages never show any.
            self.rooms: dict[str, RoomView] = {}
            for name in self.studio.rooms:
                self.views[name] = box("div", "sheet", id=f"view-{name}")
            self._bars = [room.add_bar(self) for room in self.studio.rooms.values()]
            add_help_dialog(w, self._keys)
            self.message_line = text("div", "", "said", id="said", role="status", aria_live="polite")
            self.message_line.on("click", lambda: self.show_message(""))
            self.announced = text("div", "", "unseen", id="announced", role="status", aria_live="polite")
            self.memory = Memory(self, ui.context.client, self.return_to_step)
            self.badge = Badge(self.view)
        self.built = True
        if self._unread:
            self.show_message(w("form.usual_wrong", line=w.translate_for_page(self._unread)), True)
        self.show_view(view if view in self.views else "work")
        self.timer = ui.timer(_TICK, self.tick)
        ui.context.client.on_delete(self._release)
        ui.timer(0.0, self._restore_and_reveal, once=True)

    def _head_html(self) -> str:
        rooms = self.studio.rooms.values()
        return head_html(sum((room.styles for room in rooms), ()), sum((room.modules for room in rooms), ()))

    def _release(self) -> None:
        self.input.abandon_reading()
        self.view.seen = None
        self.run.release_drawn()

    def _draw_top_bar(self) -> None:
        w = self.words
        with box("header", "top"):
            with box("div", "mark"):
                self._add_fold_button("left", "[")
                ui.html(LEAF, sanitize=False)
                text("b", "leafcut")
                text("span", "studio", "quiet")
            self.tabs = {}
            with box("nav", "tabs", aria_label=w("top.views"), data_roving=""):
                for name, key in self._keys:
                    tab = button(w(f"top.{name}"), lambda name=name: self.go_to_view(name), "tab", data_key=key)
                    self.tabs[name] = tab
            with box("div", "tools"):
                with box("nav", "languages", aria_label=w("top.language")):
                    for code, name in LANGUAGES.items():
                        current = {"aria_current": "true"} if code == w.language else {}
                        link(
                            code.upper(),
                            f"/?lang={code}",
                            "language",
                            title=name,
                            lang=code,
                            aria_label=name,
                            **current,
                        )
                button(w("top.theme"), None, "plain", data_theme_switch="", data_key="t")
                button("?", None, "plain round", data_dialog="help", data_key="?", aria_label=w("top.help"))
                self._add_fold_button("right", "]")

    def _add_fold_button(self, side: str, key: str) -> None:
        button(
            "",
            None,
            f"plain fold fold-{side}",
            data_fold=side,
            data_key=key,
            title=self.words(f"top.fold_{side}"),
            aria_label=self.words(f"top.fold_{side}"),
            aria_expanded="true",
            aria_controls=f"column-{side}",
        )

    def show_view(self, name: str) -> None:
        """Show one of the views."""
        self.shown = name
        for view_name, view in self.views.items():
            view.set_visibility(view_name == name)
            is_current = view_name == name
            self.tabs[view_name].props(
                f'aria-current="{"page" if is_current else "false"}" tabindex="{0 if is_current else -1}"'
            )
        if name == "jobs":
            self.jobs.draw()
        elif name in ("machines", "tools"):
            self.__dict__[name].draw()
        elif name in self.studio.rooms:
            background_tasks.create(self._open_room(name).show())

    def _open_room(self, name: str) -> RoomView:
        if name not in self.rooms:
            with self.views[name]:
                self.rooms[name] = self.studio.rooms[name].open(self, self.views[name].client)
        return self.rooms[name]

    def go_to_view(self, name: str) -> None:
        """Show one of the views, and add a step to the browser's history."""
        if name != self.shown:
            self.show_view(name)
            self.memory.store_as_new_step()

    async def return_to_step(self, address: dict[str, Any], kept: KeptState | None) -> None:
        """Show the view to which the user has returned. Restore its choices, unless they are None."""
        view = str(address.get("view", ""))
        self.show_view(view if view in self.views else "work")
        if kept is not None:
            restore_choices(self.view, kept)
            await self._show_restored(kept)

    async def _restore_and_reveal(self) -> None:
        try:
            kept = await self.memory.load()
            if kept is None and not self._asked:
                last = await self.memory.load_last()
                self.last = last if last is not None and last.get("source") else None
                self.run.redraw_suggestions()
        finally:
            self.place.classes(remove="loading")
        if self.memory.has_input():
            pass  # opened before the browser answered
        elif kept is not None:
            await self.restore_choices(kept)
        elif self._asked:
            await self.open_job(self._asked)
        self.memory.save()

    async def restore_choices(self, kept: KeptState) -> None:
        """Restore stored choices."""
        restore_choices(self.view, kept)
        self.view.apply_defaults()
        await self._show_restored(kept)

    async def _show_restored(self, kept: KeptState) -> None:
        self.result.preselect_tab(str(kept.get("tab")))
        edit = kept.get("edit")
        self.run.edit.store_order(edit if isinstance(edit, dict) else None)
        self.run.show_job_again()
        self.result.draw()
        if await self.input.draw_and_reread():
            self.run.draw()
            self.result.show_input()
            self.run.edit.resume_stored_order()

    def choices_to_save(self) -> KeptState:
        """Return the state to save."""
        return kept_state(self.view, self.result.tab, self.run.edit.order_to_store())

    def show_message(self, line: str, bad: bool = False, stays: bool = False) -> None:
        """Show a message at the top of the page. It disappears after a few seconds, unless it is `bad` or `stays`.

        The user can close such a message with a click.
        """
        self._until = math.inf if bad or stays else time.monotonic() + _SAID_SECONDS
        self.message_line.set_text(self.words.translate_for_page(line))
        self.message_line.classes(replace="said bad" if bad else "said")

    def announce(self, line: str) -> None:
        """Announce a message to screen readers."""
        self.announced.set_text(self.words.translate_for_page(line))

    def store_changed_choices(self) -> None:
        """Store the changed choices, and check whether the result is outdated."""
        if self.built:
            self.result.mark.refresh()
            self.memory.save()

    async def open_job(self, job: str, sheet: tuple[int, int] = (1, 1)) -> None:
        """Show a running or finished job. For a nest, show one of its sheets."""
        record = self.studio.jobs.record(job)
        if record is None:
            self.show_message(self.words("jobs.gone"), True)
            return
        self.memory.prepare_step()
        self.view.job = job
        self.show_view("work")
        self.run.watch_job()
        self.update_address()
        if not await self.input.restore_task(record.task):
            return
        self.view.sheet = sheet
        self.run.draw()
        self.result.draw()

    def files_in_use(self) -> set[str]:
        """Return all texts in the choices that may be ids of uploads."""
        state = self.choices_to_save()
        values = (entry[0] for entry in state["table"].values() if isinstance(entry[0], str))
        return {state["source"], state["second"], *(part.input for part in self.view.parts), *values}

    def update_address(self) -> None:
        """Update the address, so that it leads to this view and job even after the studio has restarted."""
        self.memory.store_opened_input()

    def tick(self) -> None:
        """Update the visible parts of the page. This method is called every `_TICK` seconds."""
        if time.monotonic() > self._until:
            self.show_message("", stays=True)
        self.badge.tick()
        for update_bar in self._bars:
            update_bar()
        for name, room in self.rooms.items():
            room.tick(shown=self.shown == name)
        self.run.tick()
        self.result.tick()
        if self.shown == "jobs":
            self.jobs.tick()


@cache
def head_html(styles: tuple[str, ...] = (), modules: tuple[str, ...] = ()) -> str:
    """Return the style sheets and scripts of the page and its rooms as HTML."""
    # Browsers cache by address, so a newer file gets a new address.
    newest = int(max(file.stat().st_mtime for file in STATIC.iterdir()))
    links = [f'<link rel="stylesheet" href="/static/{name}?{newest}">' for name in (*_STYLES, *styles)]
    first = f'<script src="/static/{_FIRST_SCRIPT}?{newest}"></script>'
    scripts = [f'<script type="module" src="/static/{name}?{newest}"></script>' for name in (*_MODULES, *modules)]
    return "".join([*links, first, *scripts])


def loading_bar_html() -> str:
    """Return the HTML of the top bar, which is visible until the page has loaded."""
    return f'<div class="boot" aria-hidden="true"><div class="mark">{LEAF}<b>leafcut</b><span>studio</span></div></div>'


def add_help_dialog(words: Words, views: tuple[tuple[str, str], ...]) -> None:
    """Add the help dialog to the page. It is hidden at first."""
    # A single element instead of hundreds, because every page contains the dialog and few pages show it.
    dialog = ui.html(_help_html(words, views), sanitize=False, tag="dialog").classes("help")
    dialog.props.update({"id": "help", "aria-label": words("top.help")})


@cache
def _help_html(words: Words, views: tuple[tuple[str, str], ...]) -> str:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    from leafcut import api
    from leafcut.read import formats

    environment = Environment(
        loader=PackageLoader("leafcut.studio", "page"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    kinds = {f"{f.name} {' '.join(f.extensions)}".strip(): f.help for f in formats()}
    return environment.get_template("help.html.jinja").render(
        w=words,
        version=__version__,
        page_keys=(*(((key,), f"top.{name}") for name, key in views), *_KEYS),
        drawing_keys=_DRAWING_KEYS,
        lists=(("help.formats", kinds), ("help.algorithms", api.algorithms())),
    )
