"""Named obstacles hold for programs of other CAMs: rapids go over them or round them, or the program is refused."""

from __future__ import annotations

import math
import re
from pathlib import Path

import ezdxf
import pytest

from leafcut import api
from leafcut.errors import LeafcutError, OptionError, PlanError, VerifyError
from leafcut.proof.obstacles import check_obstacles
from rs274_moves import moves_of_rs274, run_rs274

#: A bar between two columns of slots, and a short bar between two rows; a tool of 6 mm, described in a comment.
BARS = "40 0 50 100, 0 52 30 58"
ZONES = [tuple(map(float, bar.split())) for bar in BARS.split(",")]
HEAD = "(T1 D=6. end mill)\nG21 G90 G17 G94\nT1 M6\nS8000 M3\nG0 Z15\nG0 X10 Y10\n"
SLOTS = [(10, 10), (70, 10), (10, 40), (70, 40), (10, 70), (70, 70)]
MILLED = HEAD + "".join(f"G0 X{x} Y{y}\nG0 Z5\nG1 Z-2 F200\nG1 X{x + 10} F600\nG0 Z5\n" for x, y in SLOTS)
MILLED += "G0 Z15\nG0 X0 Y0\nM5\nM30\n"
DRILLED = HEAD + "G0 Z5\nG99 G81 X10 Y10 Z-3 R2 F100\n" + "".join(f"X{x} Y{y}\n" for x, y in SLOTS[1:])
DRILLED += "G80\nG0 Z15\nG0 X0 Y0\nM5\nM30\n"
LASER = "G21 G90\nG0 X0 Y0\n" + "".join(f"G0 X{x} Y{y}\nM4 S500\nG1 X{x + 10} F1200\nM5\n" for x, y in SLOTS) + "M2\n"
FAST = {"iterations": 1, "threads": 1, "preset": "fast"}


def met(moves: list[tuple], height: float, radius: float) -> list[tuple]:
    """Return the straight moves below a height that come into a zone: every tenth of a millimetre is looked at."""
    found, place = [], (math.nan,) * 3
    for kind, *numbers in moves:
        if kind not in ("rapid", "feed"):
            continue
        end = tuple(numbers[:3])
        steps = max(2, int(math.dist(place, end) / 0.1)) if not math.isnan(place[0]) else 2
        for k in range(steps + 1):
            x, y, z = (e if math.isnan(p) else p + (e - p) * k / steps for p, e in zip(place, end, strict=True))
            near = [math.hypot(max(a - x, 0, x - c), max(b - y, 0, y - d)) for a, b, c, d in ZONES]
            if z < height - 1e-6 and min(near) < radius - 1e-6:
                found.append((place, end))
                break
        place = end
    return found


def judged(rs274: str, text: str, folder: Path) -> list[tuple]:
    status, said = run_rs274(rs274, text, folder)
    assert status == 0, said
    return moves_of_rs274(said)


@pytest.mark.parametrize("text", [MILLED, DRILLED], ids=["milled", "drilled"])
@pytest.mark.parametrize("more", [{}, {"algorithm": "none"}, {"clearance_height": 25}], ids=str)
def test_rapids_go_over_what_is_named_by_the_judgement_of_linuxcnc(
    text: str, more: dict, rs274: str, tmp_path: Path
) -> None:
    """Version 0.1.0 moved through it at Z5. Crossings of the original are reported, and the new order has none."""
    source = tmp_path / "part.nc"
    source.write_text(text)
    height = float(more.get("clearance_height", 10.0))
    assert met(judged(rs274, text, tmp_path), height, 3.0)
    found = api.optimize(source, keep_out=BARS, **FAST, **more)
    assert met(judged(rs274, found.text, tmp_path), height, 3.0) == []
    assert found.verified
    assert "L508" in {issue.code for issue in found.issues}
    assert "L509" not in {issue.code for issue in found.issues}


@pytest.mark.hazard
@pytest.mark.parametrize("low, lifted", [(3, False), (12, True)])
def test_a_zone_with_a_height_is_crossed_above_it_and_no_higher(low: float, lifted: bool, tmp_path: Path) -> None:
    """A bar of 3 mm is crossed at Z5 as before, one of 12 mm at Z13; the other bar has no height: at Z10."""
    source = tmp_path / "part.nc"
    source.write_text(MILLED)
    bars = [f"40 0 50 100 {low}", "0 52 30 58"]
    found = api.optimize(source, keep_out=", ".join(bars), **FAST)
    assert check_obstacles(found.path_after, ZONES, [low + 1.0, 10.0], tool_radii={1: 3.0}) == []
    crossing = check_obstacles(found.path_after, ZONES[:1], math.inf, tool_radii={1: 3.0})
    assert crossing
    heights = {float(z) for z in re.findall(r"^G0 Z([0-9.]+)$", found.text, re.MULTILINE)}
    assert (13.0 in heights) == lifted
    assert 14.0 not in heights


def test_the_beam_of_a_laser_that_never_moves_z_goes_round(rs274: str, tmp_path: Path) -> None:
    source = tmp_path / "cut.nc"
    source.write_text(LASER)
    found = api.optimize(source, keep_out=BARS, process="laser", **FAST)
    assert met(judged(rs274, found.text, tmp_path), math.inf, 1e-3) == []
    with pytest.raises(LeafcutError, match="--clearance-height: this program never moves Z"):
        api.optimize(source, keep_out=BARS, clearance_height=20, process="laser", **FAST)


def test_a_program_without_crossings_stays_as_it_is(tmp_path: Path) -> None:
    source = tmp_path / "part.nc"
    source.write_text(MILLED)
    far = api.optimize(source, keep_out="500 500 600 600", **FAST)
    assert far.text == api.optimize(source, **FAST).text
    assert "L508" not in {issue.code for issue in far.issues}


