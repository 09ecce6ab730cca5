"""The cut chart: the row of a thickness, interpolation, and messages for missing data."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest

from leafcut.errors import LeafcutError, OptionError, PlanError, ReadError
from leafcut.read.cutchart import find_cut_data, load_chart

HEAD = "process,material,thickness_mm,amps,cut_speed_mm_min,pierce_height_mm,pierce_delay_s,cut_height_mm,kerf_width_mm"


def chart(tmp_path: Path, *rows: str, head: str = HEAD):
    file = tmp_path / "chart.csv"
    file.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return load_chart(file)


def test_the_row_of_a_thickness_is_taken_as_it_stands() -> None:
    """Powermax45 XP manual, 45 A, mild steel 6 mm: 1430 mm/min, kerf 1.54, 0.58 s at 3.8 mm, cut at 1.5 mm."""
    data, _ = find_cut_data(load_chart(), "plasma", "mild_steel", 6.0, 45.0)
    assert data.feed == pytest.approx(1430 / 60)
    assert (data.kerf, data.pierce_delay, data.pierce_height, data.cut_height) == (1.54, 0.58, 3.8, 1.5)
    assert data.can_pierce
    assert "Powermax45 XP" in data.source


def test_a_thickness_between_two_rows_is_taken_between_them_and_said() -> None:
    """7 mm between 6.35 and 8 mm: speeds on a power law, the kerf on a straight line."""
    data, issues = find_cut_data(load_chart(), "plasma", "mild_steel", 7.0, 45.0)
    power = math.log(7 / 6.35) / math.log(8 / 6.35)
    assert data.feed * 60 == pytest.approx(1219 * (1020 / 1219) ** power)
    assert data.kerf == pytest.approx(1.55 + (1.65 - 1.55) * (7 - 6.35) / (8 - 6.35))
    assert [i.code for i in issues if i.code == "L411"] == ["L411"]
    assert "between 6.35 and 8 mm" in str(issues[0])


def test_other_currents_for_about_the_thickness_are_offered(tmp_path: Path) -> None:
    """About 6 mm is 5 to 7 mm, about 20 mm is 18 to 22 mm; a current that has no row there is not offered."""
    rows = [f"plasma,mild_steel,{t},{a},1000,3.8,0.5,1.5,1.5" for t, a in ((6, 45), (6, 65), (7, 85), (7.1, 105))]
    _, issues = find_cut_data(chart(tmp_path, *rows), "plasma", "mild_steel", 6.0, 45.0)
    assert [(i.code, i.message) for i in issues] == [
        (
            "L412",
            "cut with plasma 45 A; for similar thicknesses, the chart also has plasma 65 A, plasma 85 A: "
            "choose with --amps",
        )
    ]
    rows = [f"plasma,mild_steel,{t},{a},1000,3.8,0.5,1.5,1.5" for t, a in ((20, 45), (22, 65), (22.1, 85))]
    _, issues = find_cut_data(chart(tmp_path, *rows), "plasma", "mild_steel", 20.0, 45.0)
    assert "also has plasma 65 A: " in issues[0].message
    _, issues = find_cut_data(chart(tmp_path, rows[0], rows[2]), "plasma", "mild_steel", 20.0, 45.0)
    assert issues == []


def test_above_the_pierce_capacity_the_chart_says_no_pierce() -> None:
    data, _ = find_cut_data(load_chart(), "plasma", "mild_steel", 16.0, 45.0)
    assert not data.can_pierce
    forced, _ = find_cut_data(load_chart(), "plasma", "mild_steel", 16.0, 45.0, pierce_delay=2.0)
    assert forced.can_pierce
    assert forced.pierce_delay == 2.0


@pytest.mark.parametrize(
    "process, material, thickness, amps, error, words",
    [
        ("plasma", "mild_steel", 60.0, None, PlanError, "nearest are"),
        ("plasma", "mild_steel", 0.2, None, PlanError, "nearest are 1, 1.52"),
        ("plasma", "titanium", 3.0, None, OptionError, "--material"),
        ("plasm", "mild_steel", 3.0, None, OptionError, "did you mean 'plasma'"),
        ("plasma", "mild_steel", 3.0, 20.0, OptionError, "45, 65, 85"),
        ("oxyfuel", "brass", 3.0, None, OptionError, "--cut-speed, --kerf and --pierce-delay"),
        ("plasma", "mild_steel", 12.7, 85.0, OptionError, "--kerf.* and the pierce delay"),
        (
            "plasma",
            "mild_steel",
            20.0,
            None,
            OptionError,
            "above the pierce capacity of plasma 45 A; for 85 A, the cut chart does not give .* use --amps 45 to start",
        ),
    ],
)
def test_what_the_chart_does_not_have_is_said_with_what_it_has(
    process: str, material: str, thickness: float, amps: float | None, error: type[LeafcutError], words: str
) -> None:
    with pytest.raises(error, match=words) as caught:
        find_cut_data(load_chart(), process, material, thickness, amps)
    assert "\n" not in str(caught.value)


def test_the_users_own_values_are_in_the_place_of_the_charts() -> None:
    data, _ = find_cut_data(
        load_chart(), "plasma", "steel", 6.0, feed=10.0, kerf=2.0, pierce_delay=0.1, pierce_height=5.0, cut_height=3.0
    )
    assert (data.feed, data.kerf, data.pierce_delay, data.pierce_height, data.cut_height) == (10.0, 2.0, 0.1, 5.0, 3.0)


def test_data_that_are_not_certain_are_said_to_be_so() -> None:
    data, issues = find_cut_data(load_chart(), "laser_fiber_3kW", "mild_steel", 3.0)
    assert data.kerf == 0.22
    assert {"L413", "L414"} <= {i.code for i in issues}


@pytest.mark.parametrize("process", ["laser", "laser_fiber", "laser_diode_5W", "laser_fiber_4kW"])
def test_no_laser_gets_the_rows_of_another_kind_or_power(process: str) -> None:
    """The user's own figures suffice for any laser; rows without kind and power apply to all."""
    with pytest.raises(OptionError, match=r"the chart has .*laser_fiber_3kw.*cut_process|no data for .*--chart"):
        find_cut_data(load_chart(), process, "mild_steel", 3.0)
    data, _ = find_cut_data(load_chart(), process, "mild_steel", 3.0, feed=5.0, kerf=0.2, pierce_delay=0.0)
    assert (data.process, data.feed) == (process.lower(), 5.0)


