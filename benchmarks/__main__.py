"""Run a benchmark: `python -m benchmarks NAME [options]`. Without a name, list the benchmarks."""

from __future__ import annotations

import ast
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path


def titles() -> dict[str, str]:
    """Return the first line of each benchmark's docstring, by name; no module is imported."""
    title_of = {}
    for file in sorted(Path(__file__).parent.glob("[!_]*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        if any(isinstance(node, ast.FunctionDef) and node.name == "main" for node in tree.body):
            title_of[file.stem] = (ast.get_docstring(tree) or "").partition("\n")[0]
    return title_of


def main(argv: Sequence[str]) -> int:
    """Run the benchmark named on the command line, and return its exit status."""
    known = titles()
    if not argv or argv[0] in ("-h", "--help"):
        print("python -m benchmarks NAME [options]; --help after a name lists its options\n")
        width = max(map(len, known))
        print("\n".join(f"{name:{width}}  {title}" for name, title in known.items()))
        return 0
    name, *options = argv
    if name not in known:
        print(f"unknown benchmark '{name}'; choose one of {', '.join(known)}", file=sys.stderr)
        return 2
    status: int = import_module(f"benchmarks.{name}").main(options)
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
