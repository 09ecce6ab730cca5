"""Options of the figures that a sheet is cut with: where they are looked up, or what they are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.option_spec import OptionGroup, option


@dataclass(frozen=True)
class CutDataOptions(OptionGroup):
    """What cuts the sheet, and how fast: of a cut chart, or of one's own.

    The material and its thickness are those of `JobOptions`.
    """

    section: ClassVar[str] = "cut_data"
    title: ClassVar[str] = "Cutting data"

    cut_process: str | None = option(
        "text",
        None,
        "plasma, laser, oxyfuel or waterjet, or a name of the cut chart such as laser_fiber_3kW",
        default_words="what the machine is, else plasma",
    )
    amps: float | None = option(
        "number",
        None,
        "current, where the chart has several",
        minimum=0,
        default_words="the fastest of the chart that pierces the sheet",
    )
    chart: Path | None = option(
        "path",
        None,
        "your own cut chart, a CSV file",
        default_words="the shipped one",
    )
    cut_speed: float | None = option(
        "quantity",
        None,
        "cutting speed",
        unit="mm/s",
        minimum=0.01,
        default_words="the chart's",
    )
