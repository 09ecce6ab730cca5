"""The proof on real programs: each is the same as itself, in another order where that is free, and as nothing else."""

from __future__ import annotations

import functools
import random
import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import ReadError
from leafcut.gcode.dialects import load_dialect
from leafcut.gcode.program import Program
from leafcut.gcode.program_interpreter import interpret_program
from leafcut.processes.program.proof.certificate import certify
from rs274_moves import moves_of_rs274, run_rs274

FILES = [
    "bcnc_sample.gcode", "camotics_buildbotics.gcode", "camotics_genes_encoder.ngc", "camotics_heart_cutout.ngc",
    "camotics_scorpion.nc", "cncjs_helical_thread.gcode", "cncjs_jsdc_laser.gcode", "gsender_kb35.nc",
    "lcnc_bezel.ngc", "lcnc_cam_nisley.ngc", "lcnc_test_12mmflat.ngc", "pcb2gcode_easysdr_drill.ngc",
    "pcb2gcode_easysdr_outline.ngc", "pcb2gcode_multivibrator_drill.ngc", "pcb2gcode_project_controller_milldrill.ngc",
    "pcb2gcode_slots_drill_metric.ngc", "ugs_enclosure_cambam.nc", "ugs_serial_stress.gcode",
]  # fmt: skip
#: Programs whose proof takes more than a second.
LARGE = {"camotics_genes_encoder.ngc"}
#: Small programs that rs274 accepts.
JUDGED = [
    "camotics_buildbotics.gcode", "camotics_scorpion.nc", "lcnc_bezel.ngc", "lcnc_test_12mmflat.ngc",
    "pcb2gcode_easysdr_outline.ngc", "pcb2gcode_multivibrator_drill.ngc",
]  # fmt: skip


def text_of(data: Path, name: str) -> str:
    return (data / "gcode" / name).read_text(encoding="utf-8", errors="replace")


def program(text: str) -> Program:
    return interpret_program(text, load_dialect("linuxcnc"), units="mm")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] if name in LARGE else []) for name in FILES]
)
def test_every_real_program_is_the_same_as_itself(data: Path, name: str) -> None:
    text = text_of(data, name)
    certificate = certify(program(text), program(text), tolerance_mm=0.0)
    assert certificate.same, certificate.differences
    assert certificate.before == certificate.after


DRILLED = r"(?:G0 X\S+ Y\S+\nG1 Z-\S+\nG1 Z\S+\n)+"
PLACES = r"(?:X\S+ Y\S+ ?\n)+"


@pytest.mark.parametrize(
    "name, run, piece",
    [
        ("pcb2gcode_easysdr_drill.ngc", DRILLED, r"G0.*\nG1.*\nG1.*\n"),
        ("pcb2gcode_multivibrator_drill.ngc", PLACES, r".*\n"),
    ],
)
def test_holes_of_one_tool_may_be_drilled_in_any_order(data: Path, name: str, run: str, piece: str) -> None:
    text, rng, moved = text_of(data, name), random.Random(3), 0

    def shuffled(match: re.Match[str]) -> str:
        nonlocal moved
        pieces = re.findall(piece, match.group())
        rng.shuffle(pieces)
        moved += len(pieces)
        return "".join(pieces)

    other = re.sub(run, shuffled, text)
    assert moved > 40 and other != text
    certificate = certify(program(text), program(other))
    assert certificate.same, certificate.differences


def test_holes_of_one_tool_may_not_be_drilled_with_another(data: Path) -> None:
    text = text_of(data, "pcb2gcode_easysdr_drill.ngc")
    runs = list(re.finditer(DRILLED, text))
    hole = re.match(r"G0.*\nG1.*\nG1.*\n", runs[0].group())
    assert hole
    other = text[: runs[0].start()] + text[runs[0].start() + hole.end() : runs[1].start()]
    other += hole.group() + text[runs[1].start() :]
    found = certify(program(text), program(other)).differences
    assert found
    assert all(d.original and d.new for d in found)


