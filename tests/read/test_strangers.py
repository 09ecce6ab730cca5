"""Files that parsers from elsewhere choke on end in one line of leafcut's own, and small files ask for small work."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from leafcut.errors import LeafcutError, OptionError, ReadError
from leafcut.geometry import containment, curves
from leafcut.geometry.containment import find_outline_conflicts
from leafcut.geometry.fitting import fit_arcs
from leafcut.model.issue import Issue
from leafcut.options import PocketDrawingOptions, ReadOptions, SheetOptions
from leafcut.processes.settings import collect_settings
from leafcut.read import read_contours
from leafcut.read.csvmap import read_csv
from leafcut.read.format import Source, load_json, load_source
from leafcut.read.machine import load_machine
from leafcut.read.nest_list import read_drawings_to_nest
from leafcut.read.strip_instance import read_strip_instance
from leafcut.read.svg import read_svg_contours
from leafcut.read.wkt import read_wkt_pockets
from leafcut.read.xmlmap import read_xml

PLAIN = ReadOptions()
Write = Callable[[str, str], Path]


def one_line(problem: BaseException) -> str:
    message = str(problem)
    assert "\n" not in message
    return message


@pytest.mark.parametrize("name", ["UTF-9", "UTF-6", "zlib", "hex", "UTF-32", "euc-jp"])
def test_an_encoding_that_there_is_not_is_told_with_its_line(name: str) -> None:
    """Expat asks Python for unknown codecs; some are not text codecs, some cannot be used."""
    text = f'<?xml version="1.0" encoding="{name}"?>\n<map><city x="1" y="2"/></map>'.encode()
    for read in (read_xml, read_svg_contours):
        with pytest.raises(ReadError) as caught:
            read(Source("a.xml", text), PLAIN)
        assert one_line(caught.value).startswith("a.xml:1: ")


@pytest.mark.parametrize("text", ["a = " + "[" * 5000, "a = " + "{b=" * 5000, "a = " + "1" * 5000, "\xe9"])
def test_toml_that_is_nested_or_has_thousands_of_digits_is_an_option_error(text: str, tmp_path: Path) -> None:
    """In options and in machines alike."""
    file = tmp_path / "a.toml"
    file.write_bytes(text.encode("latin-1"))
    for read in (lambda: collect_settings({}, file), lambda: load_machine(str(file))):
        with pytest.raises(OptionError, match="not a TOML file") as caught:
            read()
        assert str(file) in one_line(caught.value)


@pytest.mark.parametrize(
    "data", ["M0 0 L10", "M0 0 h", "M0 0 A5 5 0 1", "M0 0 C1 2 3", "M0 0 Q1", "M 0 0 S", "M0 0 T", "MZ", "M0 0 L1 1 A0"]
)
def test_svg_paths_that_lack_numbers_are_left_out_and_told(data: str) -> None:
    """svgelements counts with the numbers that are not there: the other shapes of the drawing are cut all the same."""
    text = f'<svg xmlns="http://www.w3.org/2000/svg"><path id="p" d="{data}"/><line x2="9" y2="1"/></svg>'
    part = read_svg_contours(Source("a.svg", text.encode()), PLAIN)
    assert part.contours[-1].path.length == pytest.approx(math.hypot(9, 1) * 25.4 / 96)
    assert len(part.contours) == (1 if any(i.code == "L203" for i in part.issues) else 2)


def test_a_field_longer_than_the_csv_reader_takes_is_told_with_its_line(text_file: Write) -> None:
    """The reader's limit is 131,072 letters."""
    path = text_file("list.csv", "a.dxf,1\n" + '"' + "b" * 200_000 + '",1\n')
    with pytest.raises(ReadError) as caught:
        read_drawings_to_nest([str(path)])
    assert one_line(caught.value).startswith(f"{path}:2: ")
    rows = Source("map.csv", b'4,5,6,"A"\n1,2,3,"' + b"x" * 200_000 + b'"\n')
    assert len(read_csv(rows, PLAIN).holes) == 1


def test_a_byte_that_the_well_known_text_parser_cannot_say_is_told_with_its_line() -> None:
    """Its messages quote bytes, and can cut a two-byte character in half."""
    for k in range(60):
        text = ("POLYGON ((0 0, 1 0, 1 1, 0 0))\nPOLYGON ((" + "x" * k + "\xe9" * 40).encode()
        with pytest.raises(ReadError) as caught:
            read_wkt_pockets(Source("a.wkt", text), PLAIN, PocketDrawingOptions(), SheetOptions())
        assert one_line(caught.value).startswith("a.wkt:2: ")


