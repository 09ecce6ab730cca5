"""The texts of the studio. Each language has its own TOML file. In English, most labels are derived from their keys."""

from __future__ import annotations

import re
import time
import tomllib
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from leafcut.message import Message
from leafcut.processes.settings import all_options

#: Maps each language to its own name.
LANGUAGES = {"en": "English", "es": "Español"}
#: A flag of the command line in a message. For ``--process``, the value is included.
_FLAG = re.compile(r"(?<![\w-])--(?:process\b(?: (?P<process>[a-z]+))?|(?P<flag>[a-z][a-z-]*[a-z]))")


class Words:
    """The texts in one language: ``words("run.begin")``, ``words("open.large", mib=64)``."""

    def __init__(
        self,
        language: str,
        table: Mapping[str, str],
        translated: Mapping[str, str] | None = None,
        messages: Mapping[str, str] | None = None,
    ) -> None:
        self.language = language
        self.table = table
        #: Translations of the help texts for options and issues.
        self.translated = translated or {}
        #: Translations of message templates.
        self.messages = messages or {}

    def __call__(self, key: str, **values: Any) -> str:
        """Return the text of a key, and insert its values."""
        text = self.table[key]
        return text.format(**values) if values else text

    def section(self, name: str) -> dict[str, str]:
        """Return the texts of a section by key."""
        stem = f"{name}."
        return {key.removeprefix(stem): words for key, words in self.table.items() if key.startswith(stem)}

    def item_name(self, kind: str, name: str, english: str = "") -> str:
        """Return the name of an item, such as a process or a material.

        Items of a plug-in have no text. Their name is `english`, or else `name` itself.
        """
        return self.table.get(f"{kind}.{name}") or english or default_label(name)

    def option_label(self, name: str) -> str:
        """Return the label of an option. If it has no label, return its name."""
        return self.item_name("option", name)

    def help_text(self, name: str, english: str, work: str = "") -> str:
        """Return the help text of an option. Each kind of work may have its own text for an option."""
        return self.translation(f"{work}_help", name, self.translation("help", name, english))

    def default_text(self, name: str, english: str, work: str = "") -> str:
        """Describe the default of an option. Each kind of work may have its own description."""
        return self.translation(f"{work}_default", name, self.translation("default", name, english))

    def translation(self, kind: str, name: str, english: str) -> str:
        """Translate an English text. If there is no translation, return the text unchanged."""
        return self.translated.get(f"{kind}.{name}", english) if english else ""

    def translate_for_page(self, line: str) -> str:
        """Translate a message, and replace its flags with the labels of the form."""
        return _FLAG.sub(self._field_label, self.translate(line))

    def translate(self, text: str) -> str:
        """Translate a message, including values that are messages themselves.

        Any other text, such as a file name or an answer from a controller, is returned unchanged.
        """
        if not isinstance(text, Message):
            return text
        template = self.messages.get(text.template, text.template)
        return template.format(*(self.translate(value) for value in text.values))

    def language_of(self, line: str) -> str:
        """Return the language of the result of `plain`. It is "en" if the line has no translation."""
        known = self.language == "en" or self.translate(line) != line
        return self.language if known else "en"

    def _field_label(self, match: re.Match[str]) -> str:
        if match["flag"] is None:
            value = match["process"] or ""
            field = "work" if f"work.{value}" in self.table and f"process.{value}" not in self.table else "process"
            return f"“{self(f'choose.{field}')}” {self.table.get(f'{field}.{value}', value)}".rstrip()
        name = match["flag"].replace("-", "_")
        known = _option_names()
        if name in known:
            return f"“{self.option_label(name)}”"
        if f"flag.{name}" in self.table:
            return f"“{self(f'flag.{name}')}”"
        stem = name.removeprefix("no_")
        return f"“{self.option_label(stem)}” {self('form.off')}" if stem in known else match[0]

    def explain_issue(self, code: str) -> str:
        """Explain an issue code. In English, the text is empty, because the message itself explains the issue."""
        meaning = self.translated.get(f"issue.{code}", "")
        return meaning[:1].upper() + meaning[1:]


@cache
def _option_names() -> frozenset[str]:
    return frozenset(name for _, name, _ in all_options())


@cache
def words(language: str) -> Words:
    """Return the texts of a language. If the language is unknown, return the English texts."""
    if language == "en" or language not in LANGUAGES:
        return Words("en", {key: default_label(key) for key in read_texts("es")} | read_texts("en"))
    return Words(
        language, read_texts(language), read_texts(f"options_{language}"), _read_templates(f"messages_{language}")
    )


def default_label(key: str) -> str:
    """Derive the English label from a key, such as ``From hole`` from ``flag.from_hole``."""
    return key.rpartition(".")[2].replace("_", " ").capitalize()


def _read_templates(name: str) -> dict[str, str]:
    text = (files("leafcut.studio") / "texts" / f"{name}.toml").read_text(encoding="utf-8")
    return {template: spanish for section in tomllib.loads(text).values() for template, spanish in section.items()}


def read_texts(name: str) -> dict[str, str]:
    """Return the texts of a file by key."""
    text = (files("leafcut.studio") / "texts" / f"{name}.toml").read_text(encoding="utf-8")
    return dict(_flatten("", tomllib.loads(text)))


def _flatten(prefix: str, table: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flatten(f"{prefix}{key}.", value)
        else:
            yield prefix + key, value


def preferred_language(accepted: str) -> str:
    """Return the first language in a browser's ``Accept-Language`` header that the studio supports."""
    for part in accepted.split(","):
        tag = part.partition(";")[0].strip().lower().partition("-")[0]
        if tag in LANGUAGES:
            return tag
    return "en"


def day_and_time(seconds: float) -> str:
    """Format a time (seconds since 1970) as shown in lists, such as ``2026-11-23 16:55``."""
    return time.strftime("%Y-%m-%d %H:%M", time.localtime(seconds))
