"""DXF that is damaged, hostile or senseless: one clear line, or an issue, and never an endless run."""

from __future__ import annotations

import logging
import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import ReadError
from leafcut.options import ReadOptions
from leafcut.read import dxf, dxf_document, read
from leafcut.read.format import Source
from leafcut.read.recognition import BINARY_DXF

CIRCLE = "0\nCIRCLE\n8\nHOLES\n10\n{}\n20\n{}\n40\n{}\n"
BLOCK = "0\nBLOCK\n8\n0\n2\n{}\n70\n0\n10\n0\n20\n0\n{}0\nENDBLK\n"
INSERT = "0\nINSERT\n8\n0\n2\n{}\n10\n{}\n20\n0\n"


def refusal(path, options=None):
    """Return the message of a refusal; it is one line and starts with the file."""
    with pytest.raises(ReadError) as caught:
        read(path, options)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path))
    return message


def codes(part):
    return sorted(issue.code for issue in part.issues)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"not a drawing at all", "not a DXF drawing"),
        (b"AC1032\0\0\0\0\0garbage", "DWG"),
        (bytes(range(256)) * 20, "not a DXF drawing"),
        (b"0\nSECTION\n2\nENTITIES\n\xff\xfe\x00\nzz\nzz", "end of the drawing is missing"),
        (b"AutoCAD Binary DXF\r\n\x1a\x00" + bytes(range(200)), "end of the drawing is missing"),
        (b"AutoCAD Binary DXF\r\n\x1a\x00" + bytes(range(200)) + b"\0EOF\0", "damaged"),
        (b"<html><body>0 SECTION</body></html>", "not a DXF drawing"),
    ],
)
def test_what_is_no_drawing_is_refused_with_its_reason(tmp_path, data, words):
    path = tmp_path / "bad.dxf"
    path.write_bytes(data)
    assert words in refusal(path)


@pytest.mark.parametrize("fmt", ["asc", "bin"])
def test_a_drawing_cut_off_anywhere_before_its_last_entity_is_refused(draw, tmp_path, fmt):
    whole = draw(lambda d, s: [s.add_circle((i, 0), 0.25) for i in range(20)], fmt=fmt).read_bytes()
    last = whole.rfind(b"CIRCLE")
    path = tmp_path / "cut.dxf"
    for share in (0.02, 0.3, 0.5, 0.8, 0.97, 1.0):
        path.write_bytes(whole[: int(last * share)])
        assert "end of the drawing is missing" in refusal(path) or share < 0.03


def test_a_drawing_without_eof_whose_entities_are_complete_is_read_and_reported(hand_drawn):
    part = read(hand_drawn(CIRCLE.format(1, 2, 3), end="0\nENDSEC\n"))
    assert [(h.x, h.y, h.diameter) for h in part.holes] == [(1, 2, 6)]
    assert codes(part) == ["L101"]


def test_what_follows_the_end_of_a_drawing_is_reported(hand_drawn):
    path = hand_drawn(CIRCLE.format(1, 2, 3))
    whole = path.read_bytes()
    path.write_bytes(whole + b"\r\n\x1a\0\0")
    assert codes(read(path)) == []
    path.write_bytes(whole + whole)
    assert codes(read(path)) == ["L101"]


def test_a_damaged_line_is_named_by_its_number(hand_drawn):
    path = hand_drawn(CIRCLE.format(1, 2, 3) + "0\nCIRCLE\n8\nHOLES\nxx\n1\n")
    lines = path.read_text().splitlines()
    assert refusal(path).startswith(f"{path}:{lines.index('xx') + 1}: ")


@pytest.mark.parametrize("number", ["10,5", "1.2.3", "12 mm", "zz", "", "0x10"])
def test_a_coordinate_that_is_no_number_is_never_guessed(hand_drawn, number):
    assert "hand.dxf" in refusal(hand_drawn(CIRCLE.format(1, 2, 3) + CIRCLE.format(number, 2, 3)))


