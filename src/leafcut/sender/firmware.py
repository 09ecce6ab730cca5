"""The firmwares that leafcut can send programs to. The controller in the machine profile determines the firmware."""

from __future__ import annotations

import time
from collections.abc import Callable

from leafcut.errors import OptionError
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.sender.conversation import Conversation, NotThisFirmware, wrong_firmware_error
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.marlin import MarlinConversation
from leafcut.sender.port import Port

_SPEAKERS: dict[str, type[Conversation]] = {
    "grbl": GrblConversation,
    "grbl-laser": GrblConversation,
    "marlin": MarlinConversation,
}


def conversation_class(machine: Machine, name: str) -> type[Conversation]:
    """Return the conversation class for a machine.

    `name` is the value of ``--machine`` and appears in the error message. Raises `OptionError` if leafcut cannot send
    programs to this controller.
    """
    speaker = _SPEAKERS.get(machine.control)
    if speaker is None:
        raise OptionError(
            "--machine {}: its controller is {}; leafcut sends only to GRBL and Marlin boards", name, machine.control
        )
    if speaker is MarlinConversation and machine.head is Head.LASER:
        raise OptionError(
            "--machine {}: leafcut does not send to lasers on Marlin, only to mills, drills and plotters", name
        )
    return speaker


#: Kinds of settings (see `leafcut.read.controllers.importing.KINDS`) that can be read from a port.
ASKED: dict[str, type[Conversation]] = {
    "grbl": GrblConversation,
    "fluidnc": GrblConversation,
    "marlin": MarlinConversation,
}


def query_settings(port: Port, kind: str | None = None, clock: Callable[[], float] = time.monotonic) -> tuple[str, str]:
    """Read the settings of the board at a port, in the format of a settings file.

    Without a kind, this function tries GRBL first and then Marlin. Marlin treats the GRBL query as an unknown command
    and ignores it.

    Returns
    -------
    tuple[str, str]
        The kind of the settings and their text.

    Raises
    ------
    OptionError
        Boards of this kind cannot be queried.
    SendError
        The board does not answer, has a different firmware, is moving, or does not report its settings.
    """
    if kind is not None and kind not in ASKED:
        raise OptionError(
            "--kind {}: only {} can be read from a port; use a file of its settings", kind, ", ".join(ASKED)
        )
    speakers = [GrblConversation, MarlinConversation] if kind is None else [ASKED[kind]]
    problems: list[NotThisFirmware] = []
    for speaker in speakers:
        talk = speaker(port, clock=clock)
        try:
            talk.connect()
        except NotThisFirmware as problem:
            problems.append(problem)
            continue
        return talk.read_settings_at_rest()
    answers = next((problem.answers for problem in problems if problem.answers), [])
    raise (
        problems[0]
        if kind is not None
        else wrong_firmware_error(port.name, answers, "GRBL, grblHAL, FluidNC or Marlin")
    )
