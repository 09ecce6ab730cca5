"""Check that sources, options, documents, texts and generated files agree.

``python tools/lint`` runs all checks, and ``python tools/lint docs codes`` runs two of them. Each fault is one line on
standard output. The exit status is 1 if there is a fault.
"""

from __future__ import annotations

import gc
import sys
from importlib import import_module

CHECKS = (
    "modules",
    "options",
    "codes",
    "generated",
    "docs",
    "texts",
    "messages",
    "kernels",
    "schemas",
    "release",
    "hazards",
    "prose",
)


def main(names: list[str]) -> int:
    """Run the named checks, or all checks, and return the exit status."""
    gc.disable()  # all syntax trees are needed until the end, and repeated collections would double the time
    faults = [fault for name in names or CHECKS for fault in import_module(name).faults()]
    for fault in faults:
        print(fault)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
