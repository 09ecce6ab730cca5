"""Styles and templates for pages and drawings: the colour ramp of paths, style sheets, and Jinja templates."""

from __future__ import annotations

import base64
import hashlib
from importlib.resources import files
from typing import TYPE_CHECKING

from leafcut.report.drawing import RAMP

if TYPE_CHECKING:
    from jinja2 import Environment

RGB = tuple[int, int, int]

#: Colours from the first to the last move: violet, blue, teal. Lightness changes with hue, so people with any colour
#: vision can distinguish them. They also differ from the orange of cuts. The light ramp has a contrast of 3 to white.
_LIGHT: tuple[RGB, ...] = ((82, 18, 122), (31, 98, 192), (16, 150, 140))
_DARK: tuple[RGB, ...] = ((176, 120, 235), (106, 165, 255), (120, 235, 210))


def ramp_colour(stops: tuple[RGB, ...], part: float) -> str:
    """Interpolate between the colours `stops` at `part`, 0 to 1, and return the result as ``#rrggbb``."""
    place = min(max(part, 0.0), 1.0) * (len(stops) - 1)
    index = min(int(place), len(stops) - 2)
    low, high = stops[index], stops[index + 1]
    mixed = (round(a + (b - a) * (place - index)) for a, b in zip(low, high, strict=True))
    return "#" + "".join(f"{c:02x}" for c in mixed)


def ramp_css() -> str:
    """Return the CSS rules of the ramp classes ``r0``, ``r1`` …, for light and dark mode."""

    def rules(stops: tuple[RGB, ...]) -> str:
        colours = (ramp_colour(stops, i / (RAMP - 1)) for i in range(RAMP))
        return " ".join(f".drawing .r{i}, .sw .r{i} {{ stroke: {c}; }}" for i, c in enumerate(colours))

    return f"{rules(_LIGHT)}\n@media screen and (prefers-color-scheme: dark) {{ {rules(_DARK)} }}\n"


def style_sheet(name: str, package: str = "leafcut.report") -> str:
    """Return the text of a style sheet in a package."""
    return (files(package) / name).read_text(encoding="utf-8")


def page_templates(*packages: str) -> Environment:
    """Return the environment for the Jinja templates in packages.

    It escapes all values, except with the filter ``drawn``.
    """
    from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package, "") for package in packages]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    # Drawings and style sheets of leafcut are already escaped; only this filter marks them as such.
    environment.filters["drawn"] = Markup
    return environment


def drawing_css() -> str:
    """Return the styles of a stand-alone drawing."""
    return style_sheet("drawing.css") + ramp_css()


def css_hash(css: str) -> str:
    """Return the hash of a style sheet for the content security policy of a page."""
    return base64.b64encode(hashlib.sha256(css.encode()).digest()).decode()
