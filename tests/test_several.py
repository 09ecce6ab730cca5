"""Several inputs of one command, patterns, and - for standard input and output."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.files.digests import fill_in_digest
from leafcut.files.whole_files import StandardInput

HOLES = "".join(f"X{7 * k * 5 % 11} Y{9 * k * 4 % 13}\n" for k in range(12))
PROGRAM = f"G21 G90 G17 G94\nT1 M6\nS1000 M3\nG0 Z5\nG81 X90 Y90 Z-2 R2 F100\n{HOLES}G80\nM5\nM30\n"
FAST = ["--preset", "fast", "--threads", "1"]


@pytest.fixture
def shop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with three programs, one of them broken, in which the command line runs."""
    (tmp_path / "a.nc").write_text(PROGRAM)
    (tmp_path / "b.nc").write_text(PROGRAM.replace("X90", "X80"))
    (tmp_path / "c.nc").write_text("G1 X5 F\n")
    (tmp_path / "out").mkdir()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "A.NC").write_text(PROGRAM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def answered(capsys: pytest.CaptureFixture[str], *words: str, status: int = 0) -> tuple[str, str]:
    assert run(words) == status
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    return said.out, said.err


def test_one_that_is_refused_does_not_stop_the_others_and_the_worst_status_counts(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each program is written as it would be alone; a pattern that no shell expanded is the files that fit it."""
    out, err = answered(capsys, "optimize", "?.nc", "-o", "out", *FAST, status=1)
    assert sorted(p.name for p in (shop / "out").iterdir()) == ["a.nc", "b.nc", "batch.csv", "batch.html"]
    assert (shop / "out" / "a.nc").read_text() == leafcut.optimize("a.nc", preset="fast").text
    assert "c.nc" in out and "refused" in out and "2 files in out" in out
    assert err.startswith("leafcut: c.nc:1: ") and err.count("\n") == 1
    assert [(shop / name).read_text() for name in ("a.nc", "c.nc")] == [PROGRAM, "G1 X5 F\n"]


def test_several_programs_are_one_object_of_json_and_reports_go_to_their_folder(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["optimize", "c.nc", "a.nc", "./no.nc", "--report", "out", "--json", "--dry-run", "--algorithm", "none"]
    out, err = answered(capsys, *words, *FAST, status=1)
    found = json.loads(out)
    assert [(row["input"], row["status"], "error" in row) for row in found["runs"]] == [
        ("c.nc", 1, True),
        ("a.nc", 0, False),
        ("./no.nc", 1, True),
    ]
    assert (found["failed"], found["status"]) == (2, 1)
    assert any(line.startswith(("leafcut: ./no.nc: file", "leafcut: no.nc: file")) for line in err.splitlines())
    assert found["runs"][1]["verified"] is True
    assert [p.name for p in (shop / "out").iterdir()] == ["a.html"]


def test_a_dry_run_of_several_programs_writes_nothing(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The totals are the sums of the rows."""
    before = sorted(shop.iterdir())
    out, _ = answered(capsys, "optimize", "a.nc", "b.nc", "--algorithm", "none", "--dry-run")
    assert "not written (--dry-run)" in out
    assert "2 in all" in out
    assert sorted(shop.iterdir()) == before


@pytest.mark.parametrize(
    ("status", "words", "said"),
    [
        (1, ["a.nc", "b.nc", "-o", "new.nc"], "new.nc: not a folder; with several inputs -o names a folder"),
        (1, ["a.nc", "b.nc", "-o", "."], "a.nc: is an input or another output of this run and is never overwritten"),
        (
            2,
            ["a.nc", "other/A.NC", "-o", "out"],
            "a.nc and other/A.NC would both be written as A.NC; run them separately",
        ),
        (2, ["a.nc", "a.nc"], "a.nc and a.nc would both be written as a.leafcut.nc"),
        (
            2,
            ["a.nc", "b.nc", "-o", "-"],
            "-o -: only one program can be written to standard output; for 2 inputs name a folder",
        ),
        (2, ["a.nc", "-"], "-: standard input cannot be combined with other inputs"),
        (
            1,
            ["a.nc", "b.nc", "--report", "page.html"],
            "page.html: not a folder; with several inputs --report names a folder",
        ),
        (2, ["a.nc", "b.nc", "--save-plan", "p.toml"], "--save-plan: names one file"),
        (2, ["a.nc", "b.nc", "--machine", "haas-vf3"], "did you mean 'haas-vf2'"),
        (1, ["z*.nc", "a.nc"], "z*.nc: no file matches"),
        (2, ["a.nc", "-o", "-", "--json"], "--json and -o - both write to standard output"),
        (2, ["a.nc", "--output=-", "--json"], "--json and -o - both write to standard output"),
        (2, ["a.nc", "--report", "-"], "--report -: only a program can be written to standard output"),
    ],
    ids=str,
)
def test_what_cannot_be_meant_is_refused_before_anything_is_done(
    status: int, words: list[str], said: str, shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = {p: p.read_bytes() for p in shop.rglob("*") if p.is_file()}
    out, err = answered(capsys, "optimize", *words, status=status)
    assert out == "" and said in err and err.count("\n") == 1, err
    assert {p: p.read_bytes() for p in shop.rglob("*") if p.is_file()} == before


def test_drawings_among_several_inputs_end_as_programs_of_the_machine_do(
    shop: Path, capsys: pytest.CaptureFixture[str], examples: Path
) -> None:
    drawing = str(examples / "plate_10.dxf")
    (shop / "job.toml").write_text("[drill]\ndepth = 3\n")
    answered(
        capsys,
        "optimize",
        drawing,
        "a.nc",
        "-o",
        "out",
        "-q",
        "--options",
        "job.toml",
        "--machine",
        "mach4-router",
        *FAST,
    )
    assert sorted(p.name for p in (shop / "out").iterdir()) == ["a.nc", "batch.csv", "batch.html", "plate_10.tap"]


def test_simulate_takes_several_programs_and_strict_counts_for_each(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A rapid at Z−1 is a danger of one of them; the time in all is the sum."""
    (shop / "d.nc").write_text("G21 G90\nM3 S900\nG0 X0 Y0\nG0 Z-1\nG0 X50\nM5\nG0 Z5\nM2\n")
    answered(capsys, "simulate", "a.nc", "d.nc")
    out, _ = answered(capsys, "simulate", "[ad].nc", "--strict", "--json", status=1)
    rows = json.loads(out)["runs"]
    assert [(row["program"], row["status"]) for row in rows] == [("a.nc", 0), ("d.nc", 1)]
    assert rows[0]["time_s"] == leafcut.simulate("a.nc").measure.time_s
    out, err = answered(capsys, "simulate", "a.nc", "c.nc", "d.nc", status=1)
    assert out.split()[:3] == ["danger:", "d.nc:", "L801"] and "c.nc" in out and "c.nc:1" in err


def test_what_is_dangerous_in_one_of_several_programs_is_told_before_the_table(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As for a single program: position and kind."""
    (shop / "d.nc").write_text("G21 G90\nM3 S900\nG0 X0 Y0\nG0 Z-1\nG0 X50\nM5\nG0 Z5\nM2\n")
    out, _ = answered(capsys, "optimize", "a.nc", "d.nc", "--algorithm", "none")
    assert out.split()[:3] == ["danger:", "d.nc:", "L801"]
    assert "danger: L801" in " ".join(answered(capsys, "optimize", "d.nc", "--algorithm", "none")[0].split())


def test_verify_compares_two_programs_and_no_more(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "two programs, but 3 were given" in answered(capsys, "verify", "a.nc", "b.nc", "c.nc", status=2)[1]


def given(monkeypatch: pytest.MonkeyPatch, data: bytes) -> None:
    """Have some bytes come through standard input."""
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(data)))


def test_through_standard_input_and_output_goes_the_program_alone(
    shop: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The summary goes to standard error; the program equals that of the file, except for the name in its header."""
    given(monkeypatch, PROGRAM.encode())
    out, err = answered(capsys, "optimize", "-", "-o", "-", *FAST)
    assert fill_in_digest(out.replace("standard input", "a.nc")) == leafcut.optimize("a.nc", preset="fast").text
    assert "verified" in err and "standard output" in err
    given(monkeypatch, out.encode())
    assert answered(capsys, "verify", "a.nc", "-")[0].startswith("the same work")
    given(monkeypatch, out.encode())
    assert json.loads(answered(capsys, "simulate", "-", "--json")[0])["program"] == "standard input"
    assert sorted(p.name for p in shop.iterdir()) == ["a.nc", "b.nc", "c.nc", "other", "out"]


@pytest.mark.parametrize("name", ["plate_10.dxf", "board.drl", "holes.csv"])
def test_what_comes_through_standard_input_is_known_by_its_content(
    name: str, shop: Path, examples: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (shop / "board.drl").write_text("M48\nMETRIC\nT1C0.8\n%\nT1\nX10.0Y5.0\nX30.0Y5.0\nM30\n")
    (shop / "holes.csv").write_text("x,y,diameter\n1,2,3\n4,5,3\n")
    file = shop / name if (shop / name).exists() else examples / name
    given(monkeypatch, file.read_bytes())
    out, _ = answered(capsys, "optimize", "-", "--depth", "2", "--json", *FAST)
    expected = leafcut.optimize(file, depth=2, preset="fast")
    assert json.loads(out)["counts"]["holes"] == len(expected.part.holes)
    assert json.loads(out)["after"]["time_s"] == expected.after.time_s


def test_standard_input_is_read_within_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """What never ends is refused once it is larger than any program: no more than one byte beyond that is taken."""
    from leafcut.files import whole_files as files

    monkeypatch.setattr(files, "LARGEST_PROGRAM", 1000)
    asked: list[int] = []

    def read(size: int) -> bytes:
        asked.append(size)
        return b"x" * size

    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=SimpleNamespace(read=read)))
    with pytest.raises(leafcut.LeafcutError, match="standard input: is larger than"):
        StandardInput.read()
    assert asked == [1001]
    given(monkeypatch, b" \n")
    with pytest.raises(leafcut.LeafcutError, match="standard input: is empty"):
        StandardInput.read()
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(leafcut.LeafcutError, match="standard input: is empty"):
        StandardInput.read()


def test_a_refused_program_leaves_standard_output_empty(
    shop: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    given(monkeypatch, b"G21 G90\nG0 X1 Y2\nG1 X3 F100\nG1 X4 Y7\nG0 X0 Y0\nG1 X5 F\nM2\n")
    out, err = answered(capsys, "optimize", "-", "-o", "-", status=1)
    assert out == "" and err == "leafcut: standard input:6: 'F' is a letter without a number\n"


@pytest.mark.parametrize("plain", [{}, {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}], ids=["utf8", "ascii"])
def test_names_of_files_come_through_json_whole_whatever_the_locale(plain: dict[str, str], shop: Path) -> None:
    (shop / "Blech_ä→.nc").write_text(PROGRAM)
    # -S: in this locale, Python cannot read the path of an editable installation that is not ASCII.
    environment = {**os.environ, "LC_ALL": "C", "PYTHONPATH": os.pathsep.join(sys.path), **plain}
    words = [sys.executable, "-S", "-m", "leafcut", "simulate", "Blech_ä→.nc", "--json"]
    done = subprocess.run([os.fsencode(word) for word in words], env=environment, capture_output=True, check=True)
    found: dict[str, Any] = json.loads(done.stdout)
    assert found["program"] == "Blech_ä→.nc"


BOARD = "M48\nMETRIC,TZ\nFMAT,2\n{}%\nG05\n{}T0\nM30\n"
PLATED = BOARD.format("T1C0.8\nT2C3.2\n", "T1\nX10.0Y5.0\nX30.0Y5.0\nX22.5Y17.0\nT2\nX4.0Y4.0\n")
OTHER = BOARD.format("T1C3.2\n", "T1\nX4.0Y4.0\nX50.0Y30.0\nG00X40.0Y2.0\nM15\nG01X44.0Y2.0\nM16\nG05\n")


@pytest.fixture
def board(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with the two drill files of a board; one hole stands in both."""
    (tmp_path / "board-PTH.drl").write_text(PLATED)
    (tmp_path / "board-NPTH.drl").write_text(OTHER)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_drill_files_of_a_board_make_one_program_and_gerbonara_sees_the_same_holes(
    board: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Three tools: 0.8 mm, 3.2 mm of both files, and a slot mill of 3.2 mm."""
    from gerbonara.excellon import ExcellonFile

    files = ["board-PTH.drl", "board-NPTH.drl"]
    out, _ = answered(capsys, "optimize", *files, "-o", "board.nc", "--depth", "2", "--json")
    found = json.loads(out)
    assert (found["counts"]["holes"], found["counts"]["slots"], found["counts"]["tools"]) == (5, 1, 3)
    assert found["input"] == "board-PTH.drl + board-NPTH.drl"
    told = {issue["code"]: issue["message"] for issue in found["issues"]}
    assert "board-PTH.drl 4 holes, board-NPTH.drl 2 holes and 1 slot" in told["L409"]
    assert "merged 1" in told["L301"]
    drawn = [hole for file in files for hole in ExcellonFile.open(board / file).drills()]
    expected = {(round(h.x, 3), round(h.y, 3), round(h.tool.diameter, 3)) for h in drawn}
    outcome = leafcut.optimize(files, depth=2)
    assert {(h.x, h.y, h.diameter) for h in outcome.part.holes} == expected
    assert (board / "board.nc").read_text() == outcome.text


def test_in_a_folder_every_drill_file_has_a_program_of_its_own(board: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (board / "out").mkdir()
    answered(capsys, "optimize", "board*.drl", "-o", "out", "--depth", "2", "-q")
    assert sorted(p.name for p in (board / "out").glob("*.ngc")) == ["board-NPTH.ngc", "board-PTH.ngc"]


def test_drill_files_of_a_board_have_one_zero(board: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A corner of the holes differs between the files; a point is common, and a combined program has a single zero."""
    (board / "out").mkdir()
    _, told = answered(
        capsys, "optimize", "board*.drl", "-o", "out", "--depth", "2", "--origin", "lower-left", status=2
    )
    assert "its own zero" in told and not list((board / "out").iterdir())
    answered(capsys, "optimize", "board*.drl", "-o", "out", "--depth", "2", "--origin", "1,2", "-q")
    answered(capsys, "optimize", "board*.drl", "-o", "all.ngc", "--depth", "2", "--origin", "lower-left", "-q")


def test_drill_files_that_lie_far_apart_are_warned_of(board: Path) -> None:
    (board / "board-NPTH.drl").write_text(BOARD.format("T1C3.2\n", "T1\nX200.0Y200.0\n"))
    outcome = leafcut.optimize(["board-PTH.drl", "board-NPTH.drl"], depth=2, machine="linuxcnc-sim")
    assert [i.severity for i in outcome.issues if i.code == "L409"] == ["note", "warning"]
    with pytest.raises(
        leafcut.LeafcutError,
        match=(
            r"--strict: L409 .*lie far apart; check that they belong to the same board and have the same origin and "
            r"units"
        ),
    ):
        leafcut.optimize(["board-PTH.drl", "board-NPTH.drl"], depth=2, machine="linuxcnc-sim", strict=True)


def test_one_program_is_made_of_drill_files_only(board: Path, examples: Path) -> None:
    with pytest.raises(
        leafcut.LeafcutError, match=r"only drill files can be combined .*plate_10\.dxf is not a drill file"
    ):
        leafcut.optimize(["board-PTH.drl", examples / "plate_10.dxf"], depth=2)


def test_of_several_drill_files_one_may_be_empty_and_one_that_only_lost_its_holes_may_not(tmp_path: Path) -> None:
    """KiCad writes a file of holes that are not plated for each board."""
    texts = {
        "b-PTH.drl": "M48\nMETRIC\nT1C0.8\n%\nG90\nT1\nX10.0Y5.0\nX30.0Y5.0\nM30\n",
        "b-NPTH.drl": "M48\nFMAT,2\nMETRIC\n%\nG90\nG05\nT0\nM30\n",
        "lost.drl": "M48\nMETRIC\nT1C0.8\n%\nG90\nT1\nM30\n",
    }
    plated, empty, lost = (tmp_path / name for name in texts)
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    outcome = leafcut.optimize([plated, empty], depth=2, preset="fast")
    assert len(outcome.part.holes) == 2
    told = [(issue.severity, issue.message) for issue in outcome.issues if issue.code == "L409"]
    assert told[-1] == ("note", "b-NPTH.drl has no holes and no tools")
    for files in ([plated, lost], [empty, empty], [empty]):
        with pytest.raises(leafcut.LeafcutError, match="no holes"):
            leafcut.optimize(files, depth=2)


@pytest.mark.parametrize(
    "words",
    [
        "nest - -o sheet.dxf",
        "drill a.nc --options -",
        "drill a.nc --tools -",
        "machine check - --measured 3s --machine haas-vf2",
        "machine new --answers -",
        "stock a.nc --same-as -",
        "tools import -",
    ],
)
def test_what_is_not_taken_from_standard_input_is_refused_by_name(
    words: str, shop: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is read from it."""
    monkeypatch.setattr(sys, "stdin", None)
    out, err = answered(capsys, *words.split(), status=2)
    assert out == "" and "standard input" in err and "name " in err and err.count("\n") == 1, err


@pytest.mark.parametrize(
    "words", ["stock a.nc -o -", "solve random:9 --tour -", "reorder a.nc --report -", "cut a.nc --save-plan -"]
)
def test_nothing_but_a_program_or_a_nest_goes_to_standard_output(
    words: str, shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """And no file is made that is called a dash."""
    assert run(words.split()) != 0
    said = capsys.readouterr()
    assert said.out == "" and "only a program can be written to standard output" in said.err, said.err
    assert not (shop / "-").exists()


def test_a_nest_of_one_sheet_goes_through_standard_output_and_is_cut_from_standard_input(
    shop: Path, examples: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two sheets neither goes there."""
    nest = ["nest", f"{examples / 'bracket.dxf'}:2", "--nester", "rectangles", *FAST, "-o", "-"]
    out, err = answered(capsys, *nest, "--sheet", "800x800")
    assert "SECTION" in out.split() and "SECTION" not in err and "standard output" in err
    given(monkeypatch, out.encode())
    found = json.loads(answered(capsys, "cut", "-", "--thickness", "3", "--json", *FAST)[0])
    assert found["counts"]["parts"] == 2
    out, err = answered(capsys, *nest, str(examples / "gusset.svg"), "--sheet", "200x160", status=2)
    assert out == "" and "the nest has 2 drawings" in err
    assert "--json and -o -" in answered(capsys, *nest, "--json", status=2)[1]
