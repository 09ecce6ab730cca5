"""Groups of options for tests of planning, made as a run makes them: each takes those that are its own."""

from __future__ import annotations

from typing import Any

from leafcut.options import JobOptions
from leafcut.options.option_spec import OptionGroup
from leafcut.processes.drilling.options import DrillOptions


def drilling(**options: Any) -> tuple[JobOptions, DrillOptions]:
    """Return the options of the job and of drilling."""
    known = {*JobOptions.specs(), *DrillOptions.specs()}
    assert known >= options.keys(), options.keys() - known
    return JobOptions(**_of(JobOptions, options)), DrillOptions(**_of(DrillOptions, options))


def _of(group: type[OptionGroup], options: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in options.items() if name in group.specs()}