def test_rows_that_name_neither_kind_nor_power_are_for_every_laser(tmp_path: Path) -> None:
    rows = chart(tmp_path, "laser,mild_steel,3,,1000,1,0.5,1,0.2,")
    assert find_cut_data(rows, "laser_fiber_3kW", "mild_steel", 3.0)[0].feed == pytest.approx(1000 / 60)


def test_a_manufacturers_row_goes_before_a_sample_file(tmp_path: Path) -> None:
    rows = chart(
        tmp_path,
        "plasma,mild_steel,3,45,1000,3,0.5,1.5,1.4,sample file",
        "plasma,mild_steel,3,45,2000,3,0.5,1.5,1.4,",
        head=HEAD + ",confidence",
    )
    assert find_cut_data(rows, "plasma", "mild_steel", 3.0)[0].feed == pytest.approx(2000 / 60)


def test_every_row_of_the_shipped_chart_has_its_source_and_its_confidence() -> None:
    rows = load_chart()
    assert len(rows) == 157
    assert all(r.source and r.confidence for r in rows)


def test_speeds_of_plasma_and_of_fibre_lasers_in_steel_are_the_collected_ones(data: Path) -> None:
    with (data / "cutchart.csv").open(encoding="utf-8", newline="") as file:
        collected = {
            (r["process"].lower(), float(r["thickness_mm"]), round(float(r["cut_speed_mm_min"]), 6))
            for r in csv.DictReader(file)
            if r["process"] not in ("oxyfuel", "waterjet")
        }
    shipped = {(r.process, r.thickness, round(60 * r.feed, 6)) for r in load_chart()}
    assert collected <= shipped


def test_water_jets_cut_by_the_equation_of_their_source() -> None:
    """Zeng and Kim: v = (N P^1.594 d^1.374 M^0.343 / (163 q H D^0.618))^1.15 in inches, ksi and pounds a minute; 12 mm
    of mild steel, N 87.6, at 55 ksi by hand: 122 mm/min."""
    flow = 87.6 * 55**1.594 * 0.013**1.374 * 0.8**0.343
    inches = (flow / (163 * 3 * (12 / 25.4) * 0.040**0.618)) ** 1.15
    data, issues = find_cut_data(load_chart(), "waterjet", "steel", 12.0)
    assert data.feed * 60 == pytest.approx(25.4 * inches, rel=0.005)
    assert "L413" in {i.code for i in issues}


