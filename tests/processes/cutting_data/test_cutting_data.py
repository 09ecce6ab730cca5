"""Speeds and feeds as a user asks for them: the front against brute force, limits, libraries, refusals."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.errors import LeafcutError, OptionError, PlanError
from leafcut.model.cutting_front import CuttingData
from leafcut.processes.cutting_data import run as run_of_speeds
from leafcut.read.tools import load_tools
from own_machines import machine_of_power

LIBRARY = """# my tools
[[tool]]
number = 1
diameter = "6 mm"  # the good one
feed = "100 mm/min"
spindle_speed = "900 rpm"
material = "hss"
life_cost = 4.5

[[tool]]
number = 2
kind = "end-mill"
diameter = "8 mm"
teeth = 4
feed = "300 mm/min"
spindle_speed = "4000 rpm"
material = "carbide"

[[tool]]
number = 3
kind = "reamer"
diameter = "6 mm"
"""
DRILL: dict[str, Any] = {"material": "c45", "tool_diameter": 6, "depth": 12}


@pytest.fixture
def library(tmp_path: Path) -> Path:
    file = tmp_path / "shop.toml"
    file.write_text(LIBRARY, encoding="utf-8")
    return file


def chosen(found: CuttingData, number: int = 1) -> Any:
    return next(one for one in found.tools if one.tool.number == number)


def by_hand(rpm: int, feed: int) -> tuple[float, float, float] | None:
    """Return min, currency and minutes of life of a hole in C45 by a 6 mm HSS drill, in a handbook's units.

    v = 1.14 C D^0.4/(T^0.2 f^y), deep holes as printed; 60 an hour, 10 a tool, 2 min a change, 1.5 s between holes.
    None where a limit is passed.
    """
    chip, speed = feed / rpm, math.pi * 6.0 * rpm / 1000.0
    if not 0.25 * 0.025 * 6.0 - 1e-9 <= chip <= 0.025 * 6.0 + 1e-9:
        return None
    length = 12.0 + 3.0 / math.tan(math.radians(59.0))
    share = 1.0 if length <= 18.0 else 1.0 - 0.15 * (length - 18.0) / 6.0
    c, y = (7.0, 0.7) if chip < 0.2 else (9.8, 0.5)
    life = min((1.14 * c * 6.0**0.4 * share / (speed * chip**y)) ** 5, 240.0)
    if life < 5.0:
        return None
    worn = length / feed / life
    time = (length + 2.0) / feed + 1.5 / 60.0 + 2.0 * worn
    return time, time * 1.0 + 10.0 * worn, life


def test_the_front_is_that_of_a_brute_force_search_by_the_handbooks_formulas(monkeypatch: pytest.MonkeyPatch) -> None:
    """All speeds in steps of 100 rpm and feeds of 10 mm/min, each compared with each, in plain Python."""
    monkeypatch.setattr(run_of_speeds, "_RPM_STEP", 100.0)
    monkeypatch.setattr(run_of_speeds, "_FEED_STEP", 10.0 / 60.0)
    found = leafcut.tool_speeds(**DRILL, machine="haas-vf2")
    tried = {(n, f): by_hand(n, f) for n in range(100, 8200, 100) for f in range(10, 1300, 10)}
    allowed = {pair: values for pair, values in tried.items() if values is not None}

    def dominates(a: tuple[float, float, float], b: tuple[float, float, float]) -> bool:
        one, other = (a[0], a[1], -a[2]), (b[0], b[1], -b[2])
        # Equal numbers that are reckoned in another order differ in their last digits.
        close = [abs(p - q) <= 1e-9 * abs(q) for p, q in zip(one, other, strict=True)]
        no_larger = all(p < q or near for p, q, near in zip(one, other, close, strict=True))
        return no_larger and any(p < q and not near for p, q, near in zip(one, other, close, strict=True))

    best = {pair for pair, b in allowed.items() if not any(dominates(a, b) for a in allowed.values())}
    (tool,) = found.tools
    assert {(round(p.rpm), round(p.feed * 60)) for p in tool.points} == best
    assert tool.allowed == len(allowed)
    assert len(best) > 5
    for point in tool.points:
        time, cost, life = allowed[round(point.rpm), round(point.feed * 60)]
        assert (point.time / 60, point.cost, point.life / 60) == pytest.approx((time, cost, life))


def test_each_objective_chooses_the_best_of_all_that_is_allowed_and_the_front_runs_between_them() -> None:
    found = {o: chosen(leafcut.tool_speeds(**DRILL, objective=o)) for o in ("time", "cost", "life")}
    points = found["cost"].points
    assert found["time"].best.time == min(p.time for p in points) == points[0].time
    assert found["cost"].best.cost == min(p.cost for p in points)
    assert found["life"].best.life == max(p.life for p in points) == 4 * 3600
    assert found["time"].best.time < found["cost"].best.time < found["life"].best.time
    assert points[0] == found["time"].best and len({one.points for one in found.values()}) == 1


@pytest.mark.parametrize(
    ("power", "least_life", "of"),
    [
        ("0.3 kW", 300.0, lambda p: p.power / 300.0),
        ("300 kW", 7200.0, lambda p: 7200.0 / p.life),
    ],
)
def test_no_point_is_beyond_a_limit_and_the_limit_is_what_stops_the_quickest(
    power: str, least_life: float, of: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    free = chosen(leafcut.tool_speeds(**DRILL, objective="time"))
    monkeypatch.setattr(run_of_speeds, "_LEAST_LIFE", least_life)
    bound = chosen(leafcut.tool_speeds(**DRILL, machine=machine_of_power(tmp_path, power), objective="time"))
    assert of(free.best) > 1.0
    assert all(of(point) <= 1.0 + 1e-9 for point in bound.points)
    assert max(map(of, bound.points)) > 0.9
    assert bound.best.time > free.best.time


def test_the_limits_of_a_machine_hold_without_being_asked_for(tmp_path: Path) -> None:
    profile = tmp_path / "weak.toml"
    profile.write_text(
        'controller = "grbl"\n[rapid]\nvelocity = "2 m/min"\n[travel]\nmin = "-100 mm"\nmax = "0 mm"\n'
        '[spindle]\npower = "0.3 kW"\ntorque = "1.6 N·m"\nmax_thrust = "750 N"\nmax_speed = "2000 rpm"\n'
    )
    points = chosen(leafcut.tool_speeds(**DRILL, machine=str(profile))).points
    assert all(p.power <= 300 and p.torque <= 1600 and p.thrust <= 750 and p.rpm <= 2000 for p in points)


def test_drills_of_a_drawing_have_its_holes_and_the_time_of_its_program(library: Path, examples: Path) -> None:
    """At the library's own speed without tool wear, the time equals that of the program without the other tools."""
    options: dict[str, Any] = {"depth": 3, "tools": library, "diameter_tolerance": 1, "machine": "haas-vf2"}
    plate = str(examples / "plate_10.dxf")
    found = chosen(leafcut.tool_speeds(plate, material="c45", **options))
    made = leafcut.optimize(plate, **options)
    assert found.holes == len(made.operations[0].holes) == 10
    assert found.given is not None
    assert found.given.time == pytest.approx(made.after.time_s, rel=0.02)
    assert found.best.time < found.given.time


