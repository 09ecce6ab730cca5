"""Check the torch in a cutting program.

The torch must be off during rapids and at the end. It must be switched on as the chart requires, and move at the
planned feeds.
"""

from __future__ import annotations

import math
import re

import numpy as np

from leafcut.gcode.active_comments import controller_settings
from leafcut.gcode.block_description import normalize_line
from leafcut.gcode.dialects import Dialect
from leafcut.message import Message
from leafcut.model.cutting import Cut, CutPlan
from leafcut.model.difference import Difference
from leafcut.model.machine import Probe
from leafcut.model.toolpath import Kind, Motion, Toolpath
from leafcut.processes.sheet.proof.matched_runs import CutRequest
from leafcut.processes.sheet.proof.torch_runs import TorchRun
from leafcut.proof.difference import position_text
from leafcut.proof.read_back import DWELL_ROUNDING, FEED_PART, FEED_ROUNDING
from leafcut.units import MM_PER_INCH, SECONDS_PER_MINUTE

#: Tolerance for heights in the program, mm.
_ROOM = 0.002
#: Tolerance for the position along a cut at which the feed changes, mm.
_ALONG = 0.05


def check_torch(
    path: Toolpath,
    runs: list[TorchRun],
    plan: CutPlan,
    text: str,
    dialect: Dialect,
    asked: CutRequest,
) -> list[Difference]:
    """Check the torch in a program that was read back, and return the faults.

    The checks cover rapids, the material, the marking tool, probing, feeds, and how the torch is switched on.
    """
    torch, heights, lowest = dialect.torch, dialect.has_z_words, asked.safe_height
    if lowest is None:
        lowest = max(plan.data.pierce_height, plan.data.cut_height)
    found = [
        *_rapid_faults(path, lowest if heights else None),
        *_material_faults(path, text, plan, dialect, asked.material_number),
    ]
    found += check_lighting_tool(path, dialect)
    found += check_probing(path, runs, plan, asked.probe if heights else None)
    waits = torch is None or torch.waits
    for run, cut in zip(runs, plan.cuts, strict=False):
        if cut.kind == "cut":
            found += _pierce_and_cut_height_faults(run, cut, plan, heights, waits)
        found += _feed_faults(run, cut)
    return found


def check_lighting_tool(path: Toolpath, dialect: Dialect) -> list[Difference]:
    """Return a fault for each row that switches on the torch or the scribe in the wrong state.

    The state is wrong if another tool is selected, or if its offset is not active. An offset becomes
    active with the next move in X and Y.
    """
    number = None if dialect.torch is None else dialect.torch.mark_tool
    if number is None:
        return []
    found: list[Difference] = []
    tool, offset, placed = 0, True, True
    for row in path:
        if row.kind is Kind.TOOL:
            tool, offset, placed = row.ref, False, False
        elif row.kind is Kind.OFFSET:
            offset, placed = True, False
        elif row.kind is Kind.RAPID:
            placed |= offset and not any(map(math.isnan, row.end[:2]))
        elif row.kind is Kind.SPINDLE and row.value:
            wanted = number if row.ref else 0
            if tool != wanted:
                text = Message("tool {} is selected where tool {} is needed", tool, wanted)
                found.append(Difference(Message("scribe"), 0, row.line, text))
            elif not placed:
                text = Message("tool {} is switched on before it moves to its start with its own offset", tool)
                found.append(Difference(Message("scribe"), 0, row.line, text))
        elif row.kind is Kind.END and tool:
            found.append(
                Difference(
                    Message("scribe"), 0, row.line, Message("the program ends with tool {} instead of the torch", tool)
                )
            )
    return found


def check_probing(path: Toolpath, runs: list[TorchRun], plan: CutPlan, probe: Probe | None) -> list[Difference]:
    """Return a fault for each pierce without touching off, and for each wrong probe move.

    If `probe` is None, the program must neither probe nor change Z0.
    """
    found, fresh, lit, lit_after = list[Difference](), False, False, dict[int, bool]()
    before = path.before
    for number, row in enumerate(path):
        if row.kind is Kind.PROBE:
            fresh = number + 1 < len(path) and path[number + 1].kind is Kind.SHIFT
            found += _probe_faults(row, path[number + 1] if fresh else row, lit, probe)
        elif row.kind is Kind.SHIFT and path[number - 1].kind is not Kind.PROBE and not math.isnan(row.end[2]):
            found.append(Difference(Message("probe"), 0, row.line, Message("Z0 is moved without a probe")))
        elif row.kind is Kind.SPINDLE:
            lit = row.value != 0.0
            lit_after[row.line] = fresh
        elif row.kind is Kind.MACHINE or (row.kind is Kind.RAPID and _goes_across(row, before[number])):
            fresh = False
    if probe is None:
        return found
    pierces = [run.lightings[0].line for run, cut in zip(runs, plan.cuts, strict=False) if _is_pierced(run, cut)]
    return found + [
        Difference(Message("probe"), 0, line, Message("the torch is switched on without probing the sheet first"))
        for line in pierces
        if not lit_after.get(line, False)
    ]


