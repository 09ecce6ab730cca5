"""Previews an input before a run: its format, its size, its issues, and suitable kinds of work."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from leafcut import api
from leafcut.errors import LeafcutError, ReadError
from leafcut.message import Message
from leafcut.model.contour import Contour, layer_matcher
from leafcut.model.heartbeat import OnProgress, heartbeat_for_step
from leafcut.model.part import Part
from leafcut.options import Settings
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings
from leafcut.read.format import SNIFF_BYTES, Match, Source
from leafcut.read.recognition import sniff_gcode
from leafcut.studio.jobs.link import Link
from leafcut.studio.jobs.whole import MachineTravel, WholeInput, Zero, machine_travel_around, read_whole_input

#: Suitable kinds of work for programs, for maps (by format) and for built-in examples.
_PROGRAM = ("program", "simulate", "verify")
_MAPS = {"tsplib": ("solve",), "gtsp": ("solve",), "xml": ("drill", "solve"), "csv": ("drill", "solve")}
_EXAMPLE = ("drill", "solve")


@dataclass(frozen=True, eq=False)
class Preview:
    """Preview of an input.

    Attributes
    ----------
    works
        Suitable kinds of work (see `forms.works`).
    facts
        (key of the label, value), in the order in which they are shown.
    issues
        Issues, in the format of the JSON answers.
    scenes
        Scenes of the drawing by layer.
    stock
        Function that creates the scene of a program's stock (see `stock_scene`), or None for other inputs.
    error
        Why the input cannot be read with these options and for this kind of work. It is empty if there is no error.
    work
        Kind of work for which the drawing was read. It is empty if the kind of work makes no difference.
    whole
        The entire content of a drawing, and suitable kinds of work.
    zero
        Position of program zero in the mirrored and rotated drawing, mm, or None if it is unknown or fixed.
    broken
        Whether the file itself is invalid, so that no option and no kind of work can help.
    pixels
        Width and height of a picture of unknown scale, px, or None for all other inputs.
    layers
        Number of ``circles``, ``closed`` and ``open`` shapes on each layer, except the layers of the sheet.
    """

    format: str
    works: tuple[str, ...]
    facts: tuple[tuple[str, str], ...] = ()
    issues: tuple[dict[str, str], ...] = ()
    scenes: dict[str, bytes] = field(default_factory=dict)
    stock: Callable[[], bytes] | None = field(default=None, compare=False)
    error: str = ""
    work: str = ""
    whole: WholeInput = field(default_factory=WholeInput)
    zero: Zero = None
    travel: MachineTravel | None = None
    broken: bool = False
    pixels: tuple[int, int] | None = None
    layers: dict[str, dict[str, int]] = field(default_factory=dict)


#: A drawing and a program. Previewing them loads the most common modules.
READY = (
    Source("ready.dxf", b"0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\n0\n10\n5\n20\n5\n40\n1\n0\nENDSEC\n0\nEOF\n"),
    Source("ready.nc", b"G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z-1 F100\nG2 X2 Y0 I1 J0\nG81 X5 Y5 Z-1 R2\nG80\nM2\n"),
)


def read_preview(
    source: str | Source, work: str = "", options: dict[str, Any] | None = None, progress: OnProgress | None = None
) -> Preview:
    """Preview an input for a kind of work. Raises `LeafcutError` if the format of the input is unknown."""
    from leafcut.read.registry import read_source_with_format

    settings = collect_settings(options or {})
    format_, loaded = read_source_with_format(source, heartbeat_for_step(progress, Message("reading")))
    if format_.name == "gcode":
        return _preview_program(loaded, options or {}, progress)
    kinds = _EXAMPLE if format_.name == "example" else _MAPS.get(format_.name, format_.processes)
    kinds = registry.offered_works(kinds, format_.name)
    loaded = replace(loaded, cache={})
    whole = read_whole_input(format_, loaded, kinds, settings)
    tried = [work] if work in kinds else whole.most_likely_first(kinds)
    error, broken = "", True
    for kind in tried:
        try:
            return replace(_preview_drawing(loaded, format_.name, kind, settings, whole, progress), works=kinds)
        except LeafcutError as problem:
            error, broken = error or str(problem), broken and isinstance(problem, ReadError)
    pixels = None
    if format_.name == "picture" and not broken and not (options or {}).get("pixel_size"):
        from leafcut.read.picture import picture_size

        pixels = picture_size(loaded)
    return Preview(format_.name, kinds, error=error, broken=broken, whole=whole, pixels=pixels)


def _preview_drawing(
    source: Source, name: str, work: str, settings: Settings, whole: WholeInput, progress: OnProgress | None
) -> Preview:
    from leafcut.report.json_answer import issues_as_json
    from leafcut.studio.drawing.scene import is_tsplib_map, part_scene

    part = registry.work(work).preview_part(source, settings)
    heartbeat_for_step(progress, Message("drawing the preview"))
    scenes = {"part": part_scene(part)}
    issues = tuple(issues_as_json(part.issues))
    if is_tsplib_map(part):
        return Preview(name, (work,), _part_facts(part), issues, scenes, work=work)
    background, zero = whole.background_and_zero(work, source, part, settings)
    if background is not None:
        scenes["whole"] = part_scene(background)
    travel = machine_travel_around(registry.work(work).with_defaults(settings), part.extents)
    return Preview(
        name,
        (work,),
        _part_facts(part),
        issues,
        scenes,
        work=work,
        whole=whole,
        zero=zero,
        travel=travel,
        layers=_count_shapes(part, settings),
    )


def _count_shapes(part: Part, settings: Settings) -> dict[str, dict[str, int]]:
    is_sheet = layer_matcher(settings.sheet.sheet_layers)
    shapes = {  # the strokes of a text have the same handle
        (contour.layer, _shape_kind(contour), contour.handle or str(number)): None
        for number, contour in enumerate(part.contours)
        if not is_sheet(contour.layer)
    }
    counts: dict[str, dict[str, int]] = {}
    for layer, kind, _ in shapes:
        kinds = counts.setdefault(layer, {})
        kinds[kind] = kinds.get(kind, 0) + 1
    return counts


def _shape_kind(contour: Contour) -> str:
    from leafcut.processes.contours import diameter_if_round

    if not contour.path.closed:
        return "open"
    return "closed" if diameter_if_round(contour.path) is None else "circles"


def _part_facts(part: Part) -> tuple[tuple[str, str], ...]:
    from leafcut.studio.drawing.scene import is_tsplib_map

    left, low, right, high = part.extents
    size = _size_text(right - left, high - low)
    if is_tsplib_map(part):
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
    # The holes alone do not determine the size of the plate.
    kind = "size" if part.contours or part.pockets else "centres"
    return (*facts, (kind, f"{size} mm"), ("units", part.units))


def _size_text(width: float, height: float) -> str:
    """Format a size with four significant digits and without exponents."""
    return " × ".join(f"{side:,.0f}" if abs(side) >= 1000.0 else f"{side:.4g}" for side in (width, height))


def _preview_program(source: Source, options: Mapping[str, Any], progress: OnProgress | None) -> Preview:
    from leafcut.files.whole_files import read_program
    from leafcut.report.json_answer import issues_as_json
    from leafcut.studio.drawing.scene import toolpath_scene
    from leafcut.units import format_length, format_time

    try:
        simulation = api.simulate(source, progress=progress, **_options_used_by("simulate", options))
        heartbeat_for_step(progress, Message("drawing the preview"))
        text = read_program(source)
        scene = toolpath_scene(
            simulation.run, simulation.machine, name=source.file_name, text=text, measured=simulation.measure
        )
        shown = {"after": scene}
    except LeafcutError as problem:
        # Text that resembles a program is shown even if it cannot be simulated.
        match = sniff_gcode(source.data[:SNIFF_BYTES])
        return Preview(
            "gcode", _PROGRAM, error=str(problem), broken=isinstance(problem, ReadError) and match == Match.NO
        )
    (left, low, _), (right, high, _) = simulation.path.extents
    facts = (
        ("time", format_time(simulation.measure.time_s)),
        ("rapid", format_length(simulation.measure.travel_mm)),
        ("feed", format_length(simulation.measure.cut_mm)),
        ("size", f"{_size_text(right - left, high - low)} mm"),
    )
    return Preview("gcode", _PROGRAM, facts, tuple(issues_as_json(simulation.issues)), shown)


def preview_without_part(link: Link, source: str, work: str, options: dict[str, Any]) -> Preview:
    """Preview an input. The whole content is left out, because the page does not need it."""
    seen = read_preview(source, work, options, link.report)
    return replace(seen, whole=replace(seen.whole, part=None))


def stock_scene(link: Link, source: str, options: Mapping[str, Any]) -> bytes:
    """Create the scene of a program's stock (`studio.drawing.solid`). If it cannot be shown, the scene explains why."""
    from leafcut.read.registry import read_source_with_format
    from leafcut.studio.drawing.solid import solid_scene

    _, loaded = read_source_with_format(source, heartbeat_for_step(link.report, Message("reading")))
    simulation = api.simulate(loaded, progress=link.report, **_options_used_by("simulate", options))
    stock = registry.command_function("shown_stock")(loaded, collect_settings(_options_used_by("stock", options)))
    return solid_scene(simulation.run, simulation.machine, stock, simulation.measure)


def _options_used_by(work: str, options: Mapping[str, Any]) -> dict[str, Any]:
    used = registry.work(work).used()
    return {name: value for name, value in options.items() if name in used}
