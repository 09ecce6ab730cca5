"""Explains a step of an algorithm from the literature, in sentences and in formulas with the numbers of this step."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from leafcut.model.snapshot import SearchStep
from leafcut.studio.page.formulas import (
    formula,
    frac,
    power,
    power_with_index,
    rounded_number,
    row,
    short_number,
    sub,
    sum_over,
)
from leafcut.studio.wording import Words

TAU, ETA, CHANCE = sub("τ", "ij"), sub("η", "ij"), sub("p", "ij")


def explain_step(step: SearchStep, words: Words) -> str:
    """Explain a step in HTML with headings, sentences and formulas."""
    blocks = _firefly_blocks(step, words) if step.algorithm == "firefly" else _ant_blocks(step, words)
    return "".join(blocks)


def _ant_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    yield _title(words("lesson.construction"))
    yield from _choice_rule_blocks(step, words)
    yield from _choice_example_blocks(step, words)
    if step.algorithm == "acs":
        yield from _local_update_blocks(step, words)
    yield _title(words("lesson.learning"))
    yield from _LEARNING[step.algorithm](step, words)
    yield _title(words("lesson.agreement"))
    yield _paragraph(words("lesson.branching", factor=f"{step.values['lambda']:.2f}"))


def _choice_rule_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    v = step.values
    yield _paragraph(words("lesson.rule", ants=short_number(v["m"])))

    def weight(index: str, alpha: str | float, beta: str | float) -> str:
        return row(power_with_index("τ", index, alpha), "·", power_with_index("η", index, beta))

    for alpha, beta in (("α", "β"), (v["alpha"], v["beta"])):
        yield formula(CHANCE, "=", frac(weight("ij", alpha, beta), sum_over("l", weight("il", alpha, beta))))
    yield formula(ETA, "=", frac(1, row(sub("d", "ij"), "+", "ε")), ",", "ε", "=", v["epsilon"])
    if step.algorithm == "acs":
        share = f"{100 * v['q_0']:g}"
        yield _paragraph(words("lesson.greedy", percent=share))


def _choice_example_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    if not step.choices:
        return
    heads = "".join(
        f'<th scope="col"{css}>{escape(head)}</th>'
        for head, css in ((words("lesson.to"), ""), *((head, ' class="n"') for head in ("d", "τ", "η", "p")))
    )
    rows = "".join(
        f'<tr><th scope="row">{c.place}</th><td class="n">{short_number(c.cost)}</td>'
        f'<td class="n"><math>{rounded_number(c.pheromone)}</math></td>'
        f'<td class="n"><math>{rounded_number(c.attraction)}</math></td>'
        f'<td class="n">{100 * c.probability:.1f}\u00a0%</td></tr>'
        for c in step.choices
    )
    title = escape(words("lesson.example", number=step.here))
    yield f"<table><caption>{title}</caption><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table>"


def _local_update_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    v = step.values
    yield _paragraph(words("lesson.local"))
    yield formula(TAU, "←", "(", 1, "−", "ξ", ")", TAU, "+", "ξ", "·", sub("τ", "0"))
    yield formula(TAU, "←", 1.0 - v["xi"], TAU, "+", v["xi"], "·", v["tau_0"])


def _evaporation_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    yield _paragraph(words("lesson.evaporation"))
    yield formula(TAU, "←", "(", 1, "−", "ρ", ")", TAU, "=", 1.0 - step.values["rho"], TAU)


def _ant_system_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    v = step.values
    yield from _evaporation_blocks(step, words)
    yield _paragraph(words("lesson.all_ants", ants=short_number(v["m"])))
    yield formula(TAU, "←", TAU, "+", sum_over("k", frac(1, sub("C", "k"))))
    if "c_iteration" in v:
        best = v["c_iteration"]
        yield _paragraph(words("lesson.shortest_now"))
        yield formula(frac(1, "C"), "=", frac(1, best), "=", 1.0 / best)


def _elitist_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    v = step.values
    yield from _ant_system_blocks(step, words)
    yield _paragraph(words("lesson.elite", weight=short_number(v["e"])))
    yield formula(TAU, "←", TAU, "+", frac("e", _cost_of_best()), "=", TAU, "+", v["e"] / v["c_best"])


def _rank_based_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    v = step.values
    yield from _evaporation_blocks(step, words)
    yield _paragraph(words("lesson.ranks", ranks=short_number(v["w"] - 1), weight=short_number(v["w"])))
    by_rank = sum_over("r", frac(row("w", "−", "r"), sub("C", "r")))
    yield formula(TAU, "←", TAU, "+", by_rank, "+", frac("w", _cost_of_best()))
    yield formula(frac("w", _cost_of_best()), "=", frac(v["w"], v["c_best"]), "=", v["w"] / v["c_best"])


def _max_min_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    v = step.values
    if step.depositor == "restart":
        yield _paragraph(words("lesson.restart"))
        yield formula(TAU, "←", sub("τ", "max"), "=", v["tau_max"])
        return
    yield from _evaporation_blocks(step, words)
    now = step.depositor == "iteration" and "c_iteration" in v
    length = v["c_iteration"] if now else v["c_best"]
    yield _paragraph(words("lesson.one_now" if now else "lesson.one_best"))
    yield formula(TAU, "←", TAU, "+", frac(1, "C"), ",", frac(1, "C"), "=", frac(1, length), "=", 1.0 / length)
    yield _paragraph(words("lesson.limits"))
    yield formula(sub("τ", "max"), "=", frac(1, row("ρ", "·", _cost_of_best())), "=", v["tau_max"])
    yield formula(sub("τ", "min"), "=", v["tau_min"])


def _colony_system_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    v = step.values
    yield _paragraph(words("lesson.best_only"))
    yield formula(TAU, "←", "(", 1, "−", "ρ", ")", TAU, "+", frac("ρ", _cost_of_best()))
    yield formula(TAU, "←", 1.0 - v["rho"], TAU, "+", v["rho"] / v["c_best"])


_LEARNING = {
    "as": _ant_system_blocks, "eas": _elitist_blocks, "asrank": _rank_based_blocks, "mmas": _max_min_blocks,
    "acs": _colony_system_blocks,
}  # fmt: skip


def _firefly_blocks(step: SearchStep, words: Words) -> Iterator[str]:
    v = step.values
    yield _title(words("lesson.attraction"))
    yield _paragraph(
        words(
            "lesson.dark", number=short_number(v["dark"]), count=short_number(v["n"]), length=short_number(v["c_dark"])
        )
    )
    if "target" in v:
        target, length = short_number(v["target"]), short_number(v["c_target"])
        yield _paragraph(words("lesson.target", number=target, length=length, apart=short_number(v["edges_apart"])))
        yield formula(
            "r", "=", frac(row(10, "·", "A"), "h"), "=", frac(row(10, "·", v["edges_apart"]), v["h"]), "=", v["r"]
        )
        yield formula("β", "=", sub("β", "0"), "·", power("e", row("−", "γ", "·", power("r", 2))))
        exponent = row("−", v["gamma"], "·", power(v["r"], 2))
        yield formula("β", "=", v["beta_0"], "·", power("e", exponent), "=", v["beta"])
    else:
        yield _paragraph(words("lesson.alone"))
    yield _title(words("lesson.flight"))
    yield _paragraph(words("lesson.moves", moves=short_number(v["moves"]), longest=short_number(v["longest"])))


def _cost_of_best() -> str:
    return sub("C", "best")


def _title(line: str) -> str:
    return f"<h4>{escape(line)}</h4>"


def _paragraph(line: str) -> str:
    return f"<p>{escape(line)}</p>"
