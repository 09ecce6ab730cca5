"""Options are checked and converted where they are made, and mean the same however they are given."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

import pytest

from leafcut.errors import OptionError
from leafcut.nesting.options import NestOptions
from leafcut.options import JobOptions, MillingOptions, PostOptions, ReadOptions, SolveOptions
from leafcut.options.option_spec import flag_name, typed_text
from leafcut.processes import registry
from leafcut.processes.drilling.options import DrillOptions
from leafcut.processes.settings import all_options, collect_settings, group_of


def test_a_name_belongs_to_one_group_only() -> None:
    names = [name for _, name, _ in all_options()]
    assert len(set(names)) == len(names)
    assert {group_of(n) for n in names} == set(registry.option_groups())


@pytest.mark.parametrize("group", registry.option_groups())
def test_a_default_passes_its_own_check_and_has_a_help(group: type) -> None:
    made = group()
    for name, spec in group.specs().items():
        assert getattr(made, name) == group.defaults()[name], name
        assert spec.help


@pytest.mark.parametrize(
    "group, name, value, words",
    [
        (SolveOptions, "iterations", 1.5, "whole number"),
        (SolveOptions, "iterations", "many", "whole number"),
        (SolveOptions, "iterations", -1, "below the minimum"),
        (SolveOptions, "seed", math.inf, "whole number"),
        (SolveOptions, "seed", 2**32, "above the maximum"),
        (SolveOptions, "seed", True, "whole number"),
        (SolveOptions, "algorithm", "mmass", "did you mean 'mmas'"),
        (SolveOptions, "local_search", "yes", "true or false"),
        (JobOptions, "depth", "5 parsec", "unknown unit"),
        (JobOptions, "depth", 0, "below the minimum"),
        (JobOptions, "depth", math.nan, "not a finite"),
        (ReadOptions, "origin", "1e50,0", "out of range for any machine"),
        (JobOptions, "start_point", "0,-2e6", "out of range for any machine"),
        (JobOptions, "depth", True, "not a number"),
        (JobOptions, "start_point", "1", "not a point"),
        (JobOptions, "start_point", "1,2,3,4", "not a point"),
        (DrillOptions, "cycle", "G86", "unknown value"),
        (JobOptions, "tools", 5, "a path"),
        (ReadOptions, "units", "yard", "unknown value"),
        (PostOptions, "dialect", 5, "a string"),
        (JobOptions, "step_over", "60 mm", "a fraction such as 0.6 or 60%"),
        (JobOptions, "step_over", "60", "above the maximum of 0.95"),
        (ReadOptions, "rotate", "361", "361 deg is above the maximum of 360 deg"),
        (ReadOptions, "rotate", "-400", "-400 deg is below the minimum of -360 deg"),
    ],
)
def test_what_cannot_be_used_is_refused_with_its_flag(group: Any, name: str, value: Any, words: str) -> None:
    with pytest.raises(OptionError, match=f"^{flag_name(name)}: .*{words}"):
        group(**{name: value})


@pytest.mark.parametrize(
    "group, name, value, words",
    [
        (MillingOptions, "entry_angle", "95", "95 deg is above the maximum of 45.8366 deg"),
        (JobOptions, "feed", "0", "0 mm/min is below the minimum of 0.06 mm/min"),
        (JobOptions, "depth", "0", "0 mm is below the minimum of 0.001 mm"),
        (JobOptions, "step_over", 2, "2 is above the maximum of 0.95"),
    ],
)
def test_a_value_out_of_bounds_is_told_in_the_units_a_person_types(
    group: Any, name: str, value: Any, words: str
) -> None:
    """Who types degrees and mm/min is not answered in radians and mm/s: a factor of 57 or 60 breaks tools."""
    with pytest.raises(OptionError, match=f"^{flag_name(name)}: {words}$"):
        group(**{name: value})


def test_a_bare_number_means_the_same_in_a_file_in_a_call_and_on_the_command_line(tmp_path: Path) -> None:
    """300 mm/min is 5 mm/s; 300 mm/s would break the drill."""
    file = tmp_path / "o.toml"
    file.write_text("[drill]\nfeed = 300\nthickness = 6\ndwell = 0.5\n")
    made = [
        collect_settings({}, file),
        collect_settings({"feed": 300, "thickness": 6.0, "dwell": 0.5}),
        collect_settings({"feed": "300", "thickness": "6", "dwell": "0.5"}),
        collect_settings({"feed": "0.3 m/min", "thickness": "6mm", "dwell": "500ms"}),
    ]
    assert [s.job.feed for s in made] == pytest.approx([5.0] * 4)
    assert all((s.job.thickness, s.of(DrillOptions).dwell) == (6.0, 0.5) for s in made)


def test_an_option_made_anew_keeps_its_inner_value() -> None:
    options = collect_settings({"feed": "300"}).job
    assert dataclasses.replace(options, depth=3.0).feed == options.feed


def test_what_is_given_goes_before_what_the_file_says(tmp_path: Path) -> None:
    file = tmp_path / "o.toml"
    file.write_text("[solve]\nseed = 3\npreset = 'fast'\n")
    settings = collect_settings({"seed": 4, "preset": None}, file)
    assert (settings.solve.seed, settings.solve.preset) == (4, "fast")


def test_options_of_a_file_may_stand_at_its_top_without_a_table(tmp_path: Path) -> None:
    """Also beside tables, and where an option has the name of a table."""
    file = tmp_path / "o.toml"
    file.write_text('machine = "haas-vf2"\nseed = 3\nsheet = "400x300"\n[solve]\npreset = "fast"\n[drill]\ndepth = 4\n')
    settings = collect_settings({}, file)
    assert (settings.machine.machine, settings.job.depth) == ("haas-vf2", 4.0)
    assert settings.of(NestOptions).sheet == ("400x300",)
    assert (settings.solve.seed, settings.solve.preset) == (3, "fast")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seed = 3\n[solve]\nseed = 3\n", r"'seed' is given twice, at the top and in \[solve\]"),
        ("dept = 3\n", "unknown option 'dept'; did you mean 'depth'"),
        ("[drll]\n", r"unknown table \[drll\]; did you mean 'drill'"),
        ("[drill]\ndeth = 3\n", r"unknown option 'deth' in \[drill\]; did you mean 'depth'"),
        ("drill = 3\n", r"write \[drill\]"),
        ("[drill\n", "not a TOML file"),
        ("[drill]\ndepth = -3\n", "--depth: -3 mm is below"),
    ],
)
def test_a_file_of_options_that_is_wrong_is_refused(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "o.toml"
    file.write_text(text)
    with pytest.raises(OptionError, match=words):
        collect_settings({}, file)


def test_an_unknown_option_gets_the_nearest_name() -> None:
    with pytest.raises(OptionError, match="unknown option 'thicknes'; did you mean 'thickness'"):
        collect_settings({"thicknes": 3})


def test_only_what_changes_the_program_counts_as_changed() -> None:
    given = {"threads": 2, "feed": "300", "start_point": "free", "end_point": "1,2.5", "header": False, "seed": 1}
    assert collect_settings(given).changed() == {
        "--feed": "300mm/min",
        "--start-point": "free",
        "--end-point": "1,2.5",
        "--no-header": "",
    }


@pytest.mark.parametrize("group, name, spec", list(all_options()), ids=lambda v: v if isinstance(v, str) else "")
def test_what_is_written_is_read_again_as_the_same(group: Any, name: str, spec: Any) -> None:
    value = getattr(group(), name)
    if value is None or spec.kind in ("flag", "names"):
        return
    assert getattr(group(**{name: typed_text(spec, value)}), name) == value


def test_a_share_is_a_number_or_percent_of_it() -> None:
    for said in (0.45, "0.45", "45%", " 45 % "):
        assert JobOptions(step_over=said).step_over == pytest.approx(0.45)  # type: ignore[arg-type]


def test_a_decimal_comma_is_a_point_in_what_holds_one_number_and_parts_what_holds_several() -> None:
    found = collect_settings({"thickness": "6,5", "dwell": "0,5s", "start_point": "10,20", "step_over": "62,5%"})
    assert (found.job.thickness, found.of(DrillOptions).dwell) == (6.5, 0.5)
    assert found.job.start_point == (10.0, 20.0)
    assert found.of(JobOptions).step_over == 0.625


@pytest.mark.parametrize("name", ["clearance_height", "seed", "layers", "start_point"])
def test_a_number_of_thousands_of_digits_is_refused_by_the_name_of_its_option(name: str) -> None:
    """No float holds it, and Python does not print it."""
    with pytest.raises(OptionError, match="64 bits"):
        collect_settings({name: 10**5000})
