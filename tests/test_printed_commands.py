"""Every command that the pages print: its words are right, and it runs as printed on files of its names."""

from __future__ import annotations

import itertools
import re
import shlex
import shutil
from pathlib import Path

import pytest

from leafcut.cli.app import run

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
#: Commands that need something outside of this machine, or never end, with the requirement.
OUTSIDE = {
    "--port": "a board",
    "dask://": "a cluster",
    "--parallel gpu": "a graphics card",
    "watch ": "goes on until it is stopped",
    "studio": "goes on until it is stopped",
    "send ": "a board",
    "install addon ": "a folder of another program",
    "…": "an ellipsis stands for words",
    "install kernels": "compiles for minutes; tests/test_warming.py",
}
#: Experiments of many hours: the reduced one of each runs in tests/lab.
LONG = ("lab run thesis", "lab run machining_time", "lab report ", "lab tune ")


def printed() -> dict[str, str]:
    """Return the commands of the pages, in blocks and in text, and the page of each."""
    found: dict[str, str] = {}
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for command in [
            *re.findall(r"^    (?:\.venv/bin/)?leafcut (.+)$", text, flags=re.MULTILINE),
            # Of the words in text those that name a file; the others are names of commands and options.
            *(
                one
                for one in re.findall(r"`leafcut ([^`\n]+)`", text)
                if re.search(r" (?!-)[^ .]+(?:[.][a-z]|:[0-9])", one)
            ),
        ]:
            found.setdefault(command.partition("  #")[0].strip(), page.name)
    return found


COMMANDS = printed()
#: Names in commands without a file here, and pipes.
NOT_HERE = (
    "a.nc", "'*.nc'", "my.ini", "my.toml", "mine.toml", "holes.csv", "part.stl", "board-PTH.drl", " | ", "orders",
    "shop.csv:", "siemens-828d -o plate.mpf", "cut part.step", "pocket part.step", "vf2.toml",
)  # fmt: skip
#: Earlier command on the same page that a command depends on.
BEFORE: dict[str, tuple[str, ...]] = {
    "cut nested.dxf --thickness 6 -o nested.ngc": (
        "nest examples/bracket.dxf:10 examples/gusset.svg:4 --sheet 800x500 --kerf 1.5 --gap 6 -o nested.dxf",
    ),
    "cut examples/sheet.dxf --thickness 6 --plan plan.json -o sheet.ngc": (
        "cut examples/sheet.dxf --thickness 6 --save-plan plan.json -o sheet.ngc",
    ),
    "drill examples/plate_70.dxf --tools tuned.toml --thickness 0.25in --machine haas-vf2 -o plate.nc": (
        "tools speeds examples/plate_70.dxf --material c45 --tools examples/tools.toml --thickness 0.25in --machine "
        "haas-vf2 --save tuned.toml",
    ),
    "nest examples/gusset.svg:4 --sheet first_rest_1.dxf --sheet 600x400 -o second.dxf": (
        "nest examples/bracket.dxf:10 --sheet 800x500 --remnants-out . -o first.dxf",
    ),
}


def needs(command: str) -> str:
    """Return the requirement of a command besides files, or None."""
    return next((what for word, what in OUTSIDE.items() if word in command), "")


def test_the_pages_print_commands() -> None:
    """The patterns above still find them."""
    assert len(COMMANDS) > 60


def _words(command: str) -> list[str]:
    """Return the words of a command, without redirections."""
    return shlex.split(re.split(r" [|<>] ?", command)[0])


#: Printed commands with an input that can be missing.
WITH_INPUT = sorted(
    command for command in COMMANDS if not needs(command) and not command.startswith(LONG) and "random:" not in command
)


@pytest.mark.parametrize("command", WITH_INPUT)
def test_a_printed_command_has_words_that_leafcut_knows(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In an empty folder a file is missing; a wrong word or option is refused before any file, with status 2."""
    monkeypatch.chdir(tmp_path)
    status = run([*_words(command)])
    said = capsys.readouterr()
    assert status != 2 or "file not found" in said.err, f"{COMMANDS[command]}: leafcut {command}: {said.err}"


#: Files of the names in the pages, and what they are here.
SHIPPED = {
    "plate.dxf": "examples/plate_8x8_10.dxf", "holes.dxf": "examples/plate_8x8_10.dxf",
    "bracket.dxf": "examples/bracket.dxf", "gusset.svg": "examples/gusset.svg", "sheet.dxf": "examples/sheet.dxf",
    "pocket.dxf": "examples/pocket.dxf", "program.nc": "examples/cam_121.nc", "drill.ngc": "examples/cam_121.nc",
    "shop.toml": "examples/tools.toml", "part.step": "examples/stepped_plate.step",
    "settings.txt": "tests/read/settings/grbl_3018.txt",
}  # fmt: skip
#: Programs that the pages name: four slots with the tool that the library has as T12, in the words of a Haas, too.
PROGRAM = (
    "G21 G90\n(T12 D=6. - flat end mill)\nT12 M6\nS3000 M3\nG4 P2.\nG0 X10. Y10. Z5.\n"
    + "".join(f"G0 X{x}. Y10.\nG1 Z-2. F200.\nG1 Y60. F400.\nG0 Z5.\n" for x in (20, 80, 40, 60))
    + "M5\nM2\n"
)
#: Printed commands that run on these files, in the order of the pages.
RUN = [
    command
    for command in COMMANDS
    if not needs(command) and not command.startswith(LONG) and not any(word in command for word in NOT_HERE)
]


@pytest.fixture
def shop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the working folder with the files that the pages name."""
    monkeypatch.chdir(tmp_path)
    for folder in ("examples", "tests/styles"):
        shutil.copytree(ROOT / folder, folder)
    for name, source in SHIPPED.items():
        shutil.copy(ROOT / source, name)
    for name in ("part.nc", "plate.nc", "old.nc", "new.nc", "original.nc"):
        Path(name).write_text(PROGRAM)
    Path("shop.csv").write_text("number,kind,diameter\n1,drill,1/4in\n")
    for folder in ("out", "tuned"):
        Path(folder).mkdir()
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("command", RUN)
def test_a_printed_command_runs_as_printed(command: str, shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Status 0, or 3 where the page's drawing has work that is missing."""
    for needed in BEFORE.get(command, ()):
        assert run(shlex.split(needed)) == 0, needed
    words = _words(command)
    # The pages use one name for several programs; a program of another origin is not replaced.
    for flag, name in itertools.pairwise(words):
        if flag == "-o" and Path(name).is_file():
            Path(name).unlink()
    status = run(words)
    assert status in (0, 3), f"{COMMANDS[command]}: leafcut {command}: {capsys.readouterr().err}"
