"""Parameters and expressions: values against Python's own arithmetic and against LinuxCNC's interpreter."""

from __future__ import annotations

import math
import random
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from leafcut.gcode.expressions import ProgramParameters, Scanner, read_block
from leafcut.gcode.words import BlockError
from rs274_moves import moves_of_rs274, run_rs274


def value_of(text: str, **named: float) -> float:
    """Return the value of a text."""
    scanner = Scanner(text, ProgramParameters(shared=named))
    value = scanner.parse_value()
    assert scanner.at_end()
    return value


NUMBERS = st.integers(-99, 99).map(lambda n: (f"{n / 4:g}", n / 4))
JOINED = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    " mod ": lambda a, b: a - abs(b) * math.floor(a / abs(b)),
    " gt ": lambda a, b: float(a > b),
    " LE ": lambda a, b: float(a <= b),
    " EQ ": lambda a, b: float(a == b),
    " and ": lambda a, b: float(bool(a) and bool(b)),
    " XOR ": lambda a, b: float(bool(a) != bool(b)),
}
CALLED = {
    "ABS": abs,
    "fix": math.floor,
    "FUP": math.ceil,
    "SIN": lambda a: math.sin(a * math.pi / 180),
    "Cos": lambda a: math.cos(a * math.pi / 180),
    "-": lambda a: -a,
}


def _join(children: st.SearchStrategy) -> st.SearchStrategy:
    pair = st.tuples(children, st.sampled_from(sorted(JOINED)), children)
    called = st.tuples(st.sampled_from(sorted(CALLED)), children)
    return pair.map(lambda t: (f"[{t[0][0]}{t[1]}{t[2][0]}]", _try(JOINED[t[1]], t[0][1], t[2][1]))) | called.map(
        lambda t: (f"{t[0]}[{t[1][0]}]", _try(CALLED[t[0]], t[1][1]))
    )


def _try(function, *arguments: float) -> float:
    if any(math.isnan(argument) for argument in arguments):  # a part of the expression has no value
        return math.nan
    try:
        return function(*arguments)
    except (ZeroDivisionError, ValueError):
        return math.nan


@settings(max_examples=settings().max_examples * 5)
@given(st.recursive(NUMBERS, _join, max_leaves=12))
def test_an_expression_in_brackets_has_the_value_that_python_gives_it(case: tuple[str, float]) -> None:
    """Whatever the nesting."""
    text, value = case
    assume(math.isfinite(value))
    assert math.isclose(value_of(text), value, rel_tol=1e-9, abs_tol=1e-9)


@pytest.mark.parametrize(
    "text, value",
    [
        ("[2 ** 3 ** 2]", 64.0),
        ("[1 + 2 * 3 - 4 / 2]", 5.0),
        ("[1 OR 0 AND 0]", 0.0),
        ("[1 + 1 EQ 2]", 1.0),
        ("[1 EQ 1.000001]", 1.0),
        ("ATAN[1]/[-1]", 135.0),
        ("ROUND[-2.5]", -3.0),
        ("FIX[-2.3]", -3.0),
        ("[-7 MOD 3]", 2.0),
        ("SQRT[16]", 4.0),
        ("LN[EXP[2]]", 2.0),
        ("[ACOS[0] + ASIN[1] - TAN[45]]", 179.0),
        ("#< _A b >", 7.0),
        ("EXISTS[#<_ab>]", 1.0),
        ("EXISTS[#<ba>]", 0.0),
        ("-[3]", -3.0),
        ("+#<_ab>", 7.0),
    ],
)
def test_operators_bind_as_in_linuxcnc(text: str, value: float) -> None:
    """From left to right, powers too; all comparisons on one level, all logic on the last."""
    assert value_of(text, _ab=7.0) == pytest.approx(value)


@pytest.mark.parametrize(
    "text",
    [
        "[1/0]",
        "SQRT[-1]",
        "LN[0]",
        "ACOS[2]",
        "[[-8]**0.5]",
        "EXP[1000]",
        "[1 MOD 0]",
        "[1 + 2",
        "[1 2]",
        "[]",
        "#",
        "#<a",
        "#<gone>",
        "#2.5",
        "SINUS[3]",
        "ATAN[3]",
        "EXISTS[3]",
        "[" * 60 + "1" + "]" * 60,
        "-" * 60 + "1",
        "#" * 60 + "1",
        "[9999999**9999999]",
        "[1" + "0" * 400 + "]",
        "#1" + "0" * 400,
        "[FIX[1" + "0" * 400 + "]]",
    ],
)
def test_what_has_no_value_is_refused_in_one_line(text: str) -> None:
    """An error of the block, never of Python."""
    with pytest.raises(BlockError) as caught:
        value_of(text)
    assert "\n" not in str(caught.value)


