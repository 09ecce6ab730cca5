"""Check that the Spanish catalogue has exactly the templates of the messages in the source.

A template is a constant: the first argument of `Message` or of an error, or the noun of `count_of`. A function that
builds a message from a parameter, such as `TomlTable.value_error`, is listed in `TEMPLATES`.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import sources

from leafcut.message import has_words, template_key

CATALOGUE = sources.PACKAGE / "studio" / "texts" / "messages_es.toml"
#: Functions and classes with a template → index of its argument, and prefix of the template. Errors are found by name.
TEMPLATES = {
    "Message": (0, ""),
    "ReadError": (1, ""),
    "value_error": (1, "'{}' "),
    "_missing_work_issues": (1, ""),
}
#: Functions with a noun that is counted in a message → index of its argument.
NOUNS = {
    "count_of": 1,
    "count_text": 1,
    "MissingWork": 0,
    "_count_and_area_text": 1,
    "_describe_sizes": 1,
    "_missing_work_issues": 3,
}
ERROR = re.compile(r"\w+Error|BlockError|UnclearBlock|_RunEnded|_AlarmStop|_NoAnswer|PortLost")
#: Errors of Python, whose text is not a template.
OF_PYTHON = re.compile(r"(Value|Type|Key|Index|Runtime|OS|Import|Attribute|Assertion|Overflow|Lookup)Error")
#: Files whose messages the studio never shows: command line, plug-ins for other programs, and commands without a page.
NOT_SHOWN = (
    "addons/",
    "cli/",
    "lab/",
    "order/executors.py",
    "processes/cutting_data/",
    "read/controllers/",
    "read/time_table.py",
    "read/work_materials.py",
    "report/front_chart.py",
    "report/stock_report.py",
    "results/",
    "studio/server/app.py",
)
#: English words that no Spanish text contains, except in quotes and in flags with their values (`TYPED`).
ENGLISH = re.compile(
    r"(?<![\w'/-])(?:the|of|is|are|and|with|without|cannot|must|has|have|it|its|or|for|than|not|leave|give|choose|an|be"
    r"|by|to|in|at|on|this|that|was|more|only|from|which|before|after|near|needs)(?![\w'/-])"
)
TYPED = re.compile(r"(?<!\w)'[^']*'|`[^`]*`|--[a-z-]+(?: on\b| off\b| in\b)?|mm o in\b")


def faults() -> Iterator[str]:
    """Yield every template without Spanish, and every entry of the catalogue that is unused or cannot be filled."""
    catalogue: dict[str, str] = {}
    for section in tomllib.loads(sources.text_of(CATALOGUE)).values():
        yield from (f"{place_of(key)}: {key!r} occurs twice" for key in section.keys() & catalogue.keys())
        catalogue |= section
    used: set[str] = set()
    for key, place, shown in templates():
        used.add(key)
        if shown and has_words(key) and key not in catalogue:
            yield f"{place}: no Spanish for {key!r}"
    for key, spanish in catalogue.items():
        if key not in used:
            yield f"{place_of(key)}: no message has the template {key!r}"
        if gaps_of(key) != gaps_of(spanish):
            yield f"{place_of(key)}: {key!r} and {spanish!r} have different gaps"
        if ENGLISH.search(TYPED.sub("", spanish)):
            yield f"{place_of(key)}: English in {spanish!r}"


def templates() -> Iterator[tuple[str, str, bool]]:
    """Yield the key of every template in the source, its place, and whether the studio may show it."""
    for file in sources.modules():
        shown = not file.relative_to(sources.PACKAGE).as_posix().startswith(NOT_SHOWN)
        for node in sources.nodes_of(file):
            for template in templates_of(node):
                yield template_key(template), sources.place(file, getattr(node, "lineno", None)), shown


def templates_of(node: ast.AST) -> Iterator[str]:
    """Yield the templates in one call."""
    if not isinstance(node, ast.Call):
        return
    name, args = called(node), node.args
    if name == "partial" and args and isinstance(args[0], ast.Name) and args[0].id == "Message":
        yield from constants(args[1])
    if name in NOUNS and len(args) > NOUNS[name]:
        yield from (f"{{}} {noun}{ending}" for noun in constants(args[NOUNS[name]]) for ending in ("", "s"))
    if name in TEMPLATES or (ERROR.fullmatch(name) and not OF_PYTHON.fullmatch(name)):
        index, prefix = TEMPLATES.get(name, (0, ""))
        # A text without values is no template: its braces are ordinary characters.
        alone = name != "Message" and len(args) <= index + 1
        for template in constants(args[index]) if len(args) > index else ():
            yield prefix + (template.replace("{", "{{").replace("}", "}}") if alone else template)


def called(node: ast.Call) -> str:
    """Return the name of the called function."""
    return node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")


def constants(node: ast.AST) -> Iterator[str]:
    """Yield the texts that an expression may be: a constant, or the branches of a condition."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from constants(node.body)
        yield from constants(node.orelse)


def gaps_of(text: str) -> list[str]:
    """Return the numbers of the gaps of a text in increasing order."""
    names = [name for _, name, _, _ in Formatter().parse(text) if name is not None]
    return sorted(name or str(number) for number, name in enumerate(names))


def place_of(key: str) -> str:
    """Return the place of an entry in the catalogue."""
    for number, text in enumerate(sources.text_of(Path(CATALOGUE)).splitlines(), 1):
        if text.startswith((f'"{key}"', f"'{key}'")):
            return sources.place(CATALOGUE, number)
    return sources.place(CATALOGUE)
