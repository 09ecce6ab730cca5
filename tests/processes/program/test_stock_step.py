"""The stock before the first cut as a STEP file: the same material as the same solid in STL, and what is none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("OCP")

from leafcut.cli.app import run
from leafcut.options import StockOptions
from leafcut.processes.program.workpiece import stock_block, stock_field
from made_solids import box, cut, cylinder, fused, saved

pytestmark = pytest.mark.usefixtures("opencascade_at_hand")

PROGRAM = """G21 G90
T1 M6 (D=6. CR=0. - flat end mill)
M3 S9000
G0 X20 Y10 Z5
G1 Z-2 F300
G1 Y30 F600
G0 Z5
M5
M2
"""


@pytest.fixture
def slot(tmp_path: Path) -> str:
    file = tmp_path / "slot.nc"
    file.write_text(PROGRAM)
    return str(file)


def test_a_stepped_solid_with_a_hole_is_as_high_as_it_was_made(tmp_path: Path) -> None:
    """A round hole of 10 mm, and a step 4 mm lower: a cell is at one of three heights, as its middle lies."""
    solid = fused(box(0, 0, -10, 40, 40, -4), box(0, 0, -4, 20, 40, 0))
    file = saved(tmp_path / "stock.step", cut(solid, cylinder((30, 20, -10), (0, 0, 1), 5, 10)))
    block = stock_block(str(file))
    assert (block.low, block.high) == (pytest.approx((0, 0, -10)), pytest.approx((40, 40, 0)))
    field = stock_field(StockOptions(workpiece=str(file)), block, 0.5)
    x, y = np.meshgrid(*(start + 0.5 * np.arange(n) for start, n in ((field.x, 80), (field.y, 80))))
    away = np.hypot(x - 30, y - 20)
    sure = np.abs(away - 5) > 0.06  # chords of the hole leave it by 0.05 mm
    made = np.where(x < 20, 0.0, np.where(away < 5, -10.0, -4.0))
    assert np.abs(field.heights - made)[sure].max() < 1e-5


@pytest.mark.slow
def test_one_of_several_solids_is_chosen_by_its_number(
    slot: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a block 2 mm deep in the slot the mill takes off that: 20 mm of 6 mm, and two half discs at the ends."""
    file = str(saved(tmp_path / "two.step", box(0, 0, -10, 40, 40, 0), box(100, 0, -10, 140, 40, 0)))
    assert run(["stock", slot, "--workpiece", file]) == 1
    assert "2 solids" in (told := capsys.readouterr().err)
    assert told.count("\n") == 1
    assert told.rstrip().endswith("choose one with --solid")
    assert run(["stock", slot, "--workpiece", file, "--solid", "1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["removed_mm3"] == pytest.approx(2 * (120 + 9 * np.pi), rel=0.01)
    assert run(["stock", slot, "--workpiece", file, "--solid", "2"]) == 1
    assert (
        "the program never touches the stock (X 100 to 140, Y 0 to 40, Z -10 to 0 mm); give" in capsys.readouterr().err
    )
    assert run(["stock", slot, "--workpiece", file, "--solid", "3"]) == 1
    assert "--solid 3: the STEP file has 2 solids" in capsys.readouterr().err


@pytest.mark.slow
def test_reordering_takes_a_step_file_as_its_stock(slot: str, tmp_path: Path) -> None:
    file = str(saved(tmp_path / "stock.stp", box(0, 0, -10, 40, 40, 0)))
    out = tmp_path / "out.nc"
    assert run(["reorder", slot, "-o", str(out), "--air", "--workpiece", file, "--preset", "fast"]) == 0
    assert out.is_file()


@pytest.mark.parametrize(
    ("name", "more", "status", "words"),
    [
        ("gone.step", (), 1, "gone.step: cannot be read"),
        ("torn.step", (), 1, "the STEP file is truncated"),
        ("empty.step", (), 1, "has no solid"),
        ("text.step", (), 1, "is not an STL file"),
        (
            "0,0,-10,40,40,0",
            ("--solid", "1"),
            2,
            "--solid, --up and --z-zero apply to STEP files only, not to a block; leave them out",
        ),
        ("", ("--solid", "1"), 2, "--solid: only used with --workpiece"),
    ],
)
def test_what_is_no_solid_is_refused_in_one_line(
    name: str,
    more: tuple[str, ...],
    status: int,
    words: str,
    slot: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    whole = saved(tmp_path / "whole.step", box(0, 0, -10, 40, 40, 0)).read_bytes()
    (tmp_path / "torn.step").write_bytes(whole[: len(whole) // 2])
    head, _, _ = whole.partition(b"DATA;")
    (tmp_path / "empty.step").write_bytes(head + b"DATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    (tmp_path / "text.step").write_text("a part\n" * 20)
    given = name if "," in name else str(tmp_path / name)
    assert run(["stock", slot, *(("--workpiece", given) if name else ()), *more]) == status
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1
