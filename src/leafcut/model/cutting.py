"""`CutPlan`: the cuts of a sheet in order, with chart data, leads, times and costs.

A cut is a single run of the torch, from the pierce until the torch is switched off. Its path is the centre line of the
kerf, including leads. Positions along the path are in mm from its start.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.sheet import Sheet

#: Directions of a cut. An open contour is cut ``forward``, as drawn, or ``backward``.
DIRECTIONS = ("clockwise", "counter-clockwise", "forward", "backward")

#: Properties of a cut that a plan file can lock.
FIXABLE = ("order", "start", "direction", "lead", "bridge", "ahead")

#: Styles of a lead.
LEAD_STYLES = ("arc", "line", "none")


@dataclass(frozen=True)
class ConsumptionRates:
    """How much a cutting process consumes, according to the cut chart. Values that the chart lacks are None or "".

    The lives of consumables are in seconds of cutting and in pierces.

    Attributes
    ----------
    gas, second_gas
        Plasma or cutting gas, and shield, assist or fuel gas. Flows are in standard litres per second.
    power
        Input power while the torch is on, W.
    abrasive
        Abrasive, kg/s.
    """

    nozzle: str = ""
    gas: str = ""
    gas_flow: float | None = None
    second_gas: str = ""
    second_gas_flow: float | None = None
    power: float | None = None
    abrasive: float | None = None
    nozzle_life: float | None = None
    nozzle_pierces: float | None = None
    electrode_life: float | None = None
    electrode_pierces: float | None = None


@dataclass(frozen=True)
class CutData:
    """A row of a cut chart: the parameters for a material and a thickness."""

    process: str
    material: str
    thickness: float
    feed: float
    kerf: float
    amps: float | None = None
    pierce_height: float = 0.0
    pierce_delay: float = 0.0
    cut_height: float = 0.0
    volts: float | None = None
    can_pierce: bool = True
    source: str = ""
    confidence: str = ""
    rates: ConsumptionRates = ConsumptionRates()


@dataclass(frozen=True)
class Lead:
    """A lead-in or lead-out.

    Attributes
    ----------
    angle
        Angle between a straight lead and the contour, or sweep of an arc, rad.
    run_in
        Length of the straight segment before an arc, mm. The controller activates its compensation on this segment.
    """

    style: str = "none"
    length: float = 0.0
    angle: float = 0.0
    run_in: float = 0.0


@dataclass(frozen=True)
class CutChoice:
    """Choices for a cut that the user can change in a plan file.

    Attributes
    ----------
    contours
        Indices into `Sheet.contours`, in cutting order.
    start
        Start on the drawn contour, x and y in mm; None if not chosen yet.
    direction
        One of `DIRECTIONS`; empty if not chosen yet.
    lead_in, lead_out
        The leads; None if not chosen yet.
    fixed
        Properties from `FIXABLE` that must not change: ``order`` (after all preceding cuts with a fixed order),
        ``start``, ``direction``, ``lead``, ``bridge`` (reached by a bridge), ``ahead`` (before all cuts listed below).
    bridge
        Whether the torch stays on after the previous cut and cuts through the scrap to this cut, without a pierce.
    """

    contours: tuple[int, ...]
    start: tuple[float, float] | None = None
    direction: str = ""
    lead_in: Lead | None = None
    lead_out: Lead | None = None
    fixed: tuple[str, ...] = ()
    bridge: bool = False


@dataclass(frozen=True)
class ContourPrint:
    """Properties that identify a contour from a plan file in a drawing, mm and mm²."""

    kind: str
    length: float
    area: float
    start: tuple[float, float]
    layer: str = ""
    handle: str = ""

    @classmethod
    def of(cls, contour: Contour) -> ContourPrint:
        """Compute the properties that identify a contour."""
        path = contour.path
        return cls(contour.kind, path.length, abs(path.area), path.start, contour.layer, contour.handle)


@dataclass(frozen=True)
class PlanFile:
    """The content of a plan file.

    It contains the identifying properties of the contours, and the choices of all cuts, in order.
    """

    sheet: str
    contours: tuple[ContourPrint, ...]
    cuts: tuple[CutChoice, ...]
    process: str = ""
    material: str = ""
    thickness: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class Cut:
    """A single run of the torch.

    Attributes
    ----------
    contours
        Indices into `Sheet.contours`, in cutting order. A chain cut has several.
    path
        Open path: lead-in, contours offset by half a kerf, overcut, lead-out. With `compensation` 41 or 42, the path is
        the drawn contour, and the controller offsets it.
    lead_in, lead_out
        Positions along the path where the lead-in ends and where the lead-out (or the overcut) starts, mm.
    torch_off_at
        Position where the torch is switched off while the head keeps moving, mm. If the torch stays on, this is the
        length of the path.
    joints
        Micro-joints as pairs (from, to), mm along the path. The torch is off there, so the part stays attached.
    speeds
        Pairs (position along the path, mm, feed from there on, mm/s), in order. The first position is 0.
    pierce
        False for a cut that starts in the air outside the sheet.
    compensation
        40 if the path is the centre of the kerf; 41 or 42 if the controller compensates to the left or to the right.
    loops
        Loops around sharp corners, in the scrap, as pairs (from, to), mm along the path.
    small_hole
        Whether the rules for small holes apply (lower speed, height control off).
    bridges
        Moves through the scrap between two contours of a chain, as pairs (from, to), mm along the path.
    group
        Number of the group of parts with common lines, from 1; 0 for no group. For the cut around the group, `contours`
        has all outlines of the group. For a common line, it has the adjacent outlines.
    common
        Length of a common line between two parts, mm; 0 for other cuts.
    """

    contours: tuple[int, ...]
    path: Polyline
    lead_in: float
    lead_out: float
    torch_off_at: float
    speeds: tuple[tuple[float, float], ...]
    choice: CutChoice
    joints: tuple[tuple[float, float], ...] = ()
    loops: tuple[tuple[float, float], ...] = ()
    pierce: bool = True
    kind: str = "cut"
    part: int = 0
    compensation: int = 40
    small_hole: bool = False
    bridges: tuple[tuple[float, float], ...] = ()
    chained: tuple[CutChoice, ...] = ()
    group: int = 0
    common: float = 0.0

    @property
    def choices(self) -> tuple[CutChoice, ...]:
        """The choices for all contours of the cut."""
        return (self.choice, *self.chained)

    @cached_property
    def seconds(self) -> float:
        """Time to follow the path at its programmed speeds, s. It includes neither the pierce nor acceleration."""
        edges = [*(at for at, _ in self.speeds[1:]), self.path.length]
        start, total = 0.0, 0.0
        for end, (_, feed) in zip(edges, self.speeds, strict=True):
            total += max(end - start, 0.0) / feed
            start = max(start, end)
        return total


@dataclass(frozen=True)
class CutTimes:
    """Cycle time and lengths of a part, a sheet or a batch, in s and mm.

    Attributes
    ----------
    cut_s, pierce_s, rapid_s
        Time of motion with the torch on, time at rest for pierces, and time of all other motion.
    perimeter_mm
        Length of the drawn contours.
    rapid_mm
        Length of the moves between cuts in x and y.
    """

    cut_s: float = 0.0
    pierce_s: float = 0.0
    rapid_s: float = 0.0
    cut_mm: float = 0.0
    rapid_mm: float = 0.0
    perimeter_mm: float = 0.0
    common_mm: float = 0.0
    pierces: int = 0

    @property
    def total_s(self) -> float:
        """Total time, s."""
        return self.cut_s + self.pierce_s + self.rapid_s

    @property
    def length_mm(self) -> float:
        """Length of the route as defined in publications, mm.

        The route consists of the perimeters and the moves between cuts. Common edges count only once.
        """
        return self.perimeter_mm - self.common_mm + self.rapid_mm

    def multiplied_by(self, count: int) -> CutTimes:
        """Multiply the values by a number of pieces."""
        return CutTimes(
            self.cut_s * count,
            self.pierce_s * count,
            self.rapid_s * count,
            self.cut_mm * count,
            self.rapid_mm * count,
            self.perimeter_mm * count,
            self.common_mm * count,
            self.pierces * count,
        )


@dataclass(frozen=True)
class Consumption:
    """Consumption of a part, a sheet or a batch. A value is None if the cut chart does not have it.

    Gas is in litres at standard conditions, energy in kWh, and abrasive in kg. The numbers of nozzles and electrodes
    may be fractions. With `at_arc`, the energy is measured at the arc, so it excludes the losses of the power source.
    """

    gas_l: float | None = None
    second_gas_l: float | None = None
    energy_kwh: float | None = None
    abrasive_kg: float | None = None
    nozzles: float | None = None
    electrodes: float | None = None
    at_arc: bool = False


@dataclass(frozen=True)
class PartTimes:
    """A part on a sheet, with its share of time and cost. The times include the moves to the cuts of the part.

    Attributes
    ----------
    part
        Number of the part, from 1, or 0 for cuts that do not belong to any part.
    name
        Name from the drawing, or empty.
    area
        Area, mm².
    """

    part: int
    area: float
    times: CutTimes
    cost: float = 0.0
    name: str = ""
    used: Consumption = Consumption()


@dataclass(frozen=True)
class CutMeasures:
    """Times, costs and consumption of a sheet.

    Attributes
    ----------
    cuts
        Times of every cut in the order of the plan, including the move to its start.
    utilisation
        Area of the parts divided by the area of the sheet, 0 to 1; None if the size of the sheet is unknown.
    cost, batch_cost
        Cost in the currency of the rates, including the price of the sheet; 0 if neither rates nor price are known.
    """

    sheet: CutTimes = field(default_factory=CutTimes)
    batch: CutTimes = field(default_factory=CutTimes)
    quantity: int = 1
    parts: tuple[PartTimes, ...] = ()
    utilisation: float | None = None
    cost: float = 0.0
    batch_cost: float = 0.0
    cuts: tuple[CutTimes, ...] = ()
    used: Consumption = Consumption()
    batch_used: Consumption = Consumption()


@dataclass(frozen=True)
class CutPlan:
    """A sheet and its cuts in order.

    `crossings` is the number of travel moves across detached parts, or None if the head rises between cuts. `close` is
    the number of other travel moves that pass a detached part at a distance smaller than the nozzle width.
    """

    sheet: Sheet
    data: CutData
    cuts: tuple[Cut, ...]
    measures: CutMeasures = field(default_factory=CutMeasures)
    crossings: int | None = None
    close: int = 0

    @property
    def file(self) -> PlanFile:
        """The content of the plan file."""
        return PlanFile(
            sheet=self.sheet.name,
            contours=tuple(ContourPrint.of(c) for c in self.sheet.contours),
            cuts=tuple(choice for c in self.cuts for choice in c.choices),
            process=self.data.process,
            material=self.data.material,
            thickness=self.data.thickness,
        )
