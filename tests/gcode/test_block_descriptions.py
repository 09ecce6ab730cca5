"""Descriptions of blocks with unknown effects: equal only if all their inputs are equal."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from leafcut.gcode.block_description import (
    BlockDescription,
    RangeDigests,
    describe_block,
    digest_of_callable_text,
    may_read_parameters,
    normalize_line,
    significant_text,
)
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.words import parse_block

HAAS, LINUXCNC, FAGOR = load_dialect("haas"), load_dialect("linuxcnc"), load_dialect("fagor8055")


@pytest.mark.parametrize(
    ("line", "haas", "linuxcnc"),
    [
        ("N5 G65 P100 A5. B.50", "G65 P100 A5. B0.5.", "G65 P100 A5 B0.5"),
        ("O7 M98", "M98", "M98"),
        ("/g31 z-0.0", "/ G31 Z0.", "/ G31 Z0"),
        ("A0.3333333333333", "A0.333333333.", "A0.333333333"),
        ("A123456.123456789012", "A123456.123457.", "A123456.123457"),
        ("", "", ""),
    ],
)
def test_words_are_described_by_their_values(line: str, haas: str, linuxcnc: str) -> None:
    """With Fanuc, a number with a decimal point may mean another length."""
    assert describe_block(parse_block(line), [], None, "", HAAS) == BlockDescription(haas)
    assert describe_block(parse_block(line), [], None, "", LINUXCNC) == BlockDescription(linuxcnc)


def test_comments_and_digests_follow_the_words() -> None:
    block = replace(parse_block("G65 P1"), deleted=True)
    assert describe_block(block, ["MSG,  hi  you", "b"], "12", "ab", LINUXCNC) == BlockDescription(
        "/ G65 P1 MSG, hi you b", "12", "ab"
    )
    assert describe_block(block, [], "", "", LINUXCNC) == BlockDescription("/ G65 P1", "")


@pytest.mark.parametrize(
    ("left", "right", "names"),
    [
        (("1", "2", "3"), ("1", "2", "3"), []),
        (("1",), ("2",), ["a parameter that it may read has a different value"]),
        (("1",), (None,), ["a parameter that it may read has a different value"]),
        ((None, "1"), (None,), ["the text of a subprogram that it may call has changed"]),
        (
            ("1", "", "1"),
            ("2", "", "2"),
            ["a parameter that it may read has a different value", "the code that it may repeat has changed"],
        ),
    ],
)
def test_the_inputs_that_differ_are_named(left: tuple[str, ...], right: tuple[str, ...], names: list[str]) -> None:
    one, other = BlockDescription("G65", *left), BlockDescription("G65", *right)
    assert one.changed_inputs(other) == names == other.changed_inputs(one)


@pytest.mark.parametrize(
    ("words", "comments", "reads"),
    [
        ("M19", [], False),
        *((f"M{number}", [], False) for number in (48, 49, 50, 51, 52, 53, 60, 61, 62, 68, 190)),
        *((f"M{number}", [], True) for number in (18, 20, 47, 54, 59, 69, 70, 189, 191)),
        ("G65 M19", [], True),
        ("M19", ["a #1"], True),
        ("", ["50 %f"], True),
        ("", ["PYRUN, x"], True),
        ("", ["pyx"], True),
        ("", ["x py"], False),
        ("", [], False),
    ],
)
def test_a_macro_or_a_message_may_read_parameters(words: str, comments: list[str], reads: bool) -> None:
    assert may_read_parameters(parse_block(words).words, comments, LINUXCNC) is reads
    assert may_read_parameters(parse_block(words).words, comments, HAAS) is (reads or "M" in words)


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("N10 g0 X1 (note) ; more", "G0X1"),
        ("/N10 X1", "/X1"),
        ("/ n 7 X1", "/X1"),
        ("  x 1 . 5\t", "X1.5"),
        ("X1 N5", "X1N5"),
    ],
)
def test_numbers_comments_and_spaces_are_left_out(line: str, text: str) -> None:
    assert normalize_line(line) == significant_text(line, LINUXCNC) == text
    assert significant_text(line, FAGOR) == "".join(line.split()).upper()


def test_the_text_that_may_be_called_is_digested() -> None:
    def digest(text: str) -> str:
        return digest_of_callable_text(text.splitlines(), LINUXCNC)

    assert digest("G0 X1\nM2\n") == digest("") == digest("G0 X1\nM30 ; end\n%\n\n") == ""
    called = digest("G0 X1\nM2\nO7\nG1 X1\nM99\n")
    assert len(called) == 16
    # The text before the end, numbers, comments, blank lines and percent signs do not matter.
    assert called == digest("%\nG0 X2\nM02\n\no7\nN5 g1 x1 (a)\n%\nM99\n")
    assert called == digest("G0\nM30\nO7\nG1 X1\nM99") == digest("G0\nM99\nO7\nG1 X1\nM99")
    assert called == digest("%\nG0\n%\nO7\nG1 X1\nM99")
    assert called != digest("G0 X1\nM2\nO7\nG1 X2\nM99\n")
    assert called != digest("G0 X1\nM2\nO7\nM99\nG1 X1\n")
    # M20, M300 and M2.5 do not end a program.
    assert digest("M20\nG1 X1") == digest("M300\nG1 X1") == digest("M2.5\nG1 X1") == ""
    # A subroutine counts wherever it stands, and its own end word does not end the program.
    inside = digest("o1 sub\nG1 X1\nM2\no1 endsub\nG0 X1\nM2\n")
    assert inside and inside == digest("G0 X9\no1 sub\nG1 X1\nM2\no1 endsub\nM2\n")
    assert inside != digest("o1 sub\nG1 X2\nM2\no1 endsub\nG0 X1\nM2\n")
    assert inside == digest("O<a>sub\nG1 X1\nM2\nO<a> endsub\n".replace("<a>", "1"))
    nested = digest("o<a> sub\no2 sub\nG1 X1\no2 endsub\nG1 X2\no<a> endsub\nG0 X3\nM2\n")
    assert nested != digest("o<a> sub\no2 sub\nG1 X1\no2 endsub\nG1 X4\no<a> endsub\nG0 X3\nM2\n")
    assert nested == digest("o<a> sub\no2 sub\nG1 X1\no2 endsub\nG1 X2\no<a> endsub\nG0 X5\nM2\n")


def test_two_ranges_have_the_same_digest_only_if_their_lines_agree() -> None:
    """Empty lines do not count."""
    texts = random.Random(3).choices(["G0", "G1", "X1", ""], k=24)
    digests = RangeDigests(texts)
    ranges = [(first, last) for first in range(24) for last in range(first, 24)]
    kept = {(first, last): tuple(filter(None, texts[first : last + 1])) for first, last in ranges}
    found = {pair: digests.digest_of_lines(*pair) for pair in ranges}
    assert len(set(found.values())) == len(set(kept.values()))
    assert len({(found[pair], kept[pair]) for pair in ranges}) == len(set(kept.values()))
    assert all(found[pair].startswith(f"{len(kept[pair])}:") for pair in ranges)
    assert RangeDigests(["", "G1", "", "X1"]).digest_of_lines(0, 3) == RangeDigests(["G9", "G1", "X1"]).digest_of_lines(
        1, 2
    )
