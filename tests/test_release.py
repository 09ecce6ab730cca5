"""The files of a release agree: version, types, Pythons, and the targets that workflows and documents name."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from leafcut import __version__

ROOT = Path(__file__).parents[1]
WORKFLOWS = [f".github/workflows/{name}.yml" for name in ("push", "nightly", "release")]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def test_changelog_and_citation_agree_with_the_version() -> None:
    """A release heads the changelog; before it, `Unreleased` does. The citation names the last release."""
    heads = re.findall(r"^## (\S+)", text("CHANGELOG.md"), re.MULTILINE)
    released = [head for head in heads if head != "Unreleased"]
    number, development, _ = __version__.partition(".dev")
    if development:
        assert heads[0] == "Unreleased"
        assert numbers(released[0]) < numbers(number)
    else:
        assert heads == released
        assert heads[0] == number
    assert sorted(released, key=numbers, reverse=True) == released
    assert re.findall(r"^version: (.+)$", text("CITATION.cff"), re.MULTILINE) == [released[0]]


def numbers(version: str) -> list[int]:
    return [int(number) for number in version.split(".")]


def test_the_package_is_marked_as_typed() -> None:
    assert (ROOT / "src" / "leafcut" / "py.typed").is_file()


def test_the_workflows_test_each_python_of_the_classifiers() -> None:
    """All of them each night, the oldest and the newest on each push."""
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["project"]["classifiers"]))
    matrices = [re.findall(r"python: \[(.+)\]", text(f".github/workflows/{name}.yml")) for name in ("nightly", "push")]
    assert [re.findall(r"3\.\d+", matrix) for (matrix,) in matrices] == [named, [named[0], named[-1]]]


def test_workflows_and_documents_name_existing_targets_and_tests() -> None:
    targets = set(re.findall(r"^([\w-]+):", text("Makefile"), re.MULTILINE))
    files = [*WORKFLOWS, "RELEASING.md", "CONTRIBUTING.md", ".ci/run"]
    named = {name for file in files for name in re.findall(r"(?:run: |`|^)make ([\w-]+)", text(file), re.MULTILINE)}
    assert named >= {"check", "test", "docs", "wheel-check"}
    assert not named - targets
    tests = [test for file in WORKFLOWS for test in re.findall(r"tests/\S+\.py", text(file))]
    assert tests
    assert [test for test in tests if not (ROOT / test).is_file()] == []
