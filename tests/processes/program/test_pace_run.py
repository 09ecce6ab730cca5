"""`reorder --air --feeds --low-retracts`: faster moves, without any other change."""

from __future__ import annotations

import math
import random
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.errors import OptionError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from pace_programs import BLOCK, HEAD, TAIL, body, reordered
from rs274_moves import assert_same_moves, moves_of_rs274, moves_of_toolpath, run_rs274
from stepped_stock import SteppedStock


def test_a_plunge_is_a_rapid_down_to_the_clearance_and_what_comes_up_is_one_all_the_way(tmp_path: Path) -> None:
    text = HEAD + "G0 X10 Y10\nG0 Z5\nG1 Z-2 F60\nG1 X40 F600\nG1 Z5 F60\n" + TAIL
    found = reordered(tmp_path, text, air=True, workpiece=BLOCK)
    assert body(found) == ["G0 X10 Y10", "G0 Z5", "G0 Z1.0", "G1 Z-2 F60", "G1 X40 F600", "G0 Z5 F60"]
    # From 5 to 1 at 1 mm/s, and 7 mm up.
    assert found.detail.pace.air_s == pytest.approx(4 + 7, rel=0.1)
    assert (found.detail.pace.rapids, found.detail.pace.clearance_mm) == (2, pytest.approx(1.0))
    assert found.detail.pace.feeds_s is None


def test_words_that_the_next_lines_take_from_a_changed_one_are_said_again(tmp_path: Path) -> None:
    """G1 and F are in the line that becomes a rapid; the following cut has neither."""
    text = HEAD + "G0 X-10 Y25 Z5\nG1 Z-2 F300\nX-5\nX40\nY40\nG2 X50 Y30 I0 J-10\nG1 X60\n" + TAIL
    lines = body(reordered(tmp_path, text, air=True, workpiece=BLOCK))
    assert lines == [
        "G0 X-10 Y25 Z5",
        "G0 Z-2 F300",
        "X-5",
        "G1 X40",
        "Y40",
        "G2 X50 Y30 I0 J-10",
        "G1 X60",
    ]


def test_a_cut_is_divided_where_it_leaves_the_material(tmp_path: Path) -> None:
    """The tool, 6 wide, is 1 mm clear of the block's edge, X70, at X74, but for the cell of the model."""
    text = HEAD + "G0 X60 Y20\nG0 Z1\nG1 Z-2 F300\nG1 X80 F60\nX81 Y45\n" + TAIL
    lines = body(reordered(tmp_path, text, air=True, workpiece=BLOCK, cell=0.1))
    split = next(line for line in lines if re.match(r"G1 X7[0-9.]+$|G1 X7[0-9.]+ F60.0", line))
    assert 74.0 <= float(re.search(r"X([0-9.]+)", split)[1]) <= 77.5  # a piece is half a tool long
    assert lines[lines.index(split) + 1 :] == ["G0 X80 F60", "X81 Y45"]


#: A pocket from X7 to X43 and Y7 to Y21, 2 deep.
POCKET = "G0 X10 Y10\nG0 Z5\nG1 Z-2 F60\nG1 X40 F600\nY14\nX10\nY18\nX40\nG0 Z5\n"


def test_without_a_stock_only_ways_over_places_where_the_tool_has_been_are_in_the_air(tmp_path: Path) -> None:
    """The second plunge descends in the pocket; the first and the last descend into unknown material."""
    text = HEAD + POCKET + "G0 X25 Y14\nG1 Z-4 F60\nG1 X30 F600\nG0 Z5\nG0 X10 Y30\nG1 Z-2 F60\nG1 X40 F600\n"
    found = reordered(tmp_path, text + TAIL, air=True)
    old = text.splitlines()[4:]
    at = old.index("G1 Z-4 F60")
    assert body(found) == [*old[:at], "G0 Z-1.0", *old[at:]]
    assert found.detail.pace.assumed
    assert any(issue.code == "L510" for issue in found.issues)


def test_a_corner_of_two_rapids_that_a_controller_rounds_as_far_as_it_likes_is_taken_slowly(tmp_path: Path) -> None:
    """G64 without P: LinuxCNC would go down before it is there. High above the material that does no harm."""
    for height, first in ((3, "G1 Z2.5"), (60, "G0 Z1.0")):
        text = HEAD.replace(" P0.02", "") + f"G0 X10 Y10 Z{height}\nG0 X30\nG1 Z-2 F60\nG1 X40 F600\n" + TAIL
        lines = body(reordered(tmp_path, text, air=True, workpiece=BLOCK))
        assert lines[2].startswith(first), lines


