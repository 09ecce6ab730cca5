"""Programs for the machine. They are verified results of leafcut, or opened files that are checked for this machine."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from leafcut.errors import OptionError, ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.model.kinds import Head
from leafcut.read.machine import load_machine, machine_names
from leafcut.sender.firmware import conversation_class
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.job import SendJob, job_from_text, read_program_text
from leafcut.studio.folder import OWN, Folder

if TYPE_CHECKING:
    from leafcut.model.machine import Machine
    from leafcut.studio.jobs.history import History


def included_or_own_machine(word: str, folder: Folder) -> Machine:
    """Return an included machine by its name, or one of the user's own machines as ``mine:NAME``.

    Raises `LeafcutError` if the name is unknown, if the profile is invalid, or if the page cannot send to this
    controller.
    """
    if word.startswith(OWN):
        machine = load_machine(str(folder.existing_own_path("machines", word, "--machine")))
    elif word in machine_names():
        machine = load_machine(word)
    else:
        raise OptionError("choose a machine of the library")
    if conversation_class(machine, machine.name) is not GrblConversation:
        raise OptionError(
            "{}: this page supports only GRBL boards; send to {} with leafcut send", machine.name, machine.control
        )
    return machine


def machines_to_send_to(folder: Folder) -> dict[str, Head]:
    """Return all machines that the page can send programs to, with their kind of head.

    The user's own machines come first.
    """
    heads = {}
    for word in [*(OWN + name for name in folder.own_names("machines")), *machine_names()]:
        try:
            heads[word] = included_or_own_machine(word, folder).head
        except (OptionError, ReadError):
            continue
    return heads


def program_from_job(history: History, folder: Folder, job: str, machine: str, accept: Collection[str] = ()) -> SendJob:
    """Prepare the program of a finished run for sending.

    Raises `LeafcutError` if the program was not verified or was created for a different machine.
    """
    answer, program = history.answer(job), history.artefact(job, "program")
    if answer is None or program is None:
        raise OptionError("there is no program yet; run one first, or open one")
    if not answer.get("verified"):
        raise OptionError("{} was not verified; run it again", program.file_name)
    profile = included_or_own_machine(machine, folder)
    if answer["machine"] != profile.name:
        raise OptionError(
            "{} was made and verified for {}, not for {}; run it again for this machine",
            program.file_name,
            answer["machine"],
            profile.name,
        )
    return job_from_text(program.text, program.file_name, profile, load_dialect(profile.controller), None, accept)


def program_from_file(
    folder: Folder, source: str, machine: str, units: str | None = None, accept: Collection[str] = ()
) -> SendJob:
    """Check all lines of an opened program, and prepare the program for sending.

    Raises `LeafcutError` if the program is unreadable or must not be sent.
    """
    path = folder.input_path(source)
    text, made_for = read_program_text(path, path.name), included_or_own_machine(machine, folder)
    return job_from_text(text, path.name, made_for, load_dialect(made_for.controller), units, accept)
