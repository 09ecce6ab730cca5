"""Options of a quote: prices, markup, seller, and the number of sheets or plates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from leafcut.options.option_spec import OptionGroup, option, when_absent, when_given

#: Maximum price in any currency, to catch typing errors.
_HIGHEST_PRICE = 1e9
_QUOTED = (when_given("quote"),)


@dataclass(frozen=True)
class QuoteOptions(OptionGroup):
    """The quote for a customer. The cost of the machine per hour is `--shop-rate`."""

    section: ClassVar[str] = "quote"
    title: ClassVar[str] = "Quote"

    quote: Path | None = option(
        "path",
        None,
        "quote for the customer to write (HTML): parts, weights, times and prices",
        default_words="none",
        changes_program=False,
        of_file=True,
    )
    quantity: int = option(
        "whole",
        1,
        "number of sheets or plates in the batch",
        minimum=1,
        maximum=1_000_000,
        needs=_QUOTED,
        of_file=True,
    )
    stock_price: float | None = option(
        "number",
        None,
        "price of one sheet or plate; 0 if the customer supplies it",
        minimum=0,
        maximum=_HIGHEST_PRICE,
        default_words="the price in a nested drawing, else by --price-per-kg",
        changes_program=False,
        needs=_QUOTED,
        of_file=True,
    )
    price_per_kg: float | None = option(
        "number",
        None,
        "price of the material per kg, for a sheet or plate of known size",
        minimum=0,
        maximum=_HIGHEST_PRICE,
        default_words="none",
        changes_program=False,
        needs=(*_QUOTED, when_absent("stock_price")),
    )
    density: float | None = option(
        "number",
        None,
        "density of the material, kg/m³",
        minimum=1,
        maximum=30_000,
        default_words="of the material in `leafcut list materials`",
        changes_program=False,
        needs=_QUOTED,
        of_file=True,
    )
    setup_cost: float | None = option(
        "number",
        None,
        "cost of setting up the machine, once for the batch",
        minimum=0,
        maximum=_HIGHEST_PRICE,
        default_words="required for a quote",
        changes_program=False,
        needs=_QUOTED,
    )
    markup: float | None = option(
        "percent",
        None,
        "percentage added to the cost, such as 20%",
        minimum=0,
        maximum=1000,
        default_words="required for a quote",
        changes_program=False,
        needs=_QUOTED,
    )
    currency: str | None = option(
        "text",
        None,
        "currency of all prices, such as EUR",
        default_words="required for a quote",
        changes_program=False,
        needs=_QUOTED,
    )
    valid_days: int | None = option(
        "whole",
        None,
        "number of days for which the quote is valid",
        minimum=1,
        maximum=3650,
        default_words="required for a quote",
        changes_program=False,
        needs=_QUOTED,
    )
    terms: str | None = option(
        "text",
        None,
        "lines below the prices, such as taxes, payment and delivery, separated by semicolons",
        default_words="required for a quote",
        changes_program=False,
        needs=_QUOTED,
    )
    seller: str | None = option(
        "text",
        None,
        "name and address of your shop, as lines separated by semicolons",
        default_words="required for a quote",
        changes_program=False,
        needs=_QUOTED,
    )
