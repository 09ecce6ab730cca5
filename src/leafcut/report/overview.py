"""The figures of the report in plain values, for pages that set them themselves: the studio's summary."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from leafcut.report.wording import Said

if TYPE_CHECKING:
    from leafcut.model.outcome import Outcome
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


def overview_as_json(outcome: Outcome) -> dict[str, Any]:
    """Return the figures of an outcome; words as ``{"words": template, "values": {name: words}}``."""
    found = outcome.shown.overview()
    times = {
        "kinds": found["times"]["kinds"],
        "rows": [{k: row[k] for k in ("name", "seconds", "total")} for row in found["times"]["rows"]],
    }
    return {
        "tiles": [dict(zip(("name", "figure", "words"), map(_plain, tile), strict=True)) for tile in found["tiles"]],
        "times": _plain(times),
        "parts": _plain(found["parts"]),
        "norms": _plain(found["norms"]),
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Said):
        return {"words": value.template, "values": {name: _plain(v) for name, v in value.values.items()}}
    if isinstance(value, dict):
        return {name: _plain(v) for name, v in value.items()}
    return [_plain(v) for v in value] if isinstance(value, list | tuple) else value
