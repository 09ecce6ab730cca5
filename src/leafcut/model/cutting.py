"""`CutPlan`: how a sheet is cut, cut by cut; what the chart, the rules and the order came to.

A cut is one run of the torch: from the pierce to where the torch is off for good. Its path is what the middle of the
kerf follows, leads included; places along it are said in mm from its start.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from leafcut.geometry.polyline import Polyline
from leafcut.model.sheet import Sheet, SheetContour

#: Which way round a closed contour is cut; an open one runs ``forward``, as it is drawn, or ``backward``.
DIRECTIONS = ("clockwise", "counter-clockwise", "forward", "backward")

#: What of a cut a plan file can fix.
FIXABLE = ("order", "start", "direction", "lead", "bridge", "ahead")

#: What a lead can look like.
LEAD_STYLES = ("arc", "line", "none")


@dataclass(frozen=True)
class ConsumptionRates:
    """What a way of cutting uses up, as the cut chart has it; None and "" for what the chart does not say.

    Attributes
    ----------
    nozzle
        Which nozzle it is cut with, in the words of the chart.
    gas, second_gas
        What flows while the torch is on: plasma or cutting gas, and shield, assist or fuel gas.
    gas_flow, second_gas_flow
        Litres at standard conditions per second.
    power
        Drawn while the torch is on, W.
    abrasive
        kg/s.
    nozzle_life, electrode_life
        Seconds of cutting.
    nozzle_pierces, electrode_pierces
        Pierces that it lasts.
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
    """One row of a cut chart: how a material of a thickness is cut.

    Attributes
    ----------
    process
        ``plasma``, ``oxyfuel``, ``waterjet``, or a laser by its power: ``laser_fiber_3kW``.
    material
        As charts name it: ``mild_steel``, ``stainless_304``, ``aluminium``.
    thickness
        mm.
    amps
        Current of a plasma, A; None for the others.
    feed
        Cutting speed, mm/s.
    pierce_height, cut_height
        Of the torch over the sheet, mm.
    pierce_delay
        From the arc on to the first move, s.
    kerf
        Width of the cut, mm.
    volts
        Of the arc, or None.
    can_pierce
        False where the chart says no pierce height and delay: above the pierce capacity a cut starts at the edge.
    source, confidence
        Where the row is from, and how far to trust it.
    rates
        What it uses up, as far as the chart says.
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
    """One lead: how a cut comes to its contour, or leaves it.

    Attributes
    ----------
    style
        One of `LEAD_STYLES`.
    length
        Of the line or the arc, mm.
    angle
        Of a line to the contour where they meet; that an arc turns by, rad.
    run_in
        A straight piece before the arc, mm, on which a controller takes up its compensation.
    """

    style: str = "none"
    length: float = 0.0
    angle: float = 0.0
    run_in: float = 0.0


@dataclass(frozen=True)
class CutChoice:
    """What there was to choose of one cut, and what a person may change in a plan file.

    Attributes
    ----------
    contours
        Of `Sheet.contours`, in the order in which they are cut.
    start
        Where on the drawn contour the cut begins, x and y in mm; None: to be chosen.
    direction
        One of `DIRECTIONS`, or empty: to be chosen.
    lead_in, lead_out
        None: to be chosen.
    fixed
        What must stay as it is, of `FIXABLE`: its ``order`` (it comes after the cuts before it in the plan whose order
        is fixed, too), where it begins (``start``), its ``direction``, its ``lead``, that it is come
        to by a ``bridge``, that it goes ``ahead``: all that follow it in the plan come after it.
    bridge
        True: the torch comes from the cut before through the scrap, burning, without a pierce.
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
    """What a contour is known by again: lengths in mm, area in mm², where it begins, and its name in the drawing."""

    kind: str
    length: float
    area: float
    start: tuple[float, float]
    layer: str = ""
    handle: str = ""

    @classmethod
    def of(cls, contour: SheetContour) -> ContourPrint:
        """Return what a contour of a sheet is known by again."""
        c = contour.contour
        return cls(c.kind, c.path.length, abs(c.path.area), c.path.start, c.layer, c.handle)