# -- quotations ------------------------------------------------------------------------------------------------------

LONG = "Q" * 5000


@pytest.mark.parametrize("kind", [LeafcutError, OptionError])
def test_every_quotation_is_cut_at_sixty_letters(kind: type[LeafcutError]) -> None:
    """Whoever raises it: with quotes or without, with blanks in it or not."""
    for quoted in (f"'{LONG}'", LONG, f"'{'ab ' * 2000}'", f"layer {LONG} (o1 {LONG})"):
        message = str(kind(f"unknown word {quoted} in the file; leave it out"))
        assert len(message) < 250
        assert max(map(len, message.split())) <= 63
        assert "…" in message


def test_what_leafcut_says_itself_and_names_of_files_are_not_cut() -> None:
    """Only what is too long for anybody's word is."""
    own = "the tool's height isn't known before 'M6' in the machine's own program, so the parts' edges can't be checked"
    assert str(OptionError(own)) == own
    path = "/very/long/" + "folder/" * 40 + "n" * 200 + ".dxf"
    assert str(ReadError(path, "is empty", 3)) == f"{path}:3: is empty"
    assert len(ReadError(path, LONG).reason) == 60


def test_issues_are_cut_like_errors() -> None:
    """They stand in the same summary."""
    issue = Issue("L206", f"3 insertions of block '{LONG}', which is missing", f"handle {LONG}")
    assert len(str(issue)) < 250


@pytest.mark.parametrize(
    "name, text",
    [
        ("a.xml", f'<map units="{LONG}"/>'),
        ("a.xml", f"<{LONG}/>"),
        ("a.csv", f"{LONG},{LONG}\n"),
        ("a.svg", f'<svg xmlns="http://www.w3.org/2000/svg" width="{LONG}"/>'),
        ("a.svg", f'<svg xmlns="http://www.w3.org/2000/svg"><{LONG}/><path d="{LONG}"/></svg>'),
        ("a.tsp", f"NAME: {LONG}\nTYPE: {LONG}\nDIMENSION: {LONG}\n"),
        ("a.drl", f"M48\n{LONG}\n%\n{LONG}\nM30\n"),
        ("a.wkt", f"POLYGON (({LONG}"),
    ],
)
def test_no_reader_quotes_a_file_without_end(name: str, text: str, text_file: Write) -> None:
    """A message of a kilobyte is more than anybody reads."""
    from leafcut.read import read

    path = text_file(name, text)
    for reading in (read, read_contours):
        with pytest.raises(LeafcutError) as caught:
            reading(path)
        assert len(one_line(caught.value).replace(str(path), "")) < 1000


# -- work by size ----------------------------------------------------------------------------------------------------