@pytest.mark.parametrize(
    "entity",
    [
        CIRCLE.format("nan", 0, 1),
        CIRCLE.format(0, "inf", 1),
        CIRCLE.format(0, 0, "nan"),
        CIRCLE.format(0, 0, "1e300"),
        CIRCLE.format(0, 0, 0),
        CIRCLE.format(0, 0, -2),
        CIRCLE.format("1e7", 0, 1),
        "0\nCIRCLE\n8\n0\n10\n1\n20\n1\n",
        "0\nCIRCLE\n8\n0\n40\n1\n",
        "0\nPOINT\n8\n0\n",
        "0\nINSERT\n8\n0\n2\nB\n",
        "0\nINSERT\n8\n0\n2\nB\n10\nnan\n20\n1\n",
        "0\nARC\n8\n0\n10\n1\n20\n1\n40\n1\n",
    ],
)
def test_impossible_or_missing_numbers_are_skipped_and_reported(hand_drawn, entity):
    part = read(hand_drawn(CIRCLE.format(7, 8, 1) + entity, blocks=BLOCK.format("B", CIRCLE.format(0, 0, 1))))
    assert [(h.x, h.y) for h in part.holes] == [(7, 8)]
    assert codes(part) == ["L203"]


@pytest.mark.parametrize(
    ("entities", "words"),
    [
        (
            CIRCLE.format("1e7", 0, 1),
            "no holes: 1 CIRCLE more than 1 km from the drawing origin: move",
        ),
        (CIRCLE.format("nan", 0, 1), "no holes: 1 CIRCLE with numbers out of range"),
        (CIRCLE.format(1, 2, 3) + "210\n1\n220\n0\n230\n0\n", "no holes: 1 circle not in the plane"),
        (INSERT.format("NOPE", 3), "no holes: blocks that are missing or refer to themselves"),
        ("0\nPOINT\n8\n0\n", "no holes: 1 damaged"),
        ("", "no holes: the drawing is empty"),
    ],
)
def test_a_drawing_without_any_hole_is_refused_with_the_reason(hand_drawn, entities, words):
    assert words in refusal(hand_drawn(entities))


def test_two_entities_with_one_handle_are_two_holes(hand_drawn):
    circles = "".join(CIRCLE.format(x, 0, 1).replace("8\nHOLES", "5\nA0\n8\nHOLES") for x in (1, 5))
    assert [h.x for h in read(hand_drawn(circles)).holes] == [1, 5]


def test_a_missing_block_is_reported(hand_drawn):
    part = read(hand_drawn(CIRCLE.format(7, 8, 1) + INSERT.format("NOPE", 3) * 2))
    assert codes(part) == ["L206"]
    assert "NOPE" in part.issues[0].message


def test_a_block_that_refers_to_itself_is_reported_and_not_followed(hand_drawn):
    blocks = BLOCK.format("A", CIRCLE.format(0, 0, 1) + INSERT.format("B", 5)) + BLOCK.format(
        "B", INSERT.format("A", 5)
    )
    part = read(hand_drawn(INSERT.format("A", 1), blocks=blocks))
    assert [h.x for h in part.holes] == [1]
    assert codes(part) == ["L206"]


def test_blocks_nested_deeper_than_32_are_reported(hand_drawn):
    chain = "".join(BLOCK.format(f"B{i}", INSERT.format(f"B{i + 1}", 1)) for i in range(40))
    blocks = chain + BLOCK.format("B40", CIRCLE.format(0, 0, 1))
    part = read(hand_drawn(INSERT.format("B0", 0) + INSERT.format("B10", 100), blocks=blocks))
    assert [h.x for h in part.holes] == [130]
    assert codes(part) == ["L206"]


def test_blocks_that_multiply_are_refused_or_skipped_without_being_expanded(hand_drawn):
    """Thirty levels of two: 2³⁰ circles; and the same without a circle costs nothing."""

    def laughs(inner):
        levels = "".join(
            BLOCK.format(f"{s}{i}", INSERT.format(f"A{i + 1}", 1) + INSERT.format(f"B{i + 1}", 2))
            for i in range(30)
            for s in "AB"
        )
        return levels + BLOCK.format("A30", inner) + BLOCK.format("B30", inner)

    assert "expand to more than" in refusal(hand_drawn(INSERT.format("A0", 0), blocks=laughs(CIRCLE.format(0, 0, 1))))
    line = "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n1\n21\n1\n"
    part = read(hand_drawn(INSERT.format("A0", 0) + CIRCLE.format(7, 7, 1), blocks=laughs(line)))
    assert len(part.holes) == 1


