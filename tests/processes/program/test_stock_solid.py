"""The stock before the first cut as STL: the stock left by an earlier set-up, and invalid files."""

from __future__ import annotations

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.material.height_field import HeightField
from leafcut.material.mesh_field import mesh_to_height_field
from leafcut.read.meshes import load_mesh
from leafcut.report.stock_report import stock_stl

SLOT = """G21 G90
T1 M6 (D=6. CR=0. - flat end mill)
M3 S9000
G0 X{x} Y10 Z5
G1 Z-{z} F300
G1 Y30 F600
G0 Z5
M5
M2
"""
BLOCK = "0,0,-10,40,40,0"


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> list[list[tuple[float, float, float]]]:
    """Return the triangles of a block, their outer side out."""
    (x, y, z), (a, b, c) = low, high
    sides = [
        [(x, y, z), (x, b, z), (a, b, z), (a, y, z)], [(x, y, c), (a, y, c), (a, b, c), (x, b, c)],
        [(x, y, z), (a, y, z), (a, y, c), (x, y, c)], [(a, y, z), (a, b, z), (a, b, c), (a, y, c)],
        [(a, b, z), (x, b, z), (x, b, c), (a, b, c)], [(x, b, z), (x, y, z), (x, y, c), (x, b, c)],
    ]  # fmt: skip
    return [[p, q, r] for p, *rest in sides for q, r in pairwise(rest)]


def stl(file: Path, triangles: list[list[tuple[float, float, float]]]) -> str:
    """Write triangles as binary STL; return the path."""
    table = np.zeros(len(triangles), dtype=[("n", "<f4", 3), ("corner", "<f4", (3, 3)), ("a", "<u2")])
    table["corner"] = np.array(triangles, dtype=np.float32).reshape(-1, 3, 3)
    file.write_bytes(b" " * 80 + len(table).to_bytes(4, "little") + table.tobytes())
    return str(file)


def program(folder: Path, x: float = 20.0, z: float = 2.0) -> str:
    file = folder / f"slot_{x:g}_{z:g}.nc"
    file.write_text(SLOT.format(x=x, z=z))
    return str(file)


@pytest.mark.parametrize("through", [False, True])
def test_what_a_set_up_left_comes_back_from_its_file_cell_by_cell(through: bool, tmp_path: Path) -> None:
    """Heights of single precision, also where the stock is cut through, and at its sides."""
    heights = np.random.default_rng(3).uniform(-9, 0, (30, 44)).astype(np.float32)
    heights[5:9, 10:20] = -11.0 if through else -9.5
    field = HeightField(heights, 3.25, -7.75, 0.5, -10.0)
    (tmp_path / "left.stl").write_bytes(stock_stl(field)[0])
    back = mesh_to_height_field(load_mesh(tmp_path / "left.stl"), 0.5)
    assert back.heights.shape == heights.shape
    assert (back.x, back.y, back.floor) == pytest.approx((field.x, field.y, field.floor))
    inner = np.maximum(heights, np.float32(-10.0))
    assert np.abs(back.heights - inner).max() < 1e-3


@pytest.mark.parametrize("cell", [0.4, pytest.param(0.2, marks=pytest.mark.slow)])
def test_two_set_ups_one_after_the_other_leave_what_one_program_of_both_does(tmp_path: Path, cell: float) -> None:
    """A slot along Y, then a deeper slot next to it; through a file, and at once."""
    left = str(tmp_path / "left.stl")
    assert run(["stock", program(tmp_path), "--workpiece", BLOCK, "--cell", str(cell), "-o", left]) == 0
    second = leafcut.stock(program(tmp_path, 24.0, 4.0), workpiece=left, cell=cell)
    both = tmp_path / "both.nc"
    both.write_text(SLOT.format(x=20, z=2).replace("M5\nM2\n", "") + SLOT.format(x=24, z=4).split("S9000\n")[1])
    at_once = leafcut.stock(both, workpiece=BLOCK, cell=cell)
    assert second.field.heights.shape == at_once.field.heights.shape
    assert np.abs(second.field.heights - at_once.field.heights).max() < 1e-3
    # Of the 6 mm of the second slot 2 were 2 deep already.
    assert second.removed_mm3 == pytest.approx(
        at_once.removed_mm3 - leafcut.stock(program(tmp_path), workpiece=BLOCK, cell=cell).removed_mm3, rel=1e-4
    )


def test_a_solid_is_as_high_as_it_is_over_every_cell(tmp_path: Path) -> None:
    """A plate with a block on it, and a wedge whose height is known everywhere."""
    file = stl(tmp_path / "stepped.stl", box((0, 0, -10), (40, 40, -2)) + box((10, 10, -2), (20, 30, 3)))
    field = mesh_to_height_field(load_mesh(file), 0.5)
    assert field.height_at(5.0, 5.0) == pytest.approx(-2.0)
    assert field.height_at(15.0, 20.0) == pytest.approx(3.0)
    assert field.volume == pytest.approx(40 * 40 * 8 + 10 * 20 * 5)
    low, high = (0.0, 0.0, 0.0), (10.0, 8.0, 4.0)
    wedge = [
        [
            (low[0], y, high[2]) if p[0] == low[0] and p[2] == high[2] else (p[0], p[1], low[2])
            for p in t
            for y in [p[1]]
        ]
        for t in box(low, high)
    ]
    field = mesh_to_height_field(load_mesh(stl(tmp_path / "wedge.stl", wedge)), 0.1)
    x = field.x + field.cell * np.arange(field.heights.shape[1])
    assert np.abs(field.heights - 4.0 * (1.0 - x / 10.0)).max() < 1e-5


