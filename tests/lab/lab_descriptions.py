"""Descriptions of small experiments for tests of the lab."""

from __future__ import annotations

from pathlib import Path

#: Twelve runs that take some milliseconds each: two maps, two algorithms, three seeds.
SMALL = """
title = "Two algorithms"
command = "solve"
seeds = 3
options = {iterations = 5, threads = 1, bound = false, local_search = false}
[[instance]]
name = "ten"
input = "example:plate-10"
facts = {size = 10}
[[instance]]
name = "thirty"
input = "random:30:5"
facts = {size = 30}
[factor.algorithm]
option = "algorithm"
levels = ["as", "acs"]
[response.length]
unit = "mm"
path = "length"
[[analysis]]
kind = "compare"
factors = ["algorithm"]
[reduced]
seeds = [7]
instances = ["ten"]
levels = {algorithm = ["acs"]}
"""


def written(folder: Path, text: str = SMALL, name: str = "small.toml") -> Path:
    """Write a description and return its path."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path
