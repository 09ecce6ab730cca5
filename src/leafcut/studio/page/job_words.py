"""Texts that describe a job in lists (its choices and its result), and search terms for jobs."""

from __future__ import annotations

from leafcut.api import default_machine
from leafcut.processes.settings import all_options
from leafcut.studio.folder import OWN, Folder
from leafcut.studio.jobs.history import JobRecord, JobState, SearchTerm
from leafcut.studio.jobs.task import Task
from leafcut.studio.page.forms import changed_values, value_words
from leafcut.studio.wording import Words
from leafcut.units import format_time

#: Maximum number of search terms.
_MAX_WORDS = 8


def machine_and_changed_options(task: Task, folder: Folder, words: Words) -> list[str]:
    """Return the machine and the changed options. They distinguish a job from other jobs with the same file."""
    options = changed_values(task.options)
    machine = str(options.pop("machine", "") or default_machine(task.process)).removeprefix(OWN)
    choices = [machine] if task.command == "optimize" or "machine" in task.options else []
    for name, value in options.items():
        if isinstance(value, bool):
            choices.append(words.option_label(name) if value else f"{words.option_label(name)} {words('form.off')}")
        else:
            choices.append(f"{words.option_label(name)} {value_words(name, value, words, folder)}")
    return choices


def change_words(saved: float) -> str:
    """Format a change of time in percent, such as ``−2.5 %``. A change of zero has no sign."""
    percent = round(saved, 1)
    sign = "−" if percent > 0 else "+" if percent < 0 else ""
    return f"{sign}{abs(percent):.1f}\u00a0%"


def result_words(record: JobRecord, words: Words) -> str:
    """Describe the result of a job in a few words, or return its error."""
    figures = record.figures
    if "after_s" in figures and figures["before_s"] is not None:
        change = change_words(figures["saved_percent"] or 0.0)
        return f"{format_time(figures['before_s'])} → {format_time(figures['after_s'])} ({change})"
    if "length" in figures:
        return f"{figures['length']:,.8g}"
    if "variants" in figures:
        used = f"{figures['utilisation_of_used_percent']:.1f}"
        return words("nest.found", sheets=figures["sheets"], percent=used)
    if "same" in figures:
        return words("result.same" if figures["same"] else "result.differs")
    return format_time(figures["time_s"]) if "time_s" in figures else words.translate_for_page(record.line)


def search_terms(text: str, words: Words) -> list[SearchTerm]:
    """Return a search term for each word of a text.

    A term also covers the options and states whose labels contain the word.
    """
    terms = []
    for word in text.split()[:_MAX_WORDS]:
        low = word.lower()
        options = tuple(name for _, name, _ in all_options() if low in words.option_label(name).lower())
        states = tuple(state for state in JobState if low in words(f"state.{state.value}").lower())
        terms.append(SearchTerm(word, options, states))
    return terms
