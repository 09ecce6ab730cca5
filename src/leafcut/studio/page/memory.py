"""Stores the choices of a page in the browser's history, so that they survive Back, a reload and a restart."""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from nicegui import Client

from leafcut.errors import OptionError
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.page import forms
from leafcut.studio.page.elements import BrowserState
from leafcut.studio.page.form_values import FormValues
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_live import PACES

if TYPE_CHECKING:
    from collections.abc import Awaitable

    from leafcut.studio.page.pages import Page

#: Maximum size of the stored choices, characters. A message from the browser to the server must be smaller than 1 MiB.
MAX_CHARACTERS = 900_000

#: Format of a job id.
_JOB = re.compile(r"[A-Za-z0-9_-]{12}")
#: Attributes of a `View` that are stored: texts, sets of names, and tables of texts.
_TEXTS = ("source", "name", "second", "second_name", "origin", "work", "process", "pace")

#: The choices of a page: attributes of `View`, the visible ``tab`` of the result, and ``edit`` for an edited order.
#: ``edit`` contains the ``job`` and the fields ``state``, ``before`` and ``after`` of `UndoableState.as_plain`.
KeptState = dict[str, Any]


class Memory:
    """The steps of a page in the browser's history. Each step has an address and named choices.

    When the user opens a view, the new step keeps the same name. When the user opens another file or job, the new step
    gets a new name, so that Back can restore the earlier choices. After Back or Forward, `on_went` receives the address
    of the step. It also receives the choices if the name has changed.
    """

    def __init__(
        self, page: Page, client: Client, on_went: Callable[[dict[str, Any], KeptState | None], Awaitable[None]]
    ) -> None:
        self._page, self._on_went = page, on_went
        self.browser = BrowserState(self._go_to_step)
        self.is_open: Callable[[], bool] = lambda: client.has_socket_connection
        self._register_page_as(secrets.token_urlsafe(9))
        #: Whether the choices have been read from the browser. They must not be overwritten before.
        self._loaded = False
        #: Whether the page is opening another input, which will add a step.
        self._opening = False
        #: Whether a view was opened before the choices were read from the browser.
        self._late_step = False
        #: Choices by name at the moment when the user went back or forward. The browser may not have had time to store
        #: them.
        self._left: dict[str, KeptState] = {}
        #: The address and choices that were sent last.
        self._sent = ("", "")

    def _register_page_as(self, name: str) -> None:
        self.name = name
        self._page.studio.open_pages[name] = self._page

    async def load(self) -> KeptState | None:
        """Return the choices of the current step in the browser, or None."""
        state = _parse_state(await self.browser.read_choices())
        self._loaded = True
        if state is None:
            return None
        name, latest = str(state.get("page")), self._latest_choices(state)
        other = self._page.studio.open_pages.get(name)
        if other is None or not other.memory.is_open():  # otherwise this is a duplicated tab
            self._register_page_as(name)
        return latest

    async def load_last(self) -> KeptState | None:
        """Return the choices of the page that was closed last in this browser, or None."""
        state = _parse_state(await self.browser.read_last_choices())
        return None if state is None else self._latest_choices(state)

    def _latest_choices(self, state: KeptState) -> KeptState:
        """Return the choices of a page that was closed or reloaded a moment ago.

        The server has received the last edits of this page, but the browser had no time to store them.
        """
        other = self._page.studio.open_pages.get(str(state.get("page")))
        return state if other is None or other.memory.is_open() else dict(other.choices_to_save())

    def save(self) -> None:
        """Store the page's state if it has changed, unless another input is being opened."""
        if self._loaded and not self._opening:
            late, self._late_step = self._late_step, False
            self._send_step("pushState" if late else "replaceState")

    def prepare_step(self) -> None:
        """Store the state in this step. Another input may be opened soon, which adds a step."""
        if not self._opening and self.has_input():
            self.save()
            self._opening = True

    def has_input(self) -> bool:
        """Return whether the page shows an input, a job, or parts to nest."""
        state = self._page.choices_to_save()
        return bool(state["source"] or state["job"] or state["parts"])

    def cancel_step(self) -> None:
        """Stay in this step, because no other input was opened."""
        self._opening = False

    def store_opened_input(self) -> None:
        """Store the state. If another input was opened, store it as a new step."""
        if self._opening:
            self._opening = False
            self._register_page_as(secrets.token_urlsafe(9))
            self.store_as_new_step()
        else:
            self.save()

    def store_as_new_step(self) -> None:
        """Store the state as a new step."""
        if self._loaded:
            self._send_step("pushState")
        else:
            self._late_step = True

    async def _go_to_step(self, address: dict[str, Any], state: str, newest: bool) -> None:
        """Respond to Back or Forward.

        `newest` is set if the browser has recorded all steps. Otherwise, the browser adds the missing step later, and
        the page sends the state of this step again.
        """
        kept, self._opening = _parse_state(state), False
        name = self.name if kept is None else str(kept.get("page"))
        other = name != self.name
        if other:
            self._left[self.name] = self._page.choices_to_save()
            kept = self._left.get(name, kept)
        self._register_page_as(name)
        await self._on_went(address, kept if other else None)
        if not newest:
            self._sent = ("", "")
        self.save()

    def _send_step(self, step: str) -> None:
        state = self._page.choices_to_save()
        text = json.dumps({**state, "page": self.name})
        if len(text) > MAX_CHARACTERS:
            text = json.dumps({**state, "page": self.name, "edit": None})
        page, job = self._page, self._page.view.job
        query = {"view": "" if page.shown in ("", "work") else page.shown, "job": job or ""}
        sent = ("/?" + urlencode({key: word for key, word in query.items() if word}), text)
        if sent != self._sent:
            self._sent = sent
            self.browser.add_step(step, *sent)


