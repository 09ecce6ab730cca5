"""Mutated inputs for readers, interpreters, `verify`, post-processors and whole runs, to find crashes and hangs.

    python -m benchmarks fuzz --inputs 500000 --state /tmp/fuzz

Input k of a target is always the same, so an interrupted sweep continues from its state (`--state`), and any input can
be repeated (``--again gcode:1234``). A second process watches the worker: an input may use `MOST_SECONDS` of processor
time and `MOST_MEMORY`, and may raise only a leafcut error with a short message of one line. Everything else is a fault,
whose input and traceback are stored in the folder of the state.

The cases in ``data/fuzz`` are seeds of the target whose name starts their file names.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import mmap
import os
import random
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks import ROOT, data_folder, page
from leafcut.errors import LONGEST_MESSAGE, LONGEST_QUOTE, LeafcutError

#: Maximum processor time, s, and resident memory, bytes, for an input.
MOST_SECONDS, MOST_MEMORY = 10.0, 1_500_000_000
#: Maximum size of a seed, bytes, so that thousands of inputs run in a minute.
LARGEST_SEED = 12_000
#: Maximum size of an input, bytes.
LARGEST = 400_000

DATA = data_folder()

Target = Callable[[bytes, Path], None]


# -- targets ---------------------------------------------------------------------------------------------------------


def _reader(module: str, function: str, *more: str) -> Target:
    """Return a target that calls a reader directly, without the error handling in `registry.run_reader`."""

    def read(data: bytes, place: Path) -> None:
        from importlib import import_module

        from leafcut import options
        from leafcut.read.format import Source

        given = [getattr(options, name)() for name in ("ReadOptions", *more)]
        getattr(import_module(f"leafcut.read.{module}"), function)(Source(place.name, data), *given)

    return read


def _file(module: str, function: str, *, many: bool = False) -> Target:
    """Return a target that reads a table or a list from a file."""

    def read(data: bytes, place: Path) -> None:
        from importlib import import_module

        place.write_bytes(data)
        getattr(import_module(module), function)([str(place)] if many else place)

    return read


def _options(data: bytes, place: Path) -> None:
    from leafcut.processes.settings import collect_settings

    place.write_bytes(data)
    collect_settings({}, place)


def _machine(data: bytes, place: Path) -> None:
    from leafcut.read.machine import load_machine

    file = place.with_suffix(".toml")
    file.write_bytes(data)
    load_machine(str(file))


def _picture(data: bytes, place: Path) -> None:
    from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
    from leafcut.read.format import Source
    from leafcut.read.picture import read_picture_pockets

    read_picture_pockets(Source(place.name, data), ReadOptions(), PocketDrawingOptions(pixel_size=0.2), SheetOptions())


def _any(data: bytes, place: Path) -> None:
    """Choose the format by the content, as every command does, and read the input."""
    from leafcut.options import ReadOptions
    from leafcut.read.format import Source
    from leafcut.read.registry import BUILT_IN, choose_format, run_reader

    source = Source(place.name, data)
    run_reader(choose_format(BUILT_IN, source), source, ReadOptions())


def _text(data: bytes) -> str:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _foreign(name: str) -> Target:
    def read(data: bytes, _: Path) -> None:
        from leafcut.gcode.dialects import load_dialect
        from leafcut.gcode.program_interpreter import interpret_program

        interpret_program(_text(data), load_dialect(name))

    return read


def _own(data: bytes, _: Path) -> None:
    from leafcut.gcode.dialects import load_dialect
    from leafcut.gcode.own_program import interpret_own_program

    interpret_own_program(_text(data), load_dialect("linuxcnc"))


def _verify(data: bytes, _: Path) -> None:
    """Compare a program with a copy that differs in a few lines."""
    from leafcut.gcode.dialects import load_dialect
    from leafcut.gcode.program_interpreter import interpret_program
    from leafcut.processes.program.proof.certificate import certify
    from leafcut.read.machine import load_machine

    words, text = load_dialect("linuxcnc"), _text(data)
    lines = text.splitlines(keepends=True)
    chance = random.Random(len(data))
    for _ in range(chance.randint(0, 3)):
        k = chance.randrange(len(lines)) if lines else 0
        lines[k : k + 1] = chance.choice(([], lines[k : k + 1] * 2, [*lines[k : k + 1], *lines[:1]]))
    original, new = interpret_program(text, words), interpret_program("".join(lines), words)
    certify(original, new, machine=load_machine("linuxcnc-mill"), allow_reverse=chance.random() < 0.5)


def _posts(data: bytes, _: Path) -> None:
    """Write a program in every dialect, and read the result."""
    from leafcut.errors import PostError
    from leafcut.gcode.dialects import dialect_names, load_dialect
    from leafcut.gcode.own_program import interpret_own_program
    from leafcut.gcode.program_interpreter import interpret_program
    from leafcut.options import PostOptions
    from leafcut.post.writer import write_program

    path = interpret_program(_text(data), load_dialect("linuxcnc")).path
    chance = random.Random(len(data))
    for name in sorted(dialect_names()):
        inch, numbers = chance.random() < 0.3, chance.random() < 0.3
        options = PostOptions(output_units="inch" if inch else "mm", line_numbers=numbers)
        with contextlib.suppress(PostError):
            text = write_program(path, load_dialect(name), options, header=["fuzz", "a (b) ; %"])
            with contextlib.suppress(LeafcutError):  # `verify` refuses foreign words
                interpret_own_program(text, load_dialect(name))


def _whole(process: str, extension: str, **options: float) -> Target:
    def work(data: bytes, place: Path) -> None:
        from leafcut import api

        file = place.with_suffix(extension)
        file.write_bytes(data)
        api.optimize(file, process=process, preset="fast", time_limit=0.05, threads=1, **options)

    return work


#: Name → (function, extensions of its seeds, relative frequency).
TARGETS: dict[str, tuple[Target, tuple[str, ...], float]] = {
    "gcode": (_foreign("linuxcnc"), (".ngc", ".nc", ".gcode"), 8),
    "gcode_haas": (_foreign("haas"), (".nc",), 3),
    "gcode_fanuc": (_foreign("fanuc"), (".nc",), 3),
    "gcode_grbl": (_foreign("grbl"), (".nc", ".gcode"), 3),
    "gcode_mach3": (_foreign("mach3"), (".tap", ".nc"), 2),
    "gcode_fagor": (_foreign("fagor8055"), (".pim",), 2),
    "gcode_plasma": (_foreign("qtplasmac"), (".ngc", ".nc"), 2),
    "gcode_laser": (_foreign("grbl-laser"), (".gcode", ".nc"), 2),
    "gcode_own": (_own, (".ngc", ".nc"), 6),
    "verify": (_verify, (".ngc", ".nc"), 3),
    "posts": (_posts, (".ngc", ".nc"), 2),
    "dxf": (_reader("dxf", "read_dxf"), (".dxf",), 1),
    "dxf_sheet": (_reader("dxf_contours", "read_dxf_contours"), (".dxf",), 1),
    "dxf_pockets": (_reader("dxf_contours", "read_dxf_pockets", "PocketDrawingOptions", "SheetOptions"), (".dxf",), 1),
    "svg_sheet": (_reader("svg", "read_svg_contours"), (".svg",), 4),
    "svg_pockets": (_reader("svg", "read_svg_pockets", "PocketDrawingOptions", "SheetOptions"), (".svg",), 3),
    "xml": (_reader("xmlmap", "read_xml"), (".xml",), 6),
    "csv": (_reader("csvmap", "read_csv"), (".csv",), 6),
    "excellon": (_reader("excellon", "read_excellon"), (".drl",), 3),
    "tsplib": (_reader("tsplib", "read_tsplib"), (".tsp",), 4),
    "gtsp": (_reader("gtsp", "read_gtsp"), (".gtsp", ".pcglns"), 4),
    "sirius": (_reader("sirius", "read_sirius_contours"), (".json",), 2),
    "wkt": (_reader("wkt", "read_wkt_pockets", "PocketDrawingOptions", "SheetOptions"), (".wkt",), 6),
    "picture": (_picture, (".png", ".bmp", ".jpg"), 1),
    "any": (_any, (".csv", ".xml", ".tsp", ".drl", ".svg"), 4),
    "nestlist": (_file("leafcut.read.nest_list", "read_drawings_to_nest", many=True), (".csv",), 6),
    "options": (_options, (".toml",), 6),
    "machine": (_machine, (".toml",), 6),
    "tools": (_file("leafcut.read.tools", "load_tools"), (".toml",), 6),
    "cutchart": (_file("leafcut.read.cutchart", "load_chart"), (".csv",), 2),
    "plan": (_file("leafcut.read.plan_file", "load_plan"), (".json",), 4),
    "order": (_file("leafcut.read.order_file", "load_order"), (".json",), 4),
    "reorder": (_whole("auto", ".ngc"), (".ngc", ".nc"), 0.05),
    "drill": (_whole("auto", ".csv", depth=1.0), (".csv",), 0.05),
    "cut": (_whole("cut", ".svg"), (".svg",), 0.02),
}


#: Targets that start threads, so that their process cannot fork afterwards.
WHOLE = ("reorder", "drill", "cut")

#: Seeds that are not in files; a line of dashes separates several seeds of a target.
OWN_SEEDS: dict[str, str] = {
    "xml": """<?xml version="1.0" encoding="UTF-8"?>
