"""Units are converted once, at the edge."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leafcut.errors import OptionError
from leafcut.options.sheet_word import parse_sheet
from leafcut.processes.settings import collect_settings, read_options_file
from leafcut.read.tools import load_tools
from leafcut.units import BARE_UNIT, FACTORS, format_length, format_time, parse_point, parse_quantity


@pytest.mark.parametrize(
    "text, unit, value",
    [
        ("3mm", "mm", 3.0),
        ("3", "mm", 3.0),
        (" .5 in ", "mm", 12.7),
        ('1"', "mm", 25.4),
        ("1e1 mil", "mm", 0.254),
        ("-2.5cm", "mm", -25.0),
        ("3 MM", "mm", 3.0),
        ("300", "mm/s", 5.0),
        ("90ipm", "mm/s", 90 * 25.4 / 60),
        ("1.5 m/min", "mm/s", 25.0),
        ("500ms", "s", 0.5),
        ("2 min", "s", 120.0),
        ("118deg", "rad", math.radians(118)),
        ("118", "rad", math.radians(118)),
        ("2.5 m/s2", "mm/s²", 2500.0),
        ("0.1g", "mm/s²", 980.665),
        ("24krpm", "rpm", 24000.0),
        ("6,5", "mm", 6.5),
        ("-0,125 in", "mm", -3.175),
        ("1,5 min", "s", 90.0),
        ("22,5deg", "rad", math.radians(22.5)),
        ("1250,125", "mm", 1250.125),
        ("1/4in", "mm", 6.35),
        ('3/8"', "mm", 9.525),
        ("3/8 ″", "mm", 9.525),
        ("1 1/2in", "mm", 38.1),
        ("1-1/2 in", "mm", 38.1),
        ("-1 1/2in", "mm", -38.1),
        ("+1/2", "mm", 0.5),
        ("3000 1/min", "rpm", 3000.0),
        ("1/2 1/min", "rpm", 0.5),
        ("1 1/2min", "s", 90.0),
        ("22 1/2deg", "rad", math.radians(22.5)),
    ],
)
def test_a_text_carries_its_unit_or_has_the_one_of_the_shop(text: str, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("unit", list(FACTORS))
def test_the_unit_that_a_bare_number_has_is_a_known_one(unit: str) -> None:
    assert BARE_UNIT[unit] in FACTORS[unit]


def test_a_number_is_in_inner_units_already() -> None:
    assert parse_quantity(5, "mm/s") == 5.0


@pytest.mark.parametrize(
    "value, words",
    [
        ("", "not a number"),
        ("abc", "not a number"),
        ("3 furlongs", "unknown unit 'furlongs'"),
        ("nan", "not a number"),
        ("1e999", "not a finite"),
        (math.inf, "not a finite"),
        (math.nan, "not a finite"),
        (True, "not a number"),
        ("3mm4", "unknown unit"),
        ("6,5,4", "'6,5,4' is not a single number; write it with a point, such as 6.5"),
        (",5", "such as 6.5"),
        ("6,", "such as 6.5"),
        ("1,250.5", "such as 6.5"),
        ("1,250mm", "is ambiguous: write 1250 or 1.250"),
        ("1/0in", "division by zero in '1/0in'"),
        ("1 5/4in", "5/4 is not less than 1; write a fraction such as 1 1/2in"),
        ("1/4/2in", "not a fraction; write a fraction such as 1/4in"),
        ("1.5/4in", "not a fraction"),
        ("1/4,5in", "not a fraction"),
        ("1 1/2.5in", "not a fraction"),
        ("1/-4in", "not a fraction"),
        ("1/4 furlongs", "unknown unit 'furlongs'"),
    ],
)
def test_what_is_no_quantity_is_refused(value: str | float, words: str) -> None:
    with pytest.raises(OptionError, match=words):
        parse_quantity(value, "mm")


@given(st.integers(0, 999), st.integers(1, 999), st.integers(1, 1000))
def test_a_fraction_is_what_is_divided(whole: int, part: int, parts: int) -> None:
    text = f"{whole} {part}/{parts}in"
    if part < parts or not whole:
        text = text if whole else text.removeprefix("0 ")
        assert parse_quantity(text, "mm") == pytest.approx(25.4 * (whole + part / parts))
    else:
        with pytest.raises(OptionError, match="not less than 1"):
            parse_quantity(text, "mm")


def test_a_fraction_is_taken_wherever_a_quantity_is(tmp_path: Path) -> None:
    """On the command line, in a file of options, as a sheet or a point, in a tool library, and in the studio's form."""
    quarter = pytest.approx(6.35)
    (tmp_path / "shop.toml").write_text('[drill]\nthickness = "1/4in"\nstart_point = "1/4in,1 1/2in"\n')
    options = read_options_file(tmp_path / "shop.toml")
    for values in ({"thickness": "1/4in"}, {"thickness": options["thickness"]}):
        assert collect_settings(values).job.thickness == quarter
    assert collect_settings(options).job.start_point == pytest.approx((6.35, 38.1))
    assert parse_sheet('48 1/2inx96"').size == pytest.approx((48.5 * 25.4, 96 * 25.4))
    (tmp_path / "tools.toml").write_text('[[tool]]\nnumber = 1\ndiameter = "1/4in"\nfeed = "7 1/2 ipm"\n')
    tool = load_tools(tmp_path / "tools.toml").tools[0]
    assert (tool.diameter, tool.feed) == (quarter, pytest.approx(7.5 * 25.4 / 60))
    with pytest.raises(OptionError, match=r"^--thickness: division by zero in '1/0in'$"):
        collect_settings({"thickness": "1/0in"})


@given(st.text())
def test_no_text_breaks_the_parser(text: str) -> None:
    try:
        assert math.isfinite(parse_quantity(text, "mm"))
    except OptionError as problem:
        assert str(problem)


def test_a_point_has_a_unit_in_every_coordinate() -> None:
    assert parse_point("1in, 2 ,3cm") == pytest.approx((25.4, 2.0, 30.0))
    assert parse_point((1.0, 2.0)) == (1.0, 2.0)


@pytest.mark.parametrize(
    "seconds, text",
    [
        (8.421, "8.42 s"),
        (9.996, "10.0 s"),
        (42.06, "42.1 s"),
        (59.97, "1 min 00 s"),
        (185.2, "3 min 05 s"),
        (3599.9, "1 h 00 min"),
        (7320, "2 h 02 min"),
    ],
)
def test_times_read_as_a_person_says_them(seconds: float, text: str) -> None:
    assert format_time(seconds) == text


@pytest.mark.parametrize("mm, text", [(412.34, "412.3 mm"), (12410, "12.41 m"), (-1500, "-1.50 m"), (0, "0.0 mm")])
def test_lengths_read_as_a_person_says_them(mm: float, text: str) -> None:
    assert format_length(mm) == text
