"""Results describe, show and save themselves: in a line, as a picture, as plain values and as files."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import leafcut
from leafcut.cli import app as cli
from leafcut.gcode.dialects import dialect_template
from leafcut.results.base import Result

EXAMPLES = Path(__file__).parents[1] / "examples"
PLATE, BRACKET = str(EXAMPLES / "plate_10.dxf"), str(EXAMPLES / "bracket.dxf")
PROGRAM = (
    "G21 G90 G17\nT1 M6\nS1000 M3\nG0 Z5\nG0 X5 Y5\nG1 Z-1 F100\nG1 X20\nG0 Z5\nG0 X20 Y20\nG1 Z-1\nG1 X5\nG0 Z5\nM30\n"
)

#: The least work for each function: the command, its input files ("cam" is `PROGRAM`), and its options.
CALLS: dict[str, tuple[str, list[str], dict[str, Any]]] = {
    "drill": ("drill", [PLATE], {"depth": 3, "iterations": 1, "threads": 1}),
    "reorder": ("reorder", ["cam"], {"iterations": 1, "threads": 1}),
    "simulate": ("simulate", ["cam"], {}),
    "verify": ("verify", ["cam", "cam"], {}),
    "stock": ("stock", ["cam"], {"tool_diameter": 3.0, "cell": 0.5}),
    "nest": ("nest", [f"{BRACKET}:3"], {"sheet": "500x300", "nester": "rectangles", "variants": 1}),
    "solve": ("solve", ["random:8:1"], {"algorithm": "nn"}),
    "tool_speeds": ("tools speeds", [], {"material": "c45", "tool_diameter": 6.0, "depth": 9.0}),
}
#: What depends on the clock.
CLOCKED = {"seconds", "search_seconds", "compile_seconds", "history", "workers"}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], str]:
    """Return the path of an input of `CALLS`."""
    cam = tmp_path_factory.mktemp("results") / "cam.nc"
    cam.write_text(PROGRAM)
    return lambda name: str(cam) if name == "cam" else name


@pytest.fixture(scope="module", params=CALLS)
def case(request: pytest.FixtureRequest, files: Callable[[str], str]) -> tuple[str, Result]:
    """Return each function of the library and its result."""
    name: str = request.param
    _, inputs, options = CALLS[name]
    words = [files(word) for word in inputs]
    found: Result = getattr(leafcut, name)(*([words] if name == "nest" else words), **options)
    return name, found


def test_the_plain_values_are_those_that_the_command_prints(
    case: tuple[str, Result], files: Callable[[str], str], capsys: pytest.CaptureFixture[str]
) -> None:
    name, found = case
    command, inputs, options = CALLS[name]
    flags = [word for option, value in options.items() for word in (f"--{option.replace('_', '-')}", str(value))]
    flags += ["--dry-run"] if name in ("drill", "reorder", "nest") else []
    cli.run([*command.split(), *map(files, inputs), *flags, "--json"])
    printed = json.loads(capsys.readouterr().out)
    assert printed["schema"] == 1 and "error" not in printed
    plain = json.loads(json.dumps(found.to_dict()))
    assert {k: v for k, v in plain.items() if k not in CLOCKED} == {
        k: v for k, v in printed.items() if k not in CLOCKED
    }
    assert plain.keys() == printed.keys()


def test_a_result_describes_itself_in_one_line(case: tuple[str, Result]) -> None:
    _, found = case
    line = repr(found)
    assert line.startswith(f"{type(found).__name__}(") and len(line) < 160
    assert line.isprintable()


def test_a_notebook_shows_a_picture_that_runs_no_script(case: tuple[str, Result]) -> None:
    name, found = case
    page = found._repr_html_()
    assert "<script" not in page and re.search(r"\bon[a-z]+=", page) is None
    ElementTree.fromstring(page.replace("<br>", "<br/>").replace('">', '"/>', 1) if "<img" in page else page)
    picture = re.search(r'src="data:image/svg\+xml;base64,([^"]+)"', page)
    assert (picture is None) == (name == "verify")
    if picture:
        drawing = ElementTree.fromstring(base64.b64decode(picture[1]))
        assert drawing.tag == "{http://www.w3.org/2000/svg}svg"
        assert not [part for part in drawing.iter() if part.tag.endswith("script")]
        links = [value for part in drawing.iter() for key, value in part.items() if key.endswith("href")]
        assert all(link.startswith(("#", "data:")) for link in links)


def test_every_kind_of_file_is_written(case: tuple[str, Result], tmp_path: Path) -> None:
    _, found = case
    for ending in found._contents_by_extension():
        file = tmp_path / f"saved{ending or '.nc'}"
        found.save(file)
        assert file.stat().st_size > 0
    assert json.loads((tmp_path / "saved.json").read_text(encoding="utf-8")) == json.loads(json.dumps(found.to_dict()))


def test_saving_never_overwrites_an_input(case: tuple[str, Result]) -> None:
    _, found = case
    for name in found.inputs:
        file = Path(name)
        if file.is_file():
            before = file.read_bytes()
            with pytest.raises(leafcut.LeafcutError, match="never overwritten"):
                found.save(file)
            assert file.read_bytes() == before


def test_files_that_options_name_are_inputs(tmp_path: Path, files: Callable[[str], str]) -> None:
    library, dialect = tmp_path / "tools.toml", tmp_path / "my.toml"
    library.write_text('[[tool]]\nnumber = 1\nkind = "end-mill"\ndiameter = "3 mm"\n')
    dialect.write_text(dialect_template("linuxcnc"))
    found = leafcut.stock(files("cam"), tools=library, dialect=str(dialect), cell=0.5)
    assert {str(library), str(dialect), files("cam")} <= set(found.inputs)


def test_the_program_is_saved_as_it_would_be_written(tmp_path: Path) -> None:
    found = leafcut.drill(PLATE, tmp_path / "written.nc", depth=3, iterations=1, threads=1)
    found.save(tmp_path / "saved.nc")
    assert (tmp_path / "saved.nc").read_bytes() == (tmp_path / "written.nc").read_bytes()


def test_an_unknown_kind_of_file_is_refused_with_the_known_ones(files: Callable[[str], str], tmp_path: Path) -> None:
    with pytest.raises(leafcut.OptionError, match=r"choose a name that ends in \.json or \.svg"):
        leafcut.simulate(files("cam")).save(tmp_path / "path.pdf")
    assert not list(tmp_path.iterdir())


def test_a_danger_is_shown_in_a_notebook(tmp_path: Path) -> None:
    low = tmp_path / "low.nc"
    low.write_text("G21 G90 G17\nS1000 M3\nG0 Z5\nG0 X5 Y5\nG1 Z-1 F100\nG0 X9\nG0 Z5\nM30\n")
    found = leafcut.simulate(low)
    assert "1 danger)" in repr(found)
    assert "<br>danger: " in found._repr_html_()
