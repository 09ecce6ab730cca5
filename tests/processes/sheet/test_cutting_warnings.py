"""Warnings about a sheet that can be cut, but not as well as it seems."""

from __future__ import annotations

import json
import re
from importlib import resources
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import VerifyError

FAST: dict[str, Any] = {"process": "cut", "iterations": 5, "threads": 1}
LASER: dict[str, Any] = {"machine": "laser-table", "cut_process": "laser_fiber_3kW", **FAST}


@pytest.fixture(scope="module")
def plate(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One plate of 60 mm with a mark on it."""
    file = tmp_path_factory.mktemp("plate") / "plate.dxf"
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(20, 20), (80, 20), (80, 80), (20, 80)], close=True, dxfattribs={"layer": "CUT"})
    space.add_line((40, 50), (60, 50), dxfattribs={"layer": "MARK"})
    document.saveas(file)
    return file


def test_micro_joints_of_a_laser_are_warned_of_above_3_mm_and_not_below(plate: Path) -> None:
    thick = [i for i in api.optimize(plate, thickness="6", micro_joints=2, **LASER).issues if i.code == "L620"]
    assert len(thick) == 1
    assert "without the 0.73 s" in thick[0].message and thick[0].message.endswith("or leave out --micro-joints")
    for options in ({"thickness": "3", "micro_joints": 2}, {"thickness": "6"}):
        assert "L620" not in {i.code for i in api.optimize(plate, **options, **LASER).issues}


def feeds_of_marks(text: str, lit: str) -> set[str]:
    """Return the active F at every move between a mark's words and the next M5."""
    feed, marking, found = "", False, set()
    for block in text.splitlines():
        marking = block.startswith(lit) or (marking and not block.startswith("M5"))
        said = re.search(r"F(#<[^>]*>|[0-9.]+)", block)
        feed = said.group(1) if said else feed
        if marking and re.search(r"\b[XY]", block):
            found.add(feed.removesuffix("."))
    return found


@pytest.mark.parametrize(
    "options, feed",
    [
        ({}, "2500"),
        ({"mark_speed": "20mm/s"}, "1200"),
        ({"material_number": 3}, "2500"),
        ({"material_number": 3, "mark_speed": "900mm/min"}, "900"),
    ],
)
def test_a_scribe_runs_at_the_speed_of_marks_and_the_torch_at_that_of_cuts(
    plate: Path, options: dict[str, Any], feed: str
) -> None:
    outcome = api.optimize(plate, thickness="6", **options, **FAST)
    assert outcome.verified
    assert feeds_of_marks(outcome.text, "M3 $1") == {feed}
    cuts = feeds_of_marks(outcome.text, "M3 $0")
    assert feed not in cuts
    assert cuts == ({"#<_hal[plasmac.cut-feed-rate]>"} if "material_number" in options else {f"{cut_speed(outcome):g}"})


def cut_speed(outcome: Any) -> float:
    """The chart's speed, mm/min."""
    return round(outcome.detail.plan.data.feed * 60.0, 3)


def test_a_laser_marks_at_the_speed_of_marks(plate: Path) -> None:
    outcome = api.optimize(plate, thickness="3", mark_speed="4000mm/min", **LASER)
    assert feeds_of_marks(outcome.text, "M3 S200") == {"4000"}
    assert feeds_of_marks(outcome.text, "M3 S1000") == {"10000"}


def test_marks_are_no_faster_than_the_machine_unless_that_is_asked_for(plate: Path, tmp_path: Path) -> None:
    table = resources.files("leafcut") / "machines" / "plasma-table.toml"
    slow = tmp_path / "slow.toml"
    slow.write_text(re.sub(r'^max_feed = "[^"]*"', 'max_feed = "2200 mm/min"', table.read_text(), flags=re.MULTILINE))
    options = {"machine": str(slow), "thickness": "12", **FAST}
    assert feeds_of_marks(api.optimize(plate, **options).text, "M3 $1") == {"2200"}
    with pytest.raises(VerifyError, match="the machine allows at most 2200"):
        api.optimize(plate, mark_speed="2500mm/min", **options)


def test_a_plan_for_another_thickness_or_material_is_told(plate: Path, tmp_path: Path) -> None:
    file = tmp_path / "plan.json"
    api.optimize(plate, tmp_path / "plate.ngc", thickness="6", save_plan=str(file), **FAST)
    assert "L621" not in {i.code for i in api.optimize(plate, thickness="6", plan=str(file), **FAST).issues}
    other = api.optimize(plate, thickness="10", material="stainless_304", plan=str(file), **FAST)
    (issue,) = [i for i in other.issues if i.code == "L621"]
    assert "made for 6 mm, not 10 mm and mild_steel, not stainless_304," in issue.message
    assert issue.place == str(file)


def test_a_sheet_too_large_for_the_machine_is_refused_before_places_to_pierce_are_sought(tmp_path: Path) -> None:
    document = ezdxf.new(units=4)
    document.modelspace().add_lwpolyline([(0, 0), (90000, 0), (90000, 50), (0, 50)], close=True)
    document.saveas(tmp_path / "long.dxf")
    told: list[str] = []
    with pytest.raises(VerifyError, match="too large: X goes from"):
        api.optimize(tmp_path / "long.dxf", thickness="6", progress=lambda now: told.append(now.step), **FAST)
    assert set(told) == {"reading"}


def test_a_program_with_a_material_of_the_controller_is_simulated_with_the_speed_that_is_said(
    plate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Twice the speed, half the time of the cut: a square of 60 mm with its leads, less the time at corners.

    Without a speed in the program, the chart's speed is used and reported.
    """
    out = tmp_path / "plate.ngc"
    api.optimize(plate, out, thickness="6", material_number=3, ignore_layers="MARK", **FAST)
    command = ["simulate", str(out), "--machine", "plasma-table"]
    assert run(command) == 0
    assert "the cut chart's for 3 mm of mild steel; set it with --cut-speed" in capsys.readouterr().out
    seconds = []
    for speed in ("600mm/min", "1200mm/min"):
        assert run([*command, "--cut-speed", speed, "--json"]) == 0
        seconds.append(json.loads(capsys.readouterr().out)["by_kind"]["feed"])
    assert seconds[0] == pytest.approx(2.0 * seconds[1], rel=0.02)


def test_a_register_that_must_hold_half_of_the_kerf_is_told_and_stands_in_the_program(plate: Path) -> None:
    options: dict[str, Any] = {**LASER, "thickness": "3", "compensation": "controller", "ignore_layers": "MARK"}
    outcome = api.optimize(plate, **options)
    (issue,) = [i for i in outcome.issues if i.code == "L622"]
    assert "register D1; set it to 0.11 mm" in issue.message  # the chart's kerf is 0.22 mm
    assert "(REGISTER D1 MUST HOLD HALF OF THE KERF AS A RADIUS: 0.11 MM)" in outcome.text
    assert "L622" not in {i.code for i in api.optimize(plate, **{**options, "compensation": "geometry"}).issues}
