"""Texts on layers of marks are engraved by single strokes; where they lie is compared with ezdxf's own boxes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.enums import MTextEntityAlignment, TextEntityAlignment

from leafcut import api
from leafcut.errors import LeafcutError
from leafcut.options import ReadOptions, SheetOptions
from leafcut.processes.contours import prepare_sheet
from leafcut.read import dxf_texts, read_contours
from leafcut.read.dxf_texts import text_line_strokes


def drawn(tmp_path: Path, build: Any) -> Path:
    """Return a drawing of a plate of 100 × 60 with the additions of `build`."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (100, 0), (100, 60), (0, 60)], close=True)
    build(document, space)
    document.saveas(tmp_path / "plate.dxf")
    return tmp_path / "plate.dxf"


def strokes(file: Path) -> np.ndarray[Any, Any]:
    """Return all places of the strokes of texts, float64[n, 2]."""
    contours = read_contours(file, ReadOptions()).contours
    return np.concatenate([c.path.vertices[:, :2] for c in contours if c.kind == "text"])


@pytest.mark.parametrize(
    ("align", "low", "left"),
    [
        ("LEFT", 0.0, 0.0),
        ("CENTER", 0.0, 0.5),
        ("RIGHT", 0.0, 1.0),
        ("MIDDLE_CENTER", 0.5, 0.5),
        ("TOP_LEFT", 1.0, 0.0),
    ],
)
@pytest.mark.parametrize("angle", [0.0, 30.0])
def test_a_text_is_as_high_as_it_says_and_lies_about_its_point(
    align: str, low: float, left: float, angle: float, tmp_path: Path
) -> None:
    """HIH consists of capitals without curves: its extents along and across the base line are worked out by hand."""

    def build(_: Any, space: Any) -> None:
        text = space.add_text("HIH", height=7.0, rotation=angle, dxfattribs={"layer": "MARK"})
        text.set_placement((50, 30), align=TextEntityAlignment[align])

    along = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    places = strokes(drawn(tmp_path, build)) - (50, 30)
    x, y = places @ along, places @ (-along[1], along[0])
    width = 7.0 * text_line_strokes("HIH")[1]
    assert (y.min(), y.max()) == pytest.approx((-7.0 * low, 7.0 * (1.0 - low)))
    # An H is 22 of 21 units wide and has its stems 4 from either side.
    assert (x.min(), x.max()) == pytest.approx((-left * width + 4 / 3, (1.0 - left) * width - 4 / 3))


def test_a_text_between_two_points_fills_what_is_between_them(tmp_path: Path) -> None:
    def build(_: Any, space: Any) -> None:
        text = space.add_text("HIH", height=5.0, dxfattribs={"layer": "MARK"})
        text.set_placement((10, 10), (60, 10), align=TextEntityAlignment.FIT)

    places = strokes(drawn(tmp_path, build))
    side = 50.0 * (4 / 21) / text_line_strokes("HIH")[1]
    assert (places[:, 0].min(), places[:, 0].max()) == pytest.approx((10 + side, 60 - side))
    assert np.ptp(places[:, 1]) == pytest.approx(5.0)


def test_the_rows_of_an_mtext_are_five_thirds_of_a_capital_apart(tmp_path: Path) -> None:
    def build(_: Any, space: Any) -> None:
        text = space.add_mtext("{\\fArial|b1;H}\\PH", dxfattribs={"layer": "MARK", "char_height": 6.0})
        text.set_location((20, 40), attachment_point=MTextEntityAlignment.TOP_LEFT)

    y = strokes(drawn(tmp_path, build))[:, 1]
    assert (y.max(), y.min()) == pytest.approx((40.0, 40.0 - 6.0 - 6.0 * 5 / 3))


