"""`Issue`: a problem that a reader or planner worked around, with a code and a position."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from leafcut.errors import count_of, shorten_message
from leafcut.geometry.polyline import Polyline
from leafcut.message import Message


class Severity(StrEnum):
    """How important an issue is for the machine operator. ``missing`` means that drawn work is not done."""

    NOTE = "note"
    WARNING = "warning"
    MISSING = "missing"
    DANGER = "danger"


#: Maps each code to its meaning. The first digit is the subject: 1 reading, 2 skipped objects, 3 repairs, 4
#: assumptions, 5 order of a program, 6 sheet cutting, 7 pockets, 8 behaviour of a program.
CODES: dict[str, str] = {
    "L101": "the file was damaged and could be repaired",
    "L102": "the file does not state its units",
    "L201": "an entity is not a hole",
    "L202": "an entity does not lie in the plane of the plate",
    "L203": "an entity has numbers that are out of range or missing",
    "L204": "an entity is on a layer that is off, frozen or not selected",
    "L205": "a hole is outside the selected range of diameters",
    "L206": "a block is missing, refers to itself or is nested too deep",
    "L207": "an ellipse is not circular",
    "L208": "a line of a text file could not be understood",
    "L210": "an entity of this kind is not cut",
    "L211": "a contour is on a layer that is not cut",
    "L212": "an open path was left out",
    "L213": "a contour is very small",
    "L214": "a small spot of a picture was ignored",
    "L215": "a clip path or a mask was ignored",
    "L216": "a text has letters that cannot be engraved",
    "L217": "a hole has a counterbore or a countersink",
    "L218": "a hole is not open from above",
    "L219": "a part of a solid is not milled or cut",
    "L301": "holes drawn on top of each other were merged",
    "L302": "only one of several concentric circles was used",
    "L303": "arcs that close a circle were joined into a hole",
    "L304": "a value was outside the range of its field and was replaced",
    "L311": "a gap between two ends was closed",
    "L312": "lines drawn on top of each other were merged",
    "L313": "lines of zero length were left out",
    "L314": "more than two lines meet at one point",
    "L401": "a tool was assumed",
    "L402": "a depth was assumed",
    "L403": "the position of the part on the machine is unknown",
    "L404": "a tool exits far below the part",
    "L405": "points or polygons were read as holes",
    "L406": "a drawing does not lie at Z0",
    "L407": "a tool of the library is not used",
    "L408": "the machine profile lacks values needed for the machine time",
    "L409": "several drill files were joined",
    "L411": "cutting data were interpolated between two rows of the chart",
    "L412": "the chart has other entries for this thickness",
    "L413": "cutting data are uncertain",
    "L414": "a height of the torch was assumed",
    "L415": "the sender transmits lines too slowly for their moves",
    "L417": "the machine was assumed",
    "L418": "holes or openings are on a layer that is named for other work",
    "L421": "a layer's kind was taken from its name",
    "L422": "an outline around everything may be the sheet",
    "L423": "parts touch each other",
    "L424": "an open path is cut or marked unchanged",
    "L425": "the edge of a picture becomes a wall",
    "L426": "uneven light of a picture was levelled",
    "L431": "lines of a drawing do not belong to any part",
    "L432": "a drawing contains several parts",
    "L433": "a nest failed its check, or could not be created",
    "L434": "nesting was stopped by the time limit or by the user",
    "L435": "a nest's sheet is larger than the machine's table",
    "L436": "parts do not fit on the given sheets",
    "L440": "no speeds were chosen for a tool",
    "L441": "a hole starts on an uneven surface",
    "L442": "a hole is not drawn at the height of the surface",
    "L443": "the mesh of a surface or a fixture is not closed",
    "L444": "position of a fixture",
    "L445": "a surface or a fixture may have another unit",
    "L446": "a deep hole is drilled in one stroke",
    "L447": "the bottom of a circuit board is mirrored",
    "L501": "blocks of a program keep their position",
    "L502": "nothing in a program can be reordered",
    "L503": "tool changes were saved",
    "L504": "cuts of a program can be reversed",
    "L505": "tasks keep their position: another order could not be written or proved",
    "L506": "joining sections of one tool would save tool changes",
    "L507": "a program keeps its order: it is too large to plan",
    "L508": "the original program crossed keep-out zones; the new program goes over or around them",
    "L509": "the diameter of a tool of a program is unknown",
    "L510": "the stock of a program was assumed",
    "L511": "a controller rounds the corners of a program without a tolerance",
    "L512": "tools of a program keep their feeds",
    "L513": "new speeds or heights of a program could not be proved",
    "L514": "a feed limit of a program is unknown",
    "L515": "new moves of a program cross areas that the original avoided",
    "L611": "a contour is narrower than the kerf and is not cut",
    "L612": "a contour is narrower than the kerf in places",
    "L613": "a lead was reduced",
    "L614": "number of cuts that start near a hot cut",
    "L615": "a hole is too small for good quality in a sheet this thick",
    "L616": "length of edges cut as common lines",
    "L617": "edges one kerf apart are cut separately",
    "L618": "the torch probes the sheet before every pierce",
    "L619": "the controller probes the height at a position without sheet",
    "L620": "a laser is switched on while moving, without a pierce, in a thick sheet",
    "L621": "a plan file was made for another thickness, material or process",
    "L622": "a register of the controller must hold half of the kerf",
    "L623": "travel of a lowered head over detached parts",
    "L626": "contours are compensated by the program, not by the controller",
    "L627": "a slot is cut once along its centreline, and is not as wide as drawn",
    "L701": "the tool cannot reach all of a pocket",
    "L702": "entry move changed",
    "L703": "pre-drill required",
    "L704": "the tool stops after every move of a pocket",
    "L705": "feeds of a pocket are not compared with the power of the spindle",
    "L706": "material of a pocket starts below the highest point of the solid",
    "L707": "an edge of a part is not milled, or not completely",
    "L708": "a slug of a window comes loose",
    "L709": "an outline has fewer tabs than requested",
    "L711": "a path leaves material that the tool could reach",
    "L801": "a program has a rapid below the surface",
    "L802": "a program has a rapid into uncut material",
    "L803": "a program cuts with the spindle off",
    "L804": "a program has a rapid with the torch on",
    "L805": "a program moves in X or Y at an unknown height",
    "L806": "a program needs a capability that the machine lacks",
    "L807": "a program is for a laser, a torch or a router",
    "L808": "the position of the tool is unknown",
    "L809": "the shank or holder of a tool hits material",
    "L810": "cuts of a program go beyond the given stock",
    "L811": "the stock has undercuts, which count as material",
    "L812": "the cells of the stock model are coarse for a tool",
    "L813": "a tool of the library differs from the tool that the program names",
    "L814": "all cuts of a program are above Z0",
    "L815": "rapids of a program were not compared with its earlier cuts",
    "L816": "a program shifts its Z0 down, or by an unknown amount",
    "L817": "the spindle restarts between cuts without a dwell",
    "L820": "the settings of a controller differ from the profile of its machine",
}

#: Codes of issues that appear next to the word "verified", with the heading of their line. They cover assumed values,
#: areas that the tool does not reach, and deep holes without pecks.
LIMITS = {
    **dict.fromkeys(("L102", "L401", "L402", "L405", "L412", "L413", "L414", "L417", "L510"), "assumed"),
    **dict.fromkeys(("L701", "L711"), "not cut"),
    "L446": "deep hole",
    "L447": "the bottom of a circuit board is mirrored",
}


@dataclass(frozen=True, slots=True)
class MissingWork:
    """Requested work that the program does not do.

    Attributes
    ----------
    what
        Noun for the feature: ``part``, ``hole``, ``slot``, ``pocket``, ``opening`` …
    count
        Number of missing features.
    where
        Known positions of the features in program coordinates, mm. There may be fewer positions than `count`.
    outlines
        Known closed outlines of the features, mm. Drawings show them with hatching.
    """

    what: str
    count: int = 1
    where: tuple[tuple[float, float], ...] = ()
    outlines: tuple[Polyline, ...] = ()


#: Placeholder for missing work without details.
_SOME_WORK = MissingWork("feature")


@dataclass(frozen=True, slots=True)
class Issue:
    """A problem with a code from `CODES` and a one-line message. It has a position (file, line, handle) if it is known.

    `missing` is the work that is not done, and the message explains the reason. An issue has missing work if and only
    if its severity is `Severity.MISSING`.
    """

    code: str
    message: Message
    place: str = ""
    severity: Severity = Severity.WARNING
    missing: MissingWork | None = None

    def __post_init__(self) -> None:
        if self.code not in CODES:
            raise ValueError(f"unknown issue code {self.code}")
        if self.missing is not None:
            object.__setattr__(self, "severity", Severity.MISSING)
        elif self.severity is Severity.MISSING:
            object.__setattr__(self, "missing", _SOME_WORK)
        object.__setattr__(self, "message", shorten_message(self.message))
        object.__setattr__(self, "place", shorten_message(self.place))

    def __str__(self) -> Message:
        message = Message("{} {}", self.code, self.message)
        return Message("{} ({})", message, self.place) if self.place else message

    def as_note(self) -> Issue:
        """Return the issue as a note without missing work, because the user did not request this work."""
        return Issue(self.code, self.message, self.place, Severity.NOTE)


def missing_work(issues: Iterable[Issue]) -> tuple[Issue, ...]:
    """Return the issues about missing work."""
    return tuple(issue for issue in issues if issue.missing is not None)


def missing_work_text(issues: Iterable[Issue]) -> str:
    """Summarize the missing work: ``2 parts, 1 hole``. Return "" if no work is missing."""
    numbers: dict[str, int] = {}
    for issue in issues:
        if issue.missing is not None:
            numbers[issue.missing.what] = numbers.get(issue.missing.what, 0) + issue.missing.count
    return Message.joined(", ", (count_of(number, kind) for kind, number in numbers.items()))
