"""Putting a program in order as a process: what it takes, how it is run, what its form shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from leafcut.files import check_is_text
from leafcut.model.outcome import Outcome
from leafcut.model.part import Part
from leafcut.options import Settings
from leafcut.processes.base import SEARCH, SEARCH_MORE, Process
from leafcut.processes.course import Run
from leafcut.processes.program.model import ProgramDetail

if TYPE_CHECKING:
    from leafcut.read.format import Source


class ForeignProgram(Process):
    """A G-code program of any CAM."""

    name = "program"
    asked_as = ("drill", "mill", "laser", "plasma")
    reads = "program"
    by_itself = True
    instead = {  # noqa: RUF012  # the protocol says that it is of the class
        "cut": "this is a program; of a program, say what it does: laser or plasma",
        "pocket": "this is a program; of a program, say what it does: mill",
    }
    form = (
        ("main", ("machine", "merge_tools", "mix_operations", "allow_reverse", "keep_order")),
        ("search", SEARCH),
        ("post", ("dialect", "renumber", "units", "cut_speed")),
        ("place", ("start_point", "work_offset", "keep_out", "clearance_height", "tools")),
        ("read", ("strict",)),
        ("solve", SEARCH_MORE),
    )

    def run(self, run: Run, sources: Sequence[Source], asked: str) -> Outcome[ProgramDetail]:
        """Put a program in order."""
        from leafcut.processes.program.run import resequence

        (source,) = sources
        check_is_text(source.path, source.data)
        return resequence(run, source.path, source.data, asked)

    def look_at(self, source: Source | str, settings: Settings) -> Part:
        """Refuse: a program has motions, and no drawing."""
        from leafcut.read import read

        return read(source, settings.read)
