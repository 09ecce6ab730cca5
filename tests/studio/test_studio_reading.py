"""While an input is read, the page shows how far that is, and a person can cancel it."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import works
from nicegui.client import Client
from nicegui.page import page as page_of
from own_loop import awaited
from waiting import has_ended, until

from leafcut.studio.jobs.preview import read_preview
from leafcut.studio.page import page_state, panel_reading
from leafcut.studio.page.pages import Page
from leafcut.studio.studio import Studio
from leafcut.studio.wording import words

EN = words("en")
CIRCLE = "0\nCIRCLE\n8\n0\n10\n9\n20\n0\n40\n2\n"


@pytest.fixture
def studio(own_studio: Studio) -> Studio:
    """Return a studio whose processes may be killed."""
    return own_studio


def process_of(page: Page) -> int:
    """Return the number of the process that reads the input for ever."""
    assert page.input.newest is not None
    return int(page.input.newest.what.split()[1])


@contextmanager
def opened(studio: Studio) -> Iterator[tuple[Page, Client]]:
    with Client(page_of("/")) as client:
        page = Page(studio, EN)
        page.build()
        yield page, client


async def come(true: Any) -> None:
    await asyncio.to_thread(until, true)


def within(client: Client, work: Any) -> asyncio.Task[None]:
    async def go() -> None:
        with client:
            await work()

    return asyncio.create_task(go())


def test_reading_that_is_cancelled_ends_and_the_page_stays_at_the_input_before(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(panel_reading, "QUIET_SECONDS", 0.0)

    async def work() -> None:
        with opened(studio) as (page, client):
            await page.input.open("example:plate-10", "plate-10")
            seen = page.view.seen
            with monkeypatch.context() as patched:
                patched.setattr(page_state, "preview_without_part", works.read_for_ever)
                opening = within(client, lambda: page.input.open("example:plate-27", "plate-27"))
                await come(lambda: page.input.newest is not None and page.input.newest.what)
                page.run.tick()
                number = process_of(page)
                shown = page.run.reading
                line = f"process {number}, 25 %"
                assert (shown.place.visible, shown.name.text, shown.what.text) == (True, "plate-27", line)
                page.input.cancel_reading()
                await opening
            page.run.tick()
            assert not shown.place.visible
            assert (page.view.source, page.view.seen, page.message_line.text) == (
                "example:plate-10",
                seen,
                "Reading cancelled.",
            )
            assert not page.input.reading
            await come(lambda: has_ended(number))

    awaited(work())


def test_another_input_ends_the_reading_of_the_one_before(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    async def work() -> None:
        with opened(studio) as (page, client):
            with monkeypatch.context() as patched:
                patched.setattr(page_state, "preview_without_part", works.read_for_ever)
                opening = within(client, lambda: page.input.open("example:plate-27", "plate-27"))
                await come(lambda: page.input.newest is not None and page.input.newest.what)
                number = process_of(page)
            await page.input.open("example:plate-10", "plate-10")
            await opening
            await come(lambda: has_ended(number))
            assert page.view.source == "example:plate-10"
            assert page.view.seen is not None

    awaited(work())


def test_what_is_read_again_and_cancelled_keeps_the_choice_and_says_why_nothing_is_drawn(
    studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A drawing of the choice before would not show what a run makes."""

    async def work() -> None:
        with opened(studio) as (page, client):
            await page.input.open("example:plate-10", "plate-10")
            kinds = page.view.works()
            with monkeypatch.context() as patched:
                patched.setattr(page_state, "preview_without_part", works.read_for_ever)
                again = within(client, lambda: page.input.set_option("rotate", "90", ""))
                await come(lambda: page.input.newest is not None and page.input.newest.what)
                page.input.cancel_reading()
                await again
            assert page.view.values == {"rotate": "90"}
            assert page.view.seen is not None
            assert (page.view.seen.error, page.view.works()) == ("Reading cancelled.", kinds)
            assert page.view.has_all_inputs

    awaited(work())


def test_a_page_that_is_gone_ends_its_reading(studio: Studio, monkeypatch: pytest.MonkeyPatch) -> None:
    async def work() -> None:
        with opened(studio) as (page, client):
            monkeypatch.setattr(page_state, "preview_without_part", works.read_for_ever)
            opening = within(client, lambda: page.input.open("example:plate-27", "plate-27"))
            await come(lambda: page.input.newest is not None and page.input.newest.what)
            number = process_of(page)
            page._release()
            await opening
            await come(lambda: has_ended(number))
            assert page.view.seen is None

    awaited(work())


@pytest.mark.parametrize(
    "name, text",
    [
        ("a.csv", "1,2,3\n" * 2000),
        ("a.ngc", "G21 G90 G94 G17\nG1 X1 F100\n" + "G1 X2\nG4 P1\n" * 1000 + "M2\n"),
        ("a.dxf", f"0\nSECTION\n2\nENTITIES\n{CIRCLE * 2000}0\nENDSEC\n0\nEOF\n"),
    ],
)
def test_readers_that_know_how_far_they_are_report_it(
    name: str, text: str, tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("leafcut.model.heartbeat._REPORT_INTERVAL", 0.0)
    told: list[tuple[str, float]] = []
    file = tmp_path / name
    file.write_text(text)
    read_preview(str(file), "", {}, lambda now: told.append((now.step, now.share)))
    assert {what for what, _ in told} == {"reading", "drawing the preview"}
    shares = [share for _, share in told]
    assert all(0.0 <= share <= 1.0 for share in shares)
    assert max(shares) > 0.9