def test_retracts_and_r_planes_are_as_low_as_the_ways_between_allow(tmp_path: Path) -> None:
    """Over the top at 0 by 1 mm; a descent to 2 starts at 2; next to the block, the R plane of a hole is unchanged."""
    text = HEAD + (
        "G0 X10 Y10\nG0 Z2\nG1 Z-2 F60\nG1 X40 F600\nG0 Z15\nG0 X10 Y30\nG0 Z2\nG1 Z-2 F60\nG1 X40 F600\n"
        "G0 Z15\nG0 X10 Y40\nG1 Z-2 F60\nG0 Z15\nG99 G81 X50 Y10 R5 Z-3 F100\nX50 Y20\nG80\n"
    )
    found = reordered(tmp_path, text + TAIL, low_retracts=True, workpiece=BLOCK)
    changed = [(a, b) for a, b in zip(text.splitlines()[4:], body(found), strict=True) if a != b]
    assert changed == [
        ("G0 Z15", "G0 Z2.0"),
        ("G0 Z15", "G0 Z1.0"),
        ("G99 G81 X50 Y10 R5 Z-3 F100", "G99 G81 X50 Y10 R1.0 Z-3 F100"),
    ]
    assert found.detail.pace.lowered == 3
    assert found.detail.pace.retracts_s == pytest.approx(found.before.time_s - found.after.time_s)


def test_an_r_plane_from_which_the_machine_goes_across_in_its_own_coordinates_stays(tmp_path: Path) -> None:
    """It is unknown whether that move is above the part; a move straight up is safe."""
    holes = "G0 X50 Y10 Z15\nG99 G81 X50 Y10 R5 Z-3 F100\nX50 Y20\nG80\n"
    for home, plane in (("G53 G0 Z0\nG53 G0 X0 Y0\n", "R1.0"), ("G53 G0 X0 Y0\n", "R5")):
        text = f"{HEAD}{holes}{home}M5\nM30\n"
        assert plane in reordered(tmp_path, text, low_retracts=True, workpiece=BLOCK).text.split(), home


def test_a_retract_stays_above_what_stands_between_two_cuts(tmp_path: Path) -> None:
    """The top of the block, 0, stands between two slots that are 8 deep: the way across is over it."""
    text = HEAD + ("G0 X10 Y10\nG0 Z2\nG1 Z-8 F60\nG1 X20 F600\nG1 Z-7.5\nG0 Z15\nG0 X40 Y10\nG1 Z-8 F60\nG0 Z15\n")
    assert "G0 Z1.0" in body(reordered(tmp_path, text + TAIL, low_retracts=True, workpiece=BLOCK))
    # Within one pocket, 4 mm from all its walls, the way is lower than the top.
    inside = HEAD + POCKET + "G0 X18 Y14\nG1 Z-3 F60\nG0 Z15\nG0 X14\nG1 Z-3 F60\n"
    assert "G0 Z-1.0" in body(reordered(tmp_path, inside + TAIL, low_retracts=True, workpiece=BLOCK))


def test_beside_the_block_stands_what_holds_it(tmp_path: Path) -> None:
    """Next to the block is its fixture: the moves from cut to cut along its side pass over it."""
    text = HEAD + "G0 X-4 Y5\nG0 Z2\nG1 Z-5 F60\nG1 X-2 F600\nG0 Z15\nG0 X-4 Y40\nG1 Z-5 F60\nG1 X-2 F600\n"
    assert "G0 Z1.0" in body(reordered(tmp_path, text + TAIL, low_retracts=True, workpiece=BLOCK))


def test_ways_over_a_named_clamp_keep_their_height(tmp_path: Path) -> None:
    text = HEAD + "G0 X10 Y10 Z15\nG1 Z-2 F60\nG0 Z15\nG0 X60\nG1 Z-2 F60\n" + TAIL
    clamp = {"keep_out": "30 5 40 15", "clearance_height": 12}
    found = reordered(tmp_path, text, low_retracts=True, workpiece=BLOCK, **clamp)
    assert "Z1.0" not in found.text
    assert [issue.code for issue in found.issues if issue.code == "L513"] == ["L513"]
    assert "Z1.0" in reordered(tmp_path, text, low_retracts=True, workpiece=BLOCK).text