def test_texts_of_blocks_are_scaled_turned_and_repeated_with_them(tmp_path: Path) -> None:
    def build(document: Any, space: Any) -> None:
        document.blocks.new("tag").add_text("I", height=4.0, dxfattribs={"layer": "MARK"})
        for x in (20, 60):
            space.add_blockref("tag", (x, 20), dxfattribs={"xscale": 2, "yscale": 2, "rotation": 90})

    places = strokes(drawn(tmp_path, build))
    assert np.unique(places[:, 0].round(6)).tolist() == [12.0, 20.0, 52.0, 60.0]


def test_accents_and_signs_of_drawings_have_strokes() -> None:
    for one, plain in (("é", "e"), ("Ä", "A"), ("ñ", "n"), ("Ø", "O"), ("±", "+")):
        assert len(text_line_strokes(one)[0]) > len(text_line_strokes(plain)[0])
        assert text_line_strokes(one)[1] >= text_line_strokes(plain)[1] - 1e-9
    assert text_line_strokes("°")[0]
    assert all(text_line_strokes(chr(code))[1] > 0.0 for code in range(32, 127))


def test_texts_are_marks_on_the_layers_of_marks_and_left_out_elsewhere(tmp_path: Path) -> None:
    def build(_: Any, space: Any) -> None:
        for layer, text in (("MARK", "A1"), ("0", "title"), ("notes", "B2")):
            space.add_text(text, height=5.0, dxfattribs={"layer": layer}).set_placement((20, 20))

    part = read_contours(drawn(tmp_path, build), ReadOptions())
    sheet = prepare_sheet(part, SheetOptions())
    assert {c.layer for c in sheet.contours if c.kind == "mark"} == {"MARK"}
    assert all(c.part == 1 for c in sheet.contours)
    assert [i.message for i in sheet.issues if i.code == "L210"] == [
        "texts are engraved only on mark layers; the program leaves out 1 on layer 0, 1 on layer notes"
    ]
    named = prepare_sheet(part, SheetOptions(mark_layers=("notes",)))
    assert "notes" in {c.layer for c in named.contours if c.kind == "mark"}


def test_a_text_without_strokes_is_told_as_missing_and_refused_with_strict(tmp_path: Path) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_text("Ж", height=5.0, dxfattribs={"layer": "MARK"}).set_placement((20, 20))

    file = drawn(tmp_path, build)
    options: dict[str, Any] = {"process": "cut", "thickness": 3, "iterations": 5, "threads": 1}
    told = [i for i in api.optimize(file, **options).issues if i.code == "L216"]
    assert [(i.severity, i.place) for i in told] == [("missing", "at (20, 20)")]
    assert "no strokes for 'Ж'" in told[0].message
    with pytest.raises(LeafcutError, match="not engraved"):
        api.optimize(file, strict=True, **options)


def test_an_engraved_sheet_is_marked_before_its_part_is_cut_free_and_proved(tmp_path: Path) -> None:
    def build(_: Any, space: Any) -> None:
        space.add_text("L7", height=8.0, dxfattribs={"layer": "MARK"}).set_placement((20, 20))

    outcome = api.optimize(
        drawn(tmp_path, build), process="cut", thickness=3, machine="laser-table", iterations=5, threads=1
    )
    assert outcome.verified
    assert outcome.detail.plan is not None
    kinds = [cut.kind for cut in outcome.detail.plan.cuts]
    assert kinds.count("mark") >= 2
    assert kinds[-1] == "cut"


def test_a_long_paragraph_is_wrapped_by_looking_at_each_word_a_few_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And not at all words of its row for each of them: some kilobytes took minutes."""
    written = 0
    original = dxf_texts._text_strokes

    def counted(text: str) -> Any:
        nonlocal written
        written += len(text)
        return original(text)

    monkeypatch.setattr(dxf_texts, "_text_strokes", counted)
    text = "ab cd " * 100
    file = drawn(tmp_path, lambda _, space: space.add_mtext(text, {"char_height": 1.0, "width": 90.0}))
    assert np.ptp(strokes(file)[:, 1]) > 5.0
    assert written < 5 * len(text)