@dataclass(frozen=True)
class PlanFile:
    """What a plan file holds: the contours it was made for, and the choices of every cut, in order."""

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
        Of `Sheet.contours`, in the order in which they are cut; several in a chain cut.
    path
        Open: lead-in, contours beside which the kerf runs, overcut, lead-out. Beside `compensation` 41 and 42 it is
        the drawn contour itself, and the controller keeps half a kerf away.
    lead_in, lead_out
        Where along the path the lead-in ends and the lead-out (or the overcut) begins, mm.
    torch_off_at
        Where the torch goes off while it moves on, mm; the length of the path when it does not.
    joints
        (from, to) in mm along the path: places where the torch is off in between, so that the part hangs on.
    speeds
        (from mm, feed mm/s) in order, the first from 0.
    pierce
        False: it starts beyond the sheet's edge, in the air.
    kind
        ``cut`` or ``mark``.
    part
        Number of the part it belongs to, from 1; 0 for none.
    compensation
        40: the path is the kerf's middle. 41, 42: the controller compensates to the left, to the right.
    loops
        (from, to) in mm along the path: loops round sharp corners, in scrap.
    small_hole
        True: cut by the rules of small holes (slower, height control off).
    choice
        What was chosen, as a plan file has it; of a chain, for its first contour.
    bridges
        (from, to) in mm along the path: ways through the scrap from one contour of a chain to the next.
    chained
        What was chosen for the other contours of a chain, in order.
    group
        Number of the group of parts with common lines to which it belongs, from 1; 0 for none. The cut around a group
        has all outlines of it as `contours`, a common line those beside it.
    common
        Of a common line: how much of it is an edge of two parts, mm; 0 for all else.
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
        """What was chosen for every contour, in order."""
        return (self.choice, *self.chained)

    @cached_property
    def seconds(self) -> float:
        """Time of the path at its speeds, s, without the pierce and as if speeds changed at once."""
        edges = [*(at for at, _ in self.speeds[1:]), self.path.length]
        begin, total = 0.0, 0.0
        for end, (_, feed) in zip(edges, self.speeds, strict=True):
            total += max(end - begin, 0.0) / feed
            begin = max(begin, end)
        return total


@dataclass(frozen=True)
class CutTimes:
    """Time norm and lengths of a part, a sheet or a batch: s and mm.

    `cut_s` is with the torch on, `pierce_s` what stands still for the pierces, `rapid_s` all else that moves.
    `perimeter_mm` is of the contours as drawn, `rapid_mm` in x and y from cut to cut; `length_mm` is the published
    measure of a route: the perimeters, less what edges are cut once for two parts, plus the moves in between.
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
        """All of the time, s."""
        return self.cut_s + self.pierce_s + self.rapid_s

    @property
    def length_mm(self) -> float:
        """Perimeters − common edges + moves in between, mm."""
        return self.perimeter_mm - self.common_mm + self.rapid_mm

    def times(self, count: int) -> CutTimes:
        """Return the same for so many of it."""
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
    """What a part, a sheet or a batch uses up; None for what the cut chart does not say.

    Gas in litres at standard conditions, energy in kWh, abrasive in kg; of nozzles and electrodes the part of one, or
    how many. `at_arc`: the energy is that of the arc, without what the power source loses.
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
    """One part of a sheet: its number from 1 (0: what belongs to no part), its area in mm² and its share of the time.

    The moves to a part's cuts count as the part's. Its name is the drawing's, or empty.
    """

    part: int
    area: float
    times: CutTimes
    cost: float = 0.0
    name: str = ""
    used: Consumption = Consumption()


@dataclass(frozen=True)
class CutMeasures:
    """What a sheet costs.

    Attributes
    ----------
    sheet, batch
        Of one sheet, and of `quantity` sheets.
    parts
        In the order of their numbers.
    cuts
        Of every cut, in the order of the plan, with the way to it.
    utilisation
        Area of the parts by the area of the sheet, 0 … 1; None when the sheet's size is not known.
    cost, batch_cost
        In the unit of the rates, the price of the sheet with it; 0 without both.
    used, batch_used
        What the sheet and the batch use up.
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
    """A sheet, how its material is cut, and its cuts in order.

    `crossings`: how many ways cross parts that are cut free; None where the head rises between cuts. `close`: how many
    more come nearer to one than the nozzle is wide.
    """

    sheet: Sheet
    data: CutData
    cuts: tuple[Cut, ...]
    measures: CutMeasures = field(default_factory=CutMeasures)
    crossings: int | None = None
    close: int = 0

    @property
    def file(self) -> PlanFile:
        """What its plan file holds."""
        return PlanFile(
            sheet=self.sheet.name,
            contours=tuple(ContourPrint.of(c) for c in self.sheet.contours),
            cuts=tuple(choice for c in self.cuts for choice in c.choices),
            process=self.data.process,
            material=self.data.material,
            thickness=self.data.thickness,
        )
