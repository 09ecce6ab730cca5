"""Read the materials that a program defines in comments, and add the moves that the controller makes at every cut.

The program itself does not contain these moves: `gcode.torch.convert_torch_path_for_controller` leaves them out.

Source: QtPlasmaC manual, material handling. ``(o=0, …)`` applies to the current program. ``o=1`` and ``o=2`` are stored
in the table under the number ``nu``, and selected by M190.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from leafcut.geometry.arrays import Point3
from leafcut.model.toolpath import MOTIONS, PLACES, Kind, Motion, Toolpath
from leafcut.units import MM_PER_INCH, SECONDS_PER_MINUTE

_COMMENT = re.compile(r"\(\s*o\s*=\s*([012])\s*,([^()]{1,500})\)", re.IGNORECASE)
_FIGURE = re.compile(r"\b([a-z]{2})\s*=\s*([0-9]{1,9}(?:\.[0-9]{0,9})?|\.[0-9]{1,9})(?![0-9.])", re.IGNORECASE)
_CHOICE = re.compile(r"(?:^|[\s0-9])M190\s*P([0-9]{1,9})", re.IGNORECASE)
_FLOWING = re.compile(r"^(?:\s*N[0-9]+)?\s*M(?:62|63|67)(?![0-9])", re.IGNORECASE)
_UNITS = re.compile(r"(?:^|[\s0-9])G(20|21)(?![0-9.])", re.IGNORECASE)
#: At most this many rows (outputs and pauses) come between the start of the torch and the cut.
_NEAR = 40
#: This offset marks a feed as taken from the controller's table, units per minute.
_APART = 1e-6
_CUTTING = (Kind.FEED, Kind.ARC_CW, Kind.ARC_CCW)
_MOVING = [int(kind) for kind in MOTIONS]


@dataclass(frozen=True)
class Material:
    """Pierce and cut data of a material, in mm, s and mm/s."""

    pierce_height: float
    pierce_delay: float
    cut_height: float
    feed: float


#: A material and the line from which it applies. The material is None if only the controller knows it.
Choice = tuple[int, Material | None]


def read_material_choices(lines: Sequence[str]) -> list[Choice]:
    """Return the materials that a program selects, in the order of its lines."""
    unit, table, choices = 1.0, dict[int, Material](), list[Choice]()
    for number, line in enumerate(lines, 1):
        units = _UNITS.search(line)
        if units is not None:
            unit = MM_PER_INCH if units.group(1) == "20" else 1.0
        comment = _COMMENT.search(line) if "=" in line else None
        if comment is not None:
            figures = {name.lower(): float(value) for name, value in _FIGURE.findall(comment.group(2))}
            if comment.group(1) == "0":
                choices.append((number, _material_from_values(figures, unit)))
            else:
                table[int(figures.get("nu", -1))] = _material_from_values(figures, unit)
        chosen = _CHOICE.search(line) if "190" in line else None
        if chosen is not None:
            choices.append((number, table.get(int(chosen.group(1)))))
    return choices


class MaterialFeeds:
    """Feeds that a program takes from the selected material of the controller.

    The program refers to the feed by a `word` such as ``F#<_hal[plasmac.cut-feed-rate]>``. `words` maps each of these
    feeds to its word. The feeds are a millionth higher than in the material, so that they differ from every feed that a
    program states.
    """

    def __init__(self, lines: Sequence[str], word: str, otherwise: float) -> None:
        """Take the feeds from the materials of a program. For all other materials, the feed is `otherwise`, mm/s."""
        self.word, self.words = word, dict[float, str]()
        self._choices, self._otherwise = read_material_choices(lines), otherwise
        self._starts = [line for line, _ in self._choices]

    def feed_at(self, line: int, unit: float) -> float:
        """Return the feed at a line, in program units per minute. `unit` is the length of a program unit, mm."""
        chosen = bisect_right(self._starts, line)
        material = self._choices[chosen - 1][1] if chosen else None
        known = material.feed if material is not None and material.feed > 0.0 else self._otherwise
        feed = round(known * SECONDS_PER_MINUTE / unit + _APART, 6)
        self.words[feed] = self.word
        return feed


def _material_from_values(figures: dict[str, float], unit: float) -> Material:
    return Material(
        figures.get("ph", 0.0) * unit,
        figures.get("pd", 0.0),
        figures.get("ch", 0.0) * unit,
        figures.get("fr", 0.0) * unit / SECONDS_PER_MINUTE,
    )


def add_controller_moves(path: Toolpath, lines: Sequence[str], clearance: float) -> tuple[Toolpath, int]:
    """Add the moves that the controller makes at every cut. Return the path and the number of cuts of unknown material.

    The torch descends to the pierce height, waits, descends to the cut height, and retracts after the cut. Marking has
    no delay. The second descent uses the feed of the first cutting move, as in leafcut's plans; the real feed is a
    controller setting. Probing is not included, because its path and feed are settings. Outputs synchronized with
    motion (M62, M63, M67) are left out, because the machine does not stop for them.

    `clearance` is the height of travel moves above the sheet, mm.
    """
    choices = read_material_choices(lines)
    starts = [line for line, _ in choices]
    unknown, switched, place = 0, 0, (math.nan, math.nan, clearance)
    rows = [Motion(Kind.RAPID, place, 0.0, 0, 0)]
    for index, row in enumerate(path):
        # The torch number ($1) is kept as FOREIGN; the machine does not stop for it.
        if row.kind is Kind.FOREIGN and (row.line == switched or _FLOWING.search(lines[row.line - 1])):
            continue
        if row.kind in PLACES:
            place = (row.end[0], row.end[1], place[2])
            rows.append(row._replace(end=place))
            continue
        if row.kind is not Kind.SPINDLE:
            rows.append(row)
            continue
        switched, number = row.line, bisect_right(starts, row.line)
        material = choices[number - 1][1] if number else None
        unknown += material is None and row.value != 0.0 and row.ref == 0
        moves = (
            [row]
            if material is None
            else list(_torch_switching_moves(row, material, place, clearance, _feed_after(path, index)))
        )
        place = next((m.end for m in reversed(moves) if m.kind in MOTIONS), place)
        rows += moves
    return replace(Toolpath.of_motions(rows), cycles=path.cycles, arcs=path.arcs), unknown


def _feed_after(path: Toolpath, index: int) -> float:
    """Return the feed of the first cut after a row, mm/s.

    The result is 0 if a rapid comes before the cut, or if no cut follows.
    """
    ahead = path.kind[index + 1 : index + 1 + _NEAR]
    moving = np.flatnonzero(np.isin(ahead, _MOVING))
    first = index + 1 + int(moving[0]) if len(moving) else index
    return float(path.value[first]) if path.kind[first] in _CUTTING else 0.0


def _torch_switching_moves(
    row: Motion, material: Material, place: Point3, clearance: float, feed: float
) -> Iterator[Motion]:
    """Yield the moves that the controller adds when the program switches the torch.

    `feed` is the feed of the next cut.
    """

    def motion_to(kind: Kind, z: float, feed: float = 0.0) -> Motion:
        return Motion(kind, (place[0], place[1], z), feed, 0, row.line)

    if row.value == 0.0:
        yield row
        yield motion_to(Kind.RAPID, clearance)
    elif row.ref:
        yield motion_to(Kind.RAPID, material.cut_height)
        yield row
    else:
        yield motion_to(Kind.RAPID, material.pierce_height)
        yield row
        yield Motion(Kind.DWELL, (math.nan, math.nan, math.nan), material.pierce_delay, 0, row.line)
        if feed > 0.0:
            yield motion_to(Kind.FEED, material.cut_height, feed)