def test_where_rapids_are_not_straight_a_way_across_the_air_is_a_fast_cut(tmp_path: Path) -> None:
    """Each axis of a Haas goes by itself: from X80 Y58 it would come to the block on another way."""
    text = HEAD + "G0 X78. Y-10. Z5.\nG1 Z-2. F300.\nG1 X80. Y58.\nG1 X76. Y45.\nX80.\nX40. F200.\n" + TAIL
    text = text.replace("Z15\n", "Z15.\n")
    lines = body(reordered(tmp_path, text, air=True, workpiece=BLOCK, machine="haas-vf2"))
    assert lines[:3] == ["G0 X78. Y-10. Z5.", "G0 Z-2. F300.", "G1 X80. Y58. F16500.0"]
    assert "G0 X80." in lines


#: A slot, and passes next to it that cut 1.5 mm of 6: their chips are 2 √(¼ · ¾) = 0.866 of the slot's.
SLOT_AND_SIDE = HEAD + "G0 X10 Y10\nG0 Z2\nG1 Z-2 F60\nG1 X60 F600\nG1 Y11.5\nG1 X10\n" + TAIL


def test_feeds_rise_until_the_chips_are_as_thick_as_the_programs_own_thickest(tmp_path: Path) -> None:
    """600 / 0.866 = 693, in steps of a tenth: 660. Cuts of a 20th of the width, finishing passes, get no faster."""
    found = reordered(tmp_path, SLOT_AND_SIDE, feeds=True, workpiece=BLOCK)
    assert "G1 X10 F660.0" in body(found) or any("F660.0" in line for line in body(found))
    (tool,) = found.detail.pace.tools
    assert tool.chip_limit == pytest.approx(600 / 6000, rel=1e-6)
    assert tool.chip_after <= tool.chip_limit * 1.000001
    assert tool.feed_after == pytest.approx((10.0, 11.0))
    finish = reordered(tmp_path, SLOT_AND_SIDE.replace("Y11.5", "Y10.2"), feeds=True, workpiece=BLOCK)
    assert "660" not in finish.text
    assert finish.detail.pace.feeds_s == 0.0


def test_a_feed_rises_by_no_more_than_half(tmp_path: Path) -> None:
    """A pass of 0.5 mm of 6 has chips of 0.553: 1.8 times the feed would do."""
    found = reordered(tmp_path, SLOT_AND_SIDE.replace("Y11.5", "Y10.5"), feeds=True, workpiece=BLOCK)
    highest = max(float(word) for word in re.findall(r"F([0-9.]+)", found.text))
    assert 900 / 1.11 < highest <= 900


def test_a_program_that_only_plunges_has_no_feeds_to_fit(tmp_path: Path) -> None:
    """Both plunges become rapids down to the clearance; the rest of them keeps its feed."""
    text = HEAD + "G0 X10 Y10\nG0 Z5\nG1 Z-2 F60\nG0 Z5\nG0 X40 Y10\nG1 Z-2\nG0 Z5\n" + TAIL
    library = tmp_path / "tools.toml"
    library.write_text(
        '[[tool]]\nnumber = 1\nkind = "end-mill"\n'
        'diameter = "6 mm"\nfeed = "450 mm/min"\nspindle_speed = "6000 rpm"\nplunge_feed = "100 mm/min"\n'
    )
    found = reordered(tmp_path, text, air=True, feeds=True, workpiece=BLOCK, tools=library)
    assert (found.detail.pace.tools, found.detail.pace.feeds_s) == ((), pytest.approx(0.0, abs=0.5))
    assert body(found).count("G0 Z1.0") == 2


