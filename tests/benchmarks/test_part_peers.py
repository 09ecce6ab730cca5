"""The comparison of part with other CAM programs: what it refuses, and how it reads the material after a program."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.part_peers import DIAMETER, TAB_WIDTH, Work, remaining

from benchmarks import part_peers
from leafcut.geometry.polyline import Polyline
from leafcut.material.height_field import HeightField
from leafcut.model.contour import Contour

SIDE, THICKNESS, CELL = 30.0, 4.0, 0.1


def test_a_missing_peer_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(part_peers.shutil, "which", lambda _name: None)
    assert part_peers.main(["bracket"]) == 2
    assert capsys.readouterr().err == "part_peers: freecadcmd is required: apt-get install freecad\n"
    monkeypatch.setattr(part_peers.shutil, "which", lambda name: name)
    assert part_peers.main(["bracket", "--viaconstructor", "nowhere/python"]) == 2
    assert capsys.readouterr().err == "part_peers: nowhere/python has no viaConstructor: pip install viaconstructor\n"


@pytest.mark.parametrize("gouge", [0.0, 2.0])
def test_a_tab_an_uncut_edge_and_a_cut_into_the_part_are_measured(gouge: float) -> None:
    """The kerf around a square has a tab on one side, and 20 mm of another side are not cut."""
    corners = np.array([(0, 0, 0), (SIDE, 0, 0), (SIDE, SIDE, 0), (0, SIDE, 0)], dtype=float)
    layers = {"PROFILE": [Contour(Polyline(corners, closed=True))], "BORE": [], "POCKET": [], "ENGRAVE": []}
    cells = int((SIDE + 20.0) / CELL)
    axis = -10.0 + CELL * (0.5 + np.arange(cells))
    x, y = np.meshgrid(axis, axis)
    inside = (x > 0.0) & (x < SIDE) & (y > 0.0) & (y < SIDE)
    around = (x > -DIAMETER) & (x < SIDE + DIAMETER) & (y > -DIAMETER) & (y < SIDE + DIAMETER) & ~inside
    tab = (y < 0.0) & (abs(x - 15.0) < 0.5 * TAB_WIDTH)
    uncut = (y > SIDE) & (abs(x - 15.0) < 10.0)
    heights = np.where(around & ~tab & ~uncut, -THICKNESS - 0.5, 0.0)
    heights[inside & (x > SIDE - gouge)] = -1.0
    field = HeightField(heights.astype(np.float32), axis[0], axis[0], CELL, -10.0)
    tabs, left, into = remaining(field, Work("square", THICKNESS, layers))
    assert [line.centroid.coords[0] for line in tabs] == [pytest.approx((15.0, -0.5 * DIAMETER), abs=0.2)]
    assert left == pytest.approx(20.0, abs=0.3)
    # Cells within the tolerance of the edge do not count.
    assert into == pytest.approx(max(gouge - 0.2, 0.0) * (SIDE - 0.4), abs=0.5)
