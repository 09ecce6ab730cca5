"""Plug-ins of other packages: readers, processes, algorithms, dialects and machines, found by entry points.

A package is imported only when it is listed or requested by name. Its errors do not affect anything else.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from pkgutil import resolve_name
from types import ModuleType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from leafcut.errors import LeafcutError, OptionError, shown

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")

_GROUP_PREFIX = "leafcut."


def on_call(place: str) -> Callable[..., Any]:
    """Return the function ``module:function``; its module is imported at the first call, so that only users load it."""

    def call(*arguments: Any) -> Any:
        return resolve_name(place)(*arguments)

    return call


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """A plug-in with its name and package: the object that it adds, or the `error` that prevents its use."""

    name: str
    package: str
    adds: T | None
    error: str = ""

    @property
    def refusal(self) -> str:
        """Description for a list of plug-ins: the package, and why the plug-in cannot be used."""
        return f"plug-in of {self.package} that cannot be used ({self.error})"


@dataclass(frozen=True)
class PluginKind(Generic[T]):
    """One kind of plug-in: its name, ``machine``, and the group of its entry points, ``leafcut.machines``.

    No plug-in replaces a `built_in` name. `take` converts the name and the object of an entry point to the object that
    leafcut uses, and may raise any exception. `line` returns the description of that object for a list. `claims`
    returns its names that must be unique among plug-ins of this kind, such as ``--engraving-depth``.
    """

    noun: str
    group: str
    built_in: Callable[[], Collection[str]]
    take: Callable[[str, Any], T]
    line: Callable[[T], str]
    claims: Callable[[T], Collection[str]] | None = None

    def names(self) -> tuple[str, ...]:
        """Return the available names in order, without importing the packages."""
        entry_point_names = entry_names(self.group)
        built_in_names = self.built_in() if entry_point_names else ()
        return tuple(name for name in entry_point_names if name not in built_in_names)

    def load(self, name: str) -> T:
        """Return the object of a plug-in, whose name is from `names`; raise `OptionError` if it cannot be used."""
        for plugin in self._named(name):
            if plugin.adds is not None:
                return plugin.adds
            raise OptionError(f"the {self.noun} '{name}' is a {plugin.refusal}")
        raise OptionError(f"unknown {self.noun} '{name}'")

    def plugins(self) -> list[Plugin[T]]:
        """Return every plug-in of this kind in the order of the names, unusable ones included."""
        return [plugin for name in entry_names(self.group) for plugin in self._named(name)]

    def listed(self) -> list[tuple[str, str]]:
        """Return every plug-in: its name, and its description with the package, or the reason why it cannot be used."""
        return [
            (plugin.name, plugin.refusal if plugin.adds is None else f"{self.line(plugin.adds)} (of {plugin.package})")
            for plugin in self.plugins()
        ]

    def _named(self, name: str) -> tuple[Plugin[T], ...]:
        return _checked_plugins(self, name, tuple(sys.path))


@cache
def _checked_plugins(kind: PluginKind[T], name: str, path: tuple[str, ...]) -> tuple[Plugin[T], ...]:
    """Return the plug-ins with a name; a plug-in that shares a unique name with another plug-in has an error."""
    plugins, claims = _by_name(kind, name, path), kind.claims
    if claims is None or len(plugins) != 1 or plugins[0].adds is None:
        return plugins
    plugin, claimed = plugins[0], claims(plugins[0].adds)
    for entry in _entries(path):
        if entry.group != kind.group or entry.name == name:
            continue
        for other_plugin in _by_name(kind, entry.name, path):
            shared = (
                [] if other_plugin.adds is None else [claim for claim in claimed if claim in claims(other_plugin.adds)]
            )
            if shared:
                packages = " and ".join(dict.fromkeys(sorted((plugin.package, other_plugin.package))))
                reason = (
                    f"'{name}' and '{other_plugin.name}' of {packages} both have {shared[0]}; uninstall one of them"
                )
                return (Plugin(name, plugin.package, None, reason),)
    return plugins


@cache
def _by_name(kind: PluginKind[T], name: str, path: tuple[str, ...]) -> tuple[Plugin[T], ...]:
    """Return the plug-ins with a name, without comparing them with others. No package is imported twice."""
    entries = [entry for entry in _entries(path) if entry.group == kind.group and entry.name == name]
    packages = [_package(entry) for entry in entries]
    if name in kind.built_in():
        return tuple(
            Plugin(name, package, None, f"leafcut already has a {kind.noun} of this name") for package in packages
        )
    if len(entries) > 1:
        reason = f"{' and '.join(packages)} both have a {kind.noun} of this name; uninstall one of them"
        return tuple(Plugin(name, package, None, reason) for package in packages)
    return tuple(_load_entry(kind, entry) for entry in entries)


def _load_entry(kind: PluginKind[T], entry: EntryPoint) -> Plugin[T]:
    try:
        return Plugin(entry.name, _package(entry), kind.take(entry.name, entry.load()))
    except (Exception, SystemExit) as problem:  # a module of another package may raise anything
        return Plugin(entry.name, _package(entry), None, reason(problem))


def entry_names(group: str) -> tuple[str, ...]:
    """Return the names of the entry points of a group in order; none for an empty group."""
    entries = _entries(tuple(sys.path)) if group else ()
    return tuple(dict.fromkeys(entry.name for entry in entries if entry.group == group))


def reason(problem: BaseException) -> str:
    """Return the error of a plug-in in one line; for an error of leafcut, its message."""
    if isinstance(problem, LeafcutError):
        return str(problem)
    words = shown(str(problem), 120)
    return f"{type(problem).__name__}: {words}" if words else type(problem).__name__


def file_of(name: str, loaded: Any) -> Path:
    """Return the TOML file of an entry point; raise `TypeError` if it names something else.

    A package or a module has the file ``NAME.toml`` in its folder; a path is the file; a function returns its path.
    """
    if isinstance(loaded, ModuleType):
        from importlib.resources import files

        return Path(str(files(loaded))) / f"{name}.toml"
    path = loaded() if callable(loaded) else loaded
    if isinstance(path, str) or hasattr(path, "joinpath"):  # a resource of a package resembles a path
        return Path(str(path))
    raise TypeError(f"a path was expected, not {type(path).__name__}")


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else entry.module


@cache
def _entries(path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Return leafcut's entry points on a search path, sorted by group and name.

    Of several packages with the same name, the first counts, as in an import.
    """
    from importlib.metadata import distributions

    by_package: dict[str, list[EntryPoint]] = {}
    for package in distributions(path=list(path)):
        try:
            own_entries = [entry for entry in package.entry_points if entry.group.startswith(_GROUP_PREFIX)]
            if own_entries:
                by_package.setdefault(package.name, own_entries)
        except Exception:  # unreadable metadata
            continue
    return tuple(
        sorted(
            (entry for own_entries in by_package.values() for entry in own_entries),
            key=lambda entry: (entry.group, entry.name),
        )
    )