def _parse_state(text: str) -> KeptState | None:
    with suppress(ValueError, RecursionError):
        state = json.loads(text)
        if isinstance(state, dict):
            return state
    return None


def kept_state(view: View, tab: str, edit: dict[str, Any] | None) -> KeptState:
    """Return the choices of a page."""
    return {
        **{name: getattr(view, name) for name in _TEXTS},
        "table": view.table.as_plain(),
        "parts": [part.encoded for part in view.parts],
        "part_names": dict(view.part_names),
        "sheet": list(view.sheet),
        "job": view.job or "",
        "tab": tab,
        "edit": edit,
    }


def restore_choices(view: View, plain: Mapping[str, Any]) -> None:
    """Apply stored choices (see `kept_state`) to a page. Invalid entries are ignored.

    The ids of files and jobs are only checked when they are used, in the same way as ids that a page sends.
    """
    for name in ("source", "name", "second", "second_name", "origin"):
        setattr(view, name, str(plain.get(name, "")))
    view.work = _known_or_default(plain.get("work"), forms.works_with_form(), "drill")
    view.process = _known_or_default(plain.get("process"), forms.program_processes(), "auto")
    view.pace = _known_or_default(plain.get("pace"), PACES, "full")
    view.table = FormValues.from_plain(plain.get("table"))
    names = plain.get("part_names")
    view.part_names = {k: str(v) for k, v in names.items()} if isinstance(names, dict) else {}
    view.parts, view.sheet, view.seen = _parse_parts(plain.get("parts")), _parse_sheet(plain.get("sheet")), None
    job = str(plain.get("job", ""))
    view.job = job if _JOB.fullmatch(job) and view.studio.jobs.record(job) is not None else None


def _known_or_default(word: Any, known: Iterable[str], default: str) -> str:
    return word if isinstance(word, str) and word in set(known) else default


def _parse_parts(words: Any) -> list[WantedPart]:
    parts = []
    for word in words if isinstance(words, list) else []:
        with suppress(OptionError, AttributeError):
            parts.append(WantedPart.decode(word))
    return parts


def _parse_sheet(plain: Any) -> tuple[int, int]:
    with suppress(TypeError, ValueError):
        variant, number = plain
        return int(variant), int(number)
    return 1, 1
