"""`CutPlan`: the cuts of a sheet in order, with chart data, lead-ins, times and costs.

A cut is one run of the torch, from the pierce to the final torch-off. Its path is the centre line of the kerf including
leads; positions along it are in mm from its start.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from leafcut.geometry.polyline import Polyline
from leafcut.model.contour import Contour
from leafcut.model.sheet import Sheet

#: Directions of a cut; an open contour is cut ``forward``, as drawn, or ``backward``.
DIRECTIONS = ("clockwise", "counter-clockwise", "forward", "backward")

#: Properties of a cut that a plan file can fix.
FIXABLE = ("order", "start", "direction", "lead", "bridge", "ahead")

#: Styles of a lead.
LEAD_STYLES = ("arc", "line", "none")


@dataclass(frozen=True)
class ConsumptionRates:
    """Consumption of a cutting process from the cut chart; None and "" if the chart has no value.

    `gas` is the plasma or cutting gas, `second_gas` the shield, assist or fuel gas; flows are litres at standard
    conditions per second. `power` is the input while the torch is on, W; `abrasive` is kg/s. Lives are in seconds of
    cutting, and in pierces.
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
    """One row of a cut chart: parameters for a material of a thickness.

    Attributes
    ----------
    process
        ``plasma``, ``oxyfuel``, ``waterjet``, or a laser with its power: ``laser_fiber_3kW``.
    material
        Name in charts: ``mild_steel``, ``stainless_304``, ``aluminium``.
    amps
        Current of a plasma, A; None for the others.
    feed
        Cutting speed, mm/s.
    pierce_height, cut_height
        Height of the torch above the sheet, mm.
    pierce_delay
        Time from arc-on to the first move, s.
    kerf
        Width of the cut, mm.
    can_pierce
        False if the chart has no pierce height and delay: above the pierce capacity a cut starts at the edge.
    """

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

    `angle` is that between a line and the contour, or that of an arc, rad. `run_in` is the straight segment before the
    arc, mm, on which a controller activates its compensation.
    """

    style: str = "none"
    length: float = 0.0
    angle: float = 0.0
    run_in: float = 0.0


@dataclass(frozen=True)
class CutChoice:
    """Choices for one cut, which the user can change in a plan file.

    Attributes
    ----------
    contours
        Indices into `Sheet.contours`, in cutting order.
    start
        Start on the drawn contour, x and y in mm; None: not chosen yet.
    direction
        One of `DIRECTIONS`; empty: not chosen yet. Leads are None until chosen.
    fixed
        Fixed properties, of `FIXABLE`: ``order`` (it follows the preceding cuts in the plan with a fixed order),
        ``start``, ``direction``, ``lead``, ``bridge`` (it is reached by a bridge), ``ahead`` (it is cut before
        everything listed below it).
    bridge
        True: the torch comes from the previous cut through the scrap, burning, without a pierce.
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
    """Properties that identify a contour again, mm and mm²."""

    kind: str
    length: float
    area: float
    start: tuple[float, float]
    layer: str = ""
    handle: str = ""

    @classmethod
    def of(cls, contour: Contour) -> ContourPrint:
        """Return the properties of a contour."""
        path = contour.path
        return cls(contour.kind, path.length, abs(path.area), path.start, contour.layer, contour.handle)


@dataclass(frozen=True)
class PlanFile:
    """Content of a plan file: identification of its contours, and the choices of every cut, in order."""

    sheet: str
    contours: tuple[ContourPrint, ...]
    cuts: tuple[CutChoice, ...]
    process: str = ""
    material: str = ""
    thickness: float = 0.0
    source: str = ""


@dataclass(frozen=True)
class Cut:
    """One run of the torch.

    Attributes
    ----------
    contours
        Indices into `Sheet.contours`, in cutting order; several in a chain cut.
    path
        Open path: lead-in, contours offset by half a kerf, overcut, lead-out. With `compensation` 41 or 42 it is the
        drawn contour itself, and the controller offsets it.
    lead_in, lead_out
        Positions along the path at which the lead-in ends and the lead-out (or the overcut) starts, mm.
    torch_off_at
        Position at which the torch is switched off while moving on, mm; the length of the path if it is not.
    joints
        (from, to) in mm along the path: micro-joints, where the torch is off, so that the part stays attached.
    speeds
        (from mm, feed mm/s) in order, the first from 0.
    pierce
        False: it starts outside the sheet, in the air.
    compensation
        40: the path is the centre of the kerf. 41, 42: the controller compensates to the left, to the right.
    loops
        (from, to) in mm along the path: loops around sharp corners, in scrap.
    small_hole
        True: cut by the rules for small holes (slower, height control off).
    bridges
        (from, to) in mm along the path: moves through the scrap from one contour of a chain to the next.
    group
        Number of its group of parts with common lines, from 1; 0 for none. The cut around a group has all its outlines
        as `contours`, a common line the adjacent ones.
    common
        Length of a common line that is an edge of two parts, mm; 0 for other cuts.
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
        """Choices for every contour."""
        return (self.choice, *self.chained)

    @cached_property
    def seconds(self) -> float:
        """Time of the path at its speeds, s, without the pierce and without acceleration."""
        edges = [*(at for at, _ in self.speeds[1:]), self.path.length]
        start, total = 0.0, 0.0
        for end, (_, feed) in zip(edges, self.speeds, strict=True):
            total += max(end - start, 0.0) / feed
            start = max(start, end)
        return total


@dataclass(frozen=True)
class CutTimes:
    """Cycle time and lengths of a part, a sheet or a batch: s and mm.

    `cut_s` is with the torch on, `pierce_s` at rest for the pierces, `rapid_s` all other motion. `perimeter_mm` is the
    length of the drawn contours, `rapid_mm` the length in x and y from cut to cut; `length_mm` is the published measure
    of a route: perimeters, minus common edges counted twice, plus the moves in between.
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
        """Total, s."""
        return self.cut_s + self.pierce_s + self.rapid_s

    @property
    def length_mm(self) -> float:
        """Perimeters − common edges + moves in between, mm."""
        return self.perimeter_mm - self.common_mm + self.rapid_mm

    def times(self, count: int) -> CutTimes:
        """Values for `count` pieces."""
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
    """Consumption of a part, a sheet or a batch; None if the cut chart has no value.

    Gas in litres at standard conditions, energy in kWh, abrasive in kg; nozzles and electrodes as a number or fraction.
    `at_arc`: energy of the arc, without losses of the power source.
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
    """One part of a sheet: number from 1 (0: cuts of no part), area in mm², and its share of the time.

    The moves to a part's cuts are included. The name comes from the drawing, or is empty.
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
        Every cut in the order of the plan, including the move to it.
    utilisation
        Area of the parts divided by the area of the sheet, 0 … 1; None if the sheet's size is unknown.
    cost, batch_cost
        In the currency of the rates, including the price of the sheet; 0 without both.
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

    `crossings`: number of travel moves across detached parts; None if the head rises between cuts. `close`: number of
    other travel moves that pass a detached part within the width of the nozzle.
    """

    sheet: Sheet
    data: CutData
    cuts: tuple[Cut, ...]
    measures: CutMeasures = field(default_factory=CutMeasures)
    crossings: int | None = None
    close: int = 0

    @property
    def file(self) -> PlanFile:
        """Its plan file."""
        return PlanFile(
            sheet=self.sheet.name,
            contours=tuple(ContourPrint.of(c) for c in self.sheet.contours),
            cuts=tuple(choice for c in self.cuts for choice in c.choices),
            process=self.data.process,
            material=self.data.material,
            thickness=self.data.thickness,
        )
