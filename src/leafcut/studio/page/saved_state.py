"""The choices of a page as plain values, saved after every change and restored when the page loads."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any

from leafcut.errors import OptionError
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.page import forms
from leafcut.studio.page.form_values import FormValues
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_live import PACES

#: Format of a job id.
_JOB = re.compile(r"[A-Za-z0-9_-]{12}")
#: Attributes of a `View` that are saved: texts, sets of names, and tables of texts.
_TEXTS = ("source", "name", "second", "second_name", "origin", "work", "process", "pace")

#: Choices of a page: attributes of `View`, the ``tab`` of the result, and ``edit``, an order edited by hand. ``edit``
#: consists of its ``job``, and of ``state``, ``before`` and ``after`` from `UndoableState.as_plain`.
KeptState = dict[str, Any]


def kept_state(view: View, tab: str, edit: dict[str, Any] | None) -> KeptState:
    """Return the choices of a page."""
    return {
        **{name: getattr(view, name) for name in _TEXTS},
        "table": view.table.as_plain(),
        "parts": [part.word for part in view.parts],
        "part_names": dict(view.part_names),
        "sheet": list(view.sheet),
        "job": view.job or "",
        "tab": tab,
        "edit": edit,
    }


def restore(view: View, plain: Mapping[str, Any]) -> None:
    """Apply saved choices (`kept_state`) to a page. Invalid entries are ignored.

    Ids of files and jobs are checked when they are used, like ids that a page sends.
    """
    for name in ("source", "name", "second", "second_name", "origin"):
        setattr(view, name, str(plain.get(name, "")))
    view.work = _one_of(plain.get("work"), forms.works(), "drill")
    view.process = _one_of(plain.get("process"), forms.program_processes(), "auto")
    view.pace = _one_of(plain.get("pace"), PACES, "full")
    view.table = FormValues.of_plain(plain.get("table"))
    names = plain.get("part_names")
    view.part_names = {k: str(v) for k, v in names.items()} if isinstance(names, dict) else {}
    view.parts, view.sheet, view.seen = _parts(plain.get("parts")), _sheet(plain.get("sheet")), None
    job = str(plain.get("job", ""))
    view.job = job if _JOB.fullmatch(job) and view.studio.jobs.record(job) is not None else None


def _one_of(word: Any, known: Iterable[str], default: str) -> str:
    return word if isinstance(word, str) and word in set(known) else default


def _parts(words: Any) -> list[WantedPart]:
    parts = []
    for word in words if isinstance(words, list) else []:
        with suppress(OptionError, AttributeError):
            parts.append(WantedPart.of(word))
    return parts


def _sheet(plain: Any) -> tuple[int, int]:
    with suppress(TypeError, ValueError):
        variant, number = plain
        return int(variant), int(number)
    return 1, 1
