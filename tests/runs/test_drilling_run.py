"""Drilling as a whole: several tools, one after the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import leafcut
from leafcut.errors import VerifyError
from leafcut.solve import solve as room


def map_of(tmp_path: Path, seed: int) -> Path:
    """Write a map of a few holes of three diameters."""
    rng = np.random.default_rng(seed)
    rows = [
        f"{x:.1f},{y:.1f},{d}" for (x, y), d in zip(rng.uniform(0, 90, (7, 2)), rng.choice([2, 3, 4], 7), strict=True)
    ]
    path = tmp_path / f"map_{seed}.csv"
    path.write_text("x,y,diameter\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("objective", ["time", "distance"])
def test_no_plan_is_worse_than_the_drawings_and_nearest_neighbours(tmp_path: Path, objective: str) -> None:
    """Where one tool ends the next begins, so that all together may be worse than tool by tool; bounds stay valid."""
    restated = 0
    for seed in range(40):
        found = leafcut.optimize(map_of(tmp_path, seed), units="mm", objective=objective, preset="fast")
        ours, drawn, nearest = (
            m.time_s if objective == "time" else m.travel_mm for m in (found.after, found.before, found.nearest)
        )
        assert ours <= min(drawn, nearest) + 1e-9
        for operation in found.operations:
            assert operation.solution.lower_bound is not None
            assert operation.solution.lower_bound <= operation.solution.cost + 1e-9
        restated += found.operations[0].solution.algorithm in ("nn", "none")
    assert restated > 0  # else nothing was tried


def test_a_part_that_is_too_large_is_refused_before_anything_is_sought(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "large.csv"
    path.write_text("x,y\n0,0\n5,5\n9000,5\n4,4\n1,3\n8,9\n")
    monkeypatch.setattr(room, "solve", lambda *_, **__: pytest.fail("something was sought"))
    with pytest.raises(VerifyError, match="too large"):
        leafcut.optimize(path, units="mm")
