"""Journeys of six people who use the studio for the first time."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect
from studio_page import LONG, ROOT, choose_work, opened, run, typed

EXAMPLES = ROOT / "examples"
#: A slot whose tool the program describes, of a depth.
SLOT = "(T1 D=8. CR=0. - flat end mill)\nG21 G90 G94\nT1 M6\nS3000 M3\nG0 X0 Y0 Z5\nG1 Z{} F200\nX60 F600\nG0 Z5\nM30\n"
#: Called at every station of a journey, when it is shown.
Station = Callable[[str], None]


def tab(page: Page, name: str) -> None:
    page.locator(".result").get_by_role("tab", name=name).click()
    expect(page.locator(".result").get_by_role("tab", name=name)).to_have_attribute("aria-selected", "true")


def solid(page: Page) -> None:
    page.get_by_role("radio", name="Solid", exact=True).click()
    expect(page.locator(".lc-solid-frame")).to_have_attribute("aria-busy", "false")
    expect(page.locator(".lc-differs")).to_be_visible()


def machinist(page: Page, at: Station) -> None:
    """He has a plate with holes and a Haas."""
    at("empty")
    opened(page, EXAMPLES / "plate_70.dxf")
    page.get_by_label("Machine", exact=True).select_option("haas-vf2")
    typed(page, "Thickness", "0.25in")
    at("opened")
    run(page)
    at("result")
    tab(page, "Program")
    at("program")


def programmer(page: Page, at: Station) -> None:
    """He has a program of his CAM and wants the same one, shorter."""
    opened(page, EXAMPLES / "cam_121.nc")
    at("opened")
    run(page)
    expect(page.locator(".headline")).to_be_visible(timeout=LONG)  # until then his own program stands there
    at("result")
    tab(page, "Program")
    at("program")
    tab(page, "Search")
    at("search")


def plasma_shop(page: Page, at: Station) -> None:
    """He cuts nested parts from a sheet."""
    opened(page, EXAMPLES / "sheet.dxf")
    choose_work(page, "cut")
    typed(page, "Thickness", "6")
    at("opened")
    run(page)
    at("result")
    tab(page, "Issues")
    at("issues")


def mould_maker(page: Page, at: Station) -> None:
    """He mills pockets."""
    opened(page, EXAMPLES / "pocket.dxf")
    choose_work(page, "pocket")
    typed(page, "Tool diameter", "10")
    typed(page, "Depth", "3")
    at("opened")
    run(page)
    at("result")
    solid(page)
    at("solid")


def inspector(page: Page, at: Station) -> None:
    """He has two versions of a program, and asks what of the part they leave otherwise."""
    old, new = (
        {"name": name, "mimeType": "text/plain", "buffer": SLOT.format(depth).encode()}
        for name, depth in (("old.nc", -3), ("new.nc", -2))
    )
    page.set_input_files("#open-file", old)
    expect(page.locator(".about-part .name")).to_have_text("old.nc")
    choose_work(page, "verify")
    page.locator(".second input[type=file]").set_input_files(new)
    expect(page.locator(".second")).to_contain_text("new.nc")
    run(page)
    solid(page)
    page.get_by_role("button", name="Next difference").click()
    at("solid")


def student(page: Page, at: Station) -> None:
    """She watches ants look for a tour, step by step."""
    page.get_by_text("Examples and random maps").click()
    typed(page, "Points", "120")
    page.get_by_role("button", name="Create map").click()
    choose_work(page, "solve")
    page.get_by_label("Algorithm", exact=True).select_option("mmas")
    page.get_by_label("Speed", exact=True).first.select_option("step")
    at("chosen")
    page.get_by_role("button", name="Run", exact=True).click()
    step = page.get_by_role("button", name="Single step")
    expect(step).to_be_visible(timeout=LONG)
    for _ in range(6):
        before = page.locator(".study .figure").inner_text()
        step.click()
        expect(page.locator(".study .figure")).not_to_have_text(before)
    at("step")
    page.get_by_role("button", name="Stop, keep the best").click()
    expect(page.locator("#result-panel")).to_be_visible(timeout=LONG)
    at("result")


JOURNEYS: dict[str, Callable[[Page, Station], None]] = {
    "machinist": machinist,
    "programmer": programmer,
    "plasma_shop": plasma_shop,
    "mould_maker": mould_maker,
    "inspector": inspector,
    "student": student,
}
