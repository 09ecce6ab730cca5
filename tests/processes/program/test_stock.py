"""`leafcut stock`: removed material, against figures worked by hand."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.material.height_field import StockBlock, default_cell_size

#: A slot 20 long and 2 deep with a flat mill of 6, gone back at feed; 100 mm/s² is the default machine's business.
SLOT = """G21 G90
T1 M6 (D=6. CR=0. - flat end mill)
M3 S9000
G0 X10 Y10 Z5
G1 Z-2 F300
G1 X30 F600
G1 X10
G0 Z5
M5
M2
"""


def made(folder: Path, text: str) -> str:
    file = folder / "part.nc"
    file.write_text(text)
    return str(file)


def test_a_slot_and_the_way_back_through_it(tmp_path: Path) -> None:
    """6 · 20 · 2 + π 9 · 2 mm³; 20 mm at 10 mm/s in the stock, and in the air the same back and 5 mm down at 5 mm/s."""
    found = leafcut.stock(made(tmp_path, SLOT))
    (one,) = found.tools
    assert found.derived
    assert (found.block.low[2], found.block.high[2]) == (-3.0, 0.0)
    assert found.block.low[:2] == pytest.approx((7.0, 7.0))
    assert one.removed_mm3 == pytest.approx(240 + math.pi * 18, rel=0.005)
    assert found.field.volume + found.removed_mm3 == pytest.approx(26 * 6 * 3, rel=0.03)
    # The last piece of the plunge, and the slot; the mill is flat, so all of the rest is in the air.
    assert one.deepest_mm == pytest.approx(2.0, abs=1e-6)
    assert one.widest_mm == pytest.approx(6.0, abs=0.2)
    assert one.air_s == pytest.approx(2.0, rel=0.1)
    assert found.rapids == ()


def test_a_rapid_that_meets_the_stock_is_a_danger_with_its_line_and_depth(tmp_path: Path) -> None:
    found = leafcut.stock(made(tmp_path, SLOT.replace("G0 Z5\nM5", "G0 X40\nG0 Z5\nM5")), workpiece="0,0,-5,60,20,0")
    (rapid,) = found.rapids
    assert (rapid.line, rapid.depth_mm) == (8, pytest.approx(2.0))
    (issue,) = [issue for issue in found.issues if issue.message.startswith("a rapid goes")]
    assert (issue.severity, issue.place) == ("danger", "line 8")


@pytest.mark.hazard
@pytest.mark.parametrize(
    "second, place, found",
    [
        ("Y13", "X20 Y12", []),
        ("Y17", "X20 Y13.5", ["danger"]),
        ("Y13", "X60 Y10", ["danger"]),
        ("Y13", "X31 Y12", ["danger"]),
    ],
)
def test_the_simulation_decides_on_rapids_down_inside_the_stock_that_it_knows(
    second: str, place: str, found: list[str], tmp_path: Path
) -> None:
    """A ball mill cuts two passes; only the simulation knows whether a rapid between them, to Z-0.5, meets the rib.

    Beside an assumed block the stock is unknown: there a rapid below Z0 stays a danger.
    """
    text = SLOT.replace("flat", "ball").replace("G1 X10\n", f"G1 {second}\nG1 X10\n")
    text = text.replace("M5", f"G0 {place}\nG0 Z-0.5\nG0 Z5\nM5")
    issues = leafcut.stock(made(tmp_path, text)).issues
    assert [issue.severity for issue in issues if issue.code == "L802"] == found


def test_with_strict_a_rapid_in_the_stock_ends_with_status_1(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = made(tmp_path, SLOT.replace("G0 Z5\nM5", "G0 X40\nG0 Z5\nM5"))
    assert run(["stock", bad, "--workpiece", "0,0,-5,60,20,0"]) == 0
    assert "danger: L802 a rapid goes 2.00 mm deep into the stock (line 8)" in capsys.readouterr().out
    assert run(["stock", bad, "--workpiece", "0,0,-5,60,20,0", "--strict"]) == 1


def test_the_command_prints_answers_and_writes_what_is_left(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = made(tmp_path, SLOT)
    for name in ("left.png", "left.stl"):
        assert run(["stock", program, "-o", str(tmp_path / name), "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert (tmp_path / name).stat().st_size > 1000
        assert answer["output"] == str(tmp_path / name)
        (tool,) = answer["tools"]
        assert (tool["number"], tool["kind"], tool["diameter"]) == (1, "end-mill", 6.0)
        assert answer["removed_mm3"] == pytest.approx(tool["removed_mm3"])
    assert run(["stock", program]) == 0
    out = capsys.readouterr().out
    assert "0.30 cm³ off a block around the cuts of 26.0 × 6.0 × 3.0 mm" in out
    assert "T1 end-mill Ø6" in out


@pytest.mark.parametrize(
    ("comment", "z", "area"),
    [
        ("(T1 D=6. CR=0. - flat end mill)", -2.0, 12.0),
        ("(T1 D=6. CR=3. - ball end mill)", -3.0, 4.5 * math.pi),
        ("(T1 D=6. CR=1. - bullnose end mill)", -2.0, 12.0 - 2.0 * (1.0 - math.pi / 4)),
        ("(T1 D=6. TAPER=90deg - V-bit)", -2.0, 4.0),
    ],
)
def test_a_tool_has_the_shape_that_its_comment_says(comment: str, z: float, area: float, tmp_path: Path) -> None:
    """From the section of a long slot: the additional removal of a slot 100 mm longer."""
    volumes = []
    for end in (30, 130):
        text = SLOT.replace("(D=6. CR=0. - flat end mill)", comment).replace("Z-2", f"Z{z}").replace("X30", f"X{end}")
        volumes.append(leafcut.stock(made(tmp_path, text), cell=0.05).removed_mm3)
    assert (volumes[1] - volumes[0]) / 100.0 == pytest.approx(area, rel=0.005)


def test_a_tool_of_a_library_comes_before_the_comment(tmp_path: Path) -> None:
    (tmp_path / "tools.toml").write_text('[[tool]]\nnumber = 1\nkind = "ball-mill"\ndiameter = "4 mm"\n')
    (one,) = leafcut.stock(made(tmp_path, SLOT), tools=tmp_path / "tools.toml").tools
    assert (one.tool.kind, one.tool.diameter) == ("ball-mill", 4.0)


def test_what_is_fed_first_from_an_unknown_place_cuts_at_its_end_and_is_told(tmp_path: Path) -> None:
    found = leafcut.stock(made(tmp_path, "G21 G90\nT1 M6\nM3 S900\nG1 X10 Y10 Z-2 F60\nG0 Z5\nM2\n"), tool_diameter=6)
    assert found.removed_mm3 == pytest.approx(math.pi * 18, rel=0.01)
    assert [i.message for i in found.issues if i.code == "L808"] == [
        "the start point of 1 cut is unknown, so the simulation cuts only at the end point"
    ]
    assert found.rapids == ()


@pytest.mark.parametrize(
    ("text", "options", "status", "words"),
    [
        (SLOT.replace("(D=6. CR=0. - flat end mill)", ""), [], 2, "part.nc:5: the shape of tool T1 is unknown"),
        (SLOT, ["--workpiece", "0,0,0"], 2, "has 3 numbers; give six"),
        (SLOT, ["--workpiece", "0,0,0,9,9,0"], 2, "--workpiece 0,0,0,9,9,0: a block of 9 × 9 × 0 mm has no volume"),
        (SLOT, ["--workpiece", "0,0,-5,9,x,0"], 2, "--workpiece 0,0,-5,9,x,0: 'x'"),
        (
            SLOT,
            ["--workpiece", "100,100,-5,200,200,0"],
            1,
            "the program never touches the stock (X 100 to 200",
        ),
        (
            SLOT,
            ["--workpiece", "0,0,-5,9000,9000,0", "--cell", "0.001"],
            1,
            "are needed, but the limit is 64,000,000",
        ),
        (SLOT.replace("Z-2", "Z2"), [], 1, "cuts nothing below Z0"),
        ("G21 G90\nG0 X5 Y5 Z5\nM2\n", [], 1, "the program cuts nothing"),
        (SLOT, ["-o", "part.jpg"], 2, "'part.jpg' is neither a picture (.png) nor a solid (.stl)"),
        (SLOT, ["-o", "gone/part.png"], 1, "no folder"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    text: str, options: list[str], status: int, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["stock", made(tmp_path, text), *options]) == status
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1


#: Three slots, each by itself; a ball mill, so that depth is width as well.
SLOTS = """G21 G90
T1 M6 (D=6. CR=3. - ball end mill)
M3 S9000
G0 X10 Y10 Z5
G1 Z-2 F300
G1 X30 F600
G0 Z5
G0 X10 Y30
G1 Z-2 F300
G2 X30 I10 J0 F600
G0 Z5
G0 X60 Y10
G1 Z-1 F300
G1 Y30 Z-3 F600
G0 Z5
M5
M2
"""


def test_another_order_leaves_the_same_of_the_stock(tmp_path: Path) -> None:
    """The slots in reverse order, and the arc in the opposite direction."""
    lines = SLOTS.splitlines(keepends=True)
    first, second, third = lines[3:7], lines[7:11], lines[11:15]
    second = ["G0 X30 Y30\n", "G1 Z-2 F300\n", "G3 X10 I-10 J0 F600\n", "G0 Z5\n"]
    (tmp_path / "new.nc").write_text("".join([*lines[:3], "G0 Z5\n", *third, *second, *first, *lines[15:]]))
    found = leafcut.stock(tmp_path / "new.nc", same_as=made(tmp_path, SLOTS))
    assert (found.same_as, found.differences) == (str(tmp_path / "part.nc"), ())


@pytest.mark.parametrize(
    ("old", "new", "x", "y"),
    [
        ("G1 Z-2 F300\nG1 X30", "G1 Z-2.05 F300\nG1 X30", 20.0, 10.0),
        ("G1 X30 F600", "G1 X31 F600", 33.5, 10.0),
        ("I10 J0 F600", "I10 J0.4 F600", 20.0, 40.0),
        ("Z-3 F600", "Z-3.1 F600", 60.0, 30.0),
        ("G0 X60 Y10\nG1 Z-1 F300\nG1 Y30 Z-3 F600\nG0 Z5\n", "", 60.0, 20.0),
        ("G0 X60 Y10\n", "G1 X62 Y12 F300\nG1 Z1\nG1 X60 Y10\n", None, None),
        ("CR=3. - ball", "CR=2.5 - bullnose", 20.0, 10.0),
    ],
)
def test_what_leaves_something_else_is_found_and_what_is_fed_in_the_air_is_not(
    old: str, new: str, x: float | None, y: float | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert old in SLOTS
    (tmp_path / "new.nc").write_text(SLOTS.replace(old, new))
    status = run(["stock", str(tmp_path / "new.nc"), "--same-as", made(tmp_path, SLOTS), "--json"])
    answer = json.loads(capsys.readouterr().out)
    assert (status, answer["same"]) == ((0, True) if x is None else (1, False))
    if x is not None and y is not None:
        assert min(math.dist((one["x"], one["y"]), (x, y)) for one in answer["differences"]) < 12.0


LIBRARY = """[[tool]]
number = 1
kind = "end-mill"
diameter = "6 mm"
flute_length = "5 mm"
shank_diameter = "6 mm"
stickout = "9 mm"
holder = "20-28 x 5, 28 x 40"
"""


@pytest.mark.parametrize("z", [4, 7, 10])
def test_a_shank_and_a_holder_in_the_stock_are_dangers_and_with_strict_status_1(
    z: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Flutes of 5 mm, the holder from 9 mm on, of 20 mm: 4 deep is free, 7 deep the shank, 10 deep both are in it."""
    (tmp_path / "tools.toml").write_text(LIBRARY)
    program = made(tmp_path, SLOT.replace("Z-2", f"Z-{z}"))
    given = ["--tools", str(tmp_path / "tools.toml"), "--workpiece", "-20,-20,-20,60,40,0"]
    assert run(["stock", program, *given, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    found = {(one["line"], one["part"]): one["depth_mm"] for one in answer["collisions"]}
    # The holder on the way down, in the slot, on the way back and where it goes up; the shank in the slot alone.
    expected = {**{(line, "holder"): 1.0 for line in (5, 6, 7, 8)}, (6, "shank"): 5.0}
    assert found == pytest.approx({4: {}, 7: {(6, "shank"): 2.0}, 10: expected}[z])
    assert {one["severity"] for one in answer["issues"] if one["code"] == "L809"} == ({"danger"} if found else set())
    assert run(["stock", program, *given, "--strict"]) == (1 if found else 0)
    if z == 10:
        out = capsys.readouterr().out
        assert "danger: L809 the shank of T1 enters the stock, 5.00 mm deep (line 6)" in out
        assert "the holder of T1 enters the stock, 1.00 mm deep at most, in 4 lines starting here (line 5)" in out


def test_a_body_that_the_library_does_not_know_meets_nothing(tmp_path: Path) -> None:
    (tmp_path / "tools.toml").write_text('[[tool]]\nnumber = 1\nkind = "end-mill"\ndiameter = "6 mm"\n')
    found = leafcut.stock(made(tmp_path, SLOT.replace("Z-2", "Z-19")), tools=tmp_path / "tools.toml")
    assert found.collisions == ()


def test_a_large_stock_keeps_cells_that_see_the_smallest_tool_and_says_what_they_take(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """1 × 1 m and a tool of 1 mm: a fifth of it, 5,000 × 5,000 cells of 4 bytes. Of 3 × 3 m no such cells fit."""
    text = SLOT.replace("D=6.", "D=1.").replace("X30", "X{end}").replace("X10 Y10", "X1 Y1")
    program = made(tmp_path, text.replace("X{end}", "X999"))
    assert run(["stock", program, "--workpiece", "0,0,-5,1000,1000,0", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["stock"]["cell"], answer["stock"]["cells"], answer["stock"]["bytes"]) == (
        0.2,
        25_000_000,
        100_000_000,
    )
    assert answer["removed_mm3"] == pytest.approx(2 * 998 + math.pi / 2, rel=0.01)
    assert default_cell_size(StockBlock((0, 0, -5), (3000, 3000, 0)), 1.0) == pytest.approx(0.38)
