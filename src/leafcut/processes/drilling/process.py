"""Drilling as a process: what it takes, how it is run, what its form shows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.options import DrillOptions, Settings
from leafcut.processes.base import PLACE, POST, SEARCH, SEARCH_MORE, Process, all_of
from leafcut.processes.course import Run
from leafcut.processes.drilling.model import DrillingDetail

if TYPE_CHECKING:
    from leafcut.read.format import Source

_MAIN = ("machine", "thickness", "depth", "tools", "retract", "peck")


class Drilling(Process):
    """Holes and slots of a drawing, of a drill file, or of several drill files of one board."""

    name = "drill"
    asked_as = ("drill",)
    reads = "drawing"
    by_itself = True
    joins = "excellon"
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        ("drill", all_of(DrillOptions, _MAIN)),
        ("read", ("units", "layers", "min_diameter", "max_diameter", "merge_tolerance", "concentric", "strict")),
        ("place", (*PLACE, "work_offset")),
        ("post", (*POST, "coolant")),
        ("solve", SEARCH_MORE),
    )

    def run(self, run: Run, sources: Sequence[Source], asked: str) -> Outcome[DrillingDetail]:
        """Drill the holes of all sources in one program."""
        from leafcut.processes.drilling.run import drill

        return drill(run, *sources)

    def reads_besides(self, settings: Settings) -> list[Path]:
        """Return the tool library and the order file."""
        return [file for file in (settings.drill.tools, settings.drill.hole_order) if file is not None]

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Return the holes and slots, as they are placed."""
        from leafcut.processes.placing import placed
        from leafcut.read import read

        return placed(read(source, settings.read), settings.read)
