"""A description determines the runs and their order; errors name their position."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest
from lab_descriptions import SMALL, written

from leafcut.errors import LeafcutError, OptionError
from leafcut.lab.loading import included_names, load_experiment, reduced_experiment

MORE = """
[factor.set.level]
A = {pheromone_weight = 1}
B = {pheromone_weight = 2, heuristic_weight = 4.5}
"""


def test_runs_are_all_combinations_and_seeds_come_round_last(tmp_path: Path) -> None:
    found = load_experiment(written(tmp_path, SMALL + MORE))
    runs = [(r.seed, r.instance.name, r.levels["algorithm"].name, r.levels["set"].name) for r in found.runs()]
    assert runs == list(itertools.product((1, 2, 3), ("ten", "thirty"), ("as", "acs"), ("A", "B")))
    assert found.n_runs == len(runs)


def test_options_of_a_level_win_over_those_of_the_instance_and_these_over_the_common_ones(tmp_path: Path) -> None:
    text = SMALL.replace("facts = {size = 30}", "options = {iterations = 6, heuristic_weight = 3}") + MORE
    plans = load_experiment(written(tmp_path, text)).runs()
    runs = {(plan.instance.name, plan.levels["set"].name): dict(plan.options) for plan in plans if plan.seed == 1}
    assert runs["ten", "A"]["iterations"] == 5
    assert "heuristic_weight" not in runs["ten", "A"]
    assert runs["thirty", "A"]["iterations"] == 6
    assert runs["thirty", "A"]["heuristic_weight"] == 3
    assert runs["thirty", "B"]["heuristic_weight"] == 4.5


def test_the_reduced_form_has_what_it_names_and_is_kept_under_a_name_of_its_own(tmp_path: Path) -> None:
    whole = load_experiment(written(tmp_path))
    short = reduced_experiment(whole)
    assert [(r.seed, r.instance.name, r.levels["algorithm"].name) for r in short.runs()] == [(7, "ten", "acs")]
    assert short.storage_key != whole.storage_key


def test_files_are_sought_beside_the_description(tmp_path: Path) -> None:
    text = SMALL.replace("random:30:5", "maps/mine.csv")
    assert load_experiment(written(tmp_path, text)).instances[1].input == str(tmp_path / "maps" / "mine.csv")


@pytest.mark.parametrize("name", included_names())
def test_every_shipped_experiment_can_be_meant_and_has_a_reduced_form_that_is_small(name: str) -> None:
    whole = load_experiment(name)
    assert whole.title
    assert whole.about
    assert whole.analyses
    assert reduced_experiment(whole).n_runs <= 40


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("seeds = 3", "seeds = 0", "seeds: give how many"),
        ("seeds = 3", "seeds = [1, 1]", "each once"),
        ("seeds = 3", "seed = 3", "unknown key 'seed'; did you mean 'seeds'"),
        ('command = "solve"', 'command = "solv"', "unknown command 'solv'; did you mean 'solve'"),
        ("iterations = 5", "iteratons = 5", "unknown option 'iteratons'; did you mean 'iterations'"),
        ("iterations = 5", "kerf = 5", "--kerf: this option does not apply to"),
        ('["as", "acs"]', '["as", "axs"]', "axs"),
        ('["as", "acs"]', '["as", "as"]', "two levels are the same"),
        ('["as", "acs"]', "[]", "give option = and levels"),
        ('name = "thirty"', 'name = "ten"', "two instances are called 'ten'"),
        ('kind = "compare"', 'kind = "compair"', "unknown kind 'compair'; did you mean 'compare'"),
        ('kind = "compare"', 'kind = "crossed"', "'crossed' is of 2 factors; 1 given"),
        ('kind = "compare"', 'kind = "anova"\nresponse = "weight"', "unknown response 'weight'"),
        ('kind = "compare"', 'kind = "anova"\nalpha = 2', "alpha = 2 is out of range"),
        ('kind = "compare"', 'kind = "compare"\nfact = "best"', "unknown fact 'best'"),
        ('kind = "compare"', 'kind = "compare"\nbase = "as"\nfact = "size"', "in place of a base"),
        ('path = "length"', "", "path: a text is needed"),
        ('[response.length]\nunit = "mm"\npath = "length"', "", "say what is measured"),
        ('instances = ["ten"]', 'instances = ["tenn"]', "unknown 'tenn'; did you mean 'ten'"),
        ('levels = {algorithm = ["acs"]}', 'levels = {algo = ["acs"]}', "no factor; did you mean 'algorithm'"),
    ],
)
def test_what_is_wrong_is_told_in_one_line(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in SMALL
    with pytest.raises(OptionError) as refused:
        load_experiment(written(tmp_path, SMALL.replace(old, new)))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
    assert "small" in str(refused.value)


def test_an_empty_design_and_one_that_is_too_large_are_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="has no run"):
        load_experiment(written(tmp_path, SMALL.partition("[[instance]]")[0] + '[response.a]\npath = "length"'))
    huge = (
        SMALL.replace("seeds = 3", "seeds = 1000")
        + '[factor.n_ants]\noption = "n_ants"\nlevels = '
        + str(list(range(1, 60)))
    )
    with pytest.raises(OptionError, match="at most 100000"):
        load_experiment(written(tmp_path, huge))


@pytest.mark.parametrize("name", ["no_such", "../thesis", "no/such.toml", "thesis/../x"])
def test_a_name_that_is_none_is_refused_and_leads_out_of_no_folder(name: str) -> None:
    with pytest.raises(LeafcutError):
        load_experiment(name)
