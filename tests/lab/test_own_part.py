"""Experiments on a part of the user: each strategy gives the same result as a manual run."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut import api
from leafcut.errors import OptionError
from leafcut.lab.own_experiment import compared_option_values, comparison_experiment
from leafcut.lab.running import execute_experiment, stored_rows
from leafcut.lab.store import Store

PLATE = str(Path(__file__).parents[2] / "examples" / "plate_10.dxf")


def test_each_run_is_the_one_of_its_algorithm_and_seed(tmp_path: Path) -> None:
    shared = {"machine": "haas-vf2", "depth": 3, "preset": "fast", "seed": 4}
    of = comparison_experiment(
        "plate", PLATE, "optimize", {**shared, "algorithm": "acs", "n_ants": 3}, ["nn", "acs"], 2
    )
    with Store(tmp_path / "r.sqlite") as store:
        assert execute_experiment(of, store).done == 4
        rows = stored_rows(of, store)
    assert {(row.levels["algorithm"], row.seed) for row in rows} == {(w, s) for w in ("nn", "acs") for s in (4, 5)}
    for row in rows:
        alone = api.optimize(
            PLATE,
            machine="haas-vf2",
            depth=3,
            preset="fast",
            threads=1,
            seed=row.seed,
            algorithm=row.levels["algorithm"],
            **({"n_ants": 3} if row.levels["algorithm"] == "acs" else {}),
        )
        assert row.responses["machining"] == pytest.approx(alone.after.time_s, abs=1e-9)


def test_each_algorithm_runs_with_the_settings_that_it_uses() -> None:
    settings = {"n_ants": 5, "absorption": 0.1, "greedy_probability": 0.5, "local_search": False, "seed": 2}
    of = comparison_experiment("x", PLATE, "solve", settings, ["mmas", "acs", "firefly", "2opt"], 1)
    used = {plan.options["algorithm"]: plan.options.keys() & settings.keys() - {"seed"} for plan in of.runs()}
    assert used == {
        "mmas": {"n_ants", "local_search"},
        "acs": {"n_ants", "greedy_probability", "local_search"},
        "firefly": {"absorption", "local_search"},
        "2opt": {"local_search"},
    }
    assert of.seeds == (2,)


def test_pockets_differ_in_their_strategy() -> None:
    option, ways = compared_option_values("pocket")
    assert option == "strategy"
    assert {"zigzag", "contour", "connected"} <= set(ways)
    assert "auto" not in ways


@pytest.mark.parametrize(
    ("ways", "runs", "line"),
    [(["nn"], 3, "at least two"), (["nn", "ants"], 3, "unknown algorithm 'ants'"), (["nn", "as"], 0, "choose 1 to")],
)
def test_what_cannot_be_compared_is_refused_in_one_line(ways: list[str], runs: int, line: str) -> None:
    with pytest.raises(OptionError, match=line):
        comparison_experiment("x", PLATE, "solve", {}, ways, runs)
