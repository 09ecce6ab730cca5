"""Engraving as a process: what it takes, how it is run, what its form shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from leafcut.options import JobOptions, MachineOptions, ReadOptions
from leafcut.processes.base import ORDERED, PLACE, POST, SEARCH, SEARCH_MORE, WRITTEN, Process, all_of, use
from leafcut_engrave.options import EngraveOptions

if TYPE_CHECKING:
    from leafcut.model.outcome import Outcome
    from leafcut.model.part import Part
    from leafcut.options import Settings
    from leafcut.processes.course import Run
    from leafcut.read.format import Source
    from leafcut_engrave.model import EngravingDetail


class Engraving(Process):
    """Lines and curves of a drawing, engraved where they are drawn."""

    name = "engrave"
    title = "engraving"
    command = "engrave"
    help = "Engrave the lines of a drawing."
    asked_as = ("engrave",)
    asks = "engrave"
    reads = "drawing"
    formats = ("dxf", "svg")
    options = (EngraveOptions,)
    uses = use(ReadOptions, "units", "layers", *PLACE) | use(MachineOptions) | ORDERED | WRITTEN
    uses |= use(JobOptions, "depth", "clearance_height", "start_point", "end_point")
    form = (
        ("main", ("machine", "depth", *all_of(EngraveOptions))),
        ("search", SEARCH),
        ("place", (*PLACE, "clearance_height", "start_point", "end_point", "work_offset")),
        ("read", ("units", "layers")),
        ("post", (*POST, "coolant")),
        ("solve", SEARCH_MORE),
    )

    def run(self, run: Run, sources: Sequence[Source], asked: str) -> Outcome[EngravingDetail]:
        """Engrave the lines of one drawing."""
        from leafcut_engrave.run import engrave

        return engrave(run, sources[0])

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Return the lines, as they are placed."""
        from leafcut.processes.placing import placed
        from leafcut.read import read_contours

        return placed(read_contours(source, settings.read), settings.read)
