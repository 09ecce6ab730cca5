"""Comments that QtPlasmaC executes, checked against its own G-code filter of LinuxCNC."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from leafcut.gcode.active_comments import controller_settings
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from leafcut.processes.program.proof.certificate import certify
from qtplasmac_filter import filtered
from rewriting import some_orders

THIN = "(o=0, kw=1.5, ph=4, pd=0.5, ch=1.5, fr=1200, ca=45)"
THICK = "(o=0, kw=2.5, ph=5, pd=0.9, ch=1.5, fr=700, ca=105)"


def cut(x: float, y: float, tool: int = 0) -> str:
    """Return a round hole of 10 mm, cut at the feed of either material."""
    return f"G0 X{x} Y{y}\nM3 ${tool} S1\nG3 X{x} Y{y} I5 J0 F1200\nM5 ${tool}\n"


def zigzag(first: float) -> str:
    """Return four cuts in an order that any other betters."""
    return "".join(cut(first + x, 5.0) for x in (0.0, 200.0, 20.0, 230.0))


HEAD = "G21 G40 G90 G94\nG64 P0.1\n"
PROGRAM = (
    f"{HEAD}{THIN}\n{zigzag(10)}{THICK}\n{zigzag(15)}M190 P1\nM66 P3 L3 Q1\n#<h_diameter>=20\n#<holes>=2\n{zigzag(12)}"
    f"#<h_velocity>=40 (percent)\n#<oclength>=3\n{zigzag(13)}#<holes>=0\n{zigzag(14)}M2\n"
)


def read(text: str, name: str = "qtplasmac") -> Program:
    return interpret_program(text, load_dialect(name))


def same(one: str, other: str, name: str = "qtplasmac") -> bool:
    return certify(read(one, name), read(other, name)).same


def cuts_of(text: str) -> Counter:
    """Return every cut of a filtered program with its material, including the words that the filter inserts."""
    found: Counter = Counter()
    material = place = ""
    block: list[str] | None = None
    for line in text.splitlines():
        if line.startswith("m190"):
            material = line
        elif line.startswith("g0x"):
            place = line
        elif line.startswith("m3"):
            block = []
        if block is not None:
            block.append(line)
        if line.startswith("m5") and block is not None:
            found[material, place, *block] += 1
            block = None
    return found


def test_every_parameter_that_the_filter_knows_is_one_that_we_know(qtplasmac_gcode: str) -> None:
    """The names are read from the source of the filter; a newer LinuxCNC may add some."""
    names = set(re.findall(r"startswith\('#<([a-z_-]+)>'", Path(qtplasmac_gcode).read_text("utf-8")))
    assert names == set(load_dialect("qtplasmac").obeyed_parameters) - {"tube-cut"}
    assert {"linuxcnc", "plasma"} <= {n for n in ("linuxcnc", "plasma", "haas") if load_dialect(n).obeyed_parameters}


def test_cuts_keep_the_material_and_the_settings_they_are_made_with(qtplasmac_gcode: str, tmp_path: Path) -> None:
    """In random orders, the filter makes the same cuts with the same materials, without messages; the proof agrees."""
    program = read(PROGRAM)
    sequence = find_sequence(program)
    assert [len(s.pieces) for s in sequence.sections] == [4] * 5
    before = filtered(qtplasmac_gcode, PROGRAM, tmp_path)
    assert sum(cuts_of(before.text).values()) == 20
    for seed in range(3):
        text = rewrite(program, sequence, some_orders(sequence, seed))
        assert text != PROGRAM
        after = filtered(qtplasmac_gcode, text, tmp_path)
        assert (cuts_of(after.text), after.said) == (cuts_of(before.text), before.said)
        assert same(PROGRAM, text)


#: Another setting, and how it is made.
CHANGES = {
    "kerf of a material": (THIN, THIN.replace("kw=1.5", "kw=1.6")),
    "current of a material": (THICK, THICK.replace("ca=105", "ca=100")),
    "a material is gone": (THICK + "\n", ""),
    "a material is made a remark": (THICK, THICK.replace("(o=0", "( o=0")),
    "a material is one of the table": (THIN, THIN.replace("o=0", "o=2, nu=2, na=steel")),
    "two materials changed places": (f"{THICK}\n{zigzag(15)}", f"{zigzag(15)}{THICK}\n"),
    "another number": ("M190 P1", "M190 P2"),
    "holes": ("#<holes>=2", "#<holes>=1"),
    "no holes": ("#<holes>=2\n", ""),
    "diameter of holes": ("h_diameter>=20", "h_diameter>=9"),
    "speed of holes": ("h_velocity>=40", "h_velocity>=50"),
    "overcut": ("oclength>=3", "oclength>=4"),
    "overcut later": (f"#<oclength>=3\n{zigzag(13)}", f"{zigzag(13)}#<oclength>=3\n"),
    "pierces only": (HEAD, HEAD + "#<pierce-only>=1\n"),
    "pierces only, from a place on": (THICK, f"{THICK}\n#<pierce-only>=1"),
    "heights": (HEAD, HEAD + "#<keep-z-motion>=1\n"),
    "taken as it is": ("M2\n", "M2\n;qtplasmac filtered G-code file\n"),
    "of the screen's own": (HEAD, f";conversational block\n{HEAD}"),
    "a marking torch": ("M3 $0 S1\nG3 X10.0", "M3 $1 S1\nG3 X10.0"),
    "percent": (HEAD, HEAD + "M67 E3 Q60\n"),
    "a material that is never run": ("M2\n", f"M2\n{THIN.replace('o=0', 'o=2, nu=2, na=steel')}\n"),
}


@pytest.fixture(scope="module")
def plain(qtplasmac_gcode: str, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Return the filter's output for the original program."""
    return filtered(qtplasmac_gcode, PROGRAM, tmp_path_factory.mktemp("plain")).text


@pytest.mark.parametrize("name", CHANGES)
def test_a_changed_setting_of_the_controller_is_a_difference(
    name: str, plain: str, qtplasmac_gcode: str, tmp_path: Path
) -> None:
    """The filter outputs a different program, and the proof reports it in every dialect."""
    was, now = CHANGES[name]
    changed = PROGRAM.replace(was, now, 1)
    assert changed != PROGRAM
    assert filtered(qtplasmac_gcode, changed, tmp_path).text != plain
    assert not same(PROGRAM, changed)
    assert not same(PROGRAM, changed, "linuxcnc")


@pytest.mark.parametrize(
    "was, now",
    [
        ("kw=1.5", "kw=1.50"),
        ("h_velocity>=40 (percent)", "H_VELOCITY> = 40.0"),
        (THIN, f"N10 {THIN} "),
        (HEAD, HEAD + "(plate)\n"),
    ],
)
def test_a_setting_said_in_another_way_is_the_same(was: str, now: str) -> None:
    assert same(PROGRAM, PROGRAM.replace(was, now))


def test_a_program_that_only_pierces_is_left_as_it_is() -> None:
    """For such a program the filter searches rapids line by line: nothing after the setting is moved, and the reason is
    shown.
    """
    sequence = find_sequence(read(f"{HEAD}{THIN}\n#<pierce-only>=1\n{zigzag(10)}M2\n"))
    assert not sequence.sections
    assert any("pierce-only" in reason for item in sequence.items for reason in getattr(item, "reasons", ()))
    assert find_sequence(read(f"{HEAD}{THIN}\n#<pierce-only>=0\n{zigzag(10)}M2\n")).sections


def test_no_other_controller_obeys_them() -> None:
    assert controller_settings(PROGRAM.splitlines(), load_dialect("grbl")) == ()
