"""Heights of drawn objects. A drawing should have a single height, which becomes Z0."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from leafcut.errors import count_of
from leafcut.message import Message
from leafcut.model.issue import Issue, Severity

#: Tolerance for equal heights, mm.
SAME_HEIGHT = 0.001
#: Maximum number of heights in a message; a drawing with more is a 3D drawing.
_MAX_NAMED = 4


@dataclass(frozen=True)
class HeightCount:
    """Number of objects at each height, and the position of the first object: height → (number, x, y), mm."""

    heights: dict[float, tuple[int, float, float]] = field(default_factory=dict)

    @classmethod
    def of(cls, places: Iterable[tuple[float, float, float]]) -> HeightCount:
        """Count the heights of points (x, y, z), mm."""
        heights: dict[float, tuple[int, float, float]] = {}
        for x, y, z in places:
            level = round(z / SAME_HEIGHT) * SAME_HEIGHT + 0.0
            number, x0, y0 = heights.get(level, (0, x, y))
            heights[level] = (number + 1, x0, y0)
        return cls(heights)

    @property
    def differ(self) -> bool:
        """Whether the objects have different heights."""
        return len(self.heights) > 1

    def notes(self, noun: str) -> list[Issue]:
        """Return a note if all objects are drawn at one height other than Z0; `noun` names the objects."""
        if self.differ or not self.common:
            return []
        words = Message("all {} are drawn at Z{:g}: this height becomes Z0 of the program", noun, self.common)
        return [Issue("L406", words, severity=Severity.NOTE)]

    @property
    def common(self) -> float:
        """The common height of all objects, mm; 0 if the heights differ or there are no objects."""
        return next(iter(self.heights)) if len(self.heights) == 1 else 0.0

    def __str__(self) -> Message:
        rows = sorted(self.heights.items(), key=lambda row: -row[0])
        parts = [Message("{} at Z{:g} (the first at {:g}, {:g})", n, z, x, y) for z, (n, x, y) in rows[:_MAX_NAMED]]
        named = Message.joined(", ", parts)
        more = len(rows) - _MAX_NAMED
        return Message("{}, and {}", named, count_of(more, "more height")) if more > 0 else named
