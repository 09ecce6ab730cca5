"""The forms of the studio: their fields come from the options, and a task equals its command line."""

from __future__ import annotations

import asyncio
import os
import re
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from own_loop import awaited

from leafcut import api
from leafcut.cli import app as cli
from leafcut.errors import OptionError, ReadError
from leafcut.options import ALGORITHMS, QuoteOptions, SpeedOptions
from leafcut.options.option_spec import flag_name
from leafcut.processes import registry
from leafcut.processes.settings import all_options, collect_settings, options_used_by
from leafcut.read.machine import load_machine, machine_names
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.task import Task, command_line, program_name, resolve_task
from leafcut.studio.jobs.workers import StudioWork
from leafcut.studio.page import forms
from leafcut.studio.page.fitting_machines import offered_machines
from leafcut.studio.page.form_values import Setter
from leafcut.studio.page.page_state import View
from leafcut.studio.page.panel_input import InputPanel, task_work
from leafcut.studio.studio import Studio
from leafcut.studio.wording import words
from packages import Installer, shop

ROOT = Path(__file__).parents[2]
EN = words("en")
#: Done by the studio itself, or of `leafcut stock` alone.
NOT_OFFERED = {
    "part", "save_plan", "remnants_out", "remnant_size",
    *(set(SpeedOptions.specs()) - {"shop_rate"}),
    *(set(QuoteOptions.specs()) - {"quantity"}),
}  # fmt: skip
#: A page sets the feed of a program's materials only by the speed.
OF_A_CHART = {"cut_process", "material", "thickness", "amps", "nozzle", "chart"}


def made(work: str, **values: Any) -> list[dict[str, Any]]:
    return forms.work_form(work, values, EN, machines={"haas-vf2": "haas-vf2"}, tools=["shop"])


def test_every_option_is_in_a_form() -> None:
    shown = {
        field["name"]
        for work in forms.works_with_form()
        for algorithm in ALGORITHMS
        for group in made(work, algorithm=algorithm)
        for field in group["fields"]
    }
    assert shown == {name for _, name, _ in all_options()} - NOT_OFFERED


#: Options of a command that are not choices in a form: the page has inputs, downloads, lists and files for them.
BESIDE = {
    "defaults", "options", "output", "dry_run", "report", "process", "json", "quiet", "save_map", "tour", "help",
    "version", "watch", "every", "executor", "workers",
}  # fmt: skip
#: Options without a meaning for maps: they are solved by the map's own distance rule.
NOT_OF_MAPS = {"objective", "min_diameter", "max_diameter", "concentric", "solid"}


