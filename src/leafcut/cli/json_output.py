"""JSON answers of commands: one object on standard output, with its schema number."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from leafcut.files.schemas import ANSWER, numbered


def print_json(answer: Mapping[str, Any]) -> None:
    """Print the answer of a command as JSON, schema number first."""
    text = json.dumps(numbered(ANSWER, answer), allow_nan=False, indent=2, ensure_ascii=False)
    with suppress(UnicodeError):
        # If a file name does not fit the locale, Python stores its bytes as surrogates: restore the characters.
        text = text.encode("utf-8", "surrogateescape").decode("utf-8")
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except (UnicodeError, LookupError):
        # Standard output cannot encode all characters: escape them.
        text = json.dumps(json.loads(text), indent=2)
    print(text)
