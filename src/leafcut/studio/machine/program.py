"""The program that goes to the machine: one that leafcut verified for it, or one that was opened and is read for it."""

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
    """Return a machine by its name: one of leafcut's, or ``mine:NAME`` of the person's own.

    Raises
    ------
    LeafcutError
        There is none of that name, its profile is wrong, or programs cannot be sent to its controller.
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
    """Return the machines to which programs can be sent, the person's own first, and what each works with."""
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
        There is none, it was not verified, or it was made for another machine; or it may not be sent.
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
    """Return a program that was opened as a job for a machine, which reads every line of it.

    Raises
    ------
    LeafcutError
        It cannot be read, or may not be sent.
    """
    path = folder.input_path(source)
    text, made_for = program_text(path, path.name), machine_of(machine, folder)
    return job_of(text, path.name, made_for, dialect(made_for.controller), units, accept)
