"""Print the lowest versions that pyproject.toml allows, as a constraints file for pip."""

from __future__ import annotations

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
extras = project["optional-dependencies"]
for requirement in (*project["dependencies"], *extras["lab"], *extras["nest"], *extras["studio"]):
    print(requirement.replace(">=", "==", 1))
