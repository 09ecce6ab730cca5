"""A plain command line says what the parser takes it to say, and what is not plain is left to the parser."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial, wraps
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from leafcut import cli
from leafcut.usage import DASH, HELD

#: What may be behind a flag, or an input: some of it means something to parsers.
VALUES = (
    "part.dxf", "none", "None", "null", "true", "0", "3mm", "1e3", "a,b", "[1]", '["a"]', "{}", '{"a": 1}', "~", " x ",
    "ü", "a b", "a=b", "@file", "$HOME", "", "-", "-3", "--", "drill", "optimize", "'q'", '"q"', "\\", "a\nb", "*.dxf",
)  # fmt: skip
FLAGS = (
    "--output", "-o", "--report", "--machine", "--thickness", "--json", "--quiet", "-q", "--no-json", "--no-defaults",
    "--options", "--process", "--layers", "--seed", "--bound", "--no-bound", "--strict", "--no-strict", "--preset",
    "--time-limit", "--tour", "--dialect", "--same-as", "--workers", "--every", "--bogus", "--help", "-h", "--Machine",
    "--machine=haas-vf2", "--json=true", "--objective", "--tools", "--sheet", "--kerf", "-oq", "--no-machine", "-j",
)  # fmt: skip
VALUE_FLAGS = (
    "--output", "-o", "--report", "--machine", "--thickness", "--layers", "--seed", "--preset", "--options", "--tour",
)  # fmt: skip
COMMANDS = (
    "optimize", "drill", "cut", "pocket", "nest", "filter", "batch", "watch", "solve", "simulate", "stock", "verify",
    "cutting-data", "machines", "lab", "",
)  # fmt: skip

Call = tuple[str, tuple[Any, ...], dict[str, Any]]
Read = Callable[[Sequence[str]], Call | None]


@pytest.fixture(scope="module")
def readers() -> Iterator[tuple[Read, Read]]:
    """Tell what a line calls by itself, and what it calls when the parser reads it; None where it calls nothing."""
    calls: list[Call] = []

    def noting(name: str, function: Callable[..., int]) -> Callable[..., int]:
        @wraps(function)
        def note(*places: Any, options: dict[str, Any], **own: Any) -> int:
            named = {key: value for key, value in options.items() if value is not None}
            calls.append((name, places, {**own, "options": named}))
            return 0

        return note

    def by_parser(words: Sequence[str]) -> int:
        try:
            return cli._parsed(words, [HELD if word == DASH else word for word in words])
        except Exception:  # it reads some lines wrongly that are none: a value that begins as a list does
            return -1

    def by_itself(words: Sequence[str]) -> int:
        plain = cli._plain([HELD if word == DASH else word for word in words])
        return plain() if plain else -1

    def called(read: Callable[[Sequence[str]], int], words: Sequence[str]) -> Call | None:
        calls.clear()
        read(words)
        return calls[-1] if calls else None

    real = [(name, noting(name, function), *rest) for name, function, *rest in cli._working_commands()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cli, "_working_commands", lambda: iter(real))
        yield partial(called, by_itself), partial(called, by_parser)


PLAIN: tuple[list[str], ...] = (
    ["drill", "part.dxf"],
    ["optimize", "a.dxf", "-o", "-", "--machine", "haas-vf2"],
    ["optimize", "-", "--output", "b.nc", "--no-bound", "--json"],
    ["cut", "a.dxf", "b.dxf", "--layers", "a,b", "-q", "--report", "r"],
    ["verify", "a.nc", "b.nc", "--dialect", "linuxcnc"],
    ["simulate", "a.nc", "--machine", "grbl-3018"],
    ["solve", "random:200", "--seed", "7", "--no-defaults"],
    ["watch", "in", "-o", "out", "--every", "3s"],
)


@pytest.mark.parametrize("words", PLAIN, ids=" ".join)
def test_what_people_type_is_plain_but_for_workers(words: list[str], readers: tuple[Read, Read]) -> None:
    plain, parsed = (read(words) for read in readers)
    if words[0] == "watch":
        assert plain is None  # it may be told a number of workers
    else:
        assert plain is not None
        assert plain == parsed
    assert parsed is not None


WORDS = st.sampled_from(VALUES) | st.sampled_from(FLAGS)
#: Mostly plain, so that it is not the parser alone that is asked.
ALMOST = st.sampled_from(VALUES) | st.tuples(st.sampled_from(VALUE_FLAGS), st.sampled_from(VALUES))


@given(st.sampled_from(COMMANDS), st.lists(ALMOST, max_size=4) | st.lists(WORDS, max_size=5))
@example("stock", ["a.nc", "b.nc"])
def test_a_line_that_is_read_without_the_parser_is_read_as_the_parser_does(
    readers: tuple[Read, Read], command: str, rest: list[Any]
) -> None:
    words = [command, *(word for one in rest for word in ([one] if isinstance(one, str) else one))]
    by_itself, by_parser = readers
    plain = by_itself(words)
    if plain is not None:
        assert plain == by_parser(words)


def test_a_plain_line_does_not_load_the_parser(tmp_path: Any) -> None:
    code = """
import sys
from leafcut.cli import run
status = run(["drill", "example:plate-10", "-o", sys.argv[1], "--machine", "haas-vf2", "-q"])
print(status, *{"cyclopts", "ezdxf", "shapely", "numba", "numpy.ma"} & set(sys.modules))
"""
    for _ in ("compile what is not compiled yet, with Numba", "work"):
        done = subprocess.run(
            [sys.executable, "-c", code, str(tmp_path / "a.nc")], capture_output=True, text=True, check=True
        )
    assert done.stdout.split() == ["0"]
