"""Check the options of a quote, look up the price and the weight of the material, and build the quote."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import date, timedelta
from typing import Any

from leafcut.errors import DataError, OptionError, PlanError, printable
from leafcut.message import Message
from leafcut.model.outcome import Outcome
from leafcut.model.quote import Quote, RunCost, quote_lines
from leafcut.options import QuoteOptions, Settings, flag_name
from leafcut.processes.base import Process

#: Options that every quote needs.
_NEEDED = ("seller", "terms", "currency", "valid_days", "shop_rate", "setup_cost", "markup")
#: Cubic metres per cubic millimetre.
_M3_PER_MM3 = 1e-9


def check_quote(settings: Settings, process: Process) -> None:
    """Raise OptionError if the requested quote is not an HTML file, or if an option that it needs is missing or empty.

    The name of the quote must not come from a file of options, because every job would then replace the quote.
    """
    if "quote" not in settings.asked:
        raise OptionError(
            "--quote: name the file on the command line, not in a file of options, so that no later job replaces the "
            "quote"
        )
    options = settings.of(QuoteOptions)
    if options.quote is not None and options.quote.suffix.lower() not in (".html", ".htm"):
        raise OptionError("--quote: '{}' is not a web page; name a file ending in .html", options.quote.name)
    missing = [name for name in (*_NEEDED, *process.quoted_with) if name not in settings.given]
    missing += [
        name
        for name in ("seller", "terms", "currency")
        if name in settings.given and not _lines(getattr(options, name))
    ]
    if missing:
        raise OptionError(
            "--quote: a quote also needs {}; give 0 for a cost that you do not have, and write the values of your shop "
            "once in your defaults file (leafcut defaults --template)",
            ", ".join(map(flag_name, missing)),
        )


def _lines(text: str | None) -> tuple[str, ...]:
    return tuple(line.strip() for line in re.split(r"[;\n]", text or "") if line.strip())


def stock_price(settings: Settings, stated: float, area: float, material: str, thickness: float) -> float:
    """Return the price of a sheet or plate. Without a quote, return the price in the drawing, `stated`.

    Parameters
    ----------
    stated
        Price in the drawing, or 0.
    area, thickness
        Area of the sheet or plate, mm², or 0 if it is unknown; and its thickness, mm.

    Raises
    ------
    OptionError
        The price or the density of the material is unknown, or the options contradict each other.
    """
    options = settings.of(QuoteOptions)
    if options.quote is None:
        return stated
    density = density_of(settings, material)
    price, per_kg = options.stock_price, options.price_per_kg
    if price is not None:
        if {"stock_price", "price_per_kg"} <= settings.asked:
            raise OptionError("--price-per-kg: not used with --stock-price; leave out --stock-price or --price-per-kg")
        return price
    if stated > 0.0:
        if "price_per_kg" in settings.asked:
            raise OptionError(
                "--price-per-kg: the drawing states a price of {:g} for the sheet; leave out --price-per-kg, or "
                "replace the price in the drawing with --stock-price",
                stated,
            )
        return stated
    if per_kg is None:
        raise OptionError(
            "--quote: the price of the material is missing; give --stock-price or --price-per-kg (0 if the customer "
            "supplies the material)"
        )
    if not area > 0.0:
        raise OptionError(
            "--price-per-kg: the size of the sheet or plate is unknown; draw its outline (--sheet-layers), or give "
            "its price with --stock-price"
        )
    return per_kg * weight(area * thickness, density)


def density_of(settings: Settings, material: str) -> float:
    """Return the density of the material, kg/m³. Raises OptionError if it is unknown."""
    from leafcut.read.work_materials import load_material

    given = settings.of(QuoteOptions).density
    if given is not None:
        return given
    try:
        known = load_material(material).density
    except DataError:
        raise
    except OptionError:
        known = 0.0
    if not known > 0.0:
        raise OptionError(
            "--quote: the density of '{}' is unknown, so the weight of the parts is too; give --density, such as "
            "--density 1200 (kg/m³)",
            printable(material),
        )
    return known


def weight(volume: float, density: float) -> float:
    """Return the weight, kg, of a volume, mm³, with a density, kg/m³."""
    return volume * _M3_PER_MM3 * density


def with_quote(outcome: Outcome[Any], settings: Settings, run: RunCost) -> Outcome[Any]:
    """Return the outcome with its quote.

    Raises PlanError if the program leaves out work, because the price would be too low.
    """
    if outcome.missing:
        raise PlanError(
            "--quote: the program leaves out work, so the price would be too low: {}; correct the drawing, or leave "
            "--quote out",
            outcome.missing[0],
        )
    options, today = settings.of(QuoteOptions), date.today()
    setup_cost, markup = options.setup_cost or 0.0, options.markup or 0.0
    quote = Quote(
        seller=_lines(options.seller),
        terms=_lines(options.terms),
        currency=(options.currency or "").strip(),
        made=today,
        valid_until=today + timedelta(days=options.valid_days or 0),
        material=run.material,
        is_material_supplied=run.stock_price == 0.0,
        thickness=run.thickness,
        runs=options.quantity,
        lines=quote_lines(run, options.quantity, setup_cost, markup),
        setup_cost=setup_cost,
        cost=options.quantity * run.cost + setup_cost,
        markup=markup,
    )
    return replace(outcome, quote=quote)


def no_part(name: str) -> PlanError:
    """Return the error for a quote of a drawing without a closed outline."""
    return PlanError("{}: --quote needs the closed outline of a part; leave --quote out, or draw the outline", name)


def part_label(number: int) -> Message:
    """Return the name of a part that has no name in its drawing."""
    return Message("part {}", number)
