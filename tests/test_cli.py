"""The command line's contract: exit status, one clear line, and JSON and nothing else on standard output."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.cli.progress import Reporter
from leafcut.files.digests import DIGEST_LINE, fill_in_digest
from leafcut.model.heartbeat import Progress
from leafcut.nesting.options import NestOptions
from leafcut.options import SolveOptions, SpeedOptions, StockOptions
from leafcut.options.option_spec import flag_name
from leafcut.processes.settings import all_options, collect_settings


def answer(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> tuple[str, str]:
    """Run a command line in this process; return its standard output and standard error."""
    assert run(arguments) == status
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    return captured.out, captured.err


def test_optimize_answers_with_the_keys_of_the_contract(
    capsys: pytest.CaptureFixture[str], examples: Path, tmp_path: Path
) -> None:
    out = tmp_path / "p.ngc"
    text, _ = answer(capsys, "optimize", str(examples / "plate_10.dxf"), "-o", str(out), "--json", "--thickness", "6mm")
    found = json.loads(text)
    wanted = {"input", "output", "process", "counts", "before", "after", "saved_percent", "lower_bound", "gap_percent",
              "verified", "issues"}  # fmt: skip
    assert wanted <= found.keys()
    assert found["before"].keys() == {"travel_mm", "cut_mm", "time_s"} == found["after"].keys()
    assert found["verified"] is True
    assert found["counts"]["holes"] == 10
    assert out.read_text().rstrip().endswith("M2")


def test_solve_answers_with_the_keys_of_the_contract(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """A square of four points and its middle: 1 + 1 + 1 + 2·√½ long."""
    points, tour = tmp_path / "square.csv", tmp_path / "square.tour"
    points.write_text("x,y\n0,0\n1,0\n1,1\n0,1\n0.5,0.5\n")
    text, _ = answer(capsys, "solve", str(points), "--tour", str(tour), "--json")
    found = json.loads(text)
    assert found.keys() == {
        "schema",
        "instance",
        "n",
        "algorithm",
        "seed",
        "length",
        "optimum",
        "gap_percent",
        "lower_bound",
        "seconds",
        "iterations",
        "history",
        "workers",
        "stopped_early",
        "issues",
    }
    assert found["length"] == pytest.approx(3 + 2 * 0.5**0.5)
    numbers = tour.read_text().split("TOUR_SECTION")[1].split()[:-2]
    assert sorted(int(v) for v in numbers) == [1, 2, 3, 4, 5]


def test_solve_tells_the_gap_to_the_known_optimum_else_to_the_bound_and_both_in_words(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The 2 × 1 rectangle with the middles of its long sides: 6 round, 20 % above 5, 25 % above 4.8."""
    monkeypatch.setattr("leafcut.order.certificate.lower_bound", lambda *_, **__: 4.8)
    points = "0 0", "1 0", "2 0", "2 1", "1 1", "0 1"
    rows = "\n".join(f"{k} {p}" for k, p in enumerate(points, 1))
    file = tmp_path / "six.tsp"
    file.write_text(f"NAME: six\nTYPE: TSP\nDIMENSION: 6\nEDGE_WEIGHT_TYPE: EUC_2D\nNODE_COORD_SECTION\n{rows}\nEOF\n")
    found = json.loads(answer(capsys, "solve", str(file), "--json")[0])
    assert (found["length"], found["optimum"], found["lower_bound"]) == (6.0, None, 4.8)
    assert found["gap_percent"] == pytest.approx(25.0)
    (tmp_path / "optima.csv").write_text("name,n,optimal_length\nsix,6,5\n")
    found = json.loads(answer(capsys, "solve", str(file), "--json")[0])
    assert (found["optimum"], found["lower_bound"]) == (5.0, 4.8)
    assert found["gap_percent"] == pytest.approx(20.0)
    words, _ = answer(capsys, "solve", str(file))
    assert "20.000 % above the best known length, 5\n" in words
    assert "at most 25.00 % above the shortest possible (lower bound 4.8)\n" in words
    words, _ = answer(capsys, "solve", str(file), "--no-bound")
    assert "at most" not in words