<map units="mm"><city name="A" x="1" y="2" d="3"/><hole><x>4</x><y>5.5</y><diameter>2</diameter></hole></map>
--------
<?xml version="1.0" encoding="UTF-9"?><map/>
""",
    "csv": """x;y;diameter;name
1,5;2,5;3;A
4;5;6;B
--------
# points
1 2 3
4 5 6
--------
x,y,d_mm,name
1,2,3,"a, b"
""",
    "wkt": """POLYGON ((0 0, 40 0, 40 30, 0 30, 0 0), (10 10, 20 10, 20 20, 10 20, 10 10))
SRID=4326; MULTIPOLYGON (((50 0, 60 0, 60 10, 50 0)), ((70 0, 80 0, 80 10, 70 0)))
--------
GEOMETRYCOLLECTION (POINT (1 2), LINESTRING (0 0, 1 1), POLYGON ((0 0, 9 0, 9 9, 0 0)))
""",
    "tsplib": """NAME: t
TYPE: TSP
DIMENSION: 4
EDGE_WEIGHT_TYPE: EUC_2D
NODE_COORD_SECTION
1 0 0
2 3 0
3 3 4
4 0 4
EOF
--------
NAME: m
TYPE: TSP
DIMENSION: 3
EDGE_WEIGHT_TYPE: EXPLICIT
EDGE_WEIGHT_FORMAT: FULL_MATRIX
EDGE_WEIGHT_SECTION
0 1 2
1 0 3
2 3 0
EOF
""",
    "gtsp": """NAME: g
