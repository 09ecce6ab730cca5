"""Join the drill files of a circuit board.

KiCad and other programs write plated and unplated holes to separate files.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from leafcut.errors import ReadError, count_of
from leafcut.message import Message
from leafcut.model.heartbeat import Heartbeat, ignore_heartbeat
from leafcut.model.issue import Issue, Severity
from leafcut.model.part import Part
from leafcut.options import ReadOptions
from leafcut.read import Source, read
from leafcut.read.excellon import EmptyDrillFile
from leafcut.read.filter_holes import select_holes


def read_drill_files(
    sources: Sequence[Source], options: ReadOptions, on_progress: Heartbeat = ignore_heartbeat
) -> Part:
    """Combine the holes and slots of several drill files into one part. Empty files are reported and left out.

    Raises
    ------
    ReadError
        A file cannot be read, all files are empty, or `join_drill_files` raises the error.
    """
    parts, empty = [], []
    for source in sources:
        try:
            parts.append(read(source, options, on_progress))
        except EmptyDrillFile as problem:
            empty.append(problem)
    if not parts:
        raise empty[0]
    joined = join_drill_files(parts, options)
    names = (Path(problem.file).name for problem in empty)
    notes = (Issue("L409", Message("{} has no holes and no tools", name), severity=Severity.NOTE) for name in names)
    return replace(joined, issues=(*joined.issues, *notes))


def join_drill_files(parts: Sequence[Part], options: ReadOptions) -> Part:
    """Combine the holes and slots of several drill files into one part, in the order of the files.

    A hole that appears in two files is drilled once. The part does not distinguish plated and unplated holes of equal
    diameter. To keep them apart, create one program per file.

    Raises
    ------
    ReadError
        With `options.strict`, two files contain the same hole, or the files lie too far apart to belong to one board.
    """
    holes, selection_issues = select_holes([hole for part in parts for hole in part.holes], options)
    files = Message.joined(", ", (Message("{} {}", part.source, _hole_and_slot_counts(part)) for part in parts))
    message = Message("drilled in one program: {}; one tool for each diameter, plated or not", files)
    issues = [Issue("L409", message, severity=Severity.NOTE)]
    if far := _distant_part_names(parts):
        message = Message(
            "{} lie far apart; check that they belong to the same board and have the same origin and units", far
        )
        issues.append(Issue("L409", message))
    issues += [issue for issue in selection_issues if issue.code in ("L301", "L302")]
    warnings = [issue for issue in issues if issue.severity is Severity.WARNING]
    if options.strict and warnings:
        raise ReadError(parts[0].source, Message("refused by --strict: {}", warnings[0]))
    return replace(
        parts[0],
        name=" + ".join(part.name for part in parts),
        source=" + ".join(part.source for part in parts),
        holes=holes,
        slots=tuple(slot for part in parts for slot in part.slots),
        reference=_joint_reference(parts),
        issues=(*issues, *(issue for part in parts for issue in part.issues)),
    )


def _joint_reference(parts: Sequence[Part]) -> Part | None:
    """Return a part with the holes and slots of all files, for computing the origin.

    If no file has its own reference, all holes are selected anyway, so the function returns None.
    """
    if all(part.reference is None for part in parts):
        return None
    complete = [part.reference or part for part in parts]
    holes, slots = (
        (hole for part in complete for hole in part.holes),
        (slot for part in complete for slot in part.slots),
    )
    return Part("", tuple(holes), tuple(slots))


def _hole_and_slot_counts(part: Part) -> str:
    texts = [count_of(len(part.holes), "hole")] if part.holes else []
    return " and ".join([*texts, *([count_of(len(part.slots), "slot")] if part.slots else [])])


def _distant_part_names(parts: Sequence[Part]) -> str:
    """Return the names of two parts that are farther apart than the sum of their sizes, or "" if none are."""
    boxes = [part.extents for part in parts]
    for k, (a, box_a) in enumerate(zip(parts, boxes, strict=True)):
        for b, box_b in zip(parts[k + 1 :], boxes[k + 1 :], strict=True):
            gaps = [max(box_a[i] - box_b[i + 2], box_b[i] - box_a[i + 2], 0.0) for i in (0, 1)]
            sizes = [math.dist(box[:2], box[2:]) for box in (box_a, box_b)]
            if math.hypot(*gaps) > sum(sizes) and math.hypot(*gaps) > 0.0:
                return Message("{} and {}", a.source, b.source)
    return ""
