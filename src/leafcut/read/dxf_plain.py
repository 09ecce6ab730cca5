"""Plain DXF drawings read without ezdxf: text without damage whose model space holds points, lines, circles and arcs.

To import ezdxf takes longer than all else that a plate of seventy holes asks for, so it is left to the drawings that
need it. The plain ones are most of what is drilled and cut. What is not certain to be understood as ezdxf does it (a
block, a text, a turned plane, a letter beyond ASCII, anything to repair) is not read here at all.

Source: DXF Reference, "Group Codes in Numerical Order"; what ezdxf 1.4 does with each tag (``recover``, ``dxfns``).
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from leafcut.model.heartbeat import Heartbeat

#: One tag, its value as its group code says: text, a whole number or another.
Tag = tuple[int, Any]

#: What each version calls itself, from R12 to R2018; R12 has neither subclasses nor owners.
_R12 = "AC1009"
_VERSIONS = {_R12, "AC1012", "AC1014", "AC1015", "AC1018", "AC1021", "AC1024", "AC1027", "AC1032"}
_SECTIONS = {"HEADER", "CLASSES", "TABLES", "BLOCKS", "ENTITIES", "OBJECTS", "ACDSDATA", "THUMBNAILIMAGE"}
#: R12 may not have these.
_LATER_SECTIONS = {"CLASSES", "OBJECTS", "ACDSDATA"}
#: Layouts whose entities stand in the section ENTITIES; R12 has other names for them.
_LAYOUTS = {"*model_space", "*paper_space", "$model_space", "$paper_space"}

#: Escapes for letters, which ezdxf decodes.
_ESCAPE = re.compile(rb"\\[UM]\+")
_HANDLE = re.compile(r"[1-9A-F][0-9A-F]*")

#: Group codes of numbers, and of bytes as hexadecimal digits.
_FLOATS = (range(10, 60), range(110, 150), range(210, 240), range(460, 470), range(1010, 1060))
_INTS = (
    range(60, 80), range(90, 100), range(160, 180), range(270, 300), range(370, 390), range(400, 410),
    range(420, 430), range(440, 460), range(1060, 1072),
)  # fmt: skip
_BYTES = (range(310, 320), (1004,))
_VALUE: dict[int, Any] = {
    **{code: float for codes in _FLOATS for code in codes},
    **{code: int for codes in _INTS for code in codes},
    **{code: bytes.fromhex for codes in _BYTES for code in codes},
}

_COMMENT, _GROUP, _EMBEDDED, _SUBCLASS, _FIRST_EXTENDED = 999, 102, 101, 100, 1000

#: By type of entity: its subclasses, and the names that its values have in ezdxf by group code; places by that of x.
_KINDS: dict[str, tuple[list[str], dict[int, str]]] = {
    "POINT": (["AcDbPoint"], {10: "location"}),
    "LINE": (["AcDbLine"], {10: "start", 11: "end"}),
    "CIRCLE": (["AcDbCircle"], {10: "center", 40: "radius"}),
    "ARC": (["AcDbCircle", "AcDbArc"], {10: "center", 40: "radius", 50: "start_angle", 51: "end_angle"}),
    "LWPOLYLINE": (["AcDbPolyline"], {38: "elevation", 70: "flags"}),
}
_OF_ALL = {5: "handle", 8: "layer", 60: "invisible"}
_OWNER, _PAPER, _ELEVATION, _BULGE, _NORMAL = 330, 67, 38, 42, 210
#: What a polyline may hold of its own, beside the widths, names and bulges of its vertices, which are not told twice.
_OF_VERTICES = {40, 41, _BULGE, 91}
_ONCE_OF_POLYLINE = {38, 39, 43, 70, 90}
_UP = (0.0, 0.0, 1.0)


class NotPlainError(ValueError):
    """The drawing is one for ezdxf."""


class PlainPlace(NamedTuple):
    """A place, as ezdxf has it."""

    x: float
    y: float
    z: float

    @property
    def xyz(self) -> tuple[float, float, float]:
        """The place as a plain tuple."""
        return (self.x, self.y, self.z)


class PlainValues(dict[str, Any]):
    """The values of an entity that its drawing states, by their names in ezdxf."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"no {name}") from None

    hasattr = dict.__contains__


class _Upright:
    """The plane of an entity that is not turned."""

    transform = False


_UPRIGHT = _Upright()


class PlainEntity:
    """An entity, asked as one of ezdxf."""

    def __init__(self, kind: str, dxf: PlainValues, points: list[tuple[float, float, float]]) -> None:
        self._kind, self.dxf, self._points = kind, dxf, points

    def dxftype(self) -> str:
        """Return its type."""
        return self._kind

    def ocs(self) -> _Upright:
        """Return the plane that it lies in."""
        return _UPRIGHT

    def has_xdata(self, _application: str) -> bool:
        """Return whether it has extended data; what has some is not read here."""
        return False

    @property
    def closed(self) -> bool:
        """Whether a polyline ends where it begins."""
        return bool(self.dxf.get("flags", 0) & 1)

    def get_points(self, _words: str) -> list[tuple[float, float, float]]:
        """Return (x, y, bulge) of the vertices of a polyline."""
        return self._points