def test_speeds_are_chosen_for_a_spindle_that_turns_faster_than_the_assumed_drill(examples: Path) -> None:
    """Before any speed is chosen, a drill of 6.35 mm would need 1003 rpm."""
    found = leafcut.tool_speeds(
        examples / "plate_10.dxf", thickness=6, material="aluminium", machine="shapeoko-router", preset="fast"
    )
    assert all(point.rpm >= 10_000 for tool in found.tools for point in tool.points)


def test_end_mills_are_chosen_for_beside_drills(library: Path) -> None:
    """The mill's path is 1 m: by hand 1000 mm by its feed, and its share of a worn tool."""
    found = leafcut.tool_speeds(material="c45", depth=3, tools=library)
    assert [one.tool.number for one in found.tools] == [1, 2]
    mill = chosen(found, 2).best
    assert mill.time == pytest.approx(1000.0 / mill.feed * (1.0 + 120.0 / mill.life))


@pytest.mark.parametrize("narrow", [{"step_down": 2}, {"step_over": 0.5}], ids=["depth", "width"])
def test_step_over_and_step_down_are_the_cut_of_an_end_mill(library: Path, narrow: dict[str, Any]) -> None:
    """Half as deep or wide takes half the power; the default is a slot half of the diameter of 8 mm deep."""
    given: dict[str, Any] = {"tools": library, "material": "c45", "depth": 3}
    full, same, half = (
        {(p.rpm, p.feed): p.power for p in chosen(leafcut.tool_speeds(**given, **cut), 2).points}
        for cut in ({}, {"step_down": 4}, narrow)
    )
    assert full == same
    both = full.keys() & half.keys()
    assert both and all(half[point] == pytest.approx(0.5 * full[point]) for point in both)


