"""Schema numbers: leafcut writes them in every document, and refuses a document of a schema that it does not read."""

from __future__ import annotations

import inspect
import json
import re
import sqlite3
import tomllib
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from cyclopts import App

import leafcut
from leafcut.cli import warming
from leafcut.cli.app import build_app, main, run
from leafcut.cli.defaults import TEMPLATE
from leafcut.errors import DataError, LeafcutError
from leafcut.files import schemas
from leafcut.files.schemas import SCHEMAS, Schema, check_schema
from leafcut.gcode.dialects import dialect_template, load_dialect
from leafcut.lab.loading import load_experiment
from leafcut.lab.store import Store
from leafcut.processes.settings import read_options_file
from leafcut.read.controllers.importing import change_profile_values, machine_from_settings
from leafcut.read.controllers.questions import load_answers, machine_from_answers
from leafcut.read.machine import load_machine, machine_template
from leafcut.read.operations import read_operations
from leafcut.read.order_file import load_order, order_file_text
from leafcut.read.plan_file import load_plan
from leafcut.read.tool_text import convert_library_to_toml
from leafcut.read.tools import load_tools
from leafcut.read.work_materials import load_material, material_file_text
from leafcut.studio.jobs.history import History

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
PLATE, CAM, MAP = "example:plate-10", "cam_121.nc", "random:9:1"
TOOL = '[[tool]]\nnumber = 1\ndiameter = "6 mm"\n'
EXPERIMENT = """
command = "solve"
options = {iterations = 1, algorithm = "mmas"}
[[instance]]
name = "nine"
input = "random:9:1"
[response.length]
path = "length"
"""


def database(file: Path, read: Callable[[Path], Any], number: int) -> None:
    """Create an SQLite file of leafcut, with another schema number."""
    read(file)
    with closing(sqlite3.connect(file)) as data:
        data.execute(f"pragma user_version = {number}")


def read_results(file: Path) -> None:
    with Store(file):
        pass


def read_history(file: Path) -> None:
    History(file).close()


#: Documents of the kinds that leafcut reads as text, without a number where a person may omit it; and their readers.
TEXTS: dict[Schema, tuple[str, str, Callable[[Path], Any]]] = {
    schemas.OPTIONS: ("a.toml", "thickness = 6\n", read_options_file),
    schemas.OPERATIONS: ("a.toml", 'layer.CUT = "profile"\n', read_operations),
    schemas.MACHINE: ("a.toml", machine_template("haas-vf2"), lambda file: load_machine(str(file))),
    schemas.MACHINE_ANSWERS: ("a.toml", 'controller = "haas"\n', load_answers),
    schemas.TOOLS: ("a.toml", TOOL, load_tools),
    schemas.MATERIAL: ("a.toml", material_file_text("copper"), lambda file: load_material(str(file))),
    schemas.DIALECT: ("a.toml", 'base = "haas"\n', lambda file: load_dialect(str(file))),
    schemas.EXPERIMENT: ("a.toml", EXPERIMENT, load_experiment),
    schemas.PLAN: ("a.json", '{"leafcut_plan": 1, "contours": [], "cuts": []}', load_plan),
    schemas.ORDER: ("a.json", order_file_text({0: (0, 1)}), load_order),
}
DATABASES = {schemas.RESULTS: read_results, schemas.HISTORY: read_history}


def test_every_kind_of_document_is_tested() -> None:
    assert {*TEXTS, *DATABASES, schemas.ANSWER} == {*SCHEMAS}


def with_number(schema: Schema, text: str, number: int) -> str:
    """Return a document with another schema number."""
    if text.startswith("{"):
        return json.dumps({**json.loads(text), schema.key: number})
    return f"{schema.key} = {number}\n" + re.sub(rf"(?m)^{schema.key} = \d+\n", "", text)


@pytest.mark.parametrize("schema", TEXTS, ids=lambda schema: schema.title)
def test_a_newer_file_is_refused_in_one_line_that_names_it(schema: Schema, tmp_path: Path) -> None:
    name, text, read = TEXTS[schema]
    file = tmp_path / name
    file.write_text(with_number(schema, text, schema.current), encoding="utf-8")
    read(file)
    file.write_text(with_number(schema, text, schema.current + 1), encoding="utf-8")
    with pytest.raises(LeafcutError) as refused:
        read(file)
    number = (
        f"{file}: '{schema.key}' is {schema.current + 1}, but the newest {schema.title} that this version reads has"
    )
    assert str(refused.value) == f"{number} {schema.current}; upgrade leafcut"


