"""Check that generated files are current."""

from __future__ import annotations

import runpy
from collections.abc import Iterator

import sources

#: File → its generator, and the function that returns its text.
GENERATORS = {
    sources.DOCS / "reference.md": ("tools/make_reference.py", "reference"),
    sources.PACKAGE / "options/keywords.py": ("tools/make_keywords.py", "keywords"),
}


def faults() -> Iterator[str]:
    """Yield every file that differs from the text that its generator returns."""
    for file, (generator, function) in GENERATORS.items():
        lines = runpy.run_path(str(sources.ROOT / generator))[function]().splitlines()
        current = sources.text_of(file).splitlines()
        if current != lines:
            same = [a == b for a, b in zip(current, lines, strict=False)]
            first = same.index(False) + 1 if False in same else len(same) + 1
            yield f"{sources.place(file, first)}: out of date; run {generator}"
