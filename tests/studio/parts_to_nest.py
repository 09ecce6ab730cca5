"""Small drawings of parts, for the tests that nest them."""

from __future__ import annotations


def svg(width: int, height: int, body: str) -> bytes:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" '
        f'viewBox="0 0 {width} {height}"><g fill="none" stroke="black">{body}</g></svg>'
    ).encode()


#: A plate with a hole, and an angle.
PLATE = svg(80, 50, '<path d="M0 0H80V50H0Z"/><circle cx="40" cy="25" r="12"/>')
ANGLE = svg(60, 60, '<path d="M0 0H60V15H15V60H0Z"/>')
