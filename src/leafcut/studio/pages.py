"""The pages of the studio: one page with four views, laid out here; what stands in them is in the panels."""

from __future__ import annotations

import asyncio
import gc
import logging
import math
import time
from contextlib import suppress
from html import escape
from typing import TYPE_CHECKING

from fastapi import Request
from nicegui import Client, ui
from nicegui import app as nicegui_app

from leafcut._version import __version__
from leafcut.studio.elements import box, button, link, text
from leafcut.studio.folder import Folder
from leafcut.studio.page_state import View
from leafcut.studio.panel_input import InputPanel
from leafcut.studio.panel_jobs import JobsPanel
from leafcut.studio.panel_library import LibraryPanel
from leafcut.studio.panel_result import ResultPanel
from leafcut.studio.panel_run import RunPanel
from leafcut.studio.wording import LANGUAGES, Words, preferred, words

if TYPE_CHECKING:
    from fastapi import FastAPI

    from leafcut.studio.studio import Studio

#: The views of the page, each with its key.
_VIEWS = (("work", "1"), ("jobs", "2"), ("machines", "3"), ("tools", "4"))
#: Keys that are explained, beside those of the views.
_KEYS: tuple[tuple[str, ...], ...] = (("o",), ("r",), ("s", "esc"), ("p",), ("n",), ("u",), ("y",), ("t",), ("?",))
#: Keys of the drawing as they are shown, each with what tells of it.
_DRAWING_KEYS = (
    ("← ↑ → ↓", "arrows"), ("+ −", "zoom"), ("F", "fit"), ("␣", "play"), (", .", "block"), ("M", "modes"),
    ("⇧A … ⇧W", "layers"),
)  # fmt: skip
#: A line that is no complaint goes after so many seconds.
_SAID_SECONDS = 6.0
#: So many pages may wait for their browser to connect; NiceGUI itself drops them after a minute.
_MOST_UNSEEN = 20
#: After a page is gone its memory is freed within this time, s.
_TIDY_SECONDS = 1.0
_LEAF = (
    '<svg viewBox="0 0 24 24" aria-hidden="true"><path d="M20 4C9 4 4 9 4 15c0 1.8.5 3.5 1 5 1.5.5 3.2 1 5 1 6 0 10-6 '
    '10-17z"></path><path d="M5 20 14 10"></path><path d="M20 4l-3.5 3.5"></path></svg>'
)
_HEAD = (
    '<link rel="stylesheet" href="/static/colours.css"><link rel="stylesheet" href="/static/studio.css">'
    '<script src="/static/shell.js"></script>'
)


def add_pages(app: FastAPI, studio: Studio) -> None:
    """Add the pages of a studio to its server."""
    logging.getLogger("nicegui").setLevel(logging.ERROR)
    tidier = _Tidier()

    @ui.page("/", title="leafcut studio")
    def page(request: Request, lang: str = "", job: str = "") -> None:
        Page(studio, words(_language(studio.folder, request, lang))).build(job)
        ui.context.client.on_delete(tidier.page_gone)
        tidier.drop_unseen()

    # Nothing is compressed: it goes over the loopback. Tailwind would be a compiler in the page.
    ui.run_with(
        app,
        title="leafcut studio",
        favicon=_favicon(),
        tailwind=False,
        gzip_middleware_factory=None,
        show_welcome_message=False,
        reconnect_timeout=10.0,
    )
    nicegui_app.on_exception(lambda problem: logging.getLogger("nicegui").debug("%s", problem))


class _Tidier:
    """Frees the memory of pages that nobody sees any more: about a megabyte each, in circles of references."""

    def __init__(self) -> None:
        self._due = False

    def page_gone(self) -> None:
        """Look for garbage soon, once for all the pages that go together."""
        if not self._due:
            self._due = True
            asyncio.get_running_loop().call_later(_TIDY_SECONDS, self._collect)

    def _collect(self) -> None:
        self._due = False
        gc.collect()

    @staticmethod
    def drop_unseen() -> None:
        """Drop the oldest pages that were asked for and never shown, as a program that only loads the address does."""
        unseen = [client for client in Client.instances.values() if not client.has_socket_connection]
        for client in unseen[:-_MOST_UNSEEN]:
            client.delete()


def _favicon() -> str:
    return _LEAF.replace(
        "<svg", '<svg xmlns="http://www.w3.org/2000/svg" fill="none" stroke="#1d6b41" stroke-width="2"'
    )


def _language(folder: Folder, request: Request, asked: str) -> str:
    """Return the language asked for, which is kept, or the one kept, or the browser's."""
    kept = folder.root / "language"
    if asked in LANGUAGES:
        with suppress(OSError):  # then it is asked for again
            kept.write_text(asked, encoding="utf-8")
        return asked
    with suppress(OSError, UnicodeDecodeError):
        found = kept.read_text(encoding="utf-8")
        if found in LANGUAGES:
            return found
    return preferred(request.headers.get("accept-language", ""))


