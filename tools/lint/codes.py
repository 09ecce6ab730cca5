"""Check that each issue code is used in the source, and is listed in the reference and in the Spanish texts."""

from __future__ import annotations

import re
from collections.abc import Iterator

import sources

from leafcut.model.issue import CODES
from leafcut.studio.wording import words

HOME = sources.PACKAGE / "model" / "issue.py"


def faults() -> Iterator[str]:
    """Yield every fault."""
    used = {
        code for file in sources.modules() if file != HOME for code in re.findall(r'"(\w+)"', sources.text_of(file))
    }
    documented = set(re.findall(r"`(\w+)`", sources.text_of(sources.DOCS / "reference.md")))
    spanish = {key.removeprefix("issue.") for key in words("es").translated if key.startswith("issue.")}
    places = {match[1]: place for place, match in sources.matches(r'^    "(\w+)":', HOME)}
    for code in CODES:
        for where, known in (("source", used), ("docs/reference.md", documented), ("options_es.toml", spanish)):
            if code not in known:
                yield f"{places.get(code, sources.place(HOME))}: issue code {code} is missing in {where}"
    for code in sorted(spanish - CODES.keys()):
        yield f"options_es.toml: unknown issue code {code}"
