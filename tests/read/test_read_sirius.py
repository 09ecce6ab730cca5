"""Sheets of the Sirius CAM: parts, bulges, and which entry is the sheet."""

from __future__ import annotations

import json
import math

import pytest

from leafcut.errors import ReadError
from leafcut.read import read, read_contours

SHEET = [[0, 0, 0], [0, 100, 0], [200, 100, 0], [200, 0, 0], [0, 0, 0]]
RING = [[[30, 20, 1], [10, 20, 1], [30, 20, 1]], [[25, 20, 1], [15, 20, 1], [25, 20, 1]]]


@pytest.fixture
def sheet(text_file):
    """Return a function that writes parts as (name, paths)."""

    def write(*parts):
        return text_file("a.dbs.json", json.dumps([{"partid": name, "paths": paths} for name, paths in parts]))

    return write


def test_parts_are_closed_paths_with_bulges_and_keep_their_number(sheet):
    part = read_contours(sheet(("LIST1", [SHEET]), ("A", RING), ("B", [[[50, 50, 0], [60, 50, 0], [60, 60, 0]]])))
    assert [(c.kind, c.part, c.layer, c.path.closed) for c in part.contours] == [
        ("sheet", 0, "LIST1", True),
        ("cut", 1, "A", True),
        ("cut", 1, "A", True),
        ("cut", 2, "B", False),
    ]
    assert [round(abs(c.path.area), 6) for c in part.contours[1:3]] == [
        round(100 * math.pi, 6),
        round(25 * math.pi, 6),
    ]
    assert part.issues == ()


def test_an_entry_of_another_name_is_the_sheet_when_it_lies_round_all_others(sheet):
    assert read_contours(sheet(("2X8", [SHEET]), ("A", RING))).contours[0].kind == "sheet"
    far = [[[300, 20, 1], [310, 20, 1], [300, 20, 1]]]
    assert [c.kind for c in read_contours(sheet(("X", [SHEET]), ("A", far))).contours] == ["cut", "cut"]


@pytest.mark.parametrize(
    "bad",
    [[[0, 0]], [[0, "x", 0], [1, 1, 0]], 7, [{"x": 1}, {"y": 2}], [[0, 0, 0], [1e9, 0, 0]], [[0, 0, math.nan]] * 3],
)
def test_a_path_that_is_none_is_skipped_and_reported(sheet, bad):
    part = read_contours(sheet(("LIST", [SHEET]), ("A", [*RING, bad])))
    assert len(part.contours) == 3
    assert [i.code for i in part.issues] == ["L203"]


def test_a_sheet_with_too_many_segments_is_refused_with_the_name_of_its_file(sheet, monkeypatch):
    """The outline has 4 segments and each ring 2, which make 8."""
    monkeypatch.setattr("leafcut.read.sirius.MAX_SEGMENTS", 8)
    path = sheet(("LIST1", [SHEET]), ("A", RING))
    assert len(read_contours(path).contours) == 3
    monkeypatch.setattr("leafcut.read.sirius.MAX_SEGMENTS", 7)
    with pytest.raises(ReadError, match=r"a\.dbs\.json: more than .* lines and arcs"):
        read_contours(path)


@pytest.mark.parametrize(
    "text, words",
    [
        ('[{"partid": "a", "paths": [', "not valid JSON"),
        ('[{"partid": "a"}]', "has no 'paths'"),
        ('[{"partid": "a", "paths": []}]', "no paths"),
        ('[{"partid": ' + "[" * 100_000, "not valid JSON"),
    ],
)
def test_what_is_no_sheet_is_refused_in_one_line(text_file, text, words):
    with pytest.raises(ReadError, match=words) as caught:
        read_contours(text_file("bad.dbs.json", text))
    assert "\n" not in str(caught.value)


def test_for_drilling_a_sheet_is_refused_with_its_reason(sheet):
    with pytest.raises(ReadError, match="for cutting only"):
        read(sheet(("LIST", [SHEET])))