def cutting_moves(output: str) -> Counter[tuple]:
    """Return the cuts and dwells that rs274 made, each with its start; feeds to the printed decimals."""
    place, moves = (0.0, 0.0, 0.0), []
    for move in moves_of_rs274(output):
        if move[0] in ("feed", "arc", "dwell"):
            moves.append((place, *move))
        if move[0] in ("rapid", "feed"):
            place = move[1:4]
        elif move[0] == "arc":
            place = move[2:5]
    return Counter(moves)


def told_apart(one: Counter[tuple], other: Counter[tuple]) -> bool:
    """Return whether two sets of cuts differ by more than the last decimals of a feed."""
    left, right = sorted((one - other).elements(), key=repr), sorted((other - one).elements(), key=repr)
    if len(left) != len(right):
        return True
    for a, b in zip(left, right, strict=True):
        if a[:-1] != b[:-1] or a[1] != "feed" or abs(a[-1] - b[-1]) > 0.02 + 1e-4 * a[-1]:
            return True
    return False


@pytest.fixture(scope="module")
def cuts_of(data: Path, rs274: str, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Counter[tuple]]:
    """Return LinuxCNC's cuts of an unchanged file; each file is run once."""

    @functools.cache
    def cuts(name: str) -> Counter[tuple]:
        status, output = run_rs274(rs274, text_of(data, name), tmp_path_factory.mktemp("whole"))
        assert status == 0
        return cutting_moves(output)

    return cuts


@pytest.mark.parametrize("name", JUDGED)
@settings(max_examples=25)  # each example starts rs274
@given(choice=st.data())
def test_a_changed_digit_that_changes_the_cuts_is_always_caught(
    data: Path, rs274: str, tmp_path: Path, cuts_of: Callable[[str], Counter[tuple]], name: str, choice: st.DataObject
) -> None:
    """LinuxCNC's interpreter is the judge: where its cutting moves are others, there must be a difference."""
    text = text_of(data, name)
    lines = text.splitlines(keepends=True)
    cutting = [k for k, line in enumerate(lines) if re.match(r"\s*(N\d+\s*)?(G0*[123]\b|G8[1-5]|[XYZIJF])", line)]
    number = choice.draw(st.sampled_from(cutting))
    digits = [m.start() for m in re.finditer(r"(?<=[0-9.XYZIJKRFPQ-])[0-9]", re.sub(r"[(;].*", "", lines[number]))]
    if not digits:
        return
    at = choice.draw(st.sampled_from(digits))
    digit = choice.draw(st.sampled_from([d for d in "0123456789" if d != lines[number][at]]))
    lines[number] = lines[number][:at] + digit + lines[number][at + 1 :]
    mutated = "".join(lines)
    try:
        certificate = certify(program(text), program(mutated), tolerance_mm=0.0)
    except ReadError:
        return
    status, after = run_rs274(rs274, mutated, tmp_path)
    if status == 0 and told_apart(cuts_of(name), cutting_moves(after)):
        assert not certificate.same


@pytest.mark.parametrize(
    "name",
    ["camotics_buildbotics.gcode", "pcb2gcode_slots_drill_metric.ngc", "ugs_enclosure_cambam.nc", "gsender_kb35.nc"],
)
def test_a_rapid_that_ends_lower_than_before_is_always_caught(data: Path, name: str) -> None:
    text = text_of(data, name)
    heights = list(re.finditer(r"(?m)^(?:N\d+\s*)?G0*0\s*Z\s*(-?[0-9.]+)", text))
    original = program(text)
    assert heights
    for match in random.Random(1).sample(heights, min(4, len(heights))):
        lower = f"{float(match.group(1)) - 0.1:.4f}"
        other = text[: match.start(1)] + lower + text[match.end(1) :]
        certificate = certify(original, program(other))
        assert not certificate.same, match.group()
        assert all(d.original and d.new for d in certificate.differences)
