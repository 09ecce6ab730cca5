"""What is known of an input before it is run: its kind, its size, what had to be repaired, what can be done with it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from leafcut import api
from leafcut.errors import LeafcutError
from leafcut.model.part import Part
from leafcut.options import Settings
from leafcut.processes import registry
from leafcut.processes.settings import collect
from leafcut.read.format import Source

#: Of a map, the tour through it is studied; of some that is all that they are for.
_PROGRAM = ("program", "simulate", "verify")
_MAPS = {"tsplib": ("solve",), "gtsp": ("solve",), "xml": ("drill", "solve"), "csv": ("drill", "solve")}
_EXAMPLE = ("drill", "solve")


@dataclass(frozen=True)
class Seen:
    """An input as it was found.

    Attributes
    ----------
    works
        Kinds of work (`forms.works`) that it is good for.
    facts
        (key of its words, value) in the order in which they are told.
    issues
        As the JSON answers have them.
    scenes
        What the drawing shows of it: layer → scene.
    error
        Why it cannot be read in this way; another kind of work, or other options, may be able to.
    work
        The kind of work that a drawing was read for; empty where it is the same for all.
    """

    format: str
    works: tuple[str, ...]
    facts: tuple[tuple[str, str], ...] = ()
    issues: tuple[dict[str, str], ...] = ()
    scenes: dict[str, bytes] = field(default_factory=dict)
    error: str = ""
    work: str = ""


def look(source: str, work: str = "", options: dict[str, Any] | None = None) -> Seen:
    """Return what is in an input; `work` says how to see a drawing that is good for several kinds of work.

    Raises
    ------
    LeafcutError
        There is no such input, or leafcut reads no files of its kind.
    """
    from leafcut.read.registry import read_source

    settings = collect(options or {})
    format_, loaded = read_source(source)
    if format_.name == "gcode":
        return _program(loaded, settings)
    works = _EXAMPLE if format_.name == "example" else _MAPS.get(format_.name, format_.processes)
    works = registry.offered(works, format_.name)
    tried = [work] if work in works else list(works)
    error = ""
    for one in tried:
        try:
            return replace(_drawing(loaded, format_.name, one, settings), works=works)
        except LeafcutError as problem:
            error = error or str(problem)
    return Seen(format_.name, works, error=error)


def _drawing(source: Source, name: str, work: str, settings: Settings) -> Seen:
    """Return a drawing or a map, read for a kind of work."""
    from leafcut.report.json_answer import issues_as_json
    from leafcut.studio.scene import part_scene

    part = registry.look_at(work, source, settings)
    return Seen(name, (work,), _facts(part), tuple(issues_as_json(part.issues)), {"part": part_scene(part)}, work=work)


def _facts(part: Part) -> tuple[tuple[str, str], ...]:
    from leafcut.studio.scene import unitless

    left, low, right, high = part.extents
    size = _size(right - left, high - low)
    if unitless(part):
        return (("points", f"{len(part.holes):,}"), ("size", size))
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
    # Only centres are known of a drawing of holes: how far the plate goes beyond them is not.
    kind = "size" if part.contours or part.pockets else "centres"
    return (*facts, (kind, f"{size} mm"), ("units", part.units))


def _size(width: float, height: float) -> str:
    """Return a size to four figures, with all those before the point, never as a power of ten."""
    return " × ".join(f"{side:,.0f}" if abs(side) >= 1000.0 else f"{side:.4g}" for side in (width, height))


def _program(source: Source, settings: Settings) -> Seen:
    from leafcut.files import read_program
    from leafcut.report.json_answer import issues_as_json
    from leafcut.studio.scene import toolpath_scene
    from leafcut.units import format_length, format_time

    try:
        found = api.simulate(source, machine=settings.machine.machine)
        shown = {"after": toolpath_scene(found.run, found.machine, name=source.file_name, text=read_program(source))}
    except LeafcutError as problem:
        return Seen("gcode", _PROGRAM, error=str(problem))
    (left, low, _), (right, high, _) = found.path.extents
    facts = (
        ("time", format_time(found.measure.time_s)),
        ("rapid", format_length(found.measure.travel_mm)),
        ("feed", format_length(found.measure.cut_mm)),
        ("size", f"{_size(right - left, high - low)} mm"),
    )
    return Seen("gcode", _PROGRAM, facts, tuple(issues_as_json(found.issues)), shown)
