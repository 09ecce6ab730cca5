"""A filter of LinuxCNC: converts a drawing that is opened in the controller's window to a program.

LinuxCNC runs ``program 'file'`` in a shell and reads G-code from standard output. From standard error it reads lines
``FILTER_PROGRESS=nn`` with the percentage done; it shows all other lines if the exit status is not 0. The environment
variable ``INI_FILE_NAME`` names its machine file. Source: `filter_program` of AXIS, LinuxCNC 2.9.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from leafcut import api
from leafcut.errors import LeafcutError, OptionError, ReadError
from leafcut.files.whole_files import check_file_exists
from leafcut.model.heartbeat import Progress
from leafcut.model.outcome import Outcome
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings
from leafcut.read.registry import read_source_with_format

INI_VARIABLE = "INI_FILE_NAME"


class FilterProgress:
    """Progress callback that reports the percentage done to LinuxCNC whenever it increases."""

    def __init__(self) -> None:
        self.last_percent = -1

    def __call__(self, now: Progress) -> None:
        """Report the share done as a percentage, up to 99; 100 is reported when the program is finished."""
        self.report(min(99, int(100.0 * now.share)))

    def report(self, percent: int) -> None:
        """Report a percentage."""
        if percent > self.last_percent:
            self.last_percent = percent
            print(f"FILTER_PROGRESS={percent}", file=sys.stderr, flush=True)


def run_filter(
    file: str,
    options: Mapping[str, Any],
    *,
    process: str = "auto",
    options_file: str | None = None,
    defaults_file: Path | None = None,
) -> Outcome:
    """Return the program of a drawing or of another program, for the machine on which LinuxCNC runs.

    The arguments and errors are those of `api.optimize`. Without a machine in the options or the options file,
    LinuxCNC's machine is used. If LinuxCNC did not start this process, the machine in the user's defaults is used.
    """
    progress = FilterProgress()
    progress.report(0)
    check_file_exists("--options", Path(options_file) if options_file else None)
    settings = collect_settings(options, Path(options_file) if options_file else None, defaults_file)
    names_machine = "machine" in settings.given - settings.defaults
    with _temporary_linuxcnc_profile("" if names_machine else os.environ.get(INI_VARIABLE, "")) as own_profile:
        given = {**options, "machine": own_profile} if own_profile else dict(options)
        if process == "auto":
            process = _default_process(file, own_profile or settings.machine.machine)
        outcome = api.optimize(
            file, process=process, options_file=options_file, defaults_file=defaults_file, progress=progress, **given
        )
    progress.report(100)
    return outcome


@contextmanager
def _temporary_linuxcnc_profile(ini: str) -> Iterator[str]:
    """Yield a temporary profile of LinuxCNC's machine; "" without an ini file."""
    if not ini:
        yield ""
        return
    from leafcut.read.controllers.importing import load_settings_text, machine_from_settings

    try:
        machine = machine_from_settings(load_settings_text(ini), ini, "linuxcnc")
    except LeafcutError as problem:
        line = f"{problem}; or name the machine in the line of [FILTER], --machine my.toml"
        raise OptionError(line) from None
    with tempfile.TemporaryDirectory(prefix="leafcut-") as folder:
        profile = Path(folder) / f"{Path(ini).stem}.toml"
        profile.write_text(machine.text, encoding="utf-8")
        yield str(profile)


def _default_process(file: str, machine: str) -> str:
    """Return the first process that suits the file and the machine's head, as the default of ``--process``.

    For example, a torch cuts what a spindle would drill, and an image with outlines becomes pockets on a mill. Without
    such a process, and for programs, the result is ``auto``.
    """
    from leafcut.read.machine import load_machine

    kinds = read_source_with_format(file)[0].processes
    if "program" in kinds:
        return "auto"
    head = load_machine(machine).head
    processes = (process for process in registry.processes() if process.reads == "drawing" and process.name in kinds)
    return next((process.process_values[0] for process in processes if head in process.heads), "auto")


def only_file(words: Sequence[str]) -> str:
    """Return the only file in the arguments of a filter. Raises OptionError or ReadError if the file does not exist."""
    if len(words) != 1:
        raise OptionError(f"filter takes one file, as LinuxCNC calls it; {len(words)} were given")
    if not Path(words[0]).exists():
        raise ReadError(words[0], "file not found")
    return words[0]
