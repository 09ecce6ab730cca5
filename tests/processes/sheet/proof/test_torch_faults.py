"""Faults of the torch, each from a toolpath of a few rows: kind, line and text, at both sides of each tolerance."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from proved_sheets import STEEL, planned

from leafcut.gcode.dialects import load_dialect
from leafcut.model.cutting import Cut
from leafcut.model.difference import Difference
from leafcut.model.machine import Probe
from leafcut.model.toolpath import Kind, Toolpath, ToolpathBuilder
from leafcut.processes.sheet.proof.torch import (
    _feed_faults,
    _material_faults,
    _pierce_and_cut_height_faults,
    _rapid_faults,
    check_lighting_tool,
    check_probing,
)
from leafcut.processes.sheet.proof.torch_runs import Lighting, TorchRun, torch_runs

FREE = math.nan


def marking(*rows: tuple[str, float]) -> Toolpath:
    builder = ToolpathBuilder()
    for line, (name, value) in enumerate(rows, 1):
        match name:
            case "tool":
                builder.tool(int(value), line)
            case "offset":
                builder.offset(int(value), line)
            case "move":
                builder.rapid(value, 0.0, line=line)
            case "rise":
                builder.rapid(z=value, line=line)
            case "mark" | "cut":
                builder.spindle(value, line, int(name == "mark"))
            case _:
                builder.end(line)
    return builder.build()


NUMBER = next(d.torch.mark_tool for d in map(load_dialect, ("qtplasmac",)) if d.torch) or 0
READY = (("tool", NUMBER), ("offset", NUMBER), ("move", 1.0))
BACK = (("tool", 0.0), ("offset", 0.0), ("move", 2.0))


@pytest.mark.parametrize(
    ("rows", "faults"),
    [
        ((("move", 1.0), ("cut", 1.0), ("end", 0.0)), []),
        ((*READY, ("mark", 1.0), ("cut", 0.0), *BACK, ("cut", 1.0), ("end", 0.0)), []),
        ((("move", 1.0), ("mark", 1.0), ("end", 0.0)), [(2, f"tool 0 is selected where tool {NUMBER} is needed")]),
        ((*READY, ("cut", 1.0), *BACK, ("end", 0.0)), [(4, f"tool {NUMBER} is selected where tool 0 is needed")]),
        (
            (("tool", NUMBER), ("move", 1.0), ("offset", NUMBER), ("mark", 1.0), *BACK, ("end", 0.0)),
            [(4, f"tool {NUMBER} is switched on before it moves to its start with its own offset")],
        ),
        (
            (("tool", NUMBER), ("move", 1.0), ("mark", 1.0), *BACK, ("end", 0.0)),
            [(3, f"tool {NUMBER} is switched on before it moves to its start with its own offset")],
        ),
        (
            (("tool", NUMBER), ("offset", NUMBER), ("rise", 5.0), ("mark", 1.0), *BACK, ("end", 0.0)),
            [(4, f"tool {NUMBER} is switched on before it moves to its start with its own offset")],
        ),
        ((*READY, ("mark", 1.0), ("end", 0.0)), [(5, f"the program ends with tool {NUMBER} instead of the torch")]),
    ],
)
def test_the_scribe_works_with_its_own_tool_and_offset(
    rows: tuple[tuple[str, float], ...], faults: list[tuple[int, str]]
) -> None:
    assert NUMBER > 0
    expected = [Difference("scribe", 0, line, text) for line, text in faults]
    assert check_lighting_tool(marking(*rows), load_dialect("qtplasmac")) == expected
    assert check_lighting_tool(marking(*rows), load_dialect("grbl-laser")) == []


PROBE = Probe(10.0, 20.0, 1.5)


def probed(
    *, depth: float = -20.0, feed: float = 10.0, shift: float | None = -1.5, lit: bool = False, away: str = ""
) -> Toolpath:
    """Touch off at (0, 0), set the height of the switch, light the torch and cut."""
    builder = ToolpathBuilder()
    builder.rapid(z=10.0, line=1)
    builder.rapid(0.0, 0.0, line=2)
    builder.spindle(float(lit), 3)
    builder.probe(depth, feed=feed, line=4)
    if shift is not None:
        builder.set_place(Kind.SHIFT, (0.0, 0.0, shift), 0, line=5)
    if away == "across":
        builder.rapid(x=1.0, line=6)
    elif away == "up":
        builder.rapid(z=9.0, line=6)
    elif away == "machine":
        builder.machine(z=0.0, line=6)
    builder.spindle(1.0, 7)
    builder.feed(9.0, 0.0, feed=25.0, line=8)
    builder.spindle(0.0, 9)
    builder.rapid(50.0, line=10)
    return builder.build()


def probing(path: Toolpath, probe: Probe | None = PROBE) -> list[tuple[int, str]]:
    plan = planned()[0]
    cut = next(cut for cut in plan.cuts if cut.kind == "cut" and cut.pierce)
    found = check_probing(path, torch_runs(path)[-1:], replace(plan, cuts=(cut,)), probe)
    assert {(d.what, d.original) for d in found} <= {("probe", 0)}
    return [(d.new, d.text) for d in found]


UNPROBED = (7, "the torch is switched on without probing the sheet first")


def test_each_pierce_is_probed_at_its_place() -> None:
    assert probing(probed()) == [] == probing(probed(away="up"))
    assert probing(probed(away="across")) == [UNPROBED] == probing(probed(away="machine"))
    no_height = (4, "the trip height of the switch is not set to Z-1.500")
    assert probing(probed(shift=None)) == [no_height, UNPROBED]
    assert probing(probed(), None) == [(4, "the torch probes, although no probing was requested")]
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, 5.0)
    builder.set_place(Kind.SHIFT, (0.0, 0.0, 1.0), 0, line=2)
    builder.set_place(Kind.SHIFT, (0.0, 0.0, FREE), 0, line=3)
    assert [(d.new, d.text) for d in check_probing(builder.build(), [], planned()[0], None)] == [
        (2, "Z0 is moved without a probe")
    ]


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"depth": -20.0019}, ""),
        ({"depth": -20.0021}, "the probe goes down to Z-20.002, not to Z-20.000"),
        ({"depth": FREE}, "the probe goes down to Znan, not to Z-20.000"),
        ({"feed": 10.049}, ""),
        ({"feed": 10.051}, "the probing feed is 603.06 mm/min"),
        ({"shift": -1.4981}, ""),
        ({"shift": -1.4979}, "the trip height of the switch is not set to Z-1.500"),
        ({"lit": True}, "the torch is on during probing"),
    ],
)
def test_a_probing_move_has_its_depth_feed_and_height(given: dict[str, float], text: str) -> None:
    lit = [(3, UNPROBED[1])] if given.get("lit") else []
    assert probing(probed(**given)) == ([(4, text)] if text else []) + lit  # type: ignore[arg-type]


def travelled(*, lit: bool = False, z: float = 5.0, start: str = "z", end: bool = True) -> Toolpath:
    builder = ToolpathBuilder()
    if start == "machine":
        builder.machine(z=-1.0, line=1)
    elif start == "z":
        builder.rapid(z=z, line=1)
    builder.rapid(1.0, 2.0, line=2)
    builder.spindle(float(lit), 3)
    builder.rapid(5.0, line=4)
    if end:
        builder.end(5)
    return builder.build()


def test_rapids_are_high_enough_and_dark() -> None:
    def found(path: Toolpath, lowest: float | None = 5.0) -> list[tuple[str, int, str]]:
        faults = _rapid_faults(path, lowest)
        assert {d.original for d in faults} <= {0}
        return [(d.what, d.new, d.text) for d in faults]

    assert found(travelled()) == [] == found(travelled(z=4.9981)) == found(travelled(start="machine"))
    assert found(travelled(z=4.9979)) == [
        ("rapid too low", 2, "a rapid across the sheet at Z4.998, below Z5.000, to X1.000 Y2.000"),
        ("rapid too low", 4, "a rapid across the sheet at Z4.998, below Z5.000, to X5.000 Y2.000"),
    ]
    unknown = "a rapid across the sheet at an unknown height, below Z5.000, to"
    assert [text for _, _, text in found(travelled(start=""))] == [
        f"{unknown} X1.000 Y2.000",
        f"{unknown} X5.000 Y2.000",
    ]
    assert found(travelled(z=1.0), None) == []
    on = ("torch on in a rapid", 4, "a rapid from X1.000 Y2.000 with the torch on")
    off = ("torch on at the end", 5, "the program ends with the torch on")
    assert found(travelled(lit=True)) == [on, off] and found(travelled(lit=True, end=False)) == [on]


def run_of(feeds: list[float], heights: list[float], waited: float = 0.5, height: float = 3.8) -> TorchRun:
    """Chords of 10 mm along x; the second one is dark."""
    n = len(feeds)
    burning = np.arange(n) != 1
    return TorchRun(
        3,
        np.column_stack([10.0 * np.arange(n + 1), np.zeros(n + 1)]),
        burning,
        np.array(feeds),
        np.array(heights),
        np.arange(10, 10 + n, dtype=np.int32),
        (Lighting(4, height, 1.0, 0, waited),),
    )


def cut_of(**values: object) -> Cut:
    cut = next(cut for cut in planned()[0].cuts if cut.kind == "cut")
    return replace(cut, **values)  # type: ignore[arg-type]


def test_feeds_are_those_of_the_plan_along_the_cut() -> None:
    """20 mm/s from the start, 40 mm/s from 15 mm on, which is in the middle of the second chord."""
    cut = cut_of(speeds=((0.0, 20.0), (15.0, 40.0)))
    for feeds, fault in (
        ([20.0, 99.0, 40.0], None),
        ([20.09, 99.0, 40.19], None),
        ([20.11, 99.0, 40.0], (10, "the feed is 1206.6 mm/min at X10.000 Y0.000, instead of 1200 mm/min")),
        ([20.0, 99.0, 20.0], (12, "the feed is 1200 mm/min at X30.000 Y0.000, instead of 2400 mm/min")),
    ):
        found = _feed_faults(run_of(feeds, [1.5] * 3), cut)
        assert found == ([] if fault is None else [Difference("feed", 0, *fault)])
    for change, fine in ((24.9, True), (25.04, True), (25.06, False)):
        moved = cut_of(speeds=((0.0, 20.0), (change, 40.0)))
        assert (_feed_faults(run_of([20.0, 99.0, 40.0], [1.5] * 3), moved) == []) is fine


@pytest.mark.parametrize(
    ("given", "fault"),
    [
        ({}, None),
        ({"height": 3.8019}, None),
        (
            {"height": 3.8021},
            ("pierce height", 4, "the torch is switched on at Z3.802, not at the pierce height, Z3.800"),
        ),
        ({"waited": 0.4991}, None),
        ({"waited": 0.9}, None),
        (
            {"waited": 0.4989},
            ("pierce delay", 4, "the torch waits 0.4989 s for the pierce; the cut chart requires 0.5 s"),
        ),
        ({"heights": [1.5, 9.0, 1.5019]}, None),
        (
            {"heights": [1.5, 9.0, 1.5021]},
            ("cut height", 12, "the torch cuts at Z1.502, not at the cut height, Z1.500"),
        ),
    ],
)
def test_a_cut_starts_as_the_chart_asks(given: dict[str, object], fault: tuple[str, int, str] | None) -> None:
    """Pierce at 3.8 mm for half a second, cut at 1.5 mm."""
    assert (STEEL.pierce_height, STEEL.pierce_delay, STEEL.cut_height) == (3.8, 0.5, 1.5)
    run = run_of([20.0] * 3, **{"heights": [1.5] * 3, **given})  # type: ignore[arg-type]
    plan = planned()[0]
    expected = [] if fault is None else [Difference(fault[0], 0, *fault[1:])]
    assert _pierce_and_cut_height_faults(run, cut_of(pierce=True), plan, heights=True, waits=True) == expected
    of_z = [d for d in expected if d.what == "pierce delay"]
    assert _pierce_and_cut_height_faults(run, cut_of(pierce=True), plan, heights=False, waits=True) == of_z
    no_delay = [d for d in expected if d.what != "pierce delay"]
    assert _pierce_and_cut_height_faults(run, cut_of(pierce=True), plan, heights=True, waits=False) == no_delay
    of_cut = [d for d in expected if d.what == "cut height"]
    assert _pierce_and_cut_height_faults(run, cut_of(pierce=False), plan, heights=True, waits=True) == of_cut


COMMENT = "(o=0, kw=1.5, ph=3.8, pd=0.5, ch=1.5, fr=1500)"


def stated(*lines: str, number: int | None = None, words: str = "qtplasmac", lit: int = 3) -> list[tuple[int, str]]:
    """Return the faults of the material in a text; the torch is lit at a line."""
    path = marking(("move", 1.0), *[("move", 2.0)] * (lit - 2), ("cut", 1.0))
    found = _material_faults(path, "\n".join(lines) + "\n", planned()[0], load_dialect(words), number)
    assert {(d.what, d.original) for d in found} <= {("material", 0)}
    return [(d.new, d.text) for d in found]


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("kw=1.5", "kw=1.5009", ""), ("kw=1.5", "kw=1.5011", "kw=1.5011 in the material's comment, not 1.5"),
        ("ph=3.8", "ph=3.7991", ""), ("ph=3.8", "ph=3.7989", "ph=3.7989 in the material's comment, not 3.8"),
        ("pd=0.5", "pd=0.502", "pd=0.502 in the material's comment, not 0.5"),
        ("ch=1.5", "ch=-1.5", "ch=-1.5 in the material's comment, not 1.5"),
        ("fr=1500", "fr=1507", ""), ("fr=1500", "fr=1508", "fr=1508.0 in the material's comment, not 1500"),
        (" ph=3.8,", "", "ph is missing in the material's comment; it must be 3.8"),
    ],
)  # fmt: skip
def test_the_figures_of_the_material_are_those_of_the_chart(old: str, new: str, text: str) -> None:
    assert stated("G21", COMMENT, "M3 $0 S1") == []
    assert stated("G21", COMMENT.replace(old, new), "M3 $0 S1") == ([(2, text)] if text else [])


def test_the_figures_of_a_program_in_inches_are_inches() -> None:
    inches = f"(o=0, kw={1.5 / 25.4:.4f}, ph={3.8 / 25.4:.4f}, pd=0.5, ch={1.5 / 25.4:.4f}, fr={1500 / 25.4:.2f})"
    assert stated("G20", inches, "M3 $0 S1") == [] == stated("N10 G20", inches, "M3 $0 S1")
    assert len(stated("G21", inches, "M3 $0 S1")) == 4


@pytest.mark.parametrize(
    ("lines", "number", "lit", "faults"),
    [
        (("G21", "G0", "M3"), None, 3, [(0, "the program does not give the material to the controller, (o=0, …)")]),
        (("G21", "G0", "M3", COMMENT), None, 3, [(4, "the material must be stated once, before the first cut")]),
        ((COMMENT, COMMENT, "M3"), None, 3, [(2, "the material must be stated once, before the first cut")]),
        (("G21", "M190 P7", "M3"), None, 3, [(2, "material 7 is selected; the program states its own")]),
        (("G21", "M190 P7", "M3"), 7, 3, []),
        (("G21", "G0", "M3"), 7, 3, [(0, "material 7 is not selected before the first cut")]),
        (("G21", "G0", "M3", "M190 P7"), 7, 3, [(0, "material 7 is not selected before the first cut")]),
        (("M190 P7", "M190 P8", "M3"), 7, 3, [(2, "material 8 is selected, not 7")]),
        (("M190 P7", COMMENT, "M3"), 7, 3, [(2, f"'{COMMENT}' overrides material 7")]),
    ],
)
def test_the_material_is_stated_or_selected_once_before_the_first_cut(
    lines: tuple[str, ...], number: int | None, lit: int, faults: list[tuple[int, str]]
) -> None:
    assert stated(*lines, number=number, lit=lit) == faults
