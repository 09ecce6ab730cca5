"""Read STEP files: the holes, pockets, outlines and triangles of a solid.

A subprocess reads the file with OpenCASCADE (extra `step`).
"""

from __future__ import annotations

import importlib.util
import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, ReadError, count_of
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message
from leafcut.model.contour import Contour
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.part import TURNS, Hole, HoleStep, Opening, Part, ProgramZero
from leafcut.model.pocket import Pocket
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.read.filter_holes import select_holes
from leafcut.read.format import Source, first_positions_text
from leafcut.read.step_shapes import ONLY

#: Maximum size of a file, bytes. OpenCASCADE needs about twenty times as much memory.
LARGEST = 100 * 1024 * 1024
#: Maps a horizontal hole direction, as reported by the subprocess, to the number of its axis.
_AXES = {"1, 0, 0": 0, "0, 1, 0": 1}
#: Time limit of the subprocess, s. `step_solid.MEMORY` limits its memory.
SECONDS = 300
#: Selects a solid in a file: its number, ``all``, or None for the only solid.
WhichSolid = int | Literal["all"] | None
#: Maximum number of triangles of a solid.
MOST_TRIANGLES = 2_000_000


class Pose(NamedTuple):
    """The orientation of a solid.

    It consists of the direction that points up (`model.part.TURNS`), and the level of Z0 (`ProgramZero.level`).
    """

    up: str = "z"
    level: str = "drawn"

    @classmethod
    def of(cls, options: ReadOptions) -> Pose:
        """Return the orientation of a part for machining.

        By default, the part stands upright and its top is at Z0. The options can change both.
        """
        return cls(options.up or "z", options.z_zero or "top")


AS_DRAWN = Pose()


class ChosenSolid(NamedTuple):
    """The solid in a file that a program uses as its stock, with its orientation.

    The solid keeps the orientation of the drawing unless options change it.
    """

    which: WhichSolid = None
    pose: Pose = AS_DRAWN

    @classmethod
    def of(cls, options: ReadOptions) -> ChosenSolid:
        """Return the solid that the options choose."""
        return cls(options.solid, Pose(options.up or AS_DRAWN.up, options.z_zero or AS_DRAWN.level))


def read_step(source: Source, options: ReadOptions) -> Part:
    """Read the holes of a solid that can be drilled from above, with their heights and depths.

    Raises
    ------
    ReadError
        The file is damaged or has no solid, or it has several solids and `options.solid` does not choose one of them.
    OptionError
        OpenCASCADE is not installed, or the options state a unit although the file already states a unit.
    """
    _refuse_units_option(options)
    data = _read_solid(source, options, "holes")
    holes = tuple(
        Hole(
            round(hole["x"], 6),
            round(hole["y"], 6),
            round(hole["diameter"], 6),
            z=round(hole["top"], 6) + 0.0,
            depth=round(hole["depth"], 6),
            through=hole["through"],
            flat=not (hole["through"] or hole["pointed"]),
            steps=tuple(HoleStep(**step) for step in hole["steps"]),
        )
        for hole in data["holes"]
    )
    kept, selection_issues = select_holes(holes, options)
    issues = (*_hole_issues(data, options.up or "z"), *selection_issues)
    return _with_program_zero(Part(source.name, kept, issues=issues, source=source.path, format="step"), data, options)


def read_pockets_of_step(
    source: Source, options: ReadOptions, drawing: PocketDrawingOptions, joining: SheetOptions
) -> Part:
    """Read the closed pockets of a solid, with their depths. A pocket needs a level floor and vertical walls.

    Depths are measured from the highest point of the solid, because the tool has to pass everything above the floor.
    Other pockets are reported as issues.

    Raises
    ------
    ReadError
        As in `read_step`, or the solid has no such pocket.
    OptionError
        As in `read_step`, or the options choose layers, which solids do not have.
    """
    _refuse_units_option(options)
    if options.layers or drawing.pocket_layers or drawing.island_layers:
        raise OptionError("--layers, --pocket-layers, --island-layers: a STEP file has no layers; leave them out")
    data = _read_solid(source, options, "pockets")
    issues, pocket_data = _pocket_issues(data), data["pockets"]
    if not pocket_data:
        reasons = Message.joined("; ", (issue.message for issue in issues)) or Message(
            "the level faces of the solid are all at the top"
        )
        raise ReadError(source.path, Message("the solid has no closed pocket with a level floor: {}", reasons))
    # Round openings may be as wide as the tool: the pocket process decides whether to drill them.
    openings = tuple(
        Opening(_oriented_path(opening["outline"], clockwise=False), opening["diameter"])
        for opening in data["openings"]
        if opening["diameter"]
    )
    pockets = _build_pockets(data, source.name)
    part = Part(
        source.name, issues=tuple(issues), source=source.path, format="step", pockets=pockets, openings=openings
    )
    return _with_program_zero(part, data, options)


