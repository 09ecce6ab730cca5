"""Parameters of programs and blocks with computed words, compared whole with values worked by hand."""

from __future__ import annotations

import math

import pytest

from leafcut.gcode.expressions import BlockReading, ProgramParameters, Scanner, read_block, words_without_evaluation
from leafcut.gcode.words import BlockError

NAN = math.nan


def value_of(text: str, parameters: ProgramParameters | None = None) -> float:
    scanner = Scanner(text, parameters or ProgramParameters())
    value = scanner.parse_value()
    assert scanner.at_end()
    return value


def reading(line: str, **given: object) -> BlockReading:
    return read_block(line, 3, ProgramParameters(**given))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("[7 / 2]", 3.5),
        ("[1.00009 EQ 1]", 1.0),
        ("[1.00011 EQ 1]", 0.0),
        ("[1.00009 NE 1]", 0.0),
        ("[1.00011 NE 1]", 1.0),
        ("[2 GT 2]", 0.0),
        ("[3 GT 2]", 1.0),
        ("[2 GE 2]", 1.0),
        ("[1 GE 2]", 0.0),
        ("[2 LT 2]", 0.0),
        ("[1 LT 2]", 1.0),
        ("[2 LE 2]", 1.0),
        ("[3 LE 2]", 0.0),
        ("[2 AND 0.5]", 1.0),
        ("[2 AND 0]", 0.0),
        ("[0 AND 2]", 0.0),
        ("[0 OR 0]", 0.0),
        ("[0.5 OR 0]", 1.0),
        ("[0 OR 0.5]", 1.0),
        ("[2 XOR 3]", 0.0),
        ("[2 XOR 0]", 1.0),
        ("[0 XOR 2]", 1.0),
        ("[7 MOD -3]", 1.0),
        ("[-7 MOD -3]", 2.0),
        ("[6 MOD 3]", 0.0),
        ("[1 - 2 GT 0]", 0.0),
        ("[2 * 3 MOD 4]", 2.0),
        ("[1 GT 0 EQ 1]", 1.0),
        ("[0 AND 1 OR 1]", 1.0),
        ("[2 + 3 * 2 ** 2]", 14.0),
        ("[8 / 2 / 2]", 2.0),
        ("[8 - 2 - 2]", 4.0),
        ("ABS[-2]", 2.0),
        ("ACOS[0.5]", 60.0),
        ("ASIN[0.5]", 30.0),
        ("ATAN[-1] / [1]", -45.0),
        ("COS[60]", 0.5),
        ("SIN[30]", 0.5),
        ("TAN[45]", 1.0),
        ("EXP[1]", math.e),
        ("LN[2]", math.log(2)),
        ("FIX[2.7]", 2.0),
        ("FIX[-2.7]", -3.0),
        ("FUP[2.2]", 3.0),
        ("FUP[-2.2]", -2.0),
        ("ROUND[2.5]", 3.0),
        ("ROUND[2.4]", 2.0),
        ("ROUND[-2.4]", -2.0),
        ("SQRT[2.25]", 1.5),
        ("--3", 3.0),
        ("+-3", -3.0),
        ("- #1", -4.0),
        ("##2", 4.0),
        ("#[1 + 0.00009]", 4.0),
        ("#<A B>", 6.0),
        ("EXISTS[#<ab>]", 1.0),
        ("exists [ # < ab > ]", 1.0),
        ("EXISTS[#<cd>]", 0.0),
        ("EXISTS[#<_cd>]", NAN),
        ("EXISTS[#<_ef>]", 1.0),
    ],
)
def test_a_value_is_as_worked_by_hand(text: str, value: float) -> None:
    parameters = ProgramParameters(numbered={1: 4.0, 2: 1.0}, local={"ab": 6.0}, shared={"_ef": 1.0})
    assert value_of(text, parameters) == pytest.approx(value, nan_ok=True)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("X[1/0]", "/ of 1 and 0 has no value"),
        ("XSQRT[-1]", "SQRT of -1 has no value"),
        ("XATAN[3]", "ATAN needs two arguments: ATAN[…]/[…]"),
        ("XEXISTS[3]", "EXISTS needs a name: EXISTS[#<name>]"),
        ("XEXISTS[#<a>", "an expression is not closed: ']' is missing"),
        ("X[1", "an expression is not closed: ']' is missing"),
        ("X[1 2]", "a value is expected, not '2]'"),
        ("X[]", "a value is expected, not ']'"),
        ("X[1+", "a value is missing at the end of the line"),
        ("X[ABC[1]]", "a value is expected, not 'ABC[1]]'"),
        ("X[SIN 3]", "'[' is expected"),
        ("X#<a", "a parameter name is not closed: '>' is missing"),
        ("X#<a>", "#<a> is used, but the program does not set it before"),
        ("X#2.5", "#2.5: the number of a parameter must be a whole number"),
        ("X#[0-1]", "#-1: the number of a parameter must be a whole number"),
        ("X#100000", "#100000: the number of a parameter must be a whole number"),
        ("#1 5", "'5': '=' is expected after a parameter; if # starts a comment, put it in ( )"),
        ("#<_hal[x]>=5", "#<_hal[x]> cannot be set"),
        ("#<_ini[a]b>=5", "#<_ini[a]b> cannot be set"),
        ("#<own>=5", "#<own> cannot be set"),
        ("X" + "[" * 41 + "1" + "]" * 41, "an expression has more than 40 nested brackets"),
        ("]X1", "unexpected character ']'"),
        ("= X1", "unexpected character '='"),
        ("X[1" + "0" * 400 + "]", f"'1{'0' * 58}…' exceeds the number range of controllers"),
    ],
)
def test_a_block_without_a_value_is_refused_with_the_reason(line: str, message: str) -> None:
    with pytest.raises(BlockError) as refused:
        reading(line, known=lambda name: 1.0 if name == "own" else None)
    assert str(refused.value) == message


