"""Explanations of a step of an algorithm: complete sentences in every language, formulas in MathML."""

from __future__ import annotations

from xml.etree import ElementTree

import pytest

from leafcut.model.problem import RoutingProblem
from leafcut.model.snapshot import Observer, SearchStep
from leafcut.options import LITERATURE, SolveOptions
from leafcut.order.solve import solve
from leafcut.studio.page.formulas import formula, frac, rounded_number, short_number, sub
from leafcut.studio.page.lesson import explain_step
from leafcut.studio.wording import LANGUAGES, words

XY = [(0.0, 0.0), (9.0, 1.0), (8.0, 7.0), (3.0, 9.0), (1.0, 5.0), (5.0, 4.0), (6.0, 8.0), (2.0, 2.0)]


def steps_of(algorithm: str) -> list[SearchStep]:
    seen: list[SearchStep] = []

    class Look(Observer):
        def show(self, take, alone: bool) -> None:  # type: ignore[no-untyped-def]
            seen.append(take().step)

    options = SolveOptions(algorithm=algorithm, iterations=6, threads=1, local_search=False)
    solve(RoutingProblem.of_points(XY, closed=True), options, observe=Look())
    return seen


def tree(html: str) -> ElementTree.Element:
    return ElementTree.fromstring(f"<div>{html}</div>")


@pytest.mark.parametrize("algorithm", LITERATURE)
def test_every_step_is_told_in_every_language(algorithm: str) -> None:
    steps = steps_of(algorithm)
    assert steps
    for language in LANGUAGES:
        for step in steps:
            told = tree(explain_step(step, words(language)))
            assert len(told.findall(".//h4")) >= 2
            assert all("".join(p.itertext()).strip().endswith((".", "is", "son")) for p in told.iter("p"))
            assert "{" not in "".join(told.itertext())
            assert told.find(".//math") is not None or "target" not in step.values


def test_numbers_in_the_formulas_are_those_of_the_step() -> None:
    values = {
        "alpha": 1.0, "beta": 5.0, "rho": 0.25, "m": 30, "tau_0": 0.5, "epsilon": 0.01, "c_best": 200.0,
        "c_iteration": 250.0, "lambda": 3.5, "tau_max": 0.02, "tau_min": 0.001,
    }  # fmt: skip

    def told(step: SearchStep) -> list[str]:
        return ["".join(one.itertext()) for one in tree(explain_step(step, words("en"))).iter("math")]

    formulas = told(SearchStep("mmas", values, "iteration"))
    assert any("0.75" in one for one in formulas)  # 1 − ρ
    assert any(one.endswith("1250=0.004") for one in formulas)  # 1/C of the best of the iteration
    assert any(one.endswith("=0.02") for one in formulas)
    assert any(one.endswith("1200=0.005") for one in told(SearchStep("mmas", values, "best")))
    assert any(one.endswith("=0.02") for one in told(SearchStep("mmas", values, "restart")))
    elite = told(SearchStep("eas", {**values, "e": 10.0}))
    assert any(one.endswith("+0.05") for one in elite)  # e/C = 10/200
    ranks = told(SearchStep("asrank", {**values, "w": 6.0}))
    assert any(one.endswith("=0.03") for one in ranks)  # w/C = 6/200


@pytest.mark.parametrize(
    ("value", "shown"),
    [(0.0, "0"), (25, "25"), (0.02, "0.02"), (6120.34, "6120"), (0.00012345, "1.234·10−4"), (2.5e7, "2.500·107")],
)
def test_numbers_have_four_digits_and_a_power_of_ten_where_they_are_small_or_large(value: float, shown: str) -> None:
    assert "".join(tree(rounded_number(value)).itertext()).replace(",", "") in (shown, shown.replace("1.234", "1.235"))


def test_a_formula_keeps_letters_numbers_and_signs_apart() -> None:
    made = tree(formula(sub("τ", "ij"), "←", frac(1, "C"), "<", 3))
    assert [one.text for one in made.iter("mi")] == ["τ", "i", "j", "C"]
    assert [one.text for one in made.iter("mn")] == ["1", "3"]
    assert [one.text for one in made.iter("mo")] == ["←", "<"]
    assert short_number(1234.6) == "1,235"