def test_mills_of_high_speed_steel_have_half_the_chip_of_carbide_ones(library: Path) -> None:
    """Of 8 mm in C45: 0.01 × 8 mm by tooth at most."""
    given: dict[str, Any] = {"tools": library, "material": "c45", "depth": 3}
    most = {}
    for kind in ("carbide", "hss"):
        library.write_text(LIBRARY.replace('material = "carbide"', f'material = "{kind}"'), encoding="utf-8")
        most[kind] = max(point.chip for point in chosen(leafcut.tool_speeds(**given), 2).points)
    assert most == pytest.approx({"carbide": 0.08, "hss": 0.04}, rel=0.01)


def test_a_saved_library_is_the_users_own_but_for_the_chosen_speeds_and_a_program_drills_with_them(
    library: Path, tmp_path: Path, examples: Path
) -> None:
    new = tmp_path / "new.toml"
    found = leafcut.tool_speeds(tools=library, material="c45", depth=12, save=new)
    point = chosen(found).best
    assert library.read_text(encoding="utf-8") == LIBRARY
    changed = {
        "# my tools\n": "# my tools\nschema = 1\n",
        'feed = "100 mm/min"': f'feed = "{point.feed * 60:g} mm/min"',
        'spindle_speed = "900 rpm"': f'spindle_speed = "{point.rpm:g} rpm"',
        'feed = "300 mm/min"': f'feed = "{chosen(found, 2).best.feed * 60:g} mm/min"',
        'spindle_speed = "4000 rpm"': f'spindle_speed = "{chosen(found, 2).best.rpm:g} rpm"',
    }
    expected = LIBRARY
    for old, words in changed.items():
        expected = expected.replace(old, words)
    assert new.read_text(encoding="utf-8") == expected
    made = leafcut.optimize(str(examples / "plate_10.dxf"), depth=3, tools=new, diameter_tolerance=1)
    assert f"F{point.feed * 60:g}" in made.text
    assert f"S{point.rpm:g}" in made.text


def test_without_a_library_a_new_one_is_written_and_read_again_as_the_same_tool(tmp_path: Path) -> None:
    new = tmp_path / "new.toml"
    found = leafcut.tool_speeds(**DRILL, save=new)
    (tool,) = load_tools(new).tools
    assert (tool.diameter, tool.point_angle) == pytest.approx((6.0, math.radians(118)))
    assert (tool.feed, tool.spindle_rpm) == pytest.approx((chosen(found).best.feed, chosen(found).best.rpm))


def test_a_library_of_another_program_is_written_as_toml_with_all_its_tools(tmp_path: Path) -> None:
    table = tmp_path / "tool.tbl"
    table.write_text("T1 P1 D6.0 ;drill\nT4 P4 D10 ;end mill\n")
    new = tmp_path / "new.toml"
    found = leafcut.tool_speeds(tools=table, material="c45", depth=12, save=new)
    tools = load_tools(new).by_number
    assert set(tools) == {1, 4}
    assert tools[1].feed == pytest.approx(chosen(found).best.feed)
    assert tools[4].feed == 0.0


def test_tools_whose_speeds_are_not_chosen_are_told_and_the_rest_is_chosen(library: Path) -> None:
    found = leafcut.tool_speeds(tools=library, material="c45", depth=12)
    assert [one.tool.number for one in found.tools] == [1, 2]
    assert [issue.message for issue in found.issues] == [
        "no speeds were chosen for T3: leafcut knows speeds only for drills and end mills",
    ]


