"""Tokenising lines into words."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import PostError
from leafcut.gcode.words import (
    BlockError,
    Word,
    has_nested_comment,
    numbered_lines,
    parse_block,
    parse_plain_block,
    remove_word,
    split_line,
)
from leafcut.post.words import NumberFormat, format_number


def pairs(line: str) -> list[tuple[str, float]]:
    """Return the words of a line as (letter, number)."""
    return [(w.letter, w.value) for w in parse_block(line).words]


@pytest.mark.parametrize(
    "line, words",
    [
        ("G0 X1.5 Y-2", [("G", 0), ("X", 1.5), ("Y", -2)]),
        ("n10g1x.5y+3.f100", [("N", 10), ("G", 1), ("X", 0.5), ("Y", 3), ("F", 100)]),
        ("G00X 1.0\tY\t-0.25", [("G", 0), ("X", 1), ("Y", -0.25)]),
        ("O0001 (plate)", [("O", 1)]),
        ("X1e5", [("X", 1), ("E", 5)]),
        ("G1 (over (", None),
        ("", []),
        ("   ", []),
        ("(only words)", []),
        ("; G1 X5", []),
        ("G0 X1 (a;b) Y2 ; c (d", [("G", 0), ("X", 1), ("Y", 2)]),
    ],
)
def test_a_line_is_split_into_letters_and_numbers(line: str, words: list | None) -> None:
    """Case and spaces between words do not matter."""
    if words is None:
        with pytest.raises(BlockError):
            parse_block(line)
    else:
        assert pairs(line) == words


def test_comments_slash_and_percent_are_kept_apart_from_words() -> None:
    """A comment, the block-delete slash and the percent sign are marks of the block, not words."""
    block = parse_block("/N5 G0 X1 (go; there) ; fast", 7)
    assert (block.line, block.deleted, block.comments) == (7, True, ("go; there", "fast"))
    assert parse_block("%").percent == ""
    assert parse_block(" %PLATE,MX,").percent == "PLATE,MX,"
    assert parse_block("G0 X1").percent is None


@pytest.mark.parametrize(
    "line, reason",
    [
        ("G1 X1 (open", "not closed"),
        ("G1 X1 (a (b) c)", "a comment contains another comment"),
        ("G1 X1) Y2", "')' without '('"),
        ("G1 X", "letter without a number"),
        ("G1 X--5", "letter without a number"),
        ("G1 X.", "letter without a number"),
        ("G1 X1 0", "number without a letter"),
        ("G1 X1.2.3", "number without a letter"),
        ("#1=5", "parameters"),
        ("G1 X[1+2]", "letter without a number"),
        ("G1 Xé", "letter without a number"),
        ("\x00\x01", "unexpected character"),
        ("G1 X٣", "letter without a number"),
        ("X" + "9" * 400, "out of range"),
        ("X" + "1" * 20_000, "20001 characters"),
    ],
)
def test_what_is_not_a_word_is_refused_with_its_reason(line: str, reason: str) -> None:
    """Each malformed line has a message of a single short line."""
    with pytest.raises(BlockError) as caught:
        parse_block(line)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 200


@settings(max_examples=settings().max_examples * 5)
@given(st.text(max_size=60))
def test_any_text_is_words_or_a_refusal(text: str) -> None:
    """Nothing else than a block or a BlockError comes out, and every number is finite."""
    try:
        block = parse_block(text)
    except BlockError:
        return
    assert all(isinstance(w, Word) and math.isfinite(w.value) for w in block.words)


@settings(max_examples=settings().max_examples * 5)
@given(st.lists(st.tuples(st.sampled_from("GXYZFST"), st.integers(-99999, 99999)), max_size=8))
def test_written_words_are_read_back(words: list[tuple[str, int]]) -> None:
    """Any words of letters and numbers with three decimals are unchanged."""
    line = "".join(f"{letter}{number / 1000:.3f}" for letter, number in words)
    assert pairs(line) == [(letter, number / 1000) for letter, number in words]


def test_all_three_line_ends_count() -> None:
    """Line numbers agree with an editor, whatever system wrote the file; a form feed does not end a line."""
    assert list(numbered_lines("a\r\nb\rc\nd\x0ce")) == [(1, "a"), (2, "b"), (3, "c"), (4, "d\x0ce")]


@pytest.mark.parametrize(
    "value, decimals, point, text",
    [
        (0.0, 3, False, "0"),
        (-0.0004, 3, False, "0"),
        (-0.0004, 3, True, "0."),
        (10.0, 3, True, "10."),
        (10.0, 0, False, "10"),
        (100.0, 0, True, "100."),
        (0.0015, 3, False, "0.002"),
        (1234.5678, 3, False, "1234.568"),
        (-0.5, 4, True, "-0.5"),
        (1e-9, 4, False, "0"),
    ],
)
def test_numbers_have_fixed_decimals_and_no_minus_zero(value: float, decimals: int, point: bool, text: str) -> None:
    """No exponent, no needless zeros, a decimal point where one is asked for."""
    assert format_number(value, decimals, point) == text


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e7])
def test_numbers_that_no_machine_can_go_to_are_refused(value: float) -> None:
    """NaN, infinity and kilometres are errors, not words."""
    with pytest.raises(PostError):
        format_number(value, 3)


@settings(max_examples=settings().max_examples * 5)
@given(st.floats(-1e5, 1e5), st.booleans())
def test_a_length_is_written_within_half_of_its_last_decimal(mm: float, inch: bool) -> None:
    """The value differs by at most half of the last decimal."""
    numbers = NumberFormat(inch, 4 if inch else 3, True)
    assert abs(numbers.rounded(mm) - mm) <= numbers.resolution / 2 + 1e-9
    assert "." in numbers.format_length(mm) and "e" not in numbers.format_length(mm)


def test_a_feed_of_nothing_cannot_be_written() -> None:
    """A cut with no feed, or one that rounds to nothing, is an error."""
    numbers = NumberFormat(False, 3, False)
    assert numbers.format_feed(2.0) == "120"
    assert NumberFormat(True, 4, False).format_feed(25.4) == "60"
    for feed in (0.0, 1e-6, -1.0):
        with pytest.raises(PostError):
            numbers.format_feed(feed)


@pytest.mark.parametrize(
    ("line", "rest"),
    [
        ("G1 X1 F#<w>", "G1 X1  "),
        ("(F#<w>) G1 F#<w> X1", "(F#<w>) G1   X1"),
        ("G1 F#<w> (F#<w>)", "G1   (F#<w>)"),
        ("(F#<w>) G1", None),
        ("G1 ; F#<w>", None),
        ("(a;b) F#<w>", "(a;b)  "),
        ("G1", None),
    ],
)
def test_a_word_of_the_controller_is_removed_from_the_code_and_not_from_comments(line: str, rest: str | None) -> None:
    assert remove_word(line, "F#<w>") == rest
    assert remove_word(line, "") is None


TOO_LARGE = "out of range: 1,000,000,000 or more; correct or delete this word, or post the program again"


@pytest.mark.parametrize(
    ("line", "nested"),
    [("(a (b) c)", True), ("(a) (b)", False), ("(a", False), ("(a) ; (b (c))", False), ("G0 (a ; (b))", True)],
)
def test_a_comment_inside_a_comment_is_noticed(line: str, nested: bool) -> None:
    assert has_nested_comment(line) is nested


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("G1 X1 (open", "a comment is not closed: ')' is missing"),
        ("G1 X1 (a (b) c)", "a comment contains another comment"),
        ("G1 X1) Y2", "')' without '(' before it"),
        ("G1 X--5", "'X--5' is a letter without a number"),
        ("G1 Y5 Xabcdefghijklmnopq", "'Xabcdefghijk' is a letter without a number"),
        ("G1 X\u00e9\u00e9 Y", "'X Y' is a letter without a number"),
        ("G1 X1 0", "'0' is a number without a letter"),
        ("G1 X1 -.5Y2", "'-.5Y2' is a number without a letter"),
        ("#1=5", "'#': parameters and expressions are not understood"),
        ("X1 <a>", "'<': parameters and expressions are not understood"),
        ("X1 \u00e9", "unexpected character '\\xe9'"),
        (":A", "unexpected character ':'"),
        ("X" + "1" * 10_000, "the line has 10001 characters; this is not G-code"),
        ("x1000000000", f"the number of X is {TOO_LARGE}"),
        ("X-1000000000", f"the number of X is {TOO_LARGE}"),
    ],
)  # fmt: skip
def test_a_line_is_refused_with_one_text(line: str, reason: str) -> None:
    with pytest.raises(BlockError) as caught:
        parse_block(line)
    assert str(caught.value) == reason


def test_marks_and_comments_are_no_words() -> None:
    assert pairs(":12 G1") == [("O", 12), ("G", 1)]
    assert pairs("/G1 X999999999.9") == [("G", 1), ("X", 999999999.9)]
    assert pairs("$1") == [("$", 1)]
    assert split_line(" G1 (a (b) c) ; d ", nested=True) == ("G1", ("a  b  c", "d"))
    assert split_line("G1 ((a)) (b)", nested=True) == ("G1", ("a", "b"))
    assert split_line("G1 ;(a (b", nested=True) == ("G1", ("a (b",))
    assert parse_plain_block("G1 X1 (a)\r\n") == parse_block("G1 X1 (a)")
    assert parse_plain_block("G1 X#1") is None
    words = [parse_block(line).deleted for line in ("/G1", "G1", " /G1")]
    assert words == [True, False, True]
    assert (str(parse_block("x01.50").words[0]), parse_block("G1").line) == ("X01.50", 0)
