"""Check that Python code calls only kernels that are cached on disk."""

from __future__ import annotations

import ast
from collections.abc import Iterator

import sources


def faults() -> Iterator[str]:
    """Report each import of an ``inner_kernel`` outside ``kernels/``, because it would be recompiled in each run."""
    parts = {
        (file.stem, node.name)
        for file in sources.modules("kernels")
        for node in sources.tree_of(file).body
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(name, ast.Name) and name.id == "inner_kernel" for name in node.decorator_list)
    }
    for file in sources.modules():
        if file.parent.name == "kernels":
            continue
        for node in sources.nodes_of(file):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("leafcut.kernels."):
                for alias in node.names:
                    if (str(node.module).rpartition(".")[2], alias.name) in parts:
                        place = sources.place(file, node.lineno)
                        yield f"{place}: {alias.name} is an `inner_kernel`; make it a `kernel`"
