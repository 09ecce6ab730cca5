"""Check rules for modules that neither Ruff nor import-linter checks."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter

import grimp
import sources

#: Modules of leafcut that may import modules by name: the lazy names of the library, the processes, and the add-ons.
_BY_STRING = ("__init__.py", "processes/registry.py", "addons/")
#: Modules of the studio that build their parts, which name them for types alone in order to call them.
_WHOLES = ("leafcut.studio.page.pages", "leafcut.studio.control.panel")


def faults() -> Iterator[str]:
    """Yield every fault."""
    yield from circular_imports(_imports())
    yield from repeated_names()
    yield from late_imports_of_shapely()
    yield from imports_by_string()


def _imports() -> dict[str, set[str]]:
    """Return the modules that each module imports, including imports in functions and for types only."""
    graph = grimp.build_graph("leafcut", cache_dir=None)
    imports = {module: set(graph.find_modules_directly_imported_by(module)) for module in graph.modules}
    parts = (module for module in imports if module.startswith(("leafcut.studio.page.", "leafcut.studio.control.")))
    return imports | {module: imports[module].difference(_WHOLES) for module in parts}


def circular_imports(imports: dict[str, set[str]]) -> Iterator[str]:
    """Yield circular imports of modules, including ``__init__``; import-linter checks only packages."""
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        yield f"circular import: {' <- '.join(error.args[1])}"


def repeated_names() -> Iterator[str]:
    """Yield public classes and types whose name is defined twice."""
    homes: dict[str, list[str]] = {}
    for file in sources.modules():
        for node in sources.tree_of(file).body:
            for name in _defined(node):
                if name[0].isupper() and not name.isupper():
                    homes.setdefault(name, []).append(sources.place(file, node.lineno))
    for name, places in homes.items():
        if len(places) > 1:
            yield f"{places[1]}: {name} is already defined in {places[0]}; rename one of them"


def _defined(node: ast.stmt) -> list[str]:
    if isinstance(node, ast.ClassDef):
        return [node.name]
    return (
        [target.id for target in node.targets if isinstance(target, ast.Name)] if isinstance(node, ast.Assign) else []
    )


def late_imports_of_shapely() -> Iterator[str]:
    """Yield imports of shapely inside functions that have no comment with the reason."""
    for file in sources.modules():
        for place, match in sources.matches(r"^ +(import shapely|from shapely\S* import [^#\n]*)$", file):
            yield f"{place}: '{match[1]}' in a function; move it to the top or add the reason as a comment"


def imports_by_string() -> Iterator[str]:
    """Yield imports of modules named by strings, which import-linter does not detect."""
    for file in sources.modules():
        for place, match in sources.matches(r"\b(import_module|__import__)\b", file):
            if not place.removeprefix("src/leafcut/").startswith(_BY_STRING):
                yield f"{place}: {match[1]} hides an import from import-linter; import the module itself"