TYPE: GTSP
DIMENSION: 4
GTSP_SETS: 2
EDGE_WEIGHT_TYPE: EUC_2D
NODE_COORD_SECTION
1 0 0
2 3 0
3 3 4
4 0 4
GTSP_SET_SECTION
1 1 2 -1
2 3 4 -1
EOF
""",
    "excellon": """M48
METRIC,TZ
T1C0.8
T2C3.0
%
G05
T1
X1000Y2000
R05X1000
T2
X5000Y100G85X9000Y100
M30
""",
    "nestlist": """file;quantity;rotations
a.dxf;3;0 90
b.dxf;1;free
--------
a.dxf,2
# no
b.svg,1,0/180
""",
    "options": """[machine]
machine = "linuxcnc-mill"
[drill]
thickness = "3mm"
clearance_height = 5
[solve]
seed = 7
time_limit = "2s"
[post]
output_units = "inch"
[read]
layers = ["A*", "B"]
""",
    "plan": """{"leafcut_plan": 1, "sheet": "a",
"contours": [{"kind": "cut", "length": 40.0, "area": 100.0, "start": [0, 0]}
], "cuts": [{"contours": [1], "start": [5, 0], "direction": "clockwise", "fixed": ["start"],
"lead_in": {"style": "arc", "length": 3, "angle": 90}}], "process": "plasma", "thickness": 6}
""",
    "order": """{"leafcut_order": 1, "drawing": {"holes": 4, "print": "5f0c"},
"operations": [{"operation": 1, "holes": [2]}]}
""",
    "sirius": """[{"parts": [[[0, 0], [10, 0], [10, 10], [0, 10]]]}]
""",
    "svg": """<svg xmlns="http://www.w3.org/2000/svg" width="100mm" height="60mm" viewBox="0 0 100 60">
<style>.c{stroke:red}</style><g transform="translate(5 5) rotate(10)">
<path class="c" d="M0 0 L40 0 L40 30 Q20 40 0 30 Z"/><circle cx="20" cy="15" r="5"/></g>
<defs><path id="p" d="M60 10a5 5 0 1 0 10 0a5 5 0 1 0 -10 0z"/></defs><use href="#p" x="5"/>
<rect x="60" y="30" width="20" height="10" rx="3"/><polygon points="1,1 2,1 2,2"/></svg>
""",
    "dxf": """0
