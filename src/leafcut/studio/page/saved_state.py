"""The choices of a page as plain values, saved after every change and restored when the page loads."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import Any

from leafcut.errors import OptionError
from leafcut.processes.settings import all_options
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.page import forms
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_live import PACES

#: Format of a job id.
_JOB = re.compile(r"[A-Za-z0-9_-]{12}")
#: Attributes of a `View` that are saved: texts, sets of names, and tables of texts.
_TEXTS = ("source", "name", "second", "second_name", "origin", "work", "process", "pace")
_SETS = ("of_input", "kept")
_TABLES = ("part_names", "values", "shown", "usual")

#: Choices of a page: attributes of `View`, the ``tab`` of the result, and ``edit``, the order edited by hand: its
#: ``job``, and ``state``, ``before`` and ``after`` of `Undoable.as_plain`.
KeptState = dict[str, Any]


def kept_state(view: View, tab: str, edit: dict[str, Any] | None) -> KeptState:
    """Return the choices of a page."""
    known = view.known_defaults
    return {
        **{name: getattr(view, name) for name in _TEXTS},
        **{name: sorted(getattr(view, name)) for name in _SETS},
        **{name: dict(getattr(view, name)) for name in _TABLES},
        "parts": [part.word for part in view.parts],
        "sheet": list(view.sheet),
        "known_defaults": None if known is None else sorted(known),
        "job": view.job or "",
        "tab": tab,
        "edit": edit,
    }


def has_choices(kept: KeptState) -> bool:
    """Return whether a page has choices to restore. Values from the user's defaults do not count."""
    typed = {*kept["values"], *kept["shown"]} - set(kept["usual"])
    chosen = (kept["work"], kept["process"], kept["sheet"]) != ("drill", "auto", [1, 1])
    others = ("source", "second", "origin", "parts", "part_names", "of_input", "kept", "job", "edit")
    return bool(typed) or chosen or any(kept[name] for name in others)


def restore(view: View, plain: Mapping[str, Any]) -> None:
    """Apply saved choices (`kept_state`) to a page. Invalid entries are ignored.

    Ids of files and jobs are checked when they are used, like ids that a page sends.
    """
    options = {name for _, name, _ in all_options()}
    for name in ("source", "name", "second", "second_name", "origin"):
        setattr(view, name, str(plain.get(name, "")))
    view.work = _one_of(plain.get("work"), forms.works(), "drill")
    view.process = _one_of(plain.get("process"), forms.program_processes(), "auto")
    view.pace = _one_of(plain.get("pace"), PACES, "full")
    view.values = {
        n: v for n, v in _dict(plain, "values").items() if n in options and isinstance(v, str | bool | int | float)
    }
    view.shown, view.usual = (
        {n: str(v) for n, v in _dict(plain, table).items() if n in view.values} for table in ("shown", "usual")
    )
    view.of_input, view.kept = ({n for n in _list(plain, names) if n in view.values} for names in _SETS)
    follows = isinstance(plain.get("known_defaults"), list)
    view.known_defaults = {n for n in _list(plain, "known_defaults") if n in options} if follows else None
    view.parts, view.part_names = _parts(plain.get("parts")), {k: str(v) for k, v in _dict(plain, "part_names").items()}
    view.sheet, view.seen, view.for_study = _sheet(plain.get("sheet")), None, None
    problems = {name: forms.problem_with(name, value) for name, value in view.values.items()}
    view.errors = {name: line for name, line in problems.items() if line}
    job = str(plain.get("job", ""))
    view.job = job if _JOB.fullmatch(job) and view.studio.jobs.record(job) is not None else None


def _one_of(word: Any, known: Iterable[str], default: str) -> str:
    return word if isinstance(word, str) and word in set(known) else default


def _dict(plain: Mapping[str, Any], name: str) -> dict[str, Any]:
    value = plain.get(name)
    return value if isinstance(value, dict) else {}


def _list(plain: Mapping[str, Any], name: str) -> list[Any]:
    value = plain.get(name)
    return value if isinstance(value, list) else []


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
