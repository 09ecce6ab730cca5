"""What is told of a program in a new order: what it makes, what could be reordered, and what keeps its place."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from leafcut.kinds import BEAMS
from leafcut.model.outcome import Outcome
from leafcut.model.pace_change import FeedLimit, PaceChange, ToolPace
from leafcut.model.process_report import Fact
from leafcut.model.saving import plain
from leafcut.model.shown_stock import ShownStock
from leafcut.processes.program.model import ProgramDetail, StockProof
from leafcut.report import views
from leafcut.report.drawing import Scene
from leafcut.report.json_answer import certificate_as_json
from leafcut.report.path_report import PathReport
from leafcut.report.wording import clean, count, time_words
from leafcut.units import SECONDS_PER_MINUTE

#: How each limit of feeds is called, its unit for people, and how many of these one of ours is.
_LIMITS = {
    "power": ("power", "kW", 0.001),
    "torque": ("torque", "N·m", 0.001),
    "slot": ("chip of slots", "mm", 1.0),
    "plunge": ("downwards", "mm/min", SECONDS_PER_MINUTE),
}
#: So many reasons why pieces of a program stay are told in the summary.
MOST_REASONS = 6
#: What programs do whose tool is a beam that is on or off.


class ProgramReport(PathReport[ProgramDetail]):
    """What a program in a new order shows."""

    came_in = "program"
    found = "read back: it does the same work as the original"

    def __init__(self, outcome: Outcome[ProgramDetail]) -> None:
        super().__init__(outcome)
        self.beam = outcome.process in BEAMS

    def counts(self) -> dict[str, int]:
        """Return what the proof counted, and how the program is divided."""
        outcome, detail = self.outcome, self.outcome.detail
        own = {"barriers": detail.barriers, "operations": len(outcome.operations), "pieces": detail.pieces}
        return {**asdict(detail.certificate.before), **own}

    def counts_words(self) -> str:
        """Return what a program makes, how much of it can be reordered, and how much is made from its other end."""
        detail = self.outcome.detail
        counts = detail.certificate.before
        words = [count(counts.holes, "hole")] if counts.holes else []
        words += [count(counts.cuts, "cutting move")] if counts.cuts else []
        free = detail.pieces - sum(group.count for group in detail.staying)
        if detail.pieces:
            words.append(f"{free:,} of {count(detail.pieces, 'piece')} of work free to be ordered")
        turned = detail.certificate.reversed_cuts
        return " · ".join([*(words or ["no work"]), *([f"{turned} reversed"] if turned else [])])

    def answer(self) -> dict[str, Any]:
        """Return the proof, why pieces of the program keep their place, and what new speeds did."""
        detail = self.outcome.detail
        proof = certificate_as_json(detail.certificate)
        answer = {"certificate": proof, "staying": [asdict(group) for group in detail.staying]}
        stock = {} if detail.stock is None else {"stock": plain(detail.stock)}
        return {**answer, **stock, **({} if detail.pace is None else {"pace": plain(detail.pace)})}

    def facts(self) -> list[Fact]:
        """Return the gap, what stays, what the stock shows, and how the order was sought."""
        head, *reasons = staying_words(self.outcome.detail, MOST_REASONS) or [""]
        stays = [Fact("stays", f"{head}: {'; '.join(reasons)}")] if head else []
        facts = super().facts()
        at = next((k for k, fact in enumerate(facts) if fact.name == "method"), len(facts))
        stock = self.outcome.detail.stock
        left = [Fact("stock", stock_words(stock))] if stock else []
        return [*facts[:at], *stays, *self.pace(), *left, *facts[at:]]

    def pace(self) -> list[Fact]:
        """Return what new heights and speeds saved, where they were asked for."""
        pace = self.outcome.detail.pace
        return pace_facts(pace) if pace else []

    def saved(self) -> views.PageRow:
        """Return the large figure, and that the order stays where it does."""
        outcome, row = self.outcome, super().saved()
        same = outcome.before == outcome.after and outcome.before.time_s > 0
        return {**row, "percent": "The order stays as it was."} if same else row

    def staying_words(self) -> list[str]:
        """Return all that keeps its place, and why."""
        return staying_words(self.outcome.detail)

    def stock(self) -> ShownStock:
        """Return what of the stock is known."""
        return self.outcome.detail.shown

    def size(self, scene: Scene) -> str:
        """Return how large the work is that was drawn."""
        return f"{scene.extent[0]:.4g} × {scene.extent[1]:.4g} mm"


def stock_words(stock: StockProof) -> str:
    """Return how a program was judged by what it leaves, or why it was not."""
    if stock.reason:
        return f"what is left was not compared: {stock.reason}"
    words = f"what is left is the same, in {stock.cells:,} cells of {stock.cell:g} mm"
    for tools, said in ((stock.flat, "as flat mills"), (stock.unknown, "left out, as their shape is unknown")):
        if tools:
            words += f"; {', '.join(f'T{number}' for number in tools)} {said}"
    return words


def pace_facts(pace: PaceChange) -> list[Fact]:
    """Return what new heights and speeds saved, and how the feeds of every tool have changed."""
    facts = []
    if pace.retracts_s is not None:
        words = f"{_saved(pace.retracts_s)}, {count(pace.lowered, 'height')} lower" if pace.lowered else "as they were"
        facts.append(Fact("retracts", words))
    if pace.air_s is not None:
        near = f", {pace.clearance_mm:.2g} mm or more from all material" if math.isfinite(pace.clearance_mm) else ""
        words = f"{_saved(pace.air_s)}, {count(pace.rapids, 'cut')} in the air now a rapid{near}"
        facts.append(Fact("air", words if pace.rapids else "no cut in the air that could be a rapid"))
    if pace.feeds_s is not None:
        facts.append(Fact("feeds", _saved(pace.feeds_s) if pace.tools else "as they were"))
        facts += [Fact("", _tool_words(tool)) for tool in pace.tools]
    return facts


def _saved(seconds: float) -> str:
    if seconds < 0:
        return f"{time_words(-seconds)} more, for chips that the tools bear"
    return f"{time_words(seconds)} saved" if seconds > 0 else "nothing saved"


def _tool_words(tool: ToolPace) -> str:
    """Return how the feeds of a tool have changed, and its thickest chip."""
    before, after = (_feed_words(*one) for one in (tool.feed_before, tool.feed_after))
    whose = "by its library" if tool.limit_stated else "the program's own thickest"
    return (
        f"{clean(tool.label)}: {before} → {after} mm/min; thickest chip {tool.chip_before:.3g} → "
        f"{tool.chip_after:.3g} mm a revolution, at most {tool.chip_limit:.3g} ({whose})"
        + "".join(f"; {_limit_words(limit)}" for limit in tool.limits)
    )


def _limit_words(limit: FeedLimit) -> str:
    """Return what a limit was asked for before and after: "power 1.2 → 0.9 kW, at most 0.9"."""
    words, unit, scale = _LIMITS[limit.name]
    before, after, most = (f"{scale * value:.3g}" for value in limit[1:])
    return f"{words} {before} → {after} {unit}, at most {most}"


def _feed_words(low: float, high: float) -> str:
    one, other = (f"{SECONDS_PER_MINUTE * value:.4g}" for value in (low, high))
    return one if one == other else f"{one} to {other}"


def staying_words(detail: ProgramDetail, most: int = 0) -> list[str]:
    """Return why pieces of a program keep their place: how many of how many do, and a text for each reason.

    Of more than `most` reasons the rest is one text; 0: all are told.
    """
    if not detail.staying:
        return []
    stay = sum(group.count for group in detail.staying)
    shown = detail.staying[:most] if most else detail.staying
    said = [f"{group.count:,} {clean(group.text)}" for group in shown]
    rest = stay - sum(group.count for group in shown)
    said += [f"{rest:,} for other reasons, which the report names"] if rest else []
    return [f"{stay:,} of {count(detail.pieces, 'piece')} stay{'s' if stay == 1 else ''}", *said]
