"""Options of drilling."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.options.job import CYCLES
from leafcut.options.option_spec import OptionGroup, option, when_given


@dataclass(frozen=True)
class DrillOptions(OptionGroup):
    """Options for the conversion of holes to drilling operations.

    `JobOptions` contains the depth, thickness, heights, clamps, and the first and last point.
    """

    section: ClassVar[str] = "drill"
    title: ClassVar[str] = "Drilling"

    depth_to: str = option(
        "text",
        "shoulder",
        "depth reference: full diameter (shoulder) or drill point (tip)",
        choices=("shoulder", "tip"),
        of_file=True,
    )
    surface: Path | None = option(
        "path",
        None,
        "STL or STEP file of the part or its blank, with the origin of the drawing: each hole starts at this surface, "
        "and travel moves are as low as the surface allows",
        default_words="flat",
        of_file=True,
    )
    surface_unit: str = option(
        "text",
        "mm",
        "unit of the STL files",
        choices=("mm", "in", "cm", "m"),
        needs=(when_given("surface"),),
        of_file=True,
    )
    fixture: Path | None = option(
        "path",
        None,
        "STL or STEP file of the fixture, such as clamps or a vise, with the origin of the surface; rapids pass over "
        "the fixture",
        default_words="none",
        needs=(when_given("surface"),),
        of_file=True,
    )
    cycle: str | None = option(
        "text",
        None,
        "drilling cycle for tools without one in the library",
        choices=CYCLES,
        default_words="G83 with --peck, G82 with --dwell, else G81",
    )
    peck: float | None = option(
        "quantity",
        None,
        "peck depth (Q of G83 and G73) for tools without one in the library",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="no pecking",
    )
    dwell: float | None = option(
        "quantity",
        None,
        "dwell at the bottom (P of G82) for tools without one in the library",
        unit="s",
        minimum=0,
        maximum=100,
        default_words="none",
    )
    centre_drill: bool = option(
        "flag", False, "centre-drill every hole first, with the library's centre drill", needs=(when_given("tools"),)
    )
