"""Fail a case that causes a message without a template, so that no test needs the whole text of a message.

Most tests check some words of a message. A template covers a message from its first to its last letter: one wrong or
missing word, and no template fits. The Spanish catalogue has the templates of the messages that the studio shows
(`tools/lint` compares them with the source); `message_lines.txt` has the others. A message also lacks no value.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut.errors import LeafcutError, ReadError
from leafcut.model.difference import Difference
from leafcut.model.issue import Issue
from leafcut.studio.messages import Messages
from leafcut.studio.wording import words

ROOT = Path(__file__).parents[1]
PACKAGE = Path(leafcut.__file__).parent
#: Folders of the tests whose messages are checked.
FOLDERS = tuple(
    str(ROOT / "tests" / name)
    for name in (
        "gcode",
        "order",
        "post",
        "proof",
        "read",
        "processes/pocket/proof",
        "processes/program/post",
        "processes/program/proof",
        "processes/sheet/proof",
    )
)
#: Source files with messages that the studio never shows, or that are parts of longer messages.
PARTS = (
    "cli/", "order/executors.py", "processes/cutting_data/", "processes/program/proof/changed_order.py",
    "processes/program/proof/explanation.py", "processes/program/proof/rapids.py", "processes/settings.py", "report/",
)  # fmt: skip
#: A message of gerbonara that is quoted.
QUOTED = "Undefined tool index"
LINES = (ROOT / "tests" / "message_lines.txt").read_text(encoding="utf-8").splitlines()
MESSAGES = Messages(words("es").messages.table | {line: "" for line in LINES if line and not line.startswith("# ")})
#: A value that is missing: the text of Python's None, or nothing between a colon and the next part.
NO_VALUE = re.compile(r"(?<!')\bNone\b|: ?(;|$)")

#: The file whose frames lie between a message and its cause.
ERRORS = LeafcutError.__init__.__code__.co_filename

#: Messages of the current case that no template covers or that lack a value, with their source file and line.
unknown: list[str] = []


def covered(text: str) -> bool:
    """Return whether templates cover a text; before a colon there may be anything, such as the name of a file."""
    if text in MESSAGES._whole or any(True for _ in MESSAGES._matches(text)):
        return True
    return any(
        covered(text[between.end() :]) and (between[0] == ": " or covered(text[: between.start()]))
        for between in re.finditer("; |: ", text)
    )


def check(text: str) -> None:
    """Note a text that no template covers if a source file of leafcut caused it; `''` stands for user input.

    Shortened texts, which have an ellipsis, are left out.
    """
    frame: Any = sys._getframe(2)
    inner = ("<string>", ERRORS, __file__)
    while frame is not None and frame.f_code.co_filename in inner:
        frame = frame.f_back
    file = Path(frame.f_code.co_filename) if frame is not None else ROOT
    if not file.is_relative_to(PACKAGE) or str(file.relative_to(PACKAGE)).startswith(PARTS):
        return
    known = not text or "…" in text or QUOTED in text or covered(text.replace("''", "'x'"))
    if not known or NO_VALUE.search(text):
        unknown.append(f"{file.relative_to(PACKAGE)}:{frame.f_lineno}: {text}")


def observed(kind: type[Any], name: str, text_of: Callable[..., str]) -> None:
    """Check the text of each object that a method of a class has created."""
    method = getattr(kind, name)

    def checked(self: Any, *args: Any, **given: Any) -> None:
        method(self, *args, **given)
        check(text_of(self))

    setattr(kind, name, checked)


observed(LeafcutError, "__init__", str)
observed(ReadError, "__init__", str)
observed(Issue, "__post_init__", lambda issue: issue.message)
observed(Difference, "__init__", lambda difference: difference.text)
observed(Difference, "__init__", lambda difference: difference.what)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Check the messages of a case. Random values of Hypothesis may hold anything, also parts of other messages."""
    unknown.clear()
    result = yield
    if unknown and str(item.path).startswith(FOLDERS) and not item.get_closest_marker("hypothesis"):
        pytest.fail("no template covers, or a value is missing: " + "\n".join(unknown[:5]), pytrace=False)
    return result
