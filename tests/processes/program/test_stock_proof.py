"""The second proof of a new order: the remaining stock, and rapids, shanks and holders in it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.errors import VerifyError
from leafcut.gcode.dialects import load_dialect
from leafcut.order.stop import Deadline
from leafcut.processes.job import Job, machine_of
from leafcut.processes.program.planning import Judging, create_stock_judge
from leafcut.processes.program.proof import certificate
from leafcut.processes.program.reading import read_foreign
from leafcut.processes.program.report import stock_words
from leafcut.processes.settings import collect_settings

FAST = {"preset": "fast", "threads": 1}
HEAD = "G21 G90 G17\nT1 M6 (D=6. CR=0. - flat end mill)\nM3 S9000\nG0 Z5\n"
PLACES = [(10, 10), (90, 80), (20, 70), (80, 20), (50, 45), (15, 40)]
LIBRARY = """[[tool]]
number = 1
kind = "end-mill"
diameter = "6 mm"
flute_length = "5 mm"
shank_diameter = "6 mm"
stickout = "12 mm"
holder = "40 x 30"
"""


def slot(x: float, y: float, z: float = -2.0) -> str:
    return f"G0 X{x} Y{y}\nG0 Z2\nG1 Z{z} F300\nG1 X{x + 8} F600\nG0 Z5\n"


def part(*slots: str, head: str = HEAD) -> str:
    return head + "".join(slots) + "M5\nM30\n"


def written(folder: Path, text: str) -> str:
    file = folder / "part.nc"
    file.write_text(text)
    return str(file)


def judging(text: str, **options: object) -> tuple[Judging, Job]:
    """Return the judge of a program's text."""
    made = Job(settings := collect_settings(options), machine_of(settings), Deadline())
    program = read_foreign(text, "part.nc", settings, made.machine, load_dialect("linuxcnc")).program
    return create_stock_judge(made, program, "part.nc", "mill"), made


def check(original: str, new: str, **options: object) -> None:
    """Judge another text by a program's."""
    found, made = judging(original, **options)
    assert found.judge is not None
    found.judge.check(read_foreign(new, "new.nc", made.settings, made.machine, load_dialect("linuxcnc")).program)


def test_every_reordered_program_of_known_tools_is_judged_by_what_it_leaves(tmp_path: Path) -> None:
    found = leafcut.optimize(written(tmp_path, part(*(slot(x, y) for x, y in PLACES))), **FAST)
    proof = found.detail.stock
    assert found.after.travel_mm < found.before.travel_mm
    # A twentieth of the tool; the block reaches 3 mm around the slots.
    assert (proof.cell, proof.cells, proof.given, proof.reason) == (
        0.3,
        314 * 254,
        False,
        "",
    )
    assert leafcut.stock(written(tmp_path, found.text), same_as=written(tmp_path, found.text)).differences == ()


def test_an_order_that_loses_a_cut_is_not_written_even_if_the_other_proof_sees_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = part(*(slot(x, y) for x, y in PLACES))
    from leafcut.processes.program import proving
    from leafcut.processes.program.post.rewriter import rewrite

    write, certify = rewrite, certificate.certify
    monkeypatch.setattr(proving, "rewrite", lambda *a, **k: write(*a, **k).replace("X88 F600", "X84 F600"))
    monkeypatch.setattr(certificate, "certify", lambda *a, **k: replace(certify(*a, **k), same=True, differences=()))
    found = leafcut.optimize(written(tmp_path, text), **FAST)
    assert "X88 F600" in found.text
    assert found.text.split("G21", 1)[1] == text.split("G21", 1)[1]
    (issue,) = [one for one in found.issues if one.code == "L505"]
    assert "the new program leaves the stock at Z0.000, not at Z-2.000" in issue.message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("G1 X58", "G1 X57", r"at X5\d\.\d+ Y\d+\.\d+ the new program leaves the stock at Z0\.000, not at Z-2\.000"),
        ("Z-2.0 F300\nG1 X58", "Z-2.05 F300\nG1 X58", r"the new program leaves the stock at Z-2\.050, not at Z-2\.000"),
        (
            "G0 X50 Y45\nG0 Z2",
            "G0 Z-1\nG0 X50 Y45",
            r"a rapid of T1 goes 1\.00 mm deep into the stock, first in line \d+",
        ),
    ],
)
def test_what_leaves_something_else_or_meets_more_is_refused(old: str, new: str, words: str) -> None:
    """The last case leaves the same stock except for its rapid: a slot covers the whole move before and after."""
    way = "G0 X15 Y40\nG0 Z2\nG1 Z-2.0 F300\nG1 X50 Y45 F600\nG0 Z5\n"
    original = part(*(slot(x, y) for x, y in PLACES[:4]), "G0 X20 Y40\n", slot(*PLACES[4]), way)
    changed = original.replace(old, new)
    assert changed != original
    if "rapid" in words:
        changed = original.replace(
            "G0 X20 Y40\n" + slot(*PLACES[4]) + way, "G0 X15 Y40\nG0 Z-1\nG0 X50 Y45\n" + way + slot(*PLACES[4])
        )
        original = original.replace("G0 X20 Y40\n", "")
    with pytest.raises(VerifyError, match=words):
        check(original, changed)
    check(original, original)


