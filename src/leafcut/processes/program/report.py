"""What is told of a program in a new order: what it makes, what could be reordered, and what keeps its place."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from leafcut.kinds import BEAMS
from leafcut.model.outcome import Outcome
from leafcut.model.process_report import Fact
from leafcut.model.saving import plain
from leafcut.model.shown_stock import ShownStock
from leafcut.processes.program.model import ProgramDetail, StockProof
from leafcut.report import views
from leafcut.report.drawing import Scene
from leafcut.report.json_answer import certificate_as_json
from leafcut.report.pace_words import pace_facts
from leafcut.report.path_report import PathReport
from leafcut.report.wording import clean, count

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
        if not outcome.detail.certificate.before.works:
            self.found = "but no cut and no hole was found in this program"

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
        if self.outcome.after == self.outcome.before:
            words.append("order unchanged")
        turned = detail.certificate.reversed_cuts
        return " · ".join([*(words or ["no work"]), *([f"{turned} reversed"] if turned else [])])

    def answer(self) -> dict[str, Any]:
        """Return the proof, why pieces of the program keep their place, and what new speeds did."""
        detail = self.outcome.detail
        proof = certificate_as_json(detail.certificate)
        answer = {
            "certificate": proof,
            "staying": [asdict(group) for group in detail.staying],
            "avoided_areas": asdict(detail.avoided),
        }
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
