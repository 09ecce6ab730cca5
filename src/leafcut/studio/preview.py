"""What is known of an input before it is run: its kind, its size, what had to be repaired, what can be done with it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut import api
from leafcut.errors import LeafcutError
from leafcut.model.part import Part
from leafcut.options import Settings

#: What a file of a format is good for, the likeliest first; drawings with contours come besides.
_WORKS = {
    "gcode": ("program", "simulate", "verify"),
    "tsplib": ("solve",),
    "gtsp": ("solve",),
    "xml": ("drill", "solve"),
    "csv": ("drill", "solve"),
    "example": ("drill", "solve"),
}


@dataclass(frozen=True)
class Seen:
    """An input as it was found.

    Attributes
    ----------
    works
        Kinds of work (`forms.WORKS`) that it is good for.
    facts
        (key of its words, value) in the order in which they are told.
    issues
        As the JSON answers have them.
    part
        What was read; None of a program.
    """

    format: str
    works: tuple[str, ...]
    facts: tuple[tuple[str, str], ...]
    issues: tuple[dict[str, str], ...]
    part: Part | None


def look(source: str, work: str = "", options: dict[str, Any] | None = None) -> Seen:
    """Return what is in an input; `work` says how to see a drawing that can be drilled or cut.

    Raises
    ------
    LeafcutError
        It cannot be read.
    """
    from leafcut.read import read, read_contours
    from leafcut.read.registry import read_source
    from leafcut.report.json_answer import issues_as_json

    settings = Settings.collect(options or {})
    format_, _ = read_source(source)
    if format_.name == "gcode":
        return _program(source, {"machine": settings.machine.machine})
    drawn = ("cut",) if format_.contours else ()
    works = _WORKS.get(format_.name, ("drill", *drawn))
    if work == "cut" and drawn:
        part = read_contours(source, settings.read)
    else:
        try:
            part = read(source, settings.read)
        except LeafcutError:
            if work or not drawn:
                raise
            part, works = read_contours(source, settings.read), ("cut", "drill")
    return Seen(format_.name, works, _facts(part), tuple(issues_as_json(part.issues)), part)


def _facts(part: Part) -> tuple[tuple[str, str], ...]:
    left, low, right, high = part.extents
    counts = (
        ("holes", len(part.holes)),
        ("slots", len(part.slots)),
        ("contours", len(part.contours)),
        ("pockets", len(part.pockets)),
    )
    facts = [(name, f"{number:,}") for name, number in counts if number]
    widths = sorted({h.diameter for h in part.holes if h.diameter > 0})
    if widths:
        shown = ", ".join(f"{w:.4g}" for w in widths[:4]) + (" …" if len(widths) > 4 else "")
        facts.append(("diameters", f"{shown} mm"))
    return (*facts, ("size", f"{right - left:,.4g} × {high - low:,.4g} mm"), ("units", part.units))


def _program(source: str, options: dict[str, Any]) -> Seen:
    from leafcut.units import format_length, format_time

    found = api.simulate(source, **options)
    x, y = found["extents"]["x"], found["extents"]["y"]
    facts = (
        ("time", format_time(found["time_s"])),
        ("rapid", format_length(found["rapid_mm"])),
        ("feed", format_length(found["feed_mm"])),
        ("size", f"{x[1] - x[0]:,.4g} × {y[1] - y[0]:,.4g} mm"),
    )
    issues = tuple({"code": "", "severity": "warning", "message": line, "place": ""} for line in found["issues"])
    return Seen("gcode", _WORKS["gcode"], facts, issues, None)
