"""Report on a reordered program: its work, and the tasks that moved or kept their position."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from leafcut.message import Message
from leafcut.model.fact import Fact
from leafcut.model.json_values import to_plain_json
from leafcut.model.outcome import Outcome
from leafcut.model.shown_stock import ShownStock
from leafcut.processes.program.model import ProgramDetail, StockProof
from leafcut.report.pace_words import pace_facts
from leafcut.report.path_report import PathReport
from leafcut.report.set_up import time_facts
from leafcut.report.wording import count_text, replace_unprintable

if TYPE_CHECKING:
    from leafcut.report.drawing import Scene

#: Maximum number of reasons for fixed tasks in the summary.
MOST_REASONS = 6


class ProgramReport(PathReport[ProgramDetail]):
    """Facts and views of a reordered program."""

    came_in = "program"
    found = "read back: it does the same work as the original"

    def __init__(self, outcome: Outcome[ProgramDetail]) -> None:
        super().__init__(outcome)
        if not outcome.detail.certificate.before.has_cuts_or_holes:
            self.found = "but no cut and no hole was found in this program"

    def count_facts(self) -> list[Fact]:
        """Count the features that the proof compared, the tasks that can be reordered, and the reversed tasks."""
        outcome, detail = self.outcome, self.outcome.detail
        numbers, turned = asdict(detail.certificate.before), detail.certificate.reversed_cuts
        counted = {"holes": count_text(numbers["holes"], "hole"), "cuts": count_text(numbers["cuts"], "cutting move")}
        work = [Fact(f"counts.{k}", n, "", counted.get(k, "") if n else "") for k, n in numbers.items()]
        free = detail.pieces - sum(group.count for group in detail.staying)
        pieces = count_text(detail.pieces, "piece")
        words = Message("{} of {} of work can be reordered", f"{free:,}", pieces) if detail.pieces else ""
        facts = [
            *work,
            Fact("counts.barriers", detail.barriers),
            Fact("counts.operations", len(outcome.operations)),
            Fact("counts.pieces", detail.pieces, "", words),
            Fact(sentence=Message("order unchanged") if outcome.after == outcome.before else ""),
        ]
        if not any(fact.sentence for fact in facts):
            facts.append(Fact(sentence=Message("no work")))
        return [*facts, Fact(sentence=Message("{} reversed", turned) if turned else "")]

    def process_facts(self) -> list[Fact]:
        """Return facts about the proof, fixed work, moves across avoided areas, savings, and the remaining stock."""
        detail = self.outcome.detail
        head, *reasons = staying_words(detail, MOST_REASONS) or [""]
        stays = f"{head}: {'; '.join(reasons)}" if head else ""
        left = (
            []
            if detail.stock is None
            else [Fact("stock", to_plain_json(detail.stock), "", stock_words(detail.stock), "stock")]
        )
        return [
            Fact("certificate", detail.certificate.as_json()),
            Fact("staying", [asdict(group) for group in detail.staying], "", stays, "stays" if stays else ""),
            Fact("avoided_areas", asdict(detail.avoided)),
            *left,
            *time_facts(self.outcome),
            *self.savings_facts(),
        ]

    def savings_facts(self) -> list[Fact]:
        """Return the time saved by new heights and speeds if they were requested."""
        pace = self.outcome.detail.pace
        if pace is None:
            return []

        return pace_facts(pace)

    def savings_headline(self) -> dict[str, Any]:
        """Return the headline figure. If the order did not change, this is a text."""
        outcome, row = self.outcome, super().savings_headline()
        same = outcome.before == outcome.after and outcome.before.time_s > 0
        return {**row, "percent": "The order is unchanged."} if same else row

    def staying_reasons(self) -> list[str]:
        """Return sentences about the tasks that keep their position, with the reasons."""
        return staying_words(self.outcome.detail)

    def shown_stock(self) -> ShownStock:
        """Return the known stock and tools of the program."""
        return self.outcome.detail.shown

    def size_words(self, scene: Scene) -> str:
        """Return the size of the drawn work."""
        return f"{scene.extent[0]:.4g} × {scene.extent[1]:.4g} mm"


def stock_words(stock: StockProof) -> str:
    """Describe the result of comparing the remaining stock, or the reason why it was not compared."""
    if stock.reason:
        return f"the remaining stock was not compared: {stock.reason}"
    words = f"the remaining stock is the same, in {stock.cells:,} cells of {stock.cell:g} mm"
    for tools, phrase in ((stock.flat, "as flat mills"), (stock.unknown, "left out, as their shape is unknown")):
        if tools:
            words += f"; {', '.join(f'T{number}' for number in tools)} {phrase}"
    return words


def staying_words(detail: ProgramDetail, most: int = 0) -> list[str]:
    """Describe the fixed tasks: a text with their number, followed by a text for each reason.

    At most `most` reasons are listed (0: all). If more exist, a last text states the number of tasks with other
    reasons.
    """
    if not detail.staying:
        return []
    stay = sum(group.count for group in detail.staying)
    shown = detail.staying[:most] if most else detail.staying
    phrases = [f"{group.count:,} {replace_unprintable(group.text)}" for group in shown]
    rest = stay - sum(group.count for group in shown)
    phrases += [f"{rest:,} for other reasons, which the report names"] if rest else []
    return [f"{stay:,} of {count_text(detail.pieces, 'piece')} stay{'s' if stay == 1 else ''}", *phrases]