@pytest.mark.parametrize(
    "process, material, thickness",
    [
        ("oxyfuel", "steel", 20.0),
        ("waterjet", "stainless", 8.0),
        ("waterjet", "brass", 5.0),
        ("laser_fiber_3kW", "stainless", 3.0),
        ("laser_fiber_3kW", "brass", 3.0),
        ("laser_co2_60W", "wood", 3.0),
        ("laser_co2_60W", "acrylic", 5.0),
    ],
)
def test_every_process_has_rows_of_its_materials_and_says_how_far_to_trust_them(
    process: str, material: str, thickness: float
) -> None:
    data, issues = find_cut_data(load_chart(), process, material, thickness)
    assert data.feed > 0.0
    assert data.kerf > 0.0
    assert "L413" in {i.code for i in issues}


@pytest.mark.parametrize(
    "thickness, amps", [(3.0, 65.0), (6.0, 65.0), (10.0, 65.0), (2.0, 45.0), (12.0, 45.0), (12.7, 45.0)]
)
def test_the_current_is_the_fastest_that_pierces_and_of_which_all_is_known(thickness: float, amps: float) -> None:
    """From the chart's rows by brute force: rows with a pierce and a kerf, no estimates."""
    rows = load_chart()
    data, _ = find_cut_data(rows, "plasma", "mild_steel", thickness)
    at_hand = [
        r
        for r in rows
        if (r.process, r.material, r.thickness) == ("plasma", "mild_steel", thickness)
        and r.kerf
        and r.pierce_delay is not None
        and r.source_rank < 2
    ]
    assert data.amps == amps == max(at_hand, key=lambda r: r.feed).amps


