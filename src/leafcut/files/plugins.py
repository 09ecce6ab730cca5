"""Plug-ins: what other packages add by entry points; one loader for every kind of them.

A package adds a reader, a process, an algorithm, a dialect or a machine by an entry point of its kind's group. Nothing
of it is imported before it is listed or asked for by name, and whatever it does then stops nothing else.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from leafcut.errors import LeafcutError, OptionError, shown

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")

#: What the groups of all kinds begin with.
_OURS = "leafcut."


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """A plug-in by its name and package: what it adds, or the `error` that keeps it from being used."""

    name: str
    package: str
    adds: T | None
    error: str = ""

    @property
    def told(self) -> str:
        """What a list says of one that cannot be used."""
        return f"plug-in of {self.package} that cannot be used ({self.error})"


@dataclass(frozen=True)
class PluginKind(Generic[T]):
    """One kind of plug-in.

    Attributes
    ----------
    noun, group
        What it is called, and the group of its entry points: ``machine``, ``leafcut.machines``.
    built_in
        Returns the names of what leafcut brings itself; no plug-in takes the place of that.
    take
        Returns what leafcut uses of what an entry point names, (name, object). May raise anything.
    line
        Returns what a list says of it.
    claims
        Returns what it has that no other plug-in of this kind may have, in words, such as ``--engraving-depth``.
    """

    noun: str
    group: str
    built_in: Callable[[], Collection[str]]
    take: Callable[[str, Any], T]
    line: Callable[[T], str]
    claims: Callable[[T], Collection[str]] | None = None

    def names(self) -> tuple[str, ...]:
        """Return the names that may be asked for, in order, without importing anything of the packages."""
        named = entry_names(self.group)
        own = self.built_in() if named else ()
        return tuple(name for name in named if name not in own)

    def load(self, name: str) -> T:
        """Return what the plug-in of that name adds; the name is one of `names`.

        Raises
        ------
        OptionError
            It cannot be used.
        """
        for plugin in self._named(name):
            if plugin.adds is not None:
                return plugin.adds
            raise OptionError(f"the {self.noun} '{name}' is a {plugin.told}")
        raise OptionError(f"unknown {self.noun} '{name}'")

    def plugins(self) -> list[Plugin[T]]:
        """Return every plug-in of this kind, in the order of the names, also those that cannot be used."""
        return [plugin for name in entry_names(self.group) for plugin in self._named(name)]

    def listed(self) -> list[tuple[str, str]]:
        """Return the name of every plug-in with what it is, or why it cannot be used, and the package that it is of."""
        return [
            (one.name, one.told if one.adds is None else f"{self.line(one.adds)} (of {one.package})")
            for one in self.plugins()
        ]

    def _named(self, name: str) -> tuple[Plugin[T], ...]:
        return _plugins(self, name, tuple(sys.path))


@cache
def _plugins(kind: PluginKind[T], name: str, path: tuple[str, ...]) -> tuple[Plugin[T], ...]:
    """Return the plug-ins of a name: one, or none of which any is used, as where it claims what another one does."""
    found, claims = _by_name(kind, name, path), kind.claims
    if claims is None or len(found) != 1 or found[0].adds is None:
        return found
    mine, claimed = found[0], claims(found[0].adds)
    for entry in _entries(path):
        if entry.group != kind.group or entry.name == name:
            continue
        for other in _by_name(kind, entry.name, path):
            shared = [] if other.adds is None else [one for one in claimed if one in claims(other.adds)]
            if shared:
                packages = " and ".join(dict.fromkeys(sorted((mine.package, other.package))))
                why = f"'{name}' and '{other.name}' of {packages} both have {shared[0]}; uninstall one of them"
                return (Plugin(name, mine.package, None, why),)
    return found


@cache
def _by_name(kind: PluginKind[T], name: str, path: tuple[str, ...]) -> tuple[Plugin[T], ...]:
    """Return the plug-ins of a name, whatever others claim. Nothing of a package is imported twice."""
    entries = [one for one in _entries(path) if one.group == kind.group and one.name == name]
    packages = [_package(entry) for entry in entries]
    if name in kind.built_in():
        return tuple(Plugin(name, one, None, f"leafcut already has a {kind.noun} of this name") for one in packages)
    if len(entries) > 1:
        why = f"{' and '.join(packages)} both have a {kind.noun} of this name; uninstall one of them"
        return tuple(Plugin(name, one, None, why) for one in packages)
    return tuple(_loaded(kind, entry) for entry in entries)


def _loaded(kind: PluginKind[T], entry: EntryPoint) -> Plugin[T]:
    try:
        return Plugin(entry.name, _package(entry), kind.take(entry.name, entry.load()))
    except (Exception, SystemExit) as problem:  # whatever a stranger's module does
        return Plugin(entry.name, _package(entry), None, reason(problem))


def entry_names(group: str) -> tuple[str, ...]:
    """Return the names of the entry points of a group, in order; none where the group is empty."""
    found = _entries(tuple(sys.path)) if group else ()
    return tuple(dict.fromkeys(entry.name for entry in found if entry.group == group))


def reason(problem: BaseException) -> str:
    """Return what a stranger's code raised, in a line; of an error of leafcut's own its message."""
    if isinstance(problem, LeafcutError):
        return str(problem)
    words = shown(str(problem), 120)
    return f"{type(problem).__name__}: {words}" if words else type(problem).__name__


def file_of(name: str, found: Any) -> Path:
    """Return the TOML file that an entry point stands for, by what it names.

    A package or a module stands for the file ``NAME.toml`` in its folder, a path for itself, and a function for the
    path that it returns.

    Raises
    ------
    TypeError
        It names something else.
    """
    if isinstance(found, ModuleType):
        from importlib.resources import files

        return Path(str(files(found))) / f"{name}.toml"
    path = found() if callable(found) else found
    if isinstance(path, str) or hasattr(path, "joinpath"):  # a resource of a package is like a path
        return Path(str(path))
    raise TypeError(f"a path was expected, not {type(path).__name__}")


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else entry.module


@cache
def _entries(path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Return the entry points of all our groups by their names, of packages that lie on a search path.

    Of a package that lies there twice the first counts, as for importing it.
    """
    if not any(_names_ours(folder) for folder in path):
        return ()  # what reads them takes longer to import than all that most commands do
    from importlib.metadata import distributions

    found: dict[str, list[EntryPoint]] = {}
    for package in distributions(path=list(path)):
        try:
            ours = [entry for entry in package.entry_points if entry.group.startswith(_OURS)]
            if ours:
                found.setdefault(package.name, ours)
        except Exception:  # what it says of itself cannot be read: it adds nothing
            continue
    return tuple(sorted((one for ours in found.values() for one in ours), key=lambda one: (one.group, one.name)))


def _names_ours(folder: str) -> bool:
    """Return whether a package in a folder of the search path may have an entry point of one of our groups."""
    return any(f"[{_OURS}".encode() in _content(told) for told in Path(folder).glob("*-info/entry_points.txt"))


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError:
        return b""
