"""One rule, many cases: a test that runs all of them and tells every one that fails."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Any

import pytest

#: What a case may fail with: an assertion, any other error, or what `pytest.raises` and `pytest.fail` raise.
FAULTS = (Exception, pytest.fail.Exception)

#: So many letters of a fault are told; of the first one all, by its traceback.
MOST = 300


class Faults(AssertionError):
    """What went wrong: the words of each case, and its fault."""

    def __init__(self, faults: list[tuple[str, BaseException]]) -> None:
        self.faults = faults
        lines = [f"[{name}] {type(fault).__name__}: {str(fault)[:MOST]}" for name, fault in faults]
        super().__init__("\n".join([f"{len(faults)} of the cases:", *lines]))


def every(
    names: str, cases: Iterable[Any], ids: Callable[[Any], object] | Iterable[object] | None = None
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Run a test with each of some values of its arguments, as `pytest.mark.parametrize` would, but as one test.

    For rules whose cases cost next to nothing: the cases share what other fixtures give, and all that fail are told
    together, each by its values, by what `ids` makes of each value, or by what `ids` lists. Where there is no case, as
    of files that are not here, it is skipped, as pytest would.
    """
    arguments = [name.strip() for name in names.split(",")]
    table = [tuple(case) if len(arguments) > 1 else (case,) for case in cases]
    assert all(len(case) == len(arguments) for case in table)
    if ids is None or callable(ids):
        titles = ["-".join(_words(value if ids is None else ids(value)) for value in case) for case in table]
    else:
        titles = [_words(title) for title in ids]

    def fold(test: Callable[..., None]) -> Callable[..., None]:
        def all_cases(**fixtures: Any) -> None:
            if not table:
                pytest.skip("there are no cases")
            found: list[tuple[str, BaseException]] = []
            for name, case in zip(titles, table, strict=True):
                try:
                    test(**dict(zip(arguments, case, strict=True)), **fixtures)
                except Faults as faults:
                    found += [(f"{name}-{inner}", fault) for inner, fault in faults.faults]
                except FAULTS as fault:
                    found.append((name, fault))
            if found:
                raise Faults(found) from found[0][1]

        own = inspect.signature(test)
        assert set(arguments) <= set(own.parameters), f"{test.__name__} takes no {arguments}"
        rest = [p.replace(kind=p.KEYWORD_ONLY) for p in own.parameters.values() if p.name not in arguments]
        all_cases.__signature__ = own.replace(parameters=rest)  # type: ignore[attr-defined]
        all_cases.__name__, all_cases.__doc__, all_cases.__module__ = test.__name__, test.__doc__, test.__module__
        return all_cases

    return fold


def _words(value: Any) -> str:
    return " ".join(str(getattr(value, "__name__", value))[:80].split())
