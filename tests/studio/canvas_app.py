"""A NiceGUI page with the drawing and its program: run by a test as ``python canvas_app.py PORT``."""

from __future__ import annotations

import sys

from canvas_scenes import grid_of_holes, grid_program
from nicegui import ui
from nicegui.events import GenericEventArguments

from leafcut.studio.drawing.canvas import STATIC, Canvas
from leafcut.studio.drawing.program_text import ProgramText
from leafcut.studio.server.routes import colours_css
from leafcut.studio.wording import words


def page() -> None:
    """Lay the page."""
    for style in (colours_css(), STATIC / "drawing.css", STATIC / "program.css"):
        ui.add_css(style)
    said = ui.label("nothing").props("id=said")
    selections: list[object] = []

    def selected(event: GenericEventArguments) -> None:
        selections.append(event.args)
        said.set_text(f"{len(selections)}: {event.args}")

    texts = words("en").section("canvas")
    drawing = Canvas(words=texts, on_select=selected)
    drawing.style("width: 900px; height: 500px")
    ProgramText(drawing, texts).style("width: 400px; height: 200px")
    drawing.show(grid_of_holes(), "part")
    drawing.show(grid_program(), "after")
    ui.button("row", on_click=lambda: drawing.show_line(5)).props("id=choose")
    ui.button("deselect", on_click=drawing.clear_selection).props("id=deselect")
    ui.button("clear", on_click=drawing.clear).props("id=clear")


ui.page("/")(page)
ui.run(host="127.0.0.1", port=int(sys.argv[1]), show=False, reload=False, title="leafcut", show_welcome_message=False)
