"""A caller can stop a reader: it reports progress regularly, and exceptions of the callback pass through."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from leafcut import api
from leafcut.read import read, read_contours, read_pockets


class Enough(BaseException):
    """Nobody waits any more."""


class Patience:
    """Allows a number of calls, then raises."""

    def __init__(self, most: int) -> None:
        self.left = most

    def __call__(self, *_: Any) -> None:
        self.left -= 1
        if self.left < 0:
            raise Enough


LINES = "".join(f"0\nLINE\n8\n0\n10\n{k}\n20\n0\n11\n{k + 1}\n21\n5\n" for k in range(100))
CIRCLES = "".join(f"0\nCIRCLE\n8\n0\n10\n{9 * k}\n20\n0\n40\n2\n" for k in range(100))
SVG = '<svg xmlns="http://www.w3.org/2000/svg">' + "".join(f'<circle cx="{k}" r="1"/>' for k in range(100)) + "</svg>"
WKT = "".join(f"POLYGON (({k} 0, {k + 1} 0, {k} 1, {k} 0))\n" for k in range(0, 200, 2))


@pytest.mark.parametrize("most", [0, 3, 50])
@pytest.mark.parametrize(
    ("name", "text", "reading"),
    [
        ("a.svg", SVG, read_contours),
        ("a.wkt", WKT, read_pockets),
        ("a.csv", "1,2,3\n" * 100, read),
        ("a.xml", "<map>" + '<city x="1" y="2"/>' * 100 + "</map>", read),
    ],
)
def test_a_reader_ends_when_nobody_waits_for_it(
    name: str, text: str, reading: Callable[..., Any], most: int, tmp_path: Path
) -> None:
    """Between any two things that it reads."""
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(Enough):
        reading(path, on_progress=Patience(most))


@pytest.mark.parametrize("within", ["lines", "entities"])
@pytest.mark.parametrize("entities, reading", [(LINES, read_contours), (CIRCLES, read)])
def test_a_dxf_reader_ends_when_nobody_waits_for_it(
    entities: str, reading: Callable[..., Any], within: str, hand_drawn: Any
) -> None:
    """While ezdxf takes the lines of the file, and while its entities are walked through."""
    with pytest.raises(Enough):
        reading(hand_drawn(entities), on_progress=Patience(50 if within == "entities" else 0))


def test_progress_can_end_what_only_reads(tmp_path: Path) -> None:
    """`simulate`, `verify` and `nest` of the library, and with them those jobs of the studio."""
    path = tmp_path / "a.ngc"
    path.write_text("G21 G90 G17 G94\nG0 Z5\nG1 X1 F100\nM2\n", encoding="utf-8")
    with pytest.raises(Enough):
        api.simulate(path, progress=Patience(0))
    with pytest.raises(Enough):
        api.verify(path, path, progress=Patience(0))
    with pytest.raises(Enough):
        api.nest(["no.dxf"], progress=Patience(0))
