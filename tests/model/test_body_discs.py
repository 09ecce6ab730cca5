"""Cones of holders and shanks as discs: a bound that never misses what the cone itself would meet."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from leafcut.model.cutter import CONE_STEP, SAME_RADIUS, wide_discs_above_flutes
from leafcut.model.tool import BodySegment, Tool, ToolKind

diameters = st.floats(0.0, 80.0)
segments = st.lists(st.builds(BodySegment, st.floats(0.1, 60.0), diameters, diameters), min_size=1, max_size=4)


def radius_at(parts: list[BodySegment], height: float) -> float:
    """Return the radius of a stack of cones at a height over its lower end, mm, the larger one where two meet."""
    begin, found = 0.0, 0.0
    for length, lower, upper in parts:
        if begin <= height <= begin + length:
            found = max(found, 0.5 * (lower + (upper - lower) * (height - begin) / length))
        begin += length
    return found


@given(segments, st.floats(0.0, 1.0), st.floats(0.5, 20.0))
def test_every_place_of_a_cone_is_in_a_disc_that_begins_no_higher(
    parts: list[BodySegment], share: float, diameter: float
) -> None:
    """Only parts that the flutes have not cleared before: out to the radius of the body at any of its heights."""
    tool = Tool(1, diameter, ToolKind.END_MILL, stickout=30.0, holder=tuple(parts))
    height = share * sum(one.length for one in parts)
    outside = radius_at(parts, height)
    if outside > 0.5 * diameter + 2.0 * SAME_RADIUS:
        assert any(
            disc.above <= 30.0 + height + 1e-9 and disc.radius >= outside - 1e-9
            for disc in wide_discs_above_flutes(tool)
        )


@given(segments, st.floats(0.5, 20.0))
def test_no_disc_is_wider_than_the_body_up_to_there_by_more_than_a_step(
    parts: list[BodySegment], diameter: float
) -> None:
    """So a way is refused for no more than a quarter of a millimetre beside the cone."""
    tool = Tool(1, diameter, ToolKind.END_MILL, stickout=30.0, holder=tuple(parts))
    begins = [sum(one.length for one in parts[:k]) for k in range(len(parts) + 1)]
    for disc in wide_discs_above_flutes(tool):
        height = disc.above - 30.0
        widest = max(radius_at(parts, z) for z in (*(z for z in begins if z <= height + 1e-9), height))
        assert disc.radius <= widest + CONE_STEP + 1e-9