def _is_pierced(run: TorchRun, cut: Cut) -> bool:
    return bool(run.lightings) and cut.pierce and cut.kind == "cut"


def _probe_faults(row: Motion, after: Motion, lit: bool, probe: Probe | None) -> list[Difference]:
    """Return the faults of a probe move, including a wrong height in the row `after` it, which sets Z0."""
    if probe is None:
        return [
            Difference(Message("probe"), 0, row.line, Message("the torch probes, although no probing was requested"))
        ]
    wrong = []
    if lit:
        wrong.append(Message("the torch is on during probing"))
    if not abs(row.end[2] + probe.depth) <= _ROOM:
        wrong.append(Message("the probe goes down to Z{:.3f}, not to Z{:.3f}", row.end[2], -probe.depth))
    if not abs(row.value - probe.feed) <= max(FEED_PART * probe.feed, FEED_ROUNDING):
        wrong.append(Message("the probing feed is {:.6g} mm/min", row.value * SECONDS_PER_MINUTE))
    if after.kind is not Kind.SHIFT or not abs(after.end[2] + probe.switch_offset) <= _ROOM:
        wrong.append(Message("the trip height of the switch is not set to Z{:.3f}", -probe.switch_offset))
    return [Difference(Message("probe"), 0, row.line, text) for text in wrong]


def _rapid_faults(path: Toolpath, lowest: float | None) -> list[Difference]:
    """Return a fault for each rapid that is below `lowest` mm or has the torch on.

    The result also contains a fault if the torch stays on at the end.
    """
    found: list[Difference] = []
    lit = at_machine_height = False
    before = path.before
    for number, row in enumerate(path):
        if row.kind is Kind.SPINDLE:
            lit = row.value != 0.0
        elif row.kind in (Kind.RAPID, Kind.MACHINE):
            if lit:
                where = position_text(*before[number][:2].tolist())
                found.append(
                    Difference(
                        Message("torch on in a rapid"), 0, row.line, Message("a rapid from {} with the torch on", where)
                    )
                )
            if row.kind is Kind.MACHINE or not math.isnan(row.end[2]):
                at_machine_height = row.kind is Kind.MACHINE
            if lowest is not None and not at_machine_height:
                found += _height_faults(row, before[number], lowest)
        elif row.kind is Kind.END and lit:
            found.append(
                Difference(Message("torch on at the end"), 0, row.line, Message("the program ends with the torch on"))
            )
    return found


def _height_faults(row: Motion, before: np.ndarray, lowest: float) -> list[Difference]:
    across = _goes_across(row, before)
    height = min(row.end[2], float(before[2]) if not math.isnan(before[2]) else row.end[2])
    if not across or height >= lowest - _ROOM:
        return []
    shown = Message("an unknown height") if math.isnan(height) else f"Z{height:.3f}"
    text = Message("a rapid across the sheet at {}, below Z{:.3f}, to {}", shown, lowest, position_text(*row.end[:2]))
    return [Difference(Message("rapid too low"), 0, row.line, text)]


def _goes_across(row: Motion, before: np.ndarray) -> bool:
    return any(not math.isnan(e) and e != b for e, b in zip(row.end[:2], before[:2].tolist(), strict=True))


def _pierce_and_cut_height_faults(
    run: TorchRun, cut: Cut, plan: CutPlan, heights: bool, waits: bool
) -> list[Difference]:
    data, found = plan.data, []
    if run.lightings and cut.pierce:
        first = run.lightings[0]
        if heights and not abs(first.height - data.pierce_height) <= _ROOM:
            text = Message(
                "the torch is switched on at Z{:.3f}, not at the pierce height, Z{:.3f}",
                first.height,
                data.pierce_height,
            )
            found.append(Difference(Message("pierce height"), 0, first.line, text))
        if waits and first.waited < data.pierce_delay - DWELL_ROUNDING:
            text = Message(
                "the torch waits {:g} s for the pierce; the cut chart requires {:g} s", first.waited, data.pierce_delay
            )
            found.append(Difference(Message("pierce delay"), 0, first.line, text))
    if heights:
        wrong = np.flatnonzero(run.burning & ~(np.abs(run.height - data.cut_height) <= _ROOM))
        if len(wrong):
            k = int(wrong[0])
            text = Message("the torch cuts at Z{:.3f}, not at the cut height, Z{:.3f}", run.height[k], data.cut_height)
            found.append(Difference(Message("cut height"), 0, int(run.row_line[k]), text))
    return found


