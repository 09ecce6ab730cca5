"""Compare two programs and certify that both do the same work."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from leafcut.files.whole_files import read_program
from leafcut.model.certificate import Certificate
from leafcut.model.heartbeat import OnProgress, looking_for
from leafcut.options import Settings
from leafcut.processes.job import machine_of

if TYPE_CHECKING:
    from leafcut.gcode.dialects import Dialect
    from leafcut.model.heartbeat import Heartbeat
    from leafcut.model.machine import Machine
    from leafcut.processes.program.reading import ProgramRead
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
    """Return a certificate that both programs do the same work on the machine in `settings`, or their differences."""
    from leafcut.gcode import dialects
    from leafcut.processes.program.proof.avoided_areas import avoided_areas
    from leafcut.processes.program.proof.certificate import certify

    machine = machine_of(settings)
    words = dialect or machine.controller
    look = looking_for(progress, "verifying")
    first = _interpret(original, dialects.dialect(words), settings, machine, look, choose=True)
    other = _interpret(new, first.words, settings, first.machine, look, choose=False)
    found = certify(
        first.program, other.program, machine=first.machine, allow_reverse=allow_reverse, look=look, notes=True
    )
    if found.same:
        avoided = avoided_areas(first.program, other.program, first.machine.safe_z or 0.0)
        if avoided.moves:
            found = replace(found, notes=(*found.notes, f"{avoided.crossings} (first: line {avoided.line})"))
    return replace(found, defaults=settings.from_defaults())


def _interpret(
    program: Input, words: Dialect, settings: Settings, machine: Machine, look: Heartbeat, *, choose: bool
) -> ProgramRead:
    from leafcut.processes.program.reading import read_foreign

    return read_foreign(read_program(program), str(program), settings, machine, words, look, choose=choose)
