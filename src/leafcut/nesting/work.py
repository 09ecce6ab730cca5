"""Nesting as a type of work, with its options and its form."""

from __future__ import annotations

from typing import TYPE_CHECKING

from leafcut.model.kinds import Head
from leafcut.nesting.options import NestOptions
from leafcut.options import CutDataOptions, MachineOptions, ReadOptions, Settings, SheetOptions, SolveOptions
from leafcut.processes.base import Work, option_names, use
from leafcut.processes.cutting_machines import with_default_cutting_machine

if TYPE_CHECKING:
    from leafcut.model.part import Part
    from leafcut.read.format import Source

_MAIN = ("sheet", "kerf", "gap", "margin", "rotations")


class Nesting(Work):
    """Nesting of parts in given quantities on sheets."""

    name = command = "nest"
    title = "nesting"
    options = (NestOptions,)
    uses = (
        use(ReadOptions, "units", "layers", "concentric", "solid", "strict", up=())
        | use(SheetOptions)
        | use(MachineOptions, "machine")
    )
    uses |= use(CutDataOptions, "cut_process", "kerf")
    uses |= use(SolveOptions, "preset", "time_limit", "iterations", "seed", "threads")
    otherwise = {"quantity": "write the number after the drawing, such as bracket.dxf:20"}  # noqa: RUF012  # `Work` declares it as a class variable
    helps = {  # noqa: RUF012  # `Work` declares it as a class variable
        "concentric": ("which of several concentric circles to cut as a hole", ""),
        "kerf": ("", "2mm"),
    }
    help = "Nest parts on sheets, in several variants, and write the best nest as DXF for cutting."
    heads = tuple(head for head in Head if head.method is not None)
    form = (
        ("main", _MAIN),
        ("search", ("variants", "preset", "time_limit")),
        ("nest", (*option_names(NestOptions, (*_MAIN, "variants", "remnants_out")), "machine")),
        ("sheet", option_names(SheetOptions)),
        ("read", ("units", "layers", "concentric", "solid", "up", "strict")),
        ("solve", ("iterations", "seed", "threads")),
    )

    def with_defaults(self, settings: Settings) -> Settings:
        """Return the settings of the process that will cut the nested sheets."""
        return with_default_cutting_machine(settings)

    def preview_part(self, source: Source | str, settings: Settings) -> Part:
        """Return the contours as they are drawn. Nesting decides on their positions later."""
        from leafcut.read import read_contours

        return read_contours(source, settings.read)
