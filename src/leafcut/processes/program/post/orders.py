"""Orders of a section's chains, checked before anything is written in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.errors import PostError
from leafcut.model.sequence import Section


def checked_order(section: Section, order: ArrayLike) -> NDArray[np.int64]:
    """Return the order as an array, if it has each chain of the section once and keeps its precedence.

    ~k stands for chain k made from its other end, if that is allowed.

    Raises
    ------
    PostError
        It does not; the message names the lines.
    """
    given = np.asarray(order, dtype=np.int64)
    chosen = np.where(given < 0, ~given, given)
    if chosen.shape != (len(section.chains),) or not np.array_equal(np.sort(chosen), np.arange(len(chosen))):
        raise PostError(
            f"line {section.chains[0].line}: the order does not have each of {len(section.chains)} pieces once"
        )
    fixed = [section.chains[k].line for k in chosen[given < 0].tolist() if not section.chains[k].reversible]
    if fixed:
        raise PostError(f"line {fixed[0]}: the piece of work there cannot be reversed")
    place = np.empty_like(chosen)
    place[chosen] = np.arange(len(chosen))
    for before, after in section.precedence.tolist():
        if place[before] > place[after]:
            one, other = section.chains[before].line, section.chains[after].line
            raise PostError(f"the piece at line {other} would come before the one at line {one}, which must be first")
    return given
