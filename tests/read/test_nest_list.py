"""Lists of drawings to nest: quantities, rotations, folders, and lines that are refused with their number."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.errors import LeafcutError, OptionError, ReadError
from leafcut.read.nest_list import WantedDrawing, read_drawings_to_nest


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_a_list_names_drawings_beside_it_with_quantities_and_rotations(tmp_path: Path, delimiter: str) -> None:
    """The number behind the list multiplies each quantity; an absolute path stays."""
    rows = [["file", "quantity", "rotations"], ["# comment"], ["a.dxf", "3", "0 90"], [""], ["sub/b.svg"]]
    rows.append([str(tmp_path / "c.dxf"), "", "0/180"])
    file = tmp_path / "list.csv"
    file.write_text("\n".join(delimiter.join(row) for row in rows) + "\n")
    assert read_drawings_to_nest([f"{file}:2", "d.dxf:4", "e.dxf"]) == [
        WantedDrawing(str(tmp_path / "a.dxf"), 6, ("0", "90")),
        WantedDrawing(str(tmp_path / "sub" / "b.svg"), 2),
        WantedDrawing(str(tmp_path / "c.dxf"), 2, ("0", "180")),
        WantedDrawing("d.dxf", 4),
        WantedDrawing("e.dxf", 1),
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a.dxf,2\n,3\n", ":2: names no drawing; a line is: file, quantity, rotations"),
        ("a.dxf,two\n", ":1: the quantity 'two' is not a whole number"),
        ("a.dxf\n\nb.dxf,0\n", ":3: the quantity is 0; it must be 1 or more"),
        ("a.dxf,1,sideways\n", ":1: "),
        ("# nothing\n", ": names no drawing; a line is: file, quantity, rotations"),
        ("file,quantity\n", ": names no drawing"),
    ],
)
def test_a_wrong_line_is_refused_with_its_number(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "list.csv"
    file.write_text(text)
    with pytest.raises(ReadError) as refused:
        read_drawings_to_nest([str(file)])
    assert str(refused.value).startswith(f"{file}{words}")
    assert "\n" not in str(refused.value)


def test_words_without_a_drawing_or_a_quantity_are_refused() -> None:
    with pytest.raises(OptionError, match=r"no parts given; name drawings with quantities, such as bracket\.dxf:10"):
        read_drawings_to_nest([])
    with pytest.raises(OptionError, match=r"a\.dxf:0: the quantity must be 1 or more"):
        read_drawings_to_nest(["a.dxf:0"])
    with pytest.raises(LeafcutError, match=r"a\.dxf: the quantity must be 1 or more"):
        WantedDrawing("a.dxf", 0)