def test_a_librarys_feed_and_speed_are_the_limit_and_what_is_above_it_goes_down(tmp_path: Path) -> None:
    """450 mm/min at 6000 1/min are 0.075 mm a revolution: the slot is cut with 450, the side with 450 / 0.866 = 519."""
    library = tmp_path / "tools.toml"
    library.write_text(
        '[[tool]]\nnumber = 1\nkind = "end-mill"\n'
        'diameter = "6 mm"\nfeed = "450 mm/min"\nspindle_speed = "6000 rpm"\nplunge_feed = "100 mm/min"\n'
    )
    found = reordered(tmp_path, SLOT_AND_SIDE, feeds=True, workpiece=BLOCK, tools=library)
    (tool,) = found.detail.pace.tools
    assert tool.limit_stated
    assert (tool.chip_limit, tool.chip_before) == (pytest.approx(0.075), pytest.approx(0.1))
    assert tool.chip_after <= 0.075 * 1.000001
    lines = body(found)
    assert "G1 X60 F450.0" in lines
    sides = [float(word) for line in lines[lines.index("G1 X60 F450.0") :] for word in re.findall(r"F([0-9.]+)", line)]
    assert max(sides) <= 450 / math.sqrt(0.75)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"feeds": True}, "--feeds needs the position of the material"),
        ({"low_retracts": True}, "--low-retracts needs the position of the material"),
        (
            {"air": True, "workpiece": "0,0,-5,42,50,0"},
            "a cut reaches X60.00, but this stock ends at X42",
        ),
        ({"air": True, "workpiece": "0,0,-5,100,50,-3"}, "never touches this stock"),
        ({"air": True, "workpiece": "0,0,0,70,50,0"}, "has no volume"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(tmp_path: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(OptionError, match=re.escape(words) if "." not in words else words) as refused:
        reordered(tmp_path, SLOT_AND_SIDE, **options)
    assert "\n" not in str(refused.value)


def test_a_tool_of_unknown_shape_and_a_beam_are_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=r"the shape of tool T1 is unknown"):
        reordered(tmp_path, SLOT_AND_SIDE.replace("(T1 D=6. - flat end mill)", "()"), air=True, workpiece=BLOCK)
    with pytest.raises(OptionError, match=r"--air: .* drives a laser or a torch"):
        reordered(tmp_path, "G21 G90\nM3 S500\nG0 X0 Y0\nG1 X5 F500\nM5\nM2\n", air=True, process="laser")


def test_a_program_of_which_the_controller_may_skip_moves_keeps_its_speeds(tmp_path: Path) -> None:
    """With the switch for / on, material would stand where the stock has none."""
    text = HEAD + "G0 X-20 Y25 Z5\nG1 Z-2 F300\n/X-8\nX40 F200\n" + TAIL
    found = reordered(tmp_path, text, air=True, workpiece=BLOCK)
    assert found.text == text
    assert [str(i) for i in found.issues if i.code == "L513"] == [
        "L513 speeds and heights are unchanged, because the block-delete switch (/) can skip moves and leave "
        "their material uncut (line 7)"
    ]


def test_the_summary_and_the_answer_tell_each_saving(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "part.ngc"
    file.write_text(SLOT_AND_SIDE)
    command = ["reorder", str(file), "-o", str(tmp_path / "new.ngc"), "--air", "--feeds", "--low-retracts"]
    assert run([*command, "--workpiece", BLOCK]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "air " in said
    assert "feeds " in said
    assert "T1 end-mill Ø6: 600 → 600 to 660 mm/min; thickest chip 0.1 → 0.1 mm a revolution, at most 0.1" in said


STYLES = sorted(
    file
    for file in (Path(__file__).parents[2] / "styles").iterdir()
    if re.match(
        r"cambam|estlcam|freecad|fusion|inkscape_gcode|mastercam|pcb2gcode|vcarve|sheetcam_mach3_drill", file.name
    )
)


@pytest.mark.parametrize("file", STYLES, ids=lambda file: file.name)
def test_programs_in_the_styles_of_cams_leave_the_same_and_linuxcnc_takes_what_it_took(
    file: Path, tmp_path: Path, rs274: str
) -> None:
    machine = "haas-vf2" if file.name.startswith(("fusion_haas", "mastercam")) else "linuxcnc-mill"
    common = {"machine": machine, "tool_diameter": 3}
    block = leafcut.stock(file, **common).block
    stock = {**common, "workpiece": ",".join(f"{side:.6f}" for side in (*block.low, *block.high))}
    found = leafcut.optimize(file, process="reorder", air=True, feeds=True, low_retracts=True, iterations=20, **stock)
    assert found.after.time_s <= found.before.time_s * (1 + 1e-9)
    assert not [issue for issue in found.issues if issue.code == "L513"]
    new = tmp_path / f"new{file.suffix}"
    new.write_text(found.text)
    cut = leafcut.stock(new, same_as=file, **stock)
    assert cut.differences == ()
    # Its rapids cut no more of the stock than those of the original.
    assert len(cut.rapids) <= len(leafcut.stock(file, **stock).rapids)
    before, after = (run_rs274(rs274, text, tmp_path)[0] for text in (file.read_text(), found.text))
    assert after == before or before


def random_program(chance: random.Random) -> str:
    """Return slots, holes and steps at random positions, with feed moves through the air between some of them."""
    lines = []
    for _ in range(chance.randint(3, 7)):
        x, y, depth = chance.uniform(5, 60), chance.uniform(5, 45), chance.uniform(0.5, 8)
        link = chance.choice(["G0", f"G1 F{chance.choice([500, 900])}"])
        lines += [f"{link} X{x:.3f} Y{y:.3f}", f"G1 Z{-depth:.3f} F{chance.choice([60, 120])}"]
        for _ in range(chance.randint(0, 4)):
            x, y = chance.uniform(-10, 80), chance.uniform(-10, 60)
            z = f" Z{-chance.uniform(0.5, 8):.3f}" if chance.random() < 0.2 else ""
            feed = f" F{chance.choice([300, 600, 900])}" if chance.random() < 0.5 else ""
            lines.append(f"{chance.choice(['G1 ', ''])}X{x:.3f} Y{y:.3f}{z}{feed}")
        lines.append(f"{chance.choice(['G0', 'G1'])} Z{chance.choice([5, 8, 20])}")
    return HEAD + "G0 X0 Y0 Z20\n" + "\n".join(lines) + "\n" + TAIL


@pytest.mark.parametrize("seed", range(12))
def test_random_programs_leave_the_same_and_new_rapids_keep_clear_of_all_material(
    seed: int, tmp_path: Path, rs274: str
) -> None:
    """Judged by a mill that is put at many places along the moves that LinuxCNC's interpreter sees."""
    judge(random_program(random.Random(seed)), tmp_path, rs274)


def random_series(chance: random.Random) -> str:
    """Return slots, and series of holes in them and next to them that start at heights set before them."""
    lines = []
    for _ in range(chance.randint(1, 3)):
        x, y, depth = chance.uniform(5, 60), chance.uniform(5, 45), chance.uniform(3, 7)
        lines += [f"G0 X{x:.3f} Y{y:.3f}", f"G1 Z{-depth:.3f} F120", f"G1 X{x + 9:.3f} F600", "G0 Z20"]
        for _ in range(chance.randint(1, 2)):
            # A position may be programmed with the height or before it; the length offset is in the same block.
            height = chance.choice(["G0 Z{}", "G43 H1 Z{}", "G0 X{:.3f} Y{:.3f} Z{}"])
            place = (chance.uniform(5, 60), chance.uniform(5, 45))
            top = chance.choice([8, 12, 30])
            lines.append(height.format(*place, top) if "X" in height else height.format(top))
            plane, low = chance.choice([(2, -9), (1 - depth + 1.5, -9), (4, -3)])
            cycle = chance.choice(["G81", "G83 Q2", "G82 P0.1", "G73 Q3"])
            lines.append(f"G98 {cycle} X{x + 4:.3f} Y{y:.3f} R{plane:.3f} Z{low} F200")
            for _ in range(chance.randint(0, 3)):
                word = chance.choice(["", "", "G99 ", "G98 "])
                on = (x + chance.uniform(0, 9), y) if plane < 1 else (chance.uniform(5, 60), chance.uniform(5, 45))
                lines.append(f"{word}X{on[0]:.3f} Y{on[1]:.3f}")
            lines += ["G80", *(["G0 X30 Y20"] if chance.random() < 0.5 else []), "G0 Z20"]
    return HEAD + "G0 X0 Y0 Z20\n" + "\n".join(lines) + "\n" + TAIL


@pytest.mark.parametrize("seed", range(10))
def test_random_series_of_holes_keep_clear_at_their_lower_heights(seed: int, tmp_path: Path, rs274: str) -> None:
    judge(random_series(random.Random(seed)), tmp_path, rs274)


def test_the_height_before_a_series_is_as_low_as_the_ways_between_its_holes(tmp_path: Path, rs274: str) -> None:
    """Two slots 4 deep with a rib between them: over it at 1, and the R planes in the slots stay below it."""
    slots = "G0 X10 Y10 Z15\nG1 Z-4 F60\nG1 X40 F600\nG0 Z15\nG0 X10 Y30\nG1 Z-4 F60\nG1 X40 F600\nG0 Z40\nG0 X12 Y10\n"
    series = "G98 G81 X12 Y10 R-2.5 Z-8 F100\nX38\nX38 Y30\nX12\nG80\nG0 Z40\n"
    text = HEAD + slots + "G43 H1 Z25\n" + series + TAIL
    found = body(judge(text, tmp_path, rs274, air=False, feeds=False))
    assert found[9:14] == ["G43 H1 Z1.0", "G98 G81 X12 Y10 R-2.5 Z-8 F100", "X38", "X38 Y30", "X12"]
    # Blocks after the series that need its height keep it: here a tool change.
    kept = text.replace("G80\nG0 Z40\n", "G80\nT2 M6\n")
    assert "G43 H1 Z25" in body(reordered(tmp_path, kept, low_retracts=True, workpiece=BLOCK))
    # Incremental cycles count from that height.
    kept = text.replace("G98 G81 X12 Y10 R-2.5 Z-8", "G91 G98 G81 X0 Y0 R-27.5 Z-5.5").replace(
        "\nX38\nX38 Y30\nX12", "\nX26"
    )
    assert "G43 H1 Z25" in body(reordered(tmp_path, kept.replace("G80", "G80 G90"), low_retracts=True, workpiece=BLOCK))


def judge(text: str, tmp_path: Path, rs274: str, **options: bool) -> leafcut.Outcome:
    """Check lower and faster moves, and return them."""
    asked: dict[str, Any] = {"air": True, "low_retracts": True, "feeds": True, **options}
    found = reordered(tmp_path, text, workpiece=BLOCK, cell=0.1, **asked)
    assert not [issue for issue in found.issues if "the heights are unchanged" in issue.message]
    assert found.after.time_s <= found.before.time_s * (1 + 1e-9)
    seen = []
    for one in (text, found.text):
        status, said = run_rs274(rs274, one, tmp_path)
        assert status == 0
        ours = moves_of_toolpath(interpret_program(one, load_dialect("linuxcnc")).path)
        assert_same_moves(ours, moves_of_rs274(said), 1e-4)
        seen.append(moves_of_rs274(said))
    stocks = [SteppedStock((0, 0, -10), (70, 50, 0)) for _ in seen]
    known = {(round(m[1], 3), round(m[2], 3), round(m[3], 3)) for m in seen[0] if m[0] == "rapid"}
    for moves, stock in zip(seen, stocks, strict=True):
        place = (0.0, 0.0, 0.0)
        holes: dict[tuple[float, float], float] = {}
        for move in moves:
            if move[0] not in ("rapid", "feed"):
                continue
            end = move[1:4]
            if move[0] == "feed":
                stock.cut(place, end, 3.0)
                if place[:2] == end[:2]:
                    holes[end[:2]] = min(end[2], holes.get(end[:2], 0.0))
            elif place[:2] == end[:2] and end[2] > holes.get(end[:2], 0.0):
                pass  # a peck comes down again into its own hole
            elif moves is seen[1] and tuple(round(v, 3) for v in end) not in known and end[2] <= place[2]:
                # The tool is assumed 1 mm wider; the block's cells, here 0.25, are shifted by half a cell.
                assert stock.highest(place, end, 3.0 + 1.0 - 0.18) <= -1.0 + 0.03, f"{place} to {end}"
            place = end
    # A scallop between two positions of one program and of the other differs in a cell or two.
    assert differ(*stocks).sum() <= 3
    return found


def differ(one: SteppedStock, other: SteppedStock) -> np.ndarray:
    """Return the cells that are higher or lower than all nine cells of the other field there."""
    wrong = np.zeros(one.heights.shape, dtype=bool)
    for mine, its in ((one.heights, other.heights), (other.heights, one.heights)):
        wide = np.lib.stride_tricks.sliding_window_view(np.pad(its, 1, mode="edge"), (3, 3))
        wrong |= (mine < wide.min(axis=(2, 3)) - 0.05) | (mine > wide.max(axis=(2, 3)) + 0.05)
    return wrong
