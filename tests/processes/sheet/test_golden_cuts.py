"""Golden cutting programs: one sheet for each controller of a torch or beam, in both units, as text and read back.

After a change that is meant: LEAFCUT_WRITE_GOLDEN=1 pytest with this file, and look at the diff.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from test_cutting_programs import choose, light, written

from leafcut.gcode.dialects import Torch, dialect_names, load_dialect
from leafcut.gcode.own_program import interpret_own_program
from leafcut.model.toolpath import Arc, Kind, Toolpath, ToolpathBuilder
from leafcut.options import PostOptions

GOLDEN = Path(__file__).parents[2] / "golden"
CASES = [(name, units) for name in dialect_names(torch=True) for units in ("mm", "inch")]


def torch_of(name: str) -> Torch:
    torch = load_dialect(name).torch
    assert torch is not None
    return torch


def sheet(name: str) -> Toolpath:
    """A hole at 60 % of the feed, a mark, and an outline that the controller compensates, each if it can."""
    torch, b = torch_of(name), ToolpathBuilder()
    compensates = torch.compensation
    b.blending(640, 0.1)
    b.rapid(z=10.0)
    if torch.probe:
        b.rapid(20.0, 10.0)
        b.probe(-12.0, feed=5.0)
        b.set_place(Kind.SHIFT, (20.0, 10.0, -0.5), 0)
        b.rapid(z=10.0)
    light(b, 20.0, 10.0)
    b.height_control(False)
    b.feed(25.0, 10.0, feed=12.0)
    b.arc(True, (15.0, 10.0, 1.5), Arc((20.0, 10.0, 1.5)), feed=12.0)
    if torch.arc_output is not None or torch.dark_rapids:
        b.torch(False)
        b.feed(20.0, 10.0, feed=12.0)
        b.torch(True)
    b.height_control(True)
    b.spindle(0.0)
    b.rapid(z=10.0)
    if torch.mark_on:
        if torch.mark_tool is not None:
            choose(b, torch.mark_tool)
        b.rapid(5.0, 5.0)
        b.spindle(200.0, number=1)
        b.feed(9.0, 5.0, feed=20.0)
        b.spindle(0.0, number=1)
        if torch.mark_tool is not None:
            choose(b, 0)
    light(b, -3.0, 0.0)
    if compensates:
        b.radius(41, 1.5 if compensates.endswith(".1") else 1.0)
    for x, y in ((0.0, 0.0), (0.0, 20.0), (40.0, 20.0), (40.0, 0.0), (0.0, 0.0)):
        b.feed(x, y, feed=20.0)
    if compensates:
        b.radius(40)
        b.feed(-3.0, 0.0, feed=20.0)
    b.spindle(0.0)
    b.rapid(z=10.0)
    b.end()
    return b.build()


def program(name: str, units: str) -> str:
    numbered = units == "inch" and load_dialect(name).line_numbers
    return written(name, sheet(name), PostOptions(output_units=units, line_numbers=numbered), ("sheet of 6 mm",))


@pytest.mark.parametrize("name, units", CASES)
def test_a_cutting_program_is_the_golden_one(name: str, units: str) -> None:
    file = GOLDEN / f"sheet_{name}_{units}{load_dialect(name).extension}"
    text = program(name, units)
    if os.environ.get("LEAFCUT_WRITE_GOLDEN") == "1":
        file.write_bytes(text.encode("ascii"))
    assert file.read_bytes() == text.encode("ascii")


@pytest.mark.parametrize("name, units", CASES)
def test_a_golden_cutting_program_reads_back_as_its_cuts(name: str, units: str) -> None:
    """Every cut ends at its place, with its feed; the torch burns for as many of them."""
    meant, read = (
        _cuts(path) for path in (sheet(name), interpret_own_program(program(name, units), load_dialect(name)))
    )
    assert [kind for kind, _, _ in read] == [kind for kind, _, _ in meant]
    for (_, place, feed), (_, wanted, planned) in zip(read, meant, strict=True):
        assert place == pytest.approx(wanted, abs=0.003)
        assert feed == pytest.approx(planned, rel=1e-3)


def _cuts(path: Toolpath) -> list[tuple[Kind, tuple[float, float], float]]:
    """Return kind, end and feed of the cuts that move X or Y."""
    before = path.before
    return [
        (row.kind, row.end[:2], row.value)
        for number, row in enumerate(path)
        if row.kind in (Kind.FEED, Kind.ARC_CW) and row.end[:2] != tuple(before[number, :2])
    ]
