"""The room of the studio that contains the experiments."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from leafcut.studio.folder import Folder
from leafcut.studio.lab.runs import LabRuns

if TYPE_CHECKING:
    from fastapi import APIRouter

    from leafcut.studio.lab.panel import LabPanel
    from leafcut.studio.page.pages import Page
    from leafcut.studio.studio import Studio


class LabRoom:
    """The experiments and their view."""

    name, key = "lab", "5"
    styles: tuple[str, ...] = ()
    modules: tuple[str, ...] = ()

    def __init__(self, folder: Folder) -> None:
        self.runs = LabRuns(folder)

    def add_routes(self, routes: APIRouter, studio: Studio) -> None:
        """Add the routes for reports and runs."""
        from leafcut.studio.lab.routes import add_lab

        add_lab(routes, self.runs)

    def open(self, page: Page, client: Any) -> LabPanel:
        """Create the view in the current container."""
        from leafcut.studio.lab.panel import LabPanel

        return LabPanel(page.view, page, self.runs)

    def add_bar(self, page: Page) -> Callable[[], None]:
        """Do nothing, because other views do not show any experiments."""
        return lambda: None

    def close(self) -> None:
        """Stop the running experiment, and wait until it has ended."""
        self.runs.close()
