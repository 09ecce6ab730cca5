"""What a panel asks of its page, and of the panels beside it: so that no panel has to know the page that holds it."""

from __future__ import annotations

from collections.abc import Awaitable
from typing import Any, Protocol

from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement

from leafcut.studio.drawing.canvas import Canvas
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.jobs.sheets import SheetOfNest
from leafcut.studio.jobs.task import Task
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_reading import PreviewReading
from leafcut.studio.page.preview import Seen


class InputPart(Protocol):
    """Where the input and its options are chosen."""

    @property
    def reading(self) -> bool:
        """Whether an input is being read, or will be as soon as the page comes to it."""

    @property
    def newest(self) -> PreviewReading | None:
        """What is read now."""

    def draw(self) -> None:
        """Show the input and the options as they stand."""

    def draw_pace(self) -> None:
        """Show how fast a search goes that is studied."""

    def ready(self, ready: bool) -> None:
        """Let a run be begun, or not."""

    async def look(self, view: View, work: str) -> tuple[Seen | None, str, bool]:
        """Return what there is to see of an input, a complaint, and whether nothing newer was asked for meanwhile."""

    def cancel(self) -> None:
        """End the reading."""

    async def read(self, work: str) -> bool:
        """Read the input for a kind of work; return whether it could be read."""

    def open(self, source: str, name: str) -> Awaitable[None]:
        """Take another input."""

    def move_zero(self, x: float, y: float) -> Any:
        """Put program zero elsewhere, mm from where it is."""

    async def restore(self, task: Task) -> bool:
        """Choose what a task has; return False if something else was chosen meanwhile."""

    def page_run(self) -> None:
        """Begin the run, or say what it lacks."""

    async def cut(self, sheet: SheetOfNest) -> None:
        """Take a nested sheet as the input."""


class EditPart(Protocol):
    """Where an order is changed by hand."""

    def begin(self, record: JobRecord) -> Any:
        """Open the order of a job."""

    def write(self) -> None:
        """Run with the order as it is."""

    def kept(self) -> dict[str, Any] | None:
        """Return the order that is changed, as plain values."""

    def hold(self, kept: dict[str, Any] | None) -> None:
        """Note what `kept` returned."""

    def resume(self) -> None:
        """Go on with what was noted."""


class RunPart(Protocol):
    """Where a run is begun, and its drawing is shown."""

    @property
    def canvas(self) -> Canvas:
        """The drawing."""

    @property
    def edit(self) -> EditPart:
        """Where its order is changed."""

    @property
    def running(self) -> bool:
        """Whether a run goes on."""

    @property
    def watching(self) -> bool:
        """Whether a run is looked at that may go on."""

    def begin(self) -> None:
        """Begin a run of what is chosen."""

    def watch(self) -> None:
        """Look at the job of the page."""

    def leave(self) -> None:
        """Show no job any more."""

    def resume(self) -> None:
        """Show again what the page is at."""

    def tell_earlier(self, line: str) -> None:
        """Say over the drawing that it is of earlier choices; nothing where it is not."""

    def draw(self) -> None:
        """Show what there is to see."""


class ResultPart(Protocol):
    """Where the answer of a run is shown."""

    def draw(self) -> None:
        """Show it as it stands."""

    def arrive(self, record: JobRecord) -> None:
        """Show one that is new."""

    def kept(self) -> tuple[str, Seen | None]:
        """Return which tab is in front, and which program was shown as soon as it was opened."""

    def show_again(self, kept: tuple[str, Seen | None]) -> None:
        """Show what stood there before another input was tried."""


class PageParts(Protocol):
    """The page as its panels see it."""

    @property
    def said(self) -> TextElement:
        """The line in which a person is told something."""

    @property
    def progress_place(self) -> Element:
        """Where it is shown how far a run is."""

    @property
    def input(self) -> InputPart:
        """Where the input is chosen."""

    @property
    def run(self) -> RunPart:
        """Where a run is begun and seen."""

    @property
    def result(self) -> ResultPart:
        """Where its answer is shown."""

    def say(self, line: str, bad: bool = False, stays: bool = False) -> None:
        """Tell a person something, in one line over the page."""

    def announce(self, line: str) -> None:
        """Tell those who do not look at the page."""

    def changed(self) -> None:
        """Note that something was chosen."""

    def begin_other(self) -> None:
        """Keep what is chosen for Back: another input may come."""

    def stay(self) -> None:
        """Note that no other input has come."""

    def remember(self) -> None:
        """Put the page and its job into the address."""

    async def open_job(self, job: str, sheet: tuple[int, int] = (1, 1)) -> None:
        """Show a job."""
