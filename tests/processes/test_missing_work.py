"""Missing work comes first: what of a drawing is not done is named, counted, placed, and ends with exit status 3."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import ezdxf
import pytest
from rich.console import Console

from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import LeafcutError
from leafcut.model.issue import Issue, MissingWork, Severity, missing_work_text
from leafcut.processes.registry import report_of
from leafcut.report.page import path_svg, report_page_html
from leafcut.report.summary import print_summary

FAST = ("--thickness", "6", "--algorithm", "nn", "--no-bound", "--machine", "linuxcnc-mill", "--no-defaults")
QUICK: dict[str, Any] = {"thickness": 6, "algorithm": "nn", "bound": False, "machine": "linuxcnc-mill"}


@pytest.fixture(scope="module")
def plates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of plates of 100 x 60 mm: plain, with a slot, with a window, with a counterbore."""
    folder = tmp_path_factory.mktemp("plates")
    for name in ("plain", "slot", "window", "counterbore"):
        document = ezdxf.new()
        document.header["$INSUNITS"] = 4
        space = document.modelspace()
        space.add_lwpolyline([(0, 0), (100, 0), (100, 60), (0, 60)], close=True)
        for x in (10, 50, 90):
            space.add_circle((x, 10), 3)
        if name == "slot":
            space.add_lwpolyline([(20, 30, 0), (34, 30, 1), (34, 36, 0), (20, 36, 1)], format="xyb", close=True)
        if name == "window":
            space.add_lwpolyline([(20, 30), (60, 30), (60, 50), (20, 50)], close=True)
        if name == "counterbore":
            space.add_circle((50, 10), 5)
        document.saveas(folder / f"{name}.dxf")
    return folder


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("line", "status"),
    [
        ("drill plain.dxf", 0),
        ("optimize plain.dxf", 0),
        ("drill slot.dxf", 3),
        ("optimize slot.dxf", 3),
        ("drill window.dxf", 0),
        ("optimize window.dxf", 3),
        ("drill counterbore.dxf", 3),
        ("drill counterbore.dxf --concentric smallest", 0),
        ("drill slot.dxf --strict", 1),
        ("optimize window.dxf --strict", 1),
        ("drill window.dxf --strict", 0),
    ],
)
def test_missing_work_ends_with_status_3(plates: Path, line: str, status: int) -> None:
    command, name, *more = line.split()
    assert run([command, str(plates / name), *FAST, *more, "-q"]) == status


def test_missing_work_is_told_first_in_the_summary(plates: Path, tmp_path: Path) -> None:
    outcome = api.optimize(plates / "slot.dxf", **QUICK)
    with (tmp_path / "out.txt").open("w") as file:
        print_summary(report_of(outcome), Console(file=file, width=100))
    lines = [line for line in (tmp_path / "out.txt").read_text().splitlines() if line.strip()]
    assert lines[0].startswith("missing: L201 1 slot will not be milled")
    assert any(line.startswith("verified") and "missing: 1 slot" in line for line in lines)


def test_the_answer_says_what_is_missing_how_many_where_and_why(
    plates: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    origin = ("--origin", "10,10")
    assert run(["optimize", str(plates / "slot.dxf"), *FAST, *origin, "--json"]) == 3
    (missing,) = json.loads(capsys.readouterr().out)["missing"]
    # The slot's middle is at (27, 33) in the drawing, and (17, 23) from the zero of the program.
    assert missing == {
        "what": "slot",
        "count": 1,
        "where": [[17.0, 23.0]],
        "code": "L201",
        "place": "at (27, 33)",
        "why": "1 slot will not be milled, because only round holes are drilled",
    }


@pytest.mark.hazard
def test_the_page_shows_missing_work_before_anything_else_and_hatches_it(plates: Path) -> None:
    whole, lacking = (api.optimize(plates / f"{name}.dxf", **QUICK) for name in ("plain", "slot"))
    page = report_page_html(report_of(lacking))
    assert "Missing: 1 slot" in page
    assert page.index("Missing: 1 slot") < page.index("Verified")
    assert page.index("Missing work") < page.index("Time saved")
    for which in ("before", "after"):
        assert path_svg(report_of(lacking), which).count('class="missing"') == 1
        assert 'class="missing"' not in path_svg(report_of(whole), which)
    assert "Missing" not in report_page_html(report_of(whole))


def test_several_inputs_end_with_the_worst_status(plates: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(plates / f"{name}.dxf") for name in ("plain", "slot")]
    assert run(["optimize", *files, *FAST, "--json"]) == 3
    assert [one["status"] for one in json.loads(capsys.readouterr().out)["runs"]] == [0, 3]


def test_strict_refuses_in_one_line_and_writes_nothing(plates: Path, tmp_path: Path) -> None:
    with pytest.raises(LeafcutError, match=r"slot\.dxf: refused by --strict: L201 1 slot") as refused:
        api.optimize(plates / "slot.dxf", tmp_path / "slot.nc", strict=True, **QUICK)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "slot.nc").exists()


def test_an_issue_of_missing_work_has_its_severity_and_the_other_way_round() -> None:
    issue = Issue("L611", "not cut", missing=MissingWork("part", 2))
    assert issue.severity is Severity.MISSING
    assert Issue("L611", "not cut", severity=Severity.MISSING).missing
    note = issue.as_note()
    assert (note.severity, note.missing, note.message) == (Severity.NOTE, None, "not cut")
    assert missing_work_text([issue, note, issue, Issue("L611", "", missing=MissingWork("hole"))]) == "4 parts, 1 hole"
