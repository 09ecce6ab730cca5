"""Choose the router on which a program is timed if the user named no machine."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from leafcut.gcode.words import COMMENT
from leafcut.model.toolpath import Kind

if TYPE_CHECKING:
    from leafcut.gcode.program import Program
    from leafcut.model.machine import Machine

#: Number of lines at the top of a program whose comments may name the machine.
_TOP = 200
#: Names of router software and controllers in comments, with the machine profile; makers come before firmware.
#: "Carbide" alone would match the material of a tool.
_NAMED = (
    (re.compile(r"open\s?builds", re.IGNORECASE), "openbuilds-router"),
    (re.compile(r"shapeoko|carbide\s?(?:3d|create|motion)", re.IGNORECASE), "shapeoko-router"),
    (re.compile(r"\bgrbl", re.IGNORECASE), "shapeoko-router"),
)
#: Controllers of both routers and mills. A program with the spindle speed of a router is for a router.
_WITH_SPEED = (
    (re.compile(r"\bmach\s?4\b", re.IGNORECASE), "mach4-router"),
    (re.compile(r"\bmach\s?[23]\b", re.IGNORECASE), "mach3-router"),
    (re.compile(r"\buccnc\b", re.IGNORECASE), "uccnc-router"),
    (re.compile(r"\bmasso\b", re.IGNORECASE), "masso-router"),
    (re.compile(r"\beding\s?cnc\b", re.IGNORECASE), "edingcnc-router"),
)
#: Names of machining centres and high-speed mills in comments; their spindles can be as fast as router spindles.
_CENTRE = re.compile(
    r"\b(?:haas|fanuc|mazak|okuma|doosan|hurco|brother|mori|makino|datron|tormach|fadal|sinumerik|heidenhain|fagor|"
    r"centroid|syil)\b",
    re.IGNORECASE,
)
#: Range of router spindle speeds, rpm: VFD spindles reach 24000, trim routers 30000. Belt-driven mills and most
#: machining centres stay below.
_ROUTER_RPM = (12_000.0, 30_000.0)


def router_for(program: Program) -> tuple[str, str] | None:
    """Return the router profile that a program indicates, and the word that indicates it, or None without such a
    word.
    """
    top = " ".join(text for line in program.lines[:_TOP] for text in COMMENT.findall(line))
    for name, machine in _NAMED:
        if named := name.search(top):
            return machine, named[0]
    path = program.path
    fastest = float(np.max(np.abs(path.value[path.kind == Kind.SPINDLE]), initial=0.0))
    if not _ROUTER_RPM[0] <= fastest <= _ROUTER_RPM[1] or _CENTRE.search(top):
        return None
    machine = next((machine for name, machine in _WITH_SPEED if name.search(top)), "mach3-router")
    return machine, f"S{fastest:.0f}"


def timed_as(machine: Machine, router: Machine) -> Machine:
    """Return a machine with the motion and times of a router, but with its own limits.

    The router is only assumed, so the maximum feed is the lower of the two. Units, travel, heights and spindle of the
    machine stay.
    """
    return replace(
        machine,
        name=router.name,
        description=router.description,
        rapid_velocity=router.rapid_velocity,
        acceleration=router.acceleration,
        acceleration_factor=router.acceleration_factor,
        max_feed=min(machine.max_feed, router.max_feed),
        corners=router.corners or ("grbl" if router.control.startswith("grbl") else "round"),
        corner_deviation=router.corner_deviation,
        arc_tolerance=router.arc_tolerance,
        steps_per_mm=router.steps_per_mm,
        motor_lock_s=router.motor_lock_s,
        tool_change_s=router.tool_change_s,
        spindle_start_s=router.spindle_start_s,
    )
