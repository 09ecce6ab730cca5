"""Which machines can do a kind of work, and what is said of one that cannot."""

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
def _machines() -> dict[str, Machine]:
    """Return the machines of leafcut's and of packages: no other name is looked for, as no path is."""
    found = {}
    for name in machine_names():
        with suppress(LeafcutError):
            found[name] = load_machine(name)
    return found


def machine_of(name: str, folder: Folder) -> Machine | None:
    """Return a machine, one of a person's own by its profile as it is now; None for an unknown one."""
    if not name.startswith(OWN):
        return _machines().get(name)
    try:
        return load_machine(str(folder.own_path("machines", name.removeprefix(OWN))))
    except LeafcutError:
        return None


def head_of(name: str, folder: Folder) -> Head | None:
    """Return what a machine works with; None for an unknown one."""
    machine = machine_of(name, folder)
    return None if machine is None else machine.head


def fits(name: str, work: str, folder: Folder) -> bool:
    """Return whether a machine can do a kind of work, or nothing says that it cannot."""
    head = head_of(name, folder)
    return head is None or registry.does_with(work, head)


def offered(machines: Mapping[str, str], work: str, chosen: str, folder: Folder) -> dict[str, str]:
    """Return the machines that can do a kind of work, and the one that is chosen: of that is said what is wrong."""
    return {name: title for name, title in machines.items() if name == chosen or fits(name, work, folder)}


def why_not(name: str, work: str, folder: Folder, words: Words) -> str:
    """Return why a machine cannot do a kind of work, and what to do; nothing where it can."""
    if not name or fits(name, work, folder):
        return ""
    head = head_of(name, folder)
    needed = words("choose.or").join(words(f"head.{one}") for one in registry.process(work).heads)
    called, has = name.removeprefix(OWN), words(f"head.{head}") if head else ""
    return words("choose.unfit", machine=called, has=has, needs=needed)
