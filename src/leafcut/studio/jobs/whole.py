"""The entire content of a drawing, with its background layer, suitable kinds of work, and program zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from leafcut.errors import LeafcutError
from leafcut.model.machine import Machine
from leafcut.model.part import Part
from leafcut.options import ReadOptions, Settings
from leafcut.processes import registry
from leafcut.processes.placing import place_part
from leafcut.processes.suitability import Suitability, WholeDrawing
from leafcut.read import read_whole
from leafcut.read.format import Format, Source
from leafcut.read.machine import load_machine
from leafcut.studio.drawing.thumbnail import Thumbnails

#: A kind of work is clearly worse than another if its suitability is below this share of the better suitability.
_CLEARLY_WORSE = 0.5


@dataclass(frozen=True)
class WholeInput:
    """A whole drawing before it is placed.

    Attributes
    ----------
    part
        The entire content, or None for an input that is machined completely.
    suits
        Rating of each kind of work, most likely first.
    pictures
        Thumbnail of each kind of work (see `Thumbnails.picture`).
    machine
        Default machine for files of this format. It is empty if the format has none.
    """

    part: Part | None = None
    suits: dict[str, Suitability] = field(default_factory=dict)
    pictures: dict[str, dict[str, str]] = field(default_factory=dict)
    machine: str = ""

    def most_likely_first(self, kinds: Sequence[str]) -> list[str]:
        """Sort kinds of work, most likely first."""
        return [*(work for work in self.suits if work in kinds), *(work for work in kinds if work not in self.suits)]

    def background_and_zero(
        self, work: str, source: Source, part: Part, settings: Settings
    ) -> tuple[Part | None, Zero]:
        """Place the entire drawing like the part of a kind of work.

        Return the placed drawing and the position of program zero.
        """
        zero = _program_zero(work, source, part, settings)
        if self.part is None or zero is None:
            return None, zero
        return place_part(self.part, replace(settings.read, origin=zero)), zero


#: Position of program zero in the mirrored and rotated drawing, mm, or None if it is unknown.
Zero = tuple[float, float] | None


def read_whole_input(format_: Format, source: Source, kinds: Sequence[str], settings: Settings) -> WholeInput:
    """Read the whole content of an input.

    `WholeInput.part` is None if files of this format contain only the part to be machined.
    """
    machine = next(filter(None, (registry.work(work).usual_machine(format_.name) for work in kinds)), "")
    if format_.whole is None and format_.contours is None and not _has_filters(settings.read):
        return WholeInput(machine=machine)
    try:
        part = read_whole(source, settings.read)
    except LeafcutError:
        return WholeInput(machine=machine)  # the error is reported when the drawing is read for a kind of work
    suits = _machine_first(registry.rate_works(kinds, WholeDrawing(part)), settings)
    drawn = Thumbnails(part)
    pictures = {
        work: drawn.picture(selection.contours, selection.holes, registry.work(work).pictured)
        for work, selection in suits.items()
    }
    return WholeInput(part, suits, pictures, machine)


def _machine_first(suits: dict[str, Suitability], settings: Settings) -> dict[str, Suitability]:
    """Put the works of the selected machine first, unless another kind of work suits the drawing much better."""
    if "machine" not in settings.given or not suits:
        return suits
    try:
        head = load_machine(settings.machine.machine).head
    except LeafcutError:
        return suits  # the job reports the error
    least = _CLEARLY_WORSE * next(iter(suits.values())).score

    def rank(work: str) -> bool:
        return suits[work].score <= least or not registry.machine_can_do(work, head)

    return {work: suits[work] for work in sorted(suits, key=rank)}


def _has_filters(read: ReadOptions) -> bool:
    return bool(read.layers) or read.min_diameter is not None or read.max_diameter is not None


def _program_zero(work: str, source: Source, part: Part, settings: Settings) -> Zero:
    """Return the position of program zero in the drawing. If it is a named corner, it depends on the kind of work."""
    origin = settings.read.origin
    if origin is None:
        return 0.0, 0.0
    if not isinstance(origin, str):
        return origin[0], origin[1]
    unplaced = settings.but(replace(settings.read, origin=None))
    try:
        before = registry.work(work).preview_part(source, unplaced).extents
    except LeafcutError:
        return None
    after = part.extents
    return before[0] - after[0], before[1] - after[1]


@dataclass(frozen=True)
class MachineTravel:
    """The travel of a machine in drawing coordinates: smallest x and y, and largest x and y, mm.

    Attributes
    ----------
    known
        Whether the position of program zero on the machine is known. If not, the part is assumed to lie in the middle
        of the travel.
    fits
        Whether the part lies within the travel.
    """

    box: tuple[float, float, float, float]
    known: bool
    fits: bool
    machine: str

    def as_shown(self) -> dict[str, Any]:
        """Convert the travel to plain values for the browser."""
        return {"box": list(self.box), "known": self.known, "fits": self.fits, "machine": self.machine}


def machine_travel_around(settings: Settings, extents: tuple[float, float, float, float]) -> MachineTravel | None:
    """Return the travel of the machine around a part with these extents, or None if the travel is unknown."""
    try:
        machine = load_machine(settings.machine.machine, settings.machine.work_offset)
    except LeafcutError:
        return None
    if not machine.table_known:
        return None
    x0, y0, x1, y1 = extents
    left, low = _lower_left(machine, extents)
    right, high = left + machine.reach(0), low + machine.reach(1)
    fits = left <= x0 and x1 <= right and low <= y0 and y1 <= high
    return MachineTravel((left, low, right, high), machine.work_offset is not None, fits, machine.name)


def _lower_left(machine: Machine, extents: tuple[float, float, float, float]) -> tuple[float, float]:
    if machine.work_offset is not None:
        return machine.travel_min[0] - machine.work_offset[0], machine.travel_min[1] - machine.work_offset[1]
    (a, b, _), (c, d, _) = machine.travel_min, machine.travel_max
    x0, y0, x1, y1 = extents
    return 0.5 * (x0 + x1 - (c - a)), 0.5 * (y0 + y1 - (d - b))
