"""Drilling as a whole: several tools, one after the other."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import ezdxf
import ezdxf.units
import numpy as np
import pytest

import leafcut
from leafcut.errors import LeafcutError, PlanError, VerifyError
from leafcut.model.plan import Stage
from leafcut.model.solution import Solution
from leafcut.order import solve as room
from leafcut.processes.registry import report_of
from leafcut.read.order_file import identify_drawing, order_file_text


def map_of(tmp_path: Path, seed: int) -> Path:
    """Write a map of a few holes of three diameters."""
    rng = np.random.default_rng(seed)
    rows = [
        f"{x:.1f},{y:.1f},{d}" for (x, y), d in zip(rng.uniform(0, 90, (7, 2)), rng.choice([2, 3, 4], 7), strict=True)
    ]
    path = tmp_path / f"map_{seed}.csv"
    path.write_text("x,y,diameter\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("seeds", [range(8), pytest.param(range(8, 20), marks=pytest.mark.slow)])
@pytest.mark.parametrize("objective", ["time", "distance"])
def test_no_plan_is_worse_than_the_drawings_and_nearest_neighbours(
    tmp_path: Path, objective: str, seeds: range
) -> None:
    """Separate paths for each tool would sometimes be worse, since one starts where the other ends."""
    for seed in seeds:
        found = leafcut.optimize(map_of(tmp_path, seed), units="mm", depth=3, objective=objective, preset="fast")
        ours, drawn, nearest = (
            m.time_s if objective == "time" else m.travel_mm for m in (found.after, found.before, found.nearest)
        )
        assert ours <= min(drawn, nearest) + 1e-9
        for operation in found.operations:
            assert operation.solution.lower_bound is not None
            assert operation.solution.lower_bound <= operation.solution.cost + 1e-9


def test_a_part_that_is_too_large_is_refused_before_anything_is_sought(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "large.csv"
    path.write_text("x,y\n0,0\n5,5\n9000,5\n4,4\n1,3\n8,9\n")
    monkeypatch.setattr(room, "solve", lambda *_, **__: pytest.fail("something was sought"))
    with pytest.raises(VerifyError, match="too large"):
        leafcut.optimize(path, units="mm", depth=3)


def order_file(tmp_path: Path, *operations: tuple[int, list[int]]) -> Path:
    path = tmp_path / "order.json"
    path.write_text(order_file_text({number: tuple(holes) for number, holes in operations}))
    return path


def test_holes_come_in_the_order_of_a_file_and_its_cost_is_that_of_the_order(tmp_path: Path) -> None:
    """Eight holes in a row, from the last to the first but one: 70 mm there, by hand."""
    row = tmp_path / "row.csv"
    row.write_text("x,y,diameter\n" + "".join(f"{10 * k},0,3\n" for k in range(8)))
    given = order_file(tmp_path, (0, [7, 6, 5, 4, 3, 2, 0, 1]))
    found = leafcut.optimize(row, units="mm", depth=3, objective="distance", plan=given, start_point="70,0")
    assert found.verified
    (operation,) = found.operations
    assert operation.hole_order == (7, 6, 5, 4, 3, 2, 0, 1)
    assert operation.solution.cost == pytest.approx(50.0 + 20.0 + 10.0)
    assert operation.solution.lower_bound == pytest.approx(70.0)


def test_what_a_file_does_not_name_is_found_around_it(tmp_path: Path) -> None:
    """Six holes in a row, the third first: then one move to the end and back to the rest, 10 + 10 + … by hand."""
    row = tmp_path / "row.csv"
    row.write_text("x,y,diameter\n" + "".join(f"{10 * k},0,3\n" for k in range(6)))
    found = leafcut.optimize(
        row, units="mm", depth=3, objective="distance", plan=order_file(tmp_path, (0, [2])), start_point="20,0"
    )
    (operation,) = found.operations
    assert operation.hole_order == (2, 1, 0, 3, 4, 5)
    assert operation.solution.cost == pytest.approx(20.0 + 50.0)


PLACES = [(0.0, 0.0), (10.0, 0.0), (20.0, 5.125), (3.175, 7.5)]


@pytest.mark.parametrize(
    ("places", "line"),
    [
        (PLACES, ""),
        ([(x + 0.1 + 0.2, y - 700.3) for x, y in PLACES], ""),  # moved as a whole
        ([(round(x, 3) + 1e-9, y - 1e-9) for x, y in PLACES], ""),
        (
            PLACES[:-1],
            "this order is for another drawing with 4 holes, but this drawing has 3; create a new file, or "
            "remove 'drawing' from the file to",
        ),
        (
            [*PLACES, (50.0, 50.0)],
            "this order is for another drawing with 4 holes, but this drawing has 5; create a new file, or "
            "remove 'drawing' from the file to",
        ),
        ([PLACES[1], PLACES[0], *PLACES[2:]], "with 4 holes, but this drawing has the same number at other positions;"),
        ([*PLACES[:-1], (3.275, 7.5)], "with 4 holes, but this drawing has the same number at other positions;"),
    ],
)
def test_an_order_is_that_of_one_drawing(tmp_path: Path, places: list[tuple[float, float]], line: str) -> None:
    plate, given = tmp_path / "plate.csv", tmp_path / "order.json"
    plate.write_text("x,y,diameter\n" + "".join(f"{x!r},{y!r},3\n" for x, y in places))
    given.write_text(order_file_text({0: (2, 0)}, identify_drawing(PLACES)))
    if line:
        with pytest.raises(PlanError, match=re.escape(line)):
            leafcut.optimize(plate, units="mm", depth=3, plan=given)
    else:
        found = leafcut.optimize(plate, units="mm", depth=3, preset="fast", plan=given)
        assert found.operations[0].hole_order[:2] == (2, 0)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("{}", "'leafcut_order' is missing"),
        ("[", "is not valid JSON"),
        ('{"leafcut_order": 1}', "'operations' must be a list"),
        ('{"leafcut_order": 1, "operations": [{"operation": 0, "holes": []}]}', "0 is not a whole number of 1 or more"),
        ('{"leafcut_order": 1, "operations": [{"operation": 1, "holes": [true]}]}', "true is not a whole number"),
        (
            '{"leafcut_order": 1, "operations": [{"operation": 9, "holes": []}]}',
            "operation 9: the last operation of the",
        ),
        ('{"leafcut_order": 1, "operations": [{"operation": 1, "holes": [9]}]}', "hole 9 is not drilled by"),
        ('{"leafcut_order": 1, "operations": [{"operation": 1, "holes": [2, 2]}]}', "hole 2 is listed twice"),
        ('{"leafcut_order": 1, "operations": [{"holes": [2]}]}', "row 1: "),
        ('{"leafcut_order": 1, "operations": [], "drawing": 7}', "'drawing': {"),
        ('{"leafcut_order": 1, "operations": [], "drawing": {"holes": "3", "print": ""}}', "'holes': \"3\" is not"),
        (
            '{"leafcut_order": 1, "operations": [{"operation": 1, "holes": []}, {"operation": 1, "holes": []}]}',
            "operation 1 is listed twice",
        ),
    ],
)
def test_an_order_that_cannot_be_meant_is_one_line(tmp_path: Path, text: str, line: str) -> None:
    row, given = tmp_path / "row.csv", tmp_path / "order.json"
    row.write_text("x,y,diameter\n0,0,3\n10,0,3\n20,0,3\n")
    given.write_text(text)
    with pytest.raises(LeafcutError, match=re.escape(line)):
        leafcut.optimize(row, units="mm", depth=3, plan=given)


def test_a_search_that_finds_less_than_the_drawing_has_gives_the_better_order_at_its_own_cost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever a search returns, here the reversed drawing order: the reported cost is that of the written program."""
    from leafcut.processes import ordering

    def poor(stages: list[Stage], *given: Any) -> list[Solution]:
        found = real(stages, *given)
        return [replace(one, nodes=stage.given[::-1].copy()) for one, stage in zip(found, stages, strict=True)]

    real = ordering.solve_linked_stages
    monkeypatch.setattr(ordering, "solve_linked_stages", poor)
    row = tmp_path / "row.csv"
    row.write_text("x,y,diameter\n" + "".join(f"{10 * k},0,{2 + (k > 3)}\n" for k in (0, 1, 2, 3, 4, 5, 6, 7)))
    found = leafcut.optimize(row, units="mm", depth=3, objective="distance", preset="fast")
    assert found.after.travel_mm == min(found.before.travel_mm, found.nearest.travel_mm)
    assert [one.solution.algorithm for one in found.operations] == ["none", "none"]
    assert sum(one.solution.cost for one in found.operations) == pytest.approx(70.0)
    for one in found.operations:
        assert one.solution.lower_bound is not None
        assert one.solution.lower_bound <= one.solution.cost + 1e-9


