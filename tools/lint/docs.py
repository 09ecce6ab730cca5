"""Check the links and the navigation of the documents, and the functions and options that they mention."""

from __future__ import annotations

import re
from collections.abc import Iterator
from importlib import import_module
from types import FunctionType
from typing import Any

import sources
from cyclopts import App

import leafcut
from leafcut.cli.app import build_app
from leafcut.options.option_spec import flag_name
from leafcut.options.removed import REMOVED
from leafcut.processes.settings import all_options

PAGES = tuple(sorted(sources.DOCS.rglob("*.md")))
README = sources.ROOT / "README.md"
#: Calls of other programs, which have their own flags: in a block, in a code span or in a list of words.
CALLS = r"(?:^ {4}|`|\[)(?:dask[ -]|inkscape |kicad-cli |pip |pytest |python -m )[^`\]]*"
#: Flags of the example plug-in in docs/plugins.md.
OF_PLUGIN = {"--spot-depth"}


def faults() -> Iterator[str]:
    """Yield every fault."""
    yield from broken_links()
    yield from faults_of_site()
    yield from unknown_names()
    yield from unknown_flags()
    yield from undocumented_options()
    yield from undocumented_names()


def broken_links() -> Iterator[str]:
    """Yield links to files that do not exist."""
    for page in (*sorted(sources.ROOT.glob("*.md")), *PAGES):
        for place, match in sources.matches(r"\]\(([^)#:]+)\)", page):
            if not (page.parent / match[1]).exists():
                yield f"{place}: the link {match[1]} leads nowhere"


def faults_of_site() -> Iterator[str]:
    """Yield pages that do not occur exactly once in the navigation, and settings that load files from other sites."""
    config, style = sources.ROOT / "mkdocs.yml", sources.DOCS / "site.css"
    listed = [match[1] for _, match in sources.matches(r"^ +- .+: (\S+\.md)$", config)]
    for page in sorted({*listed, *(page.name for page in sources.DOCS.glob("*.md"))}):
        if listed.count(page) != 1 or not (sources.DOCS / page).is_file():
            yield f"{sources.place(config)}: {page} must be in `nav` once, and in docs/"
    if "font: false" not in sources.text_of(config):
        yield f"{sources.place(config)}: `font: false` is missing; the site would load fonts from elsewhere"
    for place, _ in sources.matches("//", style):
        yield f"{place}: the site would load a file from elsewhere"


def unknown_names() -> Iterator[str]:
    """Yield names such as `order.solve` that do not exist in leafcut."""
    packages = {file.name.removesuffix(".py") for file in sources.PACKAGE.iterdir()}
    for page in PAGES:
        for place, match in sources.matches(r"`([a-z_]+(?:\.\w+)+)(?:\(.*?\))?`", page):
            parts = match[1].split(".")
            if parts[0] in packages and parts[-1] not in ("py", "md", "toml", "html") and not _exists(parts):
                yield f"{place}: leafcut has no {match[1]}"


def _exists(parts: list[str]) -> bool:
    """Return whether leafcut contains a module, or an attribute of a module or class, with this name."""
    for end in range(len(parts), 0, -1):
        try:
            found: Any = import_module("leafcut." + ".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[end:]:
            found = getattr(found, attribute, None)
        return found is not None
    return False


def unknown_flags() -> Iterator[str]:
    """Yield flags in the README and the pages that no command has, because they are misspelt or removed."""
    known = _flags_of(build_app()) | OF_PLUGIN | {"--help", "--help-all", "--version"}
    for page in (README, *sorted(sources.DOCS.glob("*.md"))):
        for place, line in sources.matches(r"^.*--.*$", page):
            text = re.sub(CALLS, "", line[0])
            entry = re.match(r"\* (?:`--[a-z-]+`(?:, |:))+", text) if page.name == "reference.md" else None
            listed = re.findall(r"--[a-z-]+", entry[0]) if entry else []
            removed = {flag for flag in listed if flag[2:].replace("-", "_") in REMOVED}
            for flag in re.findall(r"(?<![\w-])--[a-z][a-z-]*", text):
                if flag not in known | removed:
                    yield f"{place}: no command has {flag}"


def _flags_of(command: App) -> set[str]:
    """Return the flags of a command and of its subcommands."""
    arguments = command.assemble_argument_collection() if command.default_command else ()
    flags = {name for argument in arguments for name in argument.names}
    return flags.union(*(_flags_of(command[name]) for name in command if not name.startswith("-")))


def undocumented_options() -> Iterator[str]:
    """Yield options that are missing in the reference."""
    text = sources.text_of(sources.DOCS / "reference.md")
    for _, name, _ in all_options():
        if f"`{flag_name(name)}`" not in text:
            yield f"docs/reference.md: {flag_name(name)} is missing"


def undocumented_names() -> Iterator[str]:
    """Yield public names that have no docstring entry (`:::`) or, for other objects, no title in docs/library.md."""
    page = sources.DOCS / "library.md"
    text = sources.text_of(page)
    shown = set(re.findall(r"^::: (\S+)$", text, flags=re.MULTILINE))
    for errors in re.findall(r"members: \[(.*)\]", text):
        shown |= {f"leafcut.errors.{name}" for name in errors.split(", ")}
    for name in leafcut.__all__:
        if name == "__version__":
            continue
        found = getattr(leafcut, name)
        if isinstance(found, type | FunctionType):
            homes = {f"{found.__module__}.{found.__qualname__}", f"leafcut.options.{name}"}
            if not homes & shown:
                yield f"{sources.place(page)}: {name} is missing"
        elif f"`{name}`" not in text:
            yield f"{sources.place(page)}: {name} is missing"
