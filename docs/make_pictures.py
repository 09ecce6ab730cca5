"""Makes the pictures of the README: the path of a plate before and after."""

from __future__ import annotations

from pathlib import Path

import leafcut
from leafcut.report.page import path_svg

HERE = Path(__file__).parent


def main() -> None:
    """Write docs/pictures/before.svg and after.svg."""
    outcome = leafcut.optimize("example:plate-70", thickness="0.25in")
    for which in ("before", "after"):
        (HERE / "pictures" / f"{which}.svg").write_text(path_svg(outcome, which), encoding="utf-8")


if __name__ == "__main__":
    main()
