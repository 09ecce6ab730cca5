"""What belongs to a release agrees: the version in its files, the types, the workflow and the Pythons it runs on."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from leafcut import __version__

ROOT = Path(__file__).parents[1]
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


def test_the_package_says_that_it_has_types() -> None:
    assert (ROOT / "src" / "leafcut" / "py.typed").is_file()


def test_the_workflow_checks_every_python_that_the_package_names() -> None:
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["project"]["classifiers"]))
    (matrix,) = re.findall(r"python: \[(.+)\]", text(".github/workflows/check.yml"))
    assert re.findall(r"3\.\d+", matrix) == named


def test_workflow_and_recipe_call_targets_that_there_are() -> None:
    targets = set(re.findall(r"^([\w-]+):", text("Makefile"), re.MULTILINE))
    called = {name for file in (".github/workflows/check.yml", "RELEASING.md", "CONTRIBUTING.md", ".ci/run")
              for name in re.findall(r"(?:run: |`|^)make ([\w-]+)", text(file), re.MULTILINE)}  # fmt: skip
    assert called >= {"check", "test", "docs", "wheel-check"}
    assert not called - targets
