"""Moves that cut nothing use the air feed; two measurements find the slivers that one of them misses."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.geometry.polyline import Polyline
from leafcut.material.removal import engaged_tool_path
from leafcut.model.pocket import PocketPath, PocketPiece, PocketRules
from leafcut.processes.pocket.clearing import divide_at_air_cuts

RULES = PocketRules(tool_diameter=10.0, step_over=6.0)


# Three of 1,500 random paths hide a sliver between two measured places.
@pytest.mark.parametrize("seed", [115, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (136, 172))])
def test_air_moves_as_written_cut_nothing(seed: int) -> None:
    corners = np.random.default_rng(seed).uniform(0.0, 70.0, (50, 2)).round(2)
    rough = PocketPiece(Polyline.of_points(corners.tolist()), "rough")
    way, engaged = engaged_tool_path(PocketPath("", (rough,)), RULES)
    (pieces,) = divide_at_air_cuts([rough], way, engaged, RULES)
    kinds = [piece.kind for piece in pieces]
    assert kinds.count("air") > 20
    assert sum(piece.path.length for piece in pieces) == pytest.approx(rough.path.length)
    way, engaged = engaged_tool_path(PocketPath("", tuple(pieces)), RULES)
    widest = [engaged.width[way.piece == number].max() for number in range(len(pieces))]
    assert max(w for w, kind in zip(widest, kinds, strict=True) if kind == "air") == 0.0
