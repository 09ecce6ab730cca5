"""Interfaces of the page and its panels, so that panels do not depend on the page class."""

from __future__ import annotations

from collections.abc import Awaitable
from typing import Any, Protocol

from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement

from leafcut.studio.drawing.canvas import Canvas
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.jobs.preview import Preview
from leafcut.studio.jobs.sheets import SheetOfNest
from leafcut.studio.jobs.task import Task
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_reading import PreviewReading


class InputPart(Protocol):
    """Panel with the input and its options."""

    @property
    def reading(self) -> bool:
        """Whether an input is being read or waits to be read."""

    @property
    def newest(self) -> PreviewReading | None:
        """The current reading."""

    def draw(self) -> None:
        """Update the input and the options."""

    def draw_pace(self) -> None:
        """Update the speed of a studied search."""

    def ready(self, ready: bool) -> None:
        """Enable or disable the run button."""

    async def read_preview(self, view: View, work: str) -> tuple[Preview | None, str, bool]:
        """Return the preview of an input, an error, and whether no newer request was made meanwhile."""

    def cancel(self) -> None:
        """Cancel the reading."""

    async def read(self, work: str) -> bool:
        """Read the input for a kind of work; return whether it succeeded."""

    def open(self, source: str, name: str) -> Awaitable[None]:
        """Open another input."""

    def move_zero(self, x: float, y: float) -> Any:
        """Move program zero by a distance in mm."""

    def scale_picture(self, width: str) -> Any:
        """Set the pixel size of the open picture from its width."""

    async def restore(self, task: Task) -> bool:
        """Restore the choices of a task; return False if the user chose something else meanwhile."""

    def page_run(self) -> None:
        """Start the run, or show what is missing."""

    async def cut(self, sheet: SheetOfNest) -> None:
        """Open a nested sheet as the input."""


class EditPart(Protocol):
    """Panel for manual changes of the order."""

    def start(self, record: JobRecord) -> Any:
        """Open the order of a job."""

    def write(self) -> None:
        """Run with the edited order."""

    def kept(self) -> dict[str, Any] | None:
        """Return the edited order as plain values."""

    def hold(self, kept: dict[str, Any] | None) -> None:
        """Store the result of `kept` for `resume`."""

    def resume(self) -> None:
        """Restore the stored order."""


class RunPart(Protocol):
    """Panel that starts a run and shows its drawing."""

    @property
    def canvas(self) -> Canvas:
        """The drawing."""

    @property
    def edit(self) -> EditPart:
        """Panel for manual changes of the order."""

    @property
    def running(self) -> bool:
        """Whether a run is in progress."""

    @property
    def watching(self) -> bool:
        """Whether a run is shown that may still be in progress."""

    def start(self) -> None:
        """Start a run with the current choices."""

    def watch(self) -> None:
        """Show the job of the page."""

    def leave(self) -> None:
        """Stop showing a job."""

    def resume(self) -> None:
        """Show the current state of the page again."""

    def tell_earlier(self, line: str) -> None:
        """Show a notice that the drawing belongs to earlier choices; empty for none."""

    def draw(self) -> None:
        """Update the drawing."""


class ResultPart(Protocol):
    """Panel that shows the answer of a run."""

    def draw(self) -> None:
        """Update the answer."""

    def arrive(self, record: JobRecord) -> None:
        """Show a new answer."""

    def kept(self) -> tuple[str, Preview | None]:
        """Return the selected tab, and the program shown when it was opened."""

    def show_again(self, kept: tuple[str, Preview | None]) -> None:
        """Restore the display from before another input was tried."""


class PageParts(Protocol):
    """Interface of the page for its panels."""

    @property
    def message_line(self) -> TextElement:
        """Line for messages to the user."""

    @property
    def progress_place(self) -> Element:
        """Element for the progress of a run."""

    @property
    def input(self) -> InputPart:
        """Panel with the input."""

    @property
    def run(self) -> RunPart:
        """Panel that starts and shows a run."""

    @property
    def result(self) -> ResultPart:
        """Panel with the answer."""

    def show_message(self, line: str, bad: bool = False, stays: bool = False) -> None:
        """Show a message in a line above the page."""

    def announce(self, line: str) -> None:
        """Announce a message to screen readers."""

    def changed(self) -> None:
        """Handle a changed choice."""

    def begin_other(self) -> None:
        """Save the choices for Back, as another input may be opened."""

    def stay(self) -> None:
        """Continue with the current input, as no other was opened."""

    def remember(self) -> None:
        """Update the address with the page and its job."""

    async def open_job(self, job: str, sheet: tuple[int, int] = (1, 1)) -> None:
        """Show a job."""
