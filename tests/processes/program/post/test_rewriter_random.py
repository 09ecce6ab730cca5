"""The rewriter on random little programs with random habits: whatever is omitted or repeated, the work is the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from rewriting import lowest_way, program_of, some_orders, work_of
from rs274_moves import moves_of_rs274, run_rs274

SPOT = st.tuples(st.integers(0, 6), st.integers(0, 6))
HOLE = st.fixed_dictionaries(
    {
        "kind": st.just("cycle"),
        "at": SPOT,
        "code": st.sampled_from([81, 81, 81, 82, 83]),
        "z": st.sampled_from([-3, -4]),
        "r": st.sampled_from([1, 1, 2]),
        "initial": st.booleans(),
    }
)
WRITTEN = st.fixed_dictionaries(
    {"kind": st.just("hole"), "at": SPOT, "pecks": st.integers(1, 3), "fast": st.booleans(), "down": st.booleans()}
)
CUT = st.fixed_dictionaries(
    {
        "kind": st.just("cut"),
        "at": SPOT,
        "arc": st.booleans(),
        "plane": st.sampled_from([17, 17, 17, 18]),
        "slant": st.booleans(),
        "relative": st.integers(0, 5),
    }
)
STOP = st.fixed_dictionaries({"kind": st.just("stop"), "text": st.sampled_from(["M8", "M9", "M1", "S900", "G4 P0.5"])})
FEED = st.sampled_from([100, 200])


class Author:
    """Writes a program, omitting what holds already as `habits` say."""

    def __init__(self, habits: list[bool]) -> None:
        self.habits, self.used = habits, 0
        self.lines: list[str] = []
        self.said: dict[str, object] = {}
        self.cycle: tuple = ()

    def terse(self) -> bool:
        self.used += 1
        return self.habits[self.used % len(self.habits)]

    def word(self, group: str, text: str) -> str:
        if self.said.get(group) == text and self.terse():
            return ""
        self.said[group] = text
        return text

    def block(self, *words: str) -> None:
        text = " ".join(w for w in words if w)
        if not text:
            return
        if self.terse() and self.terse():
            text = f"N{len(self.lines)} " + text
        if self.terse() and self.terse() and self.terse():
            self.lines.append("(a remark)")
        self.lines.append(text.replace(" ", "") if self.terse() and self.terse() else text)

    def axes(self, **places: float) -> list[str]:
        return [self.word(k, f"{k}{v:g}") for k, v in places.items()]

    def move(self, code: int, feed: int | None = None, **places: float) -> None:
        self.cycle = ()
        words = self.axes(**places)
        if not any(words):
            return
        self.block(self.word("motion", f"G{code}"), *words, self.word("F", f"F{feed}") if feed else "")

    def hole(self, f: dict, feed: int) -> None:
        cycle = (f["code"], f["z"], f["r"])
        code = f"G{f['code']}"
        rest = [f"Z{f['z']}", f"R{f['r']}", *{82: ["P0.5"], 83: ["Q1.5"]}.get(f["code"], [])]
        if self.cycle and self.cycle[0] == f["code"]:
            same = {f"Z{self.cycle[1]}", f"R{self.cycle[2]}", "P0.5", "Q1.5"}
            rest = [w for w in rest if w not in same or not self.terse()]
        plane = self.word("plane", "G17")
        retract = self.word("retract", "G98" if f["initial"] else "G99")
        x, y = f["at"]
        at = self.axes(X=10 * x, Y=10 * y)
        if not any(at):
            at = [f"X{10 * x}"]
        self.block(plane, retract, self.word("motion", code), *at, *rest, self.word("F", f"F{feed}"))
        self.cycle = cycle
        self.said.pop("Z", None)

    def written(self, f: dict, feed: int) -> None:
        x, y = f["at"]
        self.move(0, X=10 * x, Y=10 * y)
        if f["down"]:
            self.move(0, Z=1)
        for peck in range(1, f["pecks"] + 1):
            self.move(1, feed, Z=-peck)
            self.move(0 if f["fast"] else 1, feed, Z=1)
        self.move(0, Z=5)

    def cut(self, f: dict, feed: int) -> None:
        x, y = 10 * f["at"][0], 10 * f["at"][1]
        if f["slant"]:
            self.move(0, X=x, Y=y, Z=3)
        else:
            self.move(0, X=x, Y=y)
        self.move(1, feed, Z=-1)
        if f["relative"] == 0:
            self.lines.append("G91")
            self.block("G1", "X2", "Y1")
            self.lines.append("G90")
            self.said = {k: v for k, v in self.said.items() if k not in ("X", "Y", "motion")}
        elif f["arc"]:
            plane = self.word("plane", f"G{f['plane']}")
            if f["plane"] == 17:
                self.block(plane, self.word("motion", "G2"), f"X{x + 4}", f"Y{y}", "I2", "J0")
            else:
                self.block(plane, self.word("motion", "G2"), f"X{x + 4}", "Z-1", "I2", "K0")
            self.said["X"] = f"X{x + 4}"
        else:
            self.move(1, X=x + 3, Y=y)
            self.move(1, feed * 2, X=x + 3, Y=y + 3)
        self.move(0, Z=5)


def text_of(features: list[dict], habits: list[bool], feeds: list[int], foot: int) -> str:
    author = Author(habits)
    author.lines += ["G21 G90 G17 G98", "S1000 M3", "G0 Z5", "X-10 Y-10"]
    author.said = {"motion": "G0", "Z": "Z5", "X": "X-10", "Y": "Y-10", "plane": "G17", "retract": "G98"}
    for number, f in enumerate(features):
        feed = feeds[number % len(feeds)]
        if f["kind"] == "cycle":
            author.hole(f, feed)
        elif f["kind"] == "stop":
            author.lines.append(f["text"])
        else:
            if author.cycle and author.terse():
                author.lines.append("G80")
                author.said.pop("motion", None)
                author.cycle = ()
            (author.written if f["kind"] == "hole" else author.cut)(f, feed)
    if foot == 0:
        author.lines += ["G0 Z20", "X-5 Y-5"]
    elif foot == 1:
        author.lines += ["G0 Z20", "X-5"]
    elif foot == 2:
        author.lines += ["G0 Z5", "G1 Z-0.5 F100", "G0 Z20"]
    return "\n".join([*author.lines, "M5", "M2", ""])


PROGRAMS = st.builds(
    text_of,
    st.lists(st.one_of(HOLE, HOLE, WRITTEN, CUT, CUT, STOP), min_size=3, max_size=14),
    st.lists(st.booleans(), min_size=5, max_size=23),
    st.lists(FEED, min_size=1, max_size=3),
    st.integers(0, 3),
)


@settings(max_examples=settings().max_examples * 2)
@given(PROGRAMS, st.integers(0, 3))
def test_any_order_of_any_program_does_the_same_work(text: str, seed: int) -> None:
    """Same cuts with tool, feed, spindle, coolant; no way lower than before; its own order gives its own bytes."""
    program = program_of(text)
    sequence = find_sequence(program)
    assert rewrite(program, sequence, [np.arange(len(s.pieces)) for s in sequence.sections]) == text
    new_text = rewrite(program, sequence, some_orders(sequence, seed))
    new = program_of(new_text)
    assert work_of(new) == work_of(program), new_text
    assert lowest_way(new) >= lowest_way(program), new_text


@settings(max_examples=25)  # each example starts rs274
@given(text=PROGRAMS)
def test_linuxcnc_finds_the_same_cuts_in_random_programs(
    rs274: str, tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    """All cutting moves that rs274 prints are the same multiset, also those that its canned cycles make."""
    program = program_of(text)
    sequence = find_sequence(program)
    new_text = rewrite(program, sequence, some_orders(sequence, 1))
    folder = tmp_path_factory.mktemp("rs274")
    cuts = []
    for said in (text, new_text):
        status, output = run_rs274(rs274, said, folder)
        assert status == 0, output[-300:] + said
        cuts.append(sorted(str(m) for m in moves_of_rs274(output) if m[0] != "rapid"))
    assert cuts[0] == cuts[1], new_text