def test_own_figures_are_enough_where_the_chart_has_no_row() -> None:
    own = {"feed": 5.0, "kerf": 1.0, "pierce_delay": 0.5}
    for process, material, thickness in (
        ("plasma", "titanium", 3.0),
        ("plasma", "steel", 60.0),
        ("oxyfuel", "s690", 9.0),
    ):
        data, _ = find_cut_data(load_chart(), process, material, thickness, **own)
        assert (data.feed, data.kerf, data.pierce_delay, data.thickness) == (5.0, 1.0, 0.5, thickness)
        assert data.can_pierce
        for key in own:
            with pytest.raises((OptionError, PlanError), match="--cut-speed"):
                find_cut_data(load_chart(), process, material, thickness, **{**own, key: None})
    with pytest.raises(OptionError, match="--cut-process"):
        find_cut_data(load_chart(), "lazer", "steel", 3.0, **own)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b\n1,2\n", "has no column 'process'"),
        (HEAD + "\n", "has no rows"),
        (HEAD + "\nplasma,steel,x,45,100,1,1,1,1\n", "'thickness_mm' is 'x'"),
        (HEAD + "\nplasma,steel,-3,45,100,1,1,1,1\n", "out of range"),
        (HEAD + "\nplasma,steel,3,45,0,1,1,1,1\n", "out of range"),
        (HEAD + "\nplasma,steel,3,45,inf,1,1,1,1\n", "out of range"),
        (HEAD + "\nplasma,steel,3,45,nan,1,1,1,1\n", "out of range"),
        (HEAD + "\nplasma,steel,3,45,1e300,1,1,1,1\n", "out of range"),
        (HEAD + "\nplasma,steel,3,45,100,1,1,1,1e-300\n", "out of range"),
        (HEAD + "\nplasma,steel,3,45,100,1,1,1,60\n", "out of range"),
        (HEAD + '\n"plasma,steel\n' + "x" * 200_000, "not a table"),
    ],
)
def test_a_file_that_is_no_chart_is_refused_in_one_line(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "chart.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ReadError, match=words) as caught:
        load_chart(file)
    assert "\n" not in str(caught.value)


def test_a_kerf_of_nothing_is_a_kerf_that_the_chart_does_not_say(tmp_path: Path) -> None:
    rows = chart(tmp_path, "plasma,mild_steel,3,45,1000,3,0.5,1.5,0")
    with pytest.raises(OptionError, match="does not give the kerf"):
        find_cut_data(rows, "plasma", "mild_steel", 3.0)
    assert find_cut_data(rows, "plasma", "mild_steel", 3.0, kerf=1.2)[0].kerf == 1.2


def test_a_pierce_height_that_the_chart_does_not_say_is_told() -> None:
    data, issues = find_cut_data(load_chart(), "plasma", "mild_steel", 20.0, 45.0, pierce_delay=2.0)
    assert data.pierce_height == data.cut_height
    assert any(i.code == "L414" and "--pierce-height" in i.message for i in issues)


RATES = f"{HEAD},nozzle,gas,gas_l_min,power_kw,abrasive_g_min,nozzle_life_h,electrode_life_pierces"


def test_what_a_chart_says_of_consumption_is_carried_over_in_seconds(tmp_path: Path) -> None:
    rows = chart(tmp_path, "plasma,mild_steel,6,45,1430,3.8,0.6,1.5,1.5,fine,air,120,7.2,360,2,500", head=RATES)
    rates = find_cut_data(rows, "plasma", "mild_steel", 6.0)[0].rates
    assert (rates.nozzle, rates.gas, rates.gas_flow, rates.power) == ("fine", "air", 2.0, 7200.0)
    assert rates.abrasive == pytest.approx(0.006)
    assert (rates.nozzle_life, rates.electrode_pierces) == (7200.0, 500.0)
    assert (rates.second_gas, rates.second_gas_flow, rates.nozzle_pierces) == ("", None, None)


@pytest.mark.parametrize(
    "bad", [",fine,air,-1,,,,", ",fine,air,x,,,,", ",fine,air,,,,0,", ",fine,air,,,,,0", ",fine,air,1e9,,,,"]
)
def test_a_rate_that_cannot_be_is_refused_with_its_line(bad, tmp_path: Path) -> None:
    with pytest.raises(ReadError, match=r"chart\.csv:2"):
        chart(tmp_path, f"plasma,mild_steel,6,45,1430,3.8,0.6,1.5,1.5{bad}", head=RATES)


def test_between_rows_rates_are_on_the_line_and_words_only_where_both_say_the_same(tmp_path: Path) -> None:
    rows = chart(
        tmp_path,
        "plasma,mild_steel,4,45,3000,3.8,0.4,1.5,1.4,a,air,100,6,,,",
        "plasma,mild_steel,8,45,1200,3.8,0.8,1.5,1.6,b,air,140,,,,",
        "plasma,mild_steel,12,45,800,3.8,0.8,1.5,1.6,b,oxygen,140,,,,",
        head=RATES,
    )
    rates = find_cut_data(rows, "plasma", "mild_steel", 6.0)[0].rates
    assert (rates.nozzle, rates.gas, rates.power) == ("", "air", None)
    assert rates.gas_flow == pytest.approx(2.0)
    other = find_cut_data(rows, "plasma", "mild_steel", 10.0)[0].rates
    assert (other.nozzle, other.gas, other.gas_flow) == ("b", "", None)


def test_a_nozzle_that_is_named_is_obeyed_or_refused(tmp_path: Path) -> None:
    rows = chart(
        tmp_path,
        "plasma,mild_steel,4,45,3000,3.8,0.4,1.5,1.4,Fine,air,,,,,",
        "plasma,mild_steel,8,45,1000,3.8,0.8,1.5,1.6,Fine,air,,,,,",
        "plasma,mild_steel,6,45,2500,3.8,0.8,1.5,1.6,Coarse,air,,,,,",
        head=RATES,
    )
    assert find_cut_data(rows, "plasma", "mild_steel", 6.0)[0].feed * 60 == pytest.approx(2500)
    fine = find_cut_data(rows, "plasma", "mild_steel", 6.0, nozzle="fine")[0]
    assert 1000 < fine.feed * 60 < 2000
    assert fine.rates.nozzle == "Fine"
    with pytest.raises(OptionError, match="--nozzle none: the chart has Fine, Coarse for plasma of mild-steel"):
        find_cut_data(rows, "plasma", "mild_steel", 6.0, nozzle="none", feed=1.0, kerf=1.0, pierce_delay=0.0)


def test_two_nozzles_are_not_mixed_where_one_has_rows_on_both_sides(tmp_path: Path) -> None:
    """5 mm is between 4 and 8 mm of one nozzle, not between its 4 mm and the other nozzle's 6 mm."""
    rows = chart(
        tmp_path,
        "plasma,mild_steel,4,45,3000,3.8,0.4,1.5,1.4,fine,air,,,,,",
        "plasma,mild_steel,8,45,1000,3.8,0.8,1.5,1.6,fine,air,,,,,",
        "plasma,mild_steel,6,45,9000,3.8,0.8,1.5,1.6,coarse,air,,,,,",
        head=RATES,
    )
    data, issues = find_cut_data(rows, "plasma", "mild_steel", 5.0)
    assert "between 4 and 8 mm" in str(issues[0])
    assert data.rates.nozzle == "fine"


def test_the_shipped_chart_says_of_consumption_only_what_its_sources_say() -> None:
    rows = load_chart()
    assert {r.rates.abrasive for r in rows if r.process != "waterjet"} == {None}
    assert {round((r.rates.abrasive or 0) * 60, 6) for r in rows if r.process == "waterjet"} == {0.36}
    assert all("garnet 0.36 kg/min" in r.source for r in rows if r.rates.abrasive)
    assert {r.rates.gas_flow for r in rows} == {None}