def _build_pockets(data: dict[str, Any], name: str) -> tuple[Pocket, ...]:
    return tuple(
        Pocket(
            _oriented_path(pocket["outline"], clockwise=False),
            tuple(_oriented_path(row, clockwise=True) for row in pocket["islands"]),
            name if len(data["pockets"]) == 1 else str(number),
            depth=round(data["highest"] - pocket["z"], 6),
            top=round(data["highest"], 6) + 0.0,
        )
        for number, pocket in enumerate(data["pockets"], 1)
    )


def read_outlines_of_step(source: Source, options: ReadOptions) -> Part:
    """Read the outlines of a flat sheet in top view: its edge and all its through-openings.

    An issue reports pockets and other features that are not cut. For a process that clears pockets, the part also
    contains the pockets. Its `besides` are then the issues about all other features.

    Raises
    ------
    ReadError, OptionError
        As in `read_step`, or the solid is not a flat sheet.
    """
    _refuse_units_option(options)
    if options.layers:
        raise OptionError("--layers: a STEP file has no layers; leave it out")
    data = _read_solid(source, options, "outlines")
    message = Message("the sheet also has pockets, steps or chamfers, which will not be cut")
    issues = (Issue("L219", message, missing=MissingWork("feature")),) if data["uneven"] else ()
    contours = tuple(Contour(Polyline(np.array(row), True), z=0.0) for row in data["outlines"])
    part = Part(source.name, issues=issues, source=source.path, format="step", contours=contours)
    if data["uneven"]:
        part = replace(part, pockets=_build_pockets(data, source.name), besides=_plate_issues(data))
    part = _with_program_zero(part, data, options)
    # The program of a sheet has its own Z0, the surface of the sheet.
    return replace(part, zero=ProgramZero(up=Pose.of(options).up))


def _read_solid(source: Source, options: ReadOptions, features: str) -> dict[str, Any]:
    return _run_step_reader(
        source.path, source.data, features, options.solid, Pose.of(options), boxed=isinstance(options.origin, str)
    )[0]


def _with_program_zero(part: Part, data: dict[str, Any], options: ReadOptions) -> Part:
    pose = Pose.of(options)
    # A rotation by a multiple of 90° keeps a bounding box exact.
    quarter_turn = abs(math.remainder(options.rotate, 0.5 * math.pi)) < 1e-9
    outline = np.array(data["box"] if data["box"] and quarter_turn else data["hull"])
    reference = Part(part.name, contours=(Contour(Polyline.of_points(outline, closed=True)),))
    zero = ProgramZero(up=pose.up, level=pose.level, z=round(data["z"], 6))
    return replace(part, reference=reference, zero=zero, height=round(data["height"], 6))


def _refuse_units_option(options: ReadOptions) -> None:
    if options.units:
        raise OptionError("--units: a STEP file defines its own unit; leave this option out")


def _oriented_path(vertices: list[list[float]], clockwise: bool) -> Polyline:
    path = Polyline(np.array(vertices), True)
    return path.reversed() if (path.area < 0.0) != clockwise else path


def read_step_mesh(path: str, data: bytes, which: WhichSolid = None, pose: Pose = AS_DRAWN) -> NDArray[np.float64]:
    """Return the surface of a solid as triangles, float64[n, 3, 3], mm, accurate to 0.05 mm.

    Raises the same errors as `read_step`.
    """
    return _run_step_reader(path, data, "mesh", which, pose)[1]


def _hole_issues(data: dict[str, Any], up: str) -> list[Issue]:
    opposite = up.removeprefix("-") if up.startswith("-") else f"-{up}"
    issues = [
        *_missing_work_issues(
            "L218",
            "{} open only from below will not be drilled; turn the part over (--up {})",
            data["below"],
            "hole",
            opposite,
        ),
        *_missing_work_issues(
            "L218",
            "{} with material inside, above or closed around it (an island, an overhang or a cavity) "
            "will not be drilled",
            data["obstructed"],
            "round wall",
        ),
    ]
    if data["free"]:
        message = Message(
            "{} with a free-form surface may contain holes that were not found; export hole walls as cylinders",
            count_of(data["free"], "face"),
        )
        issues.append(Issue("L218", message))
    for direction, count in data["aside"].items():
        # Each row of the matrix selects one axis of the solid.
        row = _AXES.get(direction)
        axis = "" if row is None else "xyz"[[abs(value) for value in TURNS[up][row]].index(1)]
        turn = Message("; turn the solid with --up {} or --up -{}", axis, axis) if axis else ""
        issues += _missing_work_issues(
            "L218", "{} along {} will not be drilled, because only holes along Z are{}", count, "hole", direction, turn
        )
    return issues


