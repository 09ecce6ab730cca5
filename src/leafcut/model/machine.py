"""`Machine`: the properties of a machine that affect its programs and their times."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from leafcut.model.kinds import Head

XYZ = tuple[float, float, float]


@dataclass(frozen=True)
class Probe:
    """Touch-off of the sheet with the torch, which moves down until a switch trips.

    `feed` is in mm/s. At `depth` mm below Z0, the controller raises an alarm. `switch_offset` is the Z travel from
    contact to the trip of the switch, mm; 0 if the tip itself is the switch.
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
        Cutting process with power, as named in cut charts (``laser_fiber_3kW``); empty if unknown, or for a spindle.
    family
        The shipped dialect on which the controller's own dialect is based; it determines the timing model.
    units
        ``mm`` or ``in``: units that the controller assumes for programs without a units word.
    rapid_style
        ``linear`` if the axes move together on a straight line, ``dogleg`` if each axis moves at its own speed.
    rapid_velocity, acceleration
        Maximum velocity of rapids, and acceleration, of each axis.
    acceleration_factor
        Share of the acceleration available on a move that starts and ends at rest (LinuxCNC reserves 10 %,
        `[TRAJ]ARC_BLEND_KINK_RATIO`).
    corners
        Corner model: ``linuxcnc`` (blends, arcs in corners, tangents), ``grbl`` (junction deviation, also for rapids)
        or ``round`` (junction deviation between feed moves, rapids stop). If empty, LinuxCNC and GRBL use their own
        model, and all other controllers use ``round``.
    corner_deviation
        Junction deviation for ``grbl`` and ``round`` corners, mm.
    arc_tolerance
        Chord tolerance of GRBL's arcs, mm ($12).
    steps_per_mm
        Motor steps per mm of each axis of a GRBL board ($100 to $102); its moves end at whole steps.
    motor_lock_s
        Time for which GRBL waits after every motion before it releases the motors, s ($1; 255 is 0).
    max_feed
        Maximum programmed feed, mm/s.
    travel_min, travel_max
        Limits of travel in machine coordinates. An unknown limit is -inf or inf, and is not checked.
    work_offset
        Program zero in machine coordinates; None if unknown, so that only the size of the job can be checked.
    home
        Machine coordinates of the spindle before and after a program.
    spindle_min_rpm, spindle_max_rpm
        Range of spindle speeds.
    tool_changer
        Whether M6 changes the tool automatically; if not, the program pauses for a manual change.
    preselect_tool, optional_stop
        Whether programs name the next tool after each change, and have an optional stop (M1) before each change.
    tool_change_s
        Time of a change, chip to chip if automatic.
    tool_change_position
        Machine coordinates (x, y) of the table for a tool change; None if the table does not move.
    spindle_power, spindle_torque, max_thrust
        Maximum spindle power and torque, W and N·mm, and maximum thrust of the z axis, N; 0 if unknown.
    spindle_start_s
        Dwell for the spindle to reach its speed.
    safe_z
        Machine coordinate z of a safe height for tool changes and for the end of a program; None to use the clearance
        height of the program.
    nozzle_diameter
        Width of the head just above the sheet, mm; 0 if unknown.
    probe
        Touch-off of the sheet in programs, or None.
    sources
        Key → source of the value, or "estimate: …".
    assumed
        Key → value and reason, in words, for values that the profile lacks and leafcut assumes.
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
        """Whether both ends of the x and y axes are known."""
        return all(math.isfinite(self.reach(axis)) for axis in (0, 1))

    @property
    def control(self) -> str:
        """The dialect whose motion model applies: the shipped dialect if known, otherwise the controller's own."""
        return self.family or self.controller
