"""The room of the studio in which users control a machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from leafcut.studio.control.link import MachineLink

if TYPE_CHECKING:
    from fastapi import APIRouter

    from leafcut.studio.control.panel import MachinePanel
    from leafcut.studio.page.pages import Page
    from leafcut.studio.studio import Studio


class ControlRoom:
    """The connection to a machine, with its view and with the Stop bar that every page shows."""

    name, key = "control", "6"
    styles: tuple[str, ...] = ("machine.css",)
    modules: tuple[str, ...] = ("machine_stop.js",)

    def __init__(self) -> None:
        self.link = MachineLink()

    def add_routes(self, routes: APIRouter, studio: Studio) -> None:
        """Add the route for the Stop bar. Any valid key may use it, even if another page has control."""

        @routes.post("/machine/stop", summary="Stop the machine: hold, wait for standstill, reset; the spindle is off")
        async def stop() -> dict[str, str]:
            self.link.stop_machine()
            return {"stop": "sent"}

    def open(self, page: Page, client: Any) -> MachinePanel:
        """Create the machine view in the current container."""
        from leafcut.studio.control.panel import MachinePanel

        return MachinePanel(page.view, page, client, self.link)

    def add_bar(self, page: Page) -> Callable[[], None]:
        """Add the Stop bar to a page. Return the function that updates the bar."""
        from leafcut.studio.control.panel import StopBar

        return StopBar(page.view, self.link).tick

    def close(self) -> None:
        """Stop the machine and disconnect."""
        self.link.close()