def test_a_tool_that_cannot_be_used_is_told_and_does_not_keep_the_others_from_their_speeds(tmp_path: Path) -> None:
    """Of three drills one is too short, and one of carbide, of which aluminium has no constants."""
    file = tmp_path / "three.toml"
    rows = ("", 'flute_length = "5 mm"', 'material = "carbide"')
    text = "".join(f'[[tool]]\nnumber = {n}\ndiameter = "{n + 4} mm"\n{row}\n' for n, row in enumerate(rows, 1))
    file.write_text(text, encoding="utf-8")
    options: dict[str, Any] = {"tools": file, "material": "6061", "depth": 12}
    found = leafcut.tool_speeds(**options)
    assert [one.tool.number for one in found.tools] == [1]
    assert [issue.severity.value for issue in found.issues] == ["warning", "warning"]
    assert "T2 drill Ø6: its flutes are 5 mm long, but with its point the holes are 13.8 mm deep" in str(
        found.issues[0]
    )
    assert "T3 drill Ø7: aluminium-6061 has no tool-life constants of carbide drills" in str(found.issues[1])


def test_the_costs_of_the_library_count(library: Path) -> None:
    """4.5 for a life: cost = rate × time + worn × 4.5."""
    point = chosen(leafcut.tool_speeds(tools=library, material="c45", depth=12)).best
    assert point.cost == pytest.approx(60 / 3600 * point.time + 4.5 * point.worn)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (
            {"material": None},
            "the material is missing; name it with --material",
        ),
        ({"material": "c54"}, "unknown material 'c54'; did you mean 'c45'?"),
        ({"tool_diameter": None}, "the tool is missing; give a drawing, --tools or --tool-diameter"),
        ({"holes": 20}, "--holes was removed: its value is always 1"),
        ({"depth": None}, "the depth of the holes is missing; give --depth or --thickness"),
        ({"shop_rate": -3}, "--shop-rate: -3 is below the minimum of 0"),
        ({"min_life": "5h"}, "--min-life was removed: its value is always 5 min"),
        ({"step_down": 3}, "--step-down: only used with --tools"),
        (
            {"material": "6061", "tool_material": "carbide"},
            "no tool-life constants of carbide drills; it has constants",
        ),
        ({"material": "copper"}, "copper has no tool-life constants of hss drills; it has none for drills"),
        ({"machine": "laser-table"}, "--machine laser-table: has no spindle"),
        ({"layers": "x"}, "--layers: only used for a drawing; leave it out"),
        ({"step_over": 0.5}, "--step-over: only used with --tools"),
    ],
)
def test_what_cannot_be_chosen_is_refused_in_one_line_that_says_why(given: dict[str, Any], words: str) -> None:
    options = {name: value for name, value in (DRILL | given).items() if value is not None}
    with pytest.raises(LeafcutError) as refused:
        leafcut.tool_speeds(**options)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_spindle_without_the_power_for_any_speed_is_refused(tmp_path: Path) -> None:
    words = "reaches a power of at most 0.001 kW; possible is at least .*; change spindle.power of the machine"
    with pytest.raises(PlanError, match=words):
        leafcut.tool_speeds(**DRILL, machine=machine_of_power(tmp_path, "1 W"))


def test_files_are_refused_before_anything_is_written(tmp_path: Path, library: Path, examples: Path) -> None:
    with pytest.raises(OptionError, match=r"--plot: 'front\.png'.*\.svg"):
        leafcut.tool_speeds(**DRILL, plot=tmp_path / "front.png")
    with pytest.raises(OptionError, match=r"--save new\.txt: a tool library is written as TOML"):
        leafcut.tool_speeds(**DRILL, save=tmp_path / "new.txt", plot=tmp_path / "front.svg")
    assert not (tmp_path / "front.svg").exists()
    with pytest.raises(LeafcutError, match="never overwritten"):
        leafcut.tool_speeds(tools=library, material="c45", depth=5, save=library)
    with pytest.raises(OptionError, match="--step-down: not used for a drawing"):
        leafcut.tool_speeds(str(examples / "plate_10.dxf"), material="c45", tools=library, depth=3, step_down=3)
    with pytest.raises(PlanError, match="is a gcode; speeds and feeds are chosen for a drawing with holes"):
        leafcut.tool_speeds(str(examples / "cam_121.nc"), material="c45")
    with pytest.raises(PlanError, match="number of its teeth is unknown"):
        mill = LIBRARY[LIBRARY.index("[[tool]]\nnumber = 2") : LIBRARY.index("[[tool]]\nnumber = 3")]
        library.write_text(mill.replace("teeth = 4\n", ""), encoding="utf-8")
        leafcut.tool_speeds(tools=library, material="c45")
    with pytest.raises(OptionError, match="'diameter' is missing"):
        library.write_text("[[tool]]\nnumber = 1\n", encoding="utf-8")
        leafcut.tool_speeds(tools=library, material="c45", depth=5)


