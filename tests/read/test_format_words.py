"""The words of formats: columns of tables, fields of maps, units, flags of blocks, and first bytes of files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import ezdxf
import pytest

from leafcut.options import ReadOptions
from leafcut.read import read, recognition
from leafcut.read.csvmap import read_csv
from leafcut.read.dxf_document import drawing_units
from leafcut.read.examples import read_example
from leafcut.read.format import Match, Source
from leafcut.read.recognition import picture_kind
from leafcut.read.xmlmap import read_xml

#: Field of a hole → names of its column in a table; of its attribute or element in a map.
COLUMNS = {
    "x": ["x"], "y": ["y"], "z": ["z"], "diameter": ["d", "dia", "Diam", "diameter", "size"],
    "handle": ["name", "ID", "label", "city"], "layer": ["layer", "Layer"],
}  # fmt: skip
FIELDS = {
    "x": ["x"], "y": ["y"], "diameter": ["d", "diameter", "dia", "diametro", "Diámetro"],
    "handle": ["name", "ID", "label", "nombre", "etiqueta"], "layer": ["layer", "capa"],
}  # fmt: skip
VALUES: dict[str, object] = {"x": 1.5, "y": 2.5, "diameter": 3.5, "z": -4.5, "handle": "A", "layer": "B"}


def written(names: dict[str, list[str]], field: str, name: str) -> dict[str, object]:
    """Return the values of a hole by the first name of each field, but `name` for one field."""
    return {name if key == field else words[0]: VALUES[key] for key, words in names.items()}


@pytest.mark.parametrize(("field", "name"), [(field, name) for field, names in COLUMNS.items() for name in names])
def test_a_column_of_a_table_is_known_by_each_of_its_names(field: str, name: str) -> None:
    cells = written(COLUMNS, field, name)
    text = f"{','.join(cells)}\n{','.join(map(str, cells.values()))}\n"
    (hole,) = read_csv(Source("a.csv", text.encode()), ReadOptions(units="mm")).holes
    assert {key: getattr(hole, key) for key in VALUES} == VALUES


@pytest.mark.parametrize(
    ("head", "x"),
    [
        ("x mm", 2), ("x_cm", 20), ("X[in]", 50.8), ("x (inch)", 50.8), ("x_[mil]", 0.0508), ("x  (m)", 2000),
        ("x(mm", 2), ("xmm", 2), ("x", 2),
    ],
)  # fmt: skip
def test_a_column_may_state_the_unit(head: str, x: float) -> None:
    (hole,) = read_csv(Source("a.csv", f"{head},y\n2,0\n".encode()), ReadOptions()).holes
    assert hole.x == pytest.approx(x)


@pytest.mark.parametrize(("field", "name"), [(field, name) for field, names in FIELDS.items() for name in names])
@pytest.mark.parametrize("tag", recognition.POINT_TAGS)
def test_a_field_of_a_map_is_known_by_each_of_its_names(tag: str, field: str, name: str) -> None:
    cells = written(FIELDS, field, name)
    attributes = "".join(f' {key}="{value}"' for key, value in cells.items())
    elements = "".join(f"<{key}>{value}</{key}>" for key, value in cells.items())
    text = f"<map><{tag}{attributes}/><{tag}>{elements}</{tag}></map>"
    for hole in read_xml(Source("a.xml", text.encode()), ReadOptions(units="mm")).holes:
        assert {key: getattr(hole, key) for key in FIELDS} == {key: VALUES[key] for key in FIELDS}


@pytest.mark.parametrize("key", ["units", "Unit", "unidades", "unidad"])
@pytest.mark.parametrize(
    ("word", "factor"),
    [
        ("mm", 1), ("millimeter", 1), ("millimetre", 1), ("milimetros", 1), ("milímetros", 1), ("in", 25.4),
        ("Inches", 25.4), ("pulgadas", 25.4), ("mils", 0.0254), ("feet", 304.8), ("meter", 1000), ("cm", 10),
    ],
)  # fmt: skip
def test_a_map_may_state_its_unit(key: str, word: str, factor: float) -> None:
    text = f'<map {key}="{word}"><hole x="2" y="0"/></map>'
    (hole,) = read_xml(Source("a.xml", text.encode()), ReadOptions()).holes
    assert hole.x == pytest.approx(2 * factor)


#: $INSUNITS of the DXF reference: mm per unit, and a name if it is a usual one. A survey foot is 1200/3937 m.
SURVEY_FOOT = 1_200_000 / 3937
UNITS = {
    1: (25.4, "in"), 2: (12 * 25.4, "ft"), 3: (5280 * 12 * 25.4, ""), 4: (1.0, "mm"), 5: (10.0, "cm"), 6: (1e3, "m"),
    7: (1e6, ""), 8: (25.4e-6, ""), 9: (0.0254, "mil"), 10: (36 * 25.4, ""), 11: (1e-7, ""), 12: (1e-6, ""),
    13: (1e-3, "µm"), 14: (100.0, ""), 15: (1e4, ""), 16: (1e5, ""), 21: (SURVEY_FOOT, ""), 22: (SURVEY_FOOT / 12, ""),
    23: (3 * SURVEY_FOOT, ""),
}  # fmt: skip


@pytest.mark.parametrize("code", range(25))
def test_a_drawing_has_the_unit_of_its_header(code: int) -> None:
    """Codes 17 to 20 are larger than any drawing."""
    document = SimpleNamespace(header={"$INSUNITS": code})
    factor, name = UNITS.get(code, (1.0, None))
    found = drawing_units(document, ReadOptions())
    assert found == (pytest.approx(factor, rel=1e-12), f"$INSUNITS {code}" if name == "" else name)
    assert drawing_units(document, ReadOptions(units="in")) == (25.4, "in")


def test_a_drawing_without_a_unit_has_none() -> None:
    assert drawing_units(SimpleNamespace(header={}), ReadOptions()) == (1.0, None)


@pytest.mark.parametrize(
    ("head", "kind"),
    [
        (b"\x89PNG\r\n\x1a\n.", "PNG"), (b"\xff\xd8\xff\xe0", "JPEG"), (b"BM1234\0\0\0\0!", "BMP"),
        (b"BM1234\0\0\0!", ""),
        (b"GIF89a", "GIF"), (b"II*\0.", "TIFF"), (b"MM\0*.", "TIFF"), (b"RIFF1234WEBPVP8", "WebP"),
        (b"RIFF1234WAVEfmt", ""), (b"RIFF123WEBP", ""), (b"BMW", ""), (b"", ""), (b"G21", ""),
    ],
)  # fmt: skip
def test_a_picture_is_known_by_its_first_bytes(head: bytes, kind: str) -> None:
    assert picture_kind(head) == kind
    assert recognition.sniff_picture(head) is (Match.YES if kind else Match.NO)


YES, MAYBE, NO = Match.YES, Match.MAYBE, Match.NO
BOM = b"\xef\xbb\xbf"
HEADS: dict[Callable[[bytes], Match], list[tuple[bytes, Match]]] = {
    recognition.sniff_dxf: [
        (b"AutoCAD Binary DXF\r\n\x1a\0", YES), (b"AutoCAD Binary DXF\r\n", NO), (b"0\nSECTION\n", YES),
        (b"  0 \r\n section\r\n", YES), (b"999\rtext\r0\rSECTION\r", YES), (b"10\nSECTION\n", NO), (b"0\nSECTIONS", NO),
        (b"x" * 4080 + b"\n0\nSECTION\n", YES), (b"x" * 4090 + b"\n0\nSECTION\n", NO), (b"0 SECTION", NO),
    ],
    recognition.sniff_svg: [
        (b"<svg>", YES), (b"<?xml?><s:svg xmlns='a'", YES), (b"<svg\n", YES), (b"<svgs>", NO), (b"svg>", NO),
        (b" " * 16379 + b"<svg>", YES), (b" " * 16380 + b"<svg>", NO), (b"<SVG>", NO),
    ],
    recognition.sniff_step: [
        (b"ISO-10303-21;", YES), (BOM + b" \t\r\nISO-10303-21;\n", YES), (b"ISO-10303-21", NO), (b"iso-10303-21;", NO),
    ],
    recognition.sniff_sirius: [
        (b'[{"partid": 1}]', YES), (BOM + b' [ {"a": 1, "partid"\n: 2}', YES), (b'{"partid": 1}', NO),
        (b'["partid"]', NO), (b'[{"PARTID": 1}]', NO),
    ],
    recognition.sniff_wkt: [
        (b"POINT (1 2)", YES), (BOM + b" srid = 4 ; polygon zm(", YES), (b"TIN EMPTY", YES), (b"POINT 1 2", NO),
        (b"POINTS (1 2)", NO), (b"CIRCLE (1 2)", NO), (b"a POINT (1 2)", NO), (b"POINT M (", YES),
        (b"POINT EMPTYS", NO),
    ],
    recognition.sniff_xml: [
        (b"<map>", MAYBE), (BOM + b" <?xml", MAYBE), (b"<map><CITY", YES), (b"<Point x='1'", YES), (b"<html>", NO),
        (b"<map><svg", NO), (b"<!DOCTYPE HTML>", NO), (b"map <city", NO), (b"", NO),
        *((b"<a><%s/>" % tag.encode(), YES) for tag in recognition.POINT_TAGS),
        (b"<a>" + b" " * 1992 + b"<html>", NO), (b"<a>" + b" " * 1993 + b"<html>", MAYBE),
    ],
    recognition.sniff_csv: [
        (b"1,2\n", MAYBE), (b"x,y\n1,2\n", MAYBE), (b"a,b\nc,d\n1,2\n", MAYBE), (b"a,b\nc,d\ne,f\n1,2\n", NO),
        (b"1\n", NO), (b"1,a\n", NO), (b"a,1\n", NO), (b"#a\n#b\n#c\n1;2,5\n", MAYBE), (b"1 2 3\n", MAYBE), (b"\0", NO),
        (b"1,2\0\n", NO), (b"", NO), (b"\n\n", NO), (b"a\n" * 50 + b"1,2\n" * 60, NO),
        (b"a\n" * 26 + b"1,2\n" * 26, NO),
        (b"a\n" * 25 + b"1,2\n" * 60, MAYBE),
    ],
    recognition.sniff_tsplib: [
        (b"NAME: a\nDIMENSION: 2\n", YES), (b" name a\n\tdimension 2", YES), (b"NAME: a\nTYPE: TSP", NO),
        (b"DIMENSION: 2", NO), (b"DIMENSION: 2\nDIMENSION: 2", NO), (b"COMMENT a\nDIMENSION", YES),
        (b"EDGE_WEIGHT_TYPE: A\nDIMENSION", YES), (b"NODE_COORD_SECTION\nDIMENSION", YES), (b"TYPE\nDIMENSION", YES),
        (b"NAMES: a\nDIMENSION: 2\n", NO), (b"NAME: a\nDIMENSION: 2\nGTSP_SETS: 3", NO), (b"aNAME\nDIMENSION", NO),
    ],
    recognition.sniff_gtsp: [
        (b"NAME: a\ngtsp_sets: 3", YES), (b"GTSP_SETS", YES), (b"a GTSP_SETS", NO), (b"GTSP_SETSX", NO),
        (b" " * 4086 + b"\nGTSP_SETS", YES), (b" " * 4087 + b"\nGTSP_SETS", NO),
    ],
    recognition.sniff_excellon: [
        (b"M48\nT1C1\n", YES), (b"M48 \rMETRIC\r", YES), (b"M48\nINCH", YES), (b"M48\nM71", YES), (b"M48\nM72", YES),
        (b"M48\nFMAT,2", YES), (b"M48\n", NO), (b"M480\nT1C1\n", NO), (b"T1C.5\nX1Y2\n", YES), (b"T1C1\nX1\n", NO),
        (b"T1C1\nX1Y2\nG1Z-1\n", MAYBE), (b"T1C1\nX1Y2\nS900 M3\n", MAYBE), (b"T1C1\nX1Y2\nM06\n", MAYBE),
        (b"T1C1\nX1Y2\nM30\n", YES), (b"T1C1\nX1Y2\nG0X1\nG5\nG85\nG90\nG93\n", YES), (b"T1C1\nX1Y2\nG81\n", MAYBE),
        (b"T1C1\nX1Y2\nG40\nG41\nG42\n", YES), (b"T1C1\nX1Y2\nG43\n", MAYBE), (b"T1C1\nX1Y2\n;Z\n(Z)\n", YES),
        (b"T1\nX1Y2\n", YES), (b"T1\nX1Y2\nG0X1\n", NO), (b"T1\nX1Y2\nZ1\n", NO), (b"T1 M6\nX1Y2\n", NO),
        (b"T1234567\nX1Y2\n", NO), (b"X1Y2\n", NO), (b"T1\nX-1.5Y+2 \n", YES), (b"T1\nX1Y2 Z3\n", NO),
        (b"T1\nX1Y2\n;G81\n", YES), (b"T1C1\nX1Y2\nM3\nMETRICZ\n", MAYBE), (b"METRIC,TZ\nT1C1Z\nX1Y2\nM71Z\n", YES),
    ],
    recognition.sniff_gcode: [
        (b"G21\n", MAYBE), (b"M3 S900\n", MAYBE), (b"X1\n", NO), (b"hello\nG1\n", NO),
        (b"G1\n\n" * 4 + b"hello\n", MAYBE),
        (b"G1\n" * 3 + b"hello\n", NO), (b"g1 x[#1]\n", MAYBE), (b"(G1 X1)\n", MAYBE), (b"G1000\n", NO),
        (b"G0001\n", MAYBE),
        (b"%\nO100\n#1=2\n/G1 X-.5 (a)\nN10 G1;b\n", MAYBE), (b"G1\0\n", NO), (b"", NO), (b"\n", NO),
        (b"X1\n" * 60 + b"G1\n", NO), (b"X1\n" * 59 + b"G1\n", MAYBE), (b"G1 " + b"X12" * 120 + b"?\n", MAYBE),
        (b"o<a> sub\nG1\n", MAYBE),
    ],
}  # fmt: skip


@pytest.mark.parametrize("sniff", HEADS, ids=lambda sniff: sniff.__name__)
def test_a_format_is_recognised_by_its_first_bytes(sniff: Callable[[bytes], Match]) -> None:
    assert [(head, sniff(head)) for head, _ in HEADS[sniff]] == HEADS[sniff]


def test_the_ten_points_of_the_first_example_are_those_of_the_documents() -> None:
    part = read_example(Source("example:Ten_Points", b""), ReadOptions())
    assert [(hole.x, hole.y, hole.diameter) for hole in part.holes] == [
        (12, 64, 0),
        (78, 18, 0),
        (45, 90, 0),
        (90, 72, 0),
        (24, 20, 0),
        (60, 52, 0),
        (8, 38, 0),
        (96, 44, 0),
        (36, 58, 0),
        (70, 88, 0),
    ]
    assert (part.name, part.source, part.format, part.units) == ("ten-points", "example:ten-points", "example", "mm")


def test_a_random_map_has_its_number_and_seed_as_its_name() -> None:
    part = read_example(Source("random:9:5", b""), ReadOptions())
    assert (part.name, part.source, len(part.holes)) == ("random-9-5", "random:9:5", 9)
    assert read_example(Source("random:9", b""), ReadOptions()).source == "random:9:1"
    assert len(read_example(Source("random:1:4294967295", b""), ReadOptions()).holes) == 1
    assert max(max(hole.x, hole.y) for hole in read_example(Source("random:9:5", b""), ReadOptions()).holes) <= 30


@pytest.mark.parametrize(("flags", "holes"), [(0, 1), (1, 1), (2, 1), (64, 1), (4, 0), (5, 0)])
def test_a_block_of_another_drawing_is_missing(flags: int, holes: int, tmp_path: Path) -> None:
    """Bit 4 of the flags marks an external reference; 1 an anonymous block, 2 a block with attributes."""
    document = ezdxf.new(units=4)
    block = document.blocks.new("BLOCK")
    block.add_circle((1, 2), 3)
    document.modelspace().add_circle((50, 50), 4)
    document.modelspace().add_blockref("BLOCK", (10, 20))
    block.block.dxf.flags = flags
    document.saveas(tmp_path / "a.dxf")
    part = read(tmp_path / "a.dxf")
    assert sorted((hole.x, hole.y, hole.diameter) for hole in part.holes) == [(11, 22, 6)] * holes + [(50, 50, 8)]
    assert [issue.code for issue in part.issues if issue.code == "L206"] == ["L206"] * (1 - holes)
