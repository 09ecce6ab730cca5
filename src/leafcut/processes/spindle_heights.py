"""Whether a machine can do the work of a spindle, and whether the heights of a job agree with it and each other."""

from __future__ import annotations

from leafcut.errors import PlanError
from leafcut.model.kinds import Head
from leafcut.model.machine import Machine
from leafcut.options import JobOptions


def check_spindle_heights(machine: Machine, job: JobOptions, work: str) -> None:
    """Refuse a machine without a spindle, and heights in a wrong order; `work` is what cannot be done: "drill".

    Raises
    ------
    PlanError
        Says which.
    """
    if machine.head is not Head.SPINDLE:
        raise PlanError(f"{machine.name} has a {machine.head}, which cannot {work}; choose another --machine")
    if job.retract_height > job.clearance_height:
        raise PlanError(
            f"--retract-height {job.retract_height:g} mm is above --clearance-height {job.clearance_height:g} mm; "
            "the R plane must not be higher than the initial plane"
        )
    if machine.safe_z is not None and machine.work_offset is not None:
        height = machine.safe_z - machine.work_offset[2]
        if height < job.clearance_height:
            raise PlanError(
                f"the safe height of {machine.name}, z {machine.safe_z:g} mm in machine coordinates, is {height:g} mm "
                f"over program zero, below --clearance-height {job.clearance_height:g} mm; check --work-offset, or "
                "lower the clearance height"
            )
