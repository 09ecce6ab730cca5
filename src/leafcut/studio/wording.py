"""The studio's words in the languages that it speaks: one TOML file for each, all with the same keys."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import Any

#: Language → its name for itself.
LANGUAGES = {"en": "English", "es": "Español"}
#: A flag of the command line in a message; of ``--process`` with what is chosen by it.
_FLAG = re.compile(r"(?<![\w-])--(?:process\b(?: (?P<process>[a-z]+))?|(?P<flag>[a-z][a-z-]*[a-z]))")


class Words:
    """The words of one language: ``words("run.begin")``, ``words("open.large", mib=64)``."""

    def __init__(self, language: str, table: Mapping[str, str], translated: Mapping[str, str] | None = None) -> None:
        self.language = language
        self.table = table
        #: What the options and the issues are about, in place of the English words that they have themselves.
        self.translated = translated or {}

    def __call__(self, key: str, **values: Any) -> str:
        """Return the words of a key, with values in their places."""
        text = self.table[key]
        return text.format(**values) if values else text

    def section(self, name: str) -> dict[str, str]:
        """Return the words of a section by their keys in it."""
        stem = f"{name}."
        return {key.removeprefix(stem): words for key, words in self.table.items() if key.startswith(stem)}

    def named(self, kind: str, name: str, english: str = "") -> str:
        """Return what something is called that a package from outside may have added: by its own words then."""
        return self.table.get(f"{kind}.{name}") or english or name.replace("_", " ").capitalize()

    def option(self, name: str) -> str:
        """Return what an option is called beside its field."""
        return self.named("option", name)

    def help(self, name: str, english: str) -> str:
        """Return what an option is for."""
        return self.translated.get(f"help.{name}", english)

    def default(self, name: str, english: str) -> str:
        """Return what holds where nothing is given, for an option that says it in words."""
        return self.translated.get(f"default.{name}", english) if english else ""

    def plain(self, line: str) -> str:
        """Return a message of leafcut's with the names of the form in the place of the command line's flags."""
        return _FLAG.sub(self._field, line)

    def _field(self, found: re.Match[str]) -> str:
        if found["flag"] is None:
            value = found["process"] or ""
            field = "work" if f"work.{value}" in self.table and f"process.{value}" not in self.table else "process"
            return f"“{self(f'choose.{field}')}” {self.table.get(f'{field}.{value}', value)}".rstrip()
        name = found["flag"].replace("-", "_")
        if f"option.{name}" in self.table:
            return f"“{self.option(name)}”"
        stem = name.removeprefix("no_")
        return f"“{self.option(stem)}” {self('form.off')}" if f"option.{stem}" in self.table else found[0]

    def issue(self, code: str) -> str:
        """Return what an issue of a code means; nothing in English, in which its message says it."""
        meaning = self.translated.get(f"issue.{code}", "")
        return meaning[:1].upper() + meaning[1:]


@cache
def words(language: str) -> Words:
    """Return the words of a language; of one that the studio does not speak, the English ones."""
    known = language if language in LANGUAGES else "en"
    return Words(known, _texts(known), {} if known == "en" else _texts(f"options_{known}"))


def _texts(name: str) -> dict[str, str]:
    text = (files("leafcut.studio") / "texts" / f"{name}.toml").read_text(encoding="utf-8")
    return dict(_flat("", tomllib.loads(text)))


def _flat(prefix: str, table: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(f"{prefix}{key}.", value)
        else:
            yield prefix + key, value


def preferred(accepted: str) -> str:
    """Return the language that a browser's ``Accept-Language`` asks for first and that the studio speaks."""
    for part in accepted.split(","):
        tag = part.partition(";")[0].strip().lower().partition("-")[0]
        if tag in LANGUAGES:
            return tag
    return "en"
