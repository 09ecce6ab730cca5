"""Repeat a drawing side by side on one plate, or in several fixtures with a work offset each."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace

from leafcut.errors import OptionError, PlanError
from leafcut.gcode.dialects import Dialect
from leafcut.geometry.arrays import Point
from leafcut.message import Message
from leafcut.model.contour import Contour, layer_matcher
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.machine import Machine
from leafcut.model.part import Part
from leafcut.model.toolpath import FIRST_OFFSET, g_word
from leafcut.options import Settings
from leafcut.processes.layers import contour_kinds
from leafcut.processes.part.model import CopyGrid
from leafcut.processes.part.operations import rules_by_layer
from leafcut.processes.part.options import PartOptions
from leafcut.processes.placing import shift_part
from leafcut.read.operations import Operation, read_operations

#: Maximum total number of shapes in all copies.
_MOST_SHAPES = 20_000
_WORK_OFFSETS = re.compile(r"G5[4-9](\.[1-3])?( ?, ?G5[4-9](\.[1-3])?)*", re.IGNORECASE)
_COLUMNS_AND_ROWS = re.compile(r"([1-9]\d{0,2}) ?[x×] ?([1-9]\d{0,2})", re.IGNORECASE)
#: Precision of distances between copies, mm.
_EXACT = 1e-6


def repeat_part(part: Part, settings: Settings, least_spacing: float = 0.0) -> tuple[Part, CopyGrid | None]:
    """Repeat a part in columns along X and rows along Y. The outline of the sheet is not copied.

    Parameters
    ----------
    least_spacing
        Minimum distance between the shapes of two copies, mm. It applies to ``--copy-spacing``, but not to ``--pitch``,
        because the copies of an L-shaped part may lie inside each other's bounding box.

    Returns
    -------
    part, grid
        The part with all copies, and their grid; the part itself and None without a grid.

    Raises
    ------
    OptionError
        The number, the spacing or the pitch of the copies is invalid.
    DataError
        The file of operations is invalid.
    PlanError
        The copies have too many shapes, it is unclear whether a layer holds the outline of the sheet, or a layer has no
        operation.
    """
    options = settings.of(PartOptions)
    if options.copies is None or _are_work_offsets(options.copies):
        return part, None
    columns, rows = columns_and_rows(options.copies)
    is_sheet = layer_matcher(settings.sheet.sheet_layers)
    once = replace(
        part,
        contours=tuple(c for c in part.contours if c.kind != "sheet" and not is_sheet(c.layer)),
        issues=tuple(issue for issue in part.issues if issue.missing is not None),
    )
    shapes = len(once.contours) + len(once.pockets) + sum(map(_number_of_marks, once.issues))
    if columns * rows * shapes > _MOST_SHAPES:
        raise PlanError(
            "{}: {} copies of {} shapes exceed the limit of {} shapes; give fewer --copies",
            part.name,
            columns * rows,
            shapes,
            _MOST_SHAPES,
        )
    if options.operations is None:
        _refuse_unclear_sheet(part, once.contours, settings)
    pitch = _pitch(once, settings, least_spacing if columns * rows > 1 else 0.0)
    grid = CopyGrid(columns, rows, pitch)
    copies = [_copy(once, place, number) for number, place in enumerate(grid.places, 1)]
    missing = iter([_in_all_copies(same) for same in zip(*(copy.issues for copy in copies), strict=True)])
    repeated = replace(
        part,
        contours=(*part.contours, *(contour for copy in copies[1:] for contour in copy.contours)),
        pockets=tuple(pocket for copy in copies for pocket in copy.pockets),
        issues=tuple(issue if issue.missing is None else next(missing) for issue in part.issues),
    )
    return repeated, grid


def work_offsets(settings: Settings, dialect: Dialect, tools: int) -> tuple[int, ...]:
    """Return the work offset of each fixture, in tenths (540 is G54).

    Raises
    ------
    OptionError
        A work offset is repeated, or the controller lacks it. The program has several `tools`, and the operator would
        have to set Z0 of every fixture again after each tool change.
    """
    options = settings.of(PartOptions)
    if options.copies is None or not _are_work_offsets(options.copies):
        return (FIRST_OFFSET,)
    offsets = [round(10.0 * float(word.strip()[1:])) for word in options.copies.split(",")]
    for given, name in ((options.copy_spacing, "--copy-spacing"), (options.pitch, "--pitch")):
        if given is not None:
            raise OptionError("{}: fixtures with their own work offsets have no distance; leave it out", name)
    if len(offsets) < 2 or len(set(offsets)) < len(offsets):
        raise OptionError("--copies: give at least two work offsets, each only once, such as G54,G55")
    missing = [offset for offset in offsets if offset not in dialect.g_codes]
    if missing:
        name = g_word(missing[0])
        raise OptionError("--copies: {} programs have no work offset {} in leafcut; leave it out", dialect.name, name)
    if tools > 1 and dialect.changes_by_hand and not dialect.length_offset:
        raise OptionError(
            "--copies: {} has no tool lengths, so Z0 of each fixture would be wrong after a tool change; use a single "
            "tool, or one fixture per program",
            dialect.name,
        )
    return tuple(offsets)


def fixture_issues(offsets: Sequence[int], machine: Machine, clearance: float) -> list[Issue]:
    """Warn if the tool moves between fixtures at the `clearance` height, mm, and not at a height of the machine."""
    if len(offsets) < 2 or machine.safe_z is not None:
        return []
    words = Message(
        "{} has no safe height in machine coordinates, so the tool moves between the fixtures at Z{:g}; set Z0 of all "
        "fixtures at the same height, and keep the space between them clear",
        machine.name,
        clearance,
    )
    return [Issue("L403", words)]


def _are_work_offsets(text: str) -> bool:
    return _WORK_OFFSETS.fullmatch(text.strip()) is not None


def columns_and_rows(text: str) -> tuple[int, int]:
    """Parse a text such as ``3x2`` into the numbers of columns and rows. Raises OptionError for any other text."""
    match = _COLUMNS_AND_ROWS.fullmatch(text.strip())
    if match is None:
        raise OptionError(
            "--copies: '{}' is not a number of columns and rows from 1 to 999, such as 3x2, or a list of work offsets, "
            "such as G54,G55",
            text,
        )
    return int(match[1]), int(match[2])


def _pitch(once: Part, settings: Settings, least_spacing: float) -> Point:
    """Return the distance from copy to copy in X and Y, mm."""
    options = settings.of(PartOptions)
    least = math.ceil(10.0 * (least_spacing - _EXACT)) / 10.0
    if options.copy_spacing is not None:
        if options.copy_spacing < least_spacing - _EXACT:
            raise OptionError(
                "--copy-spacing {:g} mm is too small, because the mill, the tabs and the finishing allowance need "
                "{:g} mm between two copies; give --copy-spacing {:g}mm",
                options.copy_spacing,
                least,
                least,
            )
        x0, y0, x1, y1 = _milled_box(once, settings)
        return x1 - x0 + options.copy_spacing, y1 - y0 + options.copy_spacing
    if options.pitch is None:
        raise OptionError(
            "--copies: the distance between the copies is missing; give --copy-spacing, such as --copy-spacing {:g}mm, "
            "or the distance from copy to copy with --pitch",
            least or 10.0,
        )
    if len(options.pitch) != 2 or min(options.pitch) <= 0.0:
        raise OptionError("--pitch: give two distances above 0, in X and Y, such as 60,40")
    return options.pitch[0], options.pitch[1]


def _milled_box(once: Part, settings: Settings) -> tuple[float, float, float, float]:
    """Return the bounding box of all shapes that are milled, mm.

    Shapes on ignored layers, such as dimensions, do not move the copies apart.
    """
    file = settings.of(PartOptions).operations
    if file is None:
        kinds = contour_kinds(once.contours, settings.sheet, [])
        milled = [contour for contour, kind in zip(once.contours, kinds, strict=True) if kind == "cut"]
    else:
        rules = rules_by_layer(once, read_operations(file), file, settings.sheet)
        milled = [c for c in once.contours if rules[c.layer].operation is not Operation.IGNORE]
    return replace(once, contours=tuple(milled)).extents


def _refuse_unclear_sheet(part: Part, copied: Sequence[Contour], settings: Settings) -> None:
    kinds = contour_kinds(copied, settings.sheet, [])
    layers = {contour.layer for contour, kind in zip(copied, kinds, strict=True) if kind == "maybe sheet"}
    if layers:
        raise PlanError(
            "{}: with --copies, layer '{}' may hold the outline of the part or of the sheet; name the layer "
            "with --cut-layers or --sheet-layers",
            part.name,
            min(layers),
        )


def _copy(once: Part, place: Point, number: int) -> Part:
    """Return a copy of a part. Its handles are unique, because strokes with the same handle belong to one text."""
    if number == 1:
        return once
    moved = shift_part(once, place)
    contours = tuple(
        replace(contour, handle=contour.handle and f"{contour.handle}.{number}") for contour in moved.contours
    )
    return replace(moved, contours=contours)


def _number_of_marks(issue: Issue) -> int:
    """Return how many marks of an issue the pictures may show, so that the limit of shapes includes them."""
    return 0 if issue.missing is None else 1 + len(issue.missing.where) + len(issue.missing.outlines)


def _in_all_copies(issues: Sequence[Issue]) -> Issue:
    missing = [issue.missing for issue in issues if issue.missing is not None]
    return replace(
        issues[0],
        missing=MissingWork(
            missing[0].what,
            sum(one.count for one in missing),
            tuple(place for one in missing for place in one.where),
            tuple(outline for one in missing for outline in one.outlines),
        ),
    )
