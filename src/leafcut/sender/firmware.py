"""The firmwares that programs can be sent to, by the controller of a machine."""

from __future__ import annotations

from leafcut.errors import OptionError
from leafcut.kinds import Head
from leafcut.model.machine import Machine
from leafcut.sender.conversation import Conversation
from leafcut.sender.grbl import GrblConversation
from leafcut.sender.marlin import MarlinConversation

_SPEAKERS: dict[str, type[Conversation]] = {
    "grbl": GrblConversation,
    "grbl-laser": GrblConversation,
    "marlin": MarlinConversation,
}


def speaker_of(machine: Machine, name: str) -> type[Conversation]:
    """Return how the controller of a machine, called so by the person, is spoken to.

    Raises
    ------
    OptionError
        Programs cannot be sent to it.
    """
    found = _SPEAKERS.get(machine.control)
    if found is None:
        raise OptionError(
            f"--machine {name}: its controller is {machine.control}; only GRBL and Marlin boards can be sent to"
        )
    if found is MarlinConversation and machine.head is Head.LASER:
        raise OptionError(f"--machine {name}: a laser on Marlin cannot be sent to; only mills, drills and plotters can")
    return found
