"""Read Gerber files of a circuit board with gerbonara: copper areas, outline and holes.

A board is a ZIP archive of Gerber and drill files, as board houses receive it. It is read in memory; nothing is
extracted. gerbonara parses the commands. leafcut refuses every command that gerbonara skips, because copper that is not
read would be milled away.
"""

from __future__ import annotations

import io
import math
import re
import warnings
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import PurePosixPath
from typing import Any

import numpy as np
import shapely
from shapely import affinity

from leafcut.errors import ReadError, parser_errors, printable
from leafcut.geometry.polyline import Polyline
from leafcut.geometry.regions import as_polyline, chords_per_quarter, polygons
from leafcut.message import Message
from leafcut.model.contour import Contour, layer_filter
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read.excellon import EmptyDrillFile, read_excellon
from leafcut.read.format import MAX_COORDINATE, MAX_SEGMENTS, Match, ReadBudget, Source, too_many_segments_error
from leafcut.read.recognition import is_gerber_text, sniff_excellon

#: Layers of a board.
COPPER, OUTLINE, HOLES, SLOTS = "COPPER", "OUTLINE", "HOLES", "SLOTS"
#: Maximum chord error of round copper, mm.
_FINE = 0.002
#: Maximum number of files in an archive, and of their bytes in total. Boards have fewer than 30 files.
_MAX_FILES, _MAX_BYTES = 500, 64 * 1024 * 1024
#: Maximum number of commands and objects in a file, and of changes between dark and clear objects. Each change costs
#: time that grows with the image.
_MAX_COMMANDS, _MAX_OBJECTS, _MAX_CHANGES = 1_000_000, 300_000, 2_000
#: Maximum number of primitives in an aperture macro, of corners of a polygon in it, and of variables that it defines
#: and uses in definitions. gerbonara computes a variable again at each use.
_MAX_PRIMITIVES, _MAX_CORNERS, _MAX_DEFINITIONS, _MAX_USES = 10_000, 12, 8, 32
#: Maximum length of the text after the last command.
_MAX_TAIL = 1_000
#: File names of CAD programs that write no X2 attributes.
_NAMES = (
    ("top", re.compile(r"\.(gtl|cmp)$|(?<![a-z])(f[._]cu|copper[._]top|top[._](copper|layer))\b", re.I)),
    ("bottom", re.compile(r"\.(gbl|sol)$|(?<![a-z])(b[._]cu|copper[._]bottom|bottom[._](copper|layer))\b", re.I)),
    ("outline", re.compile(r"\.(gko|gm1|gml|oln)$|edge[._]cuts|(?<![a-z])(board[._]?outline|outline|profile)\b", re.I)),
)
#: Function of a file by its X2 attributes, and the number of characters in which it stands.
_FUNCTION, _HEAD = re.compile(r"TF\.FileFunction,([^*%]*)"), 20_000
#: Warnings of gerbonara that do not affect the copper.
_HARMLESS = re.compile(r"image name|load name|unit mode statement|Deprecated G90|without explicit operation code")
#: Step and repeat. gerbonara skips it.
_REPEATED = re.compile(r"(?:^|[%*])\s*SR(?!X0*1Y0*1(?!\d))X\d", re.M)
#: A comment, or an extended command, which may contain several commands.
_EXTENDED = re.compile(r"G04[^*]*\*|%([^%]*)%")
#: The same, or a short word, which gerbonara ignores, or the end of the program.
_SHORT_OR_END = re.compile(r"G04[^*]*\*|%[^%]*%|G(?P<short>[123])(?!\d)|(?P<end>M0?[02]\*)")
#: An aperture and a position in a single command. gerbonara loses the position.
_JOINED = re.compile(r"D(?:[1-9]\d+|0\d{2,})\s*[XYIJD]")
_INCREMENTAL = re.compile(r"%\s*FS[LTD]?I")
_MACRO = re.compile(r"%\s*AM([^%]*)%")
_DEFINITION = re.compile(r"\$\d+=([^*]*)")


