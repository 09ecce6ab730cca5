"""Options for the cutting data of a sheet: their source, or explicit values."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option


@dataclass(frozen=True)
class CutDataOptions(OptionGroup):
    """Cutting process and cutting data of a sheet, from a cut chart or given explicitly.

    Material and thickness are in `JobOptions`.
    """

    section: ClassVar[str] = "cut_data"
    title: ClassVar[str] = "Cutting data"

    cut_process: str | None = option(
        "text",
        None,
        "cutting process: plasma, laser, oxyfuel, waterjet, or a name in the cut chart such as laser_fiber_3kW",
        default_words="the machine's, else plasma",
    )
    amps: float | None = option(
        "number",
        None,
        "cutting current, if the chart has several",
        minimum=0,
        default_words="the fastest in the chart that can pierce the sheet",
        of_file=True,
    )
    nozzle: str | None = option(
        "text",
        None,
        "nozzle, if the chart has several",
        default_words="any in the chart",
        of_file=True,
    )
    chart: Path | None = option(
        "path",
        None,
        "cut chart of your own, a CSV file",
        default_words="leafcut's chart",
    )
    kerf: float | None = option(
        "quantity",
        None,
        "kerf width",
        unit="mm",
        minimum=0,
        maximum=50,
        default_words="the chart's; 2 mm for nesting",
    )
    cut_speed: float | None = option(
        "quantity",
        None,
        "cutting speed",
        unit="mm/s",
        minimum=0.01,
        default_words="the chart's",
        of_file=True,
    )
