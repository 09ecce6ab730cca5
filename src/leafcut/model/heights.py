"""Heights of drawn objects. A drawing should have a single height, which becomes Z0."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from leafcut.errors import count_of
from leafcut.message import Message
from leafcut.model.issue import Issue, Severity

#: Tolerance for equal heights, mm.
SAME_HEIGHT = 0.001
#: Maximum number of heights listed in a message. A drawing with more heights is a 3D drawing.
_MAX_NAMED = 4


@dataclass(frozen=True)
class HeightCount:
    """Counts the objects at each height, and keeps the position of the first object.

    The dict maps a height to (number, x, y), mm.
    """

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
        """Return a note if all objects share a height other than Z0. `noun` is the word for the objects."""
        if self.differ or not self.common_height:
            return []
        words = Message("all {} are drawn at Z{:g}: this height becomes Z0 of the program", noun, self.common_height)
        return [Issue("L406", words, severity=Severity.NOTE)]

    @property
    def common_height(self) -> float:
        """The height that all objects share, mm. It is 0 if the heights differ or the drawing has no objects."""
        return next(iter(self.heights)) if len(self.heights) == 1 else 0.0

    def __str__(self) -> Message:
        rows = sorted(self.heights.items(), key=lambda row: -row[0])
        parts = [Message("{} at Z{:g} (the first at {:g}, {:g})", n, z, x, y) for z, (n, x, y) in rows[:_MAX_NAMED]]
        named = Message.joined(", ", parts)
        more = len(rows) - _MAX_NAMED
        return Message("{}, and {}", named, count_of(more, "more height")) if more > 0 else named
