"""Find plug-ins in other packages through their entry points.

Plug-ins add readers, processes, algorithms, dialects and machines. leafcut only imports a plug-in package when it lists
the plug-ins or when the user requests one by name. An error in one plug-in does not affect the others.
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

from leafcut.errors import LeafcutError, OptionError, printable
from leafcut.message import Message

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")

_GROUP_PREFIX = "leafcut."


def lazy_function(place: str) -> Callable[..., Any]:
    """Return a function that imports ``module:function`` on its first call and then calls it."""

    def call(*arguments: Any) -> Any:
        return resolve_name(place)(*arguments)

    return call


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """A plug-in: its name, its package, and the object that it adds, or the `error` that prevents its use."""

    name: str
    package: str
    adds: T | None
    error: str = ""

    @property
    def refusal(self) -> str:
        """The package, and the reason why the plug-in cannot be used, as a line in a list of plug-ins."""
        return Message("plug-in of {} that cannot be used ({})", self.package, self.error)


@dataclass(frozen=True)
class PluginKind(Generic[T]):
    """A kind of plug-in: its name (``machine``) and its entry-point group (``leafcut.machines``).

    Attributes
    ----------
    built_in
        Names that a plug-in cannot replace.
    take
        Function that takes a name and the entry point's object, and returns the object that leafcut uses. It may raise
        any exception.
    line
        Function that describes the object in a list.
    claims
        Function that returns the names that must be unique among the plug-ins of this kind, such as
        ``--engraving-depth``.
    """

    noun: str
    group: str
    built_in: Callable[[], Collection[str]]
    take: Callable[[str, Any], T]
    line: Callable[[T], str]
    claims: Callable[[T], Collection[str]] | None = None

    def names(self) -> tuple[str, ...]:
        """Return the sorted names of the plug-ins, without importing their packages."""
        entry_point_names = entry_names(self.group)
        built_in_names = self.built_in() if entry_point_names else ()
        return tuple(name for name in entry_point_names if name not in built_in_names)

    def load(self, name: str) -> T:
        """Load the object that a plug-in adds.

        Raises
        ------
        OptionError
            The name is unknown, or the plug-in cannot be used.
        """
        for plugin in self._plugins_named(name):
            if plugin.adds is not None:
                return plugin.adds
            raise OptionError("the {} '{}' is a {}", self.noun, name, plugin.refusal)
        raise OptionError("unknown {} '{}'", self.noun, name)

    def plugins(self) -> list[Plugin[T]]:
        """Return all plug-ins of this kind, sorted by name. Plug-ins that cannot be used are included."""
        return [plugin for name in entry_names(self.group) for plugin in self._plugins_named(name)]

    def names_and_descriptions(self) -> list[tuple[str, str]]:
        """Return the name and description of each plug-in. For an unusable plug-in, the description is the reason."""
        return [
            (plugin.name, plugin.refusal if plugin.adds is None else f"{self.line(plugin.adds)} (of {plugin.package})")
            for plugin in self.plugins()
        ]

    def _plugins_named(self, name: str) -> tuple[Plugin[T], ...]:
        return _checked_plugins(self, name, tuple(sys.path))


@cache
def _checked_plugins(kind: PluginKind[T], name: str, path: tuple[str, ...]) -> tuple[Plugin[T], ...]:
    """Return the plug-ins with this name. A plug-in that claims the same option as another plug-in gets an error."""
    plugins, claims = _plugins_without_conflict_check(kind, name, path), kind.claims
    if claims is None or len(plugins) != 1 or plugins[0].adds is None:
        return plugins
    plugin, claimed = plugins[0], claims(plugins[0].adds)
    for entry in _entry_points(path):
        if entry.group != kind.group or entry.name == name:
            continue
        for other_plugin in _plugins_without_conflict_check(kind, entry.name, path):
            shared = (
                [] if other_plugin.adds is None else [claim for claim in claimed if claim in claims(other_plugin.adds)]
            )
            if shared:
                packages = " and ".join(dict.fromkeys(sorted((plugin.package, other_plugin.package))))
                reason = Message(
                    "the plug-ins '{}' and '{}' of {} both have {}; uninstall one of them",
                    name,
                    other_plugin.name,
                    packages,
                    shared[0],
                )
                return (Plugin(name, plugin.package, None, reason),)
    return plugins


@cache
def _plugins_without_conflict_check(kind: PluginKind[T], name: str, path: tuple[str, ...]) -> tuple[Plugin[T], ...]:
    """Return the plug-ins with this name, without checking for conflicts with other plug-ins.

    Each package is imported only once.
    """
    entries = [entry for entry in _entry_points(path) if entry.group == kind.group and entry.name == name]
    packages = [_package_name(entry) for entry in entries]
    if name in kind.built_in():
        return tuple(
            Plugin(name, package, None, Message("leafcut already has a {} of this name", kind.noun))
            for package in packages
        )
    if len(entries) > 1:
        reason = Message("{} both have a {} of this name; uninstall one of them", " and ".join(packages), kind.noun)
        return tuple(Plugin(name, package, None, reason) for package in packages)
    return tuple(_load_entry(kind, entry) for entry in entries)


def _load_entry(kind: PluginKind[T], entry: EntryPoint) -> Plugin[T]:
    try:
        return Plugin(entry.name, _package_name(entry), kind.take(entry.name, entry.load()))
    except (Exception, SystemExit) as problem:  # a module of another package may raise anything
        return Plugin(entry.name, _package_name(entry), None, exception_line(problem))


def entry_names(group: str) -> tuple[str, ...]:
    """Return the sorted names of the entry points in a group. An empty `group` has no entry points."""
    entries = _entry_points(tuple(sys.path)) if group else ()
    return tuple(dict.fromkeys(entry.name for entry in entries if entry.group == group))


def exception_line(problem: BaseException) -> str:
    """Format an exception as a single line. The line includes the type, except for leafcut's own errors."""
    if isinstance(problem, LeafcutError):
        return str(problem)
    words = printable(str(problem), 120)
    return f"{type(problem).__name__}: {words}" if words else type(problem).__name__


def entry_point_file(name: str, loaded: Any) -> Path:
    """Return the path of the TOML file that an entry point refers to.

    The entry point may be a package or module (its folder contains ``NAME.toml``), a path, or a function that returns a
    path. The function raises `TypeError` for anything else.
    """
    if isinstance(loaded, ModuleType):
        from importlib.resources import files

        return Path(str(files(loaded))) / f"{name}.toml"
    path = loaded() if callable(loaded) else loaded
    if isinstance(path, str) or hasattr(path, "joinpath"):  # a resource of a package resembles a path
        return Path(str(path))
    raise TypeError(f"a path was expected, not {type(path).__name__}")


def _package_name(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else entry.module


@cache
def _entry_points(path: tuple[str, ...]) -> tuple[EntryPoint, ...]:
    """Return leafcut's entry points on a search path, sorted by group and name.

    If several packages have the same name, the first package wins, as in an import.
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
