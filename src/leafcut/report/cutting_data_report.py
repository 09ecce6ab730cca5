"""Speeds and feeds for the terminal and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from leafcut.report.json_answer import issues_as_json
from leafcut.report.wording import NO_VALUE, clean, count
from leafcut.units import SECONDS_PER_MINUTE, format_time

if TYPE_CHECKING:
    from rich.console import Console

    from leafcut.model.cutting_front import CuttingData, CuttingPoint, ToolFront

_MM_PER_M = 1000.0
#: Label of the best point per objective.
_BEST = {"time": "quickest", "cost": "cheapest", "life": "longest life"}


def cutting_data_as_json(found: CuttingData, save: str | None = None, plot: str | None = None) -> dict[str, Any]:
    """Return the answer of `leafcut tools speeds --json`: mm, s, kW, N·m, N, m/min for speeds, mm/min for feeds."""
    return {
        **({"input": found.source} if found.source else {}),
        "machine": found.machine.name,
        "material": found.material.name,
        "objective": found.objective,
        "shop_rate_per_hour": found.shop_rate,
        "time_s": found.time,
        "cost": found.cost,
        "tools": [_tool_as_json(one) for one in found.tools],
        "issues": issues_as_json(found.issues),
        **({"output": save} if save else {}),
        **({"plot": plot} if plot else {}),
        **({"defaults": list(found.defaults)} if found.defaults else {}),
    }


def _tool_as_json(one: ToolFront) -> dict[str, Any]:
    return {
        "number": one.tool.number,
        "kind": one.tool.kind.value,
        "diameter": one.tool.diameter,
        "material": one.tool_material.value,
        "holes": one.holes,
        "candidates": one.candidates,
        "allowed": one.allowed,
        "sources": list(one.sources),
        "chosen": _point_as_json(one.best),
        **({"given": _point_as_json(one.given)} if one.given else {}),
        "front": [_point_as_json(point) for point in one.points],
    }


def _point_as_json(point: CuttingPoint) -> dict[str, float]:
    return {
        "rpm": point.rpm,
        "feed_mm_min": point.feed * SECONDS_PER_MINUTE,
        "chip_mm": point.chip,
        "cutting_speed_m_min": point.speed * SECONDS_PER_MINUTE / _MM_PER_M,
        "time_s": point.time,
        "cost": point.cost,
        "tool_life_s": point.life,
        "worn_tools": point.worn,
        "power_kw": point.power / 1000.0,
        "torque_nm": point.torque / 1000.0,
        "thrust_n": point.thrust,
    }


def print_cutting_data(found: CuttingData, save: str | None, plot: str | None, console: Console) -> None:
    """Print for each tool the quickest, cheapest and longest-lived speed and feed, and the library's own."""
    from rich.table import Table

    def say(words: str, style: str = "") -> None:
        console.print(clean(words), style=style, markup=False, highlight=False, soft_wrap=True)

    say(f"{found.material.name} on {found.machine.name}, chosen for {found.objective}", "bold")
    for one in found.tools:
        work = count(one.holes, "hole") if one.holes else "milling"
        say("")
        say(f"{one.tool.label}, {one.tool_material.value}: {work}")
        rows = _shown(one)
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column("")
        for name in rows:
            chosen = name == _BEST[found.objective]
            table.add_column(f"→ {name}" if chosen else name, justify="right", style="bold" if chosen else "")
        for name, cells in zip(_NAMES, zip(*map(_cells, rows.values()), strict=True), strict=True):
            table.add_row(name, *cells)
        console.print(table)
        say(
            f"{count(len(one.points), 'point')} on the front, of {one.allowed:,} within the limits and "
            f"{one.candidates:,} tried",
            "dim",
        )
        life = f"the tool life of {one.tool_material.value} in {found.material.name}"
        if any(source.startswith("estimate") for source in one.sources):
            say(f"estimate: {life} has no measured source")
        elif any("from memory" in source for source in one.sources):
            say(f"from memory: some constants of {life} were not seen in print")
    say("")
    if len(found.tools) > 1:
        say(f"all tools: {format_time(found.time)} and {found.cost:.2f} for one part")
    for issue in found.issues:
        say(f"{issue.severity}: {issue}")
    for file, what in ((save, "tool library"), (plot, "picture")):
        if file:
            say(f"{what} written: {file}")


def _shown(one: ToolFront) -> dict[str, CuttingPoint]:
    """Return the points of a front to show, quickest first, and the library's own point."""
    points = one.points
    shown = {
        "quickest": min(points, key=lambda p: (p.time, p.cost)),
        "cheapest": min(points, key=lambda p: (p.cost, p.time)),
        "longest life": min(points, key=lambda p: (-p.life, p.cost)),
    }
    return shown | ({"as given": one.given} if one.given else {})


#: Row names of a tool's table.
_NAMES = (
    "spindle speed", "feed rate", "cutting speed", "chip", "time of a part", "cost of a part", "tool life",
    "worn tools", "power", "torque", "thrust",
)  # fmt: skip


def _cells(point: CuttingPoint) -> tuple[str, ...]:
    return (
        f"{point.rpm:.0f} rpm",
        f"{point.feed * SECONDS_PER_MINUTE:.0f} mm/min",
        f"{point.speed * SECONDS_PER_MINUTE / _MM_PER_M:.1f} m/min",
        f"{point.chip:.3f} mm",
        format_time(point.time),
        f"{point.cost:.2f}",
        format_time(point.life),
        f"{point.worn:.3g}",
        f"{point.power / 1000.0:.2f} kW",
        f"{point.torque / 1000.0:.2f} N·m",
        f"{point.thrust:.0f} N" if point.thrust else NO_VALUE,
    )
