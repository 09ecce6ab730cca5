"""STL: text and binary give the same triangles, and what is no mesh of a part is refused in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from leafcut.errors import ReadError
from leafcut.read.meshes import MOST_TRIANGLES, load_mesh
from meshes import binary_stl as binary
from meshes import box_triangles as box


def text(triangles: np.ndarray) -> bytes:
    facets = [
        "facet normal 0 0 0\n outer loop\n"
        + "".join(f"  vertex {x:g} {y:g} {z:g}\n" for x, y, z in triangle.tolist())
        + " endloop\nendfacet\n"
        for triangle in triangles
    ]
    return ("solid box\n" + "".join(facets) + "endsolid box\n").encode()


BOX = box(0, 0, -10, 80, 60, 0)


@pytest.mark.parametrize("written", [binary, text])
def test_text_and_binary_give_the_triangles_that_were_written(tmp_path: Path, written) -> None:
    (tmp_path / "box.stl").write_bytes(written(BOX))
    mesh = load_mesh(tmp_path / "box.stl")
    assert np.array_equal(mesh.triangles, BOX)
    assert mesh.closed
    assert (mesh.low.tolist(), mesh.high.tolist()) == ([0, 0, -10], [80, 60, 0])


def test_a_unit_is_obeyed(tmp_path: Path) -> None:
    (tmp_path / "box.stl").write_bytes(binary(box(0, 0, 0, 2, 1, 1)))
    assert load_mesh(tmp_path / "box.stl", "in").high.tolist() == [50.8, 25.4, 25.4]


def test_a_mesh_without_one_of_its_triangles_is_not_closed(tmp_path: Path) -> None:
    (tmp_path / "box.stl").write_bytes(binary(BOX[:-1]))
    assert not load_mesh(tmp_path / "box.stl").closed


def _header(count: int) -> bytes:
    return b"".ljust(80) + count.to_bytes(4, "little")


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "too short"),
        (b"G21\nG0 Z5\n", "too short"),
        (_header(2**32 - 1) + b"\0" * 500, "its header states 4,294,967,295 triangles"),
        (binary(BOX)[:-7], "is truncated"),
        (_header(0), "has no triangles"),
        (b"solid nothing\nendsolid nothing\n", "has no triangles"),
        (text(BOX)[:80], "is not a multiple of three"),
        (text(BOX).replace(b"vertex 80", b"vertex eighty", 1), "a corner has a coordinate that is not a number"),
        (binary(BOX * np.nan), "triangle 1 has a corner coordinate that is not a number"),
        (text(BOX).replace(b"vertex 80", b"vertex 1e999", 1), "a corner coordinate that is not a number"),
        (binary(BOX / 1000), "is 0.08 mm long, too long for a part; give its unit"),
        (binary(BOX * 1000), "too long for a part"),
    ],
)
def test_what_is_no_mesh_of_a_part_is_refused_in_one_line(tmp_path: Path, data: bytes, told: str) -> None:
    file = tmp_path / "bad.stl"
    file.write_bytes(data)
    with pytest.raises(ReadError) as refused:
        load_mesh(file)
    assert told in str(refused.value)
    assert str(file) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_ten_million_triangles_are_refused_before_they_are_read(tmp_path: Path) -> None:
    file = tmp_path / "large.stl"
    with file.open("wb") as out:
        out.write(_header(10_000_000))
        out.truncate(84 + 50 * 10_000_000)  # a hole in the file: no bytes are written
    with pytest.raises(ReadError, match=f"10,000,000 triangles; at most {MOST_TRIANGLES:,}"):
        load_mesh(file)


def test_a_file_that_is_not_there_and_a_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.stl", tmp_path):
        with pytest.raises(ReadError):
            load_mesh(path)