@pytest.mark.parametrize("schema", DATABASES, ids=lambda schema: schema.title)
def test_a_newer_database_is_refused_and_stays_unchanged(schema: Schema, tmp_path: Path) -> None:
    file, read = tmp_path / "a.sqlite", DATABASES[schema]
    database(file, read, schema.current + 1)
    before = file.read_bytes()
    with pytest.raises(DataError, match=re.escape(f"{file}: 'schema' is {schema.current + 1}, but ")):
        read(file)
    assert file.read_bytes() == before
    database(file, lambda _: None, schema.current)
    read(file)


@pytest.mark.parametrize("schema", [schema for schema in TEXTS if schema.key == "schema"], ids=lambda s: s.title)
def test_a_file_without_a_number_has_the_current_schema(schema: Schema, tmp_path: Path) -> None:
    name, text, read = TEXTS[schema]
    file = tmp_path / name
    file.write_text(re.sub(r"(?m)^schema = 1\n", "", text), encoding="utf-8")
    assert "schema =" not in file.read_text(encoding="utf-8")
    without = read(file)
    file.write_text(with_number(schema, text, schema.current), encoding="utf-8")
    if schema != schemas.MACHINE_ANSWERS:  # these come with their line numbers
        assert read(file) == without


@pytest.mark.parametrize("schema", TEXTS, ids=lambda schema: schema.title)
def test_a_byte_order_mark_changes_nothing(schema: Schema, tmp_path: Path) -> None:
    name, text, read = TEXTS[schema]
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    without = read(file)
    file.write_text(text, encoding="utf-8-sig")
    assert read(file) == without


def test_an_old_schema_is_read_with_a_warning_until_it_is_refused(recwarn: pytest.WarningsRecorder) -> None:
    thing = Schema("thing", current=3, oldest=2)
    check_schema(thing, 3, "a.toml")
    assert not recwarn.list
    with pytest.warns(FutureWarning, match="a.toml: 'schema' is 2, but a current thing has 3"):
        check_schema(thing, 2, "a.toml")
    with pytest.raises(DataError, match=r"a\.toml: 'schema' is 1, but the oldest thing that this version reads has 2"):
        check_schema(thing, 1, "a.toml")
    for number in (0, -1, 1.0, True, "3", None, [3]):
        with pytest.raises(DataError, match=r"a\.toml: 'schema' is .*, but must be a whole number of 1 or more"):
            check_schema(thing, number, "a.toml")


def test_the_command_line_prints_such_a_warning_as_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warnings, "formatwarning", warnings.formatwarning)
    with pytest.raises(SystemExit):
        main(["--version"])
    assert warnings.formatwarning("a.toml: old", FutureWarning, "schemas.py", 7) == "leafcut: a.toml: old\n"


