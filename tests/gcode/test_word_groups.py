"""Words that exclude each other in a block, compared with the table of the RS274/NGC report and with manuals."""

from __future__ import annotations

from itertools import combinations

import pytest

from leafcut.gcode.word_groups import GROUP_OF, M_GROUP_OF, sort_words
from leafcut.gcode.words import BlockError, parse_block

#: One line for each group: RS274/NGC, table 4, with the words that LinuxCNC, Siemens (G500 …) and Fagor have beside.
G_GROUPS = [
    "G4 G10 G28 G28.1 G30 G30.1 G52 G53 G92 G92.1 G92.2 G92.3",
    "G0 G1 G2 G3 G5 G5.1 G5.2 G5.3 G33 G33.1 G38.2 G38.3 G38.4 G38.5",
    "G69 G73 G76 G80 G81 G82 G83 G84 G85 G86 G87 G88 G89",
    "G17 G18 G19", "G90 G91", "G90.1 G91.1", "G93 G94 G95", "G20 G21 G70 G71 G700 G710", "G40 G41 G41.1 G42 G42.1",
    "G43 G43.1 G43.2 G44 G49", "G98 G99", "G54 G55 G56 G57 G58 G59 G59.1 G59.2 G59.3", "G61 G61.1 G64", "G96 G97",
    "G290 G291",
]  # fmt: skip
M_GROUPS = ["M0 M1 M2 M30 M60 M226", "M6", "M3 M4 M5", "M7 M8 M9", "M62 M63 M64 M65 M66 M67 M68", "M52", "M190"]


def refusal(line: str, separate_cycles: bool = True) -> str:
    """Return the reason why a block is refused, or an empty text."""
    try:
        sort_words(parse_block(line), frozenset(GROUP_OF), frozenset(M_GROUP_OF), separate_cycles)
    except BlockError as problem:
        return str(problem)
    return ""


@pytest.mark.parametrize("group", [*G_GROUPS, *M_GROUPS])
def test_two_words_of_a_group_exclude_each_other(group: str) -> None:
    for one, other in combinations(group.split(), 2):
        together = refusal(f"{one} {other}")
        both_coolants = {one, other} == {"M7", "M8"}
        assert together == ("" if both_coolants else f"{one} and {other} exclude each other in one block")
    for word in group.split():
        assert refusal(f"{word} {word}") == ""


@pytest.mark.parametrize("groups", [G_GROUPS, M_GROUPS])
def test_words_of_different_groups_stand_together(groups: list[str]) -> None:
    for one, other in combinations(groups, 2):
        for word in one.split():
            assert refusal(f"{word} {other.split()[0]}") == ""


def test_the_groups_have_no_other_words() -> None:
    assert len(GROUP_OF) == len(" ".join(G_GROUPS).split())
    assert len(M_GROUP_OF) == len(" ".join(M_GROUPS).split())


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("G1 G81", "G1 and G81 exclude each other in one block"),
        ("G80 G38.2", "G38.2 and G80 exclude each other in one block"),
        ("X1 X2", "X is given twice: X1 and X2"),
        ("N1 N2 X1", ""),
        ("M7 M8 M7", ""),
        ("M8 M9 M7", "M8 and M9 exclude each other in one block"),
    ],
)
def test_a_block_that_contradicts_itself_is_refused(line: str, reason: str) -> None:
    assert refusal(line, separate_cycles=False) == reason


def test_the_words_of_a_block_are_sorted() -> None:
    block = parse_block("N5 G1 G90 X1 M8 M7 M3 S9 G22 M10 G1.05 M8.5 N6")
    sorted_block = sort_words(block, frozenset(GROUP_OF), frozenset(M_GROUP_OF), False)
    assert sorted_block.g == {"motion": 10, "distance": 900}
    assert sorted_block.m == {"coolant": [8, 7], "spindle": [3]}
    assert {letter: str(word) for letter, word in sorted_block.letters.items()} == {"N": "N5", "X": "X1", "S": "S9"}
    assert list(map(str, sorted_block.unknown)) == ["G22", "M10", "G1.05", "M8.5"]
    assert sort_words(parse_block("G1 G81"), frozenset(GROUP_OF), frozenset(), True).g == {"motion": 10, "cycle": 810}