def test_a_program_can_be_simulated_and_compared(
    capsys: pytest.CaptureFixture[str], examples: Path, tmp_path: Path
) -> None:
    one, two = tmp_path / "one.ngc", tmp_path / "two.ngc"
    plate = str(examples / "plate_10.dxf")
    answer(capsys, "optimize", plate, "-o", str(one), "-q", "--thickness", "6")
    answer(capsys, "optimize", plate, "-o", str(two), "-q", "--thickness", "6", "--algorithm", "none")
    simulated = json.loads(answer(capsys, "simulate", str(one), "--machine", "linuxcnc-mill", "--json")[0])
    assert {"time_s", "rapid_mm", "feed_mm", "by_kind", "extents", "issues"} <= simulated.keys()
    assert simulated["time_s"] == pytest.approx(sum(simulated["by_kind"].values()))
    assert simulated["time_s"] == pytest.approx(leafcut.optimize(plate, thickness=6).after.time_s, rel=1e-3)
    assert simulated["issues"] == []
    proof = json.loads(answer(capsys, "verify", str(one), str(two), "--json")[0])
    assert (proof["same"], proof["differences"]) == (True, [])
    assert proof["before"]["holes"] == proof["after"]["holes"] == 10
    lines = two.read_text().splitlines()
    hole = next(k for k, line in enumerate(lines) if line.startswith("G99 G81"))
    del lines[hole + 2]
    two.write_text("\n".join(lines))
    found = json.loads(answer(capsys, "verify", str(one), str(two), "--json", status=1)[0])
    assert not found["same"]
    assert found["differences"]


def test_what_there_is_can_be_listed(capsys: pytest.CaptureFixture[str]) -> None:
    for kind, name in (("machines", "haas-vf2"), ("algorithms", "mmas"), ("formats", "dxf")):
        assert name in answer(capsys, "list", kind)[0]
        assert name in [row["name"] for row in json.loads(answer(capsys, "list", kind, "--json")[0])[kind]]


