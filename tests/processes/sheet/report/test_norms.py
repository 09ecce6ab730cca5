"""The table of norms: rows of kinds of parts that add up to the sheet, in the answer, as CSV and on the page."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from leafcut import api
from leafcut.errors import LeafcutError, OptionError
from leafcut.model.cutting import CutMeasures, CutTimes, PartTimes
from leafcut.processes.registry import report_of
from leafcut.processes.sheet.report.norms import cycle_time_rows, cycle_times_csv
from leafcut.report.json_answer import program_as_json
from leafcut.report.page import report_page_html

SHEET = Path(__file__).parents[4] / "examples" / "sheet.dxf"
CHART = """\
process,material,thickness_mm,amps,cut_speed_mm_min,pierce_height_mm,pierce_delay_s,cut_height_mm,kerf_width_mm,nozzle,gas,gas_l_min,power_kw,electrode_life_pierces
plasma,mild_steel,6,45,1430,3.8,0.6,1.5,1.5,fine,air,120,7.2,500
"""


@pytest.fixture(scope="module")
def outcome(tmp_path_factory: pytest.TempPathFactory) -> Any:
    chart = tmp_path_factory.mktemp("norms") / "chart.csv"
    chart.write_text(CHART)
    return api.optimize(SHEET, process="cut", thickness=6, chart=chart, quantity=20, algorithm="nn", bound=False)


def test_rows_add_up_to_the_sheet_and_sheets_to_the_batch(outcome: Any) -> None:
    cutting = program_as_json(report_of(outcome))["cutting"]
    *parts, sheet, batch = cutting["norms"]
    assert [row["of"] for row in (*parts[-1:], sheet, batch)] == ["part", "sheet", "batch"]
    assert sum(row["quantity"] for row in parts) == len(cutting["parts"])
    for key in ("total_perimeter_mm", "gas_l", "energy_kwh", "electrodes"):
        assert math.fsum(row[key] for row in parts) == pytest.approx(sheet[key])
        assert batch[key] == pytest.approx(20 * sheet[key])
    burning = cutting["sheet"]["cut_s"] + cutting["sheet"]["pierce_s"]
    assert sheet["gas_l"] == pytest.approx(2.0 * burning)  # 120 l/min
    assert sheet["energy_kwh"] == pytest.approx(7.2 * burning / 3600)
    assert sheet["electrodes"] == pytest.approx(cutting["sheet"]["pierces"] / 500)
    assert sheet["abrasive_kg"] is None
    assert 3600 * batch["hours"] + 60 * batch["minutes"] + batch["seconds"] == round(batch["total_s"])


def test_the_table_that_is_written_says_the_same(tmp_path: Path) -> None:
    chart, table = tmp_path / "chart.csv", tmp_path / "norms.csv"
    chart.write_text(CHART)
    made = api.optimize(
        SHEET,
        tmp_path / "a.ngc",
        process="cut",
        thickness=6,
        chart=chart,
        report=table,
        algorithm="nn",
        bound=False,
    )
    rows = list(csv.DictReader(io.StringIO(table.read_text())))
    answer = program_as_json(report_of(made))["cutting"]["norms"]
    assert [row["name"] for row in rows] == [row["name"] for row in answer]
    assert [float(row["gas_l"]) for row in rows] == pytest.approx([row["gas_l"] for row in answer])
    assert {(row["nozzle"], row["gas"], row["material"], row["abrasive_kg"]) for row in rows} == {
        ("fine", "air", "mild_steel", "")
    }
    with pytest.raises(LeafcutError, match="never overwritten"):
        api.optimize(SHEET, tmp_path / "b.ngc", process="cut", thickness=6, chart=chart, report=chart)
    with pytest.raises(OptionError, match="--report: drilling has no table of parts"):
        api.optimize("example:plate-10", process="drill", depth=3, report=tmp_path / "b.csv")


def part(number: int, area: float, name: str = "") -> PartTimes:
    return PartTimes(number, area, CutTimes(cut_s=10.0, perimeter_mm=100.0, pierces=1), name=name)


def test_parts_of_one_name_or_without_a_name_and_alike_are_one_row() -> None:
    norm = CutMeasures(
        parts=(part(1, 5.0), part(2, 5.0, "foot"), part(3, 7.0, "foot"), part(4, 5.0), part(5, 9.0), part(0, 0.0))
    )
    assert [(row.name, row.quantity, row.perimeter, row.total_s) for row in cycle_time_rows(norm)] == [
        ("1, 4", 2, 100.0, 20.0),
        ("foot", 2, 100.0, 20.0),
        ("5", 1, 100.0, 10.0),
    ]


def test_no_name_of_a_drawing_is_a_formula_of_a_spreadsheet(outcome: Any) -> None:
    plan = outcome.detail.plan
    evil = replace(plan, measures=replace(plan.measures, parts=(part(1, 5.0, "=HYPERLINK(1)"),)))
    rows = list(csv.DictReader(io.StringIO(cycle_times_csv(evil))))
    assert rows[0]["name"] == "'=HYPERLINK(1)"


def test_the_page_has_the_table_and_says_what_the_chart_does_not(outcome: Any) -> None:
    page = report_page_html(report_of(outcome))
    table = page[page.index('<table class="norms"') :]
    table = table[: table.index("</section>")]
    assert ">air</th>" in table
    assert ">electricity</th>" in table
    assert "does not say how much it uses of: abrasive, nozzles." in table
    assert "20 sheets" in table
