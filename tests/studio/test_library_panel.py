"""The pages of machines and tools, without a browser: typed text is kept until it is saved, on every page."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from nicegui.client import Client
from nicegui.page import page as page_of

from leafcut.studio.page import library
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_library import LibraryPanel
from leafcut.studio.studio import Studio
from leafcut.studio.wording import words

GRBL = library.shipped_text("machines", "grbl-3018")


@pytest.fixture(autouse=True)
def client() -> Iterator[None]:
    with Client(page_of("/")):
        yield


def panel_of(studio: Studio, kind: str, tab: str = "toml") -> tuple[LibraryPanel, list[str]]:
    """Return the form of ``mine`` on a page, and its messages."""
    said: list[str] = []
    page: Any = SimpleNamespace(
        show_message=lambda line, bad=False: said.append(line),
        input=SimpleNamespace(draw=lambda: None),
    )
    panel = LibraryPanel(View(studio, words("en")), page, kind)
    panel.tab = tab
    panel.choose("mine", True)
    return panel, said


def test_a_text_that_is_too_long_is_refused_and_stays(studio: Studio) -> None:
    library.save_profile(studio.folder, "machines", "mine", GRBL)
    panel, said = panel_of(studio, "machines")
    panel._set_text(GRBL + "#" * 300_000)
    panel._save_profile("mine")
    assert len(said) == 1 and "longer than 200,000 characters" in said[0]
    assert panel.editor is not None and len(panel.current_text) > 300_000
    assert library.own_text(studio.folder, "machines", "mine") == GRBL


def test_what_another_page_saved_is_never_overwritten_but_shown(studio: Studio) -> None:
    """Neither by a text, nor by a field, nor by a press of Save on a page that showed the text before."""
    library.save_profile(studio.folder, "machines", "mine", GRBL)
    for other, (name, act) in enumerate(
        (
            ("toml", lambda panel: panel._set_text("# mine\n" + GRBL)),
            ("form", lambda panel: panel._set_field("max_feed", "900", "")),
            ("form", lambda panel: panel._save_profile("mine")),
        )
    ):
        one, said = panel_of(studio, "machines", name)
        two, _ = panel_of(studio, "machines")
        two._set_text(f"# theirs, {other}\n{GRBL}")
        two._save_profile("mine")
        saved = library.own_text(studio.folder, "machines", "mine")
        assert saved.startswith(f"# theirs, {other}")
        act(one)
        assert said == ["“mine” was changed on another page. This is its current text: make your change again."]
        assert (one.current_text, studio.folder.draft("machines", "mine")) == (saved, None)
        one._set_field("max_feed", "900", "")
        one._save_profile("mine")
        assert library.own_text(studio.folder, "machines", "mine").startswith(f"# theirs, {other}")
        assert "900 mm/min" in library.own_text(studio.folder, "machines", "mine")


def test_what_another_page_typed_is_not_lost_and_what_it_deleted_is_told(studio: Studio) -> None:
    library.save_profile(studio.folder, "machines", "mine", GRBL)
    one, said = panel_of(studio, "machines")
    two, _ = panel_of(studio, "machines")
    two._set_text("# theirs\n" + GRBL)
    one._set_text("# mine\n" + GRBL)
    assert one.current_text == two.current_text == "# theirs\n" + GRBL
    one._set_text("# both\n" + GRBL)
    assert one.current_text == "# both\n" + GRBL
    two._delete_profile()
    one._set_text("# mine\n" + GRBL)
    assert said[-1] == "'mine' is no longer in your machines"
    assert studio.folder.own_names("machines") == []


def test_a_field_that_cannot_be_put_into_the_text_is_told_and_drawn_anew(studio: Studio) -> None:
    text = "travel = 3\n" + GRBL.replace("[travel]", "[other]")
    studio.folder.save_own("machines", "mine", text)
    panel, said = panel_of(studio, "machines", "form")
    form = panel.form
    assert form is not None
    panel._set_field("travel.min", ["0", "0", "0"], "")
    assert said == ["'travel' is not a table; write [travel]"]
    assert panel.current_text == text and panel.form is not form


def test_tools_are_added_to_no_array_of_another_form_and_that_is_told(studio: Studio) -> None:
    studio.folder.save_own("tools", "mine", 'tool = [{number = 1, diameter = "6 mm"}]')
    panel, said = panel_of(studio, "tools", "form")
    panel._add_entry("tool")
    assert said == ["'tool' must be written as [[tool]], once for each entry"]
    panel._remove_entry()
    panel._remove_entry()
    assert said[1:] == ["'tool' has no entry 1"]
