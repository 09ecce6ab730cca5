"""Each input file is opened once per run, and a run works on the content that it read first."""

from __future__ import annotations

import io
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.document import Drawing
from PIL import Image

import leafcut
from leafcut import api
from leafcut.cli.app import run
from leafcut.model.outcome import Outcome
from leafcut.read import Source
from leafcut.studio.jobs.preview import read_preview

EXAMPLES = Path(__file__).parents[1] / "examples"
STYLES = Path(__file__).parent / "styles"
LITTLE = {"iterations": 1, "bound": False, "threads": 1}


def picture() -> bytes:
    """Return a PNG picture of a rectangular pocket, 60 by 40 pixels."""
    pixels, file = np.full((40, 60), 255, np.uint8), io.BytesIO()
    pixels[10:30, 10:50] = 0
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


POCKET = (
    b'<svg xmlns="http://www.w3.org/2000/svg" width="30mm" height="20mm" viewBox="0 0 30 20">'
    b'<path fill="none" stroke="black" d="M5 5H25V15H5Z"/></svg>'
)
BRACKET = (EXAMPLES / "bracket.dxf").read_bytes()

#: Kind of work → file name, its content, another content, process and options.
WORK: dict[str, tuple[str, bytes, bytes, str, dict[str, Any]]] = {
    "drill": (
        "plate.dxf",
        (EXAMPLES / "plate_10.dxf").read_bytes(),
        (EXAMPLES / "plate_27.dxf").read_bytes(),
        "auto",
        {"thickness": 6, **LITTLE},
    ),
    "cut": ("part.dxf", BRACKET, (EXAMPLES / "pocket.dxf").read_bytes(), "cut", {"thickness": 6, **LITTLE}),
    "pocket": ("part.svg", POCKET, BRACKET, "pocket", {"depth": 2, "tool_diameter": 6, "strategy": "contour"}),
    "picture": (
        "part.png",
        picture(),
        BRACKET,
        "pocket",
        {"depth": 2, "tool_diameter": 6, "strategy": "contour", "pixel_size": 0.5},
    ),
    "program": (
        "part.nc",
        (STYLES / "lightburn_vector.gc").read_bytes(),
        (STYLES / "cambam_drill.nc").read_bytes(),
        "auto",
        LITTLE,
    ),
}


def _noted(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and _opened and isinstance(arguments[0], str | os.PathLike | bytes):
        _opened[-1].append(os.fsdecode(os.fspath(arguments[0])))


#: For each running `listening`, the paths of the files that Python opened since.
_opened: list[list[str]] = []
sys.addaudithook(_noted)


@contextmanager
def listening() -> Iterator[list[str]]:
    """Collect the paths of all files that Python opens."""
    _opened.append([])
    try:
        yield _opened[-1]
    finally:
        _opened.pop()


def times_opened(paths: list[str], file: Path) -> int:
    """Return the number of times that a file is among paths."""
    return sum(os.path.realpath(path) == os.path.realpath(file) for path in paths)


def written(work: str, folder: Path) -> Path:
    """Write the input of a kind of work."""
    file = folder / WORK[work][0]
    file.write_bytes(WORK[work][1])
    return file


def optimized(work: str, source: Path, **more: Any) -> Outcome:
    """Return the outcome of a kind of work."""
    *_, process, options = WORK[work]
    return leafcut.optimize(source, process=process, **options, **more)


def test_the_account_counts_what_is_opened(tmp_path: Path) -> None:
    file = tmp_path / "a"
    file.write_bytes(b"a")
    with listening() as paths:
        file.read_bytes()
        os.close(os.open(file, os.O_RDONLY))
    assert times_opened(paths, file) == 2


@pytest.mark.parametrize("work", list(WORK))
def test_an_input_is_opened_once_and_a_later_change_of_the_file_changes_nothing(work: str, tmp_path: Path) -> None:
    """Another file replaces the input at the first call of the progress callback."""
    source = written(work, tmp_path)
    with listening() as paths:
        expected = optimized(work, source)
    assert times_opened(paths, source) == 1

    def replace(*_: Any) -> None:
        if source.read_bytes() == WORK[work][1]:
            source.write_bytes(WORK[work][2])

    found = optimized(work, source, progress=replace)
    assert source.read_bytes() == WORK[work][2]
    assert found.text == expected.text


def test_each_part_of_a_nest_is_opened_once(tmp_path: Path) -> None:
    """The parts list and the command name the same drawing, with different quantities and rotations."""
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
        assert api.verify(program, other).same
        api.solve(points, iterations=1)
    assert [times_opened(paths, file) for file in (program, other, points)] == [1, 1, 1]


@pytest.mark.parametrize("work", list(WORK))
def test_a_preview_opens_its_input_once(work: str, tmp_path: Path) -> None:
    source = written(work, tmp_path)
    with listening() as paths:
        seen = read_preview(str(source), options={"pixel_size": 0.5} if work == "picture" else {})
    assert seen.scenes and not seen.error
    assert times_opened(paths, source) == 1


def test_a_source_in_memory_is_an_input(tmp_path: Path) -> None:
    """The file of a `Source` may be deleted."""
    program, drawing = tmp_path / "a.nc", tmp_path / "plate_10.dxf"
    shutil.copy(STYLES / "cambam_drill.nc", program)
    shutil.copy(EXAMPLES / "plate_10.dxf", drawing)
    loaded = [Source(str(file), file.read_bytes()) for file in (program, drawing)]
    expected = api.simulate(program), leafcut.optimize(drawing, thickness=6, **LITTLE)
    program.unlink()
    drawing.unlink()
    assert api.simulate(loaded[0]).measure == expected[0].measure
    assert leafcut.optimize(loaded[1], thickness=6, **LITTLE).text == expected[1].text
    assert api.verify(loaded[0], loaded[0]).same


def test_the_file_of_a_source_in_memory_is_never_overwritten(tmp_path: Path) -> None:
    drawing = tmp_path / "plate_10.dxf"
    shutil.copy(EXAMPLES / "plate_10.dxf", drawing)
    with pytest.raises(leafcut.LeafcutError, match="never overwritten"):
        leafcut.optimize(Source(str(drawing), drawing.read_bytes()), drawing, thickness=6)


def test_a_drawing_is_parsed_once_to_choose_the_command_and_to_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A named machine and mill ask whether the drawing is a part; a layer named for pockets, whether it has pockets."""
    document, parsed, load = ezdxf.new(units=4), list[Any](), Drawing.from_tags
    for x in (0, 50):
        corners = [(x, 0), (x + 40, 0), (x + 40, 20), (x, 20)]
        document.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": "POCKETS"})
    document.saveas(tmp_path / "pockets.dxf")
    monkeypatch.setattr(Drawing, "from_tags", lambda tags: parsed.append(tags) or load(tags))
    options = "--machine linuxcnc-mill --tool-diameter 6 --thickness 3 --time-limit 1 --no-bound --threads 1"
    run([str(tmp_path / "pockets.dxf"), *options.split()])
    assert len(parsed) == 1
