"""Compare two programs, and certify that both do the same work."""

from __future__ import annotations

from dataclasses import replace

from leafcut.message import Message
from leafcut.model.certificate import Certificate
from leafcut.model.heartbeat import OnProgress, heartbeat_for_step
from leafcut.options import Settings
from leafcut.processes.program.reading import read_file
from leafcut.read import Input


def verify(
    original: Input,
    new: Input,
    settings: Settings,
    dialect: str | None,
    progress: OnProgress | None,
    *,
    allow_reverse: bool,
) -> Certificate:
    """Certify that two programs do the same work on the machine in `settings`, or list their differences."""
    from leafcut.processes.program.proof.avoided_areas import find_avoided_areas
    from leafcut.processes.program.proof.certificate import certify

    check_cancelled = heartbeat_for_step(progress, Message("verifying"))
    first = read_file(original, settings, dialect, check_cancelled)
    other = read_file(new, settings, dialect, check_cancelled, first)
    found = certify(
        first.program,
        other.program,
        machine=first.machine,
        allow_reverse=allow_reverse,
        tool_diameter_mm=settings.job.tool_diameter,
        check_cancelled=check_cancelled,
        notes=True,
    )
    if found.same:
        avoided = find_avoided_areas(first.program, other.program, first.machine.safe_z or 0.0)
        if avoided.moves:
            found = replace(
                found, notes=(*found.notes, Message("{} (first: line {})", avoided.crossings, avoided.line))
            )
    return replace(found, defaults=settings.options_from_defaults())
