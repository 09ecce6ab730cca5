"""Report speeds and feeds on the terminal and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from leafcut.report.json_answer import issues_as_json
from leafcut.report.wording import NO_VALUE, count_text, print_line, replace_unprintable
from leafcut.units import SECONDS_PER_MINUTE, format_time

if TYPE_CHECKING:
    from rich.console import Console

    from leafcut.model.cutting_front import CuttingData, CuttingPoint, ToolFront

_MM_PER_M = 1000.0
#: Maps each objective to the label of its best point.
_BEST = {"time": "quickest", "cost": "cheapest", "life": "longest life"}


def cutting_data_as_json(data: CuttingData, save: str | None = None, plot: str | None = None) -> dict[str, Any]:
    """Return the answer of `leafcut tools speeds --json`.

    Cutting speeds are in m/min and feeds in mm/min. All other values are in mm, s, kW, N·m and N.
    """
    return {
        **({"input": data.source} if data.source else {}),
        "machine": data.machine.name,
        "material": data.material.name,
        "objective": data.objective,
        "shop_rate_per_hour": data.shop_rate,
        "time_s": data.time,
        "cost": data.cost,
        "tools": [_tool_as_json(tool) for tool in data.tools],
        "issues": issues_as_json(data.issues),
        **({"output": save} if save else {}),
        **({"plot": plot} if plot else {}),
        **({"defaults": list(data.defaults)} if data.defaults else {}),
    }


def _tool_as_json(front: ToolFront) -> dict[str, Any]:
    return {
        "number": front.tool.number,
        "kind": front.tool.kind.value,
        "diameter": front.tool.diameter,
        "material": front.tool_material.value,
        "holes": front.holes,
        "candidates": front.candidates,
        "allowed": front.allowed,
        "sources": list(front.sources),
        "chosen": _point_as_json(front.best),
        **({"given": _point_as_json(front.given)} if front.given else {}),
        "front": [_point_as_json(point) for point in front.points],
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


def print_cutting_data(data: CuttingData, save: str | None, plot: str | None, console: Console) -> None:
    """Print the fastest, the cheapest and the longest-lasting speed and feed of each tool.

    The table also shows the speed and feed from the tool library.
    """
    from rich.table import Table

    def print_styled(words: str, style: str = "") -> None:
        print_line(console, replace_unprintable(words), style)

    print_styled(f"{data.material.name} on {data.machine.name}, chosen for {data.objective}", "bold")
    for front in data.tools:
        work = count_text(front.holes, "hole") if front.holes else "1 m of cut"
        print_styled("")
        print_styled(f"{front.tool.label}, {front.tool_material.value}: {work}")
        rows = points_to_show(front)
        table = Table(box=None, pad_edge=False, header_style="bold")
        table.add_column("")
        for name in rows:
            chosen = name == _BEST[data.objective]
            table.add_column(f"→ {name}" if chosen else name, justify="right", style="bold" if chosen else "")
        columns = [_point_cells(point) for point in rows.values()]
        for name in columns[0]:
            table.add_row(name, *(column[name] for column in columns))
        console.print(table)
        print_styled(
            f"{count_text(len(front.points), 'point')} on the front, of {front.allowed:,} within the limits and "
            f"{front.candidates:,} tried",
            "dim",
        )
        life = f"the tool life of {front.tool_material.value} in {data.material.name}"
        if any(source.startswith("estimate") for source in front.sources):
            print_styled(f"estimate: {life} has no measured source")
        elif any("from memory" in source for source in front.sources):
            print_styled(f"unverified: some constants of {life} have no printed source")
    print_styled("")
    if data.source and len(data.tools) > 1:
        print_styled(f"all tools: {format_time(data.time)} and {data.cost:.2f} for one part")
    for issue in data.issues:
        print_styled(f"{issue.severity}: {issue}")
    for file, kind in ((save, "tool library"), (plot, "picture")):
        if file:
            print_styled(f"{kind} written: {file}")


def points_to_show(front: ToolFront) -> dict[str, CuttingPoint]:
    """Return the points of the front to show: the best point for each objective, and the given point, by name."""
    points = front.points
    shown = {
        "quickest": min(points, key=lambda p: (p.time, p.cost)),
        "cheapest": min(points, key=lambda p: (p.cost, p.time)),
        "longest life": min(points, key=lambda p: (-p.life, p.cost)),
    }
    return shown | ({"as given": front.given} if front.given else {})


def _point_cells(point: CuttingPoint) -> dict[str, str]:
    """Return the cells of a point in a tool's table, by the name of the row."""
    return {
        "spindle speed": f"{point.rpm:.0f} rpm",
        "feed rate": f"{point.feed * SECONDS_PER_MINUTE:.0f} mm/min",
        "cutting speed": f"{point.speed * SECONDS_PER_MINUTE / _MM_PER_M:.1f} m/min",
        "chip load": f"{point.chip:.3f} mm",
        "time": format_time(point.time),
        "cost": f"{point.cost:.2f}",
        "tool life": format_time(point.life),
        "worn tools": f"{point.worn:.3g}",
        "power": f"{point.power / 1000.0:.2f} kW",
        "torque": f"{point.torque / 1000.0:.2f} N·m",
        "thrust": f"{point.thrust:.0f} N" if point.thrust else NO_VALUE,
    }
