"""Draw a tool path over its holes. The drawings before and after the search use the same scale and frame."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from leafcut.model.kinds import BEAMS
from leafcut.report.frame import Frame
from leafcut.report.labels import Surroundings, label_positions
from leafcut.report.marks import arrow_heads_svg, end_marks_svg
from leafcut.report.missing_drawing import missing_work_svg, points_of_missing_work
from leafcut.report.part_edge import edge_box_corners_near, edge_segments
from leafcut.report.plan_view import PlanView, plan_view
from leafcut.report.svg import STEPS, dots_path_data, element, scaled_group_element, segments_path_data, text_element

if TYPE_CHECKING:
    from leafcut.model.issue import Issue
    from leafcut.model.outcome import Outcome, Which

#: Maximum number of stops with a number. In a longer path, the colour shows the order.
MAX_NUMBERS = 120
#: Number of colours in the ramp along a path, number of tool colours, and number of line styles for tools that share a
#: colour.
RAMP = 24
TOOL_COLOURS = 8
TOOL_STYLES = 3

#: Minimum size of a drawn hole, user units: in drawings with few holes, and in drawings with many holes.
_SMALLEST_OF_FEW = 3.6
_SMALLEST_HOLE = 1.6
#: Drawn size of holes with an unknown diameter: share of the mean spacing, and maximum, user units.
_UNSIZED_PART = 0.3
_LARGEST_UNSIZED = 5.0
_RING = 1.1
_MAX_GROUPS = 64
#: Stops of cuts are numbered if there are at most this many, or if their spacing is at least this, user units.
_FEW_NUMBERS = 24
_SPACE_FOR_NUMBERS = 20.0
#: Rapids are shown up to this distance beyond the work, as a share of the size of the work. A distant park position is
#: not shown.
_BEYOND = 0.3


@dataclass(frozen=True, eq=False)
class Dots:
    """Holes with the same tool and the same drawn size.

    The size and the centres, float64[n, 2], are in user units.
    """

    tool: int
    size: float
    points: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """Data that all drawings of an outcome share.

    Attributes
    ----------
    tools
        Tool numbers in the order of use.
    dots, slots
        Holes, and slots as (tool, width, centre line), in user units. A hole has the colour of its last tool. The tool
        number is -1 for a hole without a tool.
    numbered
        Whether the stops of the tool have numbers.
    discs
        Centre and drawn radius of each hole, float64[n, 3], user units.
    enlarged, unsized
        Whether some holes are drawn larger than they are, and whether some diameters are unknown.
    extent
        Size of the work, mm.
    edge
        Edge of the plate, float64[k, 2, 2], user units.
    missing
        Issues about missing work.
    """

    frame: Frame
    tools: tuple[int, ...]
    dots: tuple[Dots, ...]
    slots: tuple[tuple[int, float, NDArray[np.float64]], ...]
    numbered: bool
    enlarged: bool
    before: PlanView
    after: PlanView
    discs: NDArray[np.float64]
    unsized: bool = False
    extent: tuple[float, float] = (0.0, 0.0)
    edge: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 2)))
    missing: tuple[Issue, ...] = ()


def build_scene(outcome: Outcome) -> Scene:
    """Create the scene of an outcome. An empty part gives an empty frame."""
    part = outcome.part
    before, after = (plan_view(path, outcome.process in BEAMS) for path in (outcome.path_before, outcome.path_after))
    diameters = part.diameters
    ends = np.array([(s.start, s.end) for s in part.slots], dtype=np.float64).reshape(-1, 2)
    radius = np.concatenate([diameters / 2, np.repeat([s.width / 2 for s in part.slots], 2)])[:, None]
    centres = np.concatenate([part.hole_xy, ends])
    work = np.concatenate([centres - radius, centres + radius, before.work_points, after.work_points])
    work = work[np.isfinite(work).all(axis=1)]
    work = np.concatenate([work, points_of_missing_work(outcome.missing)])
    shown = (
        work
        if not len(work)
        else np.concatenate([work, edge_box_corners_near(part, work.min(axis=0), work.max(axis=0))])
    )
    frame = _fit_frame(shown, np.concatenate([before.rapids.reshape(-1, 2), after.rapids.reshape(-1, 2)]))

    tools = tuple(dict.fromkeys(o.tool.number for o in outcome.operations))
    of_hole, of_slot = np.full(len(part.holes), -1), np.full(len(part.slots), -1)
    for operation in outcome.operations:
        order = list(operation.holes)
        (of_slot if operation.slots else of_hole)[order] = tools.index(operation.tool.number)
        if not operation.slots:  # a bare point gets the diameter of its drill
            diameters[order] = np.where(diameters[order] > 0, diameters[order], operation.tool.diameter)
    numbered = max(len(before.stops), len(after.stops)) <= MAX_NUMBERS
    if len(after.cuts) and len(after.stops) > _FEW_NUMBERS:
        numbered = (
            numbered
            and _median_nearest_distance(frame.to_user_units(np.unique(after.stops, axis=0))) >= _SPACE_FOR_NUMBERS
        )
    smallest = _SMALLEST_OF_FEW if numbered else _SMALLEST_HOLE
    true_sizes, sized = diameters * frame.scale, diameters > 0.0
    sizes = np.where(
        sized, np.maximum(true_sizes, smallest), _dot_size_without_diameter(frame, len(diameters), smallest)
    )
    placed = frame.to_user_units(part.hole_xy)
    slots = tuple(
        (
            int(tool),
            max(slot.width * frame.scale, _SMALLEST_HOLE),
            frame.to_user_units(np.array([[slot.start, slot.end]])),
        )
        for tool, slot in zip(of_slot, part.slots, strict=True)
    )
    return Scene(
        frame=frame,
        tools=tools,
        dots=_group_holes(placed, sizes, of_hole),
        slots=slots,
        numbered=numbered,
        enlarged=bool((true_sizes[sized] < smallest).any()),
        before=before,
        after=after,
        discs=np.concatenate([placed, sizes[:, None] / 2], axis=1),
        unsized=not bool(sized.all()),
        extent=(float(np.ptp(work[:, 0])), float(np.ptp(work[:, 1]))) if len(work) else (0.0, 0.0),
        edge=frame.to_user_units(edge_segments(part)),
        missing=outcome.missing,
    )


def _fit_frame(work: NDArray[np.float64], rapids: NDArray[np.float64]) -> Frame:
    if not len(work):
        work = rapids if len(rapids) else np.zeros((1, 2))
    low, high = work.min(axis=0), work.max(axis=0)
    beyond = max(_BEYOND * float((high - low).max()), 10.0)
    near = np.clip(rapids, low - beyond, high + beyond)
    every = np.concatenate([work, near])
    (x0, y0), (x1, y1) = every.min(axis=0).tolist(), every.max(axis=0).tolist()
    return Frame.around_corners((x0, y0), (x1, y1))


def _dot_size_without_diameter(frame: Frame, holes: int, smallest: float) -> float:
    """Return the drawn size for holes with an unknown diameter, user units.

    The size is large enough to be visible, and small enough to avoid overlaps.
    """
    apart = math.sqrt(frame.width * frame.height / max(holes, 1))
    return min(max(_UNSIZED_PART * apart, smallest), _LARGEST_UNSIZED)


def _median_nearest_distance(places: NDArray[np.float64]) -> float:
    if len(places) < 2:
        return math.inf
    apart = np.hypot(*(places[:, None, :] - places[None, :, :]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    return float(np.median(apart.min(axis=1)))


def _group_holes(points: NDArray[np.float64], sizes: NDArray[np.float64], tools: NDArray[np.int64]) -> tuple[Dots, ...]:
    """Group the holes by tool and size. The largest holes come first, so that they never hide a smaller hole."""
    if len(np.unique(sizes)) > _MAX_GROUPS:  # too many sizes: round them to steps of 5 %
        sizes = 1.05 ** np.rint(np.log(sizes) / math.log(1.05))
    keys, group = np.unique(np.stack([-sizes, tools], axis=1), axis=0, return_inverse=True)
    group = group.reshape(-1)
    return tuple(Dots(int(tool), -size, points[group == g]) for g, (size, tool) in enumerate(keys.tolist()))


def tool_css_class(scene: Scene, tool: int) -> str:
    """Return the CSS class for the colour of a tool.

    The class is ``only`` if the scene has a single tool, and ``idle`` for holes without a tool.
    """
    if tool < 0:
        return "idle"
    if len(scene.tools) == 1:
        return "only"
    manner = tool // TOOL_COLOURS % TOOL_STYLES
    return f"t{tool % TOOL_COLOURS}" + (f" again{manner}" if manner else "")


def toolpath_svg(scene: Scene, which: Which, words: str, *, holes: str = "", size: bool = False) -> str:
    """Draw the path ``before`` or ``after`` as an SVG element with the title `words`.

    With ``holes="=name"``, this SVG defines the holes as a group with an id. With ``holes="#name"``, it reuses the
    group from another SVG on the page, so that the page stores a hundred thousand holes only once. With `size`, the
    element has a width and height.
    """
    frame, path = scene.frame, scene.before if which == "before" else scene.after
    drawn = element("use", href=holes) if holes.startswith("#") else _holes_svg(scene, holes.removeprefix("="))
    window = f"window-{which}"
    paths = (_rapids_svg(scene, path), _cuts_svg(scene, path), arrow_heads_svg(frame.to_user_units(path.rapids)))
    if len(scene.edge):
        drawn = (
            element(
                "g",
                scaled_group_element(element("path", d=segments_path_data(scene.edge), class_="plate")),
                clip_path=f"url(#{window})",
            )
            + drawn
        )
    drawn += missing_work_svg(frame, scene.missing)
    inside = (drawn, element("g", *paths, clip_path=f"url(#{window})"), *_end_marks_and_numbers_svg(scene, path))
    return frame.drawing_svg(words, window, inside, "drawing" if scene.numbered else "drawing ramped", size)


def _holes_svg(scene: Scene, name: str) -> str:
    parts = []
    for number, dots in enumerate(scene.dots):
        of_tool, data = tool_css_class(scene, dots.tool), dots_path_data(dots.points)
        if dots.size < 3 * _RING:
            parts.append(element("path", d=data, class_=f"hole {of_tool}", stroke_width=dots.size * STEPS))
            continue
        shape = f"{name or 'holes'}-{number}"
        parts += [
            element("g", element("path", id=shape, d=data), class_=f"hole {of_tool}", stroke_width=dots.size * STEPS),
            element("use", href=f"#{shape}", class_=f"inside {of_tool}", stroke_width=(dots.size - 2 * _RING) * STEPS),
        ]
    for tool, width, line in scene.slots:
        data, of_tool = segments_path_data(line), tool_css_class(scene, tool)
        parts.append(element("path", d=data, class_=f"slot {of_tool}", stroke_width=width * STEPS))
        if width > 4 * _RING:
            parts.append(element("path", d=data, class_=f"inside {of_tool}", stroke_width=(width - 2 * _RING) * STEPS))
    return element("g", scaled_group_element(*parts), id=name or None)


def _rapids_svg(scene: Scene, path: PlanView) -> str:
    """Draw the rapids, in a single colour if the stops have numbers, otherwise in a colour ramp from first to last."""
    segments = scene.frame.to_user_units(path.rapids)
    width = 1.25 if len(segments) <= 400 else 0.9 if len(segments) <= 4000 else 0.55
    if scene.numbered:
        lines = [element("path", d=segments_path_data(segments), class_="rapid")]
    else:
        chunks = np.array_split(segments, RAMP)
        lines = [element("path", d=segments_path_data(c), class_=f"rapid r{i}") for i, c in enumerate(chunks) if len(c)]
    return element("g", scaled_group_element(*lines), stroke_width=width * STEPS)


def colour_indices_of_cutting_tools(scene: Scene) -> dict[int, int]:
    """Return the colour index of each tool that cuts, by tool number. The result is empty for a single tool."""
    if len(scene.tools) < 2:
        return {}
    cutting = set(np.unique(scene.after.cut_tool).tolist())
    return {number: index for index, number in enumerate(scene.tools) if number in cutting}


def _cuts_svg(scene: Scene, path: PlanView) -> str:
    if not len(path.cuts):
        return ""
    segments, colours = scene.frame.to_user_units(path.cuts), colour_indices_of_cutting_tools(scene)
    length = float(np.hypot(*(segments[:, 1] - segments[:, 0]).T).sum())
    # Use lines that are thin enough to show cuts with a small step-over separately.
    width = float(np.clip(0.25 * scene.frame.width * scene.frame.height / max(length, 1.0), 0.9, 2.6)) * STEPS
    lines = []
    for number in [*colours, None]:
        selected = path.cut_tool == number if number is not None else ~np.isin(path.cut_tool, list(colours))
        if selected.any():
            css_class = f"cut tool {tool_css_class(scene, colours[number])}" if number is not None else "cut"
            lines.append(
                element("path", d=segments_path_data(segments[selected]), class_=css_class, stroke_width=width)
            )
    return scaled_group_element(*lines)


def _end_marks_and_numbers_svg(scene: Scene, path: PlanView) -> list[str]:
    if not len(path.stops):
        return []
    visits: dict[tuple[float, float], list[str]] = {}
    for number, (x, y) in enumerate(path.stops.tolist(), start=1):
        visits.setdefault((x, y), []).append(str(number))
    places = scene.frame.to_user_units(np.array(list(visits)))
    radii = _largest_radii(scene, places)
    last = list(visits).index(tuple(path.stops[-1].tolist()))
    free = radii.copy()
    marks = _end_marks_svg(scene, places, free, last)
    if not scene.numbered:
        return marks
    return [
        *marks,
        _stop_numbers_svg(scene, path, np.column_stack([places, free, radii]), ["/".join(v) for v in visits.values()]),
    ]


def _stop_numbers_svg(scene: Scene, path: PlanView, stops: NDArray[np.float64], words: list[str]) -> str:
    """Draw the numbers of the stops.

    A row of `stops`, float64[k, 4], contains x, y, the radius to keep clear, and the radius of the hole, user units.
    """
    frame, spacing = scene.frame, _median_nearest_distance(stops[:, :2])
    font = float(np.clip(0.45 * spacing, 7.0, 11.0))
    lines = np.concatenate([frame.to_user_units(np.concatenate([path.rapids, path.cuts])), scene.edge])
    around = Surroundings(np.concatenate([scene.discs, stops[:, :3]]), lines, (frame.width, frame.height))
    spots = label_positions(stops, words, font, around)
    numbers = [text_element(w, spot[0], spot[1], dy="0.35em") for w, spot in zip(words, spots, strict=True) if spot]
    return element("g", *numbers, class_="number", font_size=font, stroke_width=font * 0.3)


def _largest_radii(scene: Scene, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the radius of the largest hole at each position, user units. The radius is 0 at the end of a slot."""
    sizes: dict[tuple[int, int], float] = {}
    for x, y, radius in scene.discs.tolist():
        key = (round(x * STEPS), round(y * STEPS))
        sizes[key] = max(radius, sizes.get(key, 0.0))
    return np.array([sizes.get((round(x * STEPS), round(y * STEPS)), 0.0) for x, y in places.tolist()])


def _end_marks_svg(scene: Scene, places: NDArray[np.float64], radii: NDArray[np.float64], last: int) -> list[str]:
    """Mark the first stop with a ring and the last stop with a square.

    The function also enlarges the `radii` of these stops, so that labels avoid the marks.
    """
    radii[0] = ring = max(radii[0] + 3.0, 4.5)
    (x0, y0), (x1, y1) = places[[0, last]].tolist()
    half = max(radii[last] + 3.0, 4.5)
    radii[last] = 1.35 * half
    words = () if scene.numbered else (scene.frame.width, scene.frame.height)
    return end_marks_svg((x0, y0, ring), (x1, y1, half), words)
