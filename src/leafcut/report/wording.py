"""Format texts and numbers for people: clean up text from files, and print figures in the usual form."""

from __future__ import annotations

import math
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from leafcut.errors import count_of
from leafcut.message import Message, map_text
from leafcut.model.fact import Fact
from leafcut.model.issue import LIMITS, Issue, Severity
from leafcut.model.solution import Solution, gap
from leafcut.units import SECONDS_PER_MINUTE, format_length, format_time

if TYPE_CHECKING:
    from rich.console import Console

    from leafcut.model.measure import Measure
    from leafcut.model.outcome import OperationOutcome, Outcome
    from leafcut.model.tool import Tool

NO_VALUE = "–"
#: Name of the order that leafcut writes.
OURS = Message("leafcut")
#: A path counts as optimal if its gap is at most this.
MIN_GAP = 1e-4
#: Sentence that explains why a search ended early (`order.stop.PayoffLimit`).
SPARED = "more search would take longer than it saves"
MINUS = "−"

#: Unicode categories of unprintable characters that may mislead readers: controls, direction overrides, surrogates,
#: private use.
_UNPRINTABLE = frozenset({"Cc", "Cf", "Cs", "Co", "Zl", "Zp"})


def replace_unprintable(text: str) -> str:
    """Replace unprintable characters (line ends, escape sequences, direction marks) with ``�``."""
    return map_text(text, lambda plain: "".join("�" if unicodedata.category(c) in _UNPRINTABLE else c for c in plain))


def print_line(console: Console, line: str, style: str = "") -> None:
    """Print a line on the terminal as it is: without markup, colours of numbers, and line breaks."""
    console.print(line, style=style, markup=False, highlight=False, soft_wrap=True)


def printable_lines(text: str) -> list[str]:
    """Split a text into lines, and sanitise each line with `replace_unprintable`."""
    return [replace_unprintable(line.replace("\t", "    ")) for line in text.splitlines()]


def finite_or_none(value: float | None) -> float | None:
    """Return a finite number unchanged, and None for any other value. JSON supports neither NaN nor infinity."""
    return float(value) if value is not None and math.isfinite(value) else None


def count_text(number: int, noun: str) -> Message:
    """Format a number with its noun: ``1 hole``, ``10,000 holes``."""
    return count_of(number, noun, ",")


def time_words(seconds: float) -> str:
    """Format a time like `format_time`, but with a true minus sign, and with a dash for NaN."""
    if not math.isfinite(seconds):
        return NO_VALUE
    return (MINUS if seconds < 0 else "") + format_time(abs(seconds))


def clock_text(seconds: float) -> str:
    """Format a time in hours, minutes and whole seconds: ``1:02:07``."""
    hours, minutes, rest = clock_parts(seconds)
    return f"{hours}:{minutes:02d}:{rest:02d}"


def clock_parts(seconds: float) -> tuple[int, int, int]:
    """Split a time into hours, minutes and whole seconds."""
    minutes, rest = divmod(round(seconds), 60)
    return minutes // 60, minutes % 60, rest


def length_words(mm: float) -> str:
    """Format a length like `format_length`, but with a dash for NaN."""
    return format_length(mm) if math.isfinite(mm) else NO_VALUE


def cost_words(cost: float, unit: str) -> str:
    """Format the cost of a search in its unit, ``s`` or ``mm``. Four digits are enough to distinguish similar costs."""
    if not math.isfinite(cost):
        return NO_VALUE
    if unit == "mm":
        return f"{cost:.4g} mm" if abs(cost) < 1000 else f"{cost / 1000:#.4g} m".replace(". ", " ")
    return f"{cost:#.4g} s".replace(". ", " ") if abs(cost) < 10_000 else time_words(cost)


def percent_words(percent: float | None, places: int = 1) -> str:
    """Format a percentage with a true minus sign, such as ``42.1 %``, or return a dash if the number is missing."""
    if percent is None or not math.isfinite(percent):
        return NO_VALUE
    number = f"{abs(percent):.{places}f}"
    return (MINUS if percent < 0 and float(number) > 0 else "") + f"{number} %"


def share_words(percent: float) -> str:
    """Format a percentage with one decimal. Below 1 %, it has two decimals, so that a small share does not become 0."""
    return percent_words(percent, 2 if abs(percent) < 1.0 else 1)


