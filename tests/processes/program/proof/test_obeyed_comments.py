"""Comments that controllers obey: nothing moves across them, and `verify` compares them. The judge is LinuxCNC."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from leafcut.errors import ReadError
from leafcut.gcode.active_comments import is_active_comment
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.post.words import comment_lines
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.proof.certificate import certify
from leafcut.proof.program import interpret_written_program
from rs274_moves import run_rs274

HEAD = "G21 G90 G17 G40 G94\nT1 M6\nS900 M3\nG0 Z5.\n"
FIRST, SECOND, THIRD = (f"G0 X{x}. Y2.\nG0 Z1.\nG1 Z-1. F100.\nG0 Z5.\n" for x in (1, 11, 21))
END = "M5\nM30\n"

#: By controller, with the source in docs/programs.md: lines with comments that it obeys.
OBEYED = {
    "linuxcnc": [
        "(abort, turn the part over)", "( ABORT,stop)", "G1 Z5. F100. (abort,stop)", "#1=2 (abort,stop)",
        "(MSG, turn the part over)", "(debug, #1)", "(print, #1)", "(LOGOPEN,a.txt)", "(LOGAPPEND,a.txt)", "(LOG,#1)",
        "(LOGCLOSE)", "(PROBEOPEN a.txt)", "(PROBECLOSE)", "(py,print)", ";py,print", "(pyrun,x)", "(pyreload)",
        "(AXIS,hide)", "(AXIS,notify,look)", "(PREVIEW,stop)",
    ],
    "qtplasmac": ["(o=0, kw=1.5, ph=4, pd=0.5, ch=1.5, fr=1200)", "#<holes>=2", "(abort,stop)", "(MSG, look)"],
    "mach3": ["(MSG, turn the part over)"],
    "mach4": ["(MSG, turn the part over)"],
    "haas": [
        "#3000=1 (TOOL BROKEN)", "#3006=1 (TURN THE PART OVER)", "M109 P501 (SIDE 1 OR 2)", "DPRNT[X#5041[43]]",
    ],
    "fanuc": ["#3000=1 (TOOL BROKEN)", "#3006=1 (TURN THE PART OVER)"],
    "grbl": ["(MSG, look)", "(MSG look)", "(print, x)"],
    "masso": ["(MSG, look)"],
}  # fmt: skip
LINES = [(name, line) for name, lines in OBEYED.items() for line in lines]


def same(name: str, one: str, other: str) -> bool:
    """Return whether the proof calls two programs the same work."""
    return certify(*(interpret_program(text, load_dialect(name)) for text in (one, other))).same


def mutants(line: str) -> dict[str, str]:
    """Return programs in which the line between two holes is gone, elsewhere, there twice, or no longer obeyed."""
    gone = HEAD + FIRST + SECOND + THIRD + END
    found = {
        "removed": gone,
        "moved later": HEAD + FIRST + SECOND + f"{line}\n" + THIRD + END,
        "moved first": HEAD + f"{line}\n" + FIRST + SECOND + THIRD + END,
        "twice": HEAD + FIRST + f"{line}\n{line}\n" + SECOND + THIRD + END,
    }
    if line.startswith("(") and not line.startswith("(o="):
        found["replaced by a remark"] = HEAD + FIRST + f"({line[1:-1].replace(',', ' -')}s)\n" + SECOND + THIRD + END
        found["overridden by a remark"] = HEAD + FIRST + f"{line}(remark)\n" + SECOND + THIRD + END
    if " (" in line:
        found["another text"] = HEAD + FIRST + line.replace(" (", " (NOT ") + "\n" + SECOND + THIRD + END
    return found


@pytest.mark.hazard
@pytest.mark.parametrize("name, line", LINES)
def test_an_obeyed_comment_that_is_removed_moved_added_or_changed_is_never_the_same(name: str, line: str) -> None:
    original = HEAD + FIRST + f"{line}\n" + SECOND + THIRD + END
    assert same(name, original, original)
    told = {mutant: same(name, original, text) for mutant, text in mutants(line).items()}
    told["added"] = same(name, mutants(line)["removed"], original)
    if name == "grbl" or line == "(MSG look)":
        told.pop("replaced by a remark", None)  # "(MSG - look)" is a message there, too: another text, not a remark
    assert not any(told.values()), told


@pytest.mark.hazard
@pytest.mark.parametrize("name, line", LINES)
def test_nothing_moves_across_an_obeyed_comment(name: str, line: str) -> None:
    """Whatever the order: the same holes stand before it."""
    more = "".join(f"G0 X{x}. Y9.\nG0 Z1.\nG1 Z-1. F100.\nG0 Z5.\n" for x in (31, 41))
    text = HEAD + FIRST + SECOND + THIRD + f"{line}\n" + more + END
    program = interpret_program(text, load_dialect(name))
    sequence = find_sequence(program)
    assert sequence.sections
    new = rewrite(program, sequence, [np.arange(len(s.pieces))[::-1] for s in sequence.sections])
    before = new.partition(line)[0] if new.count(line) == 1 else ""
    assert {x for x in (1, 11, 21, 31, 41) if f"X{x}." in before} == {1, 11, 21}


def test_a_reason_says_that_a_comment_may_stop_the_program() -> None:
    program = interpret_program(HEAD + FIRST + "(abort, turn)\n" + SECOND + END, load_dialect("linuxcnc"))
    assert list(program.fixed.values()) == ["the comment in the block may stop the program"]


@pytest.mark.hazard
@pytest.mark.parametrize("line", [line for line in OBEYED["linuxcnc"] if line.startswith("(")])
def test_linuxcnc_does_not_skip_what_is_called_obeyed(line: str, rs274: str, tmp_path: Path) -> None:
    """It stops, or passes no plain COMMENT on; PROBEOPEN, PROBECLOSE, AXIS and PREVIEW are read from the comment."""
    status, out = run_rs274(rs274, f"G21 G90\nG0 Z5\n{line}\nG0 X1\nM2\n", tmp_path)
    assert is_active_comment(line.strip("() "))
    if "abort" in line.lower():
        assert status != 0 and "PROGRAM_END" not in out
    elif line[1:].startswith(("PROBE", "AXIS", "PREVIEW")):
        assert f'COMMENT("{line[1:-1]}")' in out
    else:
        assert "COMMENT" not in "".join(row for row in out.splitlines() if "interpreter" not in row)


@pytest.mark.parametrize("comment", ["abortive cut", "a, b", "message", "logs", "python", "axis X first", "(plain)"])
def test_a_plain_remark_is_not_obeyed(comment: str) -> None:
    assert not is_active_comment(comment)


@pytest.mark.hazard
@pytest.mark.parametrize("name, line", [(n, c) for n, c in LINES if c.startswith("(")])
def test_no_name_in_a_header_makes_a_comment_that_is_obeyed(name: str, line: str) -> None:
    """A file or a tool may be called like one."""
    for style in ("()", ";"):
        (text,) = comment_lines(line[1:-1], 200, style=style)
        bare = text.strip("(); ")
        assert not is_active_comment(bare)
        assert not bare.startswith("o=")


@pytest.mark.hazard
def test_our_own_program_is_refused_with_an_obeyed_comment_in_it() -> None:
    """The judge reads the comments, whatever the writer does to names."""
    text = "G21 G90 G17 G40\nG0 Z5\n{}\nM5\nM2\n"
    interpret_written_program(text.format("(plate)"), load_dialect("linuxcnc"))
    for comment in ("(abort, x)", "( msg, x)", ";py,x", "(PROBEOPEN a)"):
        with pytest.raises(ReadError, match="program:3: a controller would execute the comment"):
            interpret_written_program(text.format(comment), load_dialect("linuxcnc"))
