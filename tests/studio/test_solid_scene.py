"""The scenes of the stock: of a part that is not flat, and of two programs on one block."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from canvas_scenes import MACHINE
from numpy.typing import NDArray
from solid_scenes import STOCK, shaped_path, stepped_path, stepped_stock

from leafcut.material.solid import cut_display_solid
from leafcut.model.shown_stock import ShownStock
from leafcut.studio.drawing.solid import compared_solid_scenes, solid_scene
from leafcut.studio.jobs.link import Link
from leafcut.studio.jobs.run_job import JobResult, run_task
from leafcut.studio.jobs.task import ReadyTask

SLOT = "(T1 D=8. CR=0. - flat end mill)\nG21 G90 G94\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z{} F200\nX60 F600\nG0 Z5\nM30\n"


def unpacked(scene: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the header and the numbers of each block."""
    size = int.from_bytes(scene[8:12], "little")
    header = json.loads(scene[16 : 16 + size])
    return header, {
        name: np.frombuffer(scene, f"<{kind}", count, 16 + size + offset)
        for name, (kind, offset, count, _) in header["blocks"].items()
    }


def test_the_surface_and_what_holds_it_are_told_cell_by_cell() -> None:
    header, blocks = unpacked(solid_scene(stepped_path(), MACHINE, stepped_stock()))
    solid = cut_display_solid(stepped_path(), stepped_stock())
    assert (blocks["start"].reshape(solid.held.shape) == solid.before.heights).all()
    assert (blocks["held"].reshape(solid.held.shape) == solid.held).all()
    assert header["tools"]["4"]["bodies"] == [["holder", 30.0, 10.0]]
    assert header["differs"] is None


def test_a_block_is_told_by_its_top_alone() -> None:
    _, blocks = unpacked(solid_scene(shaped_path(), MACHINE, STOCK))
    assert len(blocks["start"]) == len(blocks["held"]) == len(blocks["differs"]) == 0


def test_two_programs_are_cut_from_one_block_and_what_is_higher_in_one_is_lower_in_the_other() -> None:
    around = ShownStock(STOCK.tools)
    scenes = compared_solid_scenes(
        (shaped_path(), MACHINE, around), (shaped_path(-2.5), MACHINE, around)
    )  # fmt: skip
    (one, left), (other, right) = map(unpacked, scenes)
    assert [one[key] for key in ("grid", "top", "floor")] == [other[key] for key in ("grid", "top", "floor")]
    assert one["differs"]["count"] == other["differs"]["count"] == 1
    assert [(p[2], p[3]) for p in one["differs"]["places"]] == [(p[3], p[2]) for p in other["differs"]["places"]]
    assert set(np.unique(left["differs"])) == {0, 2}
    assert (np.array([0, 2, 1])[left["differs"]] == right["differs"]).all()


def test_the_same_work_of_another_depth_below_the_floor_is_no_difference() -> None:
    thin = ShownStock(STOCK.tools, block=((0.0, 0.0, -2.0), (120.0, 80.0, 0.0)))
    runs = (shaped_path(), MACHINE, thin), (shaped_path(-2.5), MACHINE, thin)
    for header, blocks in map(unpacked, compared_solid_scenes(*runs)):
        assert header["differs"] == {"count": 0, "places": []}
        assert len(blocks["differs"]) == 0


def compared(folder: Path, *texts: str) -> JobResult:
    """Return two programs compared, as a job does it."""
    files = [folder / f"{name}.nc" for name in ("one", "other")]
    for file, text in zip(files, texts, strict=True):
        file.write_text(text)
    names = tuple(map(str, files))
    return run_task(Link(lambda _: None), ReadyTask("verify", names, "auto", {}), names)


def test_programs_that_are_compared_are_seen_by_what_they_leave(tmp_path: Path) -> None:
    made = compared(tmp_path, SLOT.format(-3), SLOT.format(-4))
    found = [unpacked(made.artefacts[f"scene-solid_{which}"].data)[0] for which in ("before", "after")]
    assert [{(p[2], p[3]) for p in header["differs"]["places"]} for header in found] == [{(-3.0, -4.0)}, {(-4.0, -3.0)}]


@pytest.mark.parametrize("unknown", [0, 1])
def test_a_tool_that_nobody_knows_is_told_of_both_and_no_option_is_named_that_there_is_not(
    unknown: int, tmp_path: Path
) -> None:
    texts = [SLOT.format(-3), SLOT.format(-3)]
    texts[unknown] = texts[unknown].partition("\n")[2]
    made = compared(tmp_path, *texts)
    for which in ("before", "after"):
        header, _ = unpacked(made.artefacts[f"scene-solid_{which}"].data)
        assert "the shape of tool T1 is unknown; describe it in a comment" in header["refused"]
