"""A parameter of the literature has its letter wherever it is named: a paper and the page can be read side by side."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.options import AcoOptions, FireflyOptions
from leafcut.processes.settings import group_of
from leafcut.studio.wording import LANGUAGES, words

LETTERS = {
    "n_ants": "m",
    "pheromone_weight": "α",
    "heuristic_weight": "β",
    "evaporation_rate": "ρ",
    "initial_pheromone": "τ₀",
    "elitist_weight": "e",
    "n_ranks": "w",
    "greedy_probability": "q₀",
    "local_evaporation_rate": "ξ",
    "best_probability": "p_best",
    "n_fireflies": "n",
    "attractiveness": "β₀",
    "absorption": "γ",
    "short_inversion": "α",
}
GLOSSARY = (Path(__file__).parents[2] / "docs" / "glossary.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name, letter", LETTERS.items())
def test_the_page_and_the_help_name_a_parameter_by_the_same_letter(name: str, letter: str) -> None:
    english = group_of(name).specs()[name].help
    for language in LANGUAGES:
        spoken = words(language)
        assert spoken.option(name).split()[-1] == letter
        assert f"({letter}" in spoken.help(name, english)


def test_all_parameters_of_the_ants_have_letters_and_the_glossary_explains_those_that_many_algorithms_share() -> None:
    assert set(AcoOptions.specs()) - {"parallel", "n_processes", "device"} <= set(LETTERS)  # these share out the work
    assert {name for name in LETTERS if name not in AcoOptions.specs()} <= set(FireflyOptions.specs())
    for letter in ("τ", "α", "β", "ρ", "ξ", "q₀", "β₀", "γ", "m"):
        assert any(f" {letter} |" in line for line in GLOSSARY.splitlines()), letter
