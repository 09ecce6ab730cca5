"""Milling pockets as a process: what it takes, how it is run, what its form shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.options import PocketOptions, Settings
from leafcut.processes.base import PLACE, POST, SEARCH, SEARCH_MORE, Process, all_of
from leafcut.processes.course import Run
from leafcut.processes.pocket.model import PocketDetail

if TYPE_CHECKING:
    from leafcut.read.format import Source

_MAIN = ("machine", "tool_diameter", "depth", "strategy", "milling", "stock", "pixel_size")
_PLACES = ("clearance_height", "retract_height", "spindle_speed", "start_point", "end_point", "work_offset")


class Pocketing(Process):
    """Pockets with islands, of a drawing or of a picture."""

    name = "pocket"
    asked_as = ("pocket",)
    reads = "drawing"
    by_itself = True
    asks = "pocket"
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        ("pocket", ("tools", *all_of(PocketOptions, _MAIN), "material")),
        ("place", (*PLACE, *_PLACES)),
        ("read", ("units", "layers", "join_tolerance", "strict")),
        ("post", (*POST, "coolant")),
        ("solve", SEARCH_MORE),
    )

    def run(self, run: Run, sources: Sequence[Source], asked: str) -> Outcome[PocketDetail]:
        """Clear the pockets of a drawing."""
        from leafcut.processes.pocket.run import pocket

        return pocket(run, sources[0])

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Return the pockets, as they are placed."""
        from leafcut.processes.placing import placed
        from leafcut.read import read_pockets

        return placed(read_pockets(source, settings.read, settings.pocket, settings.sheet), settings.read)
