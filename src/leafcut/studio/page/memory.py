"""What a page has chosen, kept under a name that stands in its address: reload, Back and a new start find it again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import urlencode

from nicegui import Client

from leafcut.studio.kept_pages import KeptPages
from leafcut.studio.page.elements import Address
from leafcut.studio.page.kept_state import KeptState
from leafcut.studio.page.page_state import View

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable


class Remembered(Protocol):
    """What of a page is kept."""

    @property
    def view(self) -> View:
        """Its choices."""

    @property
    def shown(self) -> str:
        """Which of its views is shown."""

    def state(self) -> KeptState:
        """Return what it has chosen."""


class Memory:
    """The name of a page, what is kept under it, and its address.

    A page that opens another file or another job goes on under another name: Back then leads to what was there before.
    """

    def __init__(self, page: Remembered, kept: KeptPages, name: str = "") -> None:
        self._page, self._kept = page, kept
        known = kept.get(name) is not None
        self.name = self._begun = name if known else kept.new_name()
        #: What was written last, and whether anything was.
        self._text = ""
        self._written = known
        #: The name that was left for another input, until it is known that there is one.
        self._left = ""
        self._address = ""
        self._seen: Callable[[], bool] = lambda: False
        self._history: Address | None = None

    def watch(self, client: Client, went: Callable[[dict[str, Any], bool], Awaitable[None]]) -> None:
        """Follow a page's browser: hold the name while the page is seen, and go where Back leads."""
        self._history = Address(went)
        self._seen = lambda: client.has_socket_connection
        client.on_connect(self.hold)
        client.on_delete(lambda: self._kept.let_go(self._seen))

    def hold(self) -> None:
        """Take the name; where another page that is seen has it, as a tab that was doubled, go on under another one."""
        if not self._kept.hold(self.name, self._seen):
            self.name, self._text = self._kept.new_name(), ""
            self._kept.hold(self.name, self._seen)
            self.save()

    def save(self) -> None:
        """Write what the page has chosen, if that is something new, and put its name into the address."""
        if self._write() and not self._left:
            self.replace()

    def _write(self) -> bool:
        """Write what the page has chosen; return whether that is something new."""
        state = self._page.state()
        text = state.as_json()
        if text == self._text or not (state.chosen or self._written) or not self._kept.hold(self.name, self._seen):
            return False
        self._text, self._written = text, True
        self._kept.put(self.name, text)
        return True

    def begin_other(self) -> None:
        """Keep what is chosen, and go on under another name: another input may come."""
        state = self._page.state()
        if self._left or not (state.source or state.job or state.parts):
            return
        self.save()
        self._left, self.name, self._text = self.name, self._kept.new_name(), ""
        self._kept.hold(self.name, self._seen)

    def stay(self) -> None:
        """Go on under the name that was left: no other input has come."""
        if self._left:
            self._kept.drop(self.name)
            self.name, self._left, self._text = self._left, "", ""

    def settle(self) -> None:
        """Put the page into the address: as another step of the browser's history where another input has come."""
        self.save()
        if self._left:
            self._left = ""
            self.push()
        else:
            self.replace()

    def newest(self) -> KeptState | None:
        """Return what is kept under the name that was begun with; None where nothing is."""
        found = self._kept.get(self._begun)
        return None if found is None else KeptState.from_json(found)

    def take(self, name: str) -> KeptState | None:
        """Return what is kept under another name, and go on under that; None where nothing is."""
        found = self._kept.get(name)
        if found is None:
            return None
        self._write()
        state = KeptState.from_json(found)
        self.name, self._text, self._written, self._left = name, "", True, ""
        self.hold()
        return state

    def push(self) -> None:
        """Make another step in the browser's history."""
        self._put("pushState")

    def stands(self, said: dict[str, Any]) -> None:
        """Note what the browser's address says by now; it is not told again what it says already."""
        self._address = _address({key: str(said.get(key, "")) for key in ("page", "view", "job")})

    def replace(self) -> None:
        """Put the page into the address in place of what stands there."""
        if self.address != self._address:
            self._put("replaceState")

    def _put(self, step: str) -> None:
        self._address = self.address
        if self._history is not None:
            self._history.step(step, self._address)

    @property
    def address(self) -> str:
        """The address that leads here."""
        page, job = self._page, self._page.view.job
        said = {
            "page": self.name if self._written else "",
            "view": "" if page.shown in ("", "work") else page.shown,
            "job": job or "",
        }
        return _address(said)


def _address(said: dict[str, str]) -> str:
    return "/?" + urlencode({key: word for key, word in said.items() if word})
