"""All that a drawing shows is read for a look, whatever of it is worked."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import ezdxf
import pytest

from leafcut.errors import ReadError
from leafcut.options import ReadOptions
from leafcut.read import read, read_whole
from leafcut.read.format import Source


def drawing(draw: Callable[[Any, Any], None]) -> Source:
    document = ezdxf.new("R2010", setup=True)
    document.header["$INSUNITS"] = 4
    draw(document, document.modelspace())
    text = io.StringIO()
    document.write(text)
    return Source("part.dxf", text.getvalue().encode())


def kinds_of(source: Source, layer: str, **options: Any) -> list[str]:
    """Return the contents of a layer: the kinds of its contours, and its holes."""
    whole = read_whole(source, ReadOptions(**options))
    kinds = [c.kind for c in whole.contours if c.layer == layer]
    return kinds + ["hole" for h in whole.holes if h.layer == layer]


def test_layers_that_are_not_chosen_are_read_too() -> None:
    def draw(_: Any, space: Any) -> None:
        space.add_circle((0, 0), 3, dxfattribs={"layer": "HOLES"})
        space.add_lwpolyline([(0, 0), (9, 0), (9, 9)], close=True, dxfattribs={"layer": "EDGE"})

    source = drawing(draw)
    assert kinds_of(source, "EDGE", layers=("HOLES",)) == ["cut"] and kinds_of(source, "HOLES", max_diameter=1.0)
    assert len(read(source, ReadOptions(layers=("HOLES",))).holes) == 1


def test_what_only_explains_is_lines_of_its_layer() -> None:
    """A dimension has two extension lines and one between; a hatch and a solid have their edge, a text strokes."""

    def draw(_: Any, space: Any) -> None:
        space.add_circle((0, 0), 3)
        dimension = space.add_linear_dim(base=(0, 20), p1=(0, 0), p2=(50, 0), dxfattribs={"layer": "DIM"})
        dimension.render()
        hatch = space.add_hatch(dxfattribs={"layer": "HATCH"})
        hatch.paths.add_polyline_path([(60, 0), (80, 0), (80, 20)], is_closed=True)
        space.add_solid([(100, 0), (110, 0), (100, 10), (110, 10)], dxfattribs={"layer": "SOLID"})
        space.add_text("L", height=5, dxfattribs={"layer": "TEXT", "insert": (0, 40)})

    source = drawing(draw)
    assert set(kinds_of(source, "DIM")) == {"text"} and len(kinds_of(source, "DIM")) > 3
    for layer in ("HATCH", "SOLID", "TEXT"):
        assert set(kinds_of(source, layer)) == {"text"}
    edge = next(c for c in read_whole(source).contours if c.layer == "HATCH")
    assert edge.path.extents == pytest.approx((60, 0, 80, 20))


def test_points_and_circles_are_holes_and_what_a_block_squashes_is_none() -> None:
    def draw(document: Any, space: Any) -> None:
        block = document.blocks.new("B")
        block.add_point((1, 2))
        block.add_circle((1, 2), 0.5)
        space.add_blockref("B", (10, 0))
        space.add_blockref("B", (20, 0), dxfattribs={"rotation": 90})
        space.add_blockref("B", (30, 0), dxfattribs={"xscale": 2})

    whole = read_whole(drawing(draw))
    found = [(round(h.x, 6), round(h.y, 6), h.diameter) for h in whole.holes]
    assert found == [(11, 2, 0), (11, 2, 1), (18, 1, 0), (18, 1, 1), (32, 2, 0)]
    assert [c.path.closed for c in whole.contours] == [True]


def test_layers_that_are_off_stay_out() -> None:
    def draw(document: Any, space: Any) -> None:
        document.layers.add("OFF").off()
        space.add_circle((0, 0), 3)
        space.add_circle((0, 0), 5, dxfattribs={"layer": "OFF"})

    assert kinds_of(drawing(draw), "OFF") == []


def test_what_shows_nothing_is_refused() -> None:
    with pytest.raises(ReadError, match="shows nothing"):
        read_whole(drawing(lambda *_: None))


def test_a_drawing_that_is_kept_is_parsed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every reading reports its issues."""
    from leafcut.read import dxf_document

    parsed: list[str] = []
    parse = dxf_document._load_document
    monkeypatch.setattr(dxf_document, "_load_document", lambda *all_of: parsed.append("") or parse(*all_of))
    plain = drawing(lambda _, space: space.add_circle((0, 0), 3))
    source = replace(plain, data=plain.data + b"late\n", cache={})
    issues = [read(source).issues, read(source).issues]
    read_whole(source)
    assert len(parsed) == 1
    assert issues[0] == issues[1] and "L101" in {issue.code for issue in issues[0]}
