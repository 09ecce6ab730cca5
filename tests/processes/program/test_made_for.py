"""A program states the part that it was made for, and `stock --part` judges its rapids by that part."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import OptionError
from meshes import binary_stl, box_triangles

FAST: dict[str, Any] = {
    "process": "drill", "depth": 5, "algorithm": "nn", "bound": False, "machine": "linuxcnc-mill",
}  # fmt: skip
#: Three holes on the low step, one on the high one.
HOLES = ((10, 10), (10, 30), (10, 50), (70, 30))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a part of two steps, X 0 to 40 at Z-15 and X 40 to 80 at Z0, and its holes of 6 mm."""
    folder = tmp_path_factory.mktemp("stepped")
    triangles = np.concatenate([box_triangles(0, 0, -30, 40, 60, -15), box_triangles(40, 0, -30, 80, 60, 0)])
    (folder / "part.stl").write_bytes(binary_stl(triangles))
    rows = "".join(f"{x},{y},6\n" for x, y in HOLES)
    (folder / "holes.csv").write_text(f"x,y,diameter\n{rows}")
    return folder


def drilled(folder: Path, name: str, **more: Any) -> Path:
    api.optimize(folder / "holes.csv", folder / name, surface=folder / "part.stl", **FAST, **more)
    return folder / name


@pytest.fixture(scope="module")
def program(folder: Path) -> Path:
    return drilled(folder, "part.nc")


def dangers(found: Any) -> list[Any]:
    return [issue for issue in found.issues if issue.severity == "danger"]


def test_a_program_states_the_part_it_was_made_for(folder: Path, program: Path) -> None:
    assert "(part: part.stl)" in program.read_text()
    placed = drilled(folder, "placed.nc", origin="10,5", rotate=90, mirror="x").read_text()
    assert "(part: part.stl, zero at X10 Y5 mm, mirrored x, turned 90 deg)" in placed
    api.optimize(folder / "holes.csv", folder / "flat.nc", **FAST)
    assert "part:" not in (folder / "flat.nc").read_text()


@pytest.mark.hazard
def test_our_own_program_is_not_accused_and_the_assumed_block_is_told(folder: Path, program: Path) -> None:
    """The holes of the low step are reached by rapids below the top of a full block, and above the part."""
    block = api.stock(program)
    assert block.rapids
    assert not dangers(block)
    (assumed,) = [issue for issue in block.issues if issue.code == "L510"]
    assert assumed.severity == "warning"
    assert "full block" in assumed.message
    assert "part.stl" in assumed.message
    assert "--part" in assumed.message
    part = api.stock(program, part=str(folder / "part.stl"))
    assert not part.rapids
    assert [issue.code for issue in part.issues] == ["L417"]  # the machine in the header
    assert (part.block.low, part.block.high) == ((0.0, 0.0, -30.0), (80.0, 60.0, 0.0))
    # Four holes, 5 mm deep at full diameter, and the tips of drills of 118 degrees.
    assert part.removed_mm3 == pytest.approx(4 * np.pi * 9 * (5 + 3 / np.tan(np.radians(59)) / 3), rel=0.03)


@pytest.mark.hazard
def test_the_part_is_placed_as_the_program_states(folder: Path) -> None:
    placed = drilled(folder, "turned.nc", origin="10,5", rotate=90, mirror="x")
    found = api.stock(placed, part=str(folder / "part.stl"))
    assert not found.rapids
    # x, y → −x, y → −y, −x → less (10, 5).
    assert found.block.low == pytest.approx((-70.0, -85.0, -30.0))
    assert found.block.high == pytest.approx((-10.0, -5.0, 0.0))


@pytest.mark.hazard
def test_a_rapid_through_the_part_stays_a_danger(folder: Path, program: Path) -> None:
    """A way at Z-10 from the low step to the high one runs 10 mm deep in the part."""
    text = program.read_text()
    low = folder / "low.nc"
    low.write_text(text.replace("\nM5", "\nG0 X10 Y10\nZ-10\nX70\nZ20\nM5", 1))
    assert low.read_text() != text
    found = api.stock(low, part=str(folder / "part.stl"))
    assert max(one.depth_mm for one in found.rapids) == pytest.approx(10.0, abs=0.2)
    assert dangers(found)
    assert run(["stock", str(low), "--part", str(folder / "part.stl"), "--strict", "--no-defaults"]) == 1
    assert run(["stock", str(program), "--part", str(folder / "part.stl"), "--strict", "--no-defaults"]) == 0


@pytest.mark.hazard
def test_a_part_in_the_comments_of_another_cam_changes_no_danger(tmp_path: Path) -> None:
    file = tmp_path / "foreign.nc"
    file.write_text(
        "(PART: BRACKET.IPT)\nG21 G90\nT1 M6 (D=6. CR=0. - flat end mill)\n"
        "M3 S9000\nG0 X0 Y0 Z5\nG0 Z-3\nG1 X9 F90\nM2\n"
    )
    assert {issue.code for issue in dangers(api.simulate(file))} == {"L802"}


def test_simulate_warns_of_our_own_low_ways_and_calls_them_no_danger(program: Path) -> None:
    found = api.simulate(program)
    assert not dangers(found)
    assert {"L801", "L802"} & {issue.code for issue in found.issues if issue.severity == "warning"}


def test_a_block_and_a_part_are_not_given_together(folder: Path, program: Path) -> None:
    with pytest.raises(OptionError, match="--part: not used with --workpiece"):
        api.stock(program, part=str(folder / "part.stl"), workpiece="0,0,-30,80,60,0")


def test_a_foreign_program_in_an_assumed_block_keeps_its_dangers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "slot.nc"
    file.write_text(
        "G21 G90\nT1 M6 (D=6. CR=0. - flat end mill)\nM3 S9000\nG0 X10 Y10 Z5\nG1 Z-2 F300\nG0 X30\nG0 Z5\nM2\n"
    )
    assert run(["stock", str(file), "--json", "--no-defaults"]) == 0
    answer = json.loads(capsys.readouterr().out)
    told = {issue["code"]: issue["severity"] for issue in answer["issues"]}
    assert (told["L510"], told["L801"], told["L802"]) == ("note", "danger", "danger")
    assert answer["stock"]["derived"]


@pytest.mark.hazard
@pytest.mark.slow
@pytest.mark.usefixtures("opencascade_at_hand")
def test_a_turned_and_lifted_solid_is_placed_as_the_program_states(tmp_path: Path) -> None:
    """A block at X0 to X20 with holes from its side X20: turned with +x up, its X20 is Z0."""
    pytest.importorskip("OCP")
    from made_solids import box, cut, cylinder, saved

    holes = [cylinder((20, y, z), (-1, 0, 0), 3, 8) for y, z in ((10, 10), (30, 50))]
    side = saved(tmp_path / "side.step", cut(box(0, 0, 0, 20, 40, 60), *holes))
    program = tmp_path / "side.nc"
    api.optimize(side, program, process="drill", machine="linuxcnc-mill", up="x", algorithm="nn", bound=False)
    assert "(part: side.step, x up, Z0 at Z20 mm)" in program.read_text()
    found = api.stock(program, part=str(side))
    assert not found.rapids and not dangers(found)
    assert (found.block.low[2], found.block.high[2]) == pytest.approx((-20.0, 0.0))