class PlainLayer:
    """A layer, asked as one of ezdxf."""

    def __init__(self, name: str, flags: int, color: int) -> None:
        self.dxf = PlainValues(name=name)
        self._flags, self._color = flags, color

    def is_frozen(self) -> bool:
        """Return whether nothing on it is seen, blocks that are inserted on it included."""
        return bool(self._flags & 1)

    def is_off(self) -> bool:
        """Return whether nothing on it is seen."""
        return self._color < 0


class PlainDrawing:
    """A drawing, asked as a document of ezdxf."""

    #: It inserts none.
    blocks: Mapping[str, Any] = {}

    def __init__(self, header: dict[str, Any], layers: list[PlainLayer], entities: list[PlainEntity]) -> None:
        self.header, self.layers, self._entities = header, layers, entities

    def modelspace(self) -> list[PlainEntity]:
        """Return the entities of model space, in the order of the drawing."""
        return self._entities


def read_plain(data: bytes, look: Heartbeat) -> PlainDrawing | None:
    """Return a drawing from the text of its file; None where ezdxf has to read it."""
    if not data.isascii() or _ESCAPE.search(data):
        return None
    text = data.decode("ascii").replace("\r\n", "\n")
    if "\r" in text:
        return None
    try:
        return _drawing(_sections(text, look), look)
    except ValueError:  # raised here, or by the first number that is none
        return None


def _check(fine: bool) -> None:
    if not fine:
        raise NotPlainError


def _sections(text: str, look: Heartbeat) -> dict[str, list[list[Tag]]]:
    """Return the sections by name, each as its records: the tags from one group code 0 to the next."""
    sections: dict[str, list[list[Tag]]] = {}
    section: list[list[Tag]] | None = None
    record: list[Tag] = []
    lines = text.split("\n")
    convert = _VALUE.get
    for code, word in zip(map(int, lines[::2]), lines[1::2], strict=False):
        if code == 0:
            look()
            if word == "SECTION":
                _check(section is None)
                section = [record := [(0, word)]]
            elif word == "ENDSEC":
                _check(section is not None and len(section[0]) > 1 and section[0][1][0] == 2)
                name = section[0][1][1]  # type: ignore[index]
                _check(name in _SECTIONS and name not in sections)
                sections[name], section = section, None  # type: ignore[assignment]
            elif word == "EOF":
                _check(section is None)
                return sections
            else:
                _check(section is not None and word == word.strip().upper())
                section.append(record := [(0, word)])  # type: ignore[union-attr]
        elif code != _COMMENT:
            _check(section is not None)
            kind = convert(code)
            record.append((code, word if kind is None else kind(word)))
    raise NotPlainError


def _drawing(sections: dict[str, list[list[Tag]]], look: Heartbeat) -> PlainDrawing:
    header = _header(sections.get("HEADER", []))
    version = header.get("$ACADVER", _R12)
    _check(version in _VERSIONS and not (version == _R12 and _LATER_SECTIONS & set(sections)))
    tables = sections.get("TABLES", [])[1:]
    spaces = [_one(tags, 5) for tags in tables if tags[0][1] == "BLOCK_RECORD" and _named(tags) == "*paper_space"]
    _check(_blocks_alone(sections.get("BLOCKS", [])[1:]) and len(spaces) <= 1)
    layers = [_layer(tags) for tags in tables if tags[0][1] == "LAYER"]
    _check(len({layer.dxf.name.casefold() for layer in layers}) == len(layers))
    entities = []
    records = sections.get("ENTITIES", [])[1:]
    for number, tags in enumerate(records):
        look(number / len(records))
        entities.append(_entity(tags, version == _R12, spaces))
    handles = []
    for tags in _records(sections):
        look()
        _check_structure(tags)
        handles += [value for code, value in tags if code == 5]
    _check(len(set(handles)) == len(handles))
    return PlainDrawing(header, layers, entities)


def _records(sections: dict[str, list[list[Tag]]]) -> Iterator[list[Tag]]:
    """Yield every record whose handle nothing else may have; those of dimension styles have another group code."""
    for name in ("TABLES", "BLOCKS", "ENTITIES", "OBJECTS"):
        for tags in sections.get(name, [])[1:]:
            if tags[0][1] != "DIMSTYLE":
                yield tags


def _check_structure(tags: list[Tag]) -> None:
    """Check what holds for every record: groups of applications are closed, and extended data stand at the end."""
    codes = [code for code, _ in tags]
    if _GROUP in codes and tags[0][1] != "XRECORD":
        _without_groups(tags)
    if codes and max(codes) >= _FIRST_EXTENDED:
        first = next(place for place, code in enumerate(codes) if code >= _FIRST_EXTENDED)
        _check(codes[first] == 1001 and min(codes[first:]) >= _FIRST_EXTENDED)