BLOCK = "0\nBLOCK\n8\n0\n2\nB\n70\n0\n10\n0\n20\n0\n{}0\nENDBLK\n"
ARRAY = "0\nINSERT\n8\n0\n2\nB\n10\n0\n20\n0\n41\n{}\n70\n{}\n71\n{}\n44\n10\n45\n10\n"
CIRCLE = "0\nCIRCLE\n8\n0\n10\n1\n20\n1\n40\n3\n"
LINE = "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n4\n21\n0\n"


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return the list of how many points each curve that was fitted had."""
    found: list[int] = []
    fit = fit_arcs

    def counting(points: Any, tolerance: float, closed: bool = False) -> Any:
        found.append(len(points))
        return fit(points, tolerance, closed)

    monkeypatch.setattr(curves, "fit_arcs", counting)
    return found


def test_a_million_copies_asked_for_in_two_hundred_bytes_are_refused(hand_drawn: Any, counted: list[int]) -> None:
    """Each was fitted as a giant ellipse; now none is."""
    path = hand_drawn(ARRAY.format("1e9", 1000, 1000), blocks=BLOCK.format(CIRCLE))
    with pytest.raises(ReadError, match="expand to more than"):
        read_contours(path)
    assert not counted


def test_a_curve_beyond_any_machine_is_never_followed(hand_drawn: Any, counted: list[int]) -> None:
    """A circle of 3 mm, a billion times as wide: reported as out of range, however many copies there are."""
    path = hand_drawn(ARRAY.format("1e9", 50, 20) + LINE, blocks=BLOCK.format(CIRCLE))
    part = read_contours(path)
    assert len(part.contours) == 1
    assert ["1000" in i.message for i in part.issues if i.code == "L203"] == [True]
    assert not counted


def test_copies_of_a_curve_are_fitted_once_and_moved(hand_drawn: Any, counted: list[int]) -> None:
    """A circle made an ellipse by its block: 3 × 2 copies are as one drawn at each place."""
    path = hand_drawn(ARRAY.format(2, 3, 2), blocks=BLOCK.format(CIRCLE))
    part = read_contours(path)
    assert len(counted) == 1
    corners = sorted((c.path.extents[0], c.path.extents[1]) for c in part.contours)
    # Half axes 6 and 3 about (2, 1).
    expected = sorted((2 - 6 + 10 * i, 1 - 3 + 10 * j) for i in range(3) for j in range(2))
    np.testing.assert_allclose(corners, expected, atol=0.01)


def test_the_points_of_all_curves_are_within_a_budget(hand_drawn: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Many large ellipses in few lines."""
    monkeypatch.setattr("leafcut.read.format.FREE_POINTS", 1000)
    monkeypatch.setattr("leafcut.read.format.POINTS_PER_BYTE", 0)
    ellipse = "0\nELLIPSE\n8\n0\n10\n0\n20\n{}\n11\n900\n21\n0\n40\n0.5\n"
    assert read_contours(hand_drawn(ellipse.format(0).replace("900", "9"))).contours
    with pytest.raises(ReadError, match="need more than 1,000 points"):
        read_contours(hand_drawn("".join(ellipse.format(k) for k in range(5))))


def test_outlines_drawn_again_and_again_in_one_place_are_taken_once() -> None:
    """2,500 circles at the same position are 3 million pairs; none of them is compared."""
    angle = np.linspace(0.0, math.tau, 60)
    circle = shapely.polygons(np.column_stack([np.cos(angle), np.sin(angle)]))
    other = shapely.box(10, 10, 12, 12)
    met = find_outline_conflicts(np.array([circle, other, *[circle] * 400], dtype=object))
    assert {(c.first, c.kind) for c in met} == {(0, "same")}
    assert sorted(c.second for c in met) == list(range(2, 402))


def test_outlines_of_which_all_cross_each_other_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before what they have in common is worked out for each pair."""
    monkeypatch.setattr(containment, "MOST_MEETING", 100)
    squares = shapely.box(*np.array([[k, k, k + 100, k + 100] for k in range(60)], dtype=float).T)
    with pytest.raises(LeafcutError, match="thousands of outlines"):
        find_outline_conflicts(squares)


HALVES = [b"\xff\xfe", b"\\U+D800", b"\\U+DFFF"]


@pytest.mark.parametrize("half", HALVES)
def test_letters_of_a_drawing_that_no_text_can_hold_stop_no_report_and_no_answer(half: bytes, tmp_path: Path) -> None:
    """Bytes that are no UTF-8, and halves of letters: in a layer, a part's name, a text."""
    import ezdxf

    drawing = ezdxf.new("R2010", units=4)
    drawing.appids.add("LEAFCUT")
    space = drawing.modelspace()
    outline = space.add_lwpolyline([(0, 0), (60, 0), (60, 40)], close=True, dxfattribs={"layer": "CUTQQ"})
    outline.set_xdata("LEAFCUT", [(1000, "nameQQ")])
    space.add_text("textQQ", dxfattribs={"layer": "ENGRAVE"}).set_placement((5, 5))
    drawing.saveas(file := tmp_path / "a.dxf")
    file.write_bytes(file.read_bytes().replace(b"QQ", half))
    part = read_contours(file)
    words = [c.layer + c.name for c in part.contours] + [str(issue) for issue in part.issues]
    assert "�" in "".join(words)
    assert "".join(words).encode()


def test_half_a_letter_in_json_is_told_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "a.json"
    file.write_text('{"name": "\\ud83d\\ude00 \\ud800", "items": []}')
    for read in (lambda: read_strip_instance(load_source(file), 1, None, False), lambda: load_json(file)):
        with pytest.raises(ReadError, match="an unpaired surrogate") as caught:
            read()
        assert one_line(caught.value).encode()
    file.write_text('{"name": "\\ud83d\\ude00"}')
    assert load_json(file) == {"name": "😀"}
