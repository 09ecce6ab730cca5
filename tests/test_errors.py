"""Every error is one tree, one line, and names the nearest thing there is."""

from __future__ import annotations

import pytest

from leafcut import errors
from leafcut.errors import (
    LONGEST_QUOTE,
    LeafcutError,
    OptionError,
    PlanError,
    PostError,
    ReadError,
    name_suggestion,
    printable,
)
from leafcut.files.whole_files import OutputError
from leafcut.message import Message


def test_every_error_is_a_leafcut_error() -> None:
    kinds = [k for k in vars(errors).values() if isinstance(k, type) and issubclass(k, Exception)]
    assert len(kinds) >= 7
    assert all(issubclass(k, LeafcutError) for k in [*kinds, OutputError])
    assert issubclass(OptionError, ValueError)


def test_a_read_error_names_file_and_line() -> None:
    assert str(ReadError("a.dxf", "is empty")) == "a.dxf: is empty"
    problem = ReadError("a.nc", "G7 is not understood", 12)
    assert str(problem) == "a.nc:12: G7 is not understood"
    assert (problem.file, problem.line, problem.reason) == ("a.nc", 12, "G7 is not understood")


@pytest.mark.parametrize("word", ["\\" * 500, "a/b" * 200, "x" * 500])
def test_a_long_word_is_cut_also_where_a_message_may_be_longer(word: str) -> None:
    """Messages of other libraries repeat words of the file: only these words are cut."""
    said = printable(f"Unknown type: '{word}' in line 3", 120)
    assert max(map(len, said.split())) <= LONGEST_QUOTE
    assert said.startswith("Unknown type: '")
    assert said.endswith("in line 3")


@pytest.mark.parametrize(
    "name, end",
    [
        ("has-vf2", "; did you mean 'Haas-VF2'?"),
        ("HAAS-VF2", "; did you mean 'Haas-VF2'?"),
        ("kerfs", "; choose one of Haas-VF2, grbl"),
        ("zzzz", "; choose one of Haas-VF2, grbl"),
        ("", "; choose one of Haas-VF2, grbl"),
    ],
)
def test_an_unknown_name_gets_the_nearest_or_the_list(name: str, end: str) -> None:
    assert name_suggestion(name, ["Haas-VF2", "grbl"]) == end


def test_a_long_list_of_names_is_not_printed() -> None:
    names = [f"{letter}{number}" for letter in "abcdefgh" for number in range(20)]
    assert name_suggestion("zzzz", names) == ""
    assert name_suggestion("a1", names) == "; did you mean 'a1'?"


def test_an_error_is_a_template_with_values_or_an_unchanged_text() -> None:
    error = PlanError("tool {} of {:.3g} mm is {}", 3, 2.0, Message("too long"))
    assert str(error) == "tool 3 of 2 mm is too long"
    assert isinstance(str(error), Message)
    assert str(error).template == "tool {} of {} mm is {}"  # type: ignore[attr-defined]
    assert str(PlanError("{} is a brace")) == "{} is a brace"
    assert PostError("section {} is wrong", 2, section=1).section == 1
