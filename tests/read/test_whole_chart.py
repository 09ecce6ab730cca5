"""Everything that is taken from a cut chart of ten rows, `tables/chart.csv`: checked by hand against the rows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from leafcut.errors import LeafcutError
from leafcut.read.cutchart import find_cut_data, load_chart, process_names_for
from plain_text import text_of

TABLES = Path(__file__).parent / "tables"

#: Process, material, thickness, and more.
ASKED: list[tuple[str, str, float, dict[str, Any]]] = [
    ("plasma", "mild_steel", 2.0, {}),
    ("Plasma", "Mild Steel", 4.0, {}),
    ("plasma", "steel", 4.0, {"amps": 45.0}),
    ("plasma", "s235", 4.04, {"amps": 65.0}),
    ("plasma", "mild_steel", 4.05, {"amps": 65.0}),
    ("plasma", "mild_steel", 3.0, {"amps": 45.0}),
    ("plasma", "mild_steel", 3.0, {"nozzle": " FINE "}),
    ("plasma", "mild_steel", 3.0, {"nozzle": "coarse"}),
    ("plasma", "mild_steel", 8.0, {"amps": 45.0}),
    ("plasma", "mild_steel", 12.0, {}),
    ("plasma", "mild_steel", 12.0, {"amps": 45.0}),
    ("plasma", "mild_steel", 12.0, {"amps": 45.0, "pierce_delay": 2.0}),
    ("plasma", "mild_steel", 12.0, {"amps": 85.0}),
    ("plasma", "mild_steel", 12.0, {"amps": 85.0, "kerf": 2.5, "pierce_delay": 1.0}),
    ("plasma", "mild_steel", 12.0, {"amps": 30.0}),
    ("plasma", "mild_steel", 30.0, {}),
    ("plasma", "mild_steel", 1.0, {"amps": 45.0}),
    ("plasma", "mild_steel", 30.0, {"feed": 10.0, "kerf": 3.0, "pierce_delay": 4.0}),
    ("plasma", "brass", 3.0, {}),
    ("plasma", "mild steal", 3.0, {}),
    ("plasma", "brass", 3.0, {"feed": 10.0, "kerf": 3.0, "pierce_delay": 4.0, "cut_height": 2.0, "pierce_height": 5.0}),
    ("plasma", "brass", 3.0, {"feed": 10.0, "kerf": 3.0, "pierce_delay": 4.0, "amps": 40.0}),
    ("plasma", "aluminum", 4.0, {}),
    ("plasma", "aluminum", 4.0, {"pierce_delay": 0.5, "cut_height": 2.0}),
    ("laser", "mild_steel", 2.0, {}),
    ("laser_fiber_3kw", "mild_steel", 2.0, {}),
    ("laser_fiber_3kW", "mild_steel", 2.0, {"cut_height": 0.8}),
    ("laser_fiber_6kW", "mild_steel", 2.0, {}),
    ("laser_co2_60w", "pmma", 3.0, {}),
    ("waterjet", "mild_steel", 10.0, {}),
    ("oxyfuel", "mild_steel", 20.0, {}),
    ("oxyfuel", "mild_steel", 20.0, {"kerf": 2.0}),
    ("plasmo", "mild_steel", 2.0, {}),
    ("knife", "mild_steel", 2.0, {"feed": 10.0, "kerf": 3.0, "pierce_delay": 4.0}),
]  # fmt: skip


def lines() -> list[str]:
    """Return the rows of the chart, and the data or the refusal of each request."""
    rows = load_chart(TABLES / "chart.csv")
    found = [text_of(row) for row in rows]
    found += [
        f"kinds of laser for {m}: {sorted(process_names_for(rows, 'laser', m))}" for m in ("steel", "acrylic", "wood")
    ]
    for process, material, thickness, more in ASKED:
        found.append(f"== {process} {material} {thickness:g} {more or ''}".rstrip())
        try:
            data, issues = find_cut_data(rows, process, material, thickness, **more)
            found += [text_of(data), *map(text_of, issues)]
        except LeafcutError as problem:
            found.append(f"{type(problem).__name__}: {problem}")
    return found


def test_a_chart_gives_the_data_of_a_sheet_or_says_what_it_lacks() -> None:
    assert lines() == (TABLES / "chart.txt").read_text(encoding="utf-8").splitlines()


COLUMNS = (
    "a cut chart has process, material, thickness_mm, cut_speed_mm_min, amps, pierce_height_mm, pierce_delay_s, "
    "cut_height_mm, kerf_width_mm, arc_volts, confidence, source, nozzle, gas, gas_l_min, second_gas, "
    "second_gas_l_min, power_kw, abrasive_g_min, nozzle_life_h, nozzle_life_pierces, electrode_life_h, "
    "electrode_life_pierces"
)
HEAD = "process,material,thickness_mm,cut_speed_mm_min,kerf_width_mm,nozzle_life_h\n"


@pytest.mark.parametrize(
    ("text", "refusal"),
    [
        ("a,b\n1,2\n", f":1: has no column 'process'; {COLUMNS}"),
        ("process,material,thickness_mm\n", f":1: has no column 'cut_speed_mm_min'; {COLUMNS}"),
        (HEAD, ": has no rows"),
        (HEAD + ",,,\n", ": has no rows"),
        (HEAD + "plasma,steel,x,100\n", ":2: 'thickness_mm' is 'x', not a number"),
        (HEAD + "\nplasma,steel,2,x\n", ":3: 'cut_speed_mm_min' is 'x', not a number"),
        (HEAD + "plasma,steel,2,\n", ":2: 'cut_speed_mm_min' is '', not a number"),
    ],
)
def test_a_chart_that_cannot_be_is_refused_with_its_line(text: str, refusal: str, tmp_path: Path) -> None:
    (tmp_path / "chart.csv").write_text(text)
    with pytest.raises(LeafcutError) as caught:
        load_chart(tmp_path / "chart.csv")
    assert str(caught.value) == f"{tmp_path / 'chart.csv'}{refusal}"
