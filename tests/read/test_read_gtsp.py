"""Sets of nodes: files of GTSPLIB, and files with precedence."""

from __future__ import annotations

import numpy as np
import pytest

from leafcut.errors import ReadError
from leafcut.read import read

GTSP = """NAME : five
TYPE : GTSP
DIMENSION : 5
GTSP_SETS : 2
EDGE_WEIGHT_TYPE : EUC_2D
NODE_COORD_SECTION
1 0 0
2 0 3
3 4 0
4 4 3
5 9 9
GTSP_SET_SECTION
1 5 1 -1
2 2 4 3 -1
EOF
"""

PCGLNS = """NAME : four.pcglns
TYPE : PCGLNS
DIMENSION : 4
GTSP_SETS : 3
EDGE_WEIGHT_TYPE : EXPLICIT
EDGE_WEIGHT_FORMAT : FULL_MATRIX
EDGE_WEIGHT_SECTION
0 1 2 3
-1 0 5 6
7 8 0 9
-1 4 3 0
GTSP_SET_SECTION:
1 1 -1
2 2 -1
3 3 4 -1
GTSP_SET_ORDERING
3 2 -1
START_GROUP_SECTION
1
EOF
"""


def test_sets_are_clusters_in_the_order_of_the_file(text_file):
    part = read(text_file("five.gtsp", GTSP))
    assert part.grouping.cluster.tolist() == [0, 1, 1, 1, 0]
    assert (part.format, part.edge_weight_type, part.name) == ("gtsp", "EUC_2D", "five")
    assert (part.grouping.first, len(part.grouping.precedence), part.matrix) == (-1, 0, None)
    assert [(h.x, h.y) for h in part.holes] == [(0, 0), (0, 3), (4, 0), (4, 3), (9, 9)]


def test_the_content_tells_sets_from_a_plain_problem_whatever_the_extension(text_file):
    assert read(text_file("five.tsp", GTSP)).format == "gtsp"


def test_precedence_start_and_ways_that_are_not_allowed_are_kept(text_file):
    part = read(text_file("four.pcglns", PCGLNS.replace("SECTION:", "SECTION")))
    assert part.matrix.tolist() == [[0, 1, 2, 3], [-1, 0, 5, 6], [7, 8, 0, 9], [-1, 4, 3, 0]]
    assert part.grouping.precedence.tolist() == [[2, 1]]
    assert (part.grouping.first, part.name) == (0, "four")


def test_a_colon_behind_the_name_of_a_section_is_no_matter(text_file):
    assert read(text_file("four.pcglns", PCGLNS)).grouping.cluster.tolist() == [0, 1, 2, 2]


@pytest.mark.parametrize(
    "right, wrong, words",
    [
        ("1 5 1 -1", "1 5 1 2 -1", "five.gtsp:14: node 2 occurs twice"),
        ("1 5 1 -1", "1 5 -1", "node 1 is in no set"),
        ("1 5 1 -1", "1 5 7 -1", "five.gtsp:13: set 1 has node 7; nodes are numbered 1 to 5"),
        ("1 5 1 -1", "2 5 1 -1", "five.gtsp:14: set 2 occurs twice"),
        ("1 5 1 -1", "1 -1", "set 1 has no nodes"),
        ("1 5 1 -1", "-1", "no nodes before its terminating -1"),
        ("1 5 1 -1", "1 5 1.5 -1", "1.5 is not the number of a node"),
        ("1 5 1 -1", "1 5 x -1", "five.gtsp:13: 'x' is not a number"),
        ("4 3 -1", "4 3", "does not end with -1"),
        ("GTSP_SETS : 2", "GTSP_SETS : 3", "five.gtsp:4: GTSP_SETS is 3, but the section has 2 sets"),
        ("TYPE : GTSP", "TYPE : CVRP", "TYPE 'CVRP' is not supported; expected GTSP"),
        ("GTSP_SET_SECTION", "EXTRA_SECTION", "GTSP_SET_SECTION is missing"),
        ("EOF", "GTSP_SET_ORDERING\n1 9 -1\nEOF", "five.gtsp:16: unknown set 9"),
        ("EOF", "START_GROUP_SECTION\n0\nEOF", "five.gtsp:16: unknown set 0"),
    ],
)
def test_what_cannot_be_is_refused_with_its_line(text_file, right, wrong, words):
    with pytest.raises(ReadError) as caught:
        read(text_file("five.gtsp", GTSP.replace(right, wrong)))
    assert words in str(caught.value)


def test_costs_below_zero_are_refused(text_file):
    with pytest.raises(ReadError, match="from 2 to 1 costs -2"):
        read(text_file("four.pcglns", PCGLNS.replace("-1 0 5 6", "-2 0 5 6")))


def test_instances_at_hand_are_read_as_their_list_says(data):
    """Nodes, sets and pairs of a few instances, as their list of best known lengths has them."""
    for name, nodes, sets, pairs in (("e5x_1", 315, 23, 27), ("ESC47", 244, 48, 32), ("p43.4", 204, 43, 496)):
        part = read(data / "gtsp" / "pcgtsp" / f"{name}.pcglns")
        assert len(part.holes) == nodes
        assert len(np.unique(part.grouping.cluster)) == sets
        assert len(part.grouping.precedence) == pairs
