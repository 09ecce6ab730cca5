"""A filter of LinuxCNC: a drawing is opened in the window of the controller, and becomes a program on its way there.

LinuxCNC runs ``program 'file'`` in a shell, reads G-code from standard output, and from standard error lines
``FILTER_PROGRESS=nn`` with the percent done; what else stands there it shows when the exit status is not 0. The file of
its machine is in the environment as ``INI_FILE_NAME``. Source: `filter_program` of AXIS, LinuxCNC 2.9.
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
from leafcut.files.whole_files import check_is_there
from leafcut.model.heartbeat import Progress
from leafcut.model.outcome import Outcome
from leafcut.processes import registry
from leafcut.processes.settings import collect

#: LinuxCNC's name for the file of its machine.
INI_VARIABLE = "INI_FILE_NAME"


class FilterProgress:
    """A progress callback that tells LinuxCNC the percent done, each once and none lower than before."""

    def __init__(self) -> None:
        self.told = -1

    def __call__(self, now: Progress) -> None:
        """Tell the share done, where it is another percent; the last one is told when the program is there."""
        self.tell(min(99, int(100.0 * now.share)))

    def tell(self, percent: int) -> None:
        """Tell a percentage."""
        if percent > self.told:
            self.told = percent
            print(f"FILTER_PROGRESS={percent}", file=sys.stderr, flush=True)


def run_filter(
    file: str,
    options: Mapping[str, Any],
    *,
    process: str = "auto",
    options_file: str | None = None,
    defaults_file: Path | None = None,
) -> Outcome:
    """Return the program of a drawing, or of another program, for the machine on which LinuxCNC runs.

    The arguments are those of `api.optimize`. Where neither an option nor the file of options names a machine, it is
    that of LinuxCNC; where LinuxCNC did not start this, that of the person's defaults.

    Raises
    ------
    ReadError, OptionError, PlanError, PostError, VerifyError
        One line that says what was found and what to do.
    """
    progress = FilterProgress()
    progress.tell(0)
    check_is_there("--options", Path(options_file) if options_file else None)
    settings = collect(options, Path(options_file) if options_file else None, defaults_file)
    named = "machine" in settings.given - settings.defaults
    with _machine_of_linuxcnc("" if named else os.environ.get(INI_VARIABLE, "")) as own:
        given = {**options, "machine": own} if own else dict(options)
        if process == "auto":
            process = _process(file, own or settings.machine.machine)
        outcome = api.optimize(
            file, process=process, options_file=options_file, defaults_file=defaults_file, progress=progress, **given
        )
    progress.tell(100)
    return outcome


@contextmanager
def _machine_of_linuxcnc(ini: str) -> Iterator[str]:
    """Give a profile of LinuxCNC's machine, as long as it is needed; "" without a file of it."""
    if not ini:
        yield ""
        return
    from leafcut.read.controllers.importing import imported, read_settings

    try:
        made = imported(read_settings(ini), ini, "linuxcnc")
    except LeafcutError as problem:
        line = f"{problem}; or name the machine in the line of [FILTER], --machine my.toml"
        raise OptionError(line) from None
    with tempfile.TemporaryDirectory(prefix="leafcut-") as folder:
        profile = Path(folder) / f"{Path(ini).stem}.toml"
        profile.write_text(made.text, encoding="utf-8")
        yield str(profile)


def _process(file: str, machine: str) -> str:
    """Return what ``--process`` says where nobody did: the first work that the file is for and the machine can do.

    So a torch cuts what a spindle drills, and a picture of outlines becomes pockets on a mill. Where there is none, and
    for programs, the common way finds out or refuses.
    """
    from leafcut.read.machine import load_machine
    from leafcut.read.registry import read_source

    works = read_source(file)[0].processes
    if "program" in works:
        return "auto"
    head = load_machine(machine).head
    found = (one for one in registry.processes() if one.reads == "drawing" and one.name in works)
    return next((one.asked_as[0] for one in found if head in one.heads), "auto")


def check_file(words: Sequence[str]) -> str:
    """Return the one file that a filter is called with.

    Raises
    ------
    OptionError, ReadError
        There is none, there are several, or it is not there.
    """
    if len(words) != 1:
        raise OptionError(f"filter takes one file, as LinuxCNC calls it; {len(words)} were given")
    if not Path(words[0]).exists():
        raise ReadError(words[0], "file not found")
    return words[0]