def read_gerber(source: Source, options: ReadOptions) -> Part:
    """Read a Gerber file, or a ZIP archive of Gerber and drill files, as contours in mm.

    The copper of the side `options.side` is on the layer ``COPPER``, with gaps and openings as islands. The board edge
    is on ``OUTLINE``, and holes and slots are on ``HOLES`` and ``SLOTS``. The bottom side is mirrored about the Y axis
    through the middle of the board.

    Raises
    ------
    ReadError
        The file is damaged or too large, has commands that cannot be read, or has no copper and outline on this side.
    """
    files = list(_archive_files(source)) if source.data.startswith(b"PK") else [source]
    kinds: dict[str, Source] = {}
    contours: list[Contour] = []
    issues: list[Issue] = []
    for file in files:
        source.on_progress()
        if not is_gerber_text(file.data):
            if sniff_excellon(file.data) is Match.YES:
                contours += _drilled(file, options, issues)
            continue
        text = file.text()
        kind = _kind(file, text, options.side)
        if kind is None and len(files) == 1 and _FUNCTION.search(text[:_HEAD]) is None:
            kind = options.side
        if kind == "drill":
            contours += [Contour(Polyline.circle(*place), layer=HOLES) for place in _flashed_holes(file, text)]
        elif kind in (options.side, "outline"):
            if kind in kinds:
                reason = Message("'{}' and '{}' are both the {} layer; remove one of them", kinds[kind], file, kind)
                raise ReadError(source.path, reason)
            kinds[kind] = file
            contours += _copper(file, text) if kind == options.side else _outline(file, text)
    if not kinds:
        names = printable(", ".join(file.file_name for file in files[:12]), 200)
        reason = Message("no copper or outline of the {} side was found in: {}", options.side, names)
        raise ReadError(source.path, reason)
    if sum(contour.path.n_segments for contour in contours) > MAX_SEGMENTS:
        raise too_many_segments_error(source.path)
    chosen = layer_filter(options.layers)
    part = Part(source.name, source=source.file_name, format="gerber", contours=tuple(contours))
    if options.side == "bottom":
        part, note = _mirrored(part)
        issues.append(note)
    # Both sides have the same corners, whatever lies outside the board.
    edge = tuple(contour for contour in part.contours if contour.layer == OUTLINE)
    reference = replace(part, contours=edge) if edge else None
    shown = tuple(contour for contour in part.contours if chosen(contour.layer))
    return replace(part, contours=shown, issues=tuple(issues), reference=reference)


def _archive_files(source: Source) -> Iterator[Source]:
    """Yield the files of a ZIP archive. The stated sizes are not trusted."""
    reason = Message("the archive is larger than {} MiB unpacked; remove files that are not Gerber", _MAX_BYTES >> 20)
    budget = ReadBudget(source.path, _MAX_BYTES, reason)
    with parser_errors(source.path, Message("could not be read as a ZIP archive")):
        archive = zipfile.ZipFile(io.BytesIO(source.data))
        members = [info for info in archive.infolist() if not info.is_dir()]
        if len(members) > _MAX_FILES:
            raise ReadError(source.path, Message("more than {} files; remove files that are not Gerber", _MAX_FILES))
        for info in members:
            name = PurePosixPath(info.filename)
            if "__MACOSX" in name.parts or name.name.startswith("."):
                continue
            with archive.open(info) as stream:
                data = stream.read(budget.left + 1)
            budget(len(data))
            yield Source(f"{source.path}: {printable(name.name, 80)}", data, source.on_progress)


def _kind(file: Source, text: str, side: str) -> str | None:
    """Return the kind of a Gerber file: top, bottom, outline or drill. None for any other layer."""
    match = _FUNCTION.search(text[:_HEAD])
    if match is None:
        return next((kind for kind, pattern in _NAMES if pattern.search(file.file_name)), None)
    words = [word.strip().lower() for word in match.group(1).split(",")]
    if words[0] in ("plated", "nonplated"):
        return "drill"
    if words[0] == "copper":
        return {"top": "top", "bot": "bottom"}.get(next((w for w in words if w in ("top", "bot")), ""))
    return "outline" if words[0] == "profile" else None


def _parsed(file: Source, text: str) -> Any:
    """Return the file as a gerbonara object. Raises ReadError for every command that gerbonara would skip."""
    import gerbonara

    text = _checked(file, text)
    with warnings.catch_warnings(record=True) as caught, parser_errors(file.path, Message("could not be read")):
        warnings.simplefilter("always")
        parsed = gerbonara.GerberFile.from_string(text, filename="line")
    for warning in caught:
        if not _HARMLESS.search(str(warning.message)):
            words = printable(str(warning.message), 160)
            raise ReadError(file.path, Message("not supported: {}; export the file as Gerber X2", words))
    if len(parsed.objects) > _MAX_OBJECTS:
        raise ReadError(file.path, Message("more than {:,} objects; this is not a board to mill", _MAX_OBJECTS))
    return parsed