def _missing_work_issues(code: str, template: str, number: int, noun: str, *values: object) -> list[Issue]:
    """Report work that is not done, unless the number is 0. The first value of the template is the number."""
    message = Message(template, count_of(number, noun), *values)
    return [Issue(code, message, missing=MissingWork(noun, number))] if number else []


def _plate_issues(data: dict[str, Any]) -> tuple[Issue, ...]:
    issues = tuple(_pocket_issues({**data, "openings": []}))
    if issues or not data["other"]:
        return issues
    message = Message(
        "the solid has other features than outlines and pockets, such as countersinks, which will not be milled"
    )
    return (Issue("L219", message, missing=MissingWork("feature")),)


def _pocket_issues(data: dict[str, Any]) -> list[Issue]:
    issues = [
        *_missing_work_issues(
            "L219",
            "{} open at a side (a step, an open slot) will not be milled, because a pocket has walls all around",
            data["open"],
            "level face",
        ),
        *_missing_work_issues(
            "L219",
            "{} with sloping walls or rounded floor edges will not be milled, because walls must be vertical",
            data["leaning"],
            "pocket",
        ),
        *_missing_work_issues(
            "L219",
            "{} under an overhang will not be milled, because the tool cannot reach there from above",
            data["covered"],
            "level face",
        ),
        *_missing_work_issues(
            "L219",
            "{} that slope or are rounded (chamfers, fillets, curved floors) will not be milled",
            data["sloping"],
            "face",
        ),
    ]
    openings = [
        _oriented_path(opening["outline"], clockwise=False) for opening in data["openings"] if not opening["diameter"]
    ]
    if openings:
        positions = tuple(_box_centre(outline) for outline in openings)
        message = Message(
            "the program does not mill {} through the part, because a pocket has a floor",
            count_of(len(openings), "opening"),
        )
        missing = MissingWork("opening", len(openings), positions, tuple(openings))
        issues.append(Issue("L219", message, first_positions_text(positions), missing=missing))
    return issues


def _box_centre(outline: Polyline) -> tuple[float, float]:
    x0, y0, x1, y1 = outline.extents
    return round(0.5 * (x0 + x1), 3), round(0.5 * (y0 + y1), 3)


def report_work_besides_holes(source: Source, options: ReadOptions) -> list[Issue]:
    """Report the features of a solid that drills cannot make, such as pockets and openings, as missing work (L219).

    Raises the same errors as `read_step`.
    """
    data = _read_solid(source, options, "pockets")
    issues = _pocket_issues(data)
    outlines = [
        _oriented_path(pocket["outline"], clockwise=False) for pocket in data["pockets"] if not pocket["diameter"]
    ]
    if outlines:
        positions = tuple(_box_centre(outline) for outline in outlines)
        message = Message("{} will not be milled; use leafcut pocket", count_of(len(outlines), "pocket"))
        missing = MissingWork("pocket", len(outlines), positions, tuple(outlines))
        issues.append(Issue("L219", message, first_positions_text(positions), missing=missing))
    return issues


def _run_step_reader(
    path: str, data: bytes, features: str, which: WhichSolid, pose: Pose, boxed: bool = False
) -> tuple[dict[str, Any], NDArray[np.float64]]:
    """Run the subprocess that reads a solid, and return the features and the triangles of the solid.

    With `boxed`, the features include the exact bounding box.
    """
    if importlib.util.find_spec("OCP") is None:
        raise OptionError("reading STEP needs OpenCASCADE: pip install 'leafcut[step]'")
    if len(data) > LARGEST:
        raise ReadError(path, Message("has {} MiB; STEP files up to {} MiB are read", len(data) >> 20, LARGEST >> 20))
    if not data.rstrip().endswith(b"END-ISO-10303-21;"):
        raise ReadError(path, "the STEP file is truncated: its last line is missing")
    with tempfile.TemporaryDirectory(prefix="leafcut-step-") as folder:
        file, output = Path(folder, "part.step"), Path(folder, "found.npz")
        file.write_bytes(data)
        # -P: a file beside the drawing must not be imported as a module.
        command = [
            sys.executable,
            "-P",
            "-m",
            "leafcut.read.step_solid",
            str(file),
            str(output),
            str(MOST_TRIANGLES),
            features,
            str(which or ONLY),
            *pose,
            "box" if boxed else "",
        ]
        try:
            process = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=SECONDS,
                check=False,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
            )
        except subprocess.TimeoutExpired:
            raise ReadError(
                path, Message("takes more than {} s to read; export the part with fewer faces", SECONDS)
            ) from None
        if process.returncode or not output.is_file():
            raise ReadError(path, "OpenCASCADE could not read the STEP file, or needed too much memory for it")
        with np.load(output) as arrays:
            result, triangles = json.loads(str(arrays["told"])), arrays["triangles"]
    if "problem" in result:
        raise ReadError(path, result["problem"])
    return result, triangles
