"""STEP: the holes of a solid, and its surface as triangles, by OpenCASCADE (extra `step`) in a process of its own."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leafcut.errors import OptionError, ReadError, count_of
from leafcut.model import Hole, Issue, Part, Severity
from leafcut.options import ReadOptions
from leafcut.read.filter_holes import sift
from leafcut.read.format import Format, Match, Source

#: Files larger than this are refused: OpenCASCADE takes some twenty times as much memory.
LARGEST = 100 * 1024 * 1024
#: The process gets so much memory and time: what needs more is refused, bytes and s.
MEMORY, SECONDS = 8 * 1024**3, 300
#: More triangles than this are not taken.
MOST_TRIANGLES = 2_000_000


def sniff(head: bytes) -> Match:
    """Say whether a file begins as STEP does (ISO 10303-21)."""
    return Match.YES if head.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"ISO-10303-21;") else Match.NO


def read_step(source: Source, options: ReadOptions) -> Part:
    """Return the holes of a solid that can be drilled from above, each with its height and its depth.

    Raises
    ------
    ReadError
        The file is damaged, or is no single solid.
    OptionError
        OpenCASCADE is not installed, or a unit is given: the file says its own.
    """
    if options.units:
        raise OptionError("--units: a STEP file says its own unit; leave it out")
    told = _solid(source.path, source.data)[0]
    holes = tuple(
        Hole(
            round(one["x"], 6), round(one["y"], 6), round(one["diameter"], 6), z=round(one["top"], 6),
            depth=round(one["depth"], 6), through=one["through"], flat=not (one["through"] or one["pointed"]),
        )
        for one in told["holes"]
    )  # fmt: skip
    kept, sifted = sift(holes, options)
    issues = (*_issues(told), *sifted)
    return Part(source.name, kept, issues=issues, source=source.path, format=FORMAT.name)


def step_mesh(path: str, data: bytes) -> NDArray[np.float64]:
    """Return the surface of a solid as triangles, float64[n, 3, 3], mm; they leave it by 0.05 mm at most.

    Raises
    ------
    ReadError, OptionError
        As `read_step`.
    """
    return _solid(path, data)[1]


def _issues(told: dict[str, Any]) -> list[Issue]:
    issues = []
    stepped = [one for one in told["holes"] if one["steps"]]
    if stepped:
        one = stepped[0]
        (diameter, depth), *_ = one["steps"]
        issues.append(
            Issue(
                "L217",
                f"{count_of(len(stepped), 'hole')} with a counterbore or countersink, as at {one['x']:g}, {one['y']:g} "
                f"(Ø {diameter:g}, {depth:.3f} mm deep): the narrow part is drilled, the wide one is not made",
                severity=Severity.MISSING,
            )
        )
    if told["below"]:
        issues.append(
            Issue(
                "L218",
                f"{count_of(told['below'], 'hole')} open from below alone, not drilled: turn the part over for them",
                severity=Severity.MISSING,
            )
        )
    for direction, count in told["aside"].items():
        issues.append(
            Issue(
                "L218",
                f"{count_of(count, 'hole')} along {direction}, not drilled: only holes along Z are",
                severity=Severity.MISSING,
            )
        )
    return issues


def _solid(path: str, data: bytes) -> tuple[dict[str, Any], NDArray[np.float64]]:
    """Return what the process tells of a file, and its triangles."""
    if importlib.util.find_spec("OCP") is None:
        raise OptionError("reading STEP needs OpenCASCADE: pip install 'leafcut[step]'")
    if len(data) > LARGEST:
        raise ReadError(path, f"has {len(data) >> 20} MiB; STEP files up to {LARGEST >> 20} MiB are read")
    if not data.rstrip().endswith(b"END-ISO-10303-21;"):
        raise ReadError(path, "the STEP file is cut off: its last line is missing")
    with tempfile.TemporaryDirectory(prefix="leafcut-step-") as folder:
        file, out = Path(folder, "part.step"), Path(folder, "found.npz")
        file.write_bytes(data)
        command = [sys.executable, "-m", "leafcut.read.step_solid", str(file), str(out), str(MOST_TRIANGLES)]
        try:
            done = subprocess.run(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                timeout=SECONDS, check=False, preexec_fn=_limited if sys.platform != "win32" else None,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise ReadError(path, f"takes more than {SECONDS} s to read; export the part in fewer faces") from None
        if done.returncode or not out.is_file():
            raise ReadError(path, "OpenCASCADE could not read the STEP file, or needed too much memory for it")
        with np.load(out) as found:
            told, triangles = json.loads(str(found["told"])), found["triangles"]
    if "problem" in told:
        raise ReadError(path, told["problem"])
    return told, triangles


def _limited() -> None:
    """Bound the memory of the process that reads."""
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


FORMAT = Format(
    name="step",
    extensions=(".step", ".stp"),
    help="solids of CAD (extra step): holes with their heights and depths",
    read=read_step,
    sniff=sniff,
)