def test_an_array_of_a_billion_holes_is_refused_at_once(hand_drawn):
    array = INSERT.format("B", 0) + "70\n32000\n71\n32000\n44\n5\n45\n5\n"
    assert "expand to more than" in refusal(hand_drawn(array, blocks=BLOCK.format("B", CIRCLE.format(0, 0, 1))))


def test_a_million_holes_is_the_limit(hand_drawn, monkeypatch):
    monkeypatch.setattr(dxf, "MAX_HOLES", 50)
    array = INSERT.format("B", 0) + "70\n{}\n71\n10\n44\n5\n45\n5\n"
    blocks = BLOCK.format("B", CIRCLE.format(0, 0, 1))
    assert len(read(hand_drawn(array.format(5), blocks=blocks)).holes) == 50
    assert "holes" in refusal(hand_drawn(array.format(6), blocks=blocks))


def test_a_drawing_with_too_many_entities_is_refused_before_it_is_loaded(hand_drawn, monkeypatch):
    monkeypatch.setattr(dxf_document, "MAX_ENTITIES", 20)
    assert "entities" in refusal(hand_drawn(CIRCLE.format(1, 2, 3) * 30))


def test_no_holes_says_what_was_found_instead(hand_drawn):
    line = "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n1\n21\n1\n"
    assert refusal(hand_drawn(line * 4 + "0\nTEXT\n8\n0\n10\n0\n20\n0\n40\n1\n1\nhi\n")).endswith(
        "no holes: 4 LINE; 1 TEXT; use leafcut cut or leafcut part for contours, or leafcut pocket for pockets"
    )
    assert refusal(hand_drawn("")).endswith("no holes: the drawing is empty")


def test_the_log_of_ezdxf_stays_off_the_terminal(hand_drawn, capfd):
    logger = logging.getLogger("ezdxf")
    before = logger.level
    refusal(hand_drawn(CIRCLE.format("10,5", 2, 3)))
    assert capfd.readouterr() == ("", "")
    assert logger.level == before


def test_macintosh_line_ends_are_read(hand_drawn):
    path = hand_drawn(CIRCLE.format(1, 2, 3))
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r"))
    assert len(read(path).holes) == 1


@settings(max_examples=settings().max_examples * 5)
@given(st.data())
def test_any_damage_to_a_drawing_ends_in_a_part_or_a_read_error(data):
    """Bytes of a small valid drawing are cut out, doubled or replaced."""
    text = "0\nSECTION\n2\nENTITIES\n" + CIRCLE.format(1, 2, 3) + INSERT.format("B", 2) + "0\nENDSEC\n0\nEOF\n"
    whole = text.encode()
    begin = data.draw(st.integers(0, len(whole)))
    end = data.draw(st.integers(begin, min(len(whole), begin + 20)))
    damaged = whole[:begin] + data.draw(st.binary(max_size=20)) + whole[end:]
    try:
        part = dxf.read_dxf(Source("x.dxf", damaged), ReadOptions())
    except ReadError as problem:
        assert "\n" not in str(problem)
    else:
        assert part.holes


@settings(max_examples=settings().max_examples * 5)
@given(st.binary(max_size=200))
def test_any_bytes_after_the_mark_of_a_binary_drawing_end_in_a_read_error(tail):
    end = b"\0" + struct.pack("<B", 0) + b"EOF\0"
    with pytest.raises(ReadError):
        dxf.read_dxf(Source("x.dxf", BINARY_DXF + tail + end), ReadOptions())


def test_arcs_of_a_polyline_in_a_block_count_as_many_copies(draw, monkeypatch):
    """An insertion of a polyline with thousands of arcs is thousands of times the work of a circle."""
    monkeypatch.setattr(dxf, "FREE_HOLES", 1000)
    monkeypatch.setattr("leafcut.read.format.COPIES_PER_BYTE", 0)

    def build(document, space):
        block = document.blocks.new("RING")
        block.add_lwpolyline([(math.cos(k / 50), math.sin(k / 50), 0.005) for k in range(300)], format="xyb")
        for k in range(5):
            space.add_blockref("RING", (9 * k, 0))
        space.add_circle((0, 0), 1)

    with pytest.raises(ReadError, match=r"the blocks of this drawing.*expand to more than 1,000 elements"):
        read(draw(build))
