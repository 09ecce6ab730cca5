"""Choices of a page as plain values, saved after every change and restored when a page loads."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from leafcut.errors import OptionError
from leafcut.processes.settings import all_options
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.page import forms
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_live import PACES

#: Format of a job id.
_JOB = re.compile(r"[A-Za-z0-9_-]{12}")


@dataclass(frozen=True)
class KeptState:
    """Choices of a `View`, the tab of the result, and the order edited by hand.

    `edit` has the keys ``job``, the job of the order, and ``state``, ``before`` and ``after`` of `Undoable.as_plain`.
    """

    source: str = ""
    name: str = ""
    second: str = ""
    second_name: str = ""
    parts: tuple[str, ...] = ()
    part_names: dict[str, str] = field(default_factory=dict)
    origin: str = ""
    sheet: tuple[int, int] = (1, 1)
    work: str = "drill"
    process: str = "auto"
    values: dict[str, Any] = field(default_factory=dict)
    shown: dict[str, str] = field(default_factory=dict)
    of_input: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()
    usual: dict[str, str] = field(default_factory=dict)
    known_defaults: tuple[str, ...] | None = None
    job: str = ""
    pace: str = "full"
    tab: str = "summary"
    edit: dict[str, Any] | None = None

    @classmethod
    def of(cls, view: View, tab: str, edit: dict[str, Any] | None) -> KeptState:
        """Return the choices of a page."""
        return cls(
            view.source, view.name, view.second, view.second_name,
            tuple(part.word for part in view.parts), dict(view.part_names), view.origin, view.sheet,
            view.work, view.process, dict(view.values), dict(view.shown), tuple(sorted(view.of_input)),
            tuple(sorted(view.kept)), dict(view.usual),
            None if view.known_defaults is None else tuple(sorted(view.known_defaults)),
            view.job or "", view.pace, tab, edit,
        )  # fmt: skip

    def put_into(self, view: View) -> None:
        """Apply the choices to a page."""
        view.source, view.name, view.seen = self.source, self.name, None
        view.second, view.second_name = self.second, self.second_name
        view.parts, view.part_names = [WantedPart.of(word) for word in self.parts], dict(self.part_names)
        view.origin, view.sheet = self.origin, self.sheet
        view.work, view.process, view.pace = self.work, self.process, self.pace
        view.values, view.shown, view.of_input = dict(self.values), dict(self.shown), set(self.of_input)
        view.kept, view.usual = set(self.kept), dict(self.usual)
        view.known_defaults = None if self.known_defaults is None else set(self.known_defaults)
        view.for_study = None
        problems = {name: forms.problem_with(name, value) for name, value in self.values.items()}
        view.errors = {name: line for name, line in problems.items() if line}
        view.job = self.job if self.job and view.studio.jobs.record(self.job) is not None else None

    def as_json(self) -> str:
        """Return the choices as one line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, plain: Mapping[str, Any]) -> KeptState:
        """Decode the result of `as_json`; invalid entries are ignored.

        Ids of files and jobs are checked whenever they are used, like those sent by a page.
        """
        texts = ("source", "name", "second", "second_name", "origin")
        known = {name for _, name, _ in all_options()}
        values = {
            n: v for n, v in _dict(plain, "values").items() if n in known and isinstance(v, str | bool | int | float)
        }
        job, edit = str(plain.get("job", "")), plain.get("edit")
        return cls(
            **{name: str(plain.get(name, "")) for name in texts},
            parts=_parts(plain.get("parts")),
            part_names={k: str(v) for k, v in _dict(plain, "part_names").items()},
            sheet=_sheet(plain.get("sheet")),
            work=_one_of(plain.get("work"), forms.works(), "drill"),
            process=_one_of(plain.get("process"), forms.program_processes(), "auto"),
            values=values,
            shown={n: str(v) for n, v in _dict(plain, "shown").items() if n in values},
            of_input=tuple(n for n in _list(plain, "of_input") if n in values),
            kept=tuple(n for n in _list(plain, "kept") if n in values),
            usual={n: str(v) for n, v in _dict(plain, "usual").items() if n in values},
            known_defaults=tuple(n for n in _list(plain, "known_defaults") if n in known)
            if isinstance(plain.get("known_defaults"), list)
            else None,
            job=job if _JOB.fullmatch(job) else "",
            pace=_one_of(plain.get("pace"), PACES, "full"),
            tab=str(plain.get("tab", "summary")),
            edit=edit if isinstance(edit, dict) else None,
        )

    @property
    def chosen(self) -> bool:
        """Whether there is anything to restore; values from the user's defaults do not count."""
        values = {name: value for name, value in self.values.items() if name not in self.usual}
        shown = {name: word for name, word in self.shown.items() if name not in self.usual}
        return replace(self, values=values, shown=shown, usual={}, known_defaults=None) != KeptState(
            tab=self.tab, pace=self.pace
        )


def _one_of(word: Any, known: Iterable[str], default: str) -> str:
    return word if isinstance(word, str) and word in set(known) else default


def _dict(plain: Mapping[str, Any], name: str) -> dict[str, Any]:
    value = plain.get(name)
    return value if isinstance(value, dict) else {}


def _list(plain: Mapping[str, Any], name: str) -> list[Any]:
    value = plain.get(name)
    return value if isinstance(value, list) else []


def _parts(words: Any) -> tuple[str, ...]:
    parts = []
    for word in words if isinstance(words, list) else []:
        with suppress(OptionError, AttributeError):
            parts.append(WantedPart.of(word).word)
    return tuple(parts)


def _sheet(plain: Any) -> tuple[int, int]:
    with suppress(TypeError, ValueError):
        variant, number = plain
        return int(variant), int(number)
    return 1, 1
