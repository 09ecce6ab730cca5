"""Programs for the machine: verified results of leafcut, or opened files checked for this machine."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from leafcut.errors import OptionError, ReadError
from leafcut.gcode.dialects import dialect
from leafcut.model.kinds import Head
from leafcut.read.machine import load_machine, machine_names
from leafcut.sender.firmware import speaker_of
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.job import SendJob, job_of, program_text
from leafcut.studio.folder import OWN, Folder

if TYPE_CHECKING:
    from leafcut.model.machine import Machine
    from leafcut.studio.jobs.history import History


def machine_of(word: str, folder: Folder) -> Machine:
    """Return a shipped machine by name, or a user's own one by ``mine:NAME``.

    Raises
    ------
    LeafcutError
        The name is unknown, the profile is invalid, or leafcut cannot send to this controller from the page.
    """
    if word.startswith(OWN):
        made = load_machine(str(folder.kept_own("machines", word, "--machine")))
    elif word in machine_names():
        made = load_machine(word)
    else:
        raise OptionError("choose a machine of the library")
    if speaker_of(made, made.name) is not GrblConversation:
        raise OptionError(f"{made.name}: this page serves GRBL boards alone; send to {made.control} with leafcut send")
    return made


def sendable(folder: Folder) -> dict[str, Head]:
    """Return the machines that can receive programs, the user's own first, with their kind of head."""
    found = {}
    for word in [*(OWN + name for name in folder.own("machines")), *machine_names()]:
        try:
            found[word] = machine_of(word, folder).head
        except (OptionError, ReadError):
            continue
    return found


def program_of_job(history: History, folder: Folder, job: str, machine: str, accept: Collection[str] = ()) -> SendJob:
    """Return the program of a run as a job for a machine.

    Raises
    ------
    LeafcutError
        The program is missing, unverified, made for another machine, or may not be sent.
    """
    answer, found = history.answer(job), history.artefact(job, "program")
    if answer is None or found is None:
        raise OptionError("there is no program yet; run one first, or open one")
    if not answer.get("verified"):
        raise OptionError(f"{found.file_name} was not verified; run it again")
    made_for = machine_of(machine, folder)
    if answer["machine"] != made_for.name:
        raise OptionError(
            f"{found.file_name} was made and verified for {answer['machine']}, not for {made_for.name}; run it again "
            "for this machine"
        )
    return job_of(found.text, found.file_name, made_for, dialect(made_for.controller), None, accept)


def program_of_file(
    folder: Folder, source: str, machine: str, units: str | None = None, accept: Collection[str] = ()
) -> SendJob:
    """Return an opened program as a job for a machine; every line is checked.

    Raises
    ------
    LeafcutError
        It cannot be read, or may not be sent.
    """
    path = folder.input_path(source)
    text, made_for = program_text(path, path.name), machine_of(machine, folder)
    return job_of(text, path.name, made_for, dialect(made_for.controller), units, accept)
