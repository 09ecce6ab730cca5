"""Install add-ons for other programs.

An add-on runs in the Python interpreter of the other program, which cannot import leafcut. The add-on therefore starts
leafcut as a separate program.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from leafcut.errors import OptionError, name_suggestion
from leafcut.files.whole_files import OutputError, check_output, write_all_or_none

#: Default command in an add-on that starts leafcut. The installation replaces it.
_CALL = 'LEAFCUT = ["leafcut"]'


@dataclass(frozen=True)
class Addon:
    """An add-on for another program: its name, its purpose, its files, and the next step for the user."""

    name: str
    help: str
    files: tuple[str, ...]
    then: str


ADDONS = {
    one.name: one
    for one in (
        Addon(
            "inkscape",
            "Inkscape saves a drawing as a program that cuts it from sheet or mills its pockets",
            ("leafcut.inx", "leafcut_inkscape.py"),
            "start Inkscape again: File > Save a Copy, leafcut program (*.ngc)",
        ),
        Addon(
            "freecad",
            "a post-processor for FreeCAD: programs of its jobs are reordered and verified",
            ("leafcut_post.py",),
            "start FreeCAD again: the output of a job has the processor leafcut",
        ),
    )
}


def write_addon(name: str, folder: str | Path) -> list[Path]:
    """Write all files of an add-on into a folder, and return their paths. If a file cannot be written, write none.

    The files call this leafcut through its own Python interpreter. The function replaces the files of an earlier
    leafcut.

    Raises
    ------
    OptionError
        The add-on is unknown.
    OutputError
        The folder does not exist, a file cannot be written, or a file of the same name does not come from leafcut.
    """
    if name not in ADDONS:
        raise OptionError(f"unknown add-on '{name}'{name_suggestion(name, ADDONS)}")
    if not Path(folder).is_dir():
        raise OutputError(f"{folder}: not a folder; create it first, or name the other program's folder")
    texts = {}
    for file in ADDONS[name].files:
        text = (resources.files("leafcut.addons") / name / file).read_text(encoding="utf-8")
        target = Path(folder) / file
        check_output(target, ())
        if target.exists() and b"leafcut" not in target.read_bytes():
            raise OutputError(f"{target}: exists already and is not from leafcut; choose another folder")
        texts[str(target)] = text.replace(_CALL, f"LEAFCUT = {[sys.executable, '-m', 'leafcut']!r}")
    write_all_or_none(texts)
    return [Path(target) for target in texts]
