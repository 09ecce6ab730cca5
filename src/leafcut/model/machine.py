"""`Machine`: properties of a machine that its programs and their times depend on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from leafcut.model.kinds import Head

XYZ = tuple[float, float, float]


@dataclass(frozen=True)
class Probe:
    """Touch-off of the sheet with the torch: down to contact, then on until the switch trips.

    `feed` is mm/s. At `depth` mm below Z0 the controller raises an alarm. `switch_offset` is the Z travel from contact
    to tripping of the switch, mm; 0 if the tip itself is the switch.
    """

    feed: float
    depth: float = 20.0
    switch_offset: float = 0.0


@dataclass(frozen=True)
class Machine:
    """A three-axis machine: mm, mm/s, mm/s², s, rpm; vectors are (x, y, z).

    Attributes
    ----------
    name, description, controller, head
        `controller` is the name of a dialect, or the path of its TOML file; `head` is spindle, torch (plasma),
        laser, flame or water.
    cut_process
        Cutting process with power, as named in cut charts (``laser_fiber_3kW``); empty: unknown, or a spindle.
    family
        Shipped dialect on which an own dialect of the controller is based; it determines the timing model.
    units
        ``mm`` or ``in``: units that the controller assumes for programs without a units word.
    rapid_style
        ``linear``: all axes arrive together on a straight line. ``dogleg``: each axis at its own speed.
    rapid_velocity, acceleration
        Per axis.
    acceleration_factor
        Fraction of the acceleration used on a move that starts and ends at rest (LinuxCNC holds 10 % back,
        `[TRAJ]ARC_BLEND_KINK_RATIO`).
    corners
        Corner model: ``linuxcnc`` (blends, arcs in corners, tangents), ``grbl`` (junction deviation, for rapids too) or
        ``round`` (junction deviation between feed moves, rapids end in position); empty: the model named like the
        controller (LinuxCNC, GRBL), else ``round``.
    corner_deviation
        Junction deviation for ``grbl`` and ``round`` corners, mm.
    arc_tolerance
        Chord tolerance of GRBL's arcs, mm ($12).
    steps_per_mm
        Per axis, of a GRBL board ($100 to $102), whose moves end at whole steps.
    motor_lock_s
        Time for which GRBL holds its motors after every motion and does nothing else, s ($1; 255 is 0).
    max_feed
        Highest programmed feed, mm/s.
    travel_min, travel_max
        Machine coordinates; -inf and inf for unknown ends of an axis, which are not checked.
    work_offset
        Program zero in machine coordinates if known, else None: then only the size of the job can be checked.
    home
        Machine coordinates of the spindle before and after a program.
    spindle_min_rpm, spindle_max_rpm
    tool_changer
        True: M6 changes the tool automatically; False: the program pauses for a manual change.
    preselect_tool, optional_stop
        Whether programs name the next tool after each change, and have an optional stop (M1) before each change.
    tool_change_s
        Time of a change, chip to chip if automatic.
    tool_change_position
        Machine coordinates (x, y) of the table for a change, or None: it stays in place.
    spindle_power, spindle_torque, max_thrust
        Maximum spindle power and torque, W and N·mm, and maximum thrust of the z axis, N; 0 if unknown.
    spindle_start_s
        Dwell for the spindle to reach its speed.
    safe_z
        Machine coordinate z of a safe height for tool changes and the end of a program, or None: the program's own
        clearance height is used.
    nozzle_diameter
        Width of the head just above the sheet, mm; 0 if unknown.
    probe
        Touch-off of the sheet in programs, or None.
    sources
        Source of each value, by key, or "estimate: …".
    assumed
        Values missing in the profile and assumed by leafcut, by key: the value and the reason, in words.
    """

    name: str
    description: str
    controller: str
    rapid_velocity: XYZ
    acceleration: XYZ
    max_feed: float
    travel_min: XYZ
    travel_max: XYZ
    head: Head = Head.SPINDLE
    cut_process: str = ""
    units: str = "mm"
    rapid_style: str = "linear"
    acceleration_factor: float = 1.0
    home: XYZ = (0.0, 0.0, 0.0)
    work_offset: XYZ | None = None
    spindle_min_rpm: float = 0.0
    spindle_max_rpm: float = 10_000.0
    spindle_power: float = 0.0
    spindle_torque: float = 0.0
    max_thrust: float = 0.0
    tool_changer: bool = True
    preselect_tool: bool = False
    optional_stop: bool = False
    tool_change_s: float = 10.0
    tool_change_position: tuple[float, float] | None = None
    spindle_start_s: float = 0.0
    safe_z: float | None = None
    corners: str = ""
    corner_deviation: float = 0.01
    arc_tolerance: float = 0.002
    steps_per_mm: XYZ = (250.0, 250.0, 250.0)
    motor_lock_s: float = 0.025
    nozzle_diameter: float = 0.0
    probe: Probe | None = None
    family: str = ""
    sources: dict[str, str] = field(default_factory=dict)
    assumed: dict[str, str] = field(default_factory=dict)

    def reach(self, axis: int) -> float:
        """Return the length of an axis, mm; inf if unknown."""
        return self.travel_max[axis] - self.travel_min[axis]

    @property
    def table_known(self) -> bool:
        """Whether both ends of x and of y are known."""
        return all(math.isfinite(self.reach(axis)) for axis in (0, 1))

    @property
    def control(self) -> str:
        """The dialect whose motion model applies: a shipped one if known."""
        return self.family or self.controller