SECTION
2
BLOCKS
0
BLOCK
2
B
70
0
10
0
20
0
0
CIRCLE
8
0
10
0
20
0
40
2
0
ENDBLK
0
ENDSEC
0
SECTION
2
ENTITIES
0
INSERT
2
B
10
5
20
5
41
1
70
3
71
2
44
10
45
10
0
ELLIPSE
8
0
10
50
20
50
11
20
21
0
40
0.5
0
LINE
8
0
10
0
20
0
11
90
21
0
0
ENDSEC
0
EOF
""",
    "gcode": """%
(sub)
O100 sub
G1 X#1 Y[#2+1] F100
O100 endsub
G21 G90 G17 G94
M3 S1000
#1=3
#<depth>=[2*SIN[30]]
O1 repeat [3]
G0 Z5
G0 X[#1*2] Y#<depth>
G1 Z-1 F100
G91 G2 X2 Y0 I1 J0
G90 G0 Z5
#1=[#1+1]
O1 endrepeat
O100 call [10] [20]
G81 X1 Y2 Z-3 R1 F100
X5
G80
T2 M6
G43 H2
G83 X3 Y3 Z-9 R1 Q1
G80 G53 G0 Z0
M5
M2
%
""",
}
_BLANKS, _MANY, _ENDLESS = b" " * 40_000, b"9" * 400, b"9" * 5000
#: Inputs that once caused faults: long runs of blanks for quadratic patterns, numbers with too many digits for a float
#: or a Python integer, and long words that a message repeated.
BROKE_BEFORE: dict[str, tuple[bytes, ...]] = {
    "wkt": (
        b"x" + _BLANKS + b"POLYGON ((0 0, 9 0, 9 9, 0 0))", b"POLYGON" + _BLANKS + b"x",
        b"\\" * 2000, b"a\\" * 2000,
    ),
    "csv": (b"x" + b"_" * 40_000 + b";y\n1;2\n",),
    "tsplib": (b"NAME" + _BLANKS + b"x\n", b"NAME: a" + _BLANKS + b"x\n", b"\n" * 40_000 + b"x"),
    "any": (b"\n" * 40_000 + b"x", b"T" + b"1" * 40_000, b"POLYGON" + _BLANKS + b"x"),
    "gcode": (
        b"G1 X1 F100 (X" + _BLANKS + b")\nM2\n", b"G21\nG1 X#<" + b"s" * 200 + b"\\" + b"s" * 200 + b"> F100\nM2\n",
    ),
    "gcode_haas": (b"#1=0\nWHILE [#1 LT 2] DO" + _ENDLESS + b"\n#1=#1+1\nEND" + _ENDLESS + b"\n",),
    "posts": (_BLANKS + b"\nG1 X1 F100\nM2\n",),
    "reorder": (b"G0 Z5\n(1" + _BLANKS + b")\n" + _BLANKS + b"\nG81 X1 Y1 Z-1 R1 F100\nX9\nX3\nG80\nM2\n",),
    "options": (
        b"[drill]\nclearance_height = " + _MANY, b"[solve]\nseed = " + _MANY,
        b"[machine]\nstart_point = [" + _MANY + b", 1]", b"[read]\nlayers = [" + _MANY + b"]",
    ),
    "machine": (b"acceleration_factor = " + _MANY,),
    "tools": (b"[[tool]]\nkind = 'drill'\ndiameter = '3mm'\nnumber = " + _MANY,),
    "plan": (b'{"leafcut_plan": 1, "contours": [{"kind": "cut", "length": ' + _MANY + b"}]}",),
    "order": (b'{"leafcut_order": 1, "operations": [{"operation": 1, "holes": [' + _MANY + b"]}]}",),
    "cutchart": (b"process,material,thickness_mm,cut_speed_mm_min\nplasma,steel," + _MANY + b",1\n",),
    "nestlist": (b"a.dxf;" + _ENDLESS + b";0 90\n",),
}  # fmt: skip
#: Targets that use the seeds of another target.
_LIKE = {"cut": "svg", "drill": "csv", "any": "csv", "verify": "gcode", "posts": "gcode", "reorder": "gcode"}

#: Texts to insert: invalid, huge and long numbers, unbalanced brackets, control characters.
_WORDS = (
    b"1e9", b"-1e9", b"1e309", b"nan", b"inf", b"-0", b"0", b"1", b"999999999999", b"0.000000001", b"1" * 400,
    b"9" * 5000, b"(", b")", b"[", b"]", b"[" * 50, b"[" * 2000, b"<", b">", b'"', b"'", b"#", b"%", b"/", b"*", b"=",
    b";", b",", b"\\", b"\0", b"\xff\xfe", b"\xc2", b"\xef\xbb\xbf", b"\r", b"\n", b"\t", b" " * 500,
    b"A" * 3000, b"\xe2\x80\xae",
)  # fmt: skip


def mutated(seeds: Sequence[bytes], chance: random.Random) -> bytes:
    """Return a seed with some mutations, or (once in fifty times) without any."""
    data = bytearray(chance.choice(seeds))
    for _ in range(chance.choice((0, *[1] * 16, *[2] * 12, *[4] * 10, *[12] * 8, 60, 300, 1000))):
        at = chance.randrange(len(data) + 1)
        to = min(len(data), at + chance.choice((1, 1, 2, 4, 16, 100, 1000)))
        match chance.randrange(10):
            case 0:
                data[at:to] = b""
            case 1:
                data[at:at] = chance.choice(_WORDS)
            case 2:
                data[at:to] = chance.choice(_WORDS)
            case 3 if data:
                data[min(at, len(data) - 1)] = chance.randrange(256)
            case 4:
                data[at:at] = data[at:to] * chance.choice((1, 2, 50, 1000))
            case 5:
                other = chance.choice(seeds)
                begin = chance.randrange(len(other) + 1)
                data[at:to] = other[begin : begin + chance.choice((4, 30, 300))]
            case 6:  # a different digit, sign or decimal point in a number
                digits = [k for k in range(at, min(at + 200, len(data))) if chr(data[k]) in "0123456789"]
                if digits:
                    data[chance.choice(digits)] = ord(chance.choice("0123456789.-eE"))
            case 7:
                lines = bytes(data).split(b"\n")
                k, j = chance.randrange(len(lines)), chance.randrange(len(lines))
                lines[k], lines[j] = lines[j], lines[k]
                data = bytearray(b"\n".join(lines))
            case 8:
                lines = bytes(data).split(b"\n")
                k = chance.randrange(len(lines))
                lines[k : k + 1] = chance.choice(
                    ([], [lines[k]] * min(chance.choice((2, 100, 2000)), 2 + LARGEST // (len(lines[k]) + 1)))
                )
                data = bytearray(b"\n".join(lines))
            case _ if chance.random() < 0.2:
                data = data[:at]
        del data[LARGEST:]
    return bytes(data)


def seeds_of(name: str) -> list[bytes]:
    """Return the seeds of a target in a fixed order: files of the project, files of the data, then the texts above."""
    _, endings, _ = TARGETS[name]
    folders = [ROOT / "examples", ROOT / "tests" / "golden", ROOT / "src" / "leafcut" / "machines", DATA]
    files = [f for folder in folders if folder.is_dir() for f in sorted(folder.rglob("*")) if f.suffix in endings]
    kinds = {"machine": "machines", "tools": "tools", "options": "sirius", "cutchart": "cutchart"}
    part = kinds.get(name, "")
    files += [ROOT / "src" / "leafcut" / "read" / "cutchart.csv"] if name == "cutchart" else []
    found = [f.read_bytes() for f in files if f.stat().st_size <= LARGEST_SEED and part in str(f)]
    own = OWN_SEEDS.get(_LIKE.get(name, name), "") or OWN_SEEDS.get(name.partition("_")[0], "")
    found += [text.encode() for text in own.split("--------\n") if text]
    found += BROKE_BEFORE.get(name, ())
    found += [f.read_bytes() for f in sorted((DATA / "fuzz").glob(f"{name}-*"))]
    return found or [b"1 2 3\n"]


# -- one input -------------------------------------------------------------------------------------------------------


def fault_of(name: str, data: bytes, place: Path) -> str:
    """Run a target on an input, and return the fault, or an empty text."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            TARGETS[name][0](data, place)
    except LeafcutError as problem:
        message = str(problem).replace(str(place), "")
        words = max(map(len, message.replace("/", " ").split()), default=0)
        if len(message) > LONGEST_MESSAGE + 200 or words > LONGEST_QUOTE + 20 or "\n" in message:
            return f"long message: {message[:3000]}"
    except Exception:
        return traceback.format_exc(limit=-12)
    return ""


def input_of(name: str, seeds: Sequence[bytes], seed: int, number: int) -> bytes:
    """Return input `number` of a target; the first inputs are the seeds."""
    return seeds[number] if number < len(seeds) else mutated(seeds, random.Random(f"{seed}/{name}/{number}"))


# -- worker and watcher ----------------------------------------------------------------------------------------------

_STATE = struct.Struct("=q")


@dataclass
class Sweep:
    """State of a sweep: the next input of each target, and all faults."""

    seed: int
    folder: Path
    next: dict[str, int] = field(default_factory=dict)
    found: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    @property
    def file(self) -> Path:
        """File of the state."""
        return self.folder / "state.json"

    @property
    def tried(self) -> int:
        """Number of inputs so far."""
        return sum(self.next.values())

    def load(self) -> None:
        """Load the state of an earlier sweep."""
        if self.file.is_file():
            kept = json.loads(self.file.read_text())
            if kept["seed"] != self.seed:
                sys.exit(f"{self.file} belongs to seed {kept['seed']}; choose another folder")
            self.next, self.found, self.seconds = kept["next"], kept["found"], kept["seconds"]

    def save(self) -> None:
        """Write the state."""
        kept = {"seed": self.seed, "next": self.next, "found": self.found, "seconds": round(self.seconds, 1)}
        part = self.file.with_suffix(".part")
        part.write_text(json.dumps(kept, indent=1))
        part.replace(self.file)

    def keep(self, name: str, number: int, data: bytes, fault: str) -> None:
        """Store a fault, but only one for each position in the code."""
        last = next((line for line in reversed(fault.splitlines()) if "File " in line), fault[:60])
        kind = f"{name}: {last.strip()} {fault.strip().splitlines()[-1][:100]}"
        if kind in self.found:
            return
        self.found[kind] = f"{name}:{number}"
        case = self.folder / f"{name}-{hashlib.sha256(data).hexdigest()[:8]}"
        case.write_bytes(data)
        case.with_suffix(".txt").write_text(f"{name}:{number}\n{fault}\n")
        print(f"FAULT {name}:{number} {fault.strip().splitlines()[-1][:160]}", flush=True)


def _work(name: str, seeds: list[bytes], sweep: Sweep, count: int, place: Path, shared: mmap.mmap) -> None:
    """Run inputs one after the other in a worker process, and write the faults to a file."""
    first = sweep.next.get(name, 0)
    with _faults_file(place).open("w", encoding="utf-8") as faults:
        for number in range(first, first + count):
            shared[: _STATE.size] = _STATE.pack(number)
            data = input_of(name, seeds, sweep.seed, number)
            Path("/proc/self/clear_refs").write_text("5")  # resets the peak memory for this input
            fault = fault_of(name, data, place)
            peak, resident = _memory(os.getpid())
            if not fault and peak > MOST_MEMORY:
                fault = f"memory: {peak / 1e6:.0f} MB"
            if fault:
                faults.write(json.dumps([number, fault]) + "\n")
                faults.flush()
            if resident > 0.4 * MOST_MEMORY:
                return  # the next input runs in a new worker


def _memory(process: int) -> tuple[float, float]:
    """Return the peak and current resident memory of a process, bytes; zeros after its end."""
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0.0, 0.0
    found = {line.partition(":")[0]: line.split()[1] for line in lines if line.startswith(("VmHWM", "VmRSS"))}
    return 1024.0 * float(found.get("VmHWM", 0)), 1024.0 * float(found.get("VmRSS", 0))


def _faults_file(place: Path) -> Path:
    return place.with_name("faults.jsonl")


def _spent(process: int) -> float:
    """Return the processor time of a process, s; zero after its end."""
    try:
        fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run_batch(name: str, sweep: Sweep, count: int, place: Path) -> None:
    """Run `count` more inputs of a target. If a worker hangs or grows too large, kill it and continue after its
    input.
    """
    seeds = seeds_of(name)
    end = sweep.next.get(name, 0) + count
    while sweep.next.get(name, 0) < end:
        first = sweep.next.get(name, 0)
        shared = mmap.mmap(-1, _STATE.size)
        shared[: _STATE.size] = _STATE.pack(first)
        _faults_file(place).unlink(missing_ok=True)
        sys.stdout.flush()
        worker = os.fork()
        if worker == 0:
            code = 4
            with contextlib.suppress(BaseException):
                _work(name, seeds, sweep, end - first, place, shared)
                code = 0
            os._exit(code)
        number, why = _watch(worker, shared)
        for line in _faults_file(place).read_text(encoding="utf-8").splitlines():
            at, fault = json.loads(line)
            sweep.keep(name, at, input_of(name, seeds, sweep.seed, at), fault)
        if why:
            sweep.keep(name, number, input_of(name, seeds, sweep.seed, number), why)
        sweep.next[name] = min(number + 1, end)


def _watch(worker: int, shared: mmap.mmap) -> tuple[int, str]:
    """Wait for a worker, and kill it if it hangs or grows too large; return its last input and the fault."""
    last, since, why = -1, 0.0, ""
    while True:
        done, status = os.waitpid(worker, os.WNOHANG)
        (number,) = _STATE.unpack(shared[: _STATE.size])
        if done:
            code = os.waitstatus_to_exitcode(status)
            return number, why or (f"the process ended with {code}" if code else "")
        seconds, (_, resident) = _spent(worker), _memory(worker)
        if number != last:
            last, since = number, seconds
        elif seconds - since > MOST_SECONDS:
            why = f"hang: more than {MOST_SECONDS:g} s"
        elif resident > MOST_MEMORY and (number,) == _STATE.unpack(shared[: _STATE.size]):
            why = f"memory: {resident / 1e6:.0f} MB"
        if why:
            os.kill(worker, signal.SIGKILL)
        time.sleep(0.05)


def warm_up() -> None:
    """Import all modules of the targets before the first fork; a child process compiles the kernels for whole runs."""
    with tempfile.TemporaryDirectory() as folder:
        child = os.fork()
        for name in TARGETS:
            if (name in WHOLE) == (child == 0):
                fault_of(name, seeds_of(name)[0], Path(folder) / "input")
        if child == 0:
            _compile_searches()
            os._exit(0)
        os.waitpid(child, 0)


def _compile_searches() -> None:
    """Compile the searches with precedence, which a mutated program may need."""
    import numpy as np

    from leafcut.model.problem import RoutingProblem
    from leafcut.options import SolveOptions
    from leafcut.order.solve import solve

    options = SolveOptions(iterations=50, bound=False)
    entry = np.random.default_rng(1).uniform(0.0, 100.0, (80, 2))
    for clusters, away in ((80, 0.0), (80, 1.0), (40, 1.0)):
        cluster = np.arange(80, dtype=np.int32) % clusters
        solve(RoutingProblem(entry=entry, exit=entry + away, cluster=cluster, service=np.zeros(80)), options)


def main(argv: Sequence[str]) -> int:
    """Run a sweep, or repeat an input; return 1 if the sweep finds faults."""
    parser = page.parser("fuzz", __doc__, writes=False)
    parser.add_argument("--inputs", type=int, default=10_000, help="total number, inputs of earlier sweeps included")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--state", type=Path, default=Path(tempfile.gettempdir()) / "leafcut-fuzz", help="folder")
    parser.add_argument("--targets", default=",".join(TARGETS), help="names with commas (default: all)")
    parser.add_argument("--batch", type=int, default=200, help="inputs of a target of frequency 1 in each round")
    parser.add_argument("--again", help="TARGET:NUMBER: repeat this input and show its errors")
    given = parser.parse_args(argv)
    if given.again:
        name, _, number = given.again.partition(":")
        data = input_of(name, seeds_of(name), given.seed, int(number))
        with tempfile.TemporaryDirectory() as folder:
            TARGETS[name][0](data, Path(folder) / "input")
        return 0
    given.state.mkdir(parents=True, exist_ok=True)
    sweep = Sweep(given.seed, given.state)
    sweep.load()
    warm_up()
    names = given.targets.split(",")
    with tempfile.TemporaryDirectory() as folder:
        while sweep.tried < given.inputs:
            for name in names:
                began = os.times()
                run_batch(name, sweep, max(1, round(given.batch * TARGETS[name][2])), Path(folder) / "input")
                ended = os.times()
                sweep.seconds += sum(ended[:4]) - sum(began[:4])
                sweep.save()
            print(f"{sweep.tried:,} inputs, {len(sweep.found)} faults, {sweep.seconds:.0f} s", flush=True)
    print(f"{sweep.tried:,} inputs, {len(sweep.found)} faults")
    return int(bool(sweep.found))
