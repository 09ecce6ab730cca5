"""`verify` reports a changed detaching order of two laser programs: a difference within a part, otherwise a note."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut import api
from leafcut.cli import app as cli
from leafcut.model.certificate import Certificate
from leafcut.processes.program.proof.certificate import certify
from rewriting import program_of

HEAD, FOOT = "G21 G90 G17 G94 / M5 / ", " / M2"


def square(x: float, y: float, side: float, lead: float = 0.0) -> str:
    """Return a square cut by a laser, from a lead beside its first corner on where one is given."""
    corners = f"X{x + side} Y{y} / X{x + side} Y{y + side} / X{x} Y{y + side} / X{x} Y{y} / "
    return f"G0 X{x - lead} Y{y - lead} / M3 S500 / G1 X{x} Y{y} F1000 / {corners}M5"


#: Four parts with a hole each, the third in a frame: cutting the frame detaches it too.
HOLES = [square(60 * k + 10, 10, 5) for k in range(4)]
PARTS = [square(60 * k, 0, 40, lead=k % 2) for k in range(4)]
OPENING, FRAME = square(115, -5, 50), square(112, -8, 56)


def proof(old: list[str], new: list[str]) -> Certificate:
    assert sorted(old) == sorted(new)
    texts = [HEAD + " / ".join(cuts) + FOOT for cuts in (old, new)]
    return certify(*(program_of(text) for text in texts), notes=True)


def test_a_part_that_comes_free_before_what_lies_inside_it_is_a_difference() -> None:
    found = proof([HOLES[0], PARTS[0], HOLES[1], PARTS[1]], [PARTS[0], HOLES[0], HOLES[1], PARTS[1]])
    assert [d.what for d in found.differences] == ["inner after outer"]
    assert str(found.differences[0]).count("in a part that is already detached by then") == 1
    assert found.notes == (), "the two parts come free in their order"


def test_another_order_of_parts_beside_each_other_is_a_note_and_the_same_work() -> None:
    """By hand: 0 1 2 3 becomes 2 0 3 1, so 0 and 1 have one before them that came after; holes count for nothing."""
    old = [*HOLES, *PARTS]
    found = proof(old, [*HOLES[::-1], *(PARTS[k] for k in (2, 0, 3, 1))])
    assert found.same
    (note,) = found.notes
    assert "2 of 4 outlines" in note
    assert proof(old, [*HOLES[::-1], *PARTS]).notes == ()


def test_what_lies_in_the_opening_of_a_frame_is_a_part() -> None:
    """Outline of the frame, its opening, and the part in that: of these the first and the last come free."""
    old = [PARTS[2], OPENING, FRAME, PARTS[0]]
    (note,) = proof(old, [PARTS[0], PARTS[2], OPENING, FRAME]).notes
    assert "1 of 3 outlines" in note or "2 of 3 outlines" in note


def test_the_command_prints_the_note_and_says_the_same_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, cuts in (("old", PARTS), ("new", PARTS[::-1])):
        (tmp_path / f"{name}.nc").write_text((HEAD + " / ".join(cuts) + FOOT).replace(" / ", "\n") + "\n")
    files = str(tmp_path / "old.nc"), str(tmp_path / "new.nc")
    assert cli.run(["verify", *files, "--machine", "grbl-laser-5w"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "the same work"
    assert said[1].startswith("note: parts detach in a different order: 3 of 4 outlines")
    assert len(api.verify(*files, machine="grbl-laser-5w").notes) == 1