@pytest.mark.parametrize("command", ["optimize", "nest", "solve", "simulate", "verify"])
def test_what_a_command_takes_is_in_the_forms_of_its_work(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([command, "--help-all"]) == 0
    flags = {word.replace("-", "_") for word in re.findall(r"--([a-z][a-z0-9-]+)", capsys.readouterr().out)}
    taken = flags & {name for _, name, _ in all_options()}
    shown = {
        field["name"]
        for work in forms.works_with_form()
        if forms.work_command(work) == command
        for algorithm in ALGORITHMS
        for group in made(work, algorithm=algorithm)
        for field in group["fields"]
    }
    not_said = NOT_OFFERED | (NOT_OF_MAPS if command == "solve" else OF_A_CHART)
    assert taken - shown - not_said == set()
    assert {f.removeprefix("no_") for f in flags} - {name for _, name, _ in all_options()} - BESIDE <= {"allow_reverse"}


@pytest.mark.parametrize("work", forms.works_with_form())
def test_a_form_has_only_what_its_work_uses(work: str) -> None:
    """What else a page sent would be refused."""
    names = {
        field["name"]
        for algorithm in ALGORITHMS
        for group in made(work, algorithm=algorithm)
        for field in group["fields"]
    }
    assert names - {name for _, name, _ in options_used_by(registry.work(work))} - {"dialect", "allow_reverse"} == set()


@pytest.mark.parametrize("work", forms.works_with_form())
def test_no_option_is_twice_in_a_form_and_the_important_ones_are_open(work: str) -> None:
    groups = made(work)
    names = [field["name"] for group in groups for field in group["fields"]]
    assert len(set(names)) == len(names)
    assert len(groups[0]["fields"]) <= 11
    assert sum(len(group["fields"]) for group in groups if not group["folded"]) <= 15
    assert groups[0]["folded"] is False


def test_a_field_says_what_the_option_says_for_its_work() -> None:
    fields = {f["name"]: f for work in ("drill", "cut") for group in made(work) for f in group["fields"]}
    specs = {name: spec for _, name, spec in all_options()}
    own = registry.work("drill").helps | registry.work("cut").helps
    for name, field in fields.items():
        assert field["help"] == EN.translate_for_page(own.get(name, ("", ""))[0] or specs[name].help)
        assert field["flag"] == flag_name(name)
        assert field["kind"] == specs[name].kind
        assert field["default"] or field["kind"] == "flag"
    assert fields["feed"]["unit"] == "mm/min"
    assert fields["rotate"]["unit"] == "deg"
    assert fields["clearance_height"]["default"] == "10"
    assert [word for word, _ in fields["preset"]["choices"]] == ["fast", "default", "thorough"]
    assert fields["tools"]["file"]
    assert ["mine:shop", "shop"] in fields["tools"]["choices"]


def test_what_holds_otherwise_has_room_in_its_field_and_is_said_whole_beside_the_help() -> None:
    for language in ("en", "es"):
        for work in forms.works_with_form():
            groups = forms.work_form(work, {"algorithm": "acs"}, words(language), machines={}, tools=[])
            for field in [field for group in groups for field in group["fields"] if field["name"] != "machine"]:
                assert len(field["default"]) + len(field["unit"]) <= 19, field
    fields = {field["name"]: field for group in made("cut") for field in group["fields"]}
    assert fields["lead_out"]["default"] == "auto"
    assert fields["lead_out"]["rule"].startswith("default: auto: as the lead-in")
    assert fields["machine"]["rule"] == ""


def test_a_long_default_is_shown_by_its_first_words() -> None:
    fields = {field["name"]: field for group in made("drill") for field in group["fields"]}
    rule = "one assumed drill per diameter"
    shown = fields["tools"]["default"]
    assert shown == "one assumed…"
    assert fields["tools"]["rule"] == f"default: {rule}"


def test_a_message_names_the_fields_of_the_form_and_no_flags() -> None:
    plain = EN.translate_for_page
    assert plain("give --thickness or --depth") == "give “Thickness” or “Depth”"
    assert plain("use --no-bound") == "use “Lower bound” off"
    assert plain("--process laser, not --process cut") == "“Kind of program” laser, not “Work” Cut from sheet"
    assert plain("N10 --json x--depth") == "N10 --json x--depth"
    assert words("es").translate_for_page("give --thickness") == "give “Espesor”"


def test_in_spanish_a_field_says_it_in_spanish() -> None:
    groups = forms.work_form("cut", {}, words("es"), machines={}, tools=[])
    fields = {field["name"]: field for group in groups for field in group["fields"]}
    assert fields["kerf"]["help"] == "ancho de la sangría"
    assert fields["kerf"]["default"] == "de la tabla"
    assert words("es").explain_issue("L102") == "El archivo no dice sus unidades"
    assert EN.explain_issue("L102") == ""


@pytest.mark.parametrize("work", ["drill", "cut", "pocket", "program"])
def test_the_machine_that_is_shown_is_the_one_that_is_taken(work: str, tmp_path: Path) -> None:
    every = {name: name for name in machine_names()}
    machines = offered_machines(every, work, "", Folder(tmp_path))
    groups = forms.work_form(work, {}, EN, machines=machines, tools=[])
    field = next(field for group in groups for field in group["fields"] if field["name"] == "machine")
    taken = load_machine(field["default"])
    assert taken.controller == api.dialect_of({}, registry.work(work).asks)
    assert [field["default"]] * 2 in field["choices"]
    assert ["linuxcnc-mill"] * 2 not in field["choices"] or work != "cut"  # another machine would be used instead


def test_parameters_of_an_algorithm_come_with_it() -> None:
    assert not {"aco", "firefly"} & {group["key"] for group in made("solve")}
    assert "aco" in {group["key"] for group in made("solve", algorithm="acs")}
    assert "firefly" in {group["key"] for group in made("drill", algorithm="firefly")}


@pytest.mark.parametrize(
    ("name", "value", "wrong"),
    [
        ("thickness", "6mm", ""),
        ("thickness", "0.25in", ""),
        ("thickness", '3/8"', ""),
        ("thickness", "1 1/2in", ""),
        ("thickness", "1/0in", "division by zero in '1/0in'"),
        ("thickness", "six", "'six' is not"),
        ("thickness", "-1", "below the minimum of"),
        ("seed", "1.5", "not a whole number"),
        ("seed", "", ""),
        ("algorithm", "ants", "unknown value 'ants'"),
        ("keep_out", "0 0 1 1, 2 2 3 3", ""),
        ("start_point", "1", "not a point"),
    ],
)
def test_a_field_says_at_once_what_is_wrong(name: str, value: str, wrong: str) -> None:
    found = forms.value_error_message(name, value)
    assert (wrong in found) if wrong else found == ""


def test_what_is_at_its_default_is_not_said() -> None:
    values = {"preset": "default", "clearance_height": "10mm", "bound": True, "header": False, "seed": "", "depth": "2"}
    assert forms.changed_values(values) == {"header": False, "depth": "2"}


def test_options_of_another_work_stay_out() -> None:
    assert forms.values_of_work("cut", {"peck": "1", "kerf": "2", "n_ants": "9"}) == {"kerf": "2"}
    assert forms.values_of_work("drill", {"peck": "1", "n_ants": "9", "algorithm": "acs"}) == {
        "peck": "1",
        "n_ants": "9",
        "algorithm": "acs",
    }


def test_programs_are_never_called_as_their_source() -> None:
    assert program_name("plate.dxf", ".ngc") == "plate.ngc"
    assert program_name("part.NC", ".nc") == "part_leafcut.NC"
    assert program_name("example:plate-70", ".nc") == "plate-70.nc"
    assert program_name("random:50:2", ".ngc") == "random-50-2.ngc"
    assert program_name("plate", ".ngc") == "plate.ngc"


def test_a_page_shows_the_command_line_of_its_choices(studio: Studio) -> None:
    view = View(studio, EN)
    assert view.command_line() == ""
    view.source, view.name = studio.folder.add_input("plate.dxf", b"x"), "plate.dxf"
    view.table.set_value("thickness", "3mm")
    view.table.set_value("preset", "default")
    view.table.set_value("machine", "haas-vf2")
    assert view.command_line() == "leafcut optimize plate.dxf -o plate.nc --thickness 3mm --machine haas-vf2"
    view.work = "solve"
    assert view.command_line() == "leafcut solve plate.dxf"
    view.work = "verify"
    assert view.command_line() == ""
    view.second, view.second_name = studio.folder.add_input("new.nc", b"x"), "new.nc"
    assert view.command_line() == "leafcut verify plate.dxf new.nc --machine haas-vf2"
    view.table.set_value("machine", "")
    view.table.set_value("seed", "x")
    assert view.errors == {"seed": "--seed: 'x' is not a whole number"}


@pytest.mark.parametrize(
    "name, value, said",
    [
        ("kerf", "-3", "-3 mm está por debajo del mínimo de 0 mm; escríbalo sin el signo menos, 3 mm"),
        ("tabs", "1000", "1000 está por encima del máximo de 100"),
        ("seed", "x", "'x' no es un número entero"),
    ],
)
def test_an_error_beside_a_field_is_in_the_language_of_the_page_without_the_flag(
    name: str, value: str, said: str, studio: Studio
) -> None:
    view = View(studio, words("es"))
    view.table.set_value(name, value)
    assert view.field_errors() == {name: said}
    # Elsewhere, the message names the field.
    assert words("es").translate_for_page(view.errors[name]).endswith(f": {said}")


def test_what_was_put_for_one_input_does_not_hold_for_the_next(studio: Studio) -> None:
    """The sheet that is cut three times, its origin in a nest, and an order that was made by hand go with it."""
    view = View(studio, EN, work="cut")
    view.switch_input("A" * 16, "sheet.dxf", "nest-of-jobs/1/2")
    view.table.set_value("quantity", "3", setter=Setter.INPUT)
    view.table.set_value("plan", "P" * 16, "sheet_plan.json", setter=Setter.INPUT)
    view.table.set_value("thickness", "6mm")
    view.table.set_value("kerf", "1mm")
    assert (view.build_task().origin, view.build_task().options["quantity"]) == ("nest-of-jobs/1/2", "3")
    view.switch_input("B" * 16, "other.dxf")
    assert view.build_task() == Task("optimize", ("B" * 16,), "cut", {"kerf": "1mm"})
    assert view.table.file_names == {}
    view.table.set_value("quantity", "3", setter=Setter.INPUT)
    view.table.set_value("quantity", "5")  # typed, but still for this sheet
    view.switch_input("C" * 16, "third.dxf")
    assert view.build_task().options == {"kerf": "1mm"}


def test_a_wrong_value_of_another_work_stands_in_nobodys_way(studio: Studio) -> None:
    view = View(studio, EN, source="example:plate-10", name="plate-10")
    view.table.set_value("thickness", "thick")
    view.table.set_value("min_diameter", "near")
    assert view.invalid_values.keys() == {"thickness", "min_diameter"}
    assert view.read_preview("", StudioWork(studio.workers)).error == ""
    view.work = "program"
    assert view.invalid_values == {}


def test_what_an_older_reading_found_is_not_the_newest() -> None:
    """The first input takes longer to be read than the second, which was opened meanwhile."""
    release = threading.Event()
    panel: Any = InputPanel.__new__(InputPanel)
    panel._turn, panel.reading, panel._run_wanted = 0, False, False
    panel.newest, panel.view = None, SimpleNamespace(words=EN)
    panel.show_ready = lambda _: None

    def slow(*_: object) -> str:
        release.wait(600)
        return "first"

    def broken(*_: object) -> None:
        raise ReadError("second.dxf", "is empty")

    def view(read: Any, name: str) -> Any:
        return SimpleNamespace(studio=SimpleNamespace(workers=None), read_preview=read, name=name)

    async def open_both() -> list[Any]:
        first = asyncio.create_task(InputPanel.read_preview(panel, view(slow, "first.dxf"), ""))
        await asyncio.sleep(0)
        second = await InputPanel.read_preview(panel, view(broken, "second.dxf"), "")
        release.set()
        return [await first, second]

    (*_, first_is_newest), second = awaited(open_both())
    assert (first_is_newest, second) == (False, (None, "second.dxf: is empty", True))
    assert not panel.reading


def test_an_options_file_fills_in_the_form_and_names_no_files(studio: Studio) -> None:
    view = View(studio, EN)

    def take(text: str) -> None:
        view.load_options_file(studio.folder.add_input("shop.toml", text.encode()))

    take('[drill]\nthickness = 3\nstart_point = [1, 2]\n[post]\nheader = false\n[read]\nlayers = ["A", "B"]\n')
    assert view.values == {"thickness": "3", "start_point": "1,2", "header": False, "layers": "A,B"}
    assert view.errors == {}
    for text, line in (
        ("[drill]\nthicknes = 3\n", "^shop.toml:2: unknown option 'thicknes' in"),
        ("x", "^shop.toml: not a TOML file"),
        ('[drill]\ntools = "/etc/passwd"\n', "--tools: choose a file opened in the studio"),
        ('[machine]\nmachine = "/home/me/mill.toml"\n', "--machine: choose a file opened"),
    ):
        with pytest.raises(OptionError, match=line):
            take(text)
    assert "tools" not in view.values


def test_files_of_one_name_are_told_apart(studio: Studio) -> None:
    """A program compared with itself is always the same: the command line must not say that."""
    first, second, third = (studio.folder.add_input(name, b"M30\n") for name in ("a.nc", "a.nc", "b.nc"))
    assert command_line(Task("verify", (first, second)), studio.folder) == "leafcut verify 1/a.nc 2/a.nc"
    assert command_line(Task("verify", (first, third)), studio.folder) == "leafcut verify a.nc b.nc"
    nest = command_line(Task("nest", (f"{first}:2", f"{third}:3", f"{second}:4")), studio.folder)
    assert nest.startswith("leafcut nest 1/a.nc:2 b.nc:3 3/a.nc:4 -o ")


def test_values_of_json_mean_what_they_mean_in_a_toml_file(studio: Studio) -> None:
    task = Task(
        "optimize", ("example:plate-10",), options={"thickness": 3, "layers": ["A", "B"], "start_point": [1, 2]}
    )
    settings = collect_settings(resolve_task(task, studio.folder).options)
    assert (settings.job.thickness, settings.read.layers, settings.job.start_point) == (3.0, ("A", "B"), (1.0, 2.0))
    assert "--layers A,B" in command_line(task, studio.folder)


def test_the_drawing_before_a_run_lies_as_the_run_will_place_it() -> None:
    """Mirrored it is as large, and drawn elsewhere; a map that is solved is not placed at all."""
    from leafcut.studio.jobs.preview import read_preview

    plain = read_preview("example:plate-10", "drill")
    mirrored = read_preview("example:plate-10", "drill", {"mirror": "x"})
    assert plain.facts == mirrored.facts
    assert plain.scenes["part"] != mirrored.scenes["part"]
    assert read_preview("example:plate-10", "solve", {"mirror": "x"}).scenes["part"] == plain.scenes["part"]


def test_a_process_of_a_package_has_its_form_is_run_and_is_told_by_its_own_name(
    install: Installer, own_studio: Studio, monkeypatch: pytest.MonkeyPatch
) -> None:
    studio = own_studio
    monkeypatch.setenv("PYTHONPATH", str(install(*shop())), prepend=os.pathsep)
    for language in ("en", "es"):
        groups = forms.work_form("spot", {}, words(language), machines={}, tools=[])
        assert [f["name"] for f in groups[0]["fields"]] == ["machine", "spot_depth", "tools"]
    task = Task("optimize", ("example:plate-10",), registry.work("spot").asks, {"spot_depth": "0.7", "preset": "fast"})
    job = studio.jobs.start(task)
    assert studio.jobs.wait(job) is JobState.DONE
    program = studio.history.artefact(job, "program")
    assert program is not None
    assert b"--spot-depth 0.7" in program.data
    assert task_work(task, "plate-10") == "spot"


def test_what_packages_add_is_offered_beside_what_leafcut_brings(install: Installer) -> None:
    install(*shop())
    fields = {field["name"]: field for group in made("drill") for field in group["fields"]}
    assert [name for name, _ in fields["algorithm"]["choices"]] == [*ALGORITHMS, "random-insertion"]
    assert forms.value_error_message("algorithm", "random-insertion") == ""
    assert "shop-mill" in machine_names()


def test_a_stored_job_with_a_removed_option_is_refused_by_its_name(studio: Studio) -> None:
    task = Task("optimize", ("example:plate-10",), "drill", {"depth": "3", "milling_feed": "300"})
    with pytest.raises(OptionError, match=r"^--milling-feed is now --feed$"):
        resolve_task(task, studio.folder)
