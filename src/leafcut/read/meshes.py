"""Load the meshes of solids from STL (text or binary) and STEP files.

leafcut does not use trimesh or numpy-stl. Untrusted files would need the same checks, and importing these packages
takes a second.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from leafcut.errors import OptionError, ReadError, parser_errors
from leafcut.message import Message
from leafcut.model.mesh import Mesh
from leafcut.read.format import Match
from leafcut.read.recognition import sniff_step
from leafcut.read.step import AS_DRAWN, Pose, WhichSolid, read_step_mesh
from leafcut.read.step import LARGEST as LARGEST_STEP

#: Maximum number of triangles. A triangle needs 72 bytes, and more memory while it is read.
MOST_TRIANGLES = 2_000_000
#: A binary STL has a header of 80 bytes, the number of triangles, and 50 bytes per triangle.
_HEADER, _TRIANGLE = 84, 50
#: Text needs about 250 bytes per triangle.
_MAX_TEXT = 300 * MOST_TRIANGLES
#: Minimum and maximum size of a part, mm. A size outside this range means that the unit is wrong.
SMALLEST, LARGEST = 0.5, 20_000.0

_VERTEX = re.compile(rb"vertex\s+(\S{1,40})\s+(\S{1,40})\s+(\S{1,40})", re.IGNORECASE)

#: mm per unit.
UNITS = {"mm": 1.0, "in": 25.4, "cm": 10.0, "m": 1000.0}


def load_mesh(
    path: str | Path, unit: str = "mm", mend: str = "", which: WhichSolid = None, pose: Pose = AS_DRAWN
) -> Mesh:
    """Load the mesh of a file.

    Parameters
    ----------
    unit
        Unit of an STL file, one of `UNITS`.
    which
        Solid to load from a STEP file: its number, or all solids.

    Raises
    ------
    ReadError
        The file cannot be read, is not a mesh, is empty, is too large, or has an implausible size.
    """
    file = Path(path)
    try:
        with file.open("rb") as opened:
            head = opened.read(_HEADER)
        size = file.stat().st_size
    except OSError as problem:
        raise ReadError(file, Message("cannot be read ({})", problem.strerror)) from None
    if sniff_step(head) == Match.YES:
        if unit != "mm":
            raise OptionError("--surface-unit: a STEP file defines its own unit; leave this option out")
        triangles = read_step_mesh(str(file), _read_step_bytes(file, size), which, pose)
    else:
        if which not in (None, "all"):
            raise OptionError("--solid: only STEP files have solids; leave it out")
        if pose != AS_DRAWN:
            raise OptionError(
                "--up, --z-zero: these options turn and shift only STEP files; an STL file keeps its axes and Z0; "
                "leave them out"
            )
        triangles = _read_stl(file, head, size) * UNITS[unit]
    return _checked_mesh(triangles, file, mend or Message("give its unit (--surface-unit {})", ", ".join(UNITS)))


def _read_step_bytes(file: Path, size: int) -> bytes:
    if size > LARGEST_STEP:
        raise ReadError(file, Message("has {} MiB; STEP files up to {} MiB are read", size >> 20, LARGEST_STEP >> 20))
    return file.read_bytes()


def _read_stl(file: Path, head: bytes, size: int) -> np.ndarray:
    if size < _HEADER and not head.lstrip().startswith(b"solid"):
        raise ReadError(file, "not an STL file: too short")
    stated_count = int.from_bytes(head[80:84], "little")
    binary = size >= _HEADER and size == _HEADER + _TRIANGLE * stated_count
    if not binary and not head.lstrip().lower().startswith(b"solid"):
        raise ReadError(
            file,
            Message(
                "is not an STL file, or is truncated: its header states {:,} triangles, which take "
                "{:,} bytes, and it has {:,}",
                stated_count,
                _HEADER + _TRIANGLE * stated_count,
                size,
            ),
        )
    count = stated_count if binary else 0
    if count > MOST_TRIANGLES or (not binary and size > _MAX_TEXT):
        size_text = Message("{:,} triangles", count) if binary else Message("{} MiB of text", size >> 20)
        raise ReadError(
            file, Message("has {}; at most {:,} triangles are read: export it coarser", size_text, MOST_TRIANGLES)
        )
    data = file.read_bytes()
    if binary:
        # Three numbers of the normal, nine of the corners, and two unused bytes.
        rows = np.frombuffer(
            data, dtype=np.dtype([("n", "<f4", 3), ("corners", "<f4", (3, 3)), ("a", "<u2")]), offset=_HEADER
        )
        return rows["corners"].astype(np.float64)
    corners = _VERTEX.findall(data)
    if len(corners) % 3:
        raise ReadError(
            file, Message("is truncated: its number of corners, {:,}, is not a multiple of three", len(corners))
        )
    with parser_errors(file, Message("a corner has a coordinate that is not a number")):
        return np.array(corners, dtype=np.float64).reshape(-1, 3, 3)


def _checked_mesh(triangles: np.ndarray, file: Path, mend: str) -> Mesh:
    if not len(triangles):
        raise ReadError(file, "has no triangles")
    if not np.isfinite(triangles).all():
        number = int(np.flatnonzero(~np.isfinite(triangles).all(axis=(1, 2)))[0]) + 1
        raise ReadError(file, Message("triangle {} has a corner coordinate that is not a number", number))
    longest = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    if not SMALLEST <= longest <= LARGEST:
        length = f"{longest:.3g} mm" if math.isfinite(longest) else Message("infinitely")
        raise ReadError(file, Message("is {} long, too long for a part; {}", length, mend))
    return Mesh(triangles, file.name, is_closed_mesh(triangles))


def is_closed_mesh(triangles: np.ndarray) -> bool:
    """Return whether a mesh is closed.

    After equal vertices are merged, every edge of a closed mesh belongs to an even number of triangles.
    """
    _, corner = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    faces = corner.reshape(-1, 3).astype(np.int64)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges = edges[edges[:, 0] != edges[:, 1]]
    _, times = np.unique(edges[:, 0] * (corner.max() + 1) + edges[:, 1], return_counts=True)
    return bool((times % 2 == 0).all())
