"""`Quote`: the prices of parts for a customer, and the cost that they are based on."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import date

from leafcut.geometry.polyline import Polyline

_SECONDS_PER_HOUR = 3600.0
#: Hundredths per unit of a currency, in which prices are rounded.
_CENTS = 100
#: Decimals of a price in hundredths that count. More decimals are rounding errors, which must not raise a price.
_CERTAIN_DECIMALS = 6


def cost_of_time(rate: float, seconds: float) -> float:
    """Return the cost of a time, s, at a rate per hour."""
    return rate * seconds / _SECONDS_PER_HOUR


def round_up_to_cents(cost: float) -> float:
    """Round a cost up to whole hundredths, so that no price is below its cost."""
    return math.ceil(round(cost * _CENTS, _CERTAIN_DECIMALS)) / _CENTS


@dataclass(frozen=True)
class PartCost:
    """A kind of part that a program makes, with the time and the cost of a single part.

    Attributes
    ----------
    per_run
        Number of these parts on a sheet or plate.
    outlines
        Number of outlines in the drawing of the part. If there are several, the part is a set.
    time_s, cost
        Machine time, s, and cost. They do not include the moves outside the parts, which the quote distributes.
    weight_kg, lighter
        Weight, and whether engraving, chamfers or carving make the part slightly lighter.
    edges, lines
        Closed edges and engraved lines for the picture, mm.
    """

    name: str
    per_run: int
    time_s: float
    cost: float
    weight_kg: float
    outlines: int = 1
    lighter: bool = False
    edges: tuple[Polyline, ...] = ()
    lines: tuple[Polyline, ...] = ()


@dataclass(frozen=True)
class RunCost:
    """The time, s, and the cost of a run of the program, with its parts, and the material and thickness, mm.

    The cost includes the price of the sheet or plate, `stock_price`, which is 0 if the customer supplies it.
    """

    time_s: float
    cost: float
    parts: tuple[PartCost, ...]
    material: str
    thickness: float
    stock_price: float


@dataclass(frozen=True)
class QuoteLine:
    """A line of a quote: a kind of part with its number in the batch.

    `time_s` and `price` apply to a single part. They include its share of the moves outside the parts, and the price
    also includes its share of the set-up and the markup.
    """

    part: PartCost
    quantity: int
    time_s: float
    price: float

    @property
    def total(self) -> float:
        """Price of all parts of the line."""
        return round(self.quantity * self.price, 2)


@dataclass(frozen=True)
class Quote:
    """The prices of a batch for a customer.

    Attributes
    ----------
    seller, terms
        Lines with the name and the address of the shop, and lines below the prices, such as taxes and delivery.
    is_material_supplied
        Whether the customer supplies the material, so that the prices do not include it.
    thickness
        Thickness of the sheet or plate, mm.
    runs
        Number of sheets or plates.
    setup_cost, cost
        Cost of the set-up, and cost of the batch with its set-up. The customer sees neither of them.
    markup
        Percentage added to the cost.
    """

    seller: tuple[str, ...]
    terms: tuple[str, ...]
    currency: str
    made: date
    valid_until: date
    material: str
    is_material_supplied: bool
    thickness: float
    runs: int
    lines: tuple[QuoteLine, ...]
    setup_cost: float
    cost: float
    markup: float

    @property
    def total(self) -> float:
        """Price of the batch."""
        return round(math.fsum(line.total for line in self.lines), 2)

    @property
    def quantity(self) -> int:
        """Number of parts in the batch."""
        return sum(line.quantity * line.part.outlines for line in self.lines)

    @property
    def weight_kg(self) -> float:
        """Weight of all parts in the batch."""
        return math.fsum(line.quantity * line.part.weight_kg for line in self.lines)


def quote_lines(run: RunCost, runs: int, setup_cost: float, markup: float) -> tuple[QuoteLine, ...]:
    """Distribute the time and the cost of a batch among its parts, and add the markup in percent.

    Each part gets a share of the moves outside the parts and of the set-up in proportion to its own time or cost.
    Prices are rounded up to hundredths.
    """
    own_time = math.fsum(part.per_run * part.time_s for part in run.parts)
    own_cost = math.fsum(part.per_run * part.cost for part in run.parts)
    each = (run.cost + setup_cost / runs) * (1.0 + markup / 100.0)
    lines = []
    for part in run.parts:
        of_time = part.time_s / own_time
        # If neither machine nor material costs anything, the set-up is shared by time.
        of_cost = part.cost / own_cost if own_cost > 0.0 else of_time
        lines.append(QuoteLine(part, runs * part.per_run, run.time_s * of_time, round_up_to_cents(each * of_cost)))
    return tuple(lines)