def _checked(file: Source, text: str) -> str:
    """Return the text with single, complete commands up to the end of the program.

    Raises ReadError for commands that gerbonara ignores or misreads without a warning, and for texts that take too
    long.
    """
    if text.count("*") > _MAX_COMMANDS or len(text) - max(text.rfind("*"), text.rfind("%")) > _MAX_TAIL:
        raise ReadError(
            file.path, Message("too many commands, or the last one has no end; this is not a board to mill")
        )
    end = next((match.end() for match in _SHORT_OR_END.finditer(text) if match["end"]), len(text))
    text = _SHORT_OR_END.sub(lambda m: f"G0{m['short']}" if m["short"] else m[0], text[:end])
    text = _EXTENDED.sub(_single_commands, text)
    if _REPEATED.search(text):
        reason = Message("the file repeats the board (SR), which is not supported; export one board, and use --copies")
        raise ReadError(file.path, reason)
    if _INCREMENTAL.search(text):
        raise ReadError(file.path, Message("incremental coordinates (FS…I) are not supported; export absolute ones"))
    if match := _JOINED.search(_EXTENDED.sub("", text)):
        reason = Message("'{}' selects an aperture and a position at once; export the file as Gerber X2", match[0])
        raise ReadError(file.path, reason)
    for macro in _MACRO.finditer(text):
        definitions = _DEFINITION.findall(macro[1])
        if len(definitions) > _MAX_DEFINITIONS or sum(one.count("$") for one in definitions) > _MAX_USES:
            raise ReadError(file.path, Message("an aperture macro defines too many variables; export the file anew"))
    return text


def _single_commands(match: re.Match[str]) -> str:
    """Divide an extended command into single ones, because gerbonara reads only the first. Macros stay whole."""
    words = match.group(1)
    if words is None or words.lstrip().startswith("AM"):
        return match.group()
    return "".join(f"%{word.strip()}*%" for word in words.split("*") if word.strip()) + "\n" * words.count("\n")


def _copper(file: Source, text: str) -> list[Contour]:
    """Return the edges of the copper as contours."""
    with parser_errors(file.path, Message("could not be read")):
        image = _image(file, _parsed(file, text).objects)
    pieces = sorted(polygons(image), key=lambda piece: piece.bounds)
    x0, y0, x1, y1 = image.bounds
    if not pieces:
        raise ReadError(file.path, Message("the file has no copper"))
    if not all(abs(v) <= MAX_COORDINATE for v in (x0, y0, x1, y1)):
        raise ReadError(file.path, Message("copper is more than 1 km from the origin; check the file"))
    return [
        Contour(as_polyline(ring.coords, closed=True), layer=COPPER, handle=f"copper-{number}")
        for number, piece in enumerate(pieces)
        for ring in (piece.exterior, *piece.interiors)
    ]


def _image(file: Source, objects: Sequence[Any]) -> Any:
    """Return the area of all objects. Each object adds to or clears the objects before it."""
    image: Any = shapely.Polygon()
    flashes: dict[int, Any] = {}
    batch: list[Any] = []
    if sum(one.polarity_dark != two.polarity_dark for one, two in pairwise(objects)) > _MAX_CHANGES:
        raise ReadError(file.path, Message("more than {:,} changes between dark and clear objects", _MAX_CHANGES))
    for number, item in enumerate(objects):
        batch.append(_area(file, item, flashes))
        if number + 1 == len(objects) or objects[number + 1].polarity_dark != item.polarity_dark:
            area = shapely.union_all(batch)
            image, batch = (image.union(area) if item.polarity_dark else image.difference(area)), []
            file.on_progress()
    return image


