"""A program that leafcut has put in order takes LinuxCNC no longer than before."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import leafcut
from benchmarked import benchmark
from leafcut.read.machine import load_machine
from simulated_machine import need_simulation

#: Where eight squares of 10 mm are cut, out of order, the first of them in the middle.
SQUARES = [(40, 0), (0, 0), (60, 30), (20, 0), (60, 0), (0, 30), (40, 30), (20, 30)]


@pytest.fixture
def real_files() -> Any:
    """Return the benchmark, where the simulated LinuxCNC is."""
    need_simulation(benchmark("machine_time"))
    return benchmark("real_files")


def test_a_plasma_program_whose_feed_stands_on_the_line_of_the_tool_takes_no_longer_in_linuxcnc(
    real_files: Any, tmp_path: Path
) -> None:
    """The first cut relied on the F of the M6 line: the one that is first now says it again."""
    cuts = "".join(f"G0 X{x} Y{y}\nG0 Z1\nM3 S1\nG1 X{x + 10}\nY{y + 10}\nX{x}\nY{y}\nM5\nG0 Z10\n" for x, y in SQUARES)
    before = tmp_path / "squares.ngc"
    before.write_text(f"G21 G90 G17 G40 G64 P0.1\nT1 M6 F3000\nG0 Z10\n{cuts}M2\n", encoding="ascii")
    outcome = leafcut.optimize(before, machine="plasma-table", threads=1)
    assert outcome.text.count("F3000") == 2
    assert outcome.saved_percent > 3
    said = real_files.Simulation().compared(before.read_text(encoding="ascii"), outcome.text, outcome.machine)
    assert "→" in said
    assert "slower" not in said


def test_what_was_simulated_is_not_simulated_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A sweep that was stopped goes on; where the new program seems slower both are run again, and the least counts."""
    module = benchmark("real_files")
    machine = load_machine("linuxcnc-mill")
    took = {"old": [10.0, 9.0, 8.5, 8.5], "new": [12.0, 11.0, 8.0, 8.0], "odd": ["Bad character"]}
    ran: list[str] = []

    def simulated(text: str, *_: object) -> object:
        ran.append(text)
        return took[text][ran.count(text) - 1]

    monkeypatch.setattr(module, "_simulated", simulated)
    state = tmp_path / "state.json"
    assert module.Simulation(state).compared("old", "new", machine) == "8.5 → 8.0"
    assert module.Simulation(state).compared("odd", "new", machine) == "not run: Bad character"
    once = list(ran)
    assert module.Simulation(state).compared("old", "new", machine) == "8.5 → 8.0"
    assert ran == once == ["old", "new", "old", "new", "old", "new", "odd"]


@pytest.mark.parametrize(("said", "status"), [("8.5 → 8.0", None), ("8.5 → 9.9 slower", "slower .*: a.nc")])
def test_a_program_that_is_slower_after_ends_the_benchmark_with_an_error(
    said: str, status: str | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It names the file, behind the table with all rows."""
    module = benchmark("real_files")
    monkeypatch.setattr(module, "real_files", lambda: [Path("a.nc")])
    monkeypatch.setattr(module, "STYLES", Path(__file__).parent / "none")
    monkeypatch.setattr(Path, "iterdir", lambda _: iter(()))
    monkeypatch.setattr(module, "run", lambda *_: ["a.nc", "", "", "9.0", "8.0", "11", said, "", ""])
    monkeypatch.setattr(module, "facts", lambda *_: "")
    monkeypatch.setattr("sys.argv", ["real_files.py"])
    if status is None:
        module.main()
    else:
        with pytest.raises(SystemExit, match=status):
            module.main()
    assert said in capsys.readouterr().out
