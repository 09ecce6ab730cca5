"""Read symmetric ``.tsp`` problems of TSPLIB, and write ``.tour`` files.

Numbers are interpreted as mm.

Source: G. Reinelt, TSPLIB 95 (Heidelberg 1995), sections 1.1 and 1.2.
"""

from __future__ import annotations

import contextlib
import csv
import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import LeafcutError, ReadError, name_suggestion, printable
from leafcut.message import Message
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read.format import MAX_HOLES, Source, load_source, too_many_holes_error

WEIGHT_TYPES = ("EUC_2D", "CEIL_2D", "ATT", "GEO", "MAX_2D", "MAN_2D", "EXPLICIT")
#: Maps each matrix format to the number of entries for n nodes.
MATRIX_FORMATS: dict[str, Callable[[int], int]] = {
    "FULL_MATRIX": lambda n: n * n,
    "UPPER_ROW": lambda n: n * (n - 1) // 2,
    "LOWER_ROW": lambda n: n * (n - 1) // 2,
    "UPPER_DIAG_ROW": lambda n: n * (n + 1) // 2,
    "LOWER_DIAG_ROW": lambda n: n * (n + 1) // 2,
}
#: Equivalent formats. The matrix is symmetric, so the columns of one triangle are the rows of the other triangle.
SAME_FORMAT = {
    "UPPER_COL": "LOWER_ROW",
    "LOWER_COL": "UPPER_ROW",
    "UPPER_DIAG_COL": "LOWER_DIAG_ROW",
    "LOWER_DIAG_COL": "UPPER_DIAG_ROW",
}
#: File with the best known lengths, in the same folder as the instance. Its columns are name, n, and optimal_length.
OPTIMA_FILE = "optima.csv"

_KEY = re.compile(r"\s*([A-Za-z][A-Za-z_0-9]*)\s*(?::\s*(.*))?\Z")


def read_tsplib(source: Source, options: ReadOptions) -> Part:
    """Read the nodes of a TSPLIB problem as holes of diameter 0, with the distance function of the problem.

    If the file only gives distances (EXPLICIT), the nodes are placed on a circle for display.

    Raises
    ------
    ReadError
        A key, section or number is missing, wrong, or of an unsupported kind.
    """
    keys, sections = split_keys_and_sections(source)
    weight = keys.get("EDGE_WEIGHT_TYPE", ("EUC_2D", 0))[0].upper()
    check_problem_kind(source.path, keys, weight, ("TSP",))
    n = node_count(source.path, keys)
    issues: list[Issue] = []
    costs = distance_matrix(source.path, keys, sections, n) if weight == "EXPLICIT" else None
    points = node_positions(source.path, sections, n, costs is not None, issues)
    name = printable(keys.get("NAME", ("", 0))[0]) or source.name
    return Part(
        name=name,
        holes=tuple([Hole(x, y, 0.0) for x, y in points.tolist()]),
        issues=tuple(issues),
        source=source.file_name,
        format="tsplib",
        edge_weight_type=weight,
        matrix=costs,
        optimum=_listed_optimum(source, name, n),
    )


#: The first line number and the lines of a section; sections by name; keys with their values and line numbers.
DataSection = tuple[int, list[str]]
Sections = dict[str, DataSection]
SpecificationKeys = dict[str, tuple[str, int]]


def split_keys_and_sections(source: Source) -> tuple[SpecificationKeys, Sections]:
    """Split a file into keys and sections."""
    keys: SpecificationKeys = {}
    sections: Sections = {}
    current: list[str] | None = None
    for number, line in enumerate(source.text().splitlines(), 1):
        if current is not None and not line.lstrip()[:1].isalpha():
            current.append(line)
            continue
        if not line.strip():
            continue
        match = _KEY.match(line.rstrip())
        if match is None:
            raise ReadError(source.path, Message("'{}' is neither a keyword nor a number", printable(line)), number)
        key = match.group(1).upper()
        if key == "EOF":
            break
        if key.endswith("_SECTION") or key == "GTSP_SET_ORDERING":
            current = []
            sections[key] = (number + 1, current)
        else:
            current = None
            keys[key] = (match.group(2) or "", number)
    return keys, sections


def check_problem_kind(path: str, keys: SpecificationKeys, weight: str, kinds: Sequence[str]) -> None:
    """Raise an error if the kind of problem or the distance function is not supported."""
    kind, line = keys.get("TYPE", (kinds[0], 0))
    if (kind.upper().split() or [""])[0] not in kinds:
        expected = Message("TSP (symmetric)") if kinds == ("TSP",) else ", ".join(kinds)
        raise ReadError(path, Message("TYPE '{}' is not supported; expected {}", printable(kind), expected), line)
    if weight not in WEIGHT_TYPES:
        line = keys["EDGE_WEIGHT_TYPE"][1]
        raise ReadError(
            path,
            Message("EDGE_WEIGHT_TYPE '{}' is unknown{}", printable(weight), name_suggestion(weight, WEIGHT_TYPES)),
            line,
        )


def node_count(path: str, keys: SpecificationKeys) -> int:
    """Return the number of nodes in the problem."""
    if "DIMENSION" not in keys:
        raise ReadError(path, "DIMENSION is missing")
    text, line = keys["DIMENSION"]
    if not text.isdecimal() or not 0 < len(text) < 10 or int(text) < 1:
        raise ReadError(path, Message("DIMENSION '{}' is not a number of nodes", printable(text)), line)
    if int(text) > MAX_HOLES:
        raise too_many_holes_error(path)
    return int(text)


