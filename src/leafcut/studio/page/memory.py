"""The choices of a page, saved under a name in its URL, so that they survive reloads, Back and restarts."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from nicegui import Client

from leafcut.studio.page.elements import Address
from leafcut.studio.page.saved_state import KeptState, has_choices
from leafcut.studio.saved_pages import KeptPages

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from leafcut.studio.page.pages import Page


class Memory:
    """The name of a page, its saved state, and its address. Another file or job gets a new name, so that Back works."""

    def __init__(self, page: Page, kept: KeptPages, name: str = "") -> None:
        self._page, self._kept = page, kept
        known = kept.get(name) is not None
        self.name = self._initial_name = name if known else kept.new_name()
        #: Last saved text, and whether anything was saved.
        self._text = ""
        self._written = known
        #: Previous name, while it is unknown whether another input will be opened.
        self._left = ""
        self._address = ""
        self._seen: Callable[[], bool] = lambda: False
        self._history: Address | None = None

    def watch(self, client: Client, on_address: Callable[[dict[str, Any], bool], Awaitable[None]]) -> None:
        """Connect to the browser of a page: claim the name while the page is open, and follow Back and Forward."""
        self._history = Address(on_address)
        self._seen = lambda: client.has_socket_connection
        client.on_connect(self.hold)
        client.on_delete(lambda: self._kept.release(self._seen))

    def hold(self) -> None:
        """Claim the name. If another open page has it (a duplicated tab), continue under a new name."""
        if not self._kept.hold(self.name, self._seen):
            self.name, self._text = self._kept.new_name(), ""
            self._kept.hold(self.name, self._seen)
            self.save()

    def save(self) -> None:
        """Save the page's state if it has changed, and update the address."""
        if self._write() and not self._left:
            self.replace()

    def _write(self) -> bool:
        state = self._page.state()
        text = json.dumps(state)
        if (
            text == self._text
            or not (has_choices(state) or self._written)
            or not self._kept.hold(self.name, self._seen)
        ):
            return False
        self._text, self._written = text, True
        self._kept.put(self.name, text)
        return True

    def save_and_rename(self) -> None:
        """Save the state and continue under a new name, because another input may be opened."""
        state = self._page.state()
        if self._left or not (state["source"] or state["job"] or state["parts"]):
            return
        self.save()
        self._left, self.name, self._text = self.name, self._kept.new_name(), ""
        self._kept.hold(self.name, self._seen)

    def stay(self) -> None:
        """Return to the previous name, because no other input was opened."""
        if self._left:
            self._kept.drop(self.name)
            self.name, self._left, self._text = self._left, "", ""

    def settle(self) -> None:
        """Update the address. If another input was opened, add a step to the browser's history."""
        self.save()
        if self._left:
            self._left = ""
            self.push()
        else:
            self.replace()

    def newest(self) -> KeptState | None:
        """Return the state that is saved under the initial name, or None."""
        return self._kept.get(self._initial_name)

    def take(self, name: str) -> KeptState | None:
        """Continue under another name; return the state that is saved under it, or None."""
        state = self._kept.get(name)
        if state is None:
            return None
        self._write()
        self.name, self._text, self._written, self._left = name, "", True, ""
        self.hold()
        return state

    def push(self) -> None:
        """Add the current address as a step to the browser's history."""
        self._put("pushState")

    def record_address(self, address: dict[str, Any]) -> None:
        """Record the browser's current address, so that it is not sent again."""
        self._address = _address({key: str(address.get(key, "")) for key in ("page", "view", "job")})

    def replace(self) -> None:
        """Replace the URL that the browser shows if the new one differs."""
        if self.address != self._address:
            self._put("replaceState")

    def _put(self, step: str) -> None:
        self._address = self.address
        if self._history is not None:
            self._history.step(step, self._address)

    @property
    def address(self) -> str:
        """Address of the page in its current state."""
        page, job = self._page, self._page.view.job
        query = {
            "page": self.name if self._written else "",
            "view": "" if page.shown in ("", "work") else page.shown,
            "job": job or "",
        }
        return _address(query)


def _address(query: dict[str, str]) -> str:
    return "/?" + urlencode({key: word for key, word in query.items() if word})
