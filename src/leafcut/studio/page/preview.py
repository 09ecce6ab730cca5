"""What is known of an input before it is run: its kind, its size, what had to be repaired, what can be done with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any

from leafcut import api
from leafcut.errors import LeafcutError, ReadError
from leafcut.model.heartbeat import OnProgress, looking_for
from leafcut.model.part import Part
from leafcut.model.simulation import Simulation
from leafcut.options import Settings
from leafcut.processes import registry
from leafcut.processes.settings import collect
from leafcut.read.format import SNIFF_BYTES, Match, Source
from leafcut.read.recognition import sniff_gcode
from leafcut.studio.page.whole import MachineTravel, Whole, Zero, travel_of, whole_of

#: Of a map, the tour through it is studied; of some that is all that they are for.
_PROGRAM = ("program", "simulate", "verify")
_MAPS = {"tsplib": ("solve",), "gtsp": ("solve",), "xml": ("drill", "solve"), "csv": ("drill", "solve")}
_EXAMPLE = ("drill", "solve")


@dataclass(frozen=True, eq=False)
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
    stock
        Makes the scene of the stock that a program cuts (`studio.drawing.solid`), or says why it is not shown.
    error
        Why it cannot be read in this way; another kind of work, or other options, may be able to.
    work
        The kind of work that a drawing was read for; empty where it is the same for all.
    whole
        All that a drawing shows, and which work it suits.
    zero
        Where in the drawing, mirrored and rotated, program zero is; None where that cannot be told or changed.
    travel
        How far the machine goes.
    broken
        Whether the file itself is why it cannot be read, and no option or kind of work would help.
    """

    format: str
    works: tuple[str, ...]
    facts: tuple[tuple[str, str], ...] = ()
    issues: tuple[dict[str, str], ...] = ()
    scenes: dict[str, bytes] = field(default_factory=dict)
    stock: Callable[[], bytes] | None = field(default=None, compare=False)
    error: str = ""
    work: str = ""
    whole: Whole = field(default_factory=Whole)
    zero: Zero = None
    travel: MachineTravel | None = None
    broken: bool = False


#: A drawing and a program that need what most others need.
READY = (
    Source("ready.dxf", b"0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\n0\n10\n5\n20\n5\n40\n1\n0\nENDSEC\n0\nEOF\n"),
    Source("ready.nc", b"G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z-1 F100\nG2 X2 Y0 I1 J0\nG81 X5 Y5 Z-1 R2\nG80\nM2\n"),
)


def get_ready() -> None:
    """Load what most inputs are read with, so that nobody waits for it at the first one."""
    with suppress(Exception):  # who opens a file is told what is wrong
        for source in READY:
            look(source)


def look(
    source: str | Source, work: str = "", options: dict[str, Any] | None = None, progress: OnProgress | None = None
) -> Seen:
    """Return what is in an input; `work` says how to see a drawing that is good for several kinds of work.

    Raises
    ------
    LeafcutError
        There is no such input, or leafcut reads no files of its kind.
    """
    from leafcut.read.registry import read_source

    settings = collect(options or {})
    format_, loaded = read_source(source, looking_for(progress, "reading"))
    if format_.name == "gcode":
        return _program(loaded, options or {}, progress)
    works = _EXAMPLE if format_.name == "example" else _MAPS.get(format_.name, format_.processes)
    works = registry.offered(works, format_.name)
    loaded = replace(loaded, kept={})
    whole = whole_of(format_, loaded, works, settings)
    tried = [work] if work in works else whole.likeliest(works)
    error, broken = "", True
    for one in tried:
        try:
            return replace(_drawing(loaded, format_.name, one, settings, whole, progress), works=works)
        except LeafcutError as problem:
            error, broken = error or str(problem), broken and isinstance(problem, ReadError)
    return Seen(format_.name, works, error=error, broken=broken, whole=whole)


def _drawing(
    source: Source, name: str, work: str, settings: Settings, whole: Whole, progress: OnProgress | None
) -> Seen:
    """Return a drawing or a map, read for a kind of work, over the whole of it."""
    from leafcut.report.json_answer import issues_as_json
    from leafcut.studio.drawing.scene import part_scene, unitless

    part = registry.look_at(work, source, settings)
    looking_for(progress, "drawing the preview")
    scenes = {"part": part_scene(part)}
    issues = tuple(issues_as_json(part.issues))
    if unitless(part):
        return Seen(name, (work,), _facts(part), issues, scenes, work=work)
    beneath, zero = whole.beneath(work, source, part, settings)
    if beneath is not None:
        scenes["whole"] = part_scene(beneath)
    travel = travel_of(registry.usual(work, settings), part.extents)
    return Seen(name, (work,), _facts(part), issues, scenes, work=work, whole=whole, zero=zero, travel=travel)


def _facts(part: Part) -> tuple[tuple[str, str], ...]:
    from leafcut.studio.drawing.scene import unitless

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


def _program(source: Source, options: Mapping[str, Any], progress: OnProgress | None) -> Seen:
    from leafcut.files.whole_files import read_program
    from leafcut.report.json_answer import issues_as_json
    from leafcut.studio.drawing.scene import toolpath_scene
    from leafcut.units import format_length, format_time

    try:
        used = registry.work("simulate").used()
        known = {name: value for name, value in options.items() if name in used}
        found = api.simulate(source, progress=progress, **known)
        looking_for(progress, "drawing the preview")
        text = read_program(source)
        scene = toolpath_scene(found.run, found.machine, name=source.file_name, text=text, measured=found.measure)
        shown = {"after": scene}
    except LeafcutError as problem:
        # What looks like a program is shown as text, also where nobody can run it as it is.
        looks = sniff_gcode(source.data[:SNIFF_BYTES])
        return Seen("gcode", _PROGRAM, error=str(problem), broken=isinstance(problem, ReadError) and looks == Match.NO)
    (left, low, _), (right, high, _) = found.path.extents
    facts = (
        ("time", format_time(found.measure.time_s)),
        ("rapid", format_length(found.measure.travel_mm)),
        ("feed", format_length(found.measure.cut_mm)),
        ("size", f"{_size(right - left, high - low)} mm"),
    )
    return Seen("gcode", _PROGRAM, facts, tuple(issues_as_json(found.issues)), shown, _stock(source, found, options))


def _stock(source: Source, found: Simulation, options: Mapping[str, Any]) -> Callable[[], bytes]:
    """Return what makes the scene of the stock, when somebody wants to see it."""

    def make() -> bytes:
        from leafcut.studio.drawing.solid import solid_scene

        used = registry.work("stock").used()
        settings = collect({name: value for name, value in options.items() if name in used})
        stock = registry.command("shown_stock")(source, settings)
        return solid_scene(found.run, found.machine, stock, found.measure)

    return make
