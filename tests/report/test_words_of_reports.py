"""Words of reports that are true for every controller and process."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import leafcut
from leafcut.model.outcome import Outcome
from leafcut.processes.registry import report_of
from leafcut.proof.difference import position_text
from leafcut.report.json_answer import program_as_json
from leafcut.report.page import report_page_html
from leafcut.report.wording import search_summary
from leafcut.units import to_fixed
from page_parser import Page

STYLES = Path(__file__).parents[1] / "styles"


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [
        (-1e-7, 3, "0.000"),
        (-0.0, 2, "0.00"),
        (-0.004, 2, "0.00"),
        (-0.006, 2, "-0.01"),
        (1.25, 1, "1.2"),
        (-3, 0, "-3"),
    ],
)
def test_zero_has_no_sign(value: float, decimals: int, text: str) -> None:
    assert to_fixed(value, decimals) == text


def test_places_at_zero_have_no_sign() -> None:
    assert position_text(-1e-9, -0.0004, -0.0) == "X0.000 Y0.000 Z0.000"


@pytest.mark.parametrize(("machine", "cycle"), [("grbl-3018", ""), ("marlin-mpcnc", ""), ("haas-vf2", "G81")])
def test_a_drilling_cycle_is_named_only_where_the_program_has_it(machine: str, cycle: str, examples: Path) -> None:
    outcome = leafcut.optimize(
        examples / "plate_8x8_10.dxf",
        process="drill",
        machine=machine,
        thickness=5,
        spindle_speed=3000,
        preset="fast",
    )
    assert [tool["cycle"] for tool in program_as_json(report_of(outcome))["tools"]] == [cycle]
    assert ("G81" in outcome.text) == ("G81" in report_page_html(report_of(outcome))) == (cycle == "G81")


def test_the_power_of_a_laser_is_no_speed() -> None:
    """S of a laser is its power, in the answer and in the table of the page."""
    outcome = leafcut.optimize(STYLES / "lightburn_vector.gc", preset="fast")
    tools = program_as_json(report_of(outcome))["tools"]
    assert tools and all("speed_rpm" not in tool and tool["power_s"] > 0 for tool in tools)
    words = Page(report_page_html(report_of(outcome))).words
    assert "Power S" in words and "rpm" not in words
    mill = leafcut.optimize(STYLES / "vcarve_grbl_peck.nc", preset="fast")
    assert all("power_s" not in tool and tool["speed_rpm"] > 0 for tool in program_as_json(report_of(mill))["tools"])


def test_the_time_of_the_search_is_told_apart_from_that_of_the_run(examples: Path) -> None:
    outcome = replace(leafcut.optimize(examples / "plate_10.dxf", thickness=6, preset="fast"), seconds=4.93)
    (operation,) = outcome.operations
    timed = replace(outcome, operations=(replace(operation, solution=replace(operation.solution, seconds=2.1)),))
    assert "search 2.10 s of 4.93 s" in search_summary(timed)
    assert "search 2.10 s of 4.93 s" in report_page_html(report_of(timed))
    answer = program_as_json(report_of(timed))
    assert (answer["search_seconds"], answer["seconds"]) == (2.1, 4.93)


def test_reports_name_compile_time_only_where_something_was_compiled(empty_outcome: Outcome) -> None:
    some = replace(empty_outcome, seconds=2.0, compile_seconds=40.0)
    none = replace(empty_outcome, seconds=2.0)
    assert "2.00 s and 40.0 s to load and compile kernels" in search_summary(some) and "kernels" not in search_summary(
        none
    )
    assert "40.0 s to load and compile kernels" in report_page_html(
        report_of(some)
    ) and "kernels" not in report_page_html(report_of(none))
