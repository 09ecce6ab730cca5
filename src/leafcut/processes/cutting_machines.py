"""Which machine cuts where nobody named one."""

from __future__ import annotations

from dataclasses import replace

from leafcut.options import MachineOptions, Settings

#: The machine that cuts where none is named, by how it cuts: by the longest of these that the process begins with.
CUTTING_MACHINES = {
    "plasma": "plasma-table",
    "laser": "laser-table",
    "laser_co2": "grbl-laser-co2",
    "oxyfuel": "flame-table",
    "waterjet": "water-table",
}


def for_cutting(settings: Settings) -> Settings:
    """Return the settings with a machine that cuts so where nobody named one: the default one does not cut."""
    if "machine" in settings.given or settings.machine.machine != MachineOptions().machine:
        return settings
    how = f"{_cuts_by(settings)}_"
    fitting = (kind for kind in sorted(CUTTING_MACHINES, key=len, reverse=True) if how.startswith(f"{kind}_"))
    machine = CUTTING_MACHINES[next(fitting, "plasma")]
    return settings.but(replace(settings.machine, machine=machine))


def _cuts_by(settings: Settings) -> str:
    """Return how a sheet is cut; of lasers the one that cuts the material, where the chart knows of one kind only."""
    from leafcut.read.cutchart import kinds_for, load_chart

    asked = (settings.cut_data.cut_process or "plasma").lower()
    if asked != "laser":
        return asked
    kinds = kinds_for(load_chart(settings.cut_data.chart), asked, settings.job.material)
    return "laser_co2" if kinds and all(kind.startswith("laser_co2_") for kind in kinds) else asked
