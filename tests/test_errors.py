"""Every error is one tree, one line, and names the nearest thing there is."""

from __future__ import annotations

import pytest

from leafcut import errors
from leafcut.errors import LeafcutError, OptionError, ReadError, nearest
from leafcut.files import OutputError


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


@pytest.mark.parametrize(
    ("name", "end"),
    [
        ("has-vf2", "; did you mean 'Haas-VF2'?"),
        ("HAAS-VF2", "; did you mean 'Haas-VF2'?"),
        ("zzzz", "; there are: Haas-VF2, grbl"),
        ("", "; there are: Haas-VF2, grbl"),
    ],
)
def test_an_unknown_name_gets_the_nearest_or_the_list(name: str, end: str) -> None:
    assert nearest(name, ["Haas-VF2", "grbl"]) == end
