"""Read XML point maps: ``<map units="mm"><city name="A" x="1" y="2"/></map>``, with attributes or child elements.

The root element may have any name. Points are elements named city, point, hole or node, or in Spanish ciudad, punto,
agujero or nodo; ``diameter`` (or ``d``) is optional. Entities are refused (defusedxml), so a map can neither grow in
memory nor read other files.
"""

from __future__ import annotations

import io
import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any
from xml.sax.handler import ContentHandler

from leafcut.errors import ReadError, name_suggestion, printable
from leafcut.message import Message
from leafcut.model.issue import Issue, MissingWork
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read.filter_holes import part_of_points
from leafcut.read.format import (
    MAX_COORDINATE,
    MAX_HOLES,
    Source,
    convert_xml_errors,
    drawing_unit_mm,
    to_mm,
    too_many_holes_error,
)
from leafcut.read.recognition import POINT_TAGS
from leafcut.units import MM_PER_UNIT

#: Maps the name of an attribute or element to a field of a point. The last five names are Spanish.
FIELDS = {
    "x": "x",
    "y": "y",
    "d": "d",
    "diameter": "d",
    "dia": "d",
    "name": "name",
    "id": "name",
    "label": "name",
    "layer": "layer",
    "diametro": "d",
    "diámetro": "d",
    "nombre": "name",
    "etiqueta": "name",
    "capa": "layer",
}
UNIT_WORDS = {"millimeter": "mm", "millimetre": "mm", "inches": "in", "mils": "mil", "feet": "ft", "meter": "m"}
UNIT_WORDS |= {"milimetros": "mm", "milímetros": "mm", "pulgadas": "in"}
UNIT_KEYS = ("units", "unit", "unidades", "unidad")


@dataclass
class _Point:
    line: int
    values: dict[str, str] = field(default_factory=dict)
    #: The field of the current child element.
    current: str = ""
    holds_points: bool = False


class _Map(ContentHandler):
    """Collects the points of a map while its XML is parsed."""

    def __init__(self, source: Source) -> None:
        super().__init__()
        self.path, self.on_progress = source.path, source.on_progress
        self.units: str | None = None
        self.root = ""
        self.points: list[_Point] = []
        self.open: list[_Point] = []
        self.tags: Counter[str] = Counter()

    def startElement(self, name: str, attrs: Any) -> None:
        self.on_progress()
        tag, line = _name_without_namespace(name), self._locator.getLineNumber()  # type: ignore[attr-defined]
        attributes = {_name_without_namespace(key): str(value) for key, value in attrs.items()}
        if not self.root:
            self.root = tag
            self._read_units(attributes, line)
        if tag in POINT_TAGS:
            if self.open:
                self.open[-1].holds_points = True
            self.open.append(_Point(line, {FIELDS[k]: v for k, v in attributes.items() if k in FIELDS}))
        elif self.open:
            self.open[-1].current = FIELDS.get(tag, "")
        else:
            self.tags[tag] += 1

    def characters(self, content: str) -> None:
        if self.open and (name := self.open[-1].current):
            self.open[-1].values[name] = self.open[-1].values.get(name, "") + content

    def endElement(self, name: str) -> None:
        if not self.open:
            return
        if _name_without_namespace(name) in POINT_TAGS:
            point = self.open.pop()
            if not point.holds_points or "x" in point.values:
                self.points.append(point)
            if len(self.points) > MAX_HOLES:
                raise too_many_holes_error(self.path)
        else:
            self.open[-1].current = ""

    def _read_units(self, attributes: dict[str, str], line: int) -> None:
        unit_text = next((attributes[key] for key in UNIT_KEYS if key in attributes), None)
        if unit_text is None:
            return
        word = unit_text.strip().lower()
        self.units = UNIT_WORDS.get(word, word)
        if self.units not in MM_PER_UNIT:
            known = [u for u in MM_PER_UNIT if u != '"']
            raise ReadError(
                self.path, Message("unknown units '{}'{}", printable(unit_text), name_suggestion(word, known)), line
            )


def read_xml(source: Source, options: ReadOptions) -> Part:
    """Read the points of an XML map as holes, in mm.

    Raises
    ------
    ReadError
        The file is not well-formed XML, declares entities, has unknown units, or contains no points.
    """
    point_map = _parse_map(source)
    if not point_map.points:
        tags = ", ".join(f"{n} <{printable(t, 30)}>" for t, n in list(point_map.tags.items())[:5])
        raise ReadError(
            source.path,
            Message("no points: expected <{}>, found {}", ">, <".join(POINT_TAGS), tags or Message("nothing")),
        )
    factor = drawing_unit_mm(options, point_map.units)
    holes, issues = [], []
    for point in point_map.points:
        try:
            holes.append(_hole_of_element(point, factor))
        except ValueError as problem:
            place = f"{source.file_name}:{point.line}"
            issues.append(Issue("L203", Message("point skipped: {}", problem), place, missing=MissingWork("hole")))
    if not holes:
        raise ReadError(source.path, Message("no usable points: {}", issues[0].message), point_map.points[0].line)
    return part_of_points(source, holes, issues, options, "xml", point_map.units, Message("the map"))


def _hole_of_element(point: _Point, factor: float) -> Hole:
    numbers = {}
    for name in ("x", "y", "d"):
        text = point.values.get(name, "0" if name == "d" else "").strip()
        if not text:
            raise ValueError(Message("no {}", name))
        try:
            numbers[name] = to_mm(float(text), factor)
        except ValueError:
            raise ValueError(Message("{} is '{}'", name, printable(text, 20))) from None
    if not all(abs(v) <= MAX_COORDINATE for v in numbers.values()) or numbers["d"] < 0 or math.isnan(numbers["d"]):
        raise ValueError(
            Message("x {:g}, y {:g}, diameter {:g} mm is out of range", numbers["x"], numbers["y"], numbers["d"])
        )
    values = {k: " ".join(v.split())[:100] for k, v in point.values.items()}
    return Hole(numbers["x"], numbers["y"], numbers["d"], values.get("layer", ""), values.get("name", ""))


def _parse_map(source: Source) -> _Map:
    from defusedxml.expatreader import DefusedExpatParser

    point_map = _Map(source)
    parser = DefusedExpatParser(forbid_dtd=False, forbid_entities=True, forbid_external=True)
    parser.setContentHandler(point_map)
    with convert_xml_errors(source.path, Message("which a map does not need")):
        parser.parse(io.BytesIO(source.data))
    return point_map


def _name_without_namespace(name: str) -> str:
    """Return the name of an element without its namespace, in lower case."""
    return name.rpartition(":")[2].lower()
