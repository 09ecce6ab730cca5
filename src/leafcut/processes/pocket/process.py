"""Milling pockets as a process: what it takes, how it is run, what its form shows."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from leafcut.model.kinds import Head
from leafcut.options import (
    FeedOptions,
    FireflyOptions,
    JobOptions,
    MachineOptions,
    PocketDrawingOptions,
    ReadOptions,
    Settings,
    SheetOptions,
    SpeedOptions,
)
from leafcut.options.condition import given
from leafcut.options.search import FIREFLIES
from leafcut.processes.base import ORDERED, PLACE, POST, SEARCH, SEARCH_MORE, WRITTEN, Process, all_of, use
from leafcut.processes.pocket.options import PocketOptions

if TYPE_CHECKING:
    from leafcut.model.outcome import Outcome
    from leafcut.model.part import Part
    from leafcut.processes.job import Job
    from leafcut.processes.pocket.model import PocketDetail
    from leafcut.processes.suitability import Suitability, WholeDrawing
    from leafcut.read.format import Source

_MAIN = (
    "machine", "tools", "tool_diameter", "depth", "strategy", "step_over", "step_down", "entry", "feed", "outline",
    "pixel_size",
)  # fmt: skip
#: How sure layers make it that are named as pockets are, and how sure it is without.
_BY_NAME, _UNNAMED = 0.98, 0.01
_PLACES = ("clearance_height", "retract_height", "start_point", "end_point", "work_offset")


class Pocketing(Process):
    """Pockets with islands, of a drawing or of a picture."""

    name = "pocket"
    title = "milling pockets"
    options = (PocketOptions,)
    uses = use(ReadOptions, "units", "layers", "solid", "up", "z_zero", *PLACE, "strict") | use(
        SheetOptions, "join_tolerance", "open_paths"
    )
    uses |= use(FeedOptions) | use(SpeedOptions, max_power=(given("feeds"),))
    uses |= use(PocketDrawingOptions) | use(MachineOptions) | use(JobOptions, but=("keep_order",)) | ORDERED | WRITTEN
    #: Whatever the algorithm is, fireflies may order the grid: every strategy is tried.
    uses |= {name: tuple(one for one in needs if one != FIREFLIES) for name, needs in use(FireflyOptions).items()}
    helps = {  # noqa: RUF012  # the protocol says that it is of the class
        "depth": ("depth of the pockets below Z0", "must be given"),
        "thickness": ("thickness of the plate, for pockets through it", "unknown"),
        "material": ("material of the part; it sets the speed of an assumed end mill", ""),
        "feed": ("feed rate of the end mill", "from the tool library"),
        "spindle_speed": ("spindle speed of the end mill", "from the tool library or --material"),
        "tools": ("tool library: TOML, LinuxCNC .tbl, Fusion .json or .tools, FreeCAD .fctl, a table .csv", "none"),
    }
    command = "pocket"
    help = "Mill the pockets of a drawing or a picture."
    takes = "a drawing or a picture"
    asked_as = ("pocket",)
    reads = "drawing"
    by_itself = True
    asks = "pocket"
    heads = (Head.SPINDLE,)
    pictured = "areas"
    form = (
        ("main", _MAIN),
        ("search", SEARCH),
        ("pocket", (*all_of(PocketOptions, _MAIN), *all_of(PocketDrawingOptions, _MAIN), "spindle_speed", "material")),
        ("pace", ("feeds", "max_power")),
        ("place", (*PLACE, *_PLACES)),
        ("read", ("units", "layers", "solid", "up", "z_zero", "join_tolerance", "strict")),
        ("post", (*POST, "coolant")),
        ("solve", SEARCH_MORE),
    )

    def suits(self, drawing: WholeDrawing) -> Suitability | None:
        """Say whether layers are named as pockets and islands are: what is drawn otherwise may be anything."""
        from leafcut.processes.suitability import Suitability
        from leafcut.read.pocket_outlines import ISLAND_NAMES, POCKET_NAMES

        named = drawing.named((*POCKET_NAMES, *ISLAND_NAMES))
        if named:
            words = ", ".join(named)
            on = drawing.on(named) & drawing.worked, drawing.holes_on(named)
            return Suitability(_BY_NAME, "pocket_layers", {**drawing.figures, "layers": words}, *on)
        closed = drawing.worked & drawing.closed, drawing.part.diameters > 0.0
        return Suitability(_UNNAMED, "outlines", drawing.figures, *closed) if drawing.n_outlines else None

    def run(self, run: Job, sources: Sequence[Source], asked: str) -> Outcome[PocketDetail]:
        """Clear the pockets of a drawing."""
        from leafcut.processes.pocket.run import pocket

        return pocket(run, sources[0])

    def reads_besides(self, settings: Settings) -> list[Path]:
        """Return the file of the material."""
        named = settings.job.material
        return [Path(named)] if JobOptions.specs()["material"].names_file(named) else []

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Return the pockets, as they are placed."""
        from leafcut.processes.placing import placed
        from leafcut.read import read_pockets

        return placed(read_pockets(source, settings.read, settings.pocket_drawing, settings.sheet), settings.read)
