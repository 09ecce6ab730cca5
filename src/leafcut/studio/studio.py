"""`Studio`: the state that the parts of the server share."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from leafcut.studio.drafts import Drafts
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.history import History
from leafcut.studio.jobs.jobs import Jobs
from leafcut.studio.jobs.workers import StudioWorkers
from leafcut.studio.keys import StudioKeys, kept_secret
from leafcut.studio.lab_runs import LabRuns
from leafcut.studio.machine.link import MachineLink
from leafcut.studio.recent_files import RecentFiles
from leafcut.studio.saved_pages import KeptPages

HOST, PORT = "127.0.0.1", 8173


@dataclass(frozen=True)
class Studio:
    """The state that all parts of the server share."""

    folder: Folder
    history: History
    jobs: Jobs
    workers: StudioWorkers
    keys: StudioKeys
    port: int
    pages: KeptPages
    recent: RecentFiles
    lab: LabRuns
    machine: MachineLink = field(default_factory=MachineLink)

    def drafts(self, kind: str) -> Drafts:
        """Return the unsaved texts of the user's own ``machines`` or ``tools``."""
        return Drafts(self.folder, kind)

    def close(self) -> None:
        """Stop all activities, the machine first."""
        self.machine.close()
        self.lab.stop()
        self.jobs.close()
        self.workers.close()
        self.lab.close()

    def address(self, key: str) -> str:
        """Return the address that opens the page with a key from `StudioKeys.new_entry`."""
        return f"http://{HOST}:{self.port}/?token={key}"

    @property
    def token_file(self) -> Path:
        """File with the token for programs of the same user. It exists while the studio runs."""
        return self.folder.root / "token"

    @property
    def entrance(self) -> Path:
        """HTML page that redirects this user's browser to the studio."""
        return self.folder.root / "open.html"


def open_studio(root: Path, port: int = PORT, workers: StudioWorkers | None = None) -> Studio:
    """Open the studio's folder and its history. Jobs that the last shutdown interrupted are marked.

    `workers` replaces the studio's own processes. Raise `OutputError` if the folder or the history cannot be
    written.
    """
    folder = Folder(root)
    history = History(root / "history.sqlite")
    history.interrupt()
    pages, recent = KeptPages(root / "pages"), RecentFiles(folder)

    def kept() -> set[str]:
        return pages.files_in_use() | recent.files_in_use()

    folder.drop_unused(history.inputs_in_use() | kept())
    workers = workers or StudioWorkers(root / "temporary")
    jobs, keys = Jobs(folder, history, workers, kept), StudioKeys(kept_secret(root))
    return Studio(folder, history, jobs, workers, keys, port, pages, recent, LabRuns(folder))
