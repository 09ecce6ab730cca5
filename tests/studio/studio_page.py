"""Actions of a user on the studio's page, for tests in Chromium."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Locator, Page, expect

ROOT = Path(__file__).parents[2]
PLATE = ROOT / "examples" / "plate_10.dxf"
#: A run on a busy machine that compiles first, ms; only a safety net.
LONG = 600_000


def loaded(page: Page) -> None:
    """Wait until the page is visible and connected. Before, no element has a role, and actions may arrive late."""
    expect(page.locator(".studio")).to_be_visible()
    page.wait_for_function("window.did_handshake", timeout=LONG)


def opened(page: Page, file: Path) -> None:
    loaded(page)
    page.set_input_files("#open-file", file)
    expect(page.locator(".about-part .name")).to_have_text(file.name)


def choose_work(page: Page, work: str) -> None:
    """Choose a kind of work by its picture; return when the studio shows it as chosen."""
    picture = page.get_by_role("radiogroup", name="Work", exact=True).locator(f"input[value={work}]")
    if not picture.is_checked():
        picture.click()
    expect(picture).to_be_checked()


def work_is(page: Page, work: str) -> None:
    """Wait until a kind of work is chosen."""
    expect(page.get_by_role("radiogroup", name="Work", exact=True).locator(f"input[value={work}]")).to_be_checked()


def typed(page: Page, label: str, text: str) -> None:
    field = page.get_by_label(label, exact=True)
    field.fill(text)
    field.blur()  # and not Tab: the next field would take the keys of the page


def press_run(page: Page) -> None:
    """Press Run; holes of a drawing without a depth go 3 mm deep."""
    loaded(page)
    drilled = page.get_by_role("radiogroup", name="Work", exact=True).locator("input[value=drill]:checked").count()
    solid = re.search(r"\.ste?p$", page.locator(".about-part .name").inner_text())
    form = page.locator("#view-work")
    given = [form.get_by_label(name, exact=True) for name in ("Thickness", "Depth")]
    if drilled and not solid and not any(field.input_value() for field in given):
        given[1].fill("3")
        given[1].blur()
    page.get_by_role("button", name="Run", exact=True).click()


def run(page: Page) -> None:
    press_run(page)
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)


def choose_machine(page: Page, name: str) -> None:
    """Choose a machine of the library; return when it is shown."""
    page.locator("#view-machines").get_by_role("button", name=name, exact=True).click()
    expect(page.locator(f"#view-machines section[aria-label='{name}']")).to_be_visible()


def said_by(place: Locator) -> str:
    """Return the text of an element as soon as it has some: the page may be shown before its figures."""
    expect(place).to_have_text(re.compile(r"\S"))
    return place.inner_text()


def sure(button: Locator) -> None:
    """Press a button that asks once more, and once more: in one go, as its question goes by itself after a while."""
    assert button.evaluate(
        """at => {
            if (!at.dataset.asked) at.click();
            const asked = at.textContent === at.dataset.sure;
            at.click();
            return asked;
        }"""
    )


def steady(page: Page, script: str, *arguments: object) -> Any:
    """Return the result of a script in the page as soon as two successive results are equal: the layout has come to
    rest.
    """
    found = page.evaluate(script, *arguments)
    for _ in range(600):
        page.wait_for_timeout(100)
        before, found = found, page.evaluate(script, *arguments)
        if found == before:
            return found
    pytest.fail("it never rests")


def wait_for(page: Page, true: object) -> None:
    for _ in range(LONG // 50):
        if true():  # type: ignore[operator]
            return
        page.wait_for_timeout(50)
    pytest.fail(f"it never came; on the page stands:\n{page.locator('body').inner_text()}")


def at_rest(page: Page) -> None:
    """Wait until nothing fades or slides any more: axe would take what is half there for too pale."""
    page.evaluate("Promise.all(document.getAnimations().map((one) => one.finished.catch(() => {})))")


def downloaded(page: Page, name: str) -> tuple[str, bytes]:
    link, menu = page.get_by_role("link", name=name, exact=True), page.locator(".more-files:not([open]) > summary")
    if menu.count() and not link.count():
        menu.click()
    with page.expect_download() as waiting:
        link.click()
    return waiting.value.suggested_filename, Path(waiting.value.path()).read_bytes()


def serious(page: Page, where: str, *, dark: bool = True) -> list[tuple[str, ...]]:
    """Return the accessibility violations that axe finds in the light theme, and low contrasts in the dark theme."""
    found = _found(page, where)
    if not dark:
        return found
    page.emulate_media(color_scheme="dark")
    found += _found(page, f"{where}, dark", runOnly=["color-contrast"])
    page.emulate_media(color_scheme="light")
    return found


def _found(page: Page, where: str, **options: Any) -> list[tuple[str, ...]]:
    at_rest(page)
    # The same rules are tried without it; but of each place that keeps all of them, too, axe would write a report.
    options["resultTypes"] = ["violations"]
    return [
        (where, rule["id"], rule["nodes"][0]["html"])
        for rule in Axe().run(page, options=options).response["violations"]
        if rule["impact"] in ("serious", "critical")
    ]
