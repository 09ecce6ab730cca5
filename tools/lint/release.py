"""Check that the files of a release agree: version, types, Python versions, targets and tests in the workflows."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator

import sources

from leafcut import __version__

PUSH, NIGHTLY, RELEASE = (sources.ROOT / ".github" / "workflows" / f"{n}.yml" for n in ("push", "nightly", "release"))
WORKFLOWS = (PUSH, NIGHTLY, RELEASE)
CHANGELOG, CITATION = sources.ROOT / "CHANGELOG.md", sources.ROOT / "CITATION.cff"


def faults() -> Iterator[str]:
    """Yield every fault."""
    yield from wrong_versions()
    if not (sources.PACKAGE / "py.typed").is_file():
        yield "src/leafcut/py.typed is missing; type checkers would ignore the types"
    yield from untested_pythons()
    yield from unknown_targets()
    yield from missing_tests()


def wrong_versions() -> Iterator[str]:
    """Yield contradictions between version, changelog and citation.

    A released version heads the changelog; before the release, `Unreleased` does. The citation names the last release.
    """
    place, heads = sources.place(CHANGELOG), [match[1] for _, match in sources.matches(r"^## (\S+)", CHANGELOG)]
    released = [head for head in heads if head != "Unreleased"]
    number, development, _ = __version__.partition(".dev")
    if development and (heads[0] != "Unreleased" or _numbers(released[0]) >= _numbers(number)):
        yield f"{place}: version {__version__} needs the section Unreleased above an older release"
    if not development and (heads != released or heads[0] != number):
        yield f"{place}: the section {number} must be first, and none may be Unreleased"
    if sorted(released, key=_numbers, reverse=True) != released:
        yield f"{place}: the releases are not in descending order"
    for place, match in sources.matches(r"^version: (.+)$", CITATION):
        if match[1] != released[0]:
            yield f"{place}: version {match[1]}, but the last release is {released[0]}"


def _numbers(version: str) -> list[int]:
    return [int(number) for number in version.split(".")]


def untested_pythons() -> Iterator[str]:
    """Yield workflows that do not test the required Python versions: nightly, all classifiers; on push, the first and
    last.
    """
    project = tomllib.loads(sources.text_of(sources.ROOT / "pyproject.toml"))["project"]
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(project["classifiers"]))
    for file, wanted in ((NIGHTLY, named), (PUSH, [named[0], named[-1]])):
        for place, match in sources.matches(r"python: \[(.+)\]", file):
            if re.findall(r"3\.\d+", match[1]) != wanted:
                yield f"{place}: the Pythons must be {', '.join(wanted)}, as in the classifiers of pyproject.toml"


def unknown_targets() -> Iterator[str]:
    """Yield calls of make with a target that is not in the Makefile."""
    targets = {match[1] for _, match in sources.matches(r"^([\w-]+):", sources.ROOT / "Makefile")}
    for file in (*WORKFLOWS, *(sources.ROOT / name for name in ("RELEASING.md", "CONTRIBUTING.md", ".ci/run"))):
        for place, match in sources.matches(r"(?:run: |`|^)make ([\w-]+)", file):
            if match[1] not in targets:
                yield f"{place}: the Makefile has no target {match[1]}"


def missing_tests() -> Iterator[str]:
    """Yield test files that are named in a workflow but do not exist."""
    for file in WORKFLOWS:
        for place, match in sources.matches(r"tests/\S+\.py", file):
            if not (sources.ROOT / match[0]).is_file():
                yield f"{place}: {match[0]} does not exist"
