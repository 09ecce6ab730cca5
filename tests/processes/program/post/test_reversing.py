"""Cuts written from their other end: text by hand, and random programs judged by the certificate and by rs274."""

from __future__ import annotations

import math
import random
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import PostError
from leafcut.gcode.program import Program
from leafcut.model.sequence import Sequence
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.proof.certificate import certify
from rewriting import lowest_way, program_of, rewritten, some_orders
from rs274_moves import moves_of_rs274, run_rs274
from shared_data import DATA

HEAD = "G21 G90 / T1 M6 / S1000 M3 / G0 Z5 / "
FOOT = " / G0 Z5 / X90 Y90 / G1 Z-1 F50 / X99 F200 / G0 Z5 / M5 / M2"


def turned(body: str) -> str:
    """Return the text of the first cut, made from its other end."""
    text = rewritten(HEAD + body + FOOT, [~0, 1], allow_reverse=True)
    return text.removeprefix(HEAD).removesuffix(FOOT)


def test_a_reversed_last_line_of_a_file_gets_a_line_end() -> None:
    text = "G21 G90\nS1000\nG0 X0 Y0\nM3\nG1 X5 F200\nM5\nG0 X90 Y90\nM3\nG1 X99\nM5"
    program = program_of(text, "grbl-laser")
    sequence = find_sequence(program, allow_reverse=True)
    assert rewrite(program, sequence, [np.array([~1, 0])]) == (
        "G21 G90\nS1000\nG0 X99 Y90 F200\nM3\nG1 X90\nM5\nG0 X0 Y0\nM3\nG1 X5 F200\nM5\n"
    )


@pytest.mark.parametrize(
    "body, expected",
    [
        ("G0 X0 Y0 / G1 Z-1 F50 / X5 F200", "G0 X5 Y0 / G1 Z-1 F50 / X0 F200"),
        ("G0X0.0Y0 / G1Z-1F50 / X5.250F200", "G0X5.250Y0 / G1Z-1F50 / X0.0F200"),
        ("N1 G0 X0 Y0 / N2 G1 Z-1 F50 / N3 X5 F200", "N1 G0 X5 Y0 / N2 G1 Z-1 F50 / N3 X0 F200"),
        ("g0 x0 y0 / g1 z-1 f50 / x5 f200", "g0 x5 y0 / g1 z-1 f50 / x0 f200"),
        ("g00 x0 y0 / g01 z-1 f50 / g03 x4 y2 r9 f200", "g00 x4 y2 / g01 z-1 f50 / g02 x0 y0 r9 f200"),
        # Arcs reverse their direction about the same centre; G1 is written where G2 would continue.
        (
            "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / G2 X9 Y4 I4 J0 / G1 X20",
            "G0 X20 Y4 / G1 Z-1 F50 / G1 X9 F200 / G3 X5 Y0 I0.0 J-4.0 / G1 X0 F200",
        ),
        ("G0 X0 Y0 / G1 Z-1 F50 / G03 X4 Y2 R9 F200", "G0 X4 Y2 / G1 Z-1 F50 / G02 X0 Y0 R9 F200"),
        ("G0 X0 Y0 / G1 Z-1 F50 / G2 Y4 J2 F200", "G0 X0 Y4 / G1 Z-1 F50 / G3 Y0 J-2.0 F200"),
        ("G90.1 G0 X0 Y0 / G1 Z-1 F50 / G2 X4 I2 J0 F200", "G90.1 G0 X4 Y0 / G1 Z-1 F50 / G3 X0 I2 J0 F200"),
        # The centre is exact, to the last decimal of the text.
        (
            "G0 X0.1 Y0.003 / G1 Z-1 F50 / G2 X4.1 I2.0000 J0. F200",
            "G0 X4.1 Y0.003 / G1 Z-1 F50 / G3 X0.1 I-2.0 J0.0 F200",
        ),
        # A feed stays with its piece.
        (
            "G0 X0 Y0 / G1 Z-1 F50 / X5 F200 / Y5 F90 / X9 F200 / Y9",
            "G0 X9 Y9 / G1 Z-1 F50 / Y5 F200 / X5 F200 / Y0 F90 / X0 F200",
        ),
        # Remarks stay with their blocks, above them or behind.
        (
            "G0 X0 Y0 / G1 Z-1 F50 / (one) / X5 F200 / (two) / Y5 (up) / X9 ; right",
            "G0 X9 Y5 / G1 Z-1 F50 / X5 F200 ; right / (two) / Y0 (up) / (one) / X0 F200",
        ),
        # It rises with the feed and the motion that it had.
        (
            "G0 X0 Y0 / G1 Z-1 F50 / G2 X4 I2 F200 / G1 Y-5 / G3 X9 R9 / G1 Z1 F50",
            "G0 X9 Y-5 / G1 Z-1 F50 / G2 X4 R9 F200 / G1 Y0 / G3 X0 I-2.0 F200 / G1 Z1 F50",
        ),
    ],
)
def test_the_blocks_of_a_cut_go_back(body: str, expected: str) -> None:
    assert turned(body) == expected


