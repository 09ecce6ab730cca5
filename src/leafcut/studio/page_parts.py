"""What a panel asks of its page, and of the panels beside it: so that no panel has to know the page that holds it."""

from __future__ import annotations

from typing import Any, Protocol

from nicegui.elements.mixins.text_element import TextElement

from leafcut.studio.canvas import Canvas
from leafcut.studio.history import JobRecord
from leafcut.studio.page_state import View
from leafcut.studio.preview import Seen
from leafcut.studio.sheets import SheetOfNest


class InputPart(Protocol):
    """Where the input and its options are chosen."""

    def draw(self) -> None:
        """Show the input and the options as they stand."""

    def draw_pace(self) -> None:
        """Show how fast a search goes that is studied."""

    def ready(self, ready: bool) -> None:
        """Let a run be begun, or not."""

    async def look(self, view: View, work: str) -> tuple[Seen | None, str, bool]:
        """Return what there is to see of an input, a complaint, and whether nothing newer was asked for meanwhile."""

    async def read(self, work: str) -> bool:
        """Read the input for a kind of work; return whether it could be read."""

    async def open(self, source: str, name: str) -> None:
        """Take another input."""

    async def cut(self, sheet: SheetOfNest) -> None:
        """Take a nested sheet as the input."""


class EditPart(Protocol):
    """Where an order is changed by hand."""

    def begin(self, record: JobRecord) -> Any:
        """Open the order of a job."""


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

    def draw(self) -> None:
        """Show what there is to see."""


class ResultPart(Protocol):
    """Where the answer of a run is shown."""

    def draw(self) -> None:
        """Show it as it stands."""


class PageParts(Protocol):
    """The page as its panels see it."""

    @property
    def said(self) -> TextElement:
        """The line in which a person is told something."""

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

    def remember(self) -> None:
        """Put the job into the address."""

    async def open_job(self, job: str, sheet: tuple[int, int] = (1, 1)) -> None:
        """Show a job."""
