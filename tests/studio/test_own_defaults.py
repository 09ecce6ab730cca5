"""The user's defaults (`leafcut defaults`) in the studio: initial values of forms, with their origin."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from leafcut.files.user_files import DEFAULTS_VARIABLE
from leafcut.processes.settings import all_options
from leafcut.studio.page.form_values import Setter
from leafcut.studio.page.memory import kept_state, restore_choices
from leafcut.studio.page.page_state import View
from leafcut.studio.studio import Studio
from leafcut.studio.wording import words

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
    return view, view.apply_defaults()


def notes(view: View) -> dict[str, str]:
    """Return the notes of a form on the origin of values: option → text."""
    fields = [field for group in view.options_form() for field in group["fields"]]
    return {field["name"]: field["usual"] for field in fields if "usual" in field}


def test_a_form_begins_with_the_defaults_and_tells_their_lines(studio: Studio, shop: Path) -> None:
    """A default equal to leafcut's own (`preset`) does not count as set."""
    view, problem = begun(studio)
    assert problem == ""
    assert {name: view.values[name] for name in view.values if name != "machine"} == {
        "thickness": "6mm",
        "break_through": "0.7mm",
        "start_point": "1,2",
    }
    assert notes(view) == {
        "machine": "from your defaults (shop.toml:1)",
        "thickness": "from your defaults (shop.toml:2)",
        "break_through": "from your defaults (shop.toml:6)",
        "start_point": "from your defaults (shop.toml:7)",
    }
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
    view.table.set_value("thickness", "4mm")
    view.table.set_value("machine", "")
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
    assert view.build_task().options == {}  # it is only used with --thickness
    view.table.set_value("thickness", "6mm")
    assert view.build_task().options == {"thickness": "6mm", "break_through": "0.5"}
    view.table.set_value("thickness", "")
    view.table.set_value("break_through", "0.7")
    assert view.build_task().options == {"break_through": "0.7"}


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
    """Changed, new and removed defaults apply; typed or cleared values stay, and so does an open order."""
    view, _ = begun(studio)
    view.table.set_value("start_point", "3,4")
    view.table.set_value("machine", "")
    shop.write_text('machine = "mill.toml"\nthickness = "8mm"\nseed = 5\n[drill]\nstart_point = [7, 7]\n')
    other = View(studio, EN)
    restore_choices(other, json.loads(json.dumps(kept_state(view, "summary", None))))
    assert other.apply_defaults() == "" and other.apply_defaults() == ""
    assert other.values == {"thickness": "8mm", "start_point": "3,4", "seed": "5"}
    assert notes(other) == {
        "thickness": "from your defaults (shop.toml:2)",
        "seed": "from your defaults (shop.toml:3)",
    }
    other.table.apply_job_options(other.values, {}, ())  # as where an order is opened: its values are its own
    shop.write_text('thickness = "9mm"\npreset = "fast"\n')
    assert other.apply_defaults() == "" and other.values["thickness"] == "8mm" and "preset" not in other.values
    shop.write_text("thickness =\n")
    assert "not a TOML file" in other.apply_defaults() and other.values["thickness"] == "8mm"


def test_a_page_is_stored_with_its_defaults(studio: Studio, shop: Path) -> None:
    view = View(studio, EN)
    view.apply_defaults()
    view.table.set_value("seed", "3")
    kept = kept_state(view, "summary", None)
    other = View(studio, EN)
    restore_choices(other, json.loads(json.dumps(kept)))
    assert other.table == view.table


def options_of_file() -> set[str]:
    return {name for _, name, spec in all_options() if spec.of_file}


@pytest.mark.hazard
def test_values_of_a_file_start_fresh_with_the_next_and_values_of_the_shop_stay_and_are_marked(studio: Studio) -> None:
    """A pocket's depth of 4 mm is not the depth of the holes of the next drawing."""
    of_file = {
        "depth": "4", "thickness": "6", "depth_to": "tip", "layers": "pocket", "origin": "5,5", "units": "in",
        "keep_out": "0,0,10,10", "surface": "part", "workpiece": "0,0,-5,60,20,0", "low_retracts": True, "air": True,
        "sheet_size": "100,50", "pixel_size": "0.1", "beam_power": "900", "plan": "plan",
    }  # fmt: skip
    of_shop = {
        "machine": "haas-vf2", "tools": "mine:shop", "kerf": "1.2", "dialect": "haas", "feed": "100",
        "algorithm": "aco", "time_limit": "5", "tool_diameter": "3",
    }  # fmt: skip
    view = View(studio, EN)
    for name, value in (of_file | of_shop).items():
        view.table.set_value(name, value)
    view.switch_input("example:plate-10", "plate-10")  # chosen before a file was opened: meant for this file
    assert view.values == of_file | of_shop and notes(view) == {}
    view.switch_input("example:plate-10", "plate-10")
    assert view.values == of_file | of_shop
    view.switch_input("upload", "other.dxf")
    assert view.values == of_shop
    assert view.table.names_set_by(Setter.EARLIER) == set(of_shop)
    assert set(notes(view).values()) == {"kept from the last job"} and "tools" in notes(view)
    view.table.set_value("tools", "mine:other")
    assert "tools" not in notes(view)
    other = View(studio, EN)
    restore_choices(other, json.loads(json.dumps(kept_state(view, "summary", None))))
    assert other.table == view.table
    assert view.table.names_set_by(Setter.EARLIER) == set(of_shop) - {"tools"}


def test_a_file_starts_with_the_persons_own_defaults_and_not_with_what_the_last_one_had(
    studio: Studio, shop: Path
) -> None:
    view, _ = begun(studio)
    first = notes(view)
    view.table.set_value("thickness", "20")
    view.table.set_value("break_through", "")
    view.table.set_value("start_point", "3,4")
    view.switch_input("upload", "other.dxf")
    assert (view.values["thickness"], view.values["break_through"], view.values["start_point"]) == (
        "6mm",
        "0.7mm",
        "3,4",
    )
    assert notes(view) == first | {"start_point": "kept from the last job"}


def test_an_option_that_names_a_place_a_layer_or_a_depth_of_the_part_belongs_to_its_file() -> None:
    """By the words of the options themselves, which are written by hand for another purpose."""
    found = options_of_file()
    spoken = re.compile(r"\blayers?\b|\bkeep-out|\bthickness of|\bdepth of blind|\bprogram zero|\bSTL|\bplan file")
    named = {name for _, name, spec in all_options() if spoken.search(spec.help)}
    assert named - found == set()
    assert {"machine", "tools", "dialect", "kerf", "feed", "algorithm", "time_limit", "threads"}.isdisjoint(found)