def test_json_has_shop_units_and_the_whole_front(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """m/min = π D n / 1000, kW and N·m: P = M · 2π n / 60 by the drive's 0.75."""
    line = "tools speeds --material c45 --tool-diameter 6 --depth 12 --objective time --json"
    plot = tmp_path / "front.svg"
    assert run([*line.split(), "--plot", str(plot)]) == 0
    found = json.loads(capsys.readouterr().out)
    (tool,) = found["tools"]
    point = tool["chosen"]
    assert found["objective"] == "time" and found["plot"] == str(plot)
    assert point == tool["front"][0]
    assert point["cutting_speed_m_min"] == pytest.approx(math.pi * 6 * point["rpm"] / 1000)
    assert point["chip_mm"] == pytest.approx(point["feed_mm_min"] / point["rpm"])
    assert point["power_kw"] == pytest.approx(point["torque_nm"] * math.tau * point["rpm"] / 60 / 1000 / 0.75)
    root = ElementTree.fromstring(plot.read_text(encoding="utf-8"))
    dots = [e.get("d", "") for e in root.iter() if (e.get("class") or "").startswith("dots")]
    assert sum(len(re.findall("h0", d)) for d in dots) == 2 * len(tool["front"])
    words = {e.text for e in root.iter() if e.tag.endswith("text")}
    assert {"quickest", "cheapest", "longest life", "cost", "feed rate, mm/min"} <= words


def test_the_terminal_shows_the_best_of_each_objective_and_the_librarys_own(
    capsys: pytest.CaptureFixture[str], library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert run(["tools", "speeds", "--material", "c45", "--tools", str(library), "--depth", "12"]) == 0
    out = capsys.readouterr().out
    assert "quickest" in out and "→ cheapest" in out and "as given" in out
    assert re.search(r"spindle speed .* 900 rpm\n", out)
    assert re.search(r"feed rate .* 100 mm/min\n", out)
    assert max(map(len, out.splitlines())) <= 100


@pytest.mark.parametrize(
    ("material", "tool", "words"),
    [
        ("6061", "hss", "unverified: some constants of the tool life of hss in aluminium-6061 have no printed source"),
        ("c45", "carbide", "estimate: the tool life of carbide in steel-c45 has no measured source"),
        ("s235", "hss", ""),
    ],
)
def test_the_terminal_says_in_one_line_what_a_tools_life_is_worth(
    capsys: pytest.CaptureFixture[str], material: str, tool: str, words: str
) -> None:
    """The constants of high-speed steel drills in S235 come from worked examples that were read."""
    line = f"tools speeds --material {material} --tool-material {tool} --tool-diameter 6 --depth 12"
    assert run(line.split()) == 0
    said = [row for row in capsys.readouterr().out.splitlines() if row.startswith(("unverified", "estimate"))]
    assert said == ([words] if words else [])


def test_materials_are_listed_and_shown_with_their_sources(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["list", "materials"]) == 0
    assert "steel-c45" in capsys.readouterr().out
    assert run(["list", "materials", "1045"]) == 0
    text = capsys.readouterr().out
    assert "[sources]" in text and 'kc11 = "1500 N/mm2"' in text
    own = tmp_path / "own.toml"
    own.write_text(text, encoding="utf-8")
    options = {**DRILL, "material": str(own)}
    assert chosen(leafcut.tool_speeds(**options)).points == chosen(leafcut.tool_speeds(**DRILL)).points
    assert run(["list", "materials", "1054"]) == 2
    assert "unknown material '1054'; did you mean '1045'?" in capsys.readouterr().err
