"""Records of leafcut in plain text, for comparisons with files that were checked by eye."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from leafcut.geometry.polyline import Polyline


def number(value: float) -> str:
    """Return a number with four decimals at most."""
    return f"{round(float(value), 4) + 0.0:.10g}"


def text_of(value: Any) -> str:
    """Return a value in one line; of records, the fields that differ from their defaults."""
    if isinstance(value, Polyline):
        corners = " ".join(",".join(map(number, corner)) for corner in value.vertices)
        return f"{'closed' if value.closed else 'open'} {corners}"
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        shown = [
            f"{field.name}={text_of(getattr(value, field.name))}"
            for field in dataclasses.fields(value)
            if not isinstance(getattr(value, field.name), type(field.default))
            or getattr(value, field.name) != field.default
        ]
        return f"{type(value).__name__}({'; '.join(shown)})"
    if isinstance(value, np.ndarray):
        return text_of(value.tolist())
    if isinstance(value, float):
        return number(value)
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(text_of, value))}]"
    return str(value)
