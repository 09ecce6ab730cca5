"""Compile the kernels that common work needs into the package, so that a wheel built here starts without compiling.

    python .ci/ship_kernels.py [WORD …]

They lie in src/leafcut/kernels/shipped, which git does not hold, and serve machines of this system and architecture
with these versions of Numba; all others compile on their first run. With words only the commands that hold one are run.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
SHIPPED = ROOT / "src" / "leafcut" / "kernels" / "shipped"

#: Command lines whose kernels are shipped; the working folder is empty.
WORK = (
    "optimize {examples}/plate_70.dxf -o plate.nc --machine haas-vf2",
    "optimize {examples}/board_200.dxf -o board.nc --machine grbl-3018",
    "optimize {examples}/cam_121.nc -o faster.nc --machine haas-vf2",
    "optimize {examples}/sheet.dxf --process cut --thickness 6mm -o sheet.ngc",
    "optimize {examples}/pocket.dxf -o pocket.nc --process pocket --tool-diameter 6 --depth 4",
    "solve {examples}/plate_70.dxf",
)


def main() -> None:
    """Run the commands with an empty folder for compiled code, and keep what they compiled."""
    wanted = [line for line in WORK if not sys.argv[1:] or any(word in line for word in sys.argv[1:])]
    shutil.rmtree(SHIPPED, ignore_errors=True)
    with tempfile.TemporaryDirectory() as name:
        cache = Path(name) / "cache"
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("NUMBA", "LEAFCUT"))}
        environment = {**kept, "NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(ROOT / "src")}
        for line in wanted:
            words = line.format(examples=ROOT / "examples").split()
            command = [sys.executable, "-c", "from leafcut.cli import main; main()", *words]
            subprocess.run(command, cwd=name, env=environment, check=True, stdout=subprocess.DEVNULL)
        SHIPPED.mkdir()
        for file in cache.rglob("*.kernel"):
            shutil.copy(file, SHIPPED)
    sizes = [file.stat().st_size for file in SHIPPED.iterdir()]
    print(f"{len(sizes)} kernels, {sum(sizes) / 1e6:.1f} MB in {SHIPPED.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