def test_undercuts_are_told_and_count_as_material(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A block of 10 × 20 mm that hangs 3 mm over a plate; also where its triangles are turned inside out."""
    shape = box((0, 0, -10), (40, 40, -8)) + box((15, 10, -5), (25, 30, 0))
    for name, triangles in (("over.stl", shape), ("turned.stl", [one[::-1] for one in shape])):
        assert run(["stock", program(tmp_path), "--workpiece", stl(tmp_path / name, triangles), "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert [one["message"] for one in answer["issues"] if one["code"] == "L811"] == [
            "the stock has undercuts (200.0 mm² seen from below), which are treated as solid material"
        ]
        assert answer["removed_mm3"] == pytest.approx(6 * 20 * 2, rel=0.02)


@pytest.mark.parametrize(
    ("name", "status", "words"),
    [
        ("gone.stl", 1, "gone.stl: cannot be read"),
        ("empty.stl", 1, "has no triangles"),
        ("open.stl", 1, "open.stl: has holes in its surface, so its inside is unknown; repair it"),
        ("torn.stl", 1, "is truncated"),
        ("many.stl", 1, "has 10,000,000 triangles; at most"),
        ("metres.stl", 1, "is 0.04 mm long, too long for a part; save it in mm"),
        ("inches.stl", 1, "never touches the stock"),
        ("flat.stl", 1, "has no volume"),
    ],
)
def test_what_is_no_solid_is_refused_in_one_line(
    name: str, status: int, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    block = box((0, 0, -10), (40, 40, 0))
    stl(tmp_path / "empty.stl", [])
    stl(tmp_path / "open.stl", block[1:])
    stl(tmp_path / "torn.stl", block)
    (tmp_path / "torn.stl").write_bytes((tmp_path / "torn.stl").read_bytes()[:-30])
    with (tmp_path / "many.stl").open("wb") as file:  # of the stated length but empty: it occupies no disk space
        file.write(b" " * 80 + (10_000_000).to_bytes(4, "little"))
        file.truncate(84 + 50 * 10_000_000)
    for unit, size in (("metres", 1e-3), ("inches", 1 / 25.4)):
        stl(tmp_path / f"{unit}.stl", [[(x * size, y * size, z * size) for x, y, z in one] for one in block])
    stl(tmp_path / "flat.stl", box((0, 0, 0), (40, 40, 0)))
    assert run(["stock", program(tmp_path), "--workpiece", str(tmp_path / name)]) == status
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1


def test_cells_that_do_not_fit_and_cuts_beyond_the_stock_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = stl(tmp_path / "stock.stl", box((0, 0, -10), (40, 40, 0)))
    assert run(["stock", program(tmp_path), "--workpiece", file, "--cell", "0.001"]) == 1
    assert "1,600,000,000 are needed, but the limit is 64,000,000" in capsys.readouterr().err
    small = stl(tmp_path / "small.stl", box((0, 0, -10), (40, 18, 0)))
    assert run(["stock", program(tmp_path), "--workpiece", small]) == 0
    assert "a cut reaches Y30.00, but the given stock ends at Y18 (line 6)" in capsys.readouterr().out
    inches = stl(tmp_path / "inches.stl", box((0, 0, -0.4), (1.6, 1.6, 0)))
    assert run(["stock", program(tmp_path), "--workpiece", inches]) == 1
    assert "never touches the stock" in (told := capsys.readouterr().err)
    assert told.endswith("; in inches, the stock would contain all cuts: save the file in mm\n")
    assert run(["stock", program(tmp_path), "--workpiece", "0,0,-1,1e9,9,0"]) == 2
    assert "is 1e+06 m long, which is too long for a stock; check its" in capsys.readouterr().err


def test_the_stock_is_never_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = stl(tmp_path / "stock.stl", box((0, 0, -10), (40, 40, 0)))
    assert run(["stock", program(tmp_path), "--workpiece", file, "-o", file]) == 1
    assert "stock.stl" in capsys.readouterr().err


def test_reordering_takes_a_solid_as_its_stock(tmp_path: Path) -> None:
    """A step 5 mm lower on the right: there the tool is fed 5 mm more of its way down in the air than on the left."""
    deep = "".join(
        f"G0 X{x} Y{y}\nG1 Z-7 F300\nG1 Y{y + 8} F600\nG0 Z5\n" for x, y in ((10, 8), (30, 24), (10, 24), (30, 8))
    )
    file = tmp_path / "deep.nc"
    file.write_text(SLOT.split("G0 X", maxsplit=1)[0] + "G0 Z5\n" + deep + "M5\nM2\n")
    stepped = stl(tmp_path / "step.stl", box((0, 0, -10), (40, 40, -5)) + box((0, 0, -5), (20, 40, 0)))
    whole = stl(tmp_path / "whole.stl", box((0, 0, -10), (40, 40, 0)))
    saved = []
    for stock in (whole, stepped):
        found = leafcut.optimize(file, workpiece=stock, air=True, preset="fast")
        assert found.detail.stock.given
        assert found.detail.stock.cells > 10_000
        saved.append(found.detail.pace.air_s)
    # 5 mm at 5 mm/s on two slots, less what a rapid takes.
    assert saved[1] - saved[0] == pytest.approx(2.0, abs=0.4)
    assert math.isfinite(saved[0])


def test_a_reordered_program_is_never_written_over_its_stock(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = stl(tmp_path / "stock.stl", box((0, 0, -10), (40, 40, 0)))
    before = Path(file).read_bytes()
    assert run(["reorder", program(tmp_path), "--workpiece", file, "-o", file]) == 1
    assert "not show an unchanged file of leafcut" in capsys.readouterr().err
    assert Path(file).read_bytes() == before