@pytest.mark.parametrize(
    ("keep_out", "words"),
    [
        ("12 5 18 15", r"cuts in an obstacle: .*\(line 9\)"),
        ("14 13.5 16 20", "cuts in an obstacle"),
    ],
)
def test_a_cut_in_an_obstacle_or_nearer_than_the_tool_is_wide_is_refused(
    keep_out: str, words: str, tmp_path: Path
) -> None:
    """The second rectangle is 3.5 mm beside the cut: 13.5 - 10 is more than the radius of 3, so it is not refused."""
    source = tmp_path / "part.nc"
    source.write_text(MILLED)
    if keep_out.startswith("14"):
        assert api.optimize(source, keep_out=keep_out, **FAST).verified
        keep_out = "14 12.5 16 20"
    with pytest.raises(PlanError, match=words):
        api.optimize(source, keep_out=keep_out, **FAST)


def test_where_a_rapid_stays_and_cannot_be_led_over_the_program_is_refused(tmp_path: Path) -> None:
    """A rapid in a block that is not understood stays unchanged: the refusal is one line, and no file is written."""
    source, out = tmp_path / "part.nc", tmp_path / "out.nc"
    source.write_text(MILLED.replace("G0 Z15\nG0 X0 Y0\nM5", "G0 Z5\nG91\nG0 X-80 Y-70\nG90\nM5"))
    with pytest.raises((VerifyError, PlanError), match="crosses an obstacle"):
        api.optimize(source, out, keep_out=BARS, **FAST)
    assert not out.exists()


@pytest.mark.hazard
@pytest.mark.parametrize("process", ["cut", "pocket"])
def test_a_zone_above_the_clearance_height_is_refused(process: str, tmp_path: Path) -> None:
    drawing = tmp_path / "two.dxf"
    document = ezdxf.new(units=4)
    document.modelspace().add_circle((15, 15), 10)
    document.saveas(drawing)
    machine = {"cut": {"machine": "plasma-table", "thickness": 2}, "pocket": {"depth": 2, "tool_diameter": 6}}[process]
    with pytest.raises(
        OptionError, match=r"is 30 mm high, but rapids cross it at Z10; use --clearance-height 31 or more"
    ):
        api.optimize(drawing, process=process, keep_out="40 0 50 9 30", **machine, **FAST)


def test_a_tool_whose_width_nobody_tells_is_told(tmp_path: Path) -> None:
    source, tools = tmp_path / "part.nc", tmp_path / "tools.toml"
    source.write_text(MILLED.replace("(T1 D=6. end mill)\n", ""))
    found = api.optimize(source, keep_out=BARS, **FAST)
    assert [i.message[:21] for i in found.issues if i.code == "L509"] == ["the diameter of T1 is"]
    tools.write_text(
        '[[tool]]\nnumber = 1\ndiameter = "6 mm"\nkind = "end-mill"\nfeed = "300 mm/min"\nplunge_feed = "90 mm/min"\n'
        'spindle_speed = "6000 rpm"\n'
    )
    told = api.optimize(source, keep_out=BARS, tools=tools, **FAST)
    assert "L509" not in {issue.code for issue in told.issues}


@pytest.mark.hazard
@pytest.mark.parametrize(("stickout", "refused"), [(11, True), (13, False), (None, False)])
def test_the_holder_of_the_library_stays_out_of_a_clamp_as_high_as_it(
    stickout: float | None, refused: bool, tmp_path: Path
) -> None:
    """A clamp of 9 mm, 10 mm beside the end of a slot: a holder of 40 mm is at -2 + 11 = Z9 there, or at Z11."""
    source, tools = tmp_path / "part.nc", tmp_path / "tools.toml"
    source.write_text(MILLED)
    held = "" if stickout is None else f'stickout = "{stickout} mm"\nholder = "40 x 50"\n'
    tools.write_text(
        '[[tool]]\nnumber = 1\ndiameter = "6 mm"\nkind = "end-mill"\nfeed = "300 mm/min"\nplunge_feed = "90 mm/min"\n'
        f'spindle_speed = "6000 rpm"\n{held}'
    )
    if refused:
        with pytest.raises(PlanError, match="cuts in an obstacle: the shank or holder of the tool hits a --keep-out"):
            api.optimize(source, keep_out="30 0 32 30 9", tools=tools, **FAST)
    else:
        found = api.optimize(source, keep_out="30 0 32 30 9", tools=tools, **FAST)
        bodies = {} if stickout is None else {1: [(stickout, 20.0)]}
        assert check_obstacles(found.path_after, [[30, 0, 32, 30]], 10.0, tool_radii={1: 3.0}, bodies=bodies) == []


@pytest.mark.parametrize("machine", ["laser-table", "plasma-table"])
def test_a_head_that_keeps_its_height_goes_round_what_is_named_on_a_sheet(machine: str, tmp_path: Path) -> None:
    """On 0.1.0 the rapids of a laser crossed clamps; a torch crosses them at the clearance height."""
    drawing = tmp_path / "two.dxf"
    document = ezdxf.new(units=4)
    for x, y in SLOTS:
        document.modelspace().add_circle((x + 5, y), 4)
    document.saveas(drawing)
    found = api.optimize(drawing, process="cut", machine=machine, thickness=2, keep_out="40 -20 50 100", **FAST)
    height = 10.0 if machine == "plasma-table" else math.inf
    path = found.path_after
    assert check_obstacles(path, [[40, -20, 50, 100]], height) == []
    free = api.optimize(drawing, process="cut", machine=machine, thickness=2, **FAST)
    assert bool(check_obstacles(free.path_after, [[40, -20, 50, 100]], math.inf))