def test_forty_brackets_and_the_last_parameter_are_understood() -> None:
    assert value_of("[" * 40 + "1" + "]" * 40) == 1.0
    assert math.isnan(value_of("#99999")) and math.isnan(value_of("#0"))


@pytest.mark.parametrize(
    ("line", "words", "settings", "computed", "of_machine"),
    [
        ("G1 X[1+2] Y3.50", ["G1", "X3.", "Y3.50"], [], True, False),
        ("g1x#1y-#1", ["G1", "X2.5", "Y-2.5"], [], True, False),
        ("X[1/3]", ["X0.3333333333"], [], True, False),
        ("#5=[#1*2] #<B c>=#1", [], [(5, 5.0), ("bc", 2.5)], True, False),
        ("#4999=1", [], [(4999, 1.0)], True, False),
        ("#5000=1", [], [(5000, 1.0)], True, True),
        ("#5=3 X1", ["X1"], [(5, 3.0)], True, False),
        ("@5 ^3 $0", ["@5", "^3", "$0"], [], False, False),
        ("X1 (a) Y2 (b)", ["X1", "Y2"], [], False, False),
        ("/X#1", ["X2.5"], [], True, False),
        ("/2 X#1", ["X2.5"], [], True, False),
        ("/X1 (a) (b)", ["X1"], [], False, False),
        ("#[#900]=7", [], [(-1, 7.0)], True, False),
    ],
)
def test_a_block_has_its_words_and_settings(
    line: str, words: list[str], settings: list[object], computed: bool, of_machine: bool
) -> None:
    found = reading(line, numbered={1: 2.5})
    assert [str(word) for word in found.block.words] == words
    assert (found.settings, found.computed, found.of_machine) == (settings, computed, of_machine)
    assert found.block.line == 3
    assert found.block.deleted is line.startswith("/")
    assert found.block.percent is None


def test_comments_and_percent_signs_of_computed_lines_are_kept() -> None:
    assert reading("X#1 (a) ; b", numbered={1: 1.0}).block.comments == ("a", "b")
    assert reading("X1 (a) (b)").block.comments == ("a", "b")
    percent = reading("% a (x) (y)").block
    assert (percent.percent, percent.words, percent.comments) == ("a", (), ("x", "y"))
    assert reading("%").block.percent == ""


