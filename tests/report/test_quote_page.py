"""The page of a quote."""

from __future__ import annotations

import base64
import hashlib
from dataclasses import replace
from datetime import date

from leafcut.geometry.polyline import Polyline
from leafcut.model.quote import PartCost, Quote, RunCost, quote_lines
from leafcut.report.quote_page import quote_as_json, quote_page_html, weight_words
from page_parser import Page

EDGES = (Polyline.circle(50.0, 50.0, 40.0), Polyline.circle(50.0, 50.0, 10.0))
PART = PartCost("ring", 4, 450.0, 20.0, 0.2221, edges=EDGES)


def quote_of(*parts: PartCost) -> Quote:
    run = RunCost(1800.0, 80.0, parts, "mild_steel", 6.0, 10.0)
    return Quote(
        seller=("Example Metalwork", "1 Main Street"),
        terms=("Prices do not include taxes.",),
        currency="EUR",
        made=date(2026, 11, 30),
        valid_until=date(2026, 12, 30),
        material=run.material,
        is_material_supplied=False,
        thickness=run.thickness,
        runs=5,
        lines=quote_lines(run, 5, 25.0, 20.0),
        setup_cost=25.0,
        cost=425.0,
        markup=20.0,
    )


def test_the_page_shows_the_parts_and_prices_and_neither_cost_nor_markup() -> None:
    page = Page(quote_page_html(quote_of(PART)))
    for words in (
        "Example Metalwork", "1 Main Street", "2026-11-30", "2026-12-30", "mild steel", "6 mm", "ring", "80 × 80 mm",
        "222 g", "7 min", "20", "25.50", "EUR 510.00", "4.44 kg",
        "Prices do not include taxes.",
    ):  # fmt: skip
        assert words in page.words, words
    assert not [words for words in ("425", "25.00", "20 %", "20%", "markup", "cost") if words in page.words]


def test_text_from_files_stays_text_and_nothing_is_loaded_or_run() -> None:
    evil = "<script>alert('x')</script>\u202e"
    quote = replace(
        quote_of(replace(PART, name=evil)), seller=(evil, evil), terms=(evil,), currency=evil, material=evil
    )
    html = quote_page_html(quote)
    page = Page(html)
    assert "<script" not in html and "\u202e" not in html
    assert not {"script", "link", "img", "iframe", "object", "form"} & set(page.tags)
    assert not [n for _, n, _ in page.attributes if n.startswith("on") or n in ("style", "src", "href")]
    (policy,) = [v for v in page.values("content") if "default-src" in v]
    digest = base64.b64encode(hashlib.sha256("".join(page.cells["style"]).encode()).digest()).decode()
    assert policy == f"default-src 'none'; style-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"


def test_a_set_and_an_upper_limit_of_the_weight_are_named() -> None:
    page = Page(quote_page_html(quote_of(replace(PART, outlines=3, lighter=True))))
    assert "set of 3 parts" in page.words
    assert page.words.count("at most") == 2


def test_the_facts_for_scripts_have_plain_numbers() -> None:
    facts = quote_as_json(quote_of(PART))
    assert (facts["price"], facts["cost"], facts["markup_percent"]) == (510.0, 425.0, 20.0)
    (part,) = facts["parts"]
    assert (part["quantity"], part["price_each"], part["time_s_each"]) == (20, 25.5, 450.0)


def test_weights_below_a_kilogram_are_in_grams() -> None:
    assert [weight_words(kg) for kg in (12.345, 1.0, 0.2221, 0.0054, 1234.5)] == [
        "12.35 kg", "1.00 kg", "222 g", "5.4 g", "1\u202f234.50 kg",
    ]  # fmt: skip
