"""Values of settings: how each is stored, which are refused, and with which words."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from leafcut.errors import ReadError
from leafcut.model.kinds import Head
from leafcut.read.controllers.values import (
    Axes,
    Value,
    ValueOrigin,
    Values,
    format_axes,
    format_line_numbers,
    format_with_unit,
    parse_leading_number,
)

INF = math.inf
TAKEN, DERIVED, ASSUMED = ValueOrigin.TAKEN, ValueOrigin.DERIVED, ValueOrigin.ASSUMED


def stored(fill: Callable[[Values], object]) -> list[tuple[str, object, ValueOrigin, str]]:
    values = Values("a.txt", "GRBL 1.1")
    fill(values)
    return [(one.key, one.value, one.how, one.source) for one in values.entries.values()]


def refusal(act: Callable[[Values], object]) -> str:
    with pytest.raises(ReadError) as refused:
        act(Values("a.txt", "GRBL 1.1"))
    return str(refused.value)


def axes(*numbers: float, unit: str = "mm", derived: bool = False, assumed: bool = False) -> Axes:
    return Axes(numbers, unit, "line 3", derived, assumed)


def test_an_estimate_is_named_as_one() -> None:
    assert Value("a", 1, ASSUMED, "why").source_text == "estimate: why"
    assert Value("a", 1, TAKEN, "why").source_text == Value("a", 1, DERIVED, "why").source_text == "why"


def test_a_controller_without_a_dialect_is_replaced_by_the_nearest() -> None:
    assert stored(lambda values: values.store_controller("haas", "line 1", "grbl")) == [
        ("controller", "haas", DERIVED, "line 1")
    ]
    assert stored(lambda values: values.store_controller("reprap", "line 1", "grbl")) == [
        ("controller", "grbl", ASSUMED, "leafcut has no dialect of GRBL 1.1 yet; grbl is the nearest")
    ]


def test_the_slower_rapid_of_x_and_y_is_the_highest_feed() -> None:
    rapids, gains = axes(30, 20, 10, unit="mm/s", derived=True), axes(500, 500, 500, unit="mm/s2", assumed=True)
    assert stored(lambda values: values.store_motion(rapids, gains)) == [
        ("rapid.velocity", ["30 mm/s", "20 mm/s", "10 mm/s"], DERIVED, "line 3"),
        ("rapid.acceleration", "500 mm/s2", ASSUMED, "line 3"),
        ("max_feed", "20 mm/s", DERIVED, "the slower rapid of x and y: axes also limit feeds"),
    ]


@pytest.mark.parametrize(
    ("velocity", "acceleration", "words"),
    [
        (10_000, 100_000, ""),
        (0, 1, "rapid.velocity of y is 0 mm/s, but must be above 0 (line 3)"),
        (10_001, 1, "rapid.velocity of y is 10001 mm/s, more than any machine has, 10000 mm/s (line 3); "
         "correct it first"),
        (1, -1, "rapid.acceleration of y is -1 mm/s2, but must be above 0 (line 3)"),
        (1, 100_001, "rapid.acceleration of y is 100001 mm/s2, more than any machine has, 100000 mm/s2 (line 3); "
         "correct it first"),
    ],
)  # fmt: skip
def test_speeds_that_no_machine_has_are_refused(velocity: float, acceleration: float, words: str) -> None:
    def act(values: Values) -> None:
        values.store_motion(axes(1, velocity, 1, unit="mm/s"), axes(1, acceleration, 1, unit="mm/s2"))

    if words:
        assert refusal(act) == f"a.txt: {words}"
    else:
        assert stored(act)[0][1] == ["1 mm/s", "10000 mm/s", "1 mm/s"]


def test_a_limit_is_in_the_unit_of_the_file() -> None:
    with pytest.raises(ReadError, match=r"x is 24000 in/min, more than any machine has, 23622 in/min"):
        axes(24_000, 1, 1, unit="in/min").check_plausible(Values("a", "b"), "rapid.velocity", 10_000)
    axes(23_000, 1, 1, unit="in/min").check_plausible(Values("a", "b"), "rapid.velocity", 10_000)
    axes(-3937, 0, 3937, unit="in").check_plausible(Values("a", "b"), "travel.min", 100_000)
    with pytest.raises(ReadError, match=r"z is -3938 in, more than any machine has, 3937\.01 in"):
        axes(1, 1, -3938, unit="in").check_plausible(Values("a", "b"), "travel.min", 100_000)


def test_an_infinite_travel_is_unknown_and_noted() -> None:
    values = Values("a.txt", "GRBL")
    values.store_travel(axes(-INF, 0, -5), axes(9, INF, 0, derived=True))
    assert values.notes == ["the travel of x, y is unknown: it is not checked"]
    assert [(one.key, one.value, one.how) for one in values.entries.values()] == [
        ("travel.min", ["unknown", "0 mm", "-5 mm"], TAKEN),
        ("travel.max", ["9 mm", "unknown", "0 mm"], DERIVED),
    ]
    values = Values("a.txt", "GRBL")
    values.store_travel(axes(0, 0, 0), axes(1, 1, 1))
    assert values.notes == []


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (0, 0, "the travel of y ends at 0 mm, not above its start, 0 mm (line 3)"),
        (5, 4.5, "the travel of y ends at 4.5 mm, not above its start, 5 mm (line 3)"),
        (0, 100_001, "travel.max of y is 100001 mm, more than any machine has, 100000 mm (line 3); correct it first"),
        (-100_001, 0, "travel.min of y is -100001 mm, more than any machine has, 100000 mm (line 3); correct it first"),
    ],
)
def test_a_travel_that_no_machine_has_is_refused(low: float, high: float, words: str) -> None:
    assert refusal(lambda values: values.store_travel(axes(0, low, 0), axes(1, high, 1))) == f"a.txt: {words}"


@pytest.mark.parametrize(
    ("travel", "position", "home", "how", "moved"),
    [
        (((-9, -9, -9), (0, 0, 0)), axes(0, 0, 0), "0 mm", TAKEN, False),
        (((-9, -9, -9), (0, 0, 0)), axes(1, -10, -5), ["0 mm", "-9 mm", "-5 mm"], DERIVED, True),
        (((-9, -8, -7), (0, 0, 0)), axes(-9, -8, -8, derived=True), ["-9 mm", "-8 mm", "-7 mm"], DERIVED, True),
        (((-9, -8, -7), (0, 0, 0)), axes(-9, -8, -7, derived=True), ["-9 mm", "-8 mm", "-7 mm"], DERIVED, False),
        (((-INF, -9, -9), (INF, 0, 0)), axes(99, 1, 1, assumed=True), ["99 mm", "0 mm", "0 mm"], ASSUMED, True),
        (None, axes(1, 2, 3), ["1 mm", "2 mm", "3 mm"], TAKEN, False),
    ],
)
def test_home_lies_within_the_travel(
    travel: tuple[tuple[float, ...], tuple[float, ...]] | None,
    position: Axes,
    home: object,
    how: ValueOrigin,
    moved: bool,
) -> None:
    def act(values: Values) -> None:
        if travel:
            values.store_travel(*(Axes(side, "mm", "line 1") for side in travel))
        values.store_home(position)

    assert stored(act)[-1] == ("home", home, how, "line 3; moved into the travel" if moved else "line 3")


@pytest.mark.parametrize(
    ("highest", "lowest", "kept"),
    [
        (900, 0, ["900 rpm"]), (900, 900, ["900 rpm", "900 rpm"]), (500_000, 1, ["500000 rpm", "1 rpm"]),
        (500_001, 0, "0 to 500001"), (0, 0, "0 to 0"), (900, -1, "-1 to 900"), (900, 901, "901 to 900"),
    ],
)  # fmt: skip
def test_speeds_of_the_spindle_are_kept_or_refused(highest: float, lowest: float, kept: list[str] | str) -> None:
    def act(values: Values) -> None:
        values.store_spindle_range(highest, lowest, "line 3")

    if isinstance(kept, list):
        keys = ["spindle.max_speed", "spindle.min_speed"]
        assert stored(act) == [(key, value, TAKEN, "line 3") for key, value in zip(keys, kept, strict=False)]
    else:
        assert refusal(act) == f"a.txt: the spindle turns {kept} rpm (line 3); correct it first"


def test_what_a_file_does_not_tell_is_an_estimate() -> None:
    assert stored(lambda values: values.store_manual_tool_changes("no changer")) == [
        ("tool_change.automatic", False, ASSUMED, "no changer"),
        ("tool_change.time", "60 s", ASSUMED, "a practised operator, including setting Z again"),
    ]
    assert stored(lambda values: values.store_process(Head.LASER, "line 1")) == [
        ("process", "laser", DERIVED, "line 1")
    ]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        (" 5 ", 5), ("-5.", -5), ("+.5e1 mm", 5), ("1,5", 1), ("1e-3", 0.001), ("2E+2;x", 200), ("3.25.1", 3.25),
        ("x1", "$1 is 'x1', but must be a number"), ("", "$1 is '', but must be a number"),
        ("1e999", "$1 is 1e999, which no machine has"), (".", "$1 is '.', but must be a number"),
        ("a" * 40, f"$1 is '{'a' * 29}…', but must be a number"),
    ],
)  # fmt: skip
def test_a_number_may_have_a_comment_after_it(text: str, value: float | str) -> None:
    if isinstance(value, str):
        assert refusal(lambda values: parse_leading_number(values, text, "$1", 7)) == f"a.txt:7: {value}"
    else:
        assert parse_leading_number(Values("a", "b"), text, "$1") == value


def test_numbers_and_lines_are_written_shortly() -> None:
    assert format_with_unit(0.1 + 0.2, "mm") == "0.3 mm" and format_with_unit(-INF, "mm") == "unknown"
    assert format_with_unit(1234567890123, "mm") == "1.23456789e+12 mm"
    assert (format_axes((1, 1, 1), "s"), format_axes((1, 1, 2), "s")) == ("1 s", ["1 s", "1 s", "2 s"])
    assert [
        format_line_numbers(lines) for lines in ([3], [3, 3], [4, 3], [5, 3, 4], [3, 5, 7], [3, 4, 6], [1, 2, 3, 4])
    ] == [
        "line 3",
        "line 3",
        "lines 3 and 4",
        "lines 3 to 5",
        "lines 3, 5 and 7",
        "lines 3, 4 and 6",
        "lines 1 to 4",
    ]
