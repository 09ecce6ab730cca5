"""Check that all texts of the studio have a translation and are used, and that each option has a text."""

from __future__ import annotations

import re
from collections.abc import Iterator, Set

import sources

from leafcut.lab.own_experiment import COMPARED
from leafcut.options import AcoOptions
from leafcut.processes.settings import all_options, group_of
from leafcut.studio.jobs.history import JobState
from leafcut.studio.page import forms
from leafcut.studio.page.panel_live import PACES
from leafcut.studio.wording import LANGUAGES, default_label, read_texts, words

STUDIO = sources.PACKAGE / "studio"
EN, ES = words("en"), words("es")
EN_FILE, ES_FILE, OPTIONS_FILE = (
    sources.place(STUDIO / "texts" / f"{name}.toml") for name in ("en", "es", "options_es")
)
#: Option → symbol in the literature, so that a paper and the page can be compared.
SYMBOLS = {
    "n_ants": "m",
    "pheromone_weight": "α",
    "heuristic_weight": "β",
    "evaporation_rate": "ρ",
    "initial_pheromone": "τ₀",
    "greedy_probability": "q₀",
    "n_fireflies": "n",
    "attractiveness": "β₀",
    "absorption": "γ",
}
#: Options of ant algorithms that are not parameters in the literature.
WITHOUT_SYMBOL = {"parallel", "n_processes"}
#: Symbols that several algorithms share; the glossary explains them.
SHARED_SYMBOLS = ("τ", "α", "β", "ρ", "ξ", "q₀", "β₀", "γ", "m")


def faults() -> Iterator[str]:
    """Yield every fault."""
    labels = {f"option.{name}" for _, name, _ in all_options()}
    yield from _differences(ES_FILE, ES.table.keys(), EN.table.keys() | labels)
    for key, text in read_texts("en").items():
        if text == default_label(key):
            yield f"{EN_FILE}: {key} equals the label derived from the key; leave it out"
    for key in EN.table.keys() & ES.table.keys():
        if _fields(EN.table[key]) != _fields(ES.table[key]):
            yield f"{ES_FILE}: {key} has other fields than en.toml"
    yield from faults_of_keys()
    yield from faults_of_use()
    yield from faults_of_options()
    yield from faults_of_symbols()


def _fields(text: str) -> list[str]:
    return sorted(re.findall(r"\{(\w+)\}", text))


def _differences(file: str, keys: Set[str], wanted: Set[str]) -> Iterator[str]:
    yield from (f"{file}: {key} is missing" for key in sorted(wanted - keys))
    yield from (f"{file}: unknown key {key}" for key in sorted(keys - wanted))


def faults_of_keys() -> Iterator[str]:
    """Yield missing keys for algorithms, groups, commands and states, and keys that belong to none of these."""
    groups = {key for work in forms.works_with_form() for key, _ in forms.option_groups(work)} | {
        "aco",
        "firefly",
        "cuts",
    }
    for key in sorted(key for key in EN.table if key.startswith("option.")):
        if key.removeprefix("option.") not in {name for _, name, _ in all_options()}:
            yield f"{EN_FILE}: unknown key {key}"
    for section, names in {
        "algorithm": set(COMPARED),
        "group": groups,
        "work": set(forms.works_with_form()),
        "state": {state.value for state in JobState},
        "process": set(forms.program_processes()),
        "pace": set(PACES),
    }.items():
        keys = {key for key in EN.table if key.startswith(f"{section}.")}
        yield from _differences(EN_FILE, keys, {f"{section}.{name}" for name in names})


def faults_of_use() -> Iterator[str]:
    """Yield keys that the code of the studio does not use, and uses of keys that do not exist."""
    files = sorted(file for kind in ("*.py", "*.jinja") for file in STUDIO.rglob(kind))
    code = "".join(map(sources.text_of, files))
    used = set(re.findall(r'"([a-z]+\.[a-z_-]+)"', code))
    stems = set(re.findall(r'f"([a-z]+\.)\{', code))
    sections = {f"{name}." for name in re.findall(r'\b(?:section|item_name)\("([a-z]+)"', code)}
    for key in EN.table:
        if key not in used and not key.startswith((*stems, *sections, "option.")):
            yield f"{EN_FILE}: no code uses {key}"
    known = "|".join(sorted({key.partition(".")[0] for key in EN.table}))
    for file in files:
        for place, match in sources.matches(rf'\b(?:w|words)\(\s*"((?:{known})\.[^"]+)"', file):
            if match[1] not in EN.table:
                yield f"{place}: en.toml has no key {match[1]}"


def faults_of_options() -> Iterator[str]:
    """Yield options whose help or default has no Spanish text, and Spanish texts that belong to no option."""
    for kind, attribute in (("help", "help"), ("default", "default_words")):
        english = {name: getattr(spec, attribute) for _, name, spec in all_options() if getattr(spec, attribute)}
        keys = {key for key in ES.translated if key.startswith(f"{kind}.")}
        yield from _differences(OPTIONS_FILE, keys, {f"{kind}.{name}" for name in english})
        for name, text in english.items():
            if kind == "help" and f"help.{name}" in keys and ES.help_text(name, text) == text:
                yield f"{OPTIONS_FILE}: help.{name} is English"


def faults_of_symbols() -> Iterator[str]:
    """Yield parameters of ants and fireflies whose symbol is missing in label, help or glossary."""
    for name in sorted(AcoOptions.specs().keys() - SYMBOLS.keys() - WITHOUT_SYMBOL):
        yield f"tools/lint/texts.py: SYMBOLS lacks {name}"
    for name, symbol in SYMBOLS.items():
        english = group_of(name).specs()[name].help
        for language in LANGUAGES:
            texts = words(language)
            if texts.option_label(name).split()[-1] != symbol:
                yield f"{sources.place(STUDIO / 'texts' / f'{language}.toml')}: option.{name} must end with {symbol}"
            if f"({symbol}" not in texts.help_text(name, english):
                yield f"{language}: the help of {name} must contain ({symbol})"
    glossary = sources.DOCS / "glossary.md"
    for symbol in SHARED_SYMBOLS:
        if f" {symbol} |" not in sources.text_of(glossary):
            yield f"{sources.place(glossary)}: no row for {symbol}"
