"""Report a fit to measured times: the time of each program before and after the fit, and the quality of the fit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from leafcut.report.wording import finite_or_none, print_line
from leafcut.units import format_time

if TYPE_CHECKING:
    from leafcut.model.simulation import Simulation
    from leafcut.timing.fitting import MachineFit

#: If tool changes take more than this share of the time, the report mentions them, because the profile may have a wrong
#: tool change time.
_LARGE_SHARE = 0.1


def print_fit(
    fitted: MachineFit, simulations: Sequence[Simulation], measured: Sequence[float], console: Console
) -> None:
    """Print the times of all programs, and the fitted values."""
    is_fitted = fitted.acceleration is not None or fitted.corner is not None
    table = Table("Program", box=None, pad_edge=False)
    for head in ("Measured", "leafcut", "Off", *(("Fitted", "Off") if is_fitted else ())):
        table.add_column(head, justify="right")
    for row, simulation in enumerate(simulations):
        before, after = float(fitted.before[row]), float(fitted.after[row])
        cells = [format_time(measured[row]), format_time(before), _deviation_percent(before, measured[row])]
        cells += [format_time(after), _deviation_percent(after, measured[row])] if is_fitted else []
        table.add_row(simulation.program, *cells)
    console.print(table, markup=False)
    for line in fit_lines(fitted, simulations, measured):
        print_line(console, line)


def fit_lines(fitted: MachineFit, simulations: Sequence[Simulation], measured: Sequence[float]) -> list[str]:
    """Return the lines below the table of a fit to measured times."""
    lines = []
    if len(measured) > 1:
        lines.append(
            f"root mean square error: {_root_mean_square_error(fitted.before, measured):.2f} s before, "
            f"{_root_mean_square_error(fitted.after, measured):.2f} s after"
        )
    if fitted.acceleration is not None:
        error = 100.0 * fitted.error["acceleration"]
        lines.append(f"accelerations: {fitted.acceleration:.3g} times those of the profile (± {error:.0f} %)")
    if fitted.corner is not None:
        lines.append(f"corner value: {fitted.corner:.3g} mm (± {100.0 * fitted.error['corner']:.0f} %)")
    if fitted.acceleration is not None and fitted.corner is not None:
        lines.append(f"the programs distinguish the two: condition {fitted.condition:.1f}")
    if sum(value is not None for value in (fitted.acceleration, fitted.corner)) == len(measured):
        lines.append("as many parameters as programs: the fit is exact; measure another program to test it")
    titles = {"acceleration": "accelerations", "corner": "corner value"}
    lines += [f"{titles[name]} kept: {reason}" for name, reason in fitted.held.items()]
    for simulation, seconds in zip(simulations, measured, strict=True):
        change = simulation.measure.by_kind.get("tool_change", 0.0)
        if change > _LARGE_SHARE * seconds:
            lines.append(f"{simulation.program}: {format_time(change)} of it for tool changes, as in the profile")
    return lines


def fit_as_json(
    fitted: MachineFit, simulations: Sequence[Simulation], measured: Sequence[float], written: str
) -> dict[str, Any]:
    """Return the fit as plain values for the JSON answer."""
    programs = [
        {"program": simulation.program, "measured_s": seconds, "before_s": float(before), "after_s": float(after)}
        for simulation, seconds, before, after in zip(simulations, measured, fitted.before, fitted.after, strict=True)
    ]
    return {
        "machine": simulations[0].machine.name,
        "programs": programs,
        "rms_before_s": _root_mean_square_error(fitted.before, measured),
        "rms_after_s": _root_mean_square_error(fitted.after, measured),
        "acceleration": fitted.acceleration,
        "corner_mm": fitted.corner,
        "error": {name: finite_or_none(value) for name, value in fitted.error.items()},
        "condition": finite_or_none(fitted.condition),
        "held": dict(fitted.held),
        "output": written,
    }


def _deviation_percent(seconds: float, measured: float) -> str:
    return f"{100.0 * (seconds / measured - 1.0):+.1f} %"


def _root_mean_square_error(seconds: Any, measured: Sequence[float]) -> float:
    return math.sqrt(sum((float(a) - b) ** 2 for a, b in zip(seconds, measured, strict=True)) / len(measured))
