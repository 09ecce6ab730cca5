"""The command `run_nest_command`: read parts and quantities, and write drawings of nested sheets."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path

from leafcut.files.whole_files import check_output, write_all_or_none
from leafcut.model.heartbeat import OnProgress
from leafcut.model.nest import NestOutcome
from leafcut.nesting.options import NestOptions
from leafcut.options import Settings
from leafcut.read.nest_list import WantedDrawing, read_drawings_to_nest


def run_nest_command(
    parts: Sequence[str | Path | WantedDrawing],
    output: str | Path | None,
    settings: Settings,
    *,
    other_inputs: Sequence[str | Path | None],
    progress: OnProgress | None,
    cancelled: threading.Event | None,
) -> tuple[NestOutcome, list[str | Path | None]]:
    """Nest parts and write the sheets.

    The function returns the outcome and the names of all files that were read, including `other_inputs`.
    """
    from leafcut.nesting.run import nest_and_write_drawings

    wanted = read_drawings_to_nest([part if isinstance(part, WantedDrawing) else str(part) for part in parts])
    typed = [str(part) for part in parts if not isinstance(part, WantedDrawing)]
    lists = [name for text in typed for name in (text, text.rpartition(":")[0]) if name]
    inputs = [*other_inputs, *lists, *(drawing.file for drawing in wanted)]
    check_output(output, inputs)
    options = settings.of(NestOptions)
    if options.remnants_out is not None:
        check_output(options.remnants_out / "rest.dxf", inputs)  # fail early if the folder is missing
    outcome, texts = nest_and_write_drawings(wanted, settings, output, progress=progress, cancelled=cancelled)
    sheets = [sheet.name for sheet in options.sheets if sheet.size is None]
    read = [*inputs, *sheets]
    for name in texts:
        check_output(name, read)
    write_all_or_none(texts)
    return outcome, read
