"""`Machine`: the properties of a machine that affect its programs and the time to run them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from leafcut.model.kinds import Head

XYZ = tuple[float, float, float]


@dataclass(frozen=True)
class Probe:
    """Touch-off of the sheet with the torch: the torch moves down until a switch trips.

    Attributes
    ----------
    feed
        Feed, mm/s.
    depth
        Distance below Z0 at which the controller raises an alarm, mm.
    switch_offset
        Distance that the torch moves between touching the sheet and tripping the switch, mm; 0 if the tip itself is the
        switch.
    """

    feed: float
    depth: float = 20.0
    switch_offset: float = 0.0


@dataclass(frozen=True)
class Machine:
    """A three-axis machine. Units are mm, mm/s, mm/s², s and rpm, and vectors are (x, y, z).

    Attributes
    ----------
    name, description, controller, head
        `controller` is the name of a dialect, or the path of its TOML file. `head` is spindle, torch (plasma), laser,
        flame or water.
    cut_process
        Cutting process with power, as named in cut charts (``laser_fiber_3kW``). Empty if unknown, or for a spindle.
    family
        The shipped dialect that the controller's own dialect extends. It determines the timing model.
    units
        ``mm`` or ``in``: the units that the controller assumes if a program has no units word.
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
        Motor steps per mm for each axis of a GRBL board ($100 to $102). Moves end at whole steps.
    motor_lock_s
        Time that GRBL waits after every motion before it releases the motors, s ($1). The value 255 counts as 0.
    max_feed
        Maximum programmed feed, mm/s.
    travel_min, travel_max
        Travel limits in machine coordinates. An unknown limit is -inf or inf, and is not checked.
    work_offset
        Program zero in machine coordinates. If it is None, the zero is unknown, so only the size of the job can be
        checked.
    home
        Position of the spindle in machine coordinates before and after a program.
    spindle_min_rpm, spindle_max_rpm
        Range of spindle speeds.
    tool_changer
        Whether M6 changes the tool automatically. If not, the program pauses for a manual change.
    preselect_tool, optional_stop
        Whether programs preselect the next tool after each change, and have an optional stop (M1) before each change.
    tool_change_s
        Time of a tool change. For an automatic change, this is the chip-to-chip time.
    tool_change_position
        Position (x, y) of the table for a tool change in machine coordinates; None if the table does not move.
    spindle_power, spindle_torque, max_thrust
        Maximum spindle power and torque, W and N·mm, and maximum thrust of the z axis, N; 0 if unknown.
    spindle_start_s
        Dwell until the spindle has reached its speed.
    safe_z
        Machine coordinate z of a safe height for tool changes and for the end of a program. If it is None, the
        clearance height of the program applies.
    nozzle_diameter
        Width of the head just above the sheet, mm; 0 if unknown.
    probe
        Touch-off of the sheet in programs, or None.
    sources
        Maps a key to the source of its value, or to "estimate: …".
    assumed
        Maps a key that the profile lacks to the value that leafcut assumes, with the reason, in words.
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
        """Return the travel length of an axis, mm, or inf if it is unknown."""
        return self.travel_max[axis] - self.travel_min[axis]

    @property
    def table_known(self) -> bool:
        """Whether both travel limits of the x and y axes are known."""
        return all(math.isfinite(self.reach(axis)) for axis in (0, 1))

    @property
    def control(self) -> str:
        """The dialect that determines the motion model: the shipped dialect, or else the controller's own dialect."""
        return self.family or self.controller
