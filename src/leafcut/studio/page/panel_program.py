"""Shows the text of the opened program, of a result's program, or of two compared programs."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from leafcut.errors import LeafcutError
from leafcut.files.whole_files import read_program
from leafcut.studio.drawing.canvas import Canvas
from leafcut.studio.drawing.program_text import ProgramText, program_scene
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.page.page_state import View
from leafcut.studio.studio import Studio


def is_program(view: View) -> bool:
    """Return whether the open input is a program. Its text can be shown even before a run."""
    return bool(view.source) and view.seen is not None and view.seen.format == "gcode"


def show_opened_program(view: View, drawing: Canvas) -> None:
    """Show the open program. If the program cannot be drawn, show only its text."""
    source = view.source
    drawn = view.seen is not None and "after" in view.seen.scenes
    folder = view.studio.folder
    _add_program_text(view, drawing, None if drawn else lambda: program_scene(_input_text(folder, source)))


def show_created_program(view: View, drawing: Canvas, record: JobRecord, answer: dict[str, Any]) -> bool:
    """Show the program of a finished run. Return False if the run has no program."""
    studio, command = view.studio, record.task.command
    names = studio.history.artefacts(record.id)
    if command in ("optimize", "verify") and "lines" in names:
        _add_program_text(view, drawing, lambda: _compared_programs_scene(studio, record, answer))
    elif command == "optimize":
        _add_program_text(view, drawing, None)
    elif command == "solve" and "tour" in names:
        _add_program_text(view, drawing, lambda: program_scene(_artefact_text(studio, record, "tour")))
    elif command in ("simulate", "verify"):
        _add_program_text(view, drawing, lambda: program_scene(_input_text(studio.folder, record.task.inputs[-1])))
    else:
        return False
    return True


def _add_program_text(view: View, drawing: Canvas, source: Callable[[], bytes] | None) -> None:
    ProgramText(drawing, view.words.section("canvas"), source).classes("code")


def _compared_programs_scene(studio: Studio, record: JobRecord, answer: dict[str, Any]) -> bytes:
    inputs, verifying = record.task.inputs, record.task.command == "verify"
    new = _input_text(studio.folder, inputs[1]) if verifying else _artefact_text(studio, record, "program")
    kept = studio.history.artefact(record.id, "lines")
    pairs = np.frombuffer(zlib.decompress(kept.data), dtype=np.uint32) if kept is not None else ()
    rows = answer["differences"] if verifying else []
    lines = [pair for row in rows for pair in ((row["original"], row["new"]), *row.get("also", ()))]
    return program_scene(
        new,
        _input_text(studio.folder, inputs[0]),
        pairs,
        missing=[line for line, _ in lines if line],
        added=[line for _, line in lines if line],
        beside=verifying,
    )


def _artefact_text(studio: Studio, record: JobRecord, name: str) -> str:
    artefact = studio.history.artefact(record.id, name)
    return "" if artefact is None else artefact.text


def _input_text(folder: Folder, word: str) -> str:
    try:
        return read_program(folder.input_path(word.partition(":")[0]))
    except LeafcutError as problem:
        return folder.hide_paths(str(problem))
