"""The page "published beside ours" compares each published figure with the figure that our runs give by hand."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from scipy import stats
from test_store import ROW

from leafcut.cli.app import run
from leafcut.lab import published
from leafcut.lab.description import RunPlan
from leafcut.lab.loading import load_experiment
from leafcut.lab.page import experiment_page_html, published_page_html
from leafcut.lab.published import Figure, Ours, Runs, our_counterpart, pairs_as_csv, published_blocks, published_tables
from leafcut.lab.store import Store
from page_parser import Page

Answer = Callable[[RunPlan], Mapping[str, float] | None]


def runs_of(name: str, answer: Answer, seeds: int = 5) -> Runs:
    """Return runs of an experiment with responses by formula; None for a run that is missing."""
    whole = load_experiment(name)
    rows = [
        replace(
            ROW,
            key=plan.label,
            experiment=name,
            instance=plan.instance.name,
            seed=plan.seed,
            responses=responses,
            levels={factor: level.name for factor, level in plan.levels.items()},
        )
        for plan in whole.runs()
        if plan.seed <= seeds and (responses := answer(plan)) is not None
    ]
    return Runs(whole, whole, rows)


def figures_of(experiment: str, **wanted: str) -> list[Figure]:
    """Return the published figures of an experiment with the given attributes."""
    return [
        figure
        for table in published_tables()
        for figure in table.figures
        if figure.experiment == experiment and all(getattr(figure, key) == value for key, value in wanted.items())
    ]


def level(plan: RunPlan, factor: str) -> str:
    return plan.levels[factor].name


def without_runs(name: str) -> Runs:
    return runs_of(name, lambda plan: None)


@pytest.mark.parametrize("name", published.published_experiments())
def test_every_published_figure_names_cells_of_its_experiment(name: str) -> None:
    runs = without_runs(name)
    for figure in figures_of(name):
        cells = runs.matching_cells(figure)
        assert cells
        assert {runs.base_cell(cell, figure) for cell in cells} <= set(runs.cells)
        assert figure.response in [response.name for response in runs.whole.responses]
        assert our_counterpart(figure, runs).missing in ("not_run", "cores")
        n_levels = len(runs.whole.factor(figure.factor).levels) if figure.factor else 0
        assert len(cells) == n_levels or not figure.factor


def test_a_time_is_the_mean_of_its_runs() -> None:
    (figure,) = figures_of("thesis", instance="1: 10 holes", published=78.0)
    assert dict(figure.levels) == {"set": ("A",), "processors": ("1",)}

    def search(plan: RunPlan) -> Mapping[str, float]:
        mine = (plan.instance.name, level(plan, "set"), level(plan, "processors")) == ("1: 10 holes", "A", "1")
        return {"search": 13.0 * plan.seed if mine else 1.0}  # 13, 26, 39

    assert our_counterpart(figure, runs_of("thesis", search, seeds=3)) == Ours(26.0, 3, 30)


def board(plan: RunPlan) -> Mapping[str, float]:
    """Return 10 min of travel in random order, 4 min ordered."""
    return {"travel_time": 10.0 if level(plan, "order") == "random" else 4.0, "time": 20.0}


def test_a_saving_is_of_the_base_level() -> None:
    saved, saving = figures_of("boards", instance="97 holes")
    runs = runs_of("boards", board)
    assert (saved.published, our_counterpart(saved, runs).value) == (24.6, 6.0)
    assert (saving.published, our_counterpart(saving, runs).value) == (62.27, pytest.approx(60.0))


def test_differences_are_percent_and_of_percentages_points() -> None:
    (block,) = published_blocks({"boards": runs_of("boards", board)}, "en")
    rows = [row[2:] for row in block.tables[0].rows]
    assert rows[0] == ("24.6 min", "6.0000 min", "-75.6 %", "2 / 2")  # 6 of 24.6 is 24.4 %
    assert rows[1] == ("62.27 %", "60.000 %", "-2.27 points", "2 / 2")
    # 24.6 min are 62.27 % of 39.5 min, 24.4 s for each of 97 holes; 10 min are 6.19 s for each.
    assert "travels 39.5 min on 97 holes, 24.4 s for each hole; ours travels 6.19 s" in " ".join(block.words)


def test_of_all_pieces_the_largest_saving_counts() -> None:
    def variant(plan: RunPlan) -> Mapping[str, float]:
        # The star is 1 of 4 m shorter, the rectangle 2 of 16 m.
        star, complex_ = plan.instance.name == "star", level(plan, "variant") == "published, complex"
        base = 4000.0 if star else 16000.0
        return {"length": base - complex_ * (1000.0 if star else 2000.0), "time": 8.0 if star else 2.0}

    runs = runs_of("firefly_variants", variant)
    values = {figure.statistic: our_counterpart(figure, runs).value for figure in figures_of("firefly_variants")}
    assert values == {"saving": pytest.approx(25.0), "saved": pytest.approx(1.0), "max": 8.0}


def test_f_and_the_best_levels_are_those_of_the_analysis_by_hand() -> None:
    """Means of 100 (11 and 12) and 200 (six levels), replicates of -2 … 2: F = (75,000 / 7) / (80 / 32)."""

    def length(plan: RunPlan) -> Mapping[str, float]:
        return {"length": (100.0 if level(plan, "n") in ("11", "12") else 200.0) + plan.seed - 3}

    runs = runs_of("firefly_n_simple", length)
    (block,) = published_blocks({"firefly_n_simple": runs}, "es")
    rows = [row[3:5] for row in block.tables[0].rows]
    assert rows == [("4,285.7", "+1036.5 %"), ("11, 12", "igual"), ("11", "igual")]
    assert block.words[0].startswith("3 de 3 cifras")


def test_a_cell_without_runs_shows_its_command() -> None:
    (block,) = published_blocks({"nests": without_runs("nests")}, "en", published.command_options(True, "my r.sqlite"))
    assert {row[3] for row in block.tables[0].rows} == {
        "not run: leafcut lab run nests --reduced --results 'my r.sqlite'"
    }
    assert not any("have runs here" in words for words in block.words)


def test_a_cell_whose_runs_lack_the_figure_does_not_ask_for_more_runs() -> None:
    refused = runs_of("boards", lambda plan: {})
    assert {our_counterpart(figure, refused).missing for figure in figures_of("boards")} == {"no_figure"}


def test_one_replicate_is_too_few_for_an_analysis() -> None:
    runs = runs_of("firefly_n_simple", lambda plan: {"length": 1.0 + plan.levels["n"].options["n_fireflies"]}, seeds=1)
    assert {our_counterpart(figure, runs).missing for figure in figures_of("firefly_n_simple")} == {"not_run"}


def test_the_published_nests_show_no_trend() -> None:
    """Computed by scipy alone from the published lengths; the page states the same figures."""
    (table,) = [table for table in published_tables() if table.figures[0].experiment == "nests"]
    ants, nearest, gains = ([figure.published for figure in table.figures[k::3]] for k in range(3))
    assert gains == pytest.approx([100.0 * (1.0 - a / n) for a, n in zip(ants, nearest, strict=True)], abs=0.005)
    parts = [int(figure.row["en"].split("(")[1].rstrip(")")) for figure in table.figures[::3]]
    (block,) = published_blocks({"nests": without_runs("nests")}, "en")
    for first, label in ((0, "prove it: Kendall's"), (1, "without nest 1 (120),")):
        tau, p = stats.kendalltau(parts[first:], gains[first:])
        assert f"{label} τ = {tau:.2f} (p = {p:.2f})" in block.words[-1]


def test_the_mean_gains_are_those_of_the_nests_with_runs() -> None:
    """Nests 2 and 3: published 1.72 and 0.74 %, ours 10 and -30 %."""

    def d(plan: RunPlan) -> Mapping[str, float] | None:
        ants = {"2": 90.0, "3": 130.0}.get(plan.instance.name.partition(":")[0])
        return None if ants is None else {"d_search": ants if "ants" in level(plan, "algorithm") else 100.0}

    (block,) = published_blocks({"nests": runs_of("nests", d)}, "en")
    assert "the paper's ants gain 1.23 % in the mean, ours -10.00 %" in " ".join(block.words)


def test_the_suspicious_times_of_the_thesis_recur_as_the_page_states() -> None:
    times = {figure.row["en"][:3] + figure.levels["processors"][0]: figure.published for figure in figures_of("thesis")}
    assert (times["4-B1"], times["4-C1"]) == (times["3-B1"], times["3-C1"])
    assert times["4-B2"] > times["4-B1"]
    assert len(set(times.values())) < len(times) == 90


def test_both_languages_state_the_same_figures() -> None:
    texts = [(published.page_texts("en")[key], value) for key, value in published.page_texts("es").items()]
    texts += [(text["en"], text["es"]) for table in published_tables() for text in table.sentences]
    assert published.page_texts("en").keys() == published.page_texts("es").keys()
    for english, spanish in texts:
        assert sorted(re.findall(r"{\w+}", english)) == sorted(re.findall(r"{\w+}", spanish))


def test_the_page_of_an_experiment_shows_its_published_figures() -> None:
    whole = load_experiment("boards")
    text = Page(experiment_page_html(whole, [], whole.n_runs)).words
    assert "62.27 %" in text
    assert "not run: leafcut lab run boards" in text
    own = replace(whole, shipped=False)  # a file of the user with the same name
    assert "62.27 %" not in Page(experiment_page_html(own, [], own.n_runs)).words


def test_the_table_has_a_row_for_every_published_figure() -> None:
    runs = {name: without_runs(name) for name in published.published_experiments()}
    rows = list(csv.DictReader(io.StringIO(pairs_as_csv(runs))))
    assert len(rows) == sum(len(table.figures) for table in published_tables())
    page = Page(published_page_html(runs, "es"))
    assert "sin correr: leafcut lab run nests" in page.words
    assert "Lo publicado junto a lo nuestro" in page.words


def test_the_command_writes_a_page_for_each_language_and_refuses_an_empty_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results = tmp_path / "r.sqlite"
    results.touch()
    words = ["lab", "report", "published", "--results", str(results), "-o", str(tmp_path)]
    assert run(words) == 1
    assert capsys.readouterr().err.count("\n") == 1
    with Store(results):
        pass
    assert run([*words, "--reduced"]) == 0
    names = {file.name for file in tmp_path.iterdir()} - {results.name}
    assert names == {"published_reduced.html", "published_reduced_es.html", "published_reduced.csv"}
    assert '<html lang="es">' in (tmp_path / "published_reduced_es.html").read_text(encoding="utf-8")