def _header(section: list[list[Tag]]) -> dict[str, Any]:
    """Return the variables of the header: a name, and one value or the two or three of a place."""
    if not section:
        return {}
    _check(len(section) == 1)
    found: dict[str, Any] = {}
    name = ""
    for code, value in section[0][2:]:
        if code == 9:
            _check(value.startswith("$") and value not in found and (not name or name in found))
            name = value
        elif name not in found:
            _check(name != "$INSUNITS" or code == 70)
            found[name] = value
        else:
            _check(code in (20, 30))
    _check(not name or name in found)
    return found


def _one(tags: list[Tag], code: int, default: Any = None) -> Any:
    """Return the only value of a group code."""
    values = [value for own, value in tags if own == code]
    _check(len(values) == 1 or (not values and default is not None))
    return values[0] if values else default


def _named(tags: list[Tag]) -> str:
    name: str = _one(tags, 2)
    return name.lower()


def _layer(tags: list[Tag]) -> PlainLayer:
    tags = [tag for tag in _without_groups(tags) if tag[0] < _FIRST_EXTENDED]
    return PlainLayer(_one(tags, 2), _one(tags, 70, 0), _one(tags, 62, 7))


def _blocks_alone(records: list[list[Tag]]) -> bool:
    """Return whether no block holds what belongs into a layout."""
    inside = ""
    for tags in records:
        kind = tags[0][1]
        if kind == "BLOCK":
            inside = _named(tags)
        elif kind == "ENDBLK":
            inside = ""
        elif inside in _LAYOUTS or not inside:
            return False
    return True


def _without_groups(tags: list[Tag]) -> list[Tag]:
    """Return tags without the groups that applications have put between braces."""
    if _GROUP not in [code for code, _ in tags]:
        return tags
    kept, depth = [], 0
    for code, value in tags:
        if code == _GROUP:
            _check(value.startswith("{") if depth == 0 else value == "}")
            depth = 1 - depth
        elif not depth:
            kept.append((code, value))
    _check(depth == 0)
    return kept


def _entity(tags: list[Tag], r12: bool, paper_spaces: list[str]) -> PlainEntity:
    """Return an entity of model space; its tags begin with its type."""
    kind: str = tags[0][1]
    _check(kind in _KINDS and not (r12 and kind == "LWPOLYLINE"))
    subclasses, names = _KINDS[kind]
    own = _without_groups(tags[1:])
    _check(all(code < _FIRST_EXTENDED and code != _EMBEDDED for code, _ in own))
    marks = [value for code, value in own if code == _SUBCLASS]
    _check(marks == ([] if r12 else ["AcDbEntity", *subclasses]))
    names = names | _OF_ALL
    dxf, points = PlainValues(), []
    known = _ONCE_OF_POLYLINE if kind == "LWPOLYLINE" else {_ELEVATION}
    seen: set[int] = set()
    place = 0
    while place < len(own):
        code, value = own[place]
        place += 1
        if code in (10, 11, _NORMAL):
            place, spot = _place(own, place - 1)
            if code == _NORMAL:
                _check(spot == _UP)
            elif kind == "LWPOLYLINE":
                _check(code == 10)
                points.append((spot.x, spot.y, 0.0))
                continue
            value = spot
        _check(not 12 <= code < 38 and not 211 <= code < 240)
        if kind == "LWPOLYLINE" and code in _OF_VERTICES:
            if code == _BULGE:
                _check(math.isfinite(value) and bool(points))
                points[-1] = (*points[-1][:2], value)
            continue
        if code in names or code in known or code in (_OWNER, _PAPER, _NORMAL):
            _check(code not in seen)
            seen.add(code)
        if code in names:
            _check(not isinstance(value, float) or math.isfinite(value))
            dxf[names[code]] = value
        elif code == _PAPER:
            _check(value == 0)
        elif code == _OWNER:
            _check(not r12 and value not in paper_spaces)
        else:
            _check(code != _ELEVATION)
    _check(bool(_HANDLE.fullmatch(dxf.get("handle", ""))) and "layer" in dxf)
    return PlainEntity(kind, dxf, points)


def _place(tags: list[Tag], first: int) -> tuple[int, PlainPlace]:
    """Return a place from tags that say x, y and perhaps z, and where the tags behind it begin."""
    code, x = tags[first]
    _check(first + 1 < len(tags) and tags[first + 1][0] == code + 10)
    y, z, behind = tags[first + 1][1], 0.0, first + 2
    if behind < len(tags) and tags[behind][0] == code + 20:
        z, behind = tags[behind][1], behind + 1
    _check(all(map(math.isfinite, (x, y, z))))
    return behind, PlainPlace(x, y, z)
