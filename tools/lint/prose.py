"""Check for phrases that replace a noun or a verb of the trade, in code and documents.

A phrase should be looked at; it is not necessarily wrong. A file may contain `LIMIT` of them per 1,000 words, and two
in any case.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

import sources

#: Maximum number of phrases per 1,000 words in a file.
LIMIT = 5.0
#: Minimum length of a text that is checked, in words; shorter texts are names and units.
SHORTEST = 4

#: Phrase → advice.
PHRASES = {
    r"returns? (?:(?:in|at|of) )?(?:what|how|where|that)\b": "return a noun: the path, the number, the place",
    r"(?:of|in|by|at|to|from|with|on|for|beside|behind) what\b": "name the thing",
    r"(?<![^.;:,] )what (?:is|was|are|it|an?|the|no|one|they|each|every|has|makes?|does|comes?)\b": "name the subject",
    r"(?:told|tells?|telling|said|says)\b": "report, warn, show, state",
    r"(?:that|those) (?:of|in|on|which|who|by|with|from|at)\b": "repeat the noun",
    r"(?:the|an?|each|every|other|another|this|first|last|next|which) ones?\b(?! of the| or more)": "repeat the noun",
    r"so (?:many|much|few|far|long|often)\b": "give the quantity",
    r"(?:anew|besides|beside (?:it|them))\b": "again, also, next to",
    r"ways?(?= (?:to|from|there|round|of a tool|between)\b)|ways\b": "path, move, route, method",
    r"there (?:is|are|was|were) (?:no|none|nothing|any|one)\b": "use an active verb",
    r"as (?:it|they) (?:is|are|stands?|lies?|lie|comes?|goes|was|were)\b": "unchanged",
    r"begins?\b|beginning\b": "start",
    r"(?:nobody|nothing|none) (?:is|has|was|knows|says|that|of)\b": "use a noun as the subject",
}
_PATTERNS = [(re.compile(rf"\b(?:{phrase})", re.IGNORECASE), advice) for phrase, advice in PHRASES.items()]

#: Files that have not been rewritten yet. No file may be added.
EXCEPTIONS = frozenset(
    {
        "src/leafcut/gcode/klartext.py",
        "src/leafcut/gcode/program.py",
        "src/leafcut/lab/tuning.py",
        "src/leafcut/options/search.py",
        "src/leafcut/processes/program/post/rewriter.py",
    }
)


def faults() -> Iterator[str]:
    """Yield every phrase in files that exceed the limit."""
    pages = (sources.ROOT / "README.md", *sorted(sources.DOCS.rglob("*.md")))
    for file in (*sources.modules(), *pages):
        if sources.place(file) in EXCEPTIONS:
            continue
        texts = list(texts_of(file))
        words = sum(len(text.split()) for _, text in texts)
        hits = [hit for line, text in texts for hit in phrases_of(line, text)]
        if len(hits) > 2 and 1000.0 * len(hits) > LIMIT * words:
            yield from (f"{sources.place(file, line)}: '{phrase}': {advice}" for line, phrase, advice in hits)


def phrases_of(line: int, text: str) -> Iterator[tuple[int, str, str]]:
    """Yield the line, phrase and advice for each phrase in a text that starts at a line."""
    for pattern, advice in _PATTERNS:
        for match in pattern.finditer(text):
            yield line + text[: match.start()].count("\n"), match[0], advice


def texts_of(file: Path) -> Iterator[tuple[int, str]]:
    """Yield the prose of a file with line numbers: strings and comments of a module, or paragraphs of a page."""
    texts = _texts_of_module(file) if file.suffix == ".py" else _texts_of_page(file)
    return ((line, text) for line, text in texts if len(text.split()) >= SHORTEST)


def _texts_of_module(file: Path) -> Iterator[tuple[int, str]]:
    for node in sources.nodes_of(file):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value
    for token in tokenize.generate_tokens(io.StringIO(sources.text_of(file)).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string.lstrip("#: ")


def _texts_of_page(file: Path) -> Iterator[tuple[int, str]]:
    fenced = False
    for number, line in enumerate(sources.text_of(file).splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced and not line.lstrip().startswith(("|", "    ", "<", "#")):
            yield number, line
