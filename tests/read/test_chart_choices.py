"""The choices of a cut chart are consistent: each lists only rows that match the earlier choices."""

from __future__ import annotations

from leafcut.read.cutchart import available_choices, find_cut_data, load_chart


def test_what_is_offered_beside_what_is_chosen_has_a_row_of_the_chart() -> None:
    rows = load_chart()
    first = available_choices(rows)
    assert first.materials == tuple(sorted({row.material for row in rows}))
    for process in first.processes:
        for material in available_choices(rows, process).materials:
            for thickness in available_choices(rows, process, material).thicknesses:
                wanted = {row.amps for row in rows if row.process == process and row.material == material}
                for amps in available_choices(rows, process, material, thickness).amps:
                    assert amps in wanted
                    data, _ = find_cut_data(
                        rows, process, material, thickness, amps, kerf=1.0, pierce_delay=0.0, pierce_height=3.0
                    )
                    assert data.feed > 0


def test_who_chose_what_the_chart_does_not_have_sees_what_it_has() -> None:
    rows = load_chart()
    assert available_choices(rows, "plasma", "wood").materials == ("aluminium", "mild_steel", "stainless_304")
    assert (
        available_choices(rows, "plasma", "steel").thicknesses
        == available_choices(rows, "plasma", "mild_steel").thicknesses
    )
    assert available_choices(rows, "plasma", "mild_steel", 333.0).amps == (45.0, 65.0, 85.0)
    assert available_choices(rows, "nothing").materials == available_choices(rows).materials


def test_nozzles_are_offered_of_the_rows_that_are_left() -> None:
    rows = load_chart()
    assert available_choices(rows, "oxyfuel", "mild_steel").nozzles == ("0.8 mm", "1.2 mm", "1.6 mm")
    assert available_choices(rows, "oxyfuel", "mild_steel", 13.0).nozzles == ("1.2 mm",)
    assert available_choices(rows, "plasma", "mild_steel").nozzles == ()