def written(tmp_path: Path) -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each TOML file that leafcut writes."""
    settings = (ROOT / "tests" / "read" / "settings" / "grbl_3018.txt").read_text(encoding="utf-8")
    table = tmp_path / "tools.csv"
    table.write_text("number,kind,diameter\n1,drill,6\n", encoding="utf-8")
    library = tmp_path / "tools.toml"
    library.write_text(f'# Ours\n{TOOL}feed = "100 mm/min"\nspindle_speed = "900 rpm"\n', encoding="utf-8")
    saved = tmp_path / "saved.toml"
    given: dict[str, Any] = {"depth": 3, "material": "steel-c45", "save": saved}
    yield "list machines", machine_template("haas-vf2")
    yield "machine import", machine_from_settings(settings, "grbl.txt").text
    answers = {"name": "mill", "controller": "haas", "rapid": "20 m/min"}
    yield "machine new", machine_from_answers(answers).text
    yield "machine check", change_profile_values("haas-vf2", {}, "a.toml")
    yield "list materials", material_file_text("copper")
    yield "list dialects", dialect_template("haas")
    yield "tools import", convert_library_to_toml(str(table), "mm")[0]
    yield "defaults --template", TEMPLATE
    leafcut.tool_speeds(**given, tools=library)
    yield "tools speeds --save, with a library", saved.read_text(encoding="utf-8")
    leafcut.tool_speeds(**given, tool_diameter=6)
    yield "tools speeds --save", saved.read_text(encoding="utf-8")


def test_every_file_that_leafcut_writes_states_its_schema(tmp_path: Path) -> None:
    for name, text in written(tmp_path):
        assert tomllib.loads(text)["schema"] == 1, name


#: A short run of every command that answers in JSON, in a folder with the files that it names.
RUNS = [
    "list machines", "list machines haas-vf2", "list materials", "list materials copper", "list dialects",
    "list dialects haas", "list algorithms", "list formats", "list plugins", "defaults", "install addon",
    "install addon inkscape .", "install kernels", "lab list",
    "lab run nine.toml", "lab report nine.toml",
    f"lab tune {MAP} random:9:2 random:9:3 --algorithm mmas --process solve --trials 1 --seeds 1 --iterations 1",
    "machine import settings.txt", "machine new --name m --controller haas --rapid 20m/min",
    f"machine check {CAM} --measured 5:00 --machine haas-vf2", "tools import tools.csv --units mm",
    f"optimize {PLATE} --depth 3 --algorithm none --dry-run", f"drill {PLATE} --depth 3 --algorithm none --dry-run",
    f"optimize {PLATE} example:plate-27 --depth 3 --algorithm none --dry-run",
    "cut bracket.dxf --thickness 6 --preset fast --dry-run", f"reorder {CAM} --algorithm none --dry-run",
    "pocket pocket.dxf --depth 1 --tool-diameter 10 --strategy contour --dry-run",
    "part bracket.dxf --thickness 3 --tool-diameter 3 --preset fast --dry-run",
    "nest bracket.dxf:1 --sheet 600x400 --nester rectangles --variants 1",
    f"optimize {PLATE} example:plate-27 --depth 3 -o out --preset fast", f"solve {MAP} --preset fast",
    f"reorder {CAM} --algorithm none --feeds --tool-diameter 6 --workpiece -500,-500,-20,500,500,0 --dry-run",
    f"simulate {CAM}", f"simulate {CAM} {CAM}", f"stock {CAM} --tool-diameter 6", f"verify {CAM} {CAM}",
    "tools speeds --depth 3 --tool-diameter 6 --material steel-c45",
]  # fmt: skip
#: It needs a board: tests/sender/test_marlin.py.
WITH_A_BOARD = {"send"}


def answering(application: App, place: str = "") -> Iterator[str]:
    """Yield the commands that have --json."""
    for name in application:
        if name.startswith("-"):
            continue
        command = application[name].default_command
        if command is None:
            yield from answering(application[name], f"{name} ")
        elif "as_json" in inspect.signature(command).parameters:
            yield place + name


def values_of(answer: Any) -> Iterator[Any]:
    """Yield all numbers and texts of an answer."""
    if isinstance(answer, dict | list):
        for value in answer.values() if isinstance(answer, dict) else answer:
            yield from values_of(value)
    else:
        yield answer


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("drill nosuch.dxf", "nosuch.dxf"),
        ("drill", "INPUT"),
        ("drill a.dxf --no-such-option", "--no-such-option"),
        ("list machines nosuch", "nosuch"),
        ("verify nosuch.nc nosuch.nc", "nosuch.nc"),
    ],
)
def test_a_refusal_is_one_object_and_the_same_line_on_standard_error(
    words: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run([*words.split(), "--json"]) in (1, 2)
    out, err = capsys.readouterr()
    answer = json.loads(out)
    assert list(answer) == ["schema", "error"]
    assert told in answer["error"]
    assert err == f"leafcut: {answer['error']}\n"


def test_an_error_that_the_answer_reports_is_not_answered_again(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        warming, "compile_all_kernels", lambda _: SimpleNamespace(count=3, seconds=1.0, is_cached=False)
    )
    assert run(["install", "kernels", "--json"]) == 1
    out, err = capsys.readouterr()
    assert json.loads(out) == {"schema": 1, "compiled": 3, "seconds": 1.0, "kept": False}
    assert "NUMBA_CACHE_DIR" in err


def test_every_command_that_answers_in_json_is_tested() -> None:
    commands = {*answering(build_app())}
    run_here = {command for words in RUNS for command in commands if f"{words} ".startswith(f"{command} ")}
    assert run_here == commands - WITH_A_BOARD


@pytest.mark.parametrize("words", RUNS, ids=lambda words: words[:24])
def test_a_json_answer_is_one_object_that_begins_with_its_schema(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(warming, "compile_all_kernels", lambda _: SimpleNamespace(count=0, seconds=0.0, is_cached=True))
    Path("settings.txt").write_bytes((ROOT / "tests" / "read" / "settings" / "grbl_3018.txt").read_bytes())
    for name in (CAM, "bracket.dxf", "pocket.dxf"):
        Path(name).write_bytes((EXAMPLES / name).read_bytes())
    Path("out").mkdir()
    Path("tools.csv").write_text("number,kind,diameter\n1,drill,6\n")
    Path("nine.toml").write_text(EXPERIMENT)
    if words.startswith("lab report"):
        read_results(Path("leafcut_lab.sqlite"))
    assert run([*words.split(), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert next(iter(answer.items())) == ("schema", 1)
    assert not {"inf", "-inf", "nan"} & {*map(str, values_of(answer))}
