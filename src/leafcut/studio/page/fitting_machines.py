"""Selects machines that are suitable for a kind of work, and explains why other machines are unsuitable."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from functools import cache

from leafcut.errors import LeafcutError
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.processes import registry
from leafcut.read.machine import load_machine, machine_names
from leafcut.studio.folder import OWN, Folder
from leafcut.studio.wording import Words


@cache
def _included_machines() -> dict[str, Machine]:
    machines = {}
    for name in machine_names():
        with suppress(LeafcutError):
            machines[name] = load_machine(name)
    return machines


def find_machine(name: str, folder: Folder) -> Machine | None:
    """Return a machine by its name, or None if the name is unknown.

    For a user's own machine, read its current profile.
    """
    if not name.startswith(OWN):
        return _included_machines().get(name)
    try:
        return load_machine(str(folder.own_path("machines", name.removeprefix(OWN))))
    except LeafcutError:
        return None


def machine_head(name: str, folder: Folder) -> Head | None:
    """Return a machine's kind of head, or None if the machine is unknown."""
    machine = find_machine(name, folder)
    return None if machine is None else machine.head


def is_suitable(name: str, work: str, folder: Folder) -> bool:
    """Return whether a machine is suitable for a kind of work. If this is unknown, return True."""
    head = machine_head(name, folder)
    return head is None or registry.machine_can_do(work, head)


def offered_machines(machines: Mapping[str, str], work: str, chosen: str, folder: Folder) -> dict[str, str]:
    """Return the machines that are suitable for a kind of work. The `chosen` machine is always included."""
    return {name: title for name, title in machines.items() if name == chosen or is_suitable(name, work, folder)}


def unsuitable_reason(name: str, work: str, folder: Folder, words: Words) -> str:
    """Explain why a machine is unsuitable for a kind of work, and give advice.

    Returns an empty string for a suitable machine.
    """
    if not name or is_suitable(name, work, folder):
        return ""
    head = machine_head(name, folder)
    needed = words("choose.or").join(words(f"head.{head_name}") for head_name in registry.work(work).heads)
    machine_name, head_text = name.removeprefix(OWN), words(f"head.{head}") if head else ""
    return words("choose.unfit", machine=machine_name, has=head_text, needs=needed)