def _feed_faults(run: TorchRun, cut: Cut) -> list[Difference]:
    starts = np.array([at for at, _ in cut.speeds])
    speeds = np.array([feed for _, feed in cut.speeds])
    middles = 0.5 * (run.along[:-1] + run.along[1:])
    near = [speeds[np.clip(np.searchsorted(starts, middles + d, side="right") - 1, 0, None)] for d in (-_ALONG, _ALONG)]
    room = [np.maximum(FEED_PART * planned, FEED_ROUNDING) for planned in near]
    right = [np.abs(run.feed - planned) <= allowed for planned, allowed in zip(near, room, strict=True)]
    wrong = np.flatnonzero(run.burning & ~(right[0] | right[1]))
    if not len(wrong):
        return []
    k = int(wrong[0])
    text = Message(
        "the feed is {:.6g} mm/min at {}, instead of {:.6g} mm/min",
        run.feed[k] * SECONDS_PER_MINUTE,
        position_text(*run.points[k + 1].tolist()),
        near[0][k] * SECONDS_PER_MINUTE,
    )
    return [Difference(Message("feed"), 0, int(run.row_line[k]), text)]


def _material_faults(
    path: Toolpath, text: str, plan: CutPlan, dialect: Dialect, material_number: int | None
) -> list[Difference]:
    torch = dialect.torch
    lines = text.splitlines()
    obeyed = controller_settings(lines, dialect)
    if torch is None or not torch.material_comment:
        return [
            Difference(Message("material"), 0, one.line, Message("the controller would obey '{}'", one.text))
            for one in obeyed
        ]
    selected = [
        (number, int(match.group(1)))
        for number, line in enumerate(lines, 1)
        if (match := _SELECTED.search(normalize_line(line))) is not None
    ]
    lit = path.line[(path.kind == Kind.SPINDLE) & (path.value != 0.0)]
    first = int(lit[0]) if len(lit) else len(lines) + 1
    if material_number is not None:
        found = [
            Difference(
                Message("material"), 0, one.line, Message("'{}' overrides material {}", one.text, material_number)
            )
            for one in obeyed
        ]
        found += [
            Difference(
                Message("material"), 0, number, Message("material {} is selected, not {}", material, material_number)
            )
            for number, material in selected
            if material != material_number
        ]
        if not any(number < first for number, _ in selected):
            words = Message("material {} is not selected before the first cut", material_number)
            found.append(Difference(Message("material"), 0, 0, words))
        return found
    if selected:
        number, material = selected[0]
        return [
            Difference(
                Message("material"), 0, number, Message("material {} is selected; the program states its own", material)
            )
        ]
    comment = _COMMENT.search(text)
    if comment is None:
        return [
            Difference(
                Message("material"), 0, 0, Message("the program does not give the material to the controller, (o=0, …)")
            )
        ]
    if len(obeyed) != 1 or obeyed[0].line > first:
        line = obeyed[-1].line if obeyed else 0
        return [
            Difference(Message("material"), 0, line, Message("the material must be stated once, before the first cut"))
        ]
    line = text.count("\n", 0, comment.start()) + 1
    unit = MM_PER_INCH if _INCH.search(text) else 1.0
    figures = {name: float(value) for name, value in _FIGURE.findall(comment.group())}
    data = plan.data
    wanted = {
        "kw": (data.kerf / unit, 0.001),
        "ph": (data.pierce_height / unit, 0.001),
        "pd": (data.pierce_delay, 0.001),
        "ch": (data.cut_height / unit, 0.001),
        "fr": (data.feed * SECONDS_PER_MINUTE / unit, 0.005 * data.feed * SECONDS_PER_MINUTE / unit),
    }
    faults = []
    for name, (value, room) in wanted.items():
        if name not in figures:
            text = Message("{} is missing in the material's comment; it must be {:g}", name, value)
            faults.append(Difference(Message("material"), 0, line, text))
        elif abs(figures[name] - value) > room:
            text = Message("{}={} in the material's comment, not {:g}", name, figures[name], value)
            faults.append(Difference(Message("material"), 0, line, text))
    return faults


_SELECTED = re.compile(r"M190P([0-9]+)")
_COMMENT = re.compile(r"^\(o=0,[^()\n]*\)$", re.MULTILINE)
_FIGURE = re.compile(r"\b([a-z]{2})=(-?[0-9.]+)")
_INCH = re.compile(r"^(?:N\d+ )?G20\b", re.MULTILINE)
