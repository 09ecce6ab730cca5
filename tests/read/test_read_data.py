"""Real drawings: each is read as a machinist would, or refused with the reason."""

from __future__ import annotations

import pytest

from leafcut.errors import ReadError
from leafcut.read import read

#: Holes of each drawing, counted by eye and by exploding its blocks; a text is what the refusal has to name.
DRAWINGS = {
    "camotics_buildbotics_logo": 2,  # rings with one curve in each
    "camotics_lampshade_side": "21 LWPOLYLINE",
    "deepnestport_1": 1,
    "deepnestport_3": "13 ARC",
    "deepnestport_4": "300 ARC",
    "deepnestport_6": 7,
    "deepnestport_10": 3,  # in a round part
    "deepnestport_11": 1,
    "dxfjs_array-rotated": 6,
    "dxfjs_arrayed-holes": 14,
    "dxfjs_blocks1": 1,  # its second circle is squashed by its block
    "dxfjs_closedlwpolylinebug": "INSERT",
    "dxfjs_issue21": "3 LWPOLYLINE",
    "dxfjs_issue39": 2,  # four bulged circles, two with one centre, one around another 0.1 mm off
    "dxfjs_issue42": 11,
    "dxfjs_issue53": "121 SPLINE",
    "dxfjs_openscad_export": 4,  # polygons of 30 corners, two around each centre
    "dxfjs_splines": "2 SPLINE",
    "ezdxf_edgeminer_polylines": "22 ARC",
    "ezdxf_forms": 5,
}


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_real_drawing_gives_its_holes_or_the_reason_why_not(data, name):
    path = data / "dxf" / f"{name}.dxf"
    expected = DRAWINGS[name]
    if isinstance(expected, int):
        assert len(read(path).holes) == expected
    else:
        with pytest.raises(ReadError, match=expected):
            read(path)


def test_the_table_above_has_every_drawing(data):
    assert {p.stem for p in (data / "dxf").glob("*.dxf")} == set(DRAWINGS)
