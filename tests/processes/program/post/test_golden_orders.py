"""Golden rewritten programs: random little programs in another order, as text, and judged by their work.

After a change that is meant: LEAFCUT_WRITE_GOLDEN=1 pytest with this file, and look at the diff.
"""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from leafcut.errors import PostError
from leafcut.model.obstacles import Obstacles
from leafcut.processes.program.plan.resequencing import find_sequence
from leafcut.processes.program.post.rewriter import rewrite
from rewriting import lowest_way, program_of, work_of

FILE = Path(__file__).parents[3] / "golden" / "reordered.toml"
PROGRAMS = tomllib.loads(FILE.read_text(encoding="ascii"))["program"]


def rewritten(case: dict[str, Any]) -> str:
    """Return the program in the order of a case; tools are 4 mm wide for the zones that rapids avoid."""
    program = program_of(case["text"], case.get("dialect", "linuxcnc"))
    choices = ("process", "merge_tools", "allow_reverse", "mix_operations")
    sequence = find_sequence(program, **{name: case[name] for name in choices if name in case})
    zones = np.array(case.get("zones", np.zeros((0, 5))), dtype=float)
    obstacles = Obstacles(zones[:, :4], zones[:, 4], radii=dict.fromkeys(range(3), 2.0)) if len(zones) else None
    return rewrite(
        program,
        sequence,
        [np.array(order) for order in case["orders"]],
        renumber=case.get("renumber", False),
        longest=case.get("longest", 255),
        obstacles=obstacles,
    )


@pytest.mark.parametrize("number", range(len(PROGRAMS)))
def test_a_program_in_another_order_is_the_golden_one(number: int) -> None:
    case = PROGRAMS[number]
    if "refusal" in case:
        with pytest.raises(PostError) as caught:
            rewritten(case)
        assert str(caught.value) == case["refusal"]
        return
    text = rewritten(case)
    if os.environ.get("LEAFCUT_WRITE_GOLDEN") == "1":
        golden = FILE.read_text(encoding="ascii")
        FILE.write_text(golden.replace(f"'''\n{case['result']}'''", f"'''\n{text}'''"), encoding="ascii")
    assert text == case["result"]


@pytest.mark.parametrize("number", [k for k, case in enumerate(PROGRAMS) if "result" in case])
def test_a_golden_program_does_the_work_of_its_original_and_crosses_no_lower(number: int) -> None:
    name = PROGRAMS[number].get("dialect", "linuxcnc")
    original, new = (program_of(PROGRAMS[number][which], name) for which in ("text", "result"))
    if not PROGRAMS[number].get("allow_reverse"):
        assert work_of(new) == work_of(original)
    assert lowest_way(new) >= lowest_way(original) or np.isnan(lowest_way(original))
