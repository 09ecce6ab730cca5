"""Menus with the processes, materials, thicknesses and currents of the cut chart."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from leafcut.errors import LeafcutError, OptionError
from leafcut.read.cutchart import ChartRow, available_choices, load_chart
from leafcut.studio.folder import Folder
from leafcut.studio.page.fitting_machines import find_machine
from leafcut.studio.wording import Words
from leafcut.units import parse_quantity

#: Maps each option to its choices (value, label).
Menus = dict[str, list[tuple[str, str]]]


def chart_menus(values: Mapping[str, Any], folder: Folder, words: Words, machine: str) -> Menus:
    """Return the menus of the cut options that match the current choices.

    If the chart is invalid, there are no menus.
    """
    try:
        rows = _read_chart(_chart_path(values, folder))
    except LeafcutError:
        return {}
    thickness, amps = (_number(values.get(name), unit) for name, unit in (("thickness", "mm"), ("amps", "")))
    process = str(values.get("cut_process") or "") or _cutting_process(str(values.get("machine") or machine), folder)
    choices = available_choices(rows, process, str(values.get("material") or "mild_steel"), thickness, amps)
    return {
        "cut_process": [(name, name) for name in choices.processes],
        "material": [(name, words.item_name("material", name, name.replace("_", " "))) for name in choices.materials],
        "thickness": [(f"{mm:g}", f"{mm:g} mm") for mm in choices.thicknesses],
        "amps": [(f"{a:g}", f"{a:g} A") for a in choices.amps],
        "nozzle": [(name, name) for name in choices.nozzles],
    }


def chart_error(values: Mapping[str, Any], folder: Folder) -> str:
    """Return the error in an opened chart in one line, or an empty string if the chart is valid."""
    try:
        _read_chart(_chart_path(values, folder))
    except LeafcutError as problem:
        return folder.hide_paths(str(problem))
    return ""


def _chart_path(values: Mapping[str, Any], folder: Folder) -> Path | None:
    return folder.input_path(str(values["chart"])) if values.get("chart") else None


@lru_cache(maxsize=8)
def _read_chart(chart: Path | None) -> list[ChartRow]:
    """Return the rows of a chart. They are cached, because files that are open in the studio never change."""
    return load_chart(chart)


def _cutting_process(machine: str, folder: Folder) -> str:
    profile = find_machine(machine, folder)
    return "" if profile is None else profile.cut_process or str(profile.head.method or "")


def _number(value: Any, unit: str) -> float | None:
    try:
        return parse_quantity(str(value), unit) if unit else float(str(value))
    except (OptionError, ValueError):
        return None
