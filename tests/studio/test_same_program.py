"""Command line, library and studio write the same bytes: one whole run of each process."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from parts_to_nest import ANGLE, PLATE, svg

import leafcut
from leafcut.cli import app as cli
from leafcut.options.option_spec import flag_name
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.nest_request import WantedPart
from leafcut.studio.jobs.task import Task, command_line
from leafcut.studio.studio import Studio

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
#: A rectangle with a round hole.
SHEET = svg(100, 60, '<path d="M5 5H45V45H5Z"/><circle cx="25" cy="25" r="8"/>')
#: A drilling program of four holes in a poor order.
REORDERED = b"""\
G21 G90 G17
T1 M6
S1200 M3
G0 Z10
G98 G81 X5 Y5 Z-5 R2 F120
X90 Y5
X9 Y7
X80
G80
G0 Z50
M5
M30
"""
#: A name with characters that a shell interprets.
ODD_NAME = "a 'b' $(x); plate.dxf"
SHOP_MILL = (ROOT / "src/leafcut/machines/haas-vf2.toml").read_text(encoding="utf-8")


@dataclass(frozen=True)
class Job:
    """The input of a process, its options, and the options that name further files."""

    command: str
    name: str
    data: bytes
    options: Mapping[str, Any]
    #: Option → (file name, content).
    files: Mapping[str, tuple[str, bytes]] = field(default_factory=dict)
    #: Process that the studio requests.
    process: str = "auto"


JOBS = [
    Job(
        "drill",
        ODD_NAME,
        (EXAMPLES / "plate_10.dxf").read_bytes(),
        {"thickness": "0.25in", "line_numbers": True, "bound": False, "start_point": "-5,3", "preset": "fast"}
        | {"keep_out": "0 0 1 1,2 2 3 3"},
        {"tools": ("my tools.toml", (EXAMPLES / "tools.toml").read_bytes())},
    ),
    Job("cut", "sheet.svg", SHEET, {"thickness": "6", "preset": "fast"}, process="cut"),
    Job(
        "pocket",
        "pocket.svg",
        svg(30, 20, '<path d="M5 5H25V15H5Z"/>'),
        {"depth": "2", "tool_diameter": "6", "strategy": "contour"},
        process="pocket",
    ),
    Job(
        "part",
        "bracket.dxf",
        (EXAMPLES / "bracket.dxf").read_bytes(),
        {"thickness": "3", "tool_diameter": "3", "material": "aluminium", "machine": "shapeoko-router", "tabs": "2"}
        | {"tab_height": "1", "milling": "conventional", "origin": "lower-left", "preset": "fast"},
        process="part",
    ),
    Job("reorder", "cam.nc", REORDERED, {"preset": "fast"}),
]


def program_of_studio(studio: Studio, task: Task) -> bytes:
    """Run a task as a job of the studio and return its program."""
    job = studio.jobs.start(task)
    record = studio.jobs.wait(job) and studio.jobs.record(job)
    assert record is not None
    assert record.state is JobState.DONE, record.line
    program = studio.history.artefact(job, "program")
    assert program is not None
    return program.data


@pytest.mark.parametrize("job", JOBS, ids=lambda job: job.command)
def test_command_line_library_and_studio_write_the_same_program(
    job: Job, studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two command lines: the command of the process, and the command line that the studio shows for its job."""
    folder = studio.folder
    monkeypatch.chdir(tmp_path)
    for name, data in ((job.name, job.data), *job.files.values()):
        Path(name).write_bytes(data)
    uploads = {option: folder.add_input(name, data) for option, (name, data) in job.files.items()}
    machine = {}
    if job.command == "drill":  # the drilling job uses a machine profile of the shop
        Path("my-mill.toml").write_text(SHOP_MILL, encoding="utf-8")
        folder.save_own("machines", "my-mill", SHOP_MILL)
        machine = {"machine": "my-mill.toml"}
    task_options = {**job.options, **uploads} | ({"machine": "mine:my-mill"} if machine else {})
    task = Task("optimize", (folder.add_input(job.name, job.data),), job.process, task_options)
    options = {**job.options, **machine} | {option: name for option, (name, _) in job.files.items()}

    expected = leafcut.optimize(job.name, "library.nc", process=job.process, **options)
    flags = [
        flag_name(name if value else f"no_{name}") if isinstance(value, bool) else f"{flag_name(name)}={value}"
        for name, value in options.items()
    ]
    assert cli.run([job.command, job.name, "-o", "command.nc", "--quiet", *flags]) == 0
    shown = shlex.split(command_line(task, folder, "shown.nc"))
    assert shown[0] == "leafcut"
    assert cli.run([*shown[1:], "--quiet"]) == 0

    assert expected.verified
    program = Path("library.nc").read_bytes()
    assert len(program) > 100
    assert Path("command.nc").read_bytes() == program
    assert Path("shown.nc").read_bytes() == program
    assert program_of_studio(studio, task) == program


@pytest.mark.parametrize("rotations", ["", "0 180"], ids=["words", "list"])
def test_command_line_library_and_studio_write_the_same_sheets(
    rotations: str, studio: Studio, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command line names the parts, or a parts list if a part may be rotated by certain angles only."""
    options = {"sheet": "200x90", "margin": "2", "gap": "2", "nester": "rectangles", "variants": "2"}
    plate, angle = studio.folder.add_input("plate.svg", PLATE), studio.folder.add_input("angle.svg", ANGLE)
    task = Task("nest", (f"{plate}:4", WantedPart(angle, 2, rotations).encoded), options=options)
    job = studio.jobs.start(task)
    assert studio.jobs.wait(job) is JobState.DONE
    artefacts = studio.history.artefacts(job)
    files = {key: studio.history.artefact(job, key) for key in artefacts if key == "list" or key.startswith("sheet-")}
    sheets = {file.file_name: file.data for key, file in files.items() if file and key != "list"}
    assert len(sheets) > 1

    monkeypatch.chdir(tmp_path)
    Path("plate.svg").write_bytes(PLATE)
    Path("angle.svg").write_bytes(ANGLE)
    assert ("list" in files) is bool(rotations)
    if part_list := files.get("list"):
        Path(part_list.file_name).write_bytes(part_list.data)
    words = shlex.split(command_line(task, studio.folder))
    assert ("parts.csv" in words) is bool(rotations)
    assert cli.run([*words[1:], "--quiet"]) == 0
    assert {file.name: file.read_bytes() for file in tmp_path.glob("*.dxf")} == sheets

    parts = ["parts.csv"] if rotations else ["plate.svg:4", "angle.svg:2"]
    outcome = leafcut.nest(parts, "nest.dxf", **options)
    drawings = {
        name: text.encode()
        for names, texts in zip(outcome.files, outcome.drawings, strict=True)
        for name, text in zip(names, texts, strict=True)
    }
    assert drawings == sheets
