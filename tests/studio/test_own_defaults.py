"""The person's own defaults (`leafcut defaults`) in the studio: forms begin with them, and say where they come from."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from leafcut.studio.page.kept_state import KeptState
from leafcut.studio.page.page_state import View
from leafcut.studio.studio import Studio
from leafcut.studio.wording import words
from leafcut.user_files import DEFAULTS_VARIABLE

EN = words("en")
SHOP = """\
machine = "mill.toml"
thickness = "6mm"
preset = "default"

[drill]
break_through = "0.7mm"
start_point = [1, 2]
"""


@pytest.fixture
def shop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a file of defaults beside a profile that it names."""
    from leafcut.read.machine import machine_template

    (tmp_path / "mill.toml").write_text(machine_template("haas-vf2"))
    file = tmp_path / "shop.toml"
    file.write_text(SHOP)
    monkeypatch.setenv(DEFAULTS_VARIABLE, str(file))
    return file


def begun(studio: Studio, work: str = "drill") -> tuple[View, str]:
    view = View(studio, EN, source="example:plate-10", name="plate-10", work=work)
    return view, view.take_defaults()


def notes(view: View) -> dict[str, str]:
    """Return what the form tells of where a value comes from: option → words."""
    fields = [field for group in view.form() for field in group["fields"]]
    return {field["name"]: field["usual"] for field in fields if "usual" in field}


def test_a_form_begins_with_the_defaults_and_tells_their_lines(studio: Studio, shop: Path) -> None:
    """A value that leafcut has anyway (`preset`) is none that was given."""
    view, problem = begun(studio)
    assert problem == ""
    assert {name: view.values[name] for name in view.values if name != "machine"} == {
        "thickness": "6mm", "break_through": "0.7mm", "start_point": "1,2",
    }  # fmt: skip
    assert notes(view) == {
        "machine": "from your defaults (shop.toml:1)", "thickness": "from your defaults (shop.toml:2)",
        "break_through": "from your defaults (shop.toml:6)", "start_point": "from your defaults (shop.toml:7)",
    }  # fmt: skip
    assert view.values["machine"] == "mine:mill"
    copy = studio.folder.own_path("machines", "mill")
    assert copy.read_text() == (shop.parent / "mill.toml").read_text()


def test_a_machine_of_the_library_with_the_name_of_the_defaults_one_is_kept(studio: Studio, shop: Path) -> None:
    from leafcut.read.machine import machine_template

    studio.folder.save_own("machines", "mill", machine_template("grbl-3018"))
    assert begun(studio)[0].values["machine"] == "mine:mill-defaults"
    assert studio.folder.own_path("machines", "mill").read_text() == machine_template("grbl-3018")


def test_the_command_line_says_the_defaults_and_that_no_others_hold(studio: Studio, shop: Path) -> None:
    line = begun(studio)[0].command_line()
    for words_of in ("--machine mill.toml", "--thickness 6mm", "--break-through 0.7mm", "--no-defaults"):
        assert words_of in line


def test_a_value_that_is_typed_is_no_default_any_more(studio: Studio, shop: Path) -> None:
    view, _ = begun(studio)
    view.put("thickness", "4mm")
    view.put("machine", "")
    assert notes(view).keys() == {"break_through", "start_point"}
    assert "machine" not in view.values


def test_a_default_that_does_nothing_is_left_out_of_the_run_and_a_typed_value_is_not(
    studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command line does the same: --break-through is only used with a thickness."""
    file = tmp_path / "shop.toml"
    file.write_text("break_through = 0.5\n")
    monkeypatch.setenv(DEFAULTS_VARIABLE, str(file))
    view, _ = begun(studio)
    assert view.task().options == {}  # it is only used with --thickness
    view.put("thickness", "6mm")
    assert view.task().options == {"thickness": "6mm", "break_through": "0.5"}
    view.put("thickness", "")
    view.put("break_through", "0.7")
    assert view.task().options == {"break_through": "0.7"}


def test_defaults_of_another_kind_of_work_stay_out_of_its_run(studio: Studio, shop: Path) -> None:
    assert begun(studio, "solve")[0].command_line() == "leafcut solve plate-10 --no-defaults".replace(
        "plate-10", "example:plate-10"
    )


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ('thicknes = "6mm"\n', "shop.toml:1: unknown option 'thicknes'"),
        ("thickness =\n", "shop.toml: not a TOML file"),
        ('machine = "gone.toml"\n', "gone.toml: file not found"),
    ],
)
def test_a_broken_file_of_defaults_says_one_line_and_nothing_of_it_is_taken(
    text: str, line: str, studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "shop.toml"
    file.write_text(text)
    monkeypatch.setenv(DEFAULTS_VARIABLE, str(file))
    view, problem = begun(studio)
    assert line in problem and "\n" not in problem
    assert view.values == {}


def test_a_page_that_is_loaded_again_follows_the_defaults_as_they_are_now(studio: Studio, shop: Path) -> None:
    """Changed, new and removed defaults hold; what was typed or emptied stays as it is, and so does an order opened."""
    view, _ = begun(studio)
    view.put("start_point", "3,4")
    view.put("machine", "")
    shop.write_text('machine = "mill.toml"\nthickness = "8mm"\nseed = 5\n[drill]\nstart_point = [7, 7]\n')
    other = View(studio, EN)
    KeptState.from_json(json.loads(KeptState.of(view, "summary", None).as_json())).put_into(other)
    assert other.renew_defaults() == "" and other.renew_defaults() == ""
    assert other.values == {"thickness": "8mm", "start_point": "3,4", "seed": "5"}
    assert notes(other) == {
        "thickness": "from your defaults (shop.toml:2)", "seed": "from your defaults (shop.toml:3)",
    }  # fmt: skip
    other.usual, other.known_defaults = {}, None  # as where an order is opened: its values are its own
    shop.write_text('thickness = "9mm"\npreset = "fast"\n')
    assert other.renew_defaults() == "" and other.values["thickness"] == "8mm" and "preset" not in other.values
    shop.write_text("thickness =\n")
    assert "not a TOML file" in other.renew_defaults() and other.values["thickness"] == "8mm"


def test_a_page_with_nothing_but_defaults_is_none_to_come_back_to(studio: Studio, shop: Path) -> None:
    view = View(studio, EN)
    view.take_defaults()
    state = KeptState.of(view, "summary", None)
    assert not state.chosen
    view.put("seed", "3")
    kept = KeptState.of(view, "summary", None)
    assert kept.chosen
    other = View(studio, EN)
    KeptState.from_json(json.loads(kept.as_json())).put_into(other)
    assert (other.values, other.usual) == (view.values, view.usual)
