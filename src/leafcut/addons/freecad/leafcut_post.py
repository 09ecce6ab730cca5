"""FreeCAD post-processor: a standard post-processor writes the program, then leafcut reorders and verifies it.

Arguments of the job: ``--base NAME`` names the standard post-processor (default: linuxcnc). All other arguments are
options of `leafcut reorder`: ``--machine haas-vf2 --time-limit 5s``
"""

from __future__ import annotations

import importlib
import os
import shlex
import subprocess
from typing import Any

#: Command that starts leafcut; `leafcut install addon freecad` writes the path of this installation here.
LEAFCUT = ["leafcut"]

TOOLTIP = "Posts with another post-processor (--base linuxcnc), then reorders and verifies with leafcut reorder."
TOOLTIP_ARGS = "--base NAME, and the options of leafcut reorder: --machine haas-vf2 --time-limit 5s"

#: Packages that contain FreeCAD's post-processors, up to version 0.20 and since then.
_PLACES = ("PathScripts.post", "Path.Post.scripts")


def export(objectslist: Any, filename: str, argstring: str) -> str:
    """Write the program of a job and return its text.

    If leafcut refuses the program, the function raises RuntimeError before it writes anything.
    """
    words = shlex.split(argstring or "")
    base = "linuxcnc"
    if "--base" in words:
        place = words.index("--base")
        if place + 1 == len(words):
            raise RuntimeError("--base needs the name of a post-processor, such as linuxcnc")
        base = words[place + 1]
        del words[place : place + 2]
    text = str(_load_post_processor(base).export(objectslist, "-", "--no-show-editor") or "")
    if not text:
        raise RuntimeError(f"the post-processor {base} wrote nothing")
    # FreeCAD has its own Python, whose environment variables would disturb leafcut.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    command = [*LEAFCUT, "reorder", "-", "-o", "-", "--quiet", *words]
    try:
        done = subprocess.run(command, input=text.encode("utf-8"), capture_output=True, env=environment, check=False)
    except OSError as problem:
        raise RuntimeError(
            f"leafcut cannot be started ({problem}); install it again: leafcut install addon freecad"
        ) from None
    told = done.stderr.decode("utf-8", "replace").strip()
    if done.returncode:
        raise RuntimeError(told or f"leafcut ended with status {done.returncode}")
    if told:
        _warn(told)
    if filename != "-":
        _write(filename, done.stdout)
    return str(done.stdout.decode("utf-8", "replace"))


def _load_post_processor(name: str) -> Any:
    for module in (*(f"{place}.{name}_post" for place in _PLACES), f"{name}_post"):
        try:
            return importlib.import_module(module)
        except ModuleNotFoundError as problem:
            if not module.startswith(str(problem.name)):
                raise
    raise RuntimeError(f"--base {name}: FreeCAD has no post-processor of that name")


def _write(filename: str, data: bytes) -> None:
    passing = f"{filename}.leafcut-part"
    try:
        with open(passing, "wb") as file:  # noqa: PTH123  # as plain as FreeCAD's own
            file.write(data)
        os.replace(passing, filename)  # noqa: PTH105
    except OSError as problem:
        raise RuntimeError(f"{filename}: cannot be written ({problem.strerror})") from None


def _warn(told: str) -> None:
    try:
        freecad = importlib.import_module("FreeCAD")
    except ModuleNotFoundError:
        return
    freecad.Console.PrintWarning(told + "\n")
