"""Work that was too slow or too poor in version 0.2.0: this checkout and another one, in turns.

    python -m benchmarks unseen --beside CHECKOUT
    python -m benchmarks unseen --beside CHECKOUT loops holes

The benchmark generates all files. Each run is a separate process. Processor time is the user and system time of all its
threads, peak memory is resident memory, and both include the interpreter and the libraries. A run that compiles kernels
is repeated. The table is in docs/results/unseen_files.md, which also contains trials with public files.
"""

from __future__ import annotations

import json
import math
import random
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import ezdxf
import ezdxf.units

from benchmarks import COMMAND, ROOT, data_folder, environment_of, growth, page
from benchmarks.verify_large import launch, picture

#: Code that reads a drawing as the studio does; in version 0.2.0, the function is in another module.
_PREVIEW = """
import json, sys
try:
    from leafcut.studio.jobs.preview import read_preview
except ImportError:
    from leafcut.studio.preview import look as read_preview
seen = read_preview(sys.argv[1])
print(json.dumps({"facts": dict(seen.facts), "error": seen.error}))
"""
#: Code that packs a strip with spyrrow alone, with its default number of threads.
_SPYRROW = """
import json, sys
import spyrrow
data, seconds, seed = json.load(open(sys.argv[1])), int(sys.argv[2]), int(sys.argv[3])
items = [
    spyrrow.Item(str(k), [tuple(p) for p in item["shape"]["data"]], item["demand"], item["allowed_orientations"])
    for k, item in enumerate(data["items"])
]
instance = spyrrow.StripPackingInstance("strip", data["strip_height"], items)
config = spyrrow.StripPackingConfig(early_termination=False, total_computation_time=seconds, seed=seed)
print(json.dumps({"width": instance.solve(config).width}))
"""


@dataclass(frozen=True)
class Run:
    """Processor time (s), peak memory (bytes), exit status and JSON answer of a run of leafcut.

    If the run was stopped, `stopped` is the time limit, s.
    """

    seconds: float
    peak: float
    status: int
    answer: dict[str, Any]
    stopped: int = 0

    def cost(self) -> str:
        """Return time and memory as text."""
        seconds = f"> {self.stopped} s" if self.stopped else f"{self.seconds:.1f} s"
        return f"{seconds}, {self.peak / 2**20:.0f} MiB"


@dataclass(frozen=True)
class Checkout:
    """A checkout, its folder for compiled code, and the maximum processor time of a run, s (0 for no limit)."""

    source: Path
    cache: Path
    most: int

    def python(self, code: str, words: Sequence[str], folder: Path, most: int | None = None) -> Run:
        """Run code with the modules of this checkout; repeat the run if it compiled kernels."""
        most = self.most if most is None else most
        environment = environment_of(self.source, self.cache)
        for _ in range(4):  # a run that does not wait for compilation may need more kernels
            command = [sys.executable, "-c", code, *words]
            seconds, peak, status = launch(command, str(folder), most, environment)
            text, errors = ((folder / name).read_text(errors="replace") for name in ("stdout", "stderr"))
            if "compiling" not in errors:
                break
        stopped = most if status == -signal.SIGKILL else 0
        if not stopped and (status < 0 or "Traceback" in errors):
            raise AssertionError(f"status {status}: {errors}")
        answer = json.loads(text) if text.startswith("{") else {}
        return Run(seconds, peak, status, answer, stopped)

    def command(self, words: str, folder: Path) -> Run:
        """Run a leafcut command."""
        return self.python(COMMAND, words.split(), folder)


def pocket(folder: Path) -> None:
    """Draw a pocket of 205 cm² with two islands."""
    _pocket(folder / "pocket.dxf", 160, 140, [(50, 60, 17.4), (110, 85, 17.4)])


def large_pocket(folder: Path) -> None:
    """Draw a pocket of 200 × 150 mm."""
    _pocket(folder / "large.dxf", 200, 150, [])


def _pocket(file: Path, width: float, height: float, islands: Sequence[tuple[float, float, float]]) -> None:
    drawing = ezdxf.new(units=ezdxf.units.MM)
    model = drawing.modelspace()
    model.add_lwpolyline([(0, 0), (width, 0), (width, height), (0, height)], close=True)
    for x, y, radius in islands:
        model.add_circle((x, y), radius=radius, dxfattribs={"layer": "ISLAND"})
    drawing.saveas(file)


def contours(count: int, columns: int = 0) -> Callable[[Path], None]:
    """Return a function that draws a sheet with this number of contours, as `growth.sheet` does."""
    return lambda folder: growth.sheet(count, folder / "sheet.dxf", columns)


