"""Files of the repository: paths, texts, syntax trees, and positions in them."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "src" / "leafcut"
DOCS = ROOT / "docs"


@cache
def text_of(file: Path) -> str:
    """Return the text of a file."""
    return file.read_text(encoding="utf-8")


@cache
def tree_of(file: Path) -> ast.Module:
    """Return the syntax tree of a Python file."""
    return ast.parse(text_of(file))


@cache
def nodes_of(file: Path) -> tuple[ast.AST, ...]:
    """Return all nodes of the syntax tree of a Python file."""
    return tuple(ast.walk(tree_of(file)))


@cache
def modules(*parts: str) -> tuple[Path, ...]:
    """Return the Python files in the given files or folders of the package, or in the whole package."""
    folders = [PACKAGE / part for part in parts] or [PACKAGE]
    return tuple(sorted(file for one in folders for file in ([one] if one.is_file() else one.rglob("*.py"))))


def place(file: Path, line: int | None = None) -> str:
    """Return a position in the form that editors use: ``docs/sheets.md:12``."""
    return file.relative_to(ROOT).as_posix() + (f":{line}" if line else "")


def matches(pattern: str, file: Path) -> Iterator[tuple[str, re.Match[str]]]:
    """Yield every match in a file with its position; ``^`` and ``$`` match at line boundaries."""
    text = text_of(file)
    for match in re.finditer(pattern, text, flags=re.MULTILINE):
        yield place(file, text.count("\n", 0, match.start()) + 1), match
