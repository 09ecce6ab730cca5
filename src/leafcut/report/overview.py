"""The figures of the report in plain values, for pages that set them themselves: the studio's summary."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from leafcut.report.views import PageRow

#: Name, figure, and the words under it.
Tile = tuple[str, str, str]


def overview(
    tiles: Sequence[Tile] = (), times: PageRow | None = None, parts: PageRow | None = None,
    norms: PageRow | None = None,
) -> PageRow:  # fmt: skip
    """Return what `ProcessReport.overview` tells: figures, seconds by kind (`views.stacked`), parts, and norms."""
    return {
        "tiles": list(tiles),
        "times": times or {"kinds": [], "rows": []},
        "parts": parts or {"rows": [], "feet": []},
        "norms": norms or {"rows": []},
    }
