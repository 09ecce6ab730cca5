"""The ramp of colours along a path, and the style sheets that pages and drawings carry inside."""

from __future__ import annotations

from importlib.resources import files

from leafcut.report.drawing import RAMP

RGB = tuple[int, int, int]

#: From the first move to the last: violet, blue, teal. Told apart with any colour vision, because lightness changes
#: with hue; none of them is near the orange of cuts. The light one keeps a contrast of 3 to white.
_LIGHT: tuple[RGB, ...] = ((82, 18, 122), (31, 98, 192), (16, 150, 140))
_DARK: tuple[RGB, ...] = ((176, 120, 235), (106, 165, 255), (120, 235, 210))


def ramp_colour(stops: tuple[RGB, ...], part: float) -> str:
    """Return the colour at `part` (0 to 1) of a ramp through `stops`, as ``#rrggbb``."""
    place = min(max(part, 0.0), 1.0) * (len(stops) - 1)
    index = min(int(place), len(stops) - 2)
    low, high = stops[index], stops[index + 1]
    mixed = (round(a + (b - a) * (place - index)) for a, b in zip(low, high, strict=True))
    return "#" + "".join(f"{c:02x}" for c in mixed)


def ramp_css() -> str:
    """Return the rules of the classes r0 … of a ramp, for light and for dark."""

    def rules(stops: tuple[RGB, ...]) -> str:
        colours = (ramp_colour(stops, i / (RAMP - 1)) for i in range(RAMP))
        return " ".join(f".drawing .r{i}, .sw .r{i} {{ stroke: {c}; }}" for i, c in enumerate(colours))

    return f"{rules(_LIGHT)}\n@media screen and (prefers-color-scheme: dark) {{ {rules(_DARK)} }}\n"


def style_sheet(name: str, package: str = "leafcut.report") -> str:
    """Return a style sheet that is shipped in a package."""
    return (files(package) / name).read_text(encoding="utf-8")


def drawing_css() -> str:
    """Return all that a drawing needs to look right alone."""
    return style_sheet("drawing.css") + ramp_css()
