"""Summarizes the result of a run in a few words, for the top of the result panel and for announcements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from leafcut.studio.jobs.history import JobRecord
from leafcut.studio.page.job_words import result_words
from leafcut.studio.wording import Words
from leafcut.units import format_time


@dataclass(frozen=True)
class Headline:
    """A large line with a small line below. `kind` is ``better``, ``worse`` or ``same``."""

    large: str
    small: str
    kind: str = "better"

    @property
    def classes(self) -> str:
        """CSS classes of the large line."""
        return "headline" if self.kind == "better" else f"headline {self.kind}"


def saving_headline(answer: dict[str, Any], words: Words) -> Headline:
    """Return the time of a program and how much was saved, or the reason why the program did not improve."""
    seconds = (answer["before"]["time_s"] or 0.0) - (answer["after"]["time_s"] or 0.0)
    if format_time(abs(seconds)) == format_time(0.0):
        return Headline(
            _explain_no_saving(answer, words),
            words("result.stays", time=format_time(answer["after"]["time_s"])),
            "same",
        )
    time, other = format_time(answer["after"]["time_s"]), compared_strategies(answer)
    figures = {"time": format_time(abs(seconds)), "percent": f"{abs(answer['saved_percent'] or 0.0):.1f}"}
    if seconds < 0:
        return Headline(time, words("result.longer", **figures), "worse")
    small = words("result.less_than", other=other, **figures) if other else words("result.less", **figures)
    return Headline(time, small)


def compared_strategies(answer: dict[str, Any]) -> str:
    """Return the strategies that a pocketing program is compared with. The result is empty for all other programs."""
    return " + ".join(row["strategy"] for row in answer.get("strategies", ()) if row.get("usual"))


def _explain_no_saving(answer: dict[str, Any], words: Words) -> str:
    groups = answer.get("staying", [])
    n_kept, n_tasks = sum(group["count"] for group in groups), answer["counts"].get("pieces", 0)
    if not groups or n_kept < n_tasks:
        return words("result.same_order")
    largest = max(groups, key=lambda group: int(group["count"]))
    reasons = " · ".join(words(f"stays.{name}") for name in largest["reason"].split("+"))
    return words("result.all_stay", number=f"{n_kept:,}", pieces=f"{n_tasks:,}", why=reasons)


def missing_words(answer: dict[str, Any], words: Words) -> str:
    """Describe how much work is missing. The text is empty if nothing is missing."""
    # Answers of earlier versions lack this list.
    number = sum(work["count"] for work in answer.get("missing", ()))
    key = "result.missing" if number == 1 else "result.missing_several"
    return words(key, number=f"{number:,}") if number else ""


def announcement(record: JobRecord, answer: dict[str, Any], words: Words) -> str:
    """Return the text that announces a new result to screen readers."""
    return f"{record.title}: {_figures_sentence(record, answer, words)}"


def _figures_sentence(record: JobRecord, answer: dict[str, Any], words: Words) -> str:
    command = record.task.command
    if command == "optimize":
        time_saving = saving_headline(answer, words)
        proved = words("result.verified" if answer["verified"] else "result.unverified")
        large = time_saving.large if time_saving.kind == "same" else f"{time_saving.large}, {time_saving.small}"
        missing = missing_words(answer, words)
        return f"{large}. {missing}. {proved}." if missing else f"{large}. {proved}."
    if command == "verify":
        return words("result.same" if answer["same"] else "result.differs")
    if command == "solve":
        return f"{answer['length']:,.10g}, {words('result.length', number=format(answer['n'], ','))}"
    if command == "nest":
        used = answer["variants"][0]["utilisation_of_used_percent"]
        missing = missing_words(answer, words)
        return f"{used:.1f} %, {words('nest.used')}" + (f". {missing}." if missing else "")
    if command == "simulate":
        return f"{format_time(answer['time_s'])}, {words('result.on', machine=answer['machine'])}"
    return result_words(record, words)
