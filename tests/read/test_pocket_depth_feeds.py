"""`--feeds` with pockets of several depths in one solid."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("OCP")

from leafcut import api
from leafcut.model.toolpath import Kind
from leafcut.read.work_materials import load_material
from made_solids import box, cut, rounded, saved
from own_machines import machine_of_power

pytestmark = pytest.mark.usefixtures("opencascade_at_hand")

LIBRARY = (
    '[[tool]]\nnumber = 1\nkind = "end-mill"\ndiameter = "6 mm"\nteeth = 3\nfeed = "600 mm/min"\n'
    'spindle_speed = "6000 rpm"\nplunge_feed = "200 mm/min"\n'
)


def slot_power(depth: float, feed: float) -> float:
    """Return the power of a slot at a feed, mm/s, W: 6 wide, at the mean chip over half a turn, 300 teeth a second."""
    steel = load_material("c45")
    chip = feed / 300.0 * 2.0 / math.pi
    return 6.0 * depth * feed * steel.kc11 * chip**-steel.mc / 1000.0


@pytest.mark.slow
def test_the_deepest_level_of_all_pockets_counts_for_the_power_of_each(tmp_path: Path) -> None:
    """Levels of 3 mm and of 2 mm: first cuts of both are as slow as a slot 3 mm deep has to be, never faster."""
    solid = cut(box(0, 0, -20, 100, 50, 0), rounded(10, 10, -6, 40, 40, 1, 5), rounded(55, 10, -2, 85, 40, 1, 5))
    (tmp_path / "shop.toml").write_text(LIBRARY)
    found = api.optimize(
        saved(tmp_path / "two.step", solid),
        process="pocket",
        preset="fast",
        threads=1,
        machine=machine_of_power(tmp_path, "0.4 kW"),
        strategy="contour",
        tools=tmp_path / "shop.toml",
        feeds=True,
        material="c45",
    )
    path = found.written
    assert path is not None
    level = np.isin(path.kind, (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)) & (path.before[:, 2] == path.end[:, 2])
    slowest = [float(path.value[level & (path.end[:, 2] == z)].min()) for z in (-2.0, -3.0)]
    assert slot_power(3.0, 10.0) > 300.0 > slot_power(2.0, slowest[1]) * 1.2
    for feed in slowest:
        assert 0.85 * 300.0 < slot_power(3.0, feed) <= 300.0 * 1.001
    (told,) = [one for one in found.detail.pace.tools[0].limits if one.name == "power"]
    assert told.after <= 300.0 * 1.0001
