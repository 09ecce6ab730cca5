"""`Studio` contains the state that the parts of the server share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol
from weakref import WeakValueDictionary

from leafcut.studio.folder import Folder
from leafcut.studio.jobs.history import History
from leafcut.studio.jobs.jobs import Jobs
from leafcut.studio.jobs.workers import StudioWorkers
from leafcut.studio.keys import StudioKeys, read_or_create_secret
from leafcut.studio.recent_files import RecentFiles

HOST, PORT = "127.0.0.1", 8173
#: Content security policy for a static document, such as a report. It forbids scripts and external files.
STILL_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; sandbox; frame-ancestors 'none'"


class Room(Protocol):
    """A view in a separate package. The package is loaded when the view is first shown.

    Attributes
    ----------
    name, key
        Name of the view and its key.
    styles, modules
        Static files that every page loads.
    """

    name: str
    key: str
    styles: tuple[str, ...]
    modules: tuple[str, ...]

    def add_routes(self, routes: Any, studio: Studio) -> None:
        """Add the routes of this room to an `APIRouter`."""

    def open(self, page: Any, client: Any) -> Any:
        """Create the view of this room for a `Page` in the current container. Return it as a `RoomView`."""

    def add_bar(self, page: Any) -> Callable[[], None]:
        """Add the elements of this room that every page shows. Return the function that updates them."""

    def close(self) -> None:
        """Stop everything that this room is doing."""


@dataclass(frozen=True)
class Studio:
    """The state that all parts of the server share."""

    folder: Folder
    history: History
    jobs: Jobs
    workers: StudioWorkers
    keys: StudioKeys
    port: int
    recent: RecentFiles
    #: The rooms by name. They are closed in this order.
    rooms: dict[str, Room] = field(default_factory=dict)
    #: The open pages (`page.pages.Page`), by the names of their steps in the browser's history.
    open_pages: WeakValueDictionary[str, Any] = field(default_factory=WeakValueDictionary)

    def close(self) -> None:
        """Stop all activities. The rooms stop first."""
        for room in self.rooms.values():
            room.close()
        self.jobs.close()
        self.workers.close()

    def address(self, key: str) -> str:
        """Return the address that opens the page with a key from `StudioKeys.new_entry`."""
        return f"http://{HOST}:{self.port}/?token={key}"

    @property
    def token_file(self) -> Path:
        """File with the token for programs of the same user. The file exists while the studio is running."""
        return self.folder.root / "token"

    @property
    def entrance(self) -> Path:
        """HTML page that redirects this user's browser to the studio."""
        return self.folder.root / "open.html"


def open_studio(root: Path, port: int = PORT, workers: StudioWorkers | None = None) -> Studio:
    """Open the studio's folder and its history, and mark unfinished jobs as interrupted.

    `workers` replaces the studio's own processes. Raises `OutputError` if the folder or the history cannot be written.
    """
    folder = Folder(root)
    history = History(root / "history.sqlite")
    history.mark_unfinished_interrupted()
    recent = RecentFiles(folder)
    open_pages: WeakValueDictionary[str, Any] = WeakValueDictionary()

    def kept() -> set[str]:
        return recent.files_in_use().union(*(page.files_in_use() for page in list(open_pages.values())))

    folder.delete_unused_inputs(history.inputs_in_use() | kept())
    workers = workers or StudioWorkers(root / "temporary")
    jobs, keys = Jobs(folder, history, workers, kept), StudioKeys(read_or_create_secret(root))
    return Studio(folder, history, jobs, workers, keys, port, recent, open_pages=open_pages)
