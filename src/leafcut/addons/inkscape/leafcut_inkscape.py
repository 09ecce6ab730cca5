"""Inkscape extension. Inkscape calls it with a drawing, and reads the program from standard output."""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys

#: Command that starts leafcut; `leafcut install addon inkscape` writes the path of this installation here.
LEAFCUT = ["leafcut"]


def leafcut_command(arguments: list[str]) -> list[str]:
    """Convert the arguments from Inkscape to a leafcut command line."""
    parser = argparse.ArgumentParser()
    for name in ("work", "machine", "thickness", "depth", "tool", "more", "tab", "id"):
        parser.add_argument(f"--{name}", default="")
    parser.add_argument("drawing")
    given = parser.parse_args(arguments)
    words = ["pocket" if given.work == "pocket" else "cut", given.drawing, "-o", "-", "--quiet"]
    used = {"--depth": given.depth, "--tool-diameter": given.tool}
    if given.work != "pocket":
        used = {"--thickness": given.thickness}
    for flag, value in {"--machine": given.machine, **used}.items():
        if value.strip():
            words += [flag, value.strip()]
    return [*LEAFCUT, *words, *shlex.split(given.more)]


def main() -> int:
    """Write the program to standard output and messages to standard error, and return the exit status."""
    # Inkscape has its own Python, whose environment variables would disturb leafcut.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    try:
        done = subprocess.run(leafcut_command(sys.argv[1:]), capture_output=True, env=environment, check=False)
    except OSError as problem:
        sys.stderr.write(f"leafcut cannot be started ({problem}); run: leafcut install addon inkscape\n")
        return 1
    except ValueError as problem:
        sys.stderr.write(f"More options: {problem}\n")
        return 2
    sys.stderr.write(done.stderr.decode("utf-8", "replace"))
    # Status 3: parts of the drawing are not cut. leafcut has reported them, and the program is written.
    if done.returncode not in (0, 3):
        return done.returncode
    sys.stdout.buffer.write(done.stdout)
    return 0


if __name__ == "__main__":
    sys.exit(main())