def test_a_block_with_settings_uses_the_old_values() -> None:
    """`#1=5 X#1` moves to the previous value of #1."""
    parameters = ProgramParameters(numbered={1: 3.0})
    block, settings, computed, of_machine = read_block("G1 #1=5 X#1 #<up>=[#1*2] Y-#1 (#9) ; #9", 1, parameters)
    assert [str(w) for w in block.words] == ["G1", "X3.", "Y-3."]
    assert settings == [(1, 5.0), ("up", 6.0)]
    assert computed and not of_machine


@pytest.mark.parametrize(
    "text",
    ["#7", "#0", "#5221", "#<_hal[pin]>", "#<_ini[axis_z]max>", "[#7 + 1]", "SIN[#7]", "##7", "[#7 EQ 1]", "-#7"],
)
def test_what_only_the_machine_knows_has_no_value_and_neither_has_what_comes_of_it(text: str) -> None:
    """Another program or the machine may have set it, so nothing is computed from a guess."""
    assert math.isnan(value_of(text))


def test_a_parameter_whose_number_is_not_known_may_be_any() -> None:
    """After an assignment to it, all parameters are unknown."""
    parameters = ProgramParameters(numbered={1: 3.0, 150: 4.0}, local={"a": 5.0})
    for key, value in read_block("#[#900]=7", 1, parameters).settings:
        parameters.set_parameter(key, value)
    assert (
        math.isnan(parameters.numbered_value(1))
        and math.isnan(parameters.numbered_value(150))
        and parameters.named_value("a") == 5.0
    )


def _random_expression(chance: random.Random, depth: int = 0) -> str:
    kind = chance.random()
    if depth > 3 or kind < 0.35:
        return chance.choice([f"{chance.randint(-40, 40) / 8:g}", "#1", "#<b>", "##2", "+2.5"])
    if kind < 0.8:
        signs = [
            "+",
            "-",
            "*",
            "/",
            "**",
            " MOD ",
            " EQ ",
            " NE ",
            " GT ",
            " GE ",
            " LT ",
            " LE ",
            " AND ",
            " OR ",
            " XOR ",
        ]
        terms = [_random_expression(chance, depth + 1)]
        for _ in range(chance.randint(1, 4)):
            terms += [chance.choice(signs), _random_expression(chance, depth + 1)]
        return f"[{''.join(terms)}]"
    name = chance.choice(
        ["ABS", "ACOS", "ASIN", "COS", "EXP", "FIX", "FUP", "LN", "ROUND", "SIN", "SQRT", "TAN", "ATAN"]
    )
    inner = f"{name}[{_random_expression(chance, depth + 1)}]"
    return inner + (f"/[{_random_expression(chance, depth + 1)}]" if name == "ATAN" else "")


def test_random_expressions_have_the_values_of_linuxcnc(rs274: str, tmp_path: Path) -> None:
    """Flat and nested, with all operators and functions, to the four decimals that rs274 prints."""
    chance = random.Random(5)
    parameters = ProgramParameters(numbered={1: 1.5, 2: 3.0, 3: -4.25}, local={"b": 0.75})
    cases: list[tuple[str, float]] = []
    while len(cases) < 400:
        text = f"[{_random_expression(chance)}]"
        try:
            value = Scanner(text, parameters).parse_value()
        except BlockError:
            continue
        if abs(value) < 1e4 and len(text) < 200:
            cases.append((text, value))
    # Every second move goes home, so that equal values in a row are moves, too.
    lines = [f"G0 X[20000+{text}]\nG0 X0" for text, _ in cases]
    program = "G21 G90\n#1=1.5 #2=3 #3=-4.25\n#<b>=0.75\n" + "\n".join(lines) + "\nM2\n"
    status, output = run_rs274(rs274, program, tmp_path)
    assert status == 0, output[-300:]
    theirs = [move[1] for move in moves_of_rs274(output)[::2]]
    assert len(theirs) == len(cases)
    for (text, value), other in zip(cases, theirs, strict=True):
        assert other - 20000.0 == pytest.approx(value, abs=2e-4), text
