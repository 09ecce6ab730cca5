"""A tool library that contradicts the tools that a program names: reported first, and never calculated with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut.errors import OptionError
from pace_programs import BLOCK

PROGRAM = """G21 G90
T1 M6 (T1 D=6. CR=0. - flat end mill)
M3 S9000
G0 X10 Y10
G0 Z5
G1 Z-2 F300
G1 X30 F600
G0 Z5
M5
M2
"""


def of(folder: Path, diameter: str, **options: Any) -> Any:
    library = folder / "tools.toml"
    library.write_text(f'[[tool]]\nnumber = 1\nkind = "end-mill"\ndiameter = "{diameter}"\n', encoding="utf-8")
    program = folder / "part.nc"
    program.write_text(PROGRAM, encoding="utf-8")
    return str(program), {"tools": str(library), **options}


@pytest.mark.hazard
@pytest.mark.parametrize("asked", ["air", "low_retracts"])
def test_new_speeds_and_heights_are_refused_with_the_library_of_other_tools(tmp_path: Path, asked: str) -> None:
    """With a mill of 3.175 mm a cut beside the wall of a slot would be in the air: for one of 6 mm it is not."""
    program, options = of(tmp_path, "3.175 mm", workpiece=BLOCK, **{asked: True})
    told = rf"--{asked.replace('_', '-')}: .*part\.nc: L813 T1 is Ø3\.175 mm in the library, but Ø6 mm in .* comment"
    with pytest.raises(OptionError, match=told):
        leafcut.optimize(program, **options)
    program, options = of(tmp_path, "5.95 mm", workpiece=BLOCK, **{asked: True})  # reground
    assert not any(issue.code == "L813" for issue in leafcut.optimize(program, **options).issues)


@pytest.mark.hazard
def test_the_library_of_other_tools_is_the_first_issue(tmp_path: Path) -> None:
    program, options = of(tmp_path, "3.175 mm")
    for found in (leafcut.stock(program, **options), leafcut.optimize(program, **options)):
        assert found.issues[0].code == "L813" and found.issues[0].place == "line 6"
        assert "Ø3.175 mm" in found.issues[0].message
    program, options = of(tmp_path, "6 mm")
    for found in (leafcut.stock(program, **options), leafcut.optimize(program, **options)):
        assert not any(issue.code == "L813" for issue in found.issues)