def passes(folder: Path) -> None:
    """Write 7,221 lines: passes of a 3 mm mill, 0.5 mm apart, so that each touches its neighbours."""
    text = ["G21 G90 G17 G94", "(T1 flat end mill D=3.0)", "T1 M6", "S6000 M3", "G0 Z5"]
    for row in range(math.ceil((7221 - len(text) - 2) / 29)):
        text += [f"G0 X0 Y{0.5 * row:g}", "G1 Z-1 F600"]
        text += [f"X{k} Y{0.5 * row + 0.2 * math.sin(k):.3f}" for k in range(1, 27)]
        text.append("G0 Z5")
    text = [*text[:7218], "G0 Z5", "M5", "M2", ""]
    (folder / "passes.nc").write_text("\n".join(text))


def raster(folder: Path) -> None:
    """Write a laser raster with 180,000 lines."""
    text = "".join(picture(180_000))
    (folder / "raster.nc").write_text(f"G21 G90 G17 G94\nM4 S0\nF3000\n{text}M5\nM2\n")


def holes(folder: Path) -> None:
    """Draw 28 holes of 12.40 to 12.53 mm, all with different diameters."""
    drawing = ezdxf.new(units=ezdxf.units.MM)
    for k in range(28):
        drawing.modelspace().add_circle((20 * (k % 7), 20 * (k // 7)), radius=0.5 * (12.40 + 0.13 * k / 27))
    drawing.saveas(folder / "holes.dxf")


def loops(folder: Path) -> None:
    """Write a loop that changes no parameter, and a loop that counts."""
    (folder / "still.ngc").write_text("G21 G90 G17 G94\no100 while [1]\no100 endwhile\nM2\n")
    counting = "#1=0\no100 while [#1 GE 0]\n#1=[#1+1]\no100 endwhile\n"
    (folder / "counting.ngc").write_text(f"G21 G90 G17 G94\n{counting}M2\n")


def bomb(folder: Path) -> None:
    """Write an SVG file whose `use` elements expand to 8 million rectangles."""
    groups = "".join(f'<g id="a{k}"><use href="#a{k - 1}"/><use href="#a{k - 1}" x="1"/></g>' for k in range(1, 24))
    square = '<rect id="a0" x="1" y="1" width="5" height="5"/>'
    size = 'width="100mm" height="100mm" viewBox="0 0 100 100"'
    (folder / "bomb.svg").write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}><defs>{square}{groups}</defs><use href="#a23"/></svg>'
    )


def lines(folder: Path) -> None:
    """Draw 100,000 lines: random walks of ten lines each that cross each other."""
    drawing, chance = ezdxf.new(units=ezdxf.units.MM), random.Random(1)
    model = drawing.modelspace()
    for _ in range(10_000):
        x, y = chance.uniform(0, 1000), chance.uniform(0, 1000)
        for _ in range(10):
            u, v = x + chance.uniform(-5, 5), y + chance.uniform(-5, 5)
            model.add_line((x, y), (u, v))
            x, y = u, v
    drawing.saveas(folder / "lines.dxf")


def laser_sheet(seed: int, file: Path) -> None:
    """Draw a sheet with 4 to 15 parts of different sizes in rows, with up to three holes each."""
    drawing, chance = ezdxf.new(units=ezdxf.units.MM), random.Random(seed)
    model, x, y, high = drawing.modelspace(), 10.0, 10.0, 0.0
    for _ in range(chance.randint(4, 15)):
        width, height = chance.uniform(20, 120), chance.uniform(20, 90)
        if x + width > 500.0:
            x, y, high = 10.0, y + high + 8.0, 0.0
        cut = 0.3 * min(width, height)
        corners = [(0, 0), (width, 0), (width, height - cut), (width - cut, height), (0, height)]
        model.add_lwpolyline([(x + u, y + v) for u, v in corners], close=True)
        for k in range(chance.randint(0, 3)):
            model.add_circle(
                (x + width * (k + 1) / 4.5, y + 0.4 * height),
                radius=chance.uniform(1.0, 0.05 * min(width, height) + 0.5),
            )
        x, high = x + width + 8.0, max(high, height)
    drawing.saveas(file)


def metres(run: Run) -> str:
    """Return the length of the path on one level of a pocket, as text."""
    return f"{run.answer['pocket']['feed_mm'] / 1000:.2f} m"


def time_saved(run: Run) -> str:
    """Return machine time and travel as text."""
    after = run.answer["after"]
    return f"{after['time_s']:.1f} s at the machine, travel {after['travel_mm'] / 1000:.2f} m"


def assumed(run: Run) -> str:
    """Return the number of assumed tools, as text."""
    return f"{sum(tool['assumed'] for tool in run.answer['tools'])} assumed drills"


def drawn(run: Run) -> str:
    """Return the size of the preview, as text."""
    return run.answer["error"] or f"{run.answer['facts']['contours']} outlines"


@dataclass(frozen=True)
class Work:
    """Work in one row: title, writer of its files, command (or preview of `file`), and description of the answer."""

    title: str
    make: Callable[[Path], None]
    words: str
    result: Callable[[Run], str] = time_saved
    preview: str = ""
    most: int | None = None


_POCKET = "pocket FILE -o out.nc --json --machine linuxcnc-mill --depth 3 --tool-diameter"
_LASER = "cut sheet.dxf -o out.nc --json --machine laser-table --thickness 2"
_MILL = "-o out.nc --json --machine linuxcnc-mill"
#: Rows of the table; rows with the same key belong together.
WORKS = {
    "holes": [Work("28 holes of 12.40 to 12.53 mm", holes,
                   "drill holes.dxf -o out.nc --json --machine haas-vf2 --thickness 10", assumed)],
    "loops": [Work("endless loop that changes no parameter", loops, f"reorder still.ngc {_MILL}"),
              Work("endless loop that counts", loops, f"reorder counting.ngc {_MILL}")],
    "bomb": [Work("SVG file whose `use` elements expand to 8 million rectangles", bomb,
                  "cut bomb.svg -o out.nc --json --machine grbl-laser-co2 --material acrylic --thickness 3")],
    "pocket": [Work("pocket of 205 cm², mill of 10 mm, limit 20 s", pocket,
                    _POCKET.replace("FILE", "pocket.dxf") + " 10 --time-limit 20s", metres),
               Work("the same pocket, no limit", pocket, _POCKET.replace("FILE", "pocket.dxf") + " 10", metres)],
    "large": [Work("pocket of 200 × 150 mm, mill of 3 mm", large_pocket,
                   _POCKET.replace("FILE", "large.dxf") + " 3", metres)],
    "passes": [Work("program of 7,221 lines, passes that touch, limit 10 s", passes,
                    f"reorder passes.nc {_MILL} --time-limit 10s")],
    "contours": [Work("999 laser contours, no limit", contours(999), _LASER),
                 Work("the same contours, limit 10 s", contours(999), f"{_LASER} --time-limit 10s"),
                 Work("the same contours, limit 10 s, one thread", contours(999),
                      f"{_LASER} --time-limit 10s --threads 1")],
    "heat": [Work("999 laser contours, `--heat-distance 50mm`, limit 20 s", contours(999),
                  f"{_LASER} --heat-distance 50mm --time-limit 20s")],
    "preview": [Work("preview of 100,000 lines in the studio", lines, "", drawn, "lines.dxf", 131)],
    "raster": [Work("raster of 180,000 lines", raster,
                    "reorder raster.nc -o out.nc --json --machine grbl-laser-5w")],
    "many": [Work("5,001 laser contours, limit 10 s", contours(5001, columns=58), f"{_LASER} --time-limit 10s")],
}  # fmt: skip


def measured(work: Work, checkouts: Sequence[Checkout]) -> list[str]:
    """Return a row with the title, and a cell for each checkout."""
    row = [work.title]
    for checkout in checkouts:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            work.make(folder)
            if work.preview:
                run = checkout.python(_PREVIEW, [work.preview], folder, checkout.most and work.most)
            else:
                run = checkout.command(work.words, folder)
        answer = "no result" if run.stopped else "refused" if run.status == 1 else work.result(run)
        row.append(f"{run.cost()}: {answer}")
    return row


def sheets(checkouts: Sequence[Checkout], seeds: Sequence[int]) -> Iterator[list[str]]:
    """Yield rows that compare laser sheets with the nearest-neighbour order, with 3 s and without a limit."""
    cells: dict[str, list[str]] = {"3 s": [], "no limit": []}
    limits = {"nearest": " --algorithm nn", "3 s": " --time-limit 3s", "no limit": ""}
    for checkout in checkouts:
        runs: dict[str, list[Run]] = {}
        for seed in seeds:
            with tempfile.TemporaryDirectory() as name:
                laser_sheet(seed, Path(name) / "sheet.dxf")
                for limit, words in limits.items():
                    runs.setdefault(limit, []).append(checkout.command(_LASER + words, Path(name)))
        times = {limit: [run.answer["after"]["time_s"] for run in done] for limit, done in runs.items()}
        for limit, column in cells.items():
            ratio = [a / b for a, b in zip(times[limit], times["nearest"], strict=True)]
            slower = sum(r > 1.0 - 1e-6 for r in ratio)
            column.append(
                f"{median(run.seconds for run in runs[limit]):.1f} s: {slower} of {len(seeds)} no faster, "
                f"{100 * (1 - max(ratio)):.2f} to {100 * (1 - min(ratio)):.2f} % faster, "
                f"median {100 * (1 - median(ratio)):.2f} %"
            )
    for limit, column in cells.items():
        yield [f"{len(seeds)} laser sheets beside the nearest neighbour, {limit}", *column]


#: Height of a scaled strip, mm, so that the 0.1 mm between two parts matter little.
HEIGHT = 1000.0


def strips(
    checkouts: Sequence[Checkout], names: Sequence[str], seeds: Sequence[int], seconds: int
) -> Iterator[list[str]]:
    """Yield rows that compare the strips of published sets with those of spyrrow alone, as median lengths over the
    seeds.
    """
    for name in names:
        data = json.loads((data_folder() / "nesting" / "esicup" / f"{name}.json").read_text())
        scale = HEIGHT / data["strip_height"]
        data["strip_height"] = HEIGHT
        for item in data["items"]:
            item["shape"]["data"] = [[scale * x, scale * y] for x, y in item["shape"]["data"]]
        lengths: list[list[float]] = [[] for _ in range(1 + len(checkouts))]
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            (folder / "strip.json").write_text(json.dumps(data))
            for seed in seeds:
                alone = checkouts[0].python(_SPYRROW, ["strip.json", str(seconds), str(seed)], folder, 0)
                lengths[0].append(alone.answer["width"])
                sheet = f"--sheet {math.ceil(3 * alone.answer['width'])}x{HEIGHT:g} --kerf 0 --gap 0 --margin 0"
                words = f"nest strip.json --json {sheet} --variants 1 --time-limit {seconds}s --seed {seed}"
                for column, checkout in zip(lengths[1:], checkouts, strict=True):
                    # Each checkout writes its own file, because no version replaces a drawing that it did not write.
                    run = checkout.command(f"{words} -o {checkout.cache.name}.dxf", folder)
                    column.append(run.answer["variants"][0]["used_length_of_last_mm"])
        middle = median(lengths[0])
        cells = [
            f"{100 * (median(column) / middle - 1):+.1f} % (seeds {min(column):.0f} to {max(column):.0f} mm)"
            for column in lengths[1:]
        ]
        yield [f"strip of {name}, {seconds} s, beside spyrrow alone ({middle:.0f} mm)", *cells]


def main(argv: Sequence[str]) -> int:
    """Measure the named work, and print the table."""
    parser = page.parser("unseen", __doc__, writes=False)
    known = [*WORKS, "sheets", "strips"]
    parser.add_argument("names", nargs="*", type=page.one_of(known), help=f"of {', '.join(known)} (default: all)")
    parser.add_argument("--beside", type=Path, required=True, help="another checkout, run by the same Python")
    parser.add_argument("--most", type=int, default=300, help="stop the other checkout after these processor seconds")
    parser.add_argument("--sheets", type=int, default=8, help="number of laser sheets (default: 8)")
    parser.add_argument("--cache", type=Path, help="folder that keeps the compiled code (default: a temporary folder)")
    parser.add_argument("--seeds", type=int, default=3, help="seeds of each strip (default: 3)")
    given = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as name:
        caches = [(given.cache or Path(name)).resolve() / part for part in ("other", "this")]
        for cache in caches:
            cache.mkdir(parents=True, exist_ok=True)
        checkouts = [Checkout(given.beside.resolve(), caches[0], given.most), Checkout(ROOT, caches[1], 0)]
        rows = []
        for key in given.names or known:
            if key == "sheets":
                found = list(sheets(checkouts, range(given.sheets)))
            elif key == "strips":
                found = list(strips(checkouts, ("swim", "shirts", "trousers", "dagli"), range(1, 1 + given.seeds), 20))
            else:
                found = [measured(work, checkouts) for work in WORKS[key]]
            for row in found:
                print("  ".join(row), file=sys.stderr, flush=True)
            rows += found
    print(page.facts("unseen", argv, ["leafcut", "numpy", "numba", "spyrrow"]))
    print(page.table(["work", "other checkout", "this checkout"], rows))
    return 0
