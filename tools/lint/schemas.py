"""Check that leafcut's files state their schema numbers, and that docs/schemas.md lists these numbers."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator

import sources

from leafcut.files import schemas
from leafcut.processes.settings import all_options

#: Folders whose files have a schema; the texts of the studio have none.
FOLDERS = ("src/leafcut/machines", "src/leafcut/materials", "src/leafcut/gcode/dialects", "src/leafcut/lab", "examples")


def faults() -> Iterator[str]:
    """Yield every fault."""
    yield from files_without_schema()
    yield from faults_of_page()
    if "schema" in {name for _, name, _ in all_options()}:
        yield "no option can be named schema: in a file of options it is the schema number"


def files_without_schema() -> Iterator[str]:
    """Yield TOML files that do not state a schema number, which starts at 1."""
    for folder in FOLDERS:
        files = sorted((sources.ROOT / folder).rglob("*.toml"))
        if not files:
            yield f"{folder}: no TOML file"
        for file in files:
            if not isinstance(tomllib.loads(sources.text_of(file)).get("schema"), int):
                yield f"{sources.place(file)}: `schema = 1` is missing"


def faults_of_page() -> Iterator[str]:
    """Yield kinds of document that are missing on the page, or are listed with other numbers."""
    page = sources.DOCS / "schemas.md"
    rows = r"^\| ([\w ]+) \| .* \| `(\w+)` \| (\d+) \| (\d+) \|$"
    listed = {match.groups() for _, match in sources.matches(rows, page)}
    for one in schemas.SCHEMAS:
        numbers = (str(one.current), str(one.oldest))
        keys = {key for title, key, *rest in listed if title == one.title and tuple(rest) == numbers}
        if not keys & {one.key, "user_version"}:
            row = f"{one.title}, {one.key}, {one.current}, {one.oldest}"
            yield f"{sources.place(page)}: the row {row} is missing"
    for title in sorted({title for title, *_ in listed} - {one.title for one in schemas.SCHEMAS}):
        yield f"{sources.place(page)}: leafcut has no schema of {title}"
