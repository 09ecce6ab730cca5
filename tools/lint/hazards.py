"""Compare the table of hazards (docs/hazards.md) with the tests that are marked `hazard`."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import sources

PAGE = sources.DOCS / "hazards.md"
TESTS = sources.ROOT / "tests"


def faults() -> Iterator[str]:
    """Yield every fault."""
    listed = {match[1]: place for place, match in sources.matches(r"`([\w/]+\.py::\w+)`", PAGE)}
    marked = dict(marked_tests())
    for test in sorted(listed.keys() - marked.keys()):
        yield f"{listed[test]}: tests/{test} does not exist, or has no marker `hazard`"
    for test in sorted(marked.keys() - listed.keys()):
        yield f"{marked[test]}: {test} has the marker `hazard`, but {sources.place(PAGE)} does not name it"
    for place, match in sources.matches(r"^\| (?!hazard \||---)(.*) \|$", PAGE):
        hazard, rule, *tests = (cell.strip() for cell in match[1].split("|"))
        if not (hazard and rule and len(tests) == 2 and any(tests)):
            yield f"{place}: a row needs a hazard, a rule, and a test or a mutant"


def marked_tests() -> Iterator[tuple[str, str]]:
    """Yield the file and function of each test with the marker, and its position."""
    for file in sorted(TESTS.rglob("test_*.py")):
        if "mark.hazard" in sources.text_of(file):
            for node in sources.nodes_of(file):
                if isinstance(node, ast.FunctionDef) and "pytest.mark.hazard" in map(ast.unparse, node.decorator_list):
                    yield f"{file.relative_to(TESTS).as_posix()}::{node.name}", sources.place(file, node.lineno)
