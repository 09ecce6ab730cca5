"""Drilling as a process: what it takes, how it is run, what its form shows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from leafcut.model.kinds import Head
from leafcut.options import JobOptions, MachineOptions, PostOptions, ReadOptions, Settings
from leafcut.options.condition import given
from leafcut.processes.base import CHANGES, ORDERED, PLACE, POST, SEARCH, SEARCH_MORE, WRITTEN, Process, use
from leafcut.processes.drilling.options import DrillOptions

if TYPE_CHECKING:
    from leafcut.model.outcome import Outcome
    from leafcut.model.part import Part
    from leafcut.processes.course import Run
    from leafcut.processes.drilling.model import DrillingDetail
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source

_MAIN = (
    "machine", "thickness", "depth", "tools", "material", "feed", "spindle_speed", "cycle", "peck", "clearance_height",
)  # fmt: skip
#: What the form shows of the job below its main group, around the options of drilling.
_DEPTHS = (
    "depth_to", "break_through", "hole_heights", "surface", "surface_unit", "through", "fixture",
    "fixture_file",
    "retract_height", "keep_out",
)  # fmt: skip
_REST = ("retract", "dwell", "diameter_tolerance", "centre_drill")
#: Layers of holes to drill, and how sure that makes it.
_DRILL_NAMES, _BY_NAME = ("DRILL*",), 0.93
_WAY = ("start_point", "end_point", "hole_order")


class Drilling(Process):
    """Holes and slots of a drawing, of a drill file, or of several drill files of one board."""

    name = "drill"
    title = "drilling"
    options = (DrillOptions,)
    uses = use(ReadOptions) | use(MachineOptions) | ORDERED | WRITTEN
    uses |= use(JobOptions, but=("material", "keep_order", "tool_diameter")) | use(
        JobOptions, material=(given("tools"),), diameter_tolerance=()
    )
    uses |= use(PostOptions, *CHANGES)
    otherwise = {"keep_order": "--algorithm none keeps the order of the drawing"}  # noqa: RUF012  # the protocol says that it is of the class
    helps = {  # noqa: RUF012  # the protocol says that it is of the class
        "thickness": ("thickness of the plate: the holes go through", "unknown: the holes are blind"),
        "depth": ("depth of blind holes below Z0", "from --thickness, else 1 mm (spotting)"),
        "material": ("material of the plate; it chooses among the presets of a tool library", ""),
        "feed": ("feed rate of assumed drills", "by diameter"),
        "spindle_speed": ("spindle speed of assumed drills", "20 m/min surface speed"),
    }
    command = "drill"
    help = "Drill the holes and slots of a drawing, a drill file, or several drill files of one board."
    takes = "a drawing, a drill file or a point map; several drill files make one program"
    asked_as = ("drill",)
    reads = "drawing"
    by_itself = True
    joins = "excellon"
    heads = (Head.SPINDLE,)
    pictured = "holes"
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        ("drill", (*_DEPTHS, *_REST, *_WAY)),
        (
            "read",
            (
                *("units", "layers", "min_diameter", "max_diameter", "concentric"),
                *("solid", "up", "z_zero", "strict"),
            ),
        ),
        ("place", (*PLACE, "work_offset")),
        ("post", (*POST, "coolant", *CHANGES)),
        ("solve", SEARCH_MORE),
    )

    def machine_for(self, format_name: str) -> str:
        """Return the machine for circuit boards: drill files are of boards."""
        return "pcb-drill" if format_name == self.joins else ""

    def suits(self, drawing: WholeDrawing) -> Suitability | None:
        """Say how much of the drawing is round holes."""
        from leafcut.processes.suitability import COUNTED, Suitability

        if not drawing.n_holes:
            return None
        named = drawing.named(_DRILL_NAMES)
        works = drawing.drilled, drawing.narrow
        if named and (drawing.on(named)[drawing.drilled].any() or drawing.holes_on(named)[drawing.narrow].any()):
            words = ", ".join(named)
            return Suitability(_BY_NAME, "drill_layers", {**drawing.figures, "layers": words}, *works)
        reason = "holes" if drawing.n_outlines else "only_holes"
        return Suitability(COUNTED * (1.0 - drawing.share_of_outlines), reason, drawing.figures, *works)

    def run(self, run: Run, sources: Sequence[Source], asked: str) -> Outcome[DrillingDetail]:
        """Drill the holes of all sources in one program."""
        from leafcut.processes.drilling.run import drill

        return drill(run, *sources, everything=asked == "auto")

    def reads_besides(self, settings: Settings) -> list[Path]:
        """Return the tool library, the order file, the surface and the fixture."""
        ours = settings.of(DrillOptions)
        files = (settings.job.tools, ours.hole_order, ours.surface, ours.fixture_file)
        return [file for file in files if file is not None]

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Return the holes and slots, as they are placed."""
        from leafcut.processes.placing import placed
        from leafcut.read import read

        return placed(read(source, settings.read), settings.read)
