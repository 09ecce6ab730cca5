"""Words around a change of tool that some shops want: the next tool named in time, an optional stop."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut.errors import OptionError
from leafcut.model.toolpath import Kind
from own_machines import own_machine
from rs274_moves import moves_of_rs274, run_rs274

FAST = {"process": "drill", "thickness": 5, "algorithm": "nn", "bound": False}


@pytest.fixture
def holes(tmp_path: Path) -> Path:
    """A table of holes of three diameters, so that tools are changed twice."""
    file = tmp_path / "holes.csv"
    file.write_text("x,y,diameter\n10,10,5\n40,10,5\n40,40,8\n10,40,8\n25,25,10\n")
    return file


def made(holes: Path, **options: Any) -> list[str]:
    return leafcut.optimize(holes, **FAST, **options).text.splitlines()


def with_changes(folder: Path, machine: str, *keys: str) -> str:
    """Return the path of a profile that wants more at a tool change."""
    return own_machine(folder, machine, tool_change=dict.fromkeys(keys, True))


@pytest.mark.parametrize("machine", ["linuxcnc-mill", "haas-vf2"])
def test_the_next_tool_is_named_after_each_change_but_the_last(holes: Path, tmp_path: Path, machine: str) -> None:
    own = with_changes(tmp_path, machine, "preselect")
    lines = [line for line in made(holes, machine=own) if line.startswith("T")]
    assert lines == ["T1 M6", "T2", "T2 M6", "T3", "T3 M6"]
    assert [line for line in made(holes, machine=machine) if line.startswith("T")] == ["T1 M6", "T2 M6", "T3 M6"]


def test_an_optional_stop_stands_before_each_change_with_the_spindle_off(holes: Path, tmp_path: Path) -> None:
    lines = made(holes, machine=with_changes(tmp_path, "linuxcnc-mill", "optional_stop"))
    stops = [number for number, line in enumerate(lines) if line == "M1"]
    assert len(stops) == 2
    for stop in stops:
        assert lines[stop - 1] == "M5"
        assert next(line for line in lines[stop + 1 :] if not line.startswith("(")).endswith("M6")
    assert "M1" not in made(holes, machine="linuxcnc-mill")


def test_the_program_with_them_is_read_back_as_planned_and_moves_as_without(
    holes: Path, tmp_path: Path, rs274: str
) -> None:
    own = with_changes(tmp_path, "linuxcnc-mill", "preselect", "optional_stop")
    outcome = leafcut.optimize(holes, **FAST, machine=own)
    assert (outcome.path_after.kind == Kind.PAUSE).sum() == 2
    found = []
    for text in (outcome.text, "\n".join(made(holes, machine="linuxcnc-mill")) + "\n"):
        status, said = run_rs274(rs274, text, tmp_path)
        assert status == 0, said
        found.append(moves_of_rs274(said))
    assert found[0] == found[1]
    assert [move for move in found[0] if move[0] == "tool"] == [("tool", 1), ("tool", 2), ("tool", 3)]


@pytest.mark.parametrize(
    ("machine", "why"),
    [("grbl-3018", "changed by hand"), ("fagor-8055", "also activates the tool length")],
)
def test_a_tool_is_not_named_ahead_where_its_word_does_more(
    holes: Path, tmp_path: Path, machine: str, why: str
) -> None:
    with pytest.raises(
        OptionError, match=f"--machine {machine}: .*{why}.*; remove tool_change.preselect from the mach"
    ):
        made(holes, machine=with_changes(tmp_path, machine, "preselect"))
