"""The HTML head of the page: style sheets and scripts."""

from __future__ import annotations

from functools import cache

from leafcut.studio.drawing.canvas import STATIC

LEAF = (
    '<svg viewBox="0 0 24 24" aria-hidden="true"><path d="M20 4C9 4 4 9 4 15c0 1.8.5 3.5 1 5 1.5.5 3.2 1 5 1 6 0 10-6 '
    '10-17z"></path><path d="M5 20 14 10"></path><path d="M20 4l-3.5 3.5"></path></svg>'
)

_STYLES = ("colours.css", "studio.css", "room.css", "works.css", "figures.css", "machine.css")
#: Must run before painting, because it sets the light or dark theme.
_FIRST_SCRIPT = "shell.js"
_MODULES = ("focus.js", "badge.js", "machine_stop.js", "picture.js")


@cache
def head() -> str:
    """Return the style sheets and scripts as HTML."""
    # Browsers cache by address, so a newer file gets a new address.
    newest = int(max(file.stat().st_mtime for file in STATIC.iterdir()))
    styles = [f'<link rel="stylesheet" href="/static/{name}?{newest}">' for name in _STYLES]
    first = f'<script src="/static/{_FIRST_SCRIPT}?{newest}"></script>'
    modules = [f'<script type="module" src="/static/{name}?{newest}"></script>' for name in _MODULES]
    return "".join([*styles, first, *modules])


def first_bar() -> str:
    """Return the HTML of the top bar that is visible until the page has loaded."""
    return f'<div class="boot" aria-hidden="true"><div class="mark">{LEAF}<b>leafcut</b><span>studio</span></div></div>'
