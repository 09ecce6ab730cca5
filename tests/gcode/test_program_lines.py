"""Lines of a program: their ends, a title above the percent sign, jumps that cannot be followed."""

from __future__ import annotations

import pytest

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program, split_lines


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("", []),
        ("G0", ["G0"]),
        ("G0\n", ["G0\n"]),
        ("G0\nG1", ["G0\n", "G1"]),
        ("G0\r\nG1\r\n", ["G0\r\n", "G1\r\n"]),
        ("G0\r\nG1\n\nG2", ["G0\r\n", "G1\n", "\n", "G2"]),
        ("G0\r", ["G0\r"]),
    ],
)
@pytest.mark.parametrize("name", ["linuxcnc", "haas", "grbl", "mach3"])
def test_a_text_is_split_at_its_line_feeds(text: str, lines: list[str], name: str) -> None:
    assert list(split_lines(text, load_dialect(name), "f")) == lines


def lone_returns(name: str, text: str) -> str:
    """Return the refusal of a text, or its lines."""
    try:
        return repr(split_lines(text, load_dialect(name), "f"))
    except ReadError as problem:
        return str(problem)


def test_a_carriage_return_alone_ends_a_line_only_where_the_controller_says_so() -> None:
    """LinuxCNC splits at line feeds alone; others differ, so a mixture is refused."""
    one_line = (
        "the lines end in a carriage return alone, so the controller reads them as a single line; "
        "save the file with LF line ends"
    )
    differs = (
        "the line contains a lone carriage return, and it depends on the controller whether that ends the "
        "line; save the file with LF line ends"
    )
    by_ends = {}
    for name in ("linuxcnc", "haas", "grbl", "mach3", "fanuc", "siemens", "marlin", "centroid"):
        by_ends.setdefault(load_dialect(name).line_ends, name)
    assert "lf" in by_ends and "" in by_ends
    assert lone_returns(by_ends["lf"], "G0 X1\rG1 X2\r") == f"f:1: {one_line}"
    assert lone_returns(by_ends["lf"], "G0 X1\rG1 X2\nM2") == repr(("G0 X1\rG1 X2\n", "M2"))
    assert lone_returns(by_ends[""], "G0\nG0 X1\rG1 X2\nM2") == f"f:2: {differs}"
    assert lone_returns(by_ends[""], "G0 X1\rG1 X2\r") == repr(("G0 X1\r", "G1 X2\r"))


@pytest.mark.parametrize(
    ("text", "title", "blocks"),
    [
        ("part for Joe\n%\nG21\nG0 X1.\n%\n", 1, [3, 4]),
        ("part for Joe\nby: him\n\n%\nG21\nG0 X1.\n%\n", 3, [5, 6]),
        ("(only a remark)\n%\nG21\nG0 X1.\n%\n", 0, [3, 4]),
        ("%\nG21\nG0 X1.\n%\n", 0, [2, 3]),
        ("G21\n%\n", 0, [1]),
    ],
)
def test_a_title_above_the_percent_sign_is_no_block(text: str, title: int, blocks: list[int]) -> None:
    program = interpret_program(text, load_dialect("haas"), "f")
    assert (program.title_lines, program.line.tolist()) == (title, blocks)


def test_words_above_the_percent_sign_make_them_blocks() -> None:
    with pytest.raises(ReadError, match=r"^f:1: "):
        interpret_program("part for Joe\nG21\n%\nG0 X1.\n%\n", load_dialect("haas"), "f")
