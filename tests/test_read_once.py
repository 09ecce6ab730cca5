"""An input is read once: what was looked at to see what it is, is what is worked on."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut import api
from leafcut.read import Source
from leafcut.studio.page.preview import look

EXAMPLES = Path(__file__).parents[1] / "examples"
STYLES = Path(__file__).parent / "styles"
LITTLE = {"iterations": 1, "bound": False, "threads": 1}

#: Kind of work → input, what else is put in its place, process and options.
WORK: dict[str, tuple[Path, Path, str, dict[str, Any]]] = {
    "drill": (EXAMPLES / "plate_10.dxf", EXAMPLES / "plate_27.dxf", "auto", {"thickness": 6}),
    "cut": (EXAMPLES / "bracket.dxf", EXAMPLES / "sheet.dxf", "cut", {"thickness": 6}),
    "pocket": (EXAMPLES / "pocket.dxf", EXAMPLES / "bracket.dxf", "pocket", {"depth": 2, "tool_diameter": 6}),
    "picture": (EXAMPLES / "pocket.png", EXAMPLES / "bracket.dxf", "pocket", {"depth": 2, "tool_diameter": 6}),
    "program": (STYLES / "lightburn_vector.gc", STYLES / "cambam_drill.nc", "auto", {}),
}


def _noted(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and _opened and isinstance(arguments[0], str | os.PathLike | bytes):
        _opened[-1].append(os.fsdecode(os.fspath(arguments[0])))


#: For every test that listens, the paths of the files that Python has opened since.
_opened: list[list[str]] = []
sys.addaudithook(_noted)


@contextmanager
def listening() -> Iterator[list[str]]:
    """Collect the paths of all files that are opened, by Python's own account."""
    _opened.append([])
    try:
        yield _opened[-1]
    finally:
        _opened.pop()


def times_opened(paths: list[str], file: Path) -> int:
    """Return how often a file is among paths."""
    return sum(os.path.realpath(path) == os.path.realpath(file) for path in paths)


def options_of(work: str) -> dict[str, Any]:
    """Return the process and the options of a kind of work, with little to search."""
    _, _, process, options = WORK[work]
    search = {"strategy": "contour"} if process == "pocket" else LITTLE
    scale = {"pixel_size": 0.2} if work == "picture" else {}
    return {"process": process, **options, **search, **scale}


def test_the_account_counts_what_is_opened(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_bytes(b"a")
    with listening() as paths:
        file.read_bytes()
        os.close(os.open(file, os.O_RDONLY))
    assert times_opened(paths, file) == 2


@pytest.mark.parametrize("work", list(WORK))
def test_an_input_is_opened_once(work: str, tmp_path: Path) -> None:
    source = tmp_path / WORK[work][0].name
    shutil.copy(WORK[work][0], source)
    with listening() as paths:
        leafcut.optimize(source, tmp_path / "out.nc", **options_of(work))
    assert times_opened(paths, source) == 1


@pytest.mark.parametrize("work", list(WORK))
def test_a_file_that_changes_while_work_goes_on_changes_nothing(work: str, tmp_path: Path) -> None:
    """As soon as anything is told, another file stands in its place: the answer is that of the first."""
    source = tmp_path / WORK[work][0].name
    shutil.copy(WORK[work][0], source)
    expected = leafcut.optimize(source, **options_of(work))
    told = 0

    def exchange(*_: Any) -> None:
        nonlocal told
        told += 1
        shutil.copy(WORK[work][1], source)

    found = leafcut.optimize(source, progress=exchange, **options_of(work))
    assert told and source.read_bytes() == WORK[work][1].read_bytes()
    assert found.text == expected.text


def test_parts_and_sheets_of_a_nest_are_opened_once_however_often_they_are_named(tmp_path: Path) -> None:
    """In lists, with other quantities and angles, and as words."""
    for name in ("bracket.dxf", "gusset.svg"):
        shutil.copy(EXAMPLES / name, tmp_path / name)
    parts = tmp_path / "parts.csv"
    parts.write_text("bracket.dxf;2;0\nbracket.dxf;1;90\ngusset.svg;1;free\n")
    with listening() as paths:
        outcome = leafcut.nest(
            [parts, f"{tmp_path / 'bracket.dxf'}:2"], sheet="600x400", nester="rectangles", variants=1
        )
    assert outcome.nests[0].n_placed == 6
    assert [times_opened(paths, tmp_path / name) for name in ("parts.csv", "bracket.dxf", "gusset.svg")] == [1, 1, 1]


def test_programs_and_maps_are_opened_once(tmp_path: Path) -> None:
    program, other, points = (tmp_path / name for name in ("a.nc", "b.nc", "points.csv"))
    shutil.copy(STYLES / "cambam_drill.nc", program)
    shutil.copy(STYLES / "cambam_drill.nc", other)
    points.write_text("0,0\n10,0\n10,10\n0,10\n")
    with listening() as paths:
        api.simulate(program)
        assert times_opened(paths, program) == 1
        paths.clear()
        assert api.verify_programs(program, other).same
        api.solve_file(points, iterations=1)
    assert [times_opened(paths, file) for file in (program, other, points)] == [1, 1, 1]


@pytest.mark.parametrize("work", list(WORK))
def test_a_preview_opens_its_input_once(work: str, tmp_path: Path) -> None:
    source = tmp_path / WORK[work][0].name
    shutil.copy(WORK[work][0], source)
    with listening() as paths:
        seen = look(str(source), options={"pixel_size": 0.2} if work == "picture" else {})
    assert seen.scenes and not seen.error
    assert times_opened(paths, source) == 1


def test_what_was_read_already_is_an_input(tmp_path: Path) -> None:
    """A `Source` stands for its file wherever one is taken: the file may be gone."""
    program, drawing = tmp_path / "a.nc", tmp_path / "plate_10.dxf"
    shutil.copy(STYLES / "cambam_drill.nc", program)
    shutil.copy(EXAMPLES / "plate_10.dxf", drawing)
    loaded = [Source(str(file), file.read_bytes()) for file in (program, drawing)]
    expected = api.simulate(program), leafcut.optimize(drawing, thickness=6, **LITTLE)
    program.unlink()
    drawing.unlink()
    assert api.simulate(loaded[0]).measure == expected[0].measure
    assert leafcut.optimize(loaded[1], thickness=6, **LITTLE).text == expected[1].text
    assert api.verify_programs(loaded[0], loaded[0]).same


def test_nothing_is_written_over_an_input_that_was_read_already(tmp_path: Path) -> None:
    drawing = tmp_path / "plate_10.dxf"
    shutil.copy(EXAMPLES / "plate_10.dxf", drawing)
    with pytest.raises(leafcut.LeafcutError, match="never overwritten"):
        leafcut.optimize(Source(str(drawing), drawing.read_bytes()), drawing, thickness=6)
