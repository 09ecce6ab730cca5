"""A drawing that states inches but was drawn in millimetres."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf
import pytest

from leafcut import api
from leafcut.errors import VerifyError


@pytest.mark.parametrize(
    "job",
    [
        {"process": "drill", "thickness": "5mm", "machine": "haas-vf2"},
        {"process": "cut", "thickness": "5mm", "machine": "plasma-table"},
        {"process": "pocket", "depth": 1, "tool_diameter": "6mm", "outline": "pocket", "strategy": "contour"},
    ],
    ids=lambda job: job["process"],
)
def test_a_part_too_large_because_of_stated_inches_is_refused_with_the_option(
    job: dict[str, Any], tmp_path: Path
) -> None:
    """600 × 400 mm, stated as inches, are 15 × 10 m."""
    document = ezdxf.new(units=1)
    space = document.modelspace()
    if job["process"] == "drill":
        for x in (20, 300, 580):
            space.add_circle((x, 200), 4)
    else:
        space.add_lwpolyline([(0, 0), (600, 0), (600, 400), (0, 400)], close=True)
    document.saveas(tmp_path / "plate.dxf")
    with pytest.raises(
        VerifyError, match=r"too large[^\n]*\nthe drawing states that its unit is inches; .* --units mm"
    ):
        api.optimize(tmp_path / "plate.dxf", algorithm="nn", **job)
    if job["process"] != "pocket":  # its path of 200 m takes seconds
        assert api.optimize(tmp_path / "plate.dxf", algorithm="nn", units="mm", **job).verified


def test_a_part_too_large_because_of_stated_metres_is_refused_with_the_option(tmp_path: Path) -> None:
    """ezdxf states metres in each new document, whatever its author draws in."""
    document = ezdxf.new()
    document.modelspace().add_lwpolyline([(0, 0), (60, 0), (60, 40), (0, 40)], close=True)
    document.saveas(tmp_path / "plate.dxf")
    with pytest.raises(
        VerifyError, match=r"too large[^\n]*\nthe drawing states that its unit is metres; .* --units mm"
    ):
        api.optimize(tmp_path / "plate.dxf", process="cut", thickness="5mm", machine="plasma-table")