@pytest.mark.parametrize(
    "cut, expected",
    [
        # The power of the first block holds for the whole cut, so the new first block states it.
        (
            "S300 / G0 X0 Y0 / M3 / G1 X5 F200 S400 / Y5 / X9 / M5",
            "S300 / G0 X9 Y5 / M3 / G1 X5 F200 S400 / Y0 / G1 X0 F200 S400 / M5",
        ),
        (
            "G0 X0 Y0 / M3 S300. / G1 X5 F200.0 / Y5 / X9 S300. / M5",
            "G0 X9 Y5 / M3 S300. / G1 X5 F200.0 S300. / Y0 / G1 X0 F200.0 / M5",
        ),
    ],
)
def test_a_beam_keeps_its_power_from_the_other_end(cut: str, expected: str) -> None:
    head, foot = "G21 G90 / ", " / G0 X90 Y90 / M3 S50 / G1 X99 F100 / M5 / M2"
    text = rewritten(head + cut + foot, [~0, 1], process="laser", allow_reverse=True)
    assert text == head + expected + foot


def test_what_is_not_to_be_turned_is_refused() -> None:
    program = program_of(HEAD + "G0 X0 Y0 / G1 Z-1 F50 / X5 F200" + FOOT)
    with pytest.raises(PostError, match=r"line 5: .*cannot be reversed") as caught:
        rewrite(program, find_sequence(program), [np.array([~0, 1])])
    assert caught.value.section == 0


def test_a_file_without_an_end_of_its_last_line_gets_one_where_it_is_needed() -> None:
    """The file ends within its last cut, which now starts there."""
    cut = "G0 X{0} Y0\r\nM3 S9\r\nG1 X{1} F200\r\nM5"
    program = program_of("G21 G90\r\n" + "\r\n".join(cut.format(x, x + 5) for x in (0, 20, 40)))
    sequence = find_sequence(program, process="laser", allow_reverse=True)
    new = rewrite(program, sequence, [np.array([~2, 1, 0])])
    assert new == "G21 G90\r\n" + "\r\n".join(cut.format(*x) for x in ((45, 40), (20, 25), (0, 5))) + "\r\n"


def choose_directions(sequence: Sequence, seed: int) -> tuple[list[np.ndarray], int]:
    """Return random orders with random directions, and how many cuts are turned."""
    rng, turns = random.Random(seed), 0
    orders = some_orders(sequence, seed)
    for section, order in zip(sequence.sections, orders, strict=True):
        for place, k in enumerate(order.tolist()):
            if section.pieces[k].reversible and rng.random() < 0.6:
                order[place], turns = ~k, turns + 1
    return orders, turns


PIECE = st.tuples(st.sampled_from([0, 0, 0, 2, 3]), st.integers(1, 5), st.integers(-4, 4))
CUT = st.fixed_dictionaries(
    {
        "at": st.tuples(st.integers(0, 4), st.integers(0, 4)),
        "pieces": st.lists(PIECE, min_size=1, max_size=5),
        "feeds": st.lists(st.sampled_from([200, 200, 300]), min_size=1, max_size=3),
        "habits": st.lists(st.booleans(), min_size=4, max_size=11),
        "fast": st.booleans(),
        "slow_rise": st.booleans(),
        "level": st.sampled_from([-1, -2]),
    }
)


