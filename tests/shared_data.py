"""Folder of real files (LEAFCUT_DATA); it may be missing."""

from __future__ import annotations

import os
from pathlib import Path

DATA = Path(os.environ.get("LEAFCUT_DATA") or Path(__file__).parents[2] / "shared" / "data")