def _area(file: Source, item: Any, flashes: dict[int, Any]) -> Any:
    """Return the area of a flash, a drawn line or arc, or a region, mm."""
    from gerbonara.graphic_objects import Flash, Region
    from gerbonara.utils import MM

    if isinstance(item, Flash):
        if id(item.aperture) not in flashes:
            flashes[id(item.aperture)] = _aperture_area(file, item.aperture)
        to_mm = item.unit.convert_to
        return affinity.translate(flashes[id(item.aperture)], to_mm(MM, item.x), to_mm(MM, item.y))
    (shape,) = item.to_primitives(MM)
    if isinstance(item, Region):
        path = Polyline(np.array([row for segment in shape.segments for row in _rows(*segment)]), closed=True)
        return _valid(path.flattened(_FINE))
    line = shapely.LineString(_stroke(item).flattened(_FINE))
    aperture = type(item.aperture).__name__
    if aperture == "CircleAperture":
        return _disc(line, 0.5 * shape.width)
    if aperture == "RectangleAperture" and not hasattr(item, "clockwise"):
        tool = _aperture_area(file, item.aperture)
        return shapely.union_all([affinity.translate(tool, *end) for end in line.coords]).convex_hull
    raise ReadError(file.path, Message("a line is drawn with a {}; only round pens are supported", aperture))


def _disc(geometry: Any, radius: float) -> Any:
    return geometry.buffer(radius, quad_segs=chords_per_quarter(radius, _FINE)) if radius > 0.0 else shapely.Polygon()


def _aperture_area(file: Source, aperture: Any) -> Any:
    """Return the area of an aperture that is flashed at the origin, mm."""
    from gerbonara.utils import MM

    kind = type(aperture).__name__
    if kind == "PolygonAperture":
        # gerbonara does not convert the angle, which is in degrees.
        aperture = replace(aperture, rotation=math.radians(aperture.rotation))
    corners = [getattr(aperture, "n_vertices", 3)]
    if kind == "ApertureMacroInstance":
        values = dict(enumerate(aperture.parameters, start=1))
        macro = aperture.macro.primitives
        if len(macro) > _MAX_PRIMITIVES or any(one.code in (6, 7) for one in macro):
            raise ReadError(file.path, Message("moiré and thermal macros are not supported; export the file anew"))
        outlines = [one.Calculator(one, values, MM).__enter__() for one in macro if one.code == 5]
        if any(one.rotation and (one.x or one.y) for one in outlines):  # gerbonara does not rotate the centre
            raise ReadError(file.path, Message("a rotated polygon beside the centre of a macro is not supported"))
        corners += [one.n_vertices for one in outlines]
    if not all(3 <= number <= _MAX_CORNERS for number in corners):
        raise ReadError(file.path, Message("a polygon aperture must have 3 to {} corners", _MAX_CORNERS))
    area: Any = shapely.Polygon()
    for shape in aperture.flash(0.0, 0.0, MM, True):
        own = _primitive_area(shape)
        area = area.union(own) if shape.polarity_dark else area.difference(own)
    return area


def _primitive_area(shape: Any) -> Any:
    kind = type(shape).__name__
    if kind == "Circle":
        return _disc(shapely.Point(shape.x, shape.y), shape.r)
    if kind == "Line":
        return _disc(shapely.LineString([(shape.x1, shape.y1), (shape.x2, shape.y2)]), 0.5 * shape.width)
    if kind == "Rectangle":
        x, y, w, h = shape.x, shape.y, 0.5 * shape.w, 0.5 * shape.h
        box = shapely.box(x - w, y - h, x + w, y + h)
        return affinity.rotate(box, shape.rotation, origin=(x, y), use_radians=True)
    path = Polyline(np.array([row for segment in shape.segments for row in _rows(*segment)]), closed=True)
    return _valid(path.flattened(_FINE))


def _valid(points: Any) -> Any:
    """Return a polygon without the lines that some CAD programs draw to the openings inside a region."""
    area = shapely.Polygon(points)
    return area if area.is_valid else shapely.union_all(polygons(shapely.make_valid(area)))


