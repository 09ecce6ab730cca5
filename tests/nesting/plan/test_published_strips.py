"""Strips of published sets: leafcut's nest beside spyrrow alone, with the same seeds and the same number of steps."""

from __future__ import annotations

import json
import subprocess
import sys
from statistics import median
from typing import Any

import pytest

pytest.importorskip("spyrrow")

from leafcut.nesting.options import NestOptions
from leafcut.nesting.run import search_nests
from leafcut.options import SolveOptions
from leafcut.read.format import Source
from leafcut.read.strip_instance import read_strip_instance
from shared_data import DATA

#: Height of a scaled strip, mm, beside which the 0.1 mm between two parts are small.
HEIGHT = 1000.0
#: Prints the shortest strip of the first steps. The process ends itself: spyrrow cannot stop after a number of steps.
ALONE = """
import json, os, sys, threading, time
import spyrrow
task = json.load(sys.stdin)
items = [
    spyrrow.Item(str(k), [tuple(p) for p in item["shape"]["data"]], item["demand"], item["allowed_orientations"])
    for k, item in enumerate(task["items"])
]
instance = spyrrow.StripPackingInstance("strip", task["strip_height"], items)
config = spyrrow.StripPackingConfig(
    early_termination=True, total_computation_time=None, exploration_time=100_000, compression_time=100_000,
    num_workers=1, seed=task["seed"],
)
queue, steps = spyrrow.ProgressQueue(), []
threading.Thread(target=instance.solve, args=(config, queue), daemon=True).start()
while len(steps) < task["steps"]:
    steps += queue.drain()
    time.sleep(0.005)
overlapping = (int(spyrrow.ReportType.ExplInfeas), int(spyrrow.ReportType.ExplImproving))
print(min(strip.width for kind, strip in steps[: task["steps"]] if int(kind) not in overlapping), flush=True)
os._exit(0)
"""


def published(name: str) -> dict[str, Any]:
    """Return a published set, scaled to a strip of `HEIGHT`."""
    data: dict[str, Any] = json.loads((DATA / "nesting" / "esicup" / f"{name}.json").read_text())
    scale, data["strip_height"] = HEIGHT / data["strip_height"], HEIGHT
    for item in data["items"]:
        item["shape"]["data"] = [[scale * x, scale * y] for x, y in item["shape"]["data"]]
    return data


@pytest.mark.slow
@pytest.mark.skipif(not (DATA / "nesting").is_dir(), reason="needs the published sets")
@pytest.mark.parametrize(("name", "steps"), [("fu", 250), ("dagli", 250)])
def test_a_strip_is_not_longer_than_that_of_the_nester_alone(name: str, steps: int) -> None:
    """Medians of three seeds, within 1 %: outlines grown for 0.1 mm between parts change the course of the search."""
    data, lengths = published(name), dict[str, list[float]](alone=[], leafcut=[])
    parts = read_strip_instance(Source(f"{name}.json", json.dumps(data).encode()), 1, None, False)
    options = NestOptions(sheet=(f"10000x{HEIGHT:g}",), gap=0.0, margin=0.0, nester="shapes", variants=1)
    for seed in (1, 2, 3):
        task = json.dumps({**data, "seed": seed, "steps": steps})
        alone = subprocess.run([sys.executable, "-c", ALONE], input=task, capture_output=True, text=True, check=True)
        lengths["alone"].append(float(alone.stdout))
        found = search_nests(parts, options, 0.0, SolveOptions(iterations=steps, seed=seed)).nests[0]
        assert found.repeatable and not any(found.unplaced)
        lengths["leafcut"].append(found.used_length)
    assert median(lengths["leafcut"]) <= 1.01 * median(lengths["alone"]), lengths