def area_words(area: float) -> str:
    """Format an area in mm². From 100 mm² on, it is a whole number."""
    return f"{area:,.0f} mm²" if area >= 100.0 else f"{area:.3g} mm²"


def angle_words(degrees: float) -> str:
    """Format an angle in whole degrees."""
    return f"{degrees:.0f}°"


def money_words(cost: float) -> str:
    """Format a cost in the user's currency with two decimals, or with three decimals below 1."""
    return f"{cost:,.{2 if cost >= 0.995 else 3}f}"


def _short_length_words(mm: float) -> str:
    """Format a length. Below 10 mm, it has two decimals."""
    return f"{mm:.2f} mm" if abs(mm) < 10.0 else length_words(mm)


#: Maps a unit to the function that formats its numbers.
_FIGURES: dict[str, Callable[[float], str]] = {
    "s": time_words,
    "mm": _short_length_words,
    "mm²": area_words,
    "%": share_words,
    "°": angle_words,
    "": lambda number: f"{number:,}" if isinstance(number, int) else money_words(number),
}


def fact_value_text(fact: Fact) -> str:
    """Format the value of a fact. Return "" for lists, for dicts, and for a fact without a value."""
    if isinstance(fact.value, int | float):
        if not math.isfinite(fact.value):
            return NO_VALUE
        return _FIGURES[fact.unit](fact.value) if fact.unit in _FIGURES else f"{fact.value:,.4g} {fact.unit}"
    return fact.value if isinstance(fact.value, str) else ""


def fact_line(fact: Fact) -> str:
    """Join the figure and the sentence of a fact in one line."""
    return ", ".join(filter(None, (fact_value_text(fact), fact.sentence)))


def title_words(facts: Iterable[Fact]) -> str:
    """Join the facts of the title in one line: ``70 holes · 3 tools``."""
    return " · ".join(fact.sentence for fact in facts if fact.sentence and not fact.name)


def fact_heading(name: str) -> str:
    """Convert the name of a fact to a heading in lower case. Abbreviations such as ``T1`` keep their capitals."""
    return name[:1].lower() + name[1:] if name[1:2].islower() else name


def gap_words(fraction: float, unit: str) -> str:
    """Describe a gap: ``at most 1.24 % above the shortest possible``, or for times, ``the least possible``.

    The figure is rounded up, because a smaller figure would not be proved.
    """
    possible = "the least possible" if unit == "s" else "the shortest possible"
    hundredths = math.ceil(1e4 * fraction - 1e-3)
    return f"at most {percent_words(hundredths / 100, 2)} above {possible}" if hundredths > 0 else possible


def tour_quality_lines(length: float, optimum: float | None, bound: float | None) -> list[str]:
    """Describe the quality of a tour: its excess over the best known length, and its proved gap."""
    lines = []
    if optimum is not None:
        above = percent_words(100.0 * (length / optimum - 1.0), 3)
        lines.append(f"{above} above the best known length, {optimum:,.10g}")
    certain = gap(length, bound)
    if certain is not None:
        lines.append(f"{gap_words(certain, 'mm')} (lower bound {bound:,.10g})")
    return lines


def panel_number(value: float) -> str:
    """Format a feed or a speed with as many digits as a machine panel shows. Return a dash if it is 0 or unknown."""
    if not math.isfinite(value) or value <= 0:
        return NO_VALUE
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def to_mm_per_min(feed: float) -> float:
    """Convert a feed from mm/s to mm/min."""
    return feed * SECONDS_PER_MINUTE


def saved_percent(outcome: Outcome, measure: Measure) -> float:
    """Return how much machine time a measure saves compared with the original order, percent."""
    before = outcome.before.time_s
    return 100.0 * (1.0 - measure.time_s / before) if before > 0 else 0.0


def algorithm_names(outcome: Outcome) -> str:
    """Return the names of the algorithms of all operations. The operation with the most holes comes first."""
    by_size = sorted(outcome.operations, key=lambda o: -len(o.hole_order))
    return ", ".join(dict.fromkeys(o.solution.algorithm for o in by_size))


#: Minimum time for loading and compiling kernels that the report mentions, s.
COMPILED = 1.0


