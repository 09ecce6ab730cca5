"""QtPlasmaC's own filter as a judge: what LinuxCNC's table makes of a text before the interpreter sees it.

    filtered(text, folder).text

The filter (`qtplasmac_gcode` of LinuxCNC) is a script of the screen. It wants an ini file, a table of materials, the
pins of a running screen and a window for its messages. Here the pins answer from a script named ``halcmd``, and the
window writes what it would show.
"""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

_INI = "[EMC]\nMACHINE = table\n[DISPLAY]\nDISPLAY = qtvcp qtplasmac\n[TRAJ]\nLINEAR_UNITS = {units}\n"
_PREFS = "Cut feed rate = 1000\nKerf width = 1.0\n"
_MATERIAL = "[MATERIAL_NUMBER_{n}]\nNAME = m{n}\nKERF_WIDTH = 1.{n}\nPIERCE_HEIGHT = 3\nCUT_SPEED = {n}000\n"
#: It answers what is asked for and forgets what is set: a screen that has taken everything in.
_PINS = '#!/bin/sh\n[ "$1" = setp ] && exit 0\ncase "$2" in *max-offset) echo 5;; *) echo 0;; esac\n'
_WINDOW = """
import sys
class Any:
    def __init__(self, *_, **__): pass
    def __getattr__(self, name): return Any()
    def __call__(self, *_, **__): return Any()
class QLabel(Any):
    def setText(self, text): sys.stderr.write(text + "\\n")
Qt = QIcon = QApplication = QDialog = QScrollArea = QWidget = QVBoxLayout = QPushButton = QStyle = QFrame = Any()
"""


@dataclass(frozen=True)
class Filtered:
    """The filter's output for the interpreter, and its errors and warnings."""

    text: str
    said: str


def filtered(program: str, text: str, folder: Path, units: str = "mm") -> Filtered:
    """Return the output of the filter `program` for a text; materials 1 and 2 are in the table."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "PyQt5").mkdir(exist_ok=True)
    for name in ("__init__", "QtCore", "QtGui", "QtWidgets"):
        (folder / "PyQt5" / f"{name}.py").write_text(_WINDOW, encoding="ascii")
    (folder / "halcmd").write_text(_PINS, encoding="ascii")
    (folder / "halcmd").chmod(0o755)
    (folder / "table.ini").write_text(_INI.format(units=units), encoding="ascii")
    (folder / "table.prefs").write_text(_PREFS, encoding="ascii")
    (folder / "table_material.cfg").write_text("".join(_MATERIAL.format(n=n) for n in (1, 2)), encoding="ascii")
    (folder / "part.ngc").write_text(text, encoding="utf-8")
    # It writes into one folder of all users' programs; two at once would write over each other.
    script = folder / "filter.py"
    script.write_text(Path(program).read_text("utf-8").replace("'/tmp/qtplasmac'", repr(str(folder))), encoding="utf-8")
    environment = {
        **os.environ,
        "INI_FILE_NAME": str(folder / "table.ini"),
        "PATH": f"{folder}:{os.environ['PATH']}",
        "PYTHONPATH": str(folder),
    }
    done = subprocess.run(
        ["/usr/bin/python3", str(script), "part.ngc"],
        capture_output=True, text=True, timeout=300, cwd=folder, env=environment, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(done.stderr)
    return Filtered(done.stdout, done.stderr.strip())
