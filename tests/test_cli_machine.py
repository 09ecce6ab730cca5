"""The commands `machine` and `tools`: files are written whole, and never over an input; the answers of `--json`."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut.cli.app import run
from leafcut.read.machine import load_machine
from leafcut.read.tools import load_tools

SETTINGS = Path(__file__).parent / "read" / "settings"
PROGRAM = "G21 G90 G64\nG0 Z5\nG1 Z0 F3000\n{}M2\n"


def zigzag(turns: int, width: float) -> str:
    return PROGRAM.format("".join(f"G1 X{width if k % 2 == 0 else 0}\nG1 Y{k + 1}\n" for k in range(turns)))


def hopping(holes: int, step: float) -> str:
    return PROGRAM.format(
        "".join(f"G0 Z5\nG0 X{step * k} Y{step * (k % 3)}\nG4 P0.1\nG1 Z-1\nG4 P0.1\n" for k in range(holes))
    )


@pytest.fixture
def programs(tmp_path: Path) -> dict[str, Path]:
    made = {"zig.nc": zigzag(200, 20.0), "short.nc": zigzag(400, 3.0), "holes.nc": hopping(60, 30.0)}
    for name, text in made.items():
        (tmp_path / name).write_text(text)
    return {name: tmp_path / name for name in made}


@pytest.fixture
def slow(tmp_path: Path) -> str:
    """Return a profile of a router of 0.6 of the accelerations and thrice the corner value of the shipped one."""
    text = (Path(leafcut.__file__).parent / "machines" / "mach3-router.toml").read_text(encoding="utf-8")
    text = text.replace('["600 mm/s2", "600 mm/s2", "400 mm/s2"]', '["360 mm/s2", "360 mm/s2", "240 mm/s2"]')
    file = tmp_path / "slow.toml"
    file.write_text(text.replace('deviation = "0.05 mm"', 'deviation = "0.15 mm"'), encoding="utf-8")
    return str(file)


def seconds(file: Path, machine: str) -> float:
    return leafcut.simulate(str(file), machine=machine).measure.time_s


def answer(words: list[str], capsys: pytest.CaptureFixture[str], status: int = 0) -> Any:
    assert run([*words, "--json"]) == status
    return json.loads(capsys.readouterr().out)


def refused(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert run(words) in (1, 2)
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith("leafcut: ")
    return lines[0]


def test_an_import_is_printed_or_written_and_told_with_its_sources(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = str(SETTINGS / "grbl_3018.txt"), tmp_path / "my.toml"
    assert run(["machine", "import", source]) == 0
    printed = capsys.readouterr()
    assert run(["machine", "import", source, "-o", str(out)]) == 0
    told = capsys.readouterr().out
    digest, _, text = out.read_text(encoding="utf-8").partition("\n")
    assert digest.startswith("# leafcut digest") and text == printed.out and "note: homing is off" in printed.err
    assert "assumed" in told and f"--machine {out}" in told.replace("\n", "")
    assert load_machine(str(out)).rapid_velocity[0] == pytest.approx(2000 / 60)
    found = answer(["machine", "import", source], capsys)
    assert found["profile"] == printed.out and found["kind"] == "grbl"
    rapid = next(value for value in found["values"] if value["key"] == "rapid.velocity")
    assert (rapid["how"], "$110 = 2000.000" in rapid["source"]) == ("taken", True)


def test_settings_come_through_standard_input(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    data = (SETTINGS / "grbl_laser.txt").read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(data)))
    assert answer(["machine", "import", "-"], capsys)["title"] == "GRBL 1.1f.20170801"


def test_nothing_is_written_over_an_input_or_by_halves(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ini, out = tmp_path / "a.toml", tmp_path / "out.toml"
    ini.write_bytes((SETTINGS / "linuxcnc_mm.ini").read_bytes())
    assert "never overwritten" in refused(["machine", "import", str(ini), "-o", str(ini)], capsys)
    assert ini.read_bytes() == (SETTINGS / "linuxcnc_mm.ini").read_bytes()
    grbl = str(SETTINGS / "grbl_3018.txt")
    assert run(["machine", "import", grbl, "-o", str(out)]) == run(["machine", "import", grbl, "-o", str(out)]) == 0
    old = out.read_text()
    bad = tmp_path / "bad.txt"
    bad.write_text("$110=1e9\n$111=1\n$112=1\n$120=1\n$121=1\n$122=1\n")
    assert "more than any machine has" in refused(["machine", "import", str(bad), "-o", str(out)], capsys)
    assert out.read_text() == old and sorted(f.name for f in tmp_path.iterdir()) == ["a.toml", "bad.txt", "out.toml"]
    out.write_text(old + "# measured\n")
    assert "does not show an unchanged file of leafcut" in refused(["machine", "import", grbl, "-o", str(out)], capsys)
    assert "ends in .toml" in refused(["machine", "import", str(bad), "-o", str(tmp_path / "x.txt")], capsys)
    assert "no folder" in refused(["machine", "import", str(bad), "-o", str(tmp_path / "no" / "x.toml")], capsys)
    assert "printed if you leave out -o" in refused(["machine", "import", str(bad), "-o", "-"], capsys)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("machine imprt x", "did you mean 'import'"),
        ("machine", ""),
        ("machine import", "machine import needs FILE, or --port"),
        ("machine import x.txt --port /dev/none", "takes FILE or --port, not both"),
        ("machine import x.txt --baud 9600", "--baud goes with --port"),
        ("machine import --port /dev/none", "--port /dev/none does not exist"),
        ("machine import --port /dev/null", "not a serial port"),
        ("machine import --port /dev/null --baud 9601", "--baud 9601"),
        ("machine import x --knd grbl", "did you mean '--kind'"),
        ("machine new --controler haas", "did you mean '--controller'"),
        ("machine new extra", "machine new takes no input"),
        ("machine check a.nc --measured 1:00", "--machine needs a value|needs --machine"),
        ("machine check --machine haas-vf2", "needs programs with --measured, or --times"),
        ("machine check a.nc b.nc --measured 1:00 --machine haas-vf2", "1 time for 2 programs"),
        ("machine check a.nc --measured 1:99 --machine haas-vf2", "is not a valid time.*write it as 12:34"),
        ("machine check a.nc --measured soon --machine haas-vf2", "'soon' is not a number"),
        ("machine check a.nc --measured 0 --machine haas-vf2", "is not above 0"),
        ("machine check a.nc --measured 1:00 --machine haas-vf3", "did you mean 'haas-vf2'"),
        ("machine check a.nc --measured 1:00 --times t.csv --machine haas-vf2", "leave out other programs"),
        ("machine check a.nc --measured 1:00 --machine haas-vf2 -o x.toml", "time at least two"),
        ("machine check none.nc --measured 1:00 --machine haas-vf2", "none.nc: cannot be read"),
        ("machine check --times none.csv --machine haas-vf2", "none.csv: cannot be read"),
        ("tools import x.csv --units ft", "'ft' is not mm or in"),
        ("tools imprt", "did you mean 'import'"),
    ],
)
def test_a_wrong_command_line_is_told_in_one_line(
    words: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import re

    monkeypatch.chdir(tmp_path)
    if not told:
        assert run(words.split()) == 0 and "check" in capsys.readouterr().out
        return
    line = refused(words.split(), capsys)
    assert re.search(told, line), line


def test_answers_come_from_flags_or_a_file_where_there_is_no_terminal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "answers.toml").write_text('controller = "haas"\nrapid = "1000 ipm"\ntool-changer = false\n')
    out = str(tmp_path / "vf.toml")
    words = ["machine", "new", "--answers", str(tmp_path / "answers.toml"), "--name", "VF", "-o", out]
    assert run(words) == 0
    machine = load_machine(out)
    assert (machine.name, machine.controller, machine.tool_changer) == ("VF", "haas", False)
    capsys.readouterr()
    assert "needs --rapid" in refused(["machine", "new", "--name", "x", "--controller", "haas"], capsys)
    assert "unknown answer 'speed'" in refused_answers('speed = "1"\n', tmp_path, capsys)
    assert "not a TOML file" in refused_answers("speed = \n", tmp_path, capsys)
    assert "file not found" in refused(["machine", "new", "--answers", "none.toml"], capsys)


def refused_answers(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    (folder / "wrong.toml").write_text(text)
    return refused(["machine", "new", "--answers", str(folder / "wrong.toml")], capsys)


def test_on_a_terminal_questions_are_asked_on_standard_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setattr(sys, "stdin", Terminal("Mill\ngrbl\n" + "\n" * 20))
    assert run(["machine", "new", "--rapid", "2 m/min"]) == 0
    told = capsys.readouterr()
    assert 'controller = "grbl"' in told.out and "name of the machine: " in told.err and "[10 mm/s2]" in told.err
    monkeypatch.setattr(sys, "stdin", Terminal("Mill\n"))
    assert run(["machine", "new"]) == 2
    assert "the answers ended" in capsys.readouterr().err


def test_a_stop_watch_and_one_program_are_compared_and_change_nothing(
    programs: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    own = seconds(programs["zig.nc"], "mach3-router")
    words = ["machine", "check", str(programs["zig.nc"]), "--machine", "mach3-router", "--measured"]
    found = answer([*words, f"{1.25 * own:.3f}s"], capsys)
    (row,) = found["programs"]
    assert row["measured_s"] == pytest.approx(1.25 * own, abs=1e-3) and row["before_s"] == pytest.approx(own)
    assert found["acceleration"] is None and "measure at least two" in found["held"]["acceleration"]
    assert run([*words, "12:34"]) == 0
    assert "12 min 34 s" in capsys.readouterr().out


def test_several_measured_programs_give_a_profile_that_takes_their_time(
    programs: dict[str, Path], slow: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The times are those of a machine with 0.6 times the accelerations and three times the corner value, to 0.1 s."""
    out = tmp_path / "fitted.toml"
    truth = {str(file): round(seconds(file, slow), 1) for file in programs.values()}
    words = ["machine", "check", *truth, "--machine", "mach3-router", "-o", str(out)]
    words += [word for time in truth.values() for word in ("--measured", f"{time}s")]
    found = answer(words, capsys)
    assert found["acceleration"] == pytest.approx(0.6, rel=0.02) and found["corner_mm"] == pytest.approx(0.15, rel=0.05)
    assert found["rms_after_s"] < 0.1 and found["rms_before_s"] > 1.0 and found["output"] == str(out)
    fitted = load_machine(str(out))
    assert fitted.acceleration == pytest.approx((360, 360, 240), rel=0.02)
    assert "fitted to 3 measured programs" in fitted.sources["rapid.acceleration"]
    for file, time in truth.items():
        assert seconds(Path(file), str(out)) == pytest.approx(time, abs=0.15)
    table = tmp_path / "times.csv"
    table.write_text("program,seconds\n" + "".join(f"{Path(file).name},{time}\n" for file, time in truth.items()))
    same = answer(["machine", "check", "--times", str(table), "--machine", "mach3-router"], capsys)
    assert (same["acceleration"], same["condition"]) == (found["acceleration"], found["condition"])
    assert run(["machine", "check", "--times", str(table), "--machine", "mach3-router"]) == 0
    told = capsys.readouterr().out
    assert "as many parameters as programs" not in told
    words = ["machine", "check", *list(truth)[1:], "--machine", "mach3-router"]
    assert run([*words, *(f"--measured={truth[file]}s" for file in list(truth)[1:])]) == 0
    assert "as many parameters as programs" in capsys.readouterr().out
    assert "root mean square" in told and "condition" in told and "accelerations: 0.6" in told


