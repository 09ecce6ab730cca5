"""The default machine for cutting sheet."""

from __future__ import annotations

from dataclasses import replace

from leafcut.options import MachineOptions, Settings

#: Default machine for each cutting process. If several prefixes match, the longest one counts.
CUTTING_MACHINES = {
    "plasma": "plasma-table",
    "laser": "laser-table",
    "laser_co2": "grbl-laser-co2",
    "oxyfuel": "flame-table",
    "waterjet": "water-table",
}


def with_default_cutting_machine(settings: Settings) -> Settings:
    """Use the default machine of the cutting process, because the general default machine cannot cut sheet."""
    if "machine" in settings.given or settings.machine.machine != MachineOptions().machine:
        return settings
    process_prefix = f"{_cut_process(settings)}_"
    fitting = (
        kind for kind in sorted(CUTTING_MACHINES, key=len, reverse=True) if process_prefix.startswith(f"{kind}_")
    )
    machine = CUTTING_MACHINES[next(fitting, "plasma")]
    return settings.but(replace(settings.machine, machine=machine))


def _cut_process(settings: Settings) -> str:
    """Return the cutting process.

    For a laser, this is ``laser_co2`` if the cut chart only has CO2 data for the material.
    """
    from leafcut.read.cutchart import load_chart, process_names_for

    requested = (settings.cut_data.cut_process or "plasma").lower()
    if requested != "laser":
        return requested
    kinds = process_names_for(load_chart(settings.cut_data.chart), requested, settings.job.material)
    return "laser_co2" if kinds and all(kind.startswith("laser_co2_") for kind in kinds) else requested
