"""Read generalised travelling salesman problems: ``.gtsp`` files of GTSPLIB, and ``.pcglns`` files with precedence.

These formats extend TSPLIB:

* ``GTSP_SETS``: number of sets; ``GTSP_SET_SECTION``: lines of set, nodes, -1. A tour visits one node of each set.
* ``GTSP_SET_ORDERING``: lines ``a b c -1``: set a is visited before sets b and c.
* ``START_GROUP_SECTION``: the first set of the closed tour.
* In a full matrix, -1 marks a forbidden edge; the matrix need not be symmetric.

Source: the instances of S. L. Smith and F. Imeson (GLNS, 2017) and of R. Salman, F. Ekstedt and P. Damaschke (2020).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import ReadError, printable
from leafcut.geometry.arrays import Ints
from leafcut.message import Message
from leafcut.model.issue import Issue
from leafcut.model.part import Grouping, Hole, Part
from leafcut.options import ReadOptions
from leafcut.read import tsplib
from leafcut.read.format import Source
from leafcut.read.tsplib import DataSection, Sections

KINDS = ("GTSP", "AGTSP", "PCGTSP", "PCGLNS")


def read_gtsp(source: Source, options: ReadOptions) -> Part:
    """Read the nodes as holes of diameter 0, with the distance function and the `Grouping` of the nodes.

    If the file only gives distances, the nodes are placed on a circle for display.

    Raises
    ------
    ReadError
        A key, section or number is missing, wrong, or of an unsupported kind.
    """
    path = source.path
    keys, sections = tsplib.split_keys_and_sections(source)
    weight = keys.get("EDGE_WEIGHT_TYPE", ("EUC_2D", 0))[0].upper()
    tsplib.check_problem_kind(path, keys, weight, KINDS)
    n = tsplib.node_count(path, keys)
    issues: list[Issue] = []
    matrix = tsplib.distance_matrix(path, keys, sections, n, symmetric=False) if weight == "EXPLICIT" else None
    if matrix is not None:
        _refuse_negative_costs(path, sections["EDGE_WEIGHT_SECTION"], matrix)
    points = tsplib.node_positions(path, sections, n, matrix is not None, issues)
    grouping = _parse_clusters(path, keys, sections, n)
    return Part(
        name=printable(keys.get("NAME", ("", 0))[0]).removesuffix(".pcglns") or source.name,
        holes=tuple([Hole(x, y, 0.0) for x, y in points.tolist()]),
        issues=tuple(issues),
        source=source.file_name,
        format="gtsp",
        edge_weight_type=weight,
        matrix=matrix,
        grouping=grouping,
    )


def _refuse_negative_costs(path: str, section: DataSection, matrix: NDArray[np.float64]) -> None:
    """Raise an error for negative costs. The value -1 is allowed, because it marks a forbidden edge."""
    wrong = np.argwhere((matrix < 0) & (matrix != -1))
    if len(wrong):
        i, j = wrong[0].tolist()
        raise ReadError(
            path,
            Message(
                "the edge from {} to {} costs {:g}; only -1 (not allowed) may be negative", i + 1, j + 1, matrix[i, j]
            ),
            section[0],
        )


def _parse_clusters(path: str, keys: tsplib.SpecificationKeys, sections: Sections, n: int) -> Grouping:
    if "GTSP_SET_SECTION" not in sections:
        raise ReadError(path, "GTSP_SET_SECTION is missing")
    number: dict[int, int] = {}
    cluster = np.full(n, -1, dtype=np.int32)
    for line, (name, *nodes) in _split_number_lists(path, sections["GTSP_SET_SECTION"]):
        if name in number:
            raise ReadError(path, Message("set {} occurs twice", name), line)
        if not nodes:
            raise ReadError(path, Message("set {} has no nodes", name), line)
        number[name] = len(number)
        for node in nodes:
            if not 1 <= node <= n:
                raise ReadError(path, Message("set {} has node {}; nodes are numbered 1 to {}", name, node, n), line)
            if cluster[node - 1] >= 0:
                raise ReadError(
                    path, Message("node {} occurs twice in the sets; a node belongs to a single set", node), line
                )
            cluster[node - 1] = number[name]
    alone = np.flatnonzero(cluster < 0)
    if len(alone):
        raise ReadError(path, Message("node {} is in no set", alone[0] + 1), sections["GTSP_SET_SECTION"][0])
    text, line = keys.get("GTSP_SETS", ("", 0))
    if text and text != str(len(number)):
        raise ReadError(
            path, Message("GTSP_SETS is {}, but the section has {} sets", printable(text), len(number)), line
        )
    first = _parse_start_cluster(path, sections, number)
    return Grouping(cluster, _parse_precedence(path, sections, number), first)


def _parse_precedence(path: str, sections: Sections, number: dict[int, int]) -> Ints:
    """Return the precedence of the clusters as pairs (before, after), int32[k, 2]."""
    pairs = [
        (_cluster_number(path, line, number, before), _cluster_number(path, line, number, after))
        for line, (before, *successors) in _split_number_lists(path, sections.get("GTSP_SET_ORDERING", (0, [])))
        for after in successors
    ]
    return np.array(pairs, dtype=np.int32).reshape(-1, 2)


def _parse_start_cluster(path: str, sections: Sections, number: dict[int, int]) -> int:
    if "START_GROUP_SECTION" not in sections:
        return -1
    section = sections["START_GROUP_SECTION"]
    names = tsplib.parse_section_numbers(path, section)
    if not len(names) or (names[0] != int(names[0])):
        raise ReadError(path, "START_GROUP_SECTION names no set", section[0])
    return _cluster_number(path, section[0], number, int(names[0]))


def _cluster_number(path: str, line: int, number: dict[int, int], name: int) -> int:
    if name not in number:
        raise ReadError(path, Message("unknown set {}", name), line)
    return number[name]


def _split_number_lists(path: str, section: DataSection) -> list[tuple[int, list[int]]]:
    """Split a section into lists of numbers, each with its line number. In the file, each list ends with -1."""
    values = tsplib.parse_section_numbers(path, section)
    if not len(values):
        return []
    lines = np.repeat(np.arange(section[0], section[0] + len(section[1])), [len(line.split()) for line in section[1]])
    wrong = np.flatnonzero((values != np.floor(values)) | (np.abs(values) > 2**31))
    if len(wrong):
        raise ReadError(
            path, Message("{:g} is not the number of a node or a set", values[wrong[0]]), int(lines[wrong[0]])
        )
    ends = [-1, *np.flatnonzero(values == -1).tolist()]
    if ends[-1] != len(values) - 1:
        raise ReadError(path, "the last set does not end with -1", int(lines[-1]))
    integers = values.astype(np.int64)
    runs = [(int(lines[a + 1]), integers[a + 1 : b].tolist()) for a, b in pairwise(ends)]
    empty = next((line for line, run in runs if not run), None)
    if empty is not None:
        raise ReadError(path, "a set has no nodes before its terminating -1", empty)
    return runs
