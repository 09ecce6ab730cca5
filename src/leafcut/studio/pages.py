"""The pages of the studio, in NiceGUI."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

if TYPE_CHECKING:
    from fastapi import FastAPI

    from leafcut.studio.app import Studio


def add_pages(app: FastAPI, studio: Studio) -> None:
    """Add the pages of a studio to its server."""

    @ui.page("/", title="leafcut studio")
    def work() -> None:
        ui.label("hello")
        ui.select(["a", "b"], value="a", label="x")
        ui.button("x", on_click=lambda: ui.notify("clicked"))

    ui.run_with(app, title="leafcut studio", tailwind=False, gzip_middleware_factory=None, show_welcome_message=False)