def _rows(
    start: tuple[float, float], end: tuple[float, float], arc: tuple[bool | None, tuple[float, float]]
) -> list[tuple[float, float, float]]:
    """Return the vertices of a line or an arc as rows x, y, bulge, without its end. An arc consists of two halves."""
    clockwise, (cx, cy) = arc
    if clockwise is None:
        return [(*start, 0.0)]
    first, last = (math.atan2(y - cy, x - cx) for x, y in (start, end))
    turn = (first - last if clockwise else last - first) % (2.0 * math.pi)
    turn = 2.0 * math.pi if math.dist(start, end) < 1e-6 else turn
    sign, radius = -1.0 if clockwise else 1.0, 0.5 * (math.dist(start, (cx, cy)) + math.dist(end, (cx, cy)))
    angle, bulge = first + sign * 0.5 * turn, sign * math.tan(turn / 8.0)
    return [(*start, bulge), (cx + radius * math.cos(angle), cy + radius * math.sin(angle), bulge)]


def _stroke(item: Any) -> Polyline:
    """Return the centre line of a drawn line or arc, mm."""
    from gerbonara.utils import MM

    (shape,) = item.to_primitives(MM)
    start, end = (shape.x1, shape.y1), (shape.x2, shape.y2)
    arc = (shape.clockwise, (shape.cx, shape.cy)) if hasattr(shape, "clockwise") else (None, (0.0, 0.0))
    rows = _rows(start, end, arc)
    closed = arc[0] is not None and math.dist(start, end) < 1e-6
    return Polyline(np.array(rows if closed else [*rows, (*end, 0.0)]), closed)


def _outline(file: Source, text: str) -> list[Contour]:
    """Return the centre lines of the board edge."""
    contours = []
    with parser_errors(file.path, Message("could not be read")):
        for item in _parsed(file, text).objects:
            kind = type(item).__name__
            if kind == "Region":
                area = _area(file, item, {})
                contours += [
                    Contour(as_polyline(one.exterior.coords, closed=True), layer=OUTLINE) for one in polygons(area)
                ]
            elif kind != "Flash" and (stroke := _stroke(item)).length > 0.0:
                contours.append(Contour(stroke, layer=OUTLINE))
    if not contours:
        raise ReadError(file.path, Message("the file of the board edge has no lines"))
    return contours


def _flashed_holes(file: Source, text: str) -> list[tuple[float, float, float]]:
    """Return the centre and radius of each hole in a drill file in Gerber format, mm."""
    from gerbonara.utils import MM

    holes = []
    for item in _parsed(file, text).objects:
        if type(item).__name__ != "Flash" or type(item.aperture).__name__ != "CircleAperture":
            raise ReadError(file.path, Message("slots in a Gerber drill file are not supported; export Excellon"))
        to_mm = item.unit.convert_to
        radius = 0.5 * item.aperture.equivalent_width(MM)
        holes.append((round(to_mm(MM, item.x), 6), round(to_mm(MM, item.y), 6), round(radius, 6)))
    return holes


def _drilled(file: Source, options: ReadOptions, issues: list[Issue]) -> list[Contour]:
    """Return the holes and slots of an Excellon file as closed contours."""
    try:
        part = read_excellon(file, ReadOptions(units=options.units))
    except EmptyDrillFile:
        return []
    issues += part.issues
    contours = [Contour(Polyline.circle(hole.x, hole.y, 0.5 * hole.diameter), layer=HOLES) for hole in part.holes]
    for slot in part.slots:
        across = np.subtract(slot.end, slot.start) / math.dist(slot.start, slot.end) * 0.5 * slot.width
        beside = np.array([across[1], -across[0]])
        corners = [slot.start + beside, slot.end + beside, slot.end - beside, slot.start - beside]
        rows = [(*corner, bulge) for corner, bulge in zip(corners, (0.0, 1.0, 0.0, 1.0), strict=True)]
        contours.append(Contour(Polyline(np.array(rows), closed=True), layer=SLOTS))
    return contours


def _mirrored(part: Part) -> tuple[Part, Issue]:
    """Mirror a board about the Y axis through its middle, or of the middle of everything if it has no outline."""
    edge = replace(part, contours=tuple(c for c in part.contours if c.layer == OUTLINE) or part.contours)
    x0, _, x1, _ = edge.extents
    factors, shift = np.array([-1.0, 1.0, -1.0]), np.array([x0 + x1, 0.0, 0.0])
    contours = tuple(replace(c, path=Polyline(c.path.vertices * factors + shift, c.path.closed)) for c in part.contours)
    words = Message(
        "the bottom side is mirrored about a line along Y through the middle of the board; turn it sideways"
    )
    return replace(part, contours=contours), Issue("L447", words, severity=Severity.NOTE)
