"""How a difference is told to a person."""

from __future__ import annotations

import math

import pytest

from leafcut.proof.difference import place

NAN = math.nan


@pytest.mark.parametrize(
    "where, words",
    [
        ((1.0, 2.5, -3.0), "X1.000 Y2.500 Z-3.000"),
        ((1.0, 2.5), "X1.000 Y2.500"),
        ((1.0, 2.5, NAN), "X1.000 Y2.500 and an unknown Z"),
        ((NAN, 2.5, NAN), "Y2.500 and an unknown X and Z"),
        ((NAN, NAN, NAN), "an unknown position"),
        ((NAN, NAN), "an unknown position"),
    ],
)
def test_a_place_that_is_not_known_is_told_in_words(where: tuple[float, ...], words: str) -> None:
    assert place(*where) == words
