"""Handles the sheets of a nest as jobs: cuts one sheet, or plans all cuts and compares the variants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from leafcut.errors import OptionError
from leafcut.processes.settings import collect_settings, group_of
from leafcut.studio.jobs.history import History, JobRecord, JobState
from leafcut.studio.jobs.jobs import Jobs
from leafcut.studio.jobs.task import Task, options_with_value, resolve_task

#: States of jobs whose plans are not complete yet.
GOING = (JobState.WAITING.value, JobState.RUNNING.value)


@dataclass(frozen=True)
class SheetOfNest:
    """A sheet of a nest. The variant and the sheet number count from 1. `count` is the number of copies."""

    job: str
    variant: int
    number: int
    count: int
    file: str

    @property
    def origin(self) -> str:
        """Value of `Task.origin` for the task that cuts this sheet."""
        return f"{self.job}/{self.variant}/{self.number}"

    @property
    def drawing(self) -> str:
        """Name of the file with the drawing of this sheet, which the nest has created."""
        return f"sheet-{self.variant}-{self.number}"


def sheets_in_answer(job: str, answer: Mapping[str, Any]) -> list[SheetOfNest]:
    """Return the sheets of a nest, one variant after the other."""
    return [
        SheetOfNest(job, v, k, layout["sheets"], layout["file"])
        for v, variant in enumerate(answer["variants"], 1)
        for k, layout in enumerate(variant["layouts"], 1)
    ]


def sheets_of_nest(history: History, job: str) -> list[SheetOfNest]:
    """Return the sheets of a nesting job. Raises `OptionError` if the job is not a nest or has no result."""
    record = history.get(job)
    answer = history.answer(job) if record is not None and record.task.command == "nest" else None
    if answer is None:
        raise OptionError("this job has no nests; run a job with 'nest' first")
    return sheets_in_answer(job, answer)


def upload_sheet(jobs: Jobs, sheet: SheetOfNest) -> str:
    """Return the id of the upload with the drawing of a sheet. If there is no such upload, create it.

    Raises `OptionError` if the nest was deleted.
    """
    for record in jobs.history.sheet_jobs(sheet.job):
        if record.task.origin == sheet.origin:
            try:
                jobs.folder.input_path(record.task.inputs[0])
            except OptionError:
                continue
            return record.task.inputs[0]
    drawing = jobs.history.artefact(sheet.job, sheet.drawing)
    if drawing is None:
        raise OptionError("this nest is no longer in the history")
    return jobs.folder.add_input(drawing.file_name, drawing.data)


def start_cut_planning(jobs: Jobs, job: str, options: Mapping[str, Any]) -> list[str]:
    """Start a job for each sheet of a nest that plans its cuts with the given options. Return the ids of the jobs.

    Unfinished jobs with the same options are reused. Raises `OptionError` before any job starts if `job` is not a nest
    or an option is invalid.
    """
    tasks = []
    asked = {"quantity": options.get("quantity")}
    batch = collect_settings(asked).of(group_of("quantity")).changed().get("quantity", 1)
    for sheet in sheets_of_nest(jobs.history, job):
        counted = {"quantity": batch * sheet.count} if batch * sheet.count > 1 else {}
        tasks.append(
            Task(
                "optimize",
                (upload_sheet(jobs, sheet),),
                "cut",
                {**options_with_value(options), **counted},
                sheet.origin,
            )
        )
    for task in tasks:
        resolve_task(task, jobs.folder)
    going = [record for record in jobs.sheet_jobs(job) if record.state.value in GOING]
    return [next((record.id for record in going if record.task == task), "") or jobs.start(task) for task in tasks]


def compare_variants(jobs: Jobs, job: str) -> list[dict[str, Any]]:
    """Add up the planned cuts for each variant of a nest.

    Only cuts with the options of the newest job count, and unknown values are None. ``jobs`` contains the jobs for the
    sheets of the variant. ``quickest`` marks the fastest variant as soon as all variants are planned.
    """
    sheets = sheets_of_nest(jobs.history, job)
    newest = _newest_by_origin(jobs.sheet_jobs(job))
    rows = [
        _variant_row(jobs, variant, [(s, newest.get(s.origin)) for s in variant_sheets])
        for variant, variant_sheets in _sheets_by_variant(sheets)
    ]
    timed = [row["time_s"] for row in rows if row["time_s"] is not None]
    finished = len(timed) > 1 and not any(row["state"] in GOING for row in rows)
    for row in rows:
        row["quickest"] = finished and row["time_s"] == min(timed)
    return rows


def _sheets_by_variant(sheets: list[SheetOfNest]) -> Iterator[tuple[int, list[SheetOfNest]]]:
    for variant in dict.fromkeys(sheet.variant for sheet in sheets):
        yield variant, [sheet for sheet in sheets if sheet.variant == variant]


def _newest_by_origin(records: list[JobRecord]) -> dict[str, JobRecord]:
    """Return the newest job for each origin. Only jobs with the same options as the newest of all jobs count."""
    if not records:
        return {}
    newest_options = _without_quantity(records[0].task.options)
    matching = [record for record in records if _without_quantity(record.task.options) == newest_options]
    return {record.task.origin: record for record in reversed(matching)}


def _without_quantity(options: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if name != "quantity"}


def _variant_row(jobs: Jobs, variant: int, cuts: list[tuple[SheetOfNest, JobRecord | None]]) -> dict[str, Any]:
    records = [record for _, record in cuts if record is not None]
    states = [record.state for record in records]
    row: dict[str, Any] = {
        "variant": variant,
        "state": _combined_state(states, len(cuts)),
        "line": next((record.line for record in records if record.line), ""),
        "jobs": [record.id if record is not None else None for _, record in cuts],
    }
    if row["state"] not in (JobState.DONE.value, JobState.STOPPED.value):
        return {**row, "time_s": None, "cut_mm": None, "rapid_mm": None, "pierces": None, "cost": None}
    answers = [(sheet.count, jobs.history.answer(record.id) or {}) for sheet, record in cuts if record is not None]
    times = [(count, answer["cutting"]["sheet"]) for count, answer in answers]
    sums = {key: sum(count * sheet[key] for count, sheet in times) for key in ("cut_mm", "rapid_mm", "pierces")}
    costs = [answer["cutting"]["cost"] for _, answer in answers]
    cost = None if None in costs else sum(count * answer["cutting"]["cost"] for count, answer in answers)
    time_s = sum(count * answer["after"]["time_s"] for count, answer in answers)
    return {**row, "time_s": time_s, **sums, "cost": cost or None}


def _combined_state(states: list[JobState], expected: int) -> str:
    order = (
        JobState.FAILED,
        JobState.CANCELLED,
        JobState.INTERRUPTED,
        JobState.RUNNING,
        JobState.WAITING,
        JobState.STOPPED,
        JobState.DONE,
    )
    if len(states) < expected:
        return "none"
    return next(state.value for state in order if state in states)
