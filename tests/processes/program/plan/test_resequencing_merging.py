"""Joining sections of the same tool: dropped blocks, and obstacles to joining."""

from __future__ import annotations

import pytest

from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from rewriting import program_of, some_orders, work_of

TOOL = "T{0} M6 / S{0}000 M3 / G43 H{0} G0 Z5"
END = "G0 Z20 / M5"


def work(tool: int, y: float, between: str = "") -> str:
    """Return a change of tool, two holes, and the way up."""
    change = TOOL.format(tool)
    return f"{change} / G99 G81 X0 Y{y} Z-3 R1 F100 / X20 Y{y} / G80 / {between}{END}"


def text_of(*parts: str) -> str:
    return " / ".join(["G21 G90 G17", *parts, "M30"])


def test_sections_of_one_tool_are_joined_and_the_change_is_dropped() -> None:
    text = text_of(work(1, 0), work(2, 50), work(1, 10), work(3, 80))
    program = program_of(text)
    sequence = find_sequence(program, merge_tools=True)
    assert [[c.entry for c in s.pieces] for s in sequence.sections] == [
        [(0, 0), (20, 0), (0, 10), (20, 10)],
        [(0, 50), (20, 50)],
        [(0, 80), (20, 80)],
    ]
    dropped = [program.lines[int(program.line[b]) - 1].strip() for k in sequence.dropped for b in range(k.begin, k.end)]
    assert dropped == ["G80", "G0 Z20", "M5", "T1 M6", "S1000 M3", "G43 H1 G0 Z5"]
    assert [i.message for i in sequence.issues if i.code == "L503"] == [
        "joining sections of the same tool saves 1 tool change"
    ]
    for seed in range(4):
        new = program_of(rewrite(program, sequence, some_orders(sequence, seed)))
        assert work_of(new) == work_of(program)


def test_without_the_wish_nothing_is_joined() -> None:
    assert find_sequence(program_of(text_of(work(1, 0), work(2, 50), work(1, 10)))).dropped == ()


def test_the_last_section_may_be_joined_too() -> None:
    program = program_of(text_of(work(1, 0), work(2, 50), work(1, 10)))
    sequence = find_sequence(program, merge_tools=True)
    assert [s.tool for s in sequence.sections] == [1, 2]
    new = program_of(rewrite(program, sequence, some_orders(sequence, 1)))
    assert work_of(new) == work_of(program)


FORBIDDEN = {
    "a stop": [work(1, 0), work(2, 50, "M0 / "), work(1, 10)],
    "work at the same place in between": [work(1, 0), work(2, 10), work(1, 10)],
    "another work offset": [work(1, 0), work(2, 50, "G55 / "), work(1, 10)],
    "another speed": [work(1, 0), work(2, 50), work(1, 10).replace("S1000", "S1500")],
    "another length offset": [work(1, 0), work(2, 50), work(1, 10).replace("H1", "H7")],
    "another height": [work(1, 0), work(2, 50), work(1, 10).replace("R1", "R2")],
    "work alone in between": [work(1, 0), TOOL.format(2) + " / G0 X1 Y90 / G1 Z-1 F100 / X5 / G0 Z20", work(1, 10)],
    "a block that is not understood": [work(1, 0), work(2, 50, "M150 / "), work(1, 10)],
    "a tool that stays without its words": [work(1, 0), work(2, 50), work(1, 10), work(3, 80).replace("G43 H3 ", "")],
}


@pytest.mark.parametrize("why", FORBIDDEN)
def test_sections_are_not_joined_over(why: str) -> None:
    program = program_of(text_of(*FORBIDDEN[why]))
    sequence = find_sequence(program, merge_tools=True)
    assert sequence.dropped == ()
    assert sum(s.tool == 1 for s in sequence.sections) == 2
