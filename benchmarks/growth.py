"""Growth of time and memory with the size of the work: every process at n, 2 n and 4 n.

    python -m benchmarks growth
    python -m benchmarks growth cut reorder --part 0.25

Each run is a separate process; processor time and peak resident memory include the interpreter and the libraries. An
uncounted run of the largest size compiles all kernels first. For t = a + b nᵖ, the power p is the binary logarithm of
(t(4n) - t(2n)) / (t(2n) - t(n)), however long the start takes: 1 is linear, and 2 is quadratic.
"""

from __future__ import annotations

import math
import random
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import ezdxf
import ezdxf.units

from benchmarks import page
from benchmarks.verify_large import END, HEAD, contours, run

#: Number of lines of a wave, and distances between waves and between columns of waves, mm.
_LINES, _APART, _COLUMN = 19, 0.5, 12.0


def holes(count: int, file: Path) -> None:
    """Draw holes of two sizes on a plate, with random gaps."""
    drawing, chance, side = ezdxf.new(units=ezdxf.units.MM), random.Random(1), math.ceil(math.sqrt(count))
    model = drawing.modelspace()
    for k in range(count):
        place = (5.0 * (k % side) + chance.uniform(0, 1) + 5, 5.0 * (k // side) + chance.uniform(0, 1) + 5)
        model.add_circle(place, radius=1.25 + 0.25 * (k % 2))
    drawing.saveas(file)


def panel(count: int, file: Path) -> None:
    """Draw one part with round holes."""
    holes(count, file)
    drawing = ezdxf.readfile(file)
    wide = 5.0 * math.ceil(math.sqrt(count)) + 10.0
    drawing.modelspace().add_lwpolyline([(0, 0), (wide, 0), (wide, wide), (0, wide)], close=True)
    drawing.saveas(file)


def sheet(count: int, file: Path, columns: int = 0) -> None:
    """Draw contours on a sheet: stars with two holes each, in a square or in the given number of columns."""
    drawing, chance = ezdxf.new(units=ezdxf.units.MM), random.Random(1)
    model, parts = drawing.modelspace(), max(count // 3, 1)
    side = columns or math.ceil(math.sqrt(parts))
    for k in range(parts):
        x, y, turn = 45.0 * (k % side) + 25.0, 45.0 * (k // side) + 25.0, chance.uniform(0, 6)
        corners = [(r, turn + math.pi * j / 8) for j in range(16) for r in (20.0 - 4.0 * (j % 2),)]
        model.add_lwpolyline([(x + r * math.cos(a), y + r * math.sin(a)) for r, a in corners], close=True)
        for offset in (-6.0, 6.0):
            model.add_circle((x + offset, y), radius=3.0)
    drawing.saveas(file)


def strokes(count: int, file: Path) -> None:
    """Draw open strokes to engrave, each of them a bent line, and one part around all strokes."""
    drawing, chance, side = ezdxf.new(units=ezdxf.units.MM), random.Random(1), math.ceil(math.sqrt(count))
    model = drawing.modelspace()
    for k in range(count):
        x, y = 3.0 * (k % side) + 2.0, 3.0 * (k // side) + 2.0
        points = [(x + 0.6 * j, y + chance.uniform(0, 2)) for j in range(4)]
        model.add_lwpolyline(points, dxfattribs={"layer": "ENGRAVE"})
    wide = 3.0 * side + 4.0
    model.add_lwpolyline([(0, 0), (wide, 0), (wide, wide), (0, wide)], close=True)
    drawing.saveas(file)


def islands(count: int, file: Path) -> None:
    """Draw a pocket with round islands, so that its rings divide and join at each island."""
    drawing, side = ezdxf.new(units=ezdxf.units.MM), math.ceil(math.sqrt(count))
    model, wide = drawing.modelspace(), 40.0 * side + 20.0
    model.add_lwpolyline([(0, 0), (wide, 0), (wide, wide), (0, wide)], close=True)
    for k in range(count):
        model.add_circle(
            (40.0 * (k % side) + 30.0, 40.0 * (k // side) + 30.0), radius=6.0 + k % 3, dxfattribs={"layer": "ISLAND"}
        )
    drawing.saveas(file)


def pockets(count: int, file: Path) -> None:
    """Draw pockets that are apart from each other."""
    drawing, side = ezdxf.new(units=ezdxf.units.MM), math.ceil(math.sqrt(count))
    model = drawing.modelspace()
    for k in range(count):
        x, y = 40.0 * (k % side), 40.0 * (k // side)
        corners = [(0, 0), (30, 0), (30, 12 + k % 7), (12, 14 + k % 7), (12, 30), (0, 30)]
        model.add_lwpolyline([(x + u, y + v) for u, v in corners], close=True)
    drawing.saveas(file)


def program(lines: int, file: Path) -> None:
    """Write a program of short cuts in 100 columns, close together as in an engraving."""
    text = ["G21 G90 G17 G94", "S12000 M3", "G0 Z5"]
    for number in range(max(lines // (_LINES + 2), 1)):
        x, y = (number % 100) * _COLUMN, (number // 100) * _APART
        text += [f"G0 X{x:g} Y{y:g}", "G1 Z-1 F600"]
        text += [f"X{x + 10 * k / (_LINES - 1):.3f} Y{y + 0.2 * math.sin(k):.3f}" for k in range(1, _LINES)]
        text.append("G0 Z5")
    file.write_text("\n".join([*text, "M5", "M2", ""]))


def shuffled(lines: int, file: Path) -> None:
    """Write a program of contours, and other.nc with the contours in a different order."""
    cuts = contours(lines)
    file.write_text(HEAD + "".join(cuts) + END)
    random.Random(1).shuffle(cuts)
    file.with_name("other.nc").write_text(HEAD + "".join(cuts) + END)


def parts(count: int, file: Path) -> None:
    """Draw one part; the command nests `count` copies."""
    drawing = ezdxf.new(units=ezdxf.units.MM)
    corners = [(0, 0), (60, 0), (60, 20), (25, 25), (20, 70), (0, 70)]
    drawing.modelspace().add_lwpolyline(corners, close=True)
    drawing.saveas(file)


@dataclass(frozen=True)
class Work:
    """Work of any size: its unit, largest size, input file, function that writes the input, and command with FILE and
    COUNT.
    """

    counts: str
    most: int
    file: str
    make: Callable[[int, Path], None]
    words: str

    def command(self, count: int) -> list[str]:
        """Return the words of the command line."""
        return [w.replace("FILE", self.file).replace("COUNT", str(count)) for w in self.words.split()]


#: Command for sheets.
_LASER = "cut FILE -o out.nc --machine laser-table --cut-process laser --thickness 2"

WORKS = {
    "drill": Work("holes", 4800, "holes.dxf", holes, "drill FILE -o out.nc --machine haas-vf2 --thickness 3"),
    "panel": Work("holes in one part", 1200, "panel.dxf", panel, _LASER),
    "cut": Work("contours", 3000, "sheet.dxf", sheet, _LASER),
    "engrave": Work("strokes", 20000, "strokes.dxf", strokes, _LASER),
    "reorder": Work("lines", 1_000_000, "waves.nc", program, "reorder FILE -o out.nc --machine linuxcnc-mill"),
    "verify": Work("lines", 1_000_000, "a.nc", shuffled, "verify FILE other.nc --machine linuxcnc-mill"),
    "pocket": Work("islands in one pocket", 64, "islands.dxf", islands,
                   "pocket FILE -o out.nc --machine linuxcnc-mill --depth 3 --tool-diameter 6"),
    "pockets": Work("pockets", 64, "pockets.dxf", pockets,
                    "pocket FILE -o out.nc --machine linuxcnc-mill --depth 3 --tool-diameter 6"),
    "nest": Work("parts", 400, "part.dxf", parts,
                 "nest FILE:COUNT -o out.dxf --sheet 1500x1000 --variants 1"),
}  # fmt: skip


def exponent(three: Sequence[float]) -> str:
    """Return the power of the growth over three sizes, each twice the previous one, or a dash if there is no growth."""
    first, second = three[1] - three[0], three[2] - three[1]
    return f"{math.log2(second / first):.1f}" if first > 0.05 * three[1] and second > 0 else "–"


def measured(name: str, work: Work, most: int, compiled: bool) -> Iterator[list[str]]:
    """Yield a row for each size; unless `compiled`, run the largest size first without counting it."""
    times, peaks = list[float](), list[float]()
    sizes = [most // 4, most // 2, most]
    for number, count in enumerate(sizes if compiled else [most, *sizes]):
        with tempfile.TemporaryDirectory() as folder:
            work.make(count, Path(folder) / work.file)
            seconds, peak, status = run(work.command(count), folder)
        if status:
            raise AssertionError(f"{name}, {count} {work.counts}: status {status}")
        if number == 0 and not compiled:
            continue
        times, peaks = [*times, seconds], [*peaks, peak / 1e6]
        ends = [exponent(times), exponent(peaks)] if len(times) == 3 else ["", ""]
        yield [name, f"{count:,} {work.counts}", f"{seconds:.1f} s", ends[0], f"{peak / 1e6:.0f} MB", ends[1]]


def main(argv: Sequence[str]) -> int:
    """Measure all work and publish the table."""
    parser = page.parser("growth", __doc__)
    parser.add_argument("names", nargs="*", type=page.one_of(WORKS), help=f"of {', '.join(WORKS)} (default: all)")
    parser.add_argument("--part", type=float, default=1.0, help="share of the largest size (default: 1)")
    parser.add_argument("--compiled", action="store_true", help="all kernels are compiled: skip the uncounted runs")
    given = parser.parse_args(argv)
    rows: list[list[str]] = []
    for name in given.names or WORKS:
        for row in measured(name, WORKS[name], int(given.part * WORKS[name].most), given.compiled):
            print("  ".join(row), file=sys.stderr, flush=True)
            rows.append(row)
    text = f"""# Growth of time and memory

Every process was run at the sizes n, 2 n and 4 n with the default preset, whose effort depends on the size. Each run is
a separate process with compiled kernels. The table shows the processor time of all threads and the peak resident
memory, including the start and the libraries. The power p is computed from the differences, so it does not include the
start: 1 is linear, 2 is quadratic, and – means no growth. Three sizes show little if a search chooses its own effort,
as the search of *nest* does.

{page.facts("growth", argv, ["leafcut", "numpy", "numba"])}

{page.table(["work", "size", "processor", "power p", "peak memory", "power p"], rows)}"""
    page.publish("growth", text, given.write)
    return 0
