"""`dataclass` as in the standard library, whose methods are made when they are first needed.

The standard library writes and compiles up to six methods for each class as soon as it is imported: half a millisecond,
for some two hundred classes in every run, most of which a job never makes an object of. Here the fields are collected
at once and the rest waits. What is asked for with other words than `frozen` and `eq` goes to the standard library.
"""

from __future__ import annotations

import dataclasses
import itertools
import operator
import reprlib
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(cls=None, /, **words):
        """Make a class a dataclass, as `dataclasses.dataclass` does."""
        made = _light if not words.keys() - {"frozen", "eq"} else dataclasses.dataclass
        return (lambda later: made(later, **words)) if cls is None else made(cls, **words)


__all__ = ["dataclass"]

_MISSING = dataclasses.MISSING

#: Stands for a value that is made anew for every object.
_MADE = object()


def _light(cls: Any, frozen: bool = False, eq: bool = True) -> Any:
    """Collect the fields, and put in place what makes the methods later."""
    bases: list[Any] = [base for base in cls.__mro__[1:] if dataclasses.is_dataclass(base)]
    of_frozen = any(base.__dataclass_params__.frozen for base in bases)
    if bases and of_frozen != frozen:
        return dataclasses.dataclass(frozen=frozen, eq=eq)(cls)  # which refuses it
    own_eq, own_hash, own_doc = "__eq__" in cls.__dict__, cls.__dict__.get("__hash__", _MISSING), cls.__doc__
    cls.__doc__ = own_doc or cls.__name__  # else its signature is asked for
    cls = dataclasses.dataclass(init=False, repr=False, eq=False, frozen=of_frozen)(cls)
    if _unordered(cls):
        return dataclasses.dataclass(frozen=frozen, eq=eq)(cls)  # which refuses it, too
    params = cls.__dataclass_params__
    params.init = params.repr = True
    params.eq, params.frozen = eq, frozen
    if "__init__" not in cls.__dict__:
        cls.__init__, cls.__signature__ = _init_later(cls), _Signature()
    if "__repr__" not in cls.__dict__:
        cls.__repr__ = _repr_of(cls)
    if frozen and not of_frozen:
        cls.__setattr__, cls.__delattr__ = (
            _refusing(cls, "__setattr__", "assign to"),
            _refusing(cls, "__delattr__", "delete"),
        )
    if eq:
        if not own_eq:
            cls.__eq__ = _eq_of(cls)
        if own_hash is _MISSING or (own_hash is None and own_eq):
            cls.__hash__ = _hash_of(cls) if frozen else None
    return cls


def _unordered(cls: Any) -> bool:
    """Return whether a field that must be given follows one that need not be."""
    given = [one for one in dataclasses.fields(cls) if one.init]
    needed = [one.default is _MISSING and one.default_factory is _MISSING for one in given]
    return any(later and not before for before, later in itertools.pairwise(needed))


class _Signature:
    """Asked for the signature of a class, makes the method that tells it."""

    def __get__(self, _: object, cls: Any) -> Any:
        for base in cls.__mro__:
            if getattr(base.__dict__.get("__init__"), "waits", False):
                _make_init(base)
        raise AttributeError("__signature__")


def _init_later(cls: Any) -> Callable[..., None]:
    def __init__(self: Any, *arguments: Any, **named: Any) -> None:
        _make_init(cls)(self, *arguments, **named)

    __init__.waits = True  # type: ignore[attr-defined]
    return __init__


def _make_init(cls: Any) -> Callable[..., None]:
    """Write, compile and set the method that takes the values of an object's fields."""
    frozen = cls.__dataclass_params__.frozen
    known: dict[str, Any] = {"_made": _MADE, "_set": object.__setattr__}
    parameters, lines, types = ["self"], [], {}
    for one in dataclasses.fields(cls):
        name, value = one.name, one.name
        if one.default_factory is not _MISSING:
            known[f"_new_{name}"] = one.default_factory
            value = f"_new_{name}() if {name} is _made else {name}" if one.init else f"_new_{name}()"
        elif not one.init:
            continue
        if one.init:
            types[name] = one.type
            usual = "" if one.default is _MISSING else f"=_usual_{name}"
            known[f"_usual_{name}"] = one.default
            parameters.append(name + ("=_made" if one.default_factory is not _MISSING else usual))
        lines.append(f'_set(self, "{name}", {value})' if frozen else f"self.{name} = {value}")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    text = "\n    ".join([f"def __init__({', '.join(parameters)}):", *(lines or ["pass"])])
    exec(text, known)
    made: Any = known["__init__"]
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    made.__annotations__ = types | {"return": None}
    cls.__init__ = made
    return made  # type: ignore[no-any-return]


def _refusing(cls: Any, method: str, what: str) -> Callable[..., None]:
    """Return what refuses to change an object that is frozen."""

    def refuse(self: Any, name: str, *value: Any) -> None:
        if type(self) is cls or name in cls.__dataclass_fields__:
            raise dataclasses.FrozenInstanceError(f"cannot {what} field {name!r}")
        getattr(super(cls, self), method)(name, *value)

    return refuse


def _repr_of(cls: Any) -> Callable[[Any], str]:
    @reprlib.recursive_repr()
    def __repr__(self: Any) -> str:
        shown = (f"{one.name}={getattr(self, one.name)!r}" for one in dataclasses.fields(cls) if one.repr)
        return f"{self.__class__.__qualname__}({', '.join(shown)})"

    return __repr__


def _values(names: Sequence[str]) -> Callable[[Any], tuple[Any, ...]]:
    """Return what takes the values of fields from an object, always as a tuple."""
    if len(names) > 1:
        return operator.attrgetter(*names)
    return lambda one: tuple(getattr(one, name) for name in names)


def _eq_of(cls: Any) -> Callable[[Any, object], bool]:
    values: Any = None

    def __eq__(self: Any, other: object) -> bool:
        nonlocal values
        if other.__class__ is not self.__class__:
            return NotImplemented
        if values is None:
            values = _values([one.name for one in dataclasses.fields(cls) if one.compare])
        return bool(values(self) == values(other))

    return __eq__


def _hash_of(cls: Any) -> Callable[[Any], int]:
    values: Any = None

    def __hash__(self: Any) -> int:
        nonlocal values
        if values is None:
            every = dataclasses.fields(cls)
            values = _values([one.name for one in every if (one.compare if one.hash is None else one.hash)])
        return hash(values(self))

    return __hash__
