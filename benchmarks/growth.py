"""Time and memory by the size of the work: every process at n, 2 n and 4 n, and how fast both grow.

    python benchmarks/growth.py --write docs/benchmarks.md
    python benchmarks/growth.py cut reorder --part 0.25

A process of its own does each run; what is told is its processor seconds and its peak of resident memory, the
interpreter and the libraries included. The largest is run once before, uncounted, so that nothing compiles in those
that count. Where t = a + b nᵖ, then p is the base-two logarithm of (t(4n) - t(2n)) / (t(2n) - t(n)), whatever the start
took: 1 is linear, 2 is quadratic.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import ezdxf
import ezdxf.units
from large_programs import waves
from page import facts, one_of, table, write_section
from verify_large import END, HEAD, contours, run


def holes(count: int, file: Path) -> None:
    """Draw so many holes of two sizes on a plate, apart and at random."""
    drawing, chance, side = ezdxf.new(units=ezdxf.units.MM), random.Random(1), math.ceil(math.sqrt(count))
    model = drawing.modelspace()
    for k in range(count):
        place = (5.0 * (k % side) + chance.uniform(0, 1) + 5, 5.0 * (k // side) + chance.uniform(0, 1) + 5)
        model.add_circle(place, radius=1.25 + 0.25 * (k % 2))
    drawing.saveas(file)


def panel(count: int, file: Path) -> None:
    """Draw one part with so many round holes in it."""
    holes(count, file)
    drawing = ezdxf.readfile(file)
    wide = 5.0 * math.ceil(math.sqrt(count)) + 10.0
    drawing.modelspace().add_lwpolyline([(0, 0), (wide, 0), (wide, wide), (0, wide)], close=True)
    drawing.saveas(file)


def sheet(count: int, file: Path) -> None:
    """Draw so many contours on a sheet: stars with two holes each."""
    drawing, chance = ezdxf.new(units=ezdxf.units.MM), random.Random(1)
    model, parts = drawing.modelspace(), max(count // 3, 1)
    side = math.ceil(math.sqrt(parts))
    for k in range(parts):
        x, y, turn = 45.0 * (k % side) + 25.0, 45.0 * (k // side) + 25.0, chance.uniform(0, 6)
        corners = [(r, turn + math.pi * j / 8) for j in range(16) for r in (20.0 - 4.0 * (j % 2),)]
        model.add_lwpolyline([(x + r * math.cos(a), y + r * math.sin(a)) for r, a in corners], close=True)
        for way in (-6.0, 6.0):
            model.add_circle((x + way, y), radius=3.0)
    drawing.saveas(file)


def strokes(count: int, file: Path) -> None:
    """Draw so many open strokes to engrave, each a bent line, and one part around them."""
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
    """Draw a pocket with so many round islands: its rings part and meet around each."""
    drawing, side = ezdxf.new(units=ezdxf.units.MM), math.ceil(math.sqrt(count))
    model, wide = drawing.modelspace(), 40.0 * side + 20.0
    model.add_lwpolyline([(0, 0), (wide, 0), (wide, wide), (0, wide)], close=True)
    for k in range(count):
        model.add_circle((40.0 * (k % side) + 30.0, 40.0 * (k // side) + 30.0), radius=6.0 + k % 3)
    drawing.saveas(file)


def pockets(count: int, file: Path) -> None:
    """Draw so many pockets apart from each other."""
    drawing, side = ezdxf.new(units=ezdxf.units.MM), math.ceil(math.sqrt(count))
    model = drawing.modelspace()
    for k in range(count):
        x, y = 40.0 * (k % side), 40.0 * (k // side)
        corners = [(0, 0), (30, 0), (30, 12 + k % 7), (12, 14 + k % 7), (12, 30), (0, 30)]
        model.add_lwpolyline([(x + u, y + v) for u, v in corners], close=True)
    drawing.saveas(file)


def program(lines: int, file: Path) -> None:
    """Write a program of so many lines: short cuts side by side."""
    file.write_text(waves(max(lines // 21, 1), 1))


def shuffled(lines: int, file: Path) -> None:
    """Write a program of contours, and beside it the same in another order."""
    made = contours(lines)
    file.write_text(HEAD + "".join(made) + END)
    random.Random(1).shuffle(made)
    file.with_name("other.nc").write_text(HEAD + "".join(made) + END)


def parts(count: int, file: Path) -> None:
    """Draw a part, of which so many are nested."""
    drawing = ezdxf.new(units=ezdxf.units.MM)
    corners = [(0, 0), (60, 0), (60, 20), (25, 25), (20, 70), (0, 70)]
    drawing.modelspace().add_lwpolyline(corners, close=True)
    drawing.saveas(file)


@dataclass(frozen=True)
class Work:
    """Work of a size: what it counts, the largest, what draws it, and the command with FILE and COUNT in it."""

    counts: str
    most: int
    file: str
    make: Callable[[int, Path], None]
    words: str

    def command(self, count: int) -> list[str]:
        """Return the words of the command line."""
        return [w.replace("FILE", self.file).replace("COUNT", str(count)) for w in self.words.split()]


#: How sheets are cut.
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
    """Return by what power of the size something grows; a dash where it does not grow with it."""
    first, second = three[1] - three[0], three[2] - three[1]
    return f"{math.log2(second / first):.1f}" if first > 0.05 * three[1] and second > 0 else "–"


def measured(name: str, work: Work, most: int, compiled: bool) -> Iterator[list[str]]:
    """Yield a row of the table for each size; the largest is run before, unless all is compiled."""
    times, peaks = list[float](), list[float]()
    sizes = [most // 4, most // 2, most]
    for number, count in enumerate(sizes if compiled else [most, *sizes]):
        with tempfile.TemporaryDirectory() as folder:
            work.make(count, Path(folder) / work.file)
            seconds, peak, said = run(work.command(count), folder)
        if said != "status 0":
            raise AssertionError(f"{name}, {count} {work.counts}: {said}")
        if number == 0 and not compiled:
            continue
        times, peaks = [*times, seconds], [*peaks, peak / 1e6]
        ends = [exponent(times), exponent(peaks)] if len(times) == 3 else ["", ""]
        yield [name, f"{count:,} {work.counts}", f"{seconds:.1f} s", ends[0], f"{peak / 1e6:.0f} MB", ends[1]]


def main() -> None:
    """Measure, print the table, write it into the page where asked."""
    made = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    made.add_argument("names", nargs="*", type=one_of(WORKS), help=f"only these of {', '.join(WORKS)}")
    made.add_argument("--part", type=float, default=1.0, help="this part of the largest size (default 1)")
    made.add_argument("--compiled", action="store_true", help="all kernels are compiled: no run before the counted")
    made.add_argument("--write", type=Path, help="write the table into this page")
    given = made.parse_args()
    rows: list[list[str]] = []
    for name in given.names or WORKS:
        for row in measured(name, WORKS[name], int(given.part * WORKS[name].most), given.compiled):
            print("  ".join(row), file=sys.stderr, flush=True)
            rows.append(row)
        if given.write:
            write_section(given.write, "growth", text_of(rows))
    print(text_of(rows))


def text_of(rows: Sequence[Sequence[str]]) -> str:
    """Return the section with some rows."""
    return f"""## Time and memory by size

Every process at n, 2 n and 4 n on the default preset, whose effort follows the size; each in a process of its own:
processor seconds of all threads, and the peak of resident memory, start and libraries included. Kernels were compiled
before. The power p of the size is from the differences, so the start is not in it: 1 is linear, 2 quadratic, – does
not grow with it. Three sizes tell little of a power where a search decides itself how long it goes on, as that of
*nest* does.

{facts("growth", sys.argv[1:], ["leafcut", "numpy", "numba"])}

{table(["work", "size", "processor", "power p", "memory at most", "power p"], rows)}"""


if __name__ == "__main__":
    main()
