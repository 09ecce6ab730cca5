"""TSPLIB problems and tours."""

from __future__ import annotations

import math

import numpy as np
import pytest

from leafcut.errors import LeafcutError, ReadError
from leafcut.read import read
from leafcut.read.tsplib import tour_text
from shared_data import tour_nodes

HEAD = "NAME : t\nTYPE : TSP\nCOMMENT : a : b\nDIMENSION : {}\nEDGE_WEIGHT_TYPE : {}\n"
#: Distances of four nodes, by hand.
FULL = np.array([[0, 1, 2, 3], [1, 0, 4, 5], [2, 4, 0, 6], [3, 5, 6, 0]], dtype=float)


def explicit(form, numbers, more=""):
    return HEAD.format(4, "EXPLICIT") + f"EDGE_WEIGHT_FORMAT : {form}\nEDGE_WEIGHT_SECTION\n{numbers}\n{more}EOF\n"


@pytest.mark.parametrize("weight", ["EUC_2D", "CEIL_2D", "ATT", "GEO", "MAX_2D", "MAN_2D"])
def test_nodes_are_points_in_the_order_of_their_numbers_and_the_rule_of_distance_is_kept(text_file, weight):
    text = HEAD.format(3, weight) + "NODE_COORD_SECTION\n 2 3.5e1 -4\n1 0 0\n\n3\t5 6\nEOF\n"
    part = read(text_file("t.tsp", text))
    assert [(h.x, h.y, h.diameter) for h in part.holes] == [(0, 0, 0), (35, -4, 0), (5, 6, 0)]
    assert (part.name, part.edge_weight_type, part.optimum, part.matrix) == ("t", weight, None, None)


@pytest.mark.parametrize(
    "form, numbers",
    [
        ("FULL_MATRIX", "0 1 2 3 1 0 4 5 2 4 0 6 3 5 6 0"),
        ("UPPER_ROW", "1 2 3\n4 5\n6"),
        ("LOWER_ROW", "1\n2 4\n3 5 6"),
        ("UPPER_DIAG_ROW", "0 1 2 3 0 4 5 0 6 0"),
        ("LOWER_DIAG_ROW", "0 1 0 2 4 0 3 5 6 0"),
        ("UPPER_COL", "1\n2 4\n3 5 6"),
        ("LOWER_COL", "1 2 3\n4 5\n6"),
    ],
)
def test_explicit_distances_of_every_form_give_the_same_matrix(text_file, form, numbers):
    part = read(text_file("t.tsp", explicit(form, numbers)))
    assert np.array_equal(part.matrix, FULL)
    assert part.edge_weight_type == "EXPLICIT"
    assert len({(h.x, h.y) for h in part.holes}) == 4


def test_places_for_display_are_taken(text_file):
    more = "DISPLAY_DATA_TYPE : TWOD_DISPLAY\nDISPLAY_DATA_SECTION\n1 1 1\n2 2 1\n3 3 1\n4 4 1\n"
    part = read(text_file("t.tsp", explicit("UPPER_ROW", "1 2 3 4 5 6", more)))
    assert [h.x for h in part.holes] == [1, 2, 3, 4]


def coordinates(section, n=2, weight="EUC_2D"):
    return HEAD.format(n, weight) + f"NODE_COORD_SECTION\n{section}EOF\n"


@pytest.mark.parametrize(
    "text, line, words",
    [
        (coordinates("1 0 0\n", 2), 7, "DIMENSION is 2"),
        (coordinates("1 0 0\n2 0 x\n"), 8, "'x' is not a number"),
        (coordinates("1 0 0\n2 0 -1e999\n"), 8, "is not a number"),
        (coordinates("1 0 0\n1 0 5\n"), 8, "occurs twice"),
        (coordinates("", 0), 4, "DIMENSION '0'"),
        (coordinates("", -3), 4, "DIMENSION '-3'"),
        (coordinates("", 10**8), None, "more than 1,000,000"),
        (coordinates("1 0 0\n2 1 1\n", weight="EUC_3D"), 5, "EDGE_WEIGHT_TYPE 'EUC_3D'"),
        (coordinates("1 0 0\n2 1 1\n").replace("TYPE : TSP", "TYPE : ATSP"), 2, "TYPE 'ATSP'"),
        (HEAD.format(2, "EUC_2D") + "EOF\n", None, "NODE_COORD_SECTION is missing"),
        ("NAME: x\nTYPE: TSP\nEOF\n", None, "DIMENSION is missing"),
        (coordinates("1 0 0\n2 1 1\n").replace("COMMENT", "?"), 3, "neither a keyword nor a number"),
        (explicit("UPPER_ROW", "1 2 3 4 5"), 8, "needs 6 numbers"),
        (explicit("FULL_MATRIX", "0 1 2 3 9 0 4 5 2 4 0 6 3 5 6 0"), None, "not symmetric"),
        (explicit("FUNNY", "1"), 6, "'FUNNY' is unknown; choose one of FULL_MATRIX"),
        (HEAD.format(4, "EXPLICIT") + "EDGE_WEIGHT_FORMAT: UPPER_ROW\nEOF\n", None, "EDGE_WEIGHT_SECTION is missing"),
    ],
)
def test_a_wrong_problem_is_refused_with_its_line(text_file, text, line, words):
    with pytest.raises(ReadError) as caught:
        read(text_file("t.tsp", text))
    assert words in str(caught.value)
    assert caught.value.line == line
    assert "\n" not in str(caught.value)


def test_nodes_that_are_not_numbered_from_1_keep_their_order_with_an_issue(text_file):
    part = read(text_file("t.tsp", coordinates("0 5 5\n7 1 1\n")))
    assert [h.x for h in part.holes] == [5, 1]
    assert [i.code for i in part.issues] == ["L304"]


def test_the_optimum_comes_from_the_table_beside_the_file(text_file):
    path = text_file("t.tsp", coordinates("1 0 0\n2 3 4\n"))
    text_file("optima.csv", "name,n,optimal_length\nother,2,5\nt,3,7\nT,2,10\n")
    assert read(path).optimum == 10
    text_file("optima.csv", "name,n\n\0\nt,2\n")
    assert read(path).optimum is None


def test_a_tour_numbers_the_nodes_from_one(tmp_path):
    path = tmp_path / "a.tour"
    order = np.array([3, 0, 2, 1])
    path.write_text(tour_text("name", order))
    head = ["NAME : name", "TYPE : TOUR", "DIMENSION : 4", "TOUR_SECTION"]
    assert path.read_text().splitlines() == [*head, "4", "1", "3", "2", "-1", "EOF"]
    with pytest.raises(LeafcutError, match="visits every node once"):
        tour_text("name", [0, 0, 1])


def test_the_shared_problems_have_their_sizes_and_their_best_tours_their_optima(data):
    """Independent: the published tour, measured by TSPLIB's rule, has the published length."""
    for name, n in (("kroA100", 100), ("pcb442", 442)):
        part = read(data / "tsplib" / f"{name}.tsp")
        assert len(part.holes) == n
        order = tour_nodes(data / "tsplib" / f"{name}.opt.tour")
        xy = part.hole_xy[order]
        legs = np.hypot(*(xy - np.roll(xy, -1, axis=0)).T)
        assert sum(math.floor(leg + 0.5) for leg in legs) == part.optimum


def test_the_largest_problem_is_read_whole(data):
    part = read(data / "tsplib" / "pla85900.tsp")
    assert (len(part.holes), part.edge_weight_type, part.optimum) == (85900, "CEIL_2D", 142382641)