def test_a_program_with_a_spot_drill_near_a_low_clamp_is_proved(tmp_path: Path) -> None:
    """The cone, Ø16 and 90 degrees, ends at Z-1.5: at 1 mm above the clamp of height 0 its radius is 2.5 mm."""
    tool = 'kind = "{}"\ndiameter = "{} mm"\nfeed = "2 mm/s"\nspindle_speed = "1500 rpm"\n'
    spot = "[[tool]]\nnumber = 1\n" + tool.format("centre-drill", 16) + 'point_angle = "90 deg"\ndepth = "1.5 mm"\n'
    (tmp_path / "tools.toml").write_text(spot + "[[tool]]\nnumber = 2\n" + tool.format("drill", 3.3))
    (tmp_path / "holes.csv").write_text("x,y,diameter\n50,30,3.3\n20,30,3.3\n")
    outcome = leafcut.drill(
        tmp_path / "holes.csv",
        tools=tmp_path / "tools.toml",
        centre_drill=True,
        depth=4,
        keep_out=["54 25 60 35 0"],
    )
    assert outcome.verified


def test_the_summary_states_how_far_the_drill_comes_out_below_the_plate(tmp_path: Path) -> None:
    """A drill of Ø6 and 118 degrees has a cone of 3 mm / tan 59° = 1.80 mm; 0.5 mm more leave the plate."""
    (tmp_path / "holes.csv").write_text("x,y,diameter\n50,30,6\n20,30,6\n")
    plate = leafcut.drill(tmp_path / "holes.csv", units="mm", thickness=8)
    assert -8.0 - 3.0 / math.tan(math.radians(59.0)) - 0.5 == pytest.approx(-10.30, abs=0.005)
    sentences = [fact.sentence for fact in report_of(plate).facts if fact.name == "Depth"]
    assert sentences == ["Z0 is the top; the lowest point is Z-10.30, 2.30 mm below the plate"]
    blind = leafcut.drill(tmp_path / "holes.csv", units="mm", depth=2, depth_to="tip")
    sentences = [fact.sentence for fact in report_of(blind).facts if fact.name == "Depth"]
    assert sentences == ["Z0 is the top; the lowest point is Z-2.00"]


