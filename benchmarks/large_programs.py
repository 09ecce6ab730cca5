"""Planning of large programs: 47,600 dense cuts in a million lines, in processor seconds.

    python benchmarks/large_programs.py [--cuts N] [--depths D]

The cuts are waves side by side, half a millimetre apart, as a surface or an engraving has them. With several depths
each is cut again deeper, so that what lies within the width of a mill keeps its order.
"""

from __future__ import annotations

import argparse
import math
import resource
import time

from leafcut.gcode import dialects
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.model.sequence import Section
from leafcut.processes.program.plan.resequencing import find_sequence

#: Lines of a cut, millimetres between waves and between columns of them.
_LINES, _APART, _COLUMN = 19, 0.5, 12.0


def waves(cuts: int, depths: int) -> str:
    """Return a program of so many waves in 100 columns, each cut once at each depth."""
    lines = ["G21 G90 G17 G94", "S12000 M3", "G0 Z5"]
    for depth in range(1, depths + 1):
        for number in range(depth - 1, cuts, depths):
            place = number // depths
            x, y = (place % 100) * _COLUMN, (place // 100) * _APART
            lines += [f"G0 X{x:g} Y{y:g}", f"G1 Z-{depth} F600"]
            for k in range(1, _LINES):
                lines.append(f"X{x + 10 * k / (_LINES - 1):.3f} Y{y + 0.2 * math.sin(k):.3f}")
            lines.append("G0 Z5")
    return "\n".join([*lines, "M5", "M2", ""])


def main() -> None:
    """Plan one program and say what it took."""
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--cuts", type=int, default=47_600)
    arguments.add_argument("--depths", type=int, default=1)
    given = arguments.parse_args()
    text = waves(given.cuts, given.depths)
    began = time.process_time()
    program = interpret_program(text, dialects.dialect("linuxcnc"))
    read = time.process_time()
    sequence = find_sequence(program, process="mill")
    planned = time.process_time()
    sections = [item for item in sequence.items if isinstance(item, Section)]
    pairs = sum(len(section.precedence) for section in sections)
    print(
        f"{text.count(chr(10)):,} lines: read in {read - began:.1f} s, planned in {planned - read:.1f} s of processor; "
        f"{sum(len(s.pieces) for s in sections):,} pieces in {len(sections)} sections, {pairs:,} pairs in order; "
        f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB at most"
    )


if __name__ == "__main__":
    main()
