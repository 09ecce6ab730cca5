"""What is noticed in the order of pockets: entries that differ from the request, required holes, and stops."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from leafcut.model.issue import Issue, Severity
from leafcut.processes.pocket.job import PocketJob, holes

if TYPE_CHECKING:
    from leafcut.processes.pocket.plan.entries import Descent


def stops(job: PocketJob) -> list[Issue]:
    """Return a note if the tool stops after every move, although stock would allow it to go on."""
    if not job.words.rounding or job.rounding <= job.rules.stock:
        return []
    words = (
        f"{job.words.name} stops after every move (G61): with G64 it would cut corners short by up to "
        f"{job.rounding:.2g} mm at this feed, into walls; give that much --stock to rough without stops"
    )
    return [Issue("L704", words, severity=Severity.NOTE)]


def entry_issues(descents: Sequence[Descent]) -> list[Issue]:
    """Return the entries that differ from the request, and the holes that must exist."""
    other = [d for d in descents if d.kind != d.asked]
    issues = []
    for kind in dict.fromkeys(d.kind for d in other):
        places = list(dict.fromkeys(d.place for d in other if d.kind == kind))
        asked = next(d.asked for d in other if d.kind == kind)
        words = f"no room for a {asked}: entry changed to a {kind}"
        more = f", and at {len(places) - 1} more" if len(places) > 1 else ""
        severity = Severity.WARNING if kind == "plunge" else Severity.NOTE
        issues.append(Issue("L702", words, f"at ({places[0][0]:.3f}, {places[0][1]:.3f}){more}", severity))
    if needed := holes(descents):
        words = f"{len(needed)} holes have" if len(needed) > 1 else "a hole has"
        places = list(needed)[:4]
        at = "; ".join(f"({x:.3f}, {y:.3f})" for x, y in places) + (" …" if len(needed) > 4 else "")
        issues.append(Issue("L703", f"{words} to be there before this program runs, as deep as the pocket", f"at {at}"))
    return issues