def test_a_reading_is_unknown_if_any_of_its_numbers_is() -> None:
    assert not reading("X1").has_unknown
    assert not reading("X#1", numbered={1: 1.0}).has_unknown
    assert reading("X#1").has_unknown
    assert reading("#2=#1").has_unknown
    assert reading("#5001=1").has_unknown
    assert not reading("#2=1").has_unknown


def test_fanuc_computes_without_brackets_and_has_its_own_parameters_from_1000() -> None:
    assert reading("#5=#1+2*3", numbered={1: 1.0}, fanuc=True).settings == [(5, 7.0)]
    assert reading("#1000=1", fanuc=True).of_machine and not reading("#999=1", fanuc=True).of_machine
    with pytest.raises(BlockError):
        reading("#5=#1+2", numbered={1: 1.0})
    parameters = ProgramParameters(fanuc=True)
    for key in (999, 1000):
        parameters.set_parameter(key, 1.0)
    assert parameters.numbered == {999: 1.0}


def test_parameters_are_set_forgotten_and_told_apart() -> None:
    parameters = ProgramParameters()
    assert parameters.digest() == ""
    for key, value in ((1, 2.0), (31, 3.0), (4999, 4.0), (5000, 5.0), ("a", 6.0), ("_b", 7.0)):
        parameters.set_parameter(key, value)
    assert parameters.numbered == {1: 2.0, 31: 3.0, 4999: 4.0}
    assert (parameters.local, parameters.shared) == ({"a": 6.0}, {"_b": 7.0})
    one = parameters.digest()
    assert (
        len(one) == 16
        and one
        == ProgramParameters(numbered={31: 3.0, 4999: 4.0, 1: 2.0}, local={"a": 6.0}, shared={"_b": 7.0}).digest()
    )
    parameters.set_parameter("a", 6.5)
    assert parameters.digest() != one
    assert not parameters.asked and parameters.asks == 0
    assert parameters.numbered_value(31) == 3.0 and parameters.named_value("a") == 6.5 and not parameters.asked
    assert math.isnan(parameters.numbered_value(7)) and math.isnan(parameters.named_value("_c")) and parameters.asked
    assert parameters.asks == 2
    parameters.set_parameter(-1, 1.0)
    assert sorted(parameters.numbered) == list(range(1, 31))
    assert all(map(math.isnan, parameters.numbered.values())) and parameters.local == {"a": 6.5}
    parameters.forget_values()
    assert parameters.shared == {} and math.isnan(parameters.local["a"])
    for part in ({"numbered": {1: 1.0}}, {"shared": {"_a": 1.0}}, {"local": {"a": 1.0}}):
        assert ProgramParameters(**part).digest()


def test_arguments_of_a_subroutine_are_zero_until_they_are_set() -> None:
    inside = ProgramParameters(inside=True, known=lambda name: 9.0 if name == "31" else None)
    assert [inside.numbered_value(number) for number in (1, 30, 31)] == [0.0, 0.0, 9.0]
    assert math.isnan(inside.numbered_value(0)) and math.isnan(inside.numbered_value(32))
    assert math.isnan(ProgramParameters().numbered_value(1))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("G1 X1.50 Y-.5 F#1", [("G", "1"), ("X", "1.50"), ("Y", "-.5"), ("F", "#1")]),
        ("x[#1 + 2] (a) z-#2", [("X", "[#1 + 2]"), ("Z", "-#2")]),
        ("XSIN[#1]", [("X", "SIN[#1]")]),
        *((f"{letter}#1", [(letter, "#1")]) for letter in "XYZIJKRFSQP"),
        *((f"{letter}#1", None) for letter in "GMNTHDLEABCUVWO"),
        ("#1=5", None),
        ("X1 #1=5", None),
        ("X[1", None),
        ("", []),
    ],
)
def test_computed_words_keep_their_text(line: str, words: list[tuple[str, str]] | None) -> None:
    """Only lengths, feeds, speeds and times may be computed."""
    found = words_without_evaluation(line)
    assert (None if found is None else [(word.letter, word.text) for word in found]) == words
