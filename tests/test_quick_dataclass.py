"""The quick `dataclass` is that of the standard library, whatever is asked of it: each case is made by both."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import math
import pickle
import subprocess
import sys
from collections.abc import Callable
from dataclasses import field
from typing import Any, ClassVar

import pytest

from leafcut import quick_dataclass

Make = Callable[..., Callable[[Any], Any]]


#: The quick one and that of the standard library, which says what is right.
MAKERS: tuple[Make, Make] = (quick_dataclass.dataclass, dataclasses.dataclass)


def plain(make: Make, **words: Any) -> Any:
    @make(**words)
    class Thing:
        """A thing."""

        kinds: ClassVar[int] = 3
        a: int
        b: float = 2.0
        c: list[int] = field(default_factory=list)
        d: str = field(default="d", compare=False)
        e: str = field(default="e", repr=False)
        f: int = field(default=7, init=False)
        g: list[int] = field(default_factory=list, init=False)
        h: int = field(default=0, hash=False)

    return Thing


def checked(make: Make, **words: Any) -> Any:
    @make(**words)
    class Thing:
        """A thing that looks at what it is given."""

        a: int
        b: int = 0

        def __post_init__(self) -> None:
            if self.a < 0:
                raise ValueError(f"{self.a} {self.b}")

        def __repr__(self) -> str:
            return "own"

        def __eq__(self, other: object) -> bool:
            return isinstance(other, type(self))

        def __hash__(self) -> int:
            return 5

    return Thing


def inherited(make: Make, **words: Any) -> Any:
    @make(**words)
    class Below(plain(make, **words)):  # type: ignore[misc]
        """More of it."""

        b: float = 5.0
        z: int = 9

    return Below


def not_made(make: Make, **words: Any) -> Any:
    class Below(plain(make, **words)):  # type: ignore[misc]
        """No dataclass itself."""

    return Below


def empty(make: Make, **words: Any) -> Any:
    @make(**words)
    class Thing:
        """Nothing in it."""

    return Thing


def one(make: Make, **words: Any) -> Any:
    @make(**words)
    class Thing:
        """One field."""

        a: Any = math.nan

    return Thing


CLASSES = (plain, checked, inherited, not_made, empty, one)
WORDS = ({}, {"frozen": True}, {"eq": False}, {"frozen": True, "eq": False}, {"frozen": True, "slots": True})


def told(do: Callable[[], Any]) -> str:
    """Return what comes of it: what is shown, or the error."""
    try:
        return repr(do())
    except Exception as problem:
        return f"{type(problem).__name__}: {problem}"


ASKED: dict[str, Callable[[Any], Any]] = {
    "made": lambda cls: cls(1),
    "made in full": lambda cls: cls(1, 3.0, [4], d="x"),
    "made of names": lambda cls: cls(a=1, b=2),
    "of nothing": lambda cls: cls(),
    "of too much": lambda cls: cls(*range(20)),
    "of what it has not": lambda cls: cls(1, q=2),
    "refused": lambda cls: cls(-1, 4),
    "equal": lambda cls: [cls(1) == cls(1), cls(1) == cls(2), cls(1) == 1, cls(1) != cls(1)],
    "itself": lambda cls: [thing == thing for thing in [cls()]],  # noqa: PLR0124
    "equal but for what does not count": lambda cls: cls(1, d="x") == cls(1, d="y"),
    "hash": lambda cls: [hash(a) == hash(b) for a, b in [(cls(1, 2.0, ()), cls(1, 2.0, (), h=3))]],
    "whether it has a hash": lambda cls: cls.__hash__ is None,
    "set": lambda cls: setattr(cls(1), "a", 2),
    "set what it has not": lambda cls: setattr(cls(1), "q", 2),
    "removed": lambda cls: delattr(cls(1), "a"),
    "no sharing": lambda cls: cls(1).c is cls(1).c,
    "replaced": lambda cls: dataclasses.replace(cls(1), a=4),
    "as a dict": lambda cls: dataclasses.asdict(cls(1)),
    "fields": lambda cls: [(f.name, f.type, f.init, f.compare) for f in dataclasses.fields(cls)],
    "signature": lambda cls: [p.replace(default=None) for p in inspect.signature(cls).parameters.values()],
    "defaults": lambda cls: [(p.name, p.default) for p in inspect.signature(cls).parameters.values() if p.name != "c"],
    "copied": lambda cls: copy.copy(cls(1)) == cls(1),
    "copied deeply": lambda cls: copy.deepcopy(cls(1)),
    "matched by place": lambda cls: cls.__match_args__,
    "doc": lambda cls: cls.__doc__,
    "of the class": lambda cls: [cls.b, cls.f, cls.kinds],
    "inherited from, frozen": lambda cls: dataclasses.dataclass(frozen=True)(type("Sub", (cls,), {}))(1),
    "inherited from": lambda cls: dataclasses.dataclass(type("Sub", (cls,), {}))(1),
}


@pytest.mark.parametrize("words", WORDS, ids=str)
@pytest.mark.parametrize("build", CLASSES, ids=lambda build: build.__name__)
def test_it_does_what_that_of_the_standard_library_does(build: Callable[..., Any], words: dict[str, Any]) -> None:
    for asked, do in ASKED.items():
        mine, theirs = (told(lambda: do(build(make, **words))) for make in MAKERS)  # noqa: B023
        assert mine == theirs, asked


@pytest.mark.parametrize("words", WORDS, ids=str)
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_an_inherited_class_may_be_used_before_or_after_the_one_above(words: dict[str, Any], order: Any) -> None:
    mine, theirs = (
        [told(lambda: cls(a=k)) for cls in [(cls, cls.__mro__[1])[o] for o in order] for k in (1, 2)]  # noqa: B023
        for cls in (inherited(make, **words) for make in MAKERS)
    )
    assert mine == theirs


def test_it_refuses_what_the_standard_library_refuses() -> None:
    """A frozen class below one that is not, and the other way about; a field without a default behind one with."""

    def late(make: Make) -> Any:
        return make()(type("Late", (), {"__annotations__": {"a": "int", "b": "int"}, "a": 1}))

    for build in (
        late,
        lambda make: make(frozen=True)(type("Sub", (one(make),), {})),
        lambda make: make()(type("Sub", (one(make, frozen=True),), {})),
        lambda make: make()(type("Shared", (), {"__annotations__": {"a": "list"}, "a": []})),
    ):
        mine, theirs = (told(lambda: build(make)) for make in MAKERS)  # noqa: B023
        assert mine == theirs
        assert "Error" in mine


@quick_dataclass.dataclass(frozen=True)
class Kept:
    """One that pickle finds by its name."""

    a: int
    b: tuple[int, ...] = ()


def test_objects_go_to_other_processes() -> None:
    """Also where the class has made none there."""
    assert pickle.loads(pickle.dumps(Kept(3, (4,)))) == Kept(3, (4,))
    assert not isinstance(Kept.__init__, type(object.__init__))


def test_it_holds_itself() -> None:
    thing = plain(quick_dataclass.dataclass)(1)
    thing.c.append(thing)
    assert repr(thing).count("...") == 1


def test_no_method_is_compiled_before_it_is_asked_for() -> None:
    """The reason for it: an import of two classes compiles nothing."""
    code = """
import builtins, dataclasses
from leafcut.quick_dataclass import dataclass
run = []
real, builtins.exec = builtins.exec, lambda *given: (run.append(given), real(*given))
@dataclass(frozen=True)
class A:
    "A."
    a: int = 1
@dataclass
class B:
    "B."
    a: int = 1
print(len(run), end=" ")
assert A(2) == A(2) and {A(2)} == {A(2)} and repr(B()) == "B(a=1)"
print(len(run))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["0", "2"]