def search_seconds(outcome: Outcome) -> float:
    """Return the total time of all searches that contributed an order to the program, s."""
    return sum(o.solution.seconds for o in outcome.operations)


def search_time_words(outcome: Outcome) -> str:
    """Format the times of the search and of the whole job: ``search 2.10 s of 4.93 s``.

    The times do not include loading and compiling kernels.
    """
    return f"search {time_words(search_seconds(outcome))} of {time_words(outcome.seconds)}"


def search_summary(outcome: Outcome) -> str:
    """Describe the search: the algorithm, the seed, and the times of the search and the job.

    If the search ended early, the text adds the reason.
    """
    words = f"{replace_unprintable(algorithm_names(outcome))}, seed {outcome.seed}, {search_time_words(outcome)}"
    if outcome.compile_seconds >= COMPILED:
        words += f" and {time_words(outcome.compile_seconds)} to load and compile kernels"
    return f"{words}; {SPARED}" if any(ended_without_payoff(o.solution) for o in outcome.operations) else words


def ended_without_payoff(solution: Solution) -> bool:
    """Return whether a search ended because it no longer paid off, and not because it reached a proved optimum."""
    return solution.spared and (solution.gap is None or solution.gap > MIN_GAP)


def tool_count(outcome: Outcome) -> int:
    """Return the number of different tools."""
    return len({o.tool.number for o in outcome.operations})


#: Prefix of the codes for motion issues: dangers, and limits of the machine.
MOTION = "L8"
#: All severities, the worst first.
SEVERITIES = (Severity.DANGER, Severity.MISSING, Severity.WARNING, Severity.NOTE)


@dataclass(frozen=True)
class IssueGroup:
    """Issues of one kind. The group has their number, and the message and position of the first issue."""

    code: str
    severity: Severity
    number: int
    message: str
    place: str


def verification_limits(issues: Iterable[Issue]) -> list[tuple[str, str]]:
    """Return the limits of the verification as pairs (name, text): assumptions, and areas that are not cut.

    The function lists all limits, because users would mistake a hidden assumption for a fact.
    """
    groups = [group for group in group_issues(issues, by_message=True) if group.code in LIMITS]
    return [(LIMITS[g.code], g.message + (f" ({g.place})" if g.place else "")) for g in groups]


def group_issues(issues: Iterable[Issue], *, by_message: bool = False) -> list[IssueGroup]:
    """Group issues by code, or by code and message.

    The worst groups come first. Within a severity, issues about motion and machine come before all others, which are
    sorted by code.
    """
    first: dict[tuple[str, Severity, str], Issue] = {}
    numbers: Counter[tuple[str, Severity, str]] = Counter()
    for issue in issues:
        key = (issue.code, issue.severity, issue.message if by_message else "")
        numbers[key] += 1
        first.setdefault(key, issue)
    order = sorted(first, key=lambda key: (SEVERITIES.index(key[1]), not key[0].startswith(MOTION), key[0]))
    return [
        IssueGroup(
            *key[:2], numbers[key], replace_unprintable(first[key].message), replace_unprintable(first[key].place)
        )
        for key in order
    ]


def tool_number_word(tool: Tool) -> str:
    """Return the number of a tool, such as ``T3``. Return "" if the tool has no number in the program."""
    return f"T{tool.number}" if tool.number else ""


def tool_words(tool: Tool) -> str:
    """Describe a tool: ``T3 drill Ø6.35``, or ``T3 drill`` if the diameter is unknown."""
    return replace_unprintable(
        tool.label if tool.diameter > 0 else f"{tool_number_word(tool)} {tool.name or tool.kind.value}".strip()
    )


def operation_work_words(operation: OperationOutcome) -> str:
    """Describe the work of an operation: ``70 holes``, ``3 holes, 12 cuts`` or ``121 holes, 1 in its place``."""
    work = [(len(operation.holes), "slot" if operation.slots else "hole"), (operation.cuts, "cut")]
    words = [count_text(number, noun) for number, noun in work if number] or [count_text(0, "hole")]
    staying = len(operation.staying)
    if staying:
        words.insert(1, Message("{:,} in its place" if staying == 1 else "{:,} in their places", staying))
    return Message.joined(", ", words)
