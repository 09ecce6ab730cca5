"""Writes src/leafcut/keywords.py, the options as typed keywords of the library, from the options themselves."""

from __future__ import annotations

import textwrap
from pathlib import Path

from leafcut.option_spec import OptionGroup, OptionSpec, written
from leafcut.processes import registry
from leafcut.processes.settings import used_by
from leafcut.units import BARE_UNIT

FILE = Path(__file__).parents[1] / "src" / "leafcut" / "keywords.py"
WIDTH = 120

#: Class → what it is for, and the kinds of work whose options it has.
CLASSES = {
    "OptimizeKeywords": ("`leafcut.optimize`", ("drill", "cut", "pocket", "program")),
    "NestKeywords": ("`leafcut.nest`", ("nest",)),
    "SolveKeywords": ("`leafcut.solve_part` and `leafcut.solve_file`", ("solve",)),
    "SimulateKeywords": ("`leafcut.simulate`", ("simulate",)),
    "StockKeywords": ("`leafcut.cut_stock`", ("stock",)),
    "CuttingDataKeywords": ("`leafcut.cutting_data`", ("cutting-data",)),
    "VerifyKeywords": ("`leafcut.verify_programs`", ("verify",)),
}

#: Kind of option → what a call may give.
TYPES = {
    "quantity": "Quantity",
    "number": "float",
    "share": "float | str",
    "percent": "float | str",
    "whole": "int",
    "flag": "bool",
    "text": "str",
    "names": "str | Sequence[str]",
    "point": "str | Sequence[Quantity]",
    "place": "str | Sequence[Quantity]",
    "path": "str | Path",
}

HEAD = '''"""The options as keywords of the library's functions, for editors and type checkers; None is "not given".

Made by `.ci/make_keywords.py` from the options; do not edit by hand.
"""

# Annotations are types at once: as texts each would be compiled when the module is imported.
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, TypedDict

#: A number in the unit that is told beside it, or a text with a unit of its own: ``6``, ``"0.25in"``.
Quantity = float | str
'''


def type_of(spec: OptionSpec) -> str:
    """Return what a call may give for an option."""
    if spec.choices and spec.kind == "text":
        words = "".join(f'\n        "{choice}",' for choice in spec.choices)
        return f"Literal[{words}\n        None,\n    ]"
    return f"{TYPES[spec.kind]}{' | str' if spec.words else ''} | None"


def words_of(group: type[OptionGroup], name: str, spec: OptionSpec) -> str:
    """Return an option in a sentence: what it is, its unit, its default."""
    default = group.defaults()[name]
    usual = spec.default_words or ("" if default in (None, (), False) else written(spec, default))
    beside = [BARE_UNIT[spec.unit]] if spec.unit else []
    beside += ["on unless False"] if default is True else [f"default: {usual}"] if usual else []
    said = spec.help[:1].upper() + spec.help[1:].rstrip(".") + (f" ({'; '.join(beside)})" if beside else "") + "."
    lines = textwrap.wrap(said, WIDTH - 12)
    if len(lines) == 1:
        return f'    """{said}"""'
    return "\n".join(['    """' + lines[0], *(f"    {line}" for line in lines[1:]), '    """'])


def keywords() -> str:
    """Return the whole module."""
    text = HEAD
    for title, (what, works) in CLASSES.items():
        text += f'\n\nclass {title}(TypedDict, total=False):\n    """Options of {what}."""\n\n'
        for group, name, spec in used_by(*map(registry.work, works)):
            text += f"    {name}: {type_of(spec)}\n{words_of(group, name, spec)}\n"
    return text


if __name__ == "__main__":
    FILE.write_text(keywords(), encoding="utf-8")
