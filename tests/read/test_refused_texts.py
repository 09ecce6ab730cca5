"""Small faulty files of each text format, and the whole refusal or reading of each: `tables/refused.txt`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from test_whole_parts import lines_of

from leafcut.errors import LeafcutError
from leafcut.read import read, read_contours, read_pockets
from leafcut.read.format import load_source
from leafcut.read.nest_list import read_drawings_to_nest
from leafcut.read.strip_instance import read_strip_instance
from leafcut.read.time_table import parse_stopwatch_time, read_times
from plain_text import text_of

TABLES = Path(__file__).parent / "tables"


def tsp(**changed: str) -> str:
    """Return a TSPLIB file of three nodes with changed fields; an empty one is left out."""
    fields = {
        "NAME": "x",
        "TYPE": "TSP",
        "DIMENSION": "3",
        "EDGE_WEIGHT_TYPE": "EUC_2D",
        "NODES": "1 0 0\n2 3 4\n3 6 8\n",
    } | changed
    nodes = fields.pop("NODES")
    head = "".join(f"{key} : {value}\n" for key, value in fields.items() if value)
    return f"{head}NODE_COORD_SECTION\n{nodes}EOF\n"


def parts(reader: Callable[..., Any], *arguments: Any) -> Callable[[Path], list[str]]:
    """Return a function that lists the fields of the part in a file."""
    return lambda file: [line.replace(str(file), file.name) for line in lines_of(reader(file, *arguments))]


def strip(text: str) -> str:
    """Return a strip instance with one item of these fields."""
    return '{"name": "s", "items": [{' + text + "}]}"


SQUARE = '"shape": {"type": "simple_polygon", "data": [[0,0],[2,0],[2,1]]}'
HEAD = "M48\nMETRIC,TZ\nT1C1.0\n%\nT1\n"
SVG, LINE = '<svg xmlns="http://www.w3.org/2000/svg" ', '<line x2="9"/></svg>'


def times_of(file: Path) -> list[str]:
    """Return the programs and times of a table."""
    return [f"{name.replace(str(file.parent), '')} {text_of(seconds)}" for name, seconds in read_times(file)]


#: Name of a file → its texts.
TEXTS: dict[str, tuple[Callable[[Path], list[str]], list[str]]] = {
    "a.tsp": (
        parts(read),
        [
            tsp(),
            tsp(NAME=""),
            tsp(TYPE=""),
            tsp(TYPE="ATSP"),
            tsp(TYPE="TOUR"),
            tsp(DIMENSION=""),
            tsp(DIMENSION="0"),
            tsp(DIMENSION="x"),
            tsp(DIMENSION="1"),
            tsp(DIMENSION="4"),
            tsp(DIMENSION="2"),
            tsp(DIMENSION="9999999999"),
            tsp(EDGE_WEIGHT_TYPE=""),
            tsp(EDGE_WEIGHT_TYPE="XRAY1"),
            tsp(EDGE_WEIGHT_TYPE="GEO"),
            tsp(EDGE_WEIGHT_TYPE="CEIL_2D"),
            tsp(EDGE_WEIGHT_TYPE="EXPLICIT"),
            tsp(NODES="1 0 0\n1 3 4\n3 6 8\n"),
            tsp(NODES="1 0 0\n2 3\n3 6 8\n"),
            tsp(NODES="1 0 0\n2 x 4\n3 6 8\n"),
            tsp(NODES="1 0 0\n2 3 1e99\n3 6 8\n"),
            tsp(NODES="1 0 0\n2 3 nan\n3 6 8\n"),
            tsp(NODES="0 0 0\n2 3 4\n3 6 8\n"),
            tsp(BAD_KEY="1"),
            tsp(COMMENT="a").replace("EOF\n", ""),
            tsp().replace("NODE_COORD_SECTION", "TOUR_SECTION"),
        ],
    ),
    "a.gtsp": (
        parts(read),
        [
            tsp(TYPE="GTSP", GTSP_SETS="2") + "GTSP_SET_SECTION\n1 1 2 -1\n2 3 -1\n",
            tsp(TYPE="GTSP", GTSP_SETS="2").replace("EOF\n", "GTSP_SET_SECTION\n1 1 2 -1\n2 3 -1\nEOF\n"),
            tsp(TYPE="GTSP", GTSP_SETS="3").replace("EOF\n", "GTSP_SET_SECTION\n1 1 2 -1\n2 3 -1\nEOF\n"),
            tsp(TYPE="GTSP", GTSP_SETS="2").replace("EOF\n", "GTSP_SET_SECTION\n1 1 -1\n2 3 -1\nEOF\n"),
            tsp(TYPE="GTSP", GTSP_SETS="2").replace("EOF\n", "GTSP_SET_SECTION\n1 1 2 -1\n2 2 3 -1\nEOF\n"),
            tsp(TYPE="GTSP", GTSP_SETS="2").replace("EOF\n", "GTSP_SET_SECTION\n1 1 2 -1\n2 9 -1\nEOF\n"),
            tsp(TYPE="GTSP", GTSP_SETS="2").replace("EOF\n", "GTSP_SET_SECTION\n1 1 2\nEOF\n"),
            tsp(TYPE="GTSP"),
        ],
    ),
    "a.wkt": (
        parts(read_pockets),
        [
            "",
            "x",
            "POINT (1 2)",
            "LINESTRING (0 0, 1 1)",
            "POLYGON EMPTY",
            "POLYGON ((0 0, 1 0, 1 1))",
            "POLYGON ((0 0, 9 0, 9 9, 0 0)",
            "srid = 4326 ; POLYGON ((0 0, 9 0, 9 9, 0 0))",
            "POLYGON ((0 0, 9 9, 9 0, 0 9, 0 0))",
            "\nPOLYGON Z ((0 0 5, 9 0 5, 9 9 5, 0 0 5))",
            "POLYGON ((0 0, 1e9 0, 9 9, 0 0))\n",
            "# a remark\n\nPOLYGON ((0 0, 9 0, 9 9, 0 0))\nPOLYGON ((1 1, 2 1))",
            "POLYGON ((0 0, 9 0, 9 9, 0 0), (20 20, 21 20, 21 21, 20 20))",
            "POLYGON ((0 0, 9 0, 9 9, 0 0))\nPOLYGON ((1 0.5, 8 0.5, 8 7, 1 0.5))",
        ],
    ),
    "a.csv": (
        parts(read),
        [
            "",
            "x,y\n",
            "x,y\n1,2\n",
            "1,2\n3,4\n",
            "x\ty\td\n1\t2\t3\n",
            "y;x\n1;2\n",
            "x,y,d\n1,2\n3,nan,1\n",
            "a,b\n1,2\n",
            "x,y [in]\n1,1\n",
            "x (in),y (in),d (in)\n1,1,0.25\n",
            "# c\nx,y,name\n1,2,A\n",
            "x,y\n1e9,2\n",
            "1 2\n3 4\n",
            "x,y,d\n1,2,1001\n5,6,2\n",
        ],
    ),
    "a.xml": (
        parts(read),
        [
            "<map/>",
            "<map><city x='1' y='2'/></map>",
            "<map units='in'><point x='1' y='2' diameter='0.5'/></map>",
            "<map units='ell'><point x='1' y='2'/></map>",
            "<map><city x='1'/></map>",
            "<map><city",
            "<mapa><ciudad x='1' y='2'/></mapa>",
            "<map><city name='A' x='1e9' y='2'/><city x='3' y='4'/></map>",
            "<map><hole x='1' y='2' diameter='-1'/></map>",
            "<!DOCTYPE a [<!ENTITY b 'c'>]><map><city x='1' y='2'/></map>",
        ],
    ),
    "a.dbs.json": (
        parts(read_contours),
        [
            "",
            "[]",
            "{}",
            "[1]",
            '[{"paths": 1}]',
            '[{"paths": []}]',
            '[{"partid": "A", "paths": [[[0,0],[1,0]]]}]',
            '[{"partid": "A", "paths": [[[0,0]], [[0,0],[1e9,0]], [["a",0],[1,0]], [[0,0],[1,0],[0,0,0]]]}]',
            '[{"paths": [[[0,0],[9,0],[9,9],[0,0]]]}, {"partid": "B", "paths": [[[1,1],[2,1,1],[1,1]]]}]',
            '[{"paths": [[[0,0],[9,0],[9,9],[0,0]]]}, {"partid": "B", "paths": [[[1,1],[2,1,1],[10,1]]]}]',
        ],
    ),
    "a.json": (
        lambda file: [text_of(part) for part in read_strip_instance(load_source(file), 2, None, False)],
        [
            "",
            "[]",
            "{}",
            '{"items": []}',
            strip(""),
            strip(f'"demand": 3, {SQUARE}'),
            strip(f'"id": 7, "demand": 1, {SQUARE}'),
            strip(f'"demand": 0, {SQUARE}'),
            strip(f'"demand": true, {SQUARE}'),
            strip(f'"demand": 1.0, {SQUARE}'),
            strip(f'"demand": 1, "allowed_orientations": [0, 90, 450], {SQUARE}'),
            strip(f'"demand": 1, "allowed_orientations": [], {SQUARE}'),
            strip(f'"demand": 1, "allowed_orientations": ["x"], {SQUARE}'),
            strip('"demand": 1, "shape": {"type": "circle", "data": []}'),
            strip('"demand": 1, "shape": {"type": "simple_polygon", "data": [[0,0],[1,0]]}'),
            strip('"demand": 1, "shape": {"type": "simple_polygon", "data": [[0,0],[1,0],[1e9,1]]}'),
            strip(f'"demand": 1, {SQUARE}').replace('"name": "s", ', ""),
            '{"items": [3]}',
        ],
    ),
    "parts.csv": (
        lambda file: [text_of(part).replace(str(file.parent), "") for part in read_drawings_to_nest([f"{file}:2"])],
        [
            "",
            "file,quantity\n",
            "a.dxf\n",
            "a.dxf;3;0 90\n",
            "Part\tn\na.dxf\t2\t0/180\n",
            "# c\nDRAWING,n,r\na.dxf,,free\n",
            "a.dxf,x\n",
            "a.dxf,0\n",
            ",3\n",
            "a.dxf,1,x\n",
            "a.dxf,1\n\nfile,2\n",
            "/tmp/a.dxf,1\n",
            'a.dxf,1\n"a\n',
        ],
    ),
    "times.csv": (
        times_of,
        [
            "",
            "program,seconds\n",
            "a.nc,90 s\n",
            "a.nc;1:30\n",
            "program,time\na.nc,1:02:03\n\nb.nc, 2 min\n",
            "a.nc\n",
            "a.nc,x\nb.nc,y\n",
            "a.nc,1:00\nb.nc,y\n",
            ",5 s\n",
            "a.nc,0 s\n",
            "a\0b",
        ],
    ),
    "clock": (
        lambda file: [text_of(parse_stopwatch_time(file.read_text()))],
        [
            "12:34",
            "1:02:03",
            "0:59.5",
            "59:59",
            "60:00",
            "1:59:59",
            "1:60:00",
            "0:60",
            "1:00:60",
            "0:00",
            "-1:00",
            "754 s",
            "12 min",
            "x",
            "1:2:3:4",
            "1000:00:00",
            "9999:00",
            "0:00.000001",
        ],
    ),
    "a.drl": (
        parts(read),
        [
            HEAD + "X1Y2\nM30\n",
            HEAD + "X1Y2\n",
            HEAD,
            HEAD + "M30\n",
            "M48\nINCH,LZ\nT1C0.1\n%\nT1\nX1Y2\nM30\n",
            "M48\n%\nX1Y2\nM30\n",
            HEAD + "X1Y2\nZZZ\nM30\n",
            HEAD + "X1e9Y2\nM30\n",
            HEAD.replace("C1.0", "C0") + "X1Y2\nM30\n",
            HEAD.replace("C1.0", "C-1") + "X1Y2\nM30\n",
            HEAD + "X1Y2G85X1Y2\nX5Y5\nM30\n",
            HEAD + "X1Y2\nX1Y2\nM30\n",
        ],
    ),
    "a.svg": (
        parts(read_contours),
        [
            "",
            "<svg",
            f"{SVG}/>",
            f'{SVG}width="9mm" height="9mm"><g/></svg>',
            f'{SVG}width="9mm" height="9mm"><line x2="9"/></svg>',
            f'{SVG}viewBox="0 0 9 9"><line x2="9"/></svg>',
            f'{SVG}width="x" height="9mm"><line x2="9"/></svg>',
            f'{SVG}width="0mm" height="9mm" viewBox="0 0 9 9"><line x2="9"/></svg>',
            f'{SVG}width="9mm" height="9mm" viewBox="0 0 9"><line x2="9"/></svg>',
            f'{SVG}width="9mm" height="9mm" viewBox="0 0 9 0"><line x2="9"/></svg>',
            f'{SVG}width="9em" height="9%"><line x2="9"/></svg>',
            f'{SVG}width="9mm" height="9mm"><text>a</text></svg>',
            f'{SVG}width="9mm" height="9mm" viewBox="0 0 18 9" preserveAspectRatio="none"><line x2="9"/></svg>',
            f'{SVG}width="9mm" height="9mm" viewBox="0 0 18 9" preserveAspectRatio="xMaxYMin slice">{LINE}',
            f'{SVG}><style>.a{{stroke:red}} .b {{ display : none }}</style><g class="b"><line/></g><g class="a">'
            f'<line x2="8"/></g>{LINE}',
        ],
    ),
}


def lines(folder: Path) -> list[str]:
    """Return each text with what is read of it."""
    found = []
    for name, (reader, texts) in TEXTS.items():
        file = folder / name
        for text in texts:
            file.write_text(text, encoding="utf-8")
            found.append(f"== {name}: {text[-90:]!a}")
            try:
                found += reader(file)
            except LeafcutError as problem:
                found.append(f"{type(problem).__name__}: {str(problem).replace(str(file), name)}")
    return found


def test_a_faulty_file_is_refused_or_read_as_it_was_checked(tmp_path: Path) -> None:
    assert lines(tmp_path) == (TABLES / "refused.txt").read_text(encoding="utf-8").splitlines()


def test_the_options_of_a_strip_instance_replace_its_angles(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text(strip(f'"demand": 2, "allowed_orientations": [90], {SQUARE}'), encoding="utf-8")
    (part,) = read_strip_instance(load_source(file), 3, (0.5,), True, 25.4)
    assert (part.quantity, part.rotations, part.name) == (6, (0.5,), "s-0")
    assert part.contours[0].path.extents == (0.0, 0.0, 50.8, 25.4)