def test_a_machine_shown_can_be_saved_and_used_again(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The same program, byte for byte, but for the name of the option."""
    own = tmp_path / "my.toml"
    own.write_text(answer(capsys, "list", "machines", "haas-vf2")[0], encoding="utf-8")
    shown = leafcut.optimize(PLATE, machine=str(own), thickness=5).text
    assert (
        fill_in_digest(shown.replace("--machine my.toml", "--machine haas-vf2"))
        == leafcut.optimize(PLATE, machine="haas-vf2", thickness=5).text
    )
    profile = json.loads(answer(capsys, "list", "machines", str(own), "--json")[0])
    assert (profile["name"], profile["profile"]) == ("haas-vf2", own.read_text(encoding="utf-8"))
    assert "did you mean 'haas-vf2'" in answer(capsys, "list", "machines", "haas-vf3", status=2)[1]


PLATE = "example:plate-10"
REFUSED = [
    (1, ["optimize", "nothing.dxf"], "file not found"),
    (1, ["optimize", "empty.dxf"], "empty"),
    (1, ["optimize", "garbage.dxf"], "garbage.dxf"),
    (1, ["optimize", "cut.dxf"], "cut.dxf"),
    (1, ["optimize", "lines.dxf"], "no holes"),
    (1, ["optimize", "bomb.xml"], "bomb.xml"),
    (1, ["optimize", "outside.xml"], "outside.xml"),
    (1, ["optimize", "far.csv"], "far.csv"),
    (2, ["optimize", PLATE, "--no-such-option", "1"], "--no-such-option"),
    (2, ["optimize", PLATE, "--n-antz", "1"], "--n-ants"),
    (2, ["optimize", PLATE, "--machine", "haas-vf3"], "did you mean 'haas-vf2'"),
    (2, ["optimize", PLATE, "--algorithm", "mmass"], "did you mean 'mmas'"),
    (2, ["optimize", PLATE, "--depth", "deep"], "--depth"),
    (2, ["optimize", PLATE, "--depth", "-3"], "--depth"),
    (2, ["optimize", PLATE, "--depth", "nan"], "--depth"),
    (2, ["optimize", PLATE, "--depth", "1e9"], "maximum"),
    (2, ["optimize", PLATE, "--time-limit", "2 lightyears"], "lightyears"),
    (2, ["optimize", PLATE, "--options", "wrong.toml"], "n_antz"),
    (2, ["optimize", PLATE, "--target-gap", "2%"], "--target-gap was removed"),
    (2, ["optimize", PLATE, "--process", "weld"], "--process"),
    (1, ["optimize", "example:plate-11"], "plate-10"),
    (2, ["optimize"], "INPUT"),
    (2, ["polish", "x"], "polish"),
    (1, ["optimize", PLATE, "--machine", "grbl-3018", "--depth", "3", "--work-offset", "1000,0,0"], "travel"),
    (1, ["optimize", "example:board-200", "--depth", "3", "--machine", "grbl-3018"], "travel"),
    (1, ["optimize", PLATE, "--thickness", "80", "--tools", "tools.toml"], "deep"),
    (1, ["optimize", PLATE, "--thickness", "5", "--tools", "other.toml"], "no drill of 6.35"),
    (1, ["optimize", PLATE, "-o", "no/such/folder/p.nc"], "no folder"),
    (1, ["optimize", PLATE, "-o", "."], "folder"),
    (1, ["optimize", "some.csv", "-o", "some.csv"], "never overwritten"),
    (1, ["optimize", "some.csv", "-o", "./some.csv"], "never overwritten"),
    (1, ["optimize", "some.csv", "--report", "some.csv"], "never overwritten"),
    (1, ["optimize", "some.csv", "-o", "p.nc", "--report", "p.nc"], "never overwritten"),
    (1, ["solve", "nothing.tsp"], "file not found"),
    (1, ["simulate", "nothing.nc"], "cannot be read"),
    (1, ["simulate", "empty.dxf"], "empty"),
    (1, ["simulate", "garbage.dxf"], "garbage.dxf: this is a binary file"),
    (1, ["verify", "nothing.nc", "nothing.nc"], "cannot be read"),
]


def lay_out(folder: Path) -> None:
    """Make the wrong files that the table names."""
    (folder / "empty.dxf").write_bytes(b"")
    (folder / "garbage.dxf").write_bytes(bytes(range(256)) * 40)
    (folder / "cut.dxf").write_text("  0\nSECTION\n  2\nENTITIES\n  0\nCIRCLE\n 10\n1.0\n 20\n")
    (folder / "lines.dxf").write_text(
        "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\n0\n20\n0\n11\n5\n21\n5\n0\nENDSEC\n0\nEOF\n"
    )
    entities = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 12))
    (folder / "bomb.xml").write_text(
        f'<!DOCTYPE m [<!ENTITY e0 "x">{entities}]><map><city x="1" y="2">&e11;</city></map>'
    )
    (folder / "outside.xml").write_text(
        '<!DOCTYPE m [<!ENTITY e SYSTEM "file:///etc/passwd">]><map><city x="1" y="2">&e;</city></map>'
    )
    (folder / "far.csv").write_text("x,y\nnan,1\n1e300,2\n")
    (folder / "some.csv").write_text("x,y\n0,0\n5,5\n")
    (folder / "wrong.toml").write_text("[aco]\nn_antz = 3\n")
    tool = '[[tool]]\nnumber = 1\nkind = "drill"\ndiameter = "{}mm"\nfeed = "100 mm/min"\nspindle_speed = "900 rpm"\n'
    (folder / "tools.toml").write_text(tool.format(6.35) + 'flute_length = "40mm"\n')
    (folder / "other.toml").write_text(tool.format(5))


@pytest.mark.parametrize(
    ("status", "arguments", "words"), REFUSED, ids=lambda v: " ".join(v) if isinstance(v, list) else ""
)
def test_bad_input_gets_one_clear_line_and_writes_nothing(
    status: int,
    arguments: list[str],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    lay_out(tmp_path)
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    out, err = answer(capsys, *arguments, status=status)
    assert out == ""
    assert err.startswith("leafcut: ")
    assert err.count("\n") == 1, err
    assert words in err
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


def test_a_refusal_tells_that_the_program_of_an_earlier_run_is_still_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    program = tmp_path / "plate.ngc"
    words = ["optimize", "example:plate-10", "--output", str(program)]
    assert run([*words, "--seed", "x"]) == 2
    assert str(program) not in capsys.readouterr().err
    before = fill_in_digest(f"({DIGEST_LINE})\nG0 X1\n")
    program.write_text(before)
    assert run([*words, "--seed", "x"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].endswith(f"; {program} was not changed")
    assert program.read_text() == before


def test_an_output_that_may_not_be_written_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(leafcut.LeafcutError, match="no permission to write"):
        leafcut.optimize("no such drawing.dxf", tmp_path / "p.nc")


def interrupt_at(words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulate Ctrl-C when the progress first shows `words`."""

    def call(self: Reporter, progress: Progress) -> None:
        if progress.step.startswith(words):
            raise KeyboardInterrupt

    monkeypatch.setattr(Reporter, "__call__", call)


def test_ctrl_c_in_the_search_keeps_the_best_and_writes_a_whole_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "p.ngc"
    interrupt_at("ordering", monkeypatch)
    text, _ = answer(
        capsys, "optimize", "random:80", "-o", str(out), "--depth", "3", "--iterations", "1000000", "--json"
    )
    assert json.loads(text)["verified"]
    assert out.read_text().rstrip().endswith("M2")
    assert out.read_text().count("\nX") + out.read_text().count("\nY") >= 70


def test_ctrl_c_elsewhere_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    interrupt_at("verifying", monkeypatch)
    _, err = answer(capsys, "optimize", PLATE, "-o", str(tmp_path / "p.ngc"), "--depth", "3", status=1)
    assert err == "leafcut: interrupted; nothing was written\n"
    assert list(tmp_path.iterdir()) == []


def test_every_option_is_a_flag_of_the_command_that_it_is_for(capsys: pytest.CaptureFixture[str]) -> None:
    commands = ("optimize", "nest", "stock", "tools speeds")
    texts = {command: answer(capsys, *command.split(), "--help-all")[0] for command in commands}
    command = {NestOptions: "nest", StockOptions: "stock", SpeedOptions: "tools speeds"}
    for group, name, spec in all_options():
        text = texts[command.get(group, "optimize")]
        assert flag_name(name) in text, name
        assert spec.help.split()[0] in text


def test_a_file_of_options_means_the_same_as_the_options_themselves(tmp_path: Path) -> None:
    options = tmp_path / "o.toml"
    options.write_text(
        '[machine]\nmachine = "haas-vf2"\n[drill]\npeck = "2mm"\nthickness = 6.0\n'
        '[aco]\nn_ants = 7\n[solve]\nalgorithm = "acs"\niterations = 3\nseed = 4\n'
    )
    given = {"machine": "haas-vf2", "peck": "2mm", "thickness": "6mm", "algorithm": "acs", "n_ants": "7"}
    given |= {"iterations": 3, "seed": 4}
    assert leafcut.optimize(PLATE, options_file=options).text == leafcut.optimize(PLATE, **given).text


def test_the_header_holds_what_it_takes_to_make_the_program_again() -> None:
    text = leafcut.optimize(PLATE, peck="2mm", thickness="0.25in", iterations=2, seed=11, threads=1).text
    head = text[:600]
    for words in (
        "seed 11",
        "--peck 2mm",
        "--thickness 6.35mm",
        "--iterations 2",
        "linuxcnc-mill",
        leafcut.__version__,
    ):
        assert words in head
    assert "--threads" not in text


def test_settings_are_checked_when_they_are_made() -> None:
    with pytest.raises(leafcut.LeafcutError, match="minimum"):
        SolveOptions(iterations=-1)
    assert collect_settings({"depth": "0.1in"}).job.depth == pytest.approx(2.54)


def test_quiet_still_warns_of_lost_holes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "odd.csv").write_text("x,y,diameter\n0,0,3\n9,oops,3\n5,5,3\n")
    out, err = answer(capsys, "optimize", str(tmp_path / "odd.csv"), "-q", "--thickness", "2", status=3)
    assert out == ""
    assert "missing: L208" in err
    assert "odd.csv" in err or "line 3" in err or ":3" in err