class Page:
    """One open page."""

    def __init__(self, studio: Studio, spoken: Words) -> None:
        self.studio, self.words = studio, spoken
        self.view = View(studio, spoken)
        #: When what is said goes away by itself, by the monotonic clock.
        self._until = math.inf
        self.shown = ""

    def build(self, job: str) -> None:
        """Lay out the page; `job` is shown where it is one."""
        w = self.words
        lost = escape(w("help.lost") + "|" + w("help.again"))
        ui.add_head_html(
            f'<meta name="leafcut-language" content="{w.language}"><meta name="leafcut-lost" content="{lost}">{_HEAD}'
        )
        ui.context.client.content.classes("all")
        with box("div", "studio", lang=w.language):
            self._top()
            self.views = {}
            with box("div", "work", id="view-work") as self.views["work"]:
                with box("aside", "left", aria_label=w("left.title")):
                    self.input = InputPanel(self.view, self)
                with box("section", "middle", aria_label=w("middle.title")):
                    self.run = RunPanel(self.view, self)
                with box("aside", "right", aria_label=w("right.title")):
                    self.result = ResultPanel(self.view, self)
            with box("div", "sheet", id="view-jobs") as self.views["jobs"]:
                self.jobs = JobsPanel(self.view, self)
            for kind in ("machines", "tools"):
                with box("div", "sheet", id=f"view-{kind}") as self.views[kind]:
                    self.__dict__[kind] = LibraryPanel(self.view, self, kind)
            self._help()
            self.said = text("div", "", "said", id="said", role="status", aria_live="polite")
            self.said.on("click", lambda: self.say(""))
        self.show("work")
        self.timer = ui.timer(0.1, self.tick)
        ui.context.client.on_delete(self._forget)
        if job:
            ui.timer(0.0, lambda: self.open_job(job), once=True)

    def _forget(self) -> None:
        """Let go of what is large, now that nobody sees the page any more; the rest goes when memory is tidied up."""
        self.view.seen = None
        self.run.forget()

    def _top(self) -> None:
        w = self.words
        with box("header", "top"):
            with box("div", "mark"):
                ui.html(_LEAF, sanitize=False)
                text("b", "leafcut")
                text("span", "studio", "quiet")
            self.tabs = {}
            with box("nav", "tabs", aria_label=w("top.views")):
                for name, key in _VIEWS:
                    tab = button(w(f"top.{name}"), lambda name=name: self.show(name), "tab", data_key=key)
                    self.tabs[name] = tab
            with box("div", "tools"):
                with box("nav", "languages", aria_label=w("top.language")):
                    for code, name in LANGUAGES.items():
                        here = {"aria_current": "true"} if code == w.language else {}
                        link(code.upper(), f"/?lang={code}", "language", title=name, lang=code, aria_label=name, **here)
                button(w("top.theme"), None, "plain", data_theme_switch="", data_key="t")
                button("?", None, "plain round", data_dialog="help", data_key="?", aria_label=w("top.help"))

    def _help(self) -> None:
        w = self.words
        with box("dialog", "help", id="help", aria_label=w("top.help")):
            text("h2", w("help.title"))
            with box("div", "columns"):
                with box("dl", "keys"):
                    for name, key in _VIEWS:
                        self._key(w(f"top.{name}"), key)
                    for every in _KEYS:
                        self._key(w(f"key.{'help' if every == ('?',) else every[0]}"), *every)
                with box("div"):
                    text("h3", w("help.drawing"))
                    with box("dl", "keys"):
                        for keys, name in _DRAWING_KEYS:
                            self._key(w(f"key.{name}"), keys)
            self._lists()
            text("p", w("help.text"), "quiet")
            text("p", f"leafcut {__version__}", "quiet small")
            button(w("help.close"), None, "", data_close="")

    def _lists(self) -> None:
        """List what `leafcut formats` and `leafcut algorithms` list."""
        from leafcut import api
        from leafcut.read import formats

        kinds = {f"{f.name} {' '.join(f.extensions)}".strip(): f.help for f in formats()}
        for key, rows in (("formats", kinds), ("algorithms", api.algorithms())):
            with box("details", "listed", name="listed"):
                text("summary", self.words(f"help.{key}"))
                with box("dl", "known", lang="en"):
                    for name, about in rows.items():
                        text("dt", name)
                        text("dd", about)

    @staticmethod
    def _key(meaning: str, *keys: str) -> None:
        with box("dt"):
            for key in keys:
                text("kbd", "Esc" if key == "esc" else key.upper() if len(key) == 1 else key)
        text("dd", meaning)

    def show(self, name: str) -> None:
        """Show one of the views."""
        self.shown = name
        for each, view in self.views.items():
            view.set_visibility(each == name)
            self.tabs[each].props(f'aria-current="{"page" if each == name else "false"}"')
        if name == "jobs":
            self.jobs.draw()
        elif name in ("machines", "tools"):
            self.__dict__[name].draw()

    def say(self, line: str, bad: bool = False, stays: bool = False) -> None:
        """Tell a person something, in one line over the page; a click takes it away.

        What is not `bad` goes by itself after a while, unless it `stays` until something else is told.
        """
        self._until = math.inf if bad or stays else time.monotonic() + _SAID_SECONDS
        self.said.set_text(self.words.plain(line))
        self.said.classes(replace="said bad" if bad else "said")

    async def open_job(self, job: str, sheet: tuple[int, int] = (1, 1)) -> None:
        """Show a job, whether it runs or ran; of a nest, one of its sheets."""
        record = self.studio.jobs.record(job)
        if record is None:
            self.say(self.words("jobs.gone"), True)
            return
        self.view.job = job
        self.remember()
        self.show("work")
        self.run.watch()
        if not await self.input.restore(record.task):
            return
        self.view.sheet = sheet
        self.run.draw()
        self.result.draw()

    def remember(self) -> None:
        """Put the job into the address: the page comes back to it, also when the studio was started again under it."""
        ui.navigate.history.replace(f"/?job={self.view.job}" if self.view.job else "/")

    def tick(self) -> None:
        """Look ten times a second how the job that is shown goes on."""
        if time.monotonic() > self._until:
            self.say("", stays=True)
        self.run.tick()
        self.result.tick()
        if self.shown == "jobs":
            self.jobs.tick()