def test_only_a_machine_that_nobody_named_is_assumed(tmp_path: Path) -> None:
    (tmp_path / "holes.csv").write_text("x,y,diameter\n50,30,6\n20,30,6\n")
    for options, assumed, timed_as in (
        (
            {},
            ["the machine is assumed to be linuxcnc-mill; name yours with --machine"],
            ["the machine is linuxcnc-mill, as the header of the program states; change it with --machine"],
        ),
        ({"machine": "haas-vf2"}, [], []),
    ):
        program = leafcut.drill(tmp_path / "holes.csv", tmp_path / "o.nc", units="mm", depth=2, **options)
        timed = leafcut.simulate(tmp_path / "o.nc", **options)
        for issues, expected in ((program.issues, assumed), (timed.issues, timed_as)):
            assert [issue.message for issue in issues if issue.code == "L417"] == expected


def test_holes_on_a_layer_that_is_named_for_pockets_are_reported(tmp_path: Path) -> None:
    drawing = ezdxf.new(units=ezdxf.units.MM)
    for x, layer in ((0, "ISLAND"), (20, "Islands"), (40, "pocket_1"), (60, "HOLES"), (80, "ISLAND")):
        drawing.modelspace().add_circle((x, 0), 3.0, dxfattribs={"layer": layer})
    drawing.saveas(tmp_path / "plate.dxf")
    issues = leafcut.drill(tmp_path / "plate.dxf", depth=2).issues
    assert sorted(issue.message.partition(",")[0] for issue in issues if issue.code == "L418") == [
        "the program drills 1 hole on layer 'Islands'",
        "the program drills 1 hole on layer 'pocket_1'",
        "the program drills 2 holes on layer 'ISLAND'",
    ]
    chosen = leafcut.drill(tmp_path / "plate.dxf", depth=2, layers=["HOLES", "ISLAND"])
    assert "L418" not in {issue.code for issue in chosen.issues}