def test_an_order_in_which_a_holder_meets_what_was_cut_away_before_is_refused(tmp_path: Path) -> None:
    """A slot of 14 mm in passes, its holder 12 mm above the tip: free once the ground around is 4 mm lower."""
    (tmp_path / "tools.toml").write_text(LIBRARY)
    face = "".join(f"G0 X10 Y{y}\nG1 Z-4 F300\nG1 X90 F600\nG0 Z5\n" for y in range(10, 91, 5))
    deep = "G0 X40 Y50\n" + "".join(
        f"G1 Z{-z} F300\nG1 X{40 if k % 2 else 50} F600\n" for k, z in enumerate((5, 9, 13, 14))
    )
    given = {"tools": tmp_path / "tools.toml", "workpiece": "0,0,-30,100,100,0"}
    one, other = part(face, deep, "G0 Z5\n"), part(deep, "G0 Z5\n", face)
    check(one, one, **given)
    with pytest.raises(VerifyError, match=r"the holder of T1 gets 2\.00 mm deep into the stock, first in line \d+"):
        check(one, other, **given)
    assert judging(one, **given)[0].issues == ()
    (issue,) = judging(other, **given)[0].issues
    assert (issue.code, issue.severity) == ("L809", "danger")


def test_dangers_of_the_original_are_told_and_refused_only_if_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Slots 7 mm deep with flutes of 5; without a block it is not known that material is there, and it is a warning."""
    (tmp_path / "tools.toml").write_text(LIBRARY)
    file = written(tmp_path, part(*(slot(x, y, -7.0) for x, y in PLACES)))
    block = {"workpiece": "-10,-10,-20,110,100,0"}
    for given, severity in (({}, "warning"), (block, "danger")):
        found = leafcut.optimize(file, tools=tmp_path / "tools.toml", **given, **FAST)
        (issue,) = [one for one in found.issues if one.code == "L809"]
        assert issue.severity == severity
        assert issue.message.startswith("the shank of T1 is in the stock on 6 moves, up to 2.00 mm deep")
    command = ["reorder", file, "--tools", str(tmp_path / "tools.toml"), "--workpiece", block["workpiece"], "--strict"]
    assert run([*command, "-o", str(tmp_path / "new.nc")]) == 1
    assert "the shank of T1 is in the stock on 6 moves" in capsys.readouterr().err
    assert not (tmp_path / "new.nc").exists()


@pytest.mark.parametrize(
    ("head", "z", "words"),
    [
        ("G21 G90\nT1 M6\nM3 S900\nG0 Z5\n", -2.0, "not compared: the shapes of its tools are unknown; give --tools"),
        (
            HEAD,
            1.0,
            "not compared: the program cuts nothing below Z0, so the top of the stock is unknown; give --workpiece",
        ),
        (HEAD.replace("CR=0. - flat end mill", "- V-bit"), -2.0, "cells of 0.3 mm; T1 as flat mills"),
    ],
)
def test_what_is_not_known_of_the_tools_or_the_stock_is_told(head: str, z: float, words: str, tmp_path: Path) -> None:
    """A V-bit without its angle counts as flat: both programs are cut by the same shape."""
    found = leafcut.optimize(written(tmp_path, part(*(slot(x, y, z) for x, y in PLACES), head=head)), **FAST)
    assert words in stock_words(found.detail.stock)
    assert found.verified


def test_a_stock_that_is_never_touched_is_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = written(tmp_path, part(*(slot(x, y) for x, y in PLACES)))
    assert run(["reorder", file, "-o", str(tmp_path / "new.nc"), "--workpiece", "500,0,-9,600,90,0"]) == 2
    err = capsys.readouterr().err
    assert "never touches this stock; specify the stock in program coordinates" in err
    assert err.count("\n") == 1


def test_the_judge_leaves_the_stock_as_it_was(tmp_path: Path) -> None:
    found, _ = judging(part(slot(10, 10)), workpiece="0,0,-10,60,60,0")
    assert found.judge is not None
    assert np.all(found.judge.stock.heights == 0.0)
    assert found.judge.left.heights.min() == -2.0


def test_a_program_of_a_laser_that_is_read_as_milling_is_pointed_to_its_process() -> None:
    """No option gives a beam the shape of a mill."""
    found, _ = judging("G21 G90\nG0 X0 Y0 Z5\nM3 S100\nG1 Z-1 F100\nX9\nG0 Z5\nM5\nM30\n", machine="grbl-laser-5w")
    assert found.proof is not None
    assert "--process laser" in found.proof.reason
