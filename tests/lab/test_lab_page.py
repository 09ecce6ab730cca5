"""The page of an experiment states the results of its runs, and needs no other file."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import replace
from pathlib import Path

import pytest
from lab_descriptions import SMALL, written
from test_store import ROW

from leafcut.lab.analysis_blocks import blocks_of_all_analyses
from leafcut.lab.loading import load_experiment
from leafcut.lab.page import experiment_page_html, rows_as_csv, searches_block
from leafcut.lab.results import Results
from leafcut.lab.store import Row
from page_parser import Page

#: Two factors, every kind of analysis, and markup in the title.
EVERY = SMALL.replace('"Two algorithms"', '"Two <script>alert(1)</script>"').replace(
    "[[analysis]]",
    """[factor.ants]
option = "n_ants"
levels = [5, 10]
[response.time]
unit = "s"
path = "wall_s"
[[analysis]]
kind = "anova"
factors = ["algorithm"]
[[analysis]]
kind = "crossed"
factors = ["algorithm", "ants"]
[[analysis]]
kind = "pareto"
[[analysis]]
kind = "trend"
factors = ["algorithm"]
base = "as"
[[analysis]]""",
)


def rows_of(folder: Path, text: str = EVERY, seeds: int = 3) -> tuple[object, list[Row]]:
    """Return a description and its runs by formula: acs is 10 shorter than as; 5 ants take half as long as 10."""
    found = load_experiment(written(folder, text))
    rows = []
    for plan in found.runs():
        algorithm, ants = (plan.levels[name].name for name in ("algorithm", "ants"))
        length = (100.0 if plan.instance.name == "ten" else 300.0) - 10.0 * (algorithm == "acs") + plan.seed
        answer = {"length": length, "time": int(ants) / 5.0 + 0.01 * plan.seed}
        rows.append(
            replace(
                ROW,
                key=str(len(rows)),
                instance=plan.instance.name,
                levels={"algorithm": algorithm, "ants": ants},
                seed=plan.seed,
                responses=answer,
            )
        )
    return found, [row for row in rows if row.seed <= seeds]


@pytest.mark.parametrize("seeds", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_the_page_needs_no_other_file_and_escapes_text_from_files(seeds: int, tmp_path: Path) -> None:
    """One seed gives half of the charts."""
    html = experiment_page_html(*rows_of(tmp_path, seeds=seeds), 24)
    page = Page(html)
    assert "script" not in page.tags
    assert "Two <script>alert(1)</script>" in page.words
    assert not re.search(r'(?:href|src)="(?!#)', html)
    assert html.count("<svg") == html.count('role="img"') + 1  # the mark of leafcut is decoration
    ids = re.findall(r'\sid="([^"]+)"', html)
    assert set(re.findall(r'(?:href="|url\()#([\w-]+)', html)) <= set(ids)


@pytest.mark.slow
def test_the_page_states_the_differences_of_the_formula(tmp_path: Path) -> None:
    text = Page(experiment_page_html(*rows_of(tmp_path), 24)).words
    assert "24 of 24 runs done" in text
    # as – acs is 10 in every run, of which the mean square within is (1² + 0² + 1²) · 2 / 4 = 1.
    assert "-10.000" in text or "10.000" in text
    assert "an effect of the factor 'algorithm'" in text
    assert "as against acs: acs is better" in text
    # 10 of 102 and 10 of 302, with both numbers of ants.
    assert f"acs over as: mean gain {50 * (10 / 102 + 10 / 302):.2f} %" in text


def test_a_page_without_runs_shows_the_command(tmp_path: Path) -> None:
    found, _ = rows_of(tmp_path)
    text = Page(experiment_page_html(found, [], 24)).words
    assert "0 of 24 runs done" in text
    assert "leafcut lab run small" in text


def test_an_analysis_without_enough_runs_is_explained(tmp_path: Path) -> None:
    found, rows = rows_of(tmp_path, seeds=1)
    text = Page(experiment_page_html(found, rows, 24)).words
    assert "Not done: an analysis of variance needs 2 figures of each level" in text
    assert "8 of 24 runs done" in text


def test_a_failed_run_and_a_run_of_an_older_description_are_not_counted(tmp_path: Path) -> None:
    found, rows = rows_of(tmp_path, seeds=1)
    odd = [replace(rows[0], failed="no such <tool>"), replace(rows[1], instance="gone"), *rows[2:]]
    text = Page(experiment_page_html(found, odd, 24)).words
    assert "6 of 24 runs done" in text
    assert "no such <tool>" in text


def test_the_table_has_a_row_for_every_run(tmp_path: Path) -> None:
    found, rows = rows_of(tmp_path)
    table = list(csv.DictReader(io.StringIO(rows_as_csv(found, rows))))
    assert len(table) == len(rows)
    assert [float(row["length"]) for row in table] == [row.responses["length"] for row in rows]
    assert {row["algorithm"] for row in table} == {"as", "acs"}


def test_speed_up_is_the_ratio_of_means(tmp_path: Path) -> None:
    text = SMALL.replace("threads = 1, ", "")
    text = text.replace('option = "algorithm"\nlevels = ["as", "acs"]', 'option = "threads"\nlevels = [1, 2]')
    text = text.replace('levels = {algorithm = ["acs"]}', "levels = {algorithm = [1]}")
    text = text.replace(
        '[[analysis]]\nkind = "compare"', '[response.time]\npath = "wall_s"\n[[analysis]]\nkind = "speedup"'
    )
    text = text.replace('kind = "speedup"', 'kind = "speedup"\nresponse = "time"')
    found = load_experiment(written(tmp_path, text))
    rows = [
        replace(
            ROW,
            key=plan.label,
            instance=plan.instance.name,
            seed=plan.seed,
            levels={name: level.name for name, level in plan.levels.items()},
            responses={"length": 1.0, "time": 6.0 if plan.levels["algorithm"].name == "1" else 4.0},
        )
        for plan in found.runs()
    ]
    shown = Page(experiment_page_html(found, rows, 12)).words
    assert "1.50" in shown
    assert "75 %" in shown


@pytest.mark.parametrize(
    ("value", "words"), [(0.0, "0"), (12345.678, "12,346"), (1122.26, "1,122.3"), (0.012345, "0.012345")]
)
def test_figures_have_five_significant_digits(value: float, words: str) -> None:
    from leafcut.lab.results import five_digits

    assert five_digits(value) == words


def page_of_lengths(folder: Path, analysis: str) -> str:
    """Return the text of a page whose analysis compares known lengths of two algorithms."""
    of = load_experiment(written(folder, SMALL.replace('kind = "compare"', f'kind = "compare"\n{analysis}')))
    lengths = {("ten", "as"): 200.0, ("ten", "acs"): 150.0, ("thirty", "as"): 400.0, ("thirty", "acs"): 420.0}
    rows = []
    for plan in of.runs():
        algorithm = plan.levels["algorithm"].name
        answer = {"length": lengths[plan.instance.name, algorithm]}
        row = replace(ROW, key=plan.label, instance=plan.instance.name, seed=plan.seed, responses=answer)
        rows.append(replace(row, levels={"algorithm": algorithm}))
    return Page(experiment_page_html(of, rows, 12)).words


def test_a_comparison_with_a_base_shows_each_instance_in_percent_of_the_base(tmp_path: Path) -> None:
    text = page_of_lengths(tmp_path, 'base = "as"')
    assert "acs against as: -10.00 % in the mean of 2 instances" in text  # of -25 % and +5 %
    assert "from -25.00 to +5.00" in text
    assert "150.00 (-25.00 %)" in text
    assert "420.00 (+5.00 %)" in text


def test_a_comparison_with_a_fact_shows_each_instance_in_percent_of_the_fact(tmp_path: Path) -> None:
    text = page_of_lengths(tmp_path, 'fact = "size"')
    assert "as against size: +1566.67 %" in text  # 200 of 10 and 400 of 30


def test_a_chart_with_many_variants_has_a_curve_for_each_level_of_the_first_factor(tmp_path: Path) -> None:
    text = EVERY.replace("levels = [5, 10]", "levels = [1, 2, 3, 4, 5]")
    of = load_experiment(written(tmp_path, text))
    rows = [
        replace(
            ROW,
            key=plan.label,
            instance=plan.instance.name,
            seed=plan.seed,
            levels={name: level.name for name, level in plan.levels.items()},
        )
        for plan in of.runs()
    ]
    block = searches_block(Results.from_rows(of, rows))
    assert block
    convergence = block.drawn[0][1]
    assert ">as<" in convergence
    assert "Ants" not in convergence


def test_attractiveness_is_halved_where_the_formula_halves_it() -> None:
    """10·exp(-γ·r²) = 5 at r = √(ln 2 / γ): 8.33 for γ = 0.010, 6.21 for γ = 0.018."""
    of = load_experiment("firefly_gamma")
    (block,) = [block for block in blocks_of_all_analyses(Results.from_rows(of, [])) if "β over" in block.title]
    assert "halved at r = 8.33 with γ = 0.010, and at r = 6.21 with γ = 0.018" in block.words[0]
    assert "γ = 0.015" in block.drawn[0][1]
