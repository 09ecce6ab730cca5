"""A short sweep of mutated inputs: the former faults, and a few inputs of every target."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import fuzz

#: Slow targets get fewer inputs; whole runs belong to long sweeps.
FEW = {"picture", "verify", "posts", "dxf", "dxf_sheet", "dxf_pockets", "excellon", "svg_pockets"}


def test_cases_of_former_faults_end_in_short_errors_of_leafcut(data: Path, tmp_path: Path) -> None:
    """Former faults: exceptions of libraries, quotations of a kilobyte."""
    cases = [f for f in sorted((data / "fuzz").iterdir()) if f.name.partition("-")[0] in fuzz.TARGETS]
    assert len(cases) >= 30
    faults = {f.name: fuzz.fault_of(f.name.partition("-")[0], f.read_bytes(), tmp_path / "input") for f in cases}
    assert {name: fault for name, fault in faults.items() if fault} == {}


def test_long_runs_and_long_numbers_end_in_errors_of_leafcut(tmp_path: Path) -> None:
    """Forty thousand blanks take linear time; numbers with too many digits are refused."""
    cases = [(name, case) for name, several in fuzz.BROKE_BEFORE.items() for case in several]
    faults = [(name, case[:40], fuzz.fault_of(name, case, tmp_path / "input")) for name, case in cases]
    assert [fault for fault in faults if fault[2]] == []


@pytest.mark.parametrize("name", [name for name in fuzz.TARGETS if name not in fuzz.WHOLE])
def test_mutated_inputs_end_in_errors_of_leafcut(name: str, tmp_path: Path) -> None:
    """Every run has the same inputs; ``python -m benchmarks fuzz --again`` repeats a failed input."""
    seeds = fuzz.seeds_of(name)
    for number in range(len(seeds), len(seeds) + (3 if name in FEW else 10)):
        fault = fuzz.fault_of(name, fuzz.input_of(name, seeds, 1, number), tmp_path / "input")
        assert not fault, f"{name}:{number}: {fault}"


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_an_interrupted_sweep_continues(tmp_path: Path) -> None:
    """A fault is kept once, with its input."""
    name = "csv"
    target = fuzz.TARGETS[name]

    def breaks(content: bytes, _: Path) -> None:
        if b"nan" in content:
            raise KeyError("fault")

    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(fuzz.TARGETS, name, (breaks, *target[1:]))
        sweep = fuzz.Sweep(1, tmp_path)
        fuzz.run_batch(name, sweep, 150, tmp_path / "input")
        sweep.save()
        again = fuzz.Sweep(1, tmp_path)
        again.load()
        assert again.next == {name: 150}
        fuzz.run_batch(name, again, 150, tmp_path / "input")
    assert again.tried == 300
    assert len(again.found) == 1
    number = int(next(iter(again.found.values())).partition(":")[2])
    assert b"nan" in fuzz.input_of(name, fuzz.seeds_of(name), 1, number)
