"""HTML head of the page: style sheets, scripts, and preloading of the modules."""

from __future__ import annotations

import re
from functools import cache

from nicegui import __version__ as nicegui_version
from nicegui.dependencies import esm_modules

from leafcut.studio.drawing.canvas import STATIC
from leafcut.studio.drawing.program_text import ProgramText

LEAF = (
    '<svg viewBox="0 0 24 24" aria-hidden="true"><path d="M20 4C9 4 4 9 4 15c0 1.8.5 3.5 1 5 1.5.5 3.2 1 5 1 6 0 10-6 '
    '10-17z"></path><path d="M5 20 14 10"></path><path d="M20 4l-3.5 3.5"></path></svg>'
)

_STYLES = ("colours.css", "studio.css", "room.css", "works.css", "figures.css", "machine.css")
#: Only the first script must run before painting, as it sets the light or dark theme.
_SCRIPTS = ("shell.js", "focus.js", "badge.js", "machine_stop.js", "picture.js")
_IMPORT = re.compile(r'from "(?:\./|leafcut-canvas/)([\w.]+)"')


@cache
def head() -> str:
    """Return the head as HTML."""
    # Browsers cache by address, so a newer file gets a new address.
    newest = int(max(file.stat().st_mtime for file in STATIC.iterdir()))
    styles = [f'<link rel="stylesheet" href="/static/{name}?{newest}">' for name in _STYLES]
    scripts = [
        f'<script src="/static/{name}?{newest}"{" defer" if number else ""}></script>'
        for number, name in enumerate(_SCRIPTS)
    ]
    key = next(key for key, module in esm_modules.items() if module.name == "leafcut-canvas")
    # Without preloading, a browser would load them one after the other, as each imports the next.
    root = f"/_nicegui/{nicegui_version}/esm/{key}"
    addresses = [f"{root}/{name}" for name in imported()]
    if ProgramText.component is not None:  # loaded only when a program is opened
        addresses.append(f"/_nicegui/{nicegui_version}/components/{ProgramText.component.key}")
    modules = [f'<link rel="modulepreload" href="{address}">' for address in addresses]
    return "".join([*styles, *scripts, *modules])


def first_bar() -> str:
    """Return the HTML of the top bar, painted until the page has loaded."""
    return f'<div class="boot" aria-hidden="true"><div class="mark">{LEAF}<b>leafcut</b><span>studio</span></div></div>'


def imported() -> list[str]:
    """Return the names of all imported modules."""
    names = {name for file in STATIC.glob("*.js") for name in _IMPORT.findall(file.read_text(encoding="utf-8"))}
    return sorted(names)
