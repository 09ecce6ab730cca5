"""Orders of a section's pieces, checked before anything is written in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from leafcut.errors import PostError
from leafcut.model.sequence import Section


def checked_order(section: Section, order: ArrayLike) -> NDArray[np.int64]:
    """Return the order as an array, if it has each piece of the section once and keeps its precedence.

    ~k stands for piece k made from its other end, if that is allowed.

    Raises
    ------
    PostError
        It does not; the message names the lines.
    """
    given = np.asarray(order, dtype=np.int64)
    chosen = np.where(given < 0, ~given, given)
    if chosen.shape != (len(section.pieces),) or not np.array_equal(np.sort(chosen), np.arange(len(chosen))):
        raise PostError(
            f"line {section.pieces[0].line}: the order does not have each of {len(section.pieces)} pieces once"
        )
    fixed = [section.pieces[k].line for k in chosen[given < 0].tolist() if not section.pieces[k].reversible]
    if fixed:
        raise PostError(f"line {fixed[0]}: the piece of work there cannot be reversed")
    place = np.empty_like(chosen)
    place[chosen] = np.arange(len(chosen))
    for before, after in section.precedence.tolist():
        if place[before] > place[after]:
            one, other = section.pieces[before].line, section.pieces[after].line
            raise PostError(f"the piece at line {other} would come before the one at line {one}, which must be first")
    return given
