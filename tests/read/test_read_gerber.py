"""Gerber files: copper has the area that the file draws, and anything that would be lost is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import shapely

from boards import DRILLS, archive, edge, gerber, rectangle
from leafcut.errors import ReadError
from leafcut.options import ReadOptions
from leafcut.read import Source, read_contours
from leafcut.read.gerber import read_gerber


def copper_of(text: str) -> shapely.Geometry:
    part = read_gerber(Source("board.gbr", text.encode()), ReadOptions())
    rings = [shapely.LinearRing(c.path.flattened(0.001)) for c in part.contours if c.layer == "COPPER"]
    return shapely.build_area(shapely.GeometryCollection(rings))


ROUND, BOX = "%ADD10C,0.500*%\n", "%ADD10R,0.4X0.2*%\n"
ROUNDED = "%AMRR*20,1,0.6,0,0,1,0,30*1,1,0.6,0.866025,0.5*%\n%ADD10RR*%\n"
OCTAGON = "%AMOC8*5,1,8,0,0,1.0,22.5*%\n%ADD10OC8*%\n"
PAD = "D10*\nX0Y0D03*\n"
#: Each variable doubles the work of the one before it.
DOUBLED = "".join(f"${k + 1}=${k}+${k}*" for k in range(1, 40))
CHANGED = "%LPC*%\nD10*\nX0Y0D03*\n%LPD*%\nX0Y0D03*\n" * 1100
ARC = "D10*\nX1000Y0D02*\nG75*\nG03*\nX0Y1000I-1000J0D01*\n"


def capsule(length: float, width: float) -> float:
    return length * width + math.pi * width**2 / 4.0


@pytest.mark.parametrize(
    "body, apertures, area, bounds",
    [
        (rectangle(0, 0, 2000, 1000), "", 2.0, (0, 0, 2, 1)),
        ("D10*\nX1000Y1000D03*\n", ROUND, math.pi / 16, (0.75, 0.75, 1.25, 1.25)),
        ("D10*\nX0Y0D02*\nX3000Y4000D01*\n", ROUND, capsule(5.0, 0.5), (-0.25, -0.25, 3.25, 4.25)),
        (ARC, ROUND, math.pi / 2 * 0.5 + math.pi / 16, (-0.25, -0.25, 1.25, 1.25)),
        ("D10*\nX0Y0D02*\nX1000Y0D01*\n", BOX, 1.4 * 0.2, (-0.2, -0.1, 1.2, 0.1)),
        ("D10*\nX1000Y0D03*\n", "%ADD10O,1.0X0.4*%\n", capsule(0.6, 0.4), (0.5, -0.2, 1.5, 0.2)),
        ("D10*\nX1000Y0D03*\n", "%ADD10P,1.0X4X45*%\n", 0.5, (1 - 0.35355, -0.35355, 1 + 0.35355, 0.35355)),
        ("D10*\nX1000Y0D03*\n", "%ADD10C,1.0X0.5*%\n", math.pi * 3 / 16, (0.5, -0.5, 1.5, 0.5)),
        ("D10*\nX5000Y0D03*\n", OCTAGON, 2 * math.sqrt(2) / 4, (5 - 0.46194, -0.46194, 5 + 0.46194, 0.46194)),
        ("D10*\nX0Y0D03*\n", ROUNDED, 0.6 + math.pi * 0.09 / 2, (-0.15, -0.259808, 1.166025, 0.8)),
        # A clear square leaves a frame; the dark square in it comes later.
        (rectangle(0, 0, 4000, 4000) + "%LPC*%\n" + rectangle(1000, 1000, 3000, 3000) + "%LPD*%\n"
         + rectangle(1500, 1500, 2500, 2500), "", 13.0, (0, 0, 4, 4)),
        # Two commands in one extended command.
        (rectangle(0, 0, 4000, 4000) + "%LPC*ADD11C,1*%\nD11*\nX2000Y2000D03*\n", "", 16 - math.pi / 4, (0, 0, 4, 4)),
        # A region with a cut to its opening, as KiCad fills zones.
        ("G01*\nG36*\nX0Y0D02*\nX4000Y0D01*\nX4000Y4000D01*\nX0Y4000D01*\nX0Y2000D01*\nX1000Y2000D01*\nX1000Y3000D01*\n"
         "X3000Y3000D01*\nX3000Y1000D01*\nX1000Y1000D01*\nX1000Y2000D01*\nX0Y2000D01*\nX0Y0D01*\nG37*\n", "", 12.0,
         (0, 0, 4, 4)),
    ],
)  # fmt: skip
def test_copper_has_the_area_that_the_file_draws(
    body: str, apertures: str, area: float, bounds: tuple[float, ...]
) -> None:
    copper = copper_of(gerber(body, apertures=apertures))
    assert copper.area == pytest.approx(area, abs=0.006)
    if "RR" not in apertures:
        assert copper.bounds == pytest.approx(bounds, abs=0.003)


def test_a_file_in_inches_is_read_in_mm() -> None:
    text = gerber("D10*\nX1000Y1000D03*\n", apertures="%ADD10C,0.1*%\n").replace("MOMM", "MOIN")
    assert copper_of(text).bounds == pytest.approx((24.13, 24.13, 26.67, 26.67), abs=0.003)


@pytest.mark.hazard
def test_short_words_and_text_after_the_end_mean_the_same_as_in_other_readers() -> None:
    """A quarter circle to the left stays one, and nothing is drawn after M02."""
    quarter = "%ADD10C,0.1*%\nG75*\nD10*\nX1000Y0D02*\nG03*\nX0Y1000I-1000J0D01*\nG{}*\nX1000Y0I0J-1000D01*\n"
    assert copper_of(gerber(quarter.format("2"))).area == pytest.approx(copper_of(gerber(quarter.format("02"))).area)
    pad = gerber(PAD, apertures="%ADD10C,1*%\n")
    assert copper_of(pad + "X5000Y0D03*\nM02*\n").bounds == copper_of(pad).bounds


@pytest.mark.hazard
@pytest.mark.parametrize(
    "text, words",
    [
        (gerber("%SRX2Y1I5J0*%\n" + rectangle(0, 0, 1000, 1000) + "%SR*%\n"), "repeats the board"),
        (gerber("%LR45*%\n" + rectangle(0, 0, 1000, 1000)), "Unknown statement"),
        (gerber("%LMX*%\n" + rectangle(0, 0, 1000, 1000)), "Unknown statement"),
        (gerber("%IPNEG*%\n" + rectangle(0, 0, 1000, 1000)), "image polarity"),
        (gerber("%IFsecret.gbr*%\n" + rectangle(0, 0, 1000, 1000)), "could not be read"),
        (gerber(rectangle(0, 0, 1000, 1000))[:-5], "may be truncated"),
        (gerber("D10*\nX0Y0D03*\n", apertures="%AMTT*7,0,0,1,0.8,0.1,0*%\n%ADD10TT*%\n"), "thermal macros"),
        (gerber("D10*\nX0Y0D03*\n", apertures="%AMTT*5,1,900000000,0,0,1,0*%\n%ADD10TT*%\n"), "3 to 12 corners"),
        (gerber("D11*\nX0Y0D03*\n"), "undefined aperture"),
        (gerber(PAD + "%LPD*SRX2Y1I5J0*%\n"), "repeats the board"),
        (gerber(PAD + "%\nSRX2Y1I5J0*\n%\n"), "repeats the board"),
        (gerber(PAD + "SRX2Y1I5J0*\n"), "repeats the board"),
        (gerber(PAD + "D10X5000Y5000D03*\n"), "an aperture and a position at once"),
        (gerber(PAD).replace("FSLAX", "FSLIX"), "incremental coordinates"),
        (
            gerber("D10*\nX0Y0D03*\n", apertures="%AMTT*5,1,6,2,0,0.5,90*%\n%ADD10TT*%\n"),
            "a rotated polygon beside the centre",
        ),
        (gerber(PAD) + "G04" * 400, "the last one has no end"),
        (
            gerber("D10*\nX0Y0D03*\n", apertures=f"%AMTT*{DOUBLED}1,1,$40,0,0*%\n%ADD10TT,1*%\n"),
            "too many variables",
        ),
        (gerber(CHANGED, apertures=ROUND), "changes between dark and clear"),
        (gerber(""), "no copper"),
        (gerber(rectangle(0, 0, 1000, 1000)).replace("%MOMM*%\n", ""), "unit"),
    ],
)
def test_copper_that_would_be_lost_is_refused(text: str, words: str) -> None:
    with pytest.raises(ReadError, match=words):
        copper_of(text)


FILES = {
    "gerbers/board-F_Cu.gbr": gerber(rectangle(1000, 1000, 5000, 2000)),
    "gerbers/board-B_Cu.gbr": gerber(rectangle(1000, 8000, 2000, 9000), "Copper,L2,Bot"),
    "gerbers/board-Edge_Cuts.gbr": edge(0, 0, 20000, 10000),
    "gerbers/board.drl": DRILLS,
    "gerbers/board-F_Mask.gbr": gerber(rectangle(0, 0, 9000, 9000), "Soldermask,Top"),
    "README.txt": "text",
}


def boxes(path: Path, side: str = "top") -> dict[str, list[tuple[float, ...]]]:
    part = read_contours(path, ReadOptions(side=side))
    found: dict[str, list[tuple[float, ...]]] = {}
    for contour in part.contours:
        found.setdefault(contour.layer, []).append(tuple(np.round(contour.path.extents, 3).tolist()))
    return found


@pytest.mark.parametrize("with_attributes", [True, False])
def test_an_archive_has_the_copper_of_one_side_the_outline_and_the_holes(with_attributes: bool, tmp_path: Path) -> None:
    files = FILES
    if not with_attributes:
        files = {name: text.partition("*%\n")[2] if "TF." in text else text for name, text in FILES.items()}
    (tmp_path / "board.zip").write_bytes(archive(files))
    top, bottom = boxes(tmp_path / "board.zip"), boxes(tmp_path / "board.zip", "bottom")
    assert set(top) == {"COPPER", "OUTLINE", "HOLES"}
    assert top["COPPER"] == [(1, 1, 5, 2)] and top["HOLES"] == [(2.6, 2.6, 3.4, 3.4), (15.5, 5.5, 18.5, 8.5)]
    corners = np.array(top["OUTLINE"]).reshape(-1, 2)
    assert (*corners.min(axis=0), *corners.max(axis=0)) == (0, 0, 20, 10)
    # Mirrored about X = 10, the middle of the board.
    assert bottom["COPPER"] == [(18, 8, 19, 9)] and bottom["HOLES"] == [(16.6, 2.6, 17.4, 3.4), (1.5, 5.5, 4.5, 8.5)]


@pytest.mark.hazard
def test_an_archive_that_is_hostile_or_ambiguous_is_refused(tmp_path: Path) -> None:
    def problem(data: bytes) -> str:
        with pytest.raises(ReadError) as caught:
            read_gerber(Source("board.zip", data), ReadOptions())
        return str(caught.value)

    assert "MiB unpacked" in problem(archive({"bomb.gbr": "0" * (65 * 1024 * 1024)}))
    assert "more than 500 files" in problem(archive({f"{k}.txt": "x" for k in range(501)}))
    assert "are both the top layer" in problem(archive({**FILES, "other.gbr": FILES["gerbers/board-F_Cu.gbr"]}))
    assert "no copper or outline of the top side" in problem(archive({"README.txt": "text"}))
    assert "could not be read as a ZIP archive" in problem(archive(FILES)[:-40])
    escaping = archive({"../../evil-F_Cu.gbr": FILES["gerbers/board-F_Cu.gbr"]})
    assert read_gerber(Source("board.zip", escaping), ReadOptions()).contours
    assert not [*tmp_path.parent.glob("evil*")]