def text_of(cuts: list[dict], inch: bool, beam: bool) -> str:
    """Return a program with cuts of random pieces, with or without repeating active words."""
    said = {"G": ""}

    def words(terse: bool, *given: str) -> str:
        kept = [w for w in given if w and not (terse and said.get(w[0]) == w)]
        said.update((w[0], w) for w in given if w)
        return " ".join(kept)

    lines = ["G20 G90 G17" if inch else "G21 G90 G17", "G0 Z5" if not beam else "S300", "" if beam else "S900 M3"]
    for number, cut in enumerate(cuts):
        x, y = 40 * cut["at"][0] + 0.125 * number, 40 * cut["at"][1]
        lines.append(f"G0 X{x:g} Y{y:g}")
        said.update(G="G0", X=f"X{x:g}", Y=f"Y{y:g}")
        if beam:
            lines.append("M3")
        else:
            lines += ["Z1"] if cut["fast"] else []
            lines.append(f"G1 Z{cut['level']} F50")
            said.update(G="G1", F="F50")
        for k, (code, dx, dy) in enumerate(cut["pieces"]):
            terse, feed = cut["habits"][k % len(cut["habits"])], cut["feeds"][k % len(cut["feeds"])]
            u, v, centre = x + dx, y + dy, []
            if code:
                radius = math.hypot(dx, dy) / 2
                centre = [f"I{dx / 2:g}", f"J{dy / 2:g}"] if terse else [f"R{radius + 1:.4f}"]
            line = words(terse, f"G{code or 1}", f"X{u:g}", f"Y{v:g}", f"F{feed}")
            lines.append(" ".join([line, *centre]) + (" (piece)" if k % 3 == 1 else ""))
            x, y = u, v
        lines += ["M5"] if beam else (["G1 Z1 F80"] if cut["slow_rise"] else []) + ["G0 Z5"]
        said.update(G="G1" if beam and cut["pieces"][-1][0] == 0 else "", F="")
    return "\n".join([line for line in lines if line] + ["M5", "M2", ""])


PROGRAMS = st.builds(text_of, st.lists(CUT, min_size=2, max_size=7), st.booleans(), st.booleans())


@given(PROGRAMS, st.integers(0, 9))
def test_any_directions_of_any_program_do_the_same_work(text: str, seed: int) -> None:
    """The certificate counts what was turned, and without the option it does not let it pass."""
    program = program_of(text)
    sequence = find_sequence(program, allow_reverse=True)
    orders, turns = choose_directions(sequence, seed)
    new_text = rewrite(program, sequence, orders)
    new = program_of(new_text)
    found = certify(program, new, allow_reverse=True)
    assert found.same, f"{found.differences[0]}\n{text}\n{new_text}"
    assert found.reversed_cuts == turns
    assert lowest_way(new) >= lowest_way(program) or np.isnan(lowest_way(program))
    assert certify(program, new).same == (turns == 0)


def undirected(program: str, folder: object, text: str) -> Counter:
    """Return the cuts that rs274 prints as a multiset without direction; of plunges and rises, the heights."""
    status, output = run_rs274(program, text, folder)  # type: ignore[arg-type]
    assert status == 0, output[-300:] + text
    place, cuts = (0.0, 0.0, 0.0), Counter()
    for kind, *numbers in moves_of_rs274(output):
        if kind == "arc":
            _, x, y, z, u, v, turns = numbers
            ends = tuple(sorted([(round(p[0], 3), round(p[1], 3)) for p in (place, (x, y))]))
            way = (turns > 0) == (ends[0] == (round(place[0], 3), round(place[1], 3)))
            cuts["arc", ends, round(z, 3), round(u, 2), round(v, 2), way] += 1
        elif kind == "feed":
            x, y, z, feed = numbers
            if (x, y) == place[:2]:
                cuts["up or down", *sorted([round(z, 3), round(place[2], 3)]), feed, z > place[2]] += 1
            else:
                cuts["line", *sorted([tuple(round(v, 3) for v in p) for p in (place, (x, y, z))]), feed] += 1
        if kind in ("arc", "feed", "rapid"):
            at = 1 if kind == "arc" else 0
            place = (numbers[at], numbers[at + 1], numbers[at + 2])
    return cuts


GCODE = DATA / "gcode"


def test_linuxcnc_finds_the_same_cuts_of_a_real_engraving_with_strokes_turned(rs274: str, tmp_path: Path) -> None:
    file = GCODE / "gsender_kb35.nc"
    if not file.exists():
        pytest.skip(f"{file} is not there")
    text = file.read_text(encoding="latin-1")
    program, sequence = read(text)
    orders, turns = choose_directions(sequence, 1)
    assert turns > 3
    assert undirected(rs274, tmp_path, text) == undirected(rs274, tmp_path, rewrite(program, sequence, orders))


def read(text: str) -> tuple[Program, Sequence]:
    program = program_of(text)
    return program, find_sequence(program, allow_reverse=True)


@settings(max_examples=25)  # each example starts rs274
@given(text=PROGRAMS)
def test_linuxcnc_finds_the_same_cuts_whichever_way_they_go(
    rs274: str, tmp_path_factory: pytest.TempPathFactory, text: str
) -> None:
    program, sequence = read(text)
    new_text = rewrite(program, sequence, choose_directions(sequence, 3)[0])
    folder = tmp_path_factory.mktemp("rs274")
    assert undirected(rs274, folder, text) == undirected(rs274, folder, new_text), new_text
