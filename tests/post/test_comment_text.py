"""Comments of a program, character by character, with expected texts worked by hand."""

from __future__ import annotations

import pytest

from leafcut.post.words import comment_lines, to_plain_ascii


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("a(b)c{d}e", "a[b]c[d]e"),
        ("20%", "20 pct"),
        ("?!~", "..-"),
        ("2×3", "2x3"),
        ("1–2—3", "1-2-3"),
        ("µm μm", "um um"),
        ("45°", "45 deg"),
        ("Ø3 ø4 ⌀5", "D3 d4 D5"),
        ("mm² mm³", "mm2 mm3"),
        ("2·b→c", "2,b->c"),
        # Wide letters become plain ones only after the decomposition, and are replaced then.
        ("（ａ）！？％～", "[a].. pct-"),
        ("Größe é", "Gro.e e"),
        ("tab\tand\nline\r\x00\x1f\x7fend", "tab and line .end"),
        ("  two   spaces ", "two spaces"),
        ("no-break\u00a0space", "no-break space"),
        ("1;b; c;", "1,b; c;"),
        ("1;;b", "1,,b"),
        ("[]<>=#$&*+,-./:@^_`|'\"", "[]<>=#$&*+,-./:@^_`|'\""),
        ("", ""),
    ],
)  # fmt: skip
def test_each_special_character_has_a_plain_replacement(text: str, plain: str) -> None:
    assert to_plain_ascii(text) == plain


@pytest.mark.parametrize(
    ("text", "plain"),
    [
        ("print, it", "print - it"),
        ("Part_A , b, c", "Part_A - b, c"),
        ("two words, b", "two words, b"),
        ("2a, b", "2a, b"),
        ("see: print, it", "see: print, it"),
        ("msg", "- msg"),
        ("msg_1", "msg_1"),
        ("o=1", "- o=1"),
        ("O =1", "- O =1"),
        ("no=1", "no=1"),
        ("abort, now", "abort - now"),
    ],
)
def test_a_comment_that_a_controller_would_obey_starts_differently(text: str, plain: str) -> None:
    assert to_plain_ascii(text) == plain


def test_comment_lines_fit_and_each_of_them_is_plain() -> None:
    """A line is at most 4 characters shorter than the width: parentheses, and "- " before an active word."""
    assert comment_lines("x" * 12, 16) == [f"({'x' * 12})"]
    assert comment_lines("x" * 13, 16) == [f"({'x' * 12})", "(x)"]
    assert comment_lines("six words that wrap before msg now", 30) == ["(six words that wrap before)", "(- msg now)"]
    assert comment_lines("Maß", 30) == ["(Ma.)"]
    assert comment_lines("Blech 2 mm", 30, uppercase=True) == ["(BLECH 2 MM)"]
    assert comment_lines("Blech 2 mm", 30, style=";") == ["; Blech 2 mm"]
    assert comment_lines("", 30) == ["()"]
    assert comment_lines("", 30, style=";") == [";"]