def parse_section_numbers(path: str, section: DataSection) -> NDArray[np.float64]:
    """Parse all numbers of a section, float64. Raise an error for the first line that contains other text."""
    first, lines = section
    try:
        values = np.array(list(map(float, " ".join(lines).split())), dtype=np.float64)
    except ValueError:
        values = np.array([math.nan])
    if np.isfinite(values).all():
        return values
    for offset, line in enumerate(lines):
        for word in line.split():
            try:
                valid = math.isfinite(float(word))
            except ValueError:
                valid = False
            if not valid:
                raise ReadError(path, Message("'{}' is not a number", printable(word, 30)), first + offset)
    return values


def node_positions(path: str, sections: Sections, n: int, explicit: bool, issues: list[Issue]) -> NDArray[np.float64]:
    """Return the positions of the nodes, float64[n, 2].

    If the distances are `explicit` and the file contains no positions, place the nodes on a circle.
    """
    if "NODE_COORD_SECTION" in sections:
        return _sorted_coordinates(path, sections["NODE_COORD_SECTION"], n, issues)
    if not explicit:
        raise ReadError(path, "NODE_COORD_SECTION is missing")
    if "DISPLAY_DATA_SECTION" in sections:
        return _sorted_coordinates(path, sections["DISPLAY_DATA_SECTION"], n, issues)
    angle = np.arange(n) * (math.tau / n)
    return np.column_stack([np.cos(angle), np.sin(angle)]) * (10.0 * n / math.tau)


def _sorted_coordinates(path: str, section: DataSection, n: int, issues: list[Issue]) -> NDArray[np.float64]:
    """Return the coordinates of the nodes, float64[n, 2], sorted by node number."""
    values = parse_section_numbers(path, section)
    last = section[0] + len(section[1]) - 1
    if len(values) != 3 * n:
        raise ReadError(
            path, Message("DIMENSION is {}, but the section has {:g} nodes (number, x, y)", n, len(values) / 3), last
        )
    table = values.reshape(n, 3)
    ids = table[:, 0]
    order = np.argsort(ids, kind="stable")
    if np.array_equal(ids[order], np.arange(1, n + 1)):
        return np.ascontiguousarray(table[order, 1:])
    if len(np.unique(ids)) < n:
        raise ReadError(path, "a node number occurs twice", last)
    issues.append(
        Issue(
            "L304",
            Message("nodes are not numbered from 1; they are used in the order of the file"),
            severity=Severity.NOTE,
        )
    )
    return np.ascontiguousarray(table[:, 1:])


def distance_matrix(
    path: str, keys: SpecificationKeys, sections: Sections, n: int, symmetric: bool = True
) -> NDArray[np.float64]:
    """Return the distances of an EXPLICIT problem, float64[n, n]. Only a full matrix may be asymmetric."""
    form, line = keys.get("EDGE_WEIGHT_FORMAT", ("", 0))
    form = SAME_FORMAT.get(form.upper(), form.upper())
    if form not in MATRIX_FORMATS:
        known = name_suggestion(form, MATRIX_FORMATS)
        raise ReadError(path, Message("EDGE_WEIGHT_FORMAT '{}' is unknown{}", printable(form), known), line or None)
    if "EDGE_WEIGHT_SECTION" not in sections:
        raise ReadError(path, "EDGE_WEIGHT_SECTION is missing")
    section = sections["EDGE_WEIGHT_SECTION"]
    values = parse_section_numbers(path, section)
    if len(values) != MATRIX_FORMATS[form](n):
        last = section[0] + len(section[1]) - 1
        needed = MATRIX_FORMATS[form](n)
        raise ReadError(
            path, Message("{} of {} nodes needs {} numbers, but the section has {}", form, n, needed, len(values)), last
        )
    if form == "FULL_MATRIX":
        full = values.reshape(n, n)
        if symmetric and not np.array_equal(full, full.T):
            raise ReadError(path, "the matrix is not symmetric; leafcut solves symmetric problems")
        return full
    triangle = np.zeros((n, n))
    offset = 0 if "DIAG" in form else 1
    # Both functions list the triangle row by row, like the file.
    indices = np.triu_indices(n, offset) if form.startswith("UPPER") else np.tril_indices(n, -offset)
    triangle[indices] = values
    symmetric_matrix: NDArray[np.float64] = triangle + triangle.T - np.diag(np.diag(triangle))
    return symmetric_matrix


def _listed_optimum(source: Source, name: str, n: int) -> float | None:
    """Look up the length of the optimal tour in the `OPTIMA_FILE` next to the instance.

    Return None if it is not listed.
    """
    names = {name.casefold().removesuffix(".tsp"), source.name.casefold()}
    with contextlib.suppress(LeafcutError, csv.Error, ValueError, TypeError):
        text = load_source(Path(source.path).with_name(OPTIMA_FILE)).text()
        for row in csv.DictReader(text.splitlines()):
            if (row.get("name") or "").casefold() in names and int(row.get("n") or n) == n:
                length = float(row["optimal_length"])
                return length if math.isfinite(length) and length > 0 else None
    return None


def tour_text(name: str, order: Sequence[int] | NDArray[np.integer], every: bool = True) -> str:
    """Write a tour as the text of a TSPLIB ``.tour`` file. `order` contains the node numbers from 0, in visiting order.

    `every` states whether the tour must visit all nodes. A tour through sets of nodes visits only some of them.

    Raises
    ------
    LeafcutError
        The order is not a permutation, or contains a node twice.
    """
    nodes = [int(i) for i in order]
    if sorted(nodes) != list(range(len(nodes))) if every else len(set(nodes)) < len(nodes):
        raise LeafcutError("{}: a tour visits every node once; this order does not", name)
    lines = [f"NAME : {printable(name)}", "TYPE : TOUR", f"DIMENSION : {len(nodes)}", "TOUR_SECTION"]
    return "\n".join([*lines, *(str(i + 1) for i in nodes), "-1", "EOF", ""])
