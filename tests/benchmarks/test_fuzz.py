"""A short sweep of mutated inputs: the cases that broke leafcut before, and a few of every target."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarked import benchmark

ROOT = Path(__file__).parents[2]
#: What costs more than the others is tried less; whole runs are tried in long sweeps only.
FEW = {"picture", "verify", "posts", "dxf", "dxf_sheet", "dxf_pockets", "excellon", "svg_pockets"}


fuzz = benchmark("fuzz")


def test_the_cases_that_broke_leafcut_before_end_in_its_own_errors(data: Path, tmp_path: Path) -> None:
    """An exception of a library, a kilobyte of quotation: all of them are one short line now, or are read."""
    cases = [f for f in sorted((data / "fuzz").iterdir()) if f.name.partition("-")[0] in fuzz.TARGETS]
    assert len(cases) >= 30
    faults = {f.name: fuzz.fault_of(f.name.partition("-")[0], f.read_bytes(), tmp_path / "input") for f in cases}
    assert {name: fault for name, fault in faults.items() if fault} == {}


def test_long_runs_and_long_numbers_end_in_leafcuts_own_errors(tmp_path: Path) -> None:
    """Forty thousand blanks are looked at once, not from each of their places; no number has too many digits."""
    cases = [(name, case) for name, several in fuzz.BROKE_BEFORE.items() for case in several]
    faults = [(name, case[:40], fuzz.fault_of(name, case, tmp_path / "input")) for name, case in cases]
    assert [fault for fault in faults if fault[2]] == []


@pytest.mark.parametrize("name", [name for name in fuzz.TARGETS if name not in fuzz.WHOLE])
def test_mutated_inputs_end_in_leafcuts_own_errors(name: str, tmp_path: Path) -> None:
    """The same inputs in every run, so that one that fails can be made again: ``benchmarks/fuzz.py --again``."""
    seeds = fuzz.seeds_of(name)
    for number in range(len(seeds), len(seeds) + (3 if name in FEW else 20)):
        fault = fuzz.fault_of(name, fuzz.input_of(name, seeds, 1, number), tmp_path / "input")
        assert not fault, f"{name}:{number}: {fault}"


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_sweep_that_was_ended_goes_on_where_it_was(tmp_path: Path) -> None:
    """And an input that breaks is found, once, with what made it."""
    name = "csv"
    target = fuzz.TARGETS[name]

    def breaks(content: bytes, _: Path) -> None:
        if b"nan" in content:
            raise KeyError("found")

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