@pytest.mark.parametrize(
    ("head", "machine", "shown", "hidden"),
    [
        (
            "(o=0, pd=0.1, ph=3, ch=1, fr=900)\nM3 $0 S1",
            "plasma-table",
            ("feed moves", "piercing"),
            ("spindle", "tool", "dwell", "Z "),
        ),
        ("M3 S900", "linuxcnc-mill", ("cutting", "spindle", "Z -1.000 to 5.000"), ("piercing", "tool", "dwell")),
    ],
)
def test_simulate_uses_the_terms_of_the_machine_and_leaves_out_axes_without_positions(
    head: str,
    machine: str,
    shown: tuple[str, ...],
    hidden: tuple[str, ...],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    program, z = tmp_path / "cut.ngc", ("G0 Z5\n", "G1 Z-1 F100\n") if machine == "linuxcnc-mill" else ("", "")
    program.write_text(
        f"G21 G90\n{z[0]}G0 X1 Y1\n{head}\n{z[1]}G1 X20 F900\nM5{' $0' * (not z[0])}\n{z[0]}G0 X0 Y0\nM2\n"
    )
    said = answer(capsys, "simulate", str(program), "--machine", machine)[0]
    assert all(words in said for words in shown) and not any(words in said for words in hidden)
    found = json.loads(answer(capsys, "simulate", str(program), "--machine", machine, "--json")[0])["extents"]
    assert found == {"x": [0.0, 20.0], "y": [0.0, 1.0], "z": [-1.0, 5.0] if z[0] else None}


def test_simulate_says_a_danger_once_and_how_often_it_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    program = tmp_path / "still.ngc"
    program.write_text("G21 G90\nT1 M6\nG0 Z5\nG0 X0 Y0\nG1 Z-1 F100\n" + "X5\nX0\n" * 30 + "G0 Z5\nM2\n")
    lines = answer(capsys, "simulate", str(program))[0].splitlines()
    (said,) = [line for line in lines if line.startswith("warning")]
    assert "never starts the spindle" in said and said.endswith("(line 5)")
    program.write_text("G21 G90\nM3 S900\nM5\nG0 Z5\nG0 X0 Y0\nG1 Z-1 F100\n" + "X5\nX0\n" * 30 + "G0 Z5\nM2\n")
    (said,) = [line for line in answer(capsys, "simulate", str(program))[0].splitlines() if line.startswith("danger")]
    assert "61 cuts with the spindle off" in said and said.endswith("(line 6)")