def test_what_cannot_be_fitted_is_not_written(
    programs: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "fitted.toml"
    words = ["machine", "check", str(programs["zig.nc"]), str(programs["holes.nc"]), "--machine", "mach3-router"]
    assert run([*words, "--measured", "9:00:00", "--measured", "1s", "-o", str(out)]) == 1
    assert "was not written" in capsys.readouterr().out and not out.exists()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "has no row"),
        ("program,seconds\n", "has no row"),
        ("a.nc,1\nb.nc,soon\n", ":2: 'soon' is not a number"),
        ("a.nc\n", ":1: 'a.nc' is not program,seconds"),
        ("a.nc,0\nb.nc,0\n", ":2: '0' is not above 0"),
        ("a.nc,1\n" * 1001, "more than 1000 rows"),
        ("\0", "is a binary file"),
    ],
)
def test_a_table_of_times_is_refused_at_its_row(
    text: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "t.csv").write_text(text)
    assert told in refused(["machine", "check", "--times", str(tmp_path / "t.csv"), "--machine", "haas-vf2"], capsys)


def test_a_tool_library_is_imported_and_what_is_left_out_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table, out = tmp_path / "shop.csv", tmp_path / "shop.toml"
    table.write_text("T,type,diameter (mm)\n1,drill,5\n2,hammer,6\n")
    assert run(["tools", "import", str(table), "-o", str(out)]) == 0
    told = capsys.readouterr().out
    assert "left out: T2: 'hammer'" in told and told.endswith("shop.toml: 1 tool\n")
    assert load_tools(out).tools == load_tools(table).tools
    assert answer(["tools", "import", str(table)], capsys)["left_out"][0].startswith("T2")
    assert "never overwritten" in refused(["tools", "import", str(out), "-o", str(out)], capsys)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('name = "a"\nnonsense = 3\n', "answers.toml:2: unknown answer 'nonsense'"),
        ('name = "a"\ncontroller = "gerbl"\nrapid = "2 m/min"\n', "answers.toml:2: "),
        ('name = "a"\ncontroller = "grbl"\nrapid = "fast"\n', "answers.toml:3: "),
        ("name =\n", "answers.toml: not a TOML file"),
    ],
)
def test_a_wrong_file_of_answers_is_refused_as_a_file_with_its_line(
    text: str, line: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command line is right: status 1. The same words typed are wrong usage, status 2."""
    (tmp_path / "answers.toml").write_text(text)
    assert run(["machine", "new", "--answers", str(tmp_path / "answers.toml")]) == 1
    said = capsys.readouterr().err
    assert line in said and said.count("\n") == 1
    assert run(["machine", "new", "--name", "a", "--controller", "grbl", "--rapid", "fast"]) == 2


def test_a_flag_that_overrides_a_wrong_answer_of_a_file_is_what_counts(tmp_path: Path) -> None:
    (tmp_path / "answers.toml").write_text('name = "a"\ncontroller = "grbl"\nrapid = "fast"\n')
    words = ["machine", "new", "--answers", str(tmp_path / "answers.toml"), "-o", str(tmp_path / "a.toml")]
    assert run([*words, "--rapid", "2 m/min"]) == 0


def test_a_profile_of_a_board_is_not_named_after_its_port(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (SETTINGS / "grbl_3018.txt").read_text()
    monkeypatch.setattr("leafcut.cli.machine._query_board", lambda *_: ("grbl", text))
    assert run(["machine", "import", "--port", "/dev/ttyUSB0"]) == 0
    out = capsys.readouterr().out
    assert 'name = "grbl-board"' in out
    assert "tty" not in out
