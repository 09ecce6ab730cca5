"""`Machine`: the facts of one machine that its programs and its time depend on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from leafcut.model.kinds import Head

XYZ = tuple[float, float, float]


@dataclass(frozen=True)
class Probe:
    """How a torch finds the sheet: down until it touches, then on until its switch trips.

    Attributes
    ----------
    feed
        mm/s.
    depth
        How far below Z0 it goes at most, before the controller gives an alarm, mm.
    switch_offset
        How far Z goes on between the torch's touching the sheet and the tripping of the switch, mm: 0 where the tip
        itself is the contact.
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
        What cuts, kind and power, as cut charts name it (``laser_fiber_3kW``); empty: not known, or a spindle.
    family
        The shipped dialect that the controller's is based on where it is not a shipped one: timing goes by it.
    units
        ``mm`` or ``in``: what the controller takes the numbers of a program for that does not say it.
    rapid_style
        ``linear``: all axes arrive together on a straight line. ``dogleg``: each axis at its own speed.
    rapid_velocity, acceleration
        Per axis.
    acceleration_factor
        Part of the acceleration that the controller uses on a move that starts and ends at rest (LinuxCNC keeps
        10 % back, `[TRAJ]ARC_BLEND_KINK_RATIO`).
    corners
        How the controller takes corners: ``linuxcnc`` (blends, arcs in corners, tangents), ``grbl`` (junction
        deviation, rapids too) or ``round`` (junction deviation between feed moves, rapids end in position); empty: as
        the controllers of that name do, and ``round`` for the others.
    corner_deviation
        How far from the corner the path may be thought to pass, mm, where corners are ``grbl`` or ``round``.
    arc_tolerance
        How far the chords may be from the arcs that GRBL cuts into them, mm ($12).
    steps_per_mm
        Per axis, of a GRBL board ($100 to $102): its moves end at whole steps.
    motor_lock_s
        For how long GRBL holds its motors after every motion and does nothing else, s ($1; 255 is 0).
    max_feed
        Highest programmed feed, mm/s.
    travel_min, travel_max
        Machine coordinates; -inf and inf where the end of an axis is not known, and nothing is checked against it.
    work_offset
        Program zero in machine coordinates where it is known, else None: then only the size of the job can be checked.
    home
        Machine coordinates where the spindle waits before and after a program.
    spindle_min_rpm, spindle_max_rpm
    tool_changer
        True: M6 changes by itself; False: a person changes, the program pauses.
    preselect_tool, optional_stop
        Whether programs name the next tool after each change, and stop before each if a switch is on (M1).
    tool_change_s
        Time of one change, chip to chip where the machine does it.
    tool_change_position
        Machine coordinates (x, y) to which the table goes for a change, or None: it stays where it is.
    spindle_power, spindle_torque, max_thrust
        What the spindle gives at most, W and N·mm, and with how much force z goes down, N; 0 where that is not known.
    spindle_start_s
        Dwell that lets the spindle reach its speed.
    safe_z
        Machine coordinate z of a safe height for tool changes and the end of a program, or None: the program's own
        clearance height is used.
    nozzle_diameter
        How wide its head is just above the sheet, mm; 0 where that is not known.
    probe
        How its torch finds the sheet where the program does that, or None.
    sources
        Where each value comes from, by key, or "estimate: …".
    assumed
        What its profile does not say and was taken as leafcut's own figure, by key: the value and why, in words.
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
        """Return how far an axis goes, mm; inf where that is not known."""
        return self.travel_max[axis] - self.travel_min[axis]

    @property
    def table_known(self) -> bool:
        """Whether both ends of x and of y are known."""
        return all(math.isfinite(self.reach(axis)) for axis in (0, 1))

    @property
    def control(self) -> str:
        """The dialect of the controller that moves as this machine's does, a shipped one where any is known."""
        return self.family or self.controller
