"""A watched folder: complete files become programs, incomplete files are awaited, and nothing stops the watch."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from leafcut import api
from leafcut.cli.app import run
from leafcut.cli.batch import BatchRow, read_table
from leafcut.cli.watch_folder import FolderPoll, FolderWatch
from leafcut.errors import OptionError
from leafcut.files.whole_files import OutputError
from leafcut.order.executors import open_executor

PROGRAM = "G21 G90 G17 G54\nT1 M6\nS1200 M3\nG0 Z10\nG98 G81 X5 Y5 Z-5 R2 F120\nX50\nX9 Y30\nG80\nG0 Z50\nM30\n"
BROKEN = PROGRAM.replace("X50", "X")
GIVEN = {"machine": "linuxcnc-mill", "preset": "fast", "threads": 1}
DRILLED: dict[str, object] = {**GIVEN, "depth": 3}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder to watch, with a folder for the programs next to it; the current folder contains both."""
    for name in ("in", "out"):
        (tmp_path / name).mkdir()
    monkeypatch.chdir(tmp_path)
    return Path("in")


class Watched:
    """Output of a watch while steps happen between its polls; no time passes."""

    def __init__(self, folder: Path, *steps: Callable[[], object], given: dict[str, object] = GIVEN) -> None:
        self.written: list[BatchRow] = []
        self.refused: list[str] = []
        waiting = [*steps]

        def sleep(_: float) -> None:
            if not waiting:
                raise KeyboardInterrupt
            waiting.pop(0)()

        with open_executor("threads", 1) as executor, pytest.raises(KeyboardInterrupt):
            watch = FolderWatch(folder, Path("out"), given, executor, self.written.append, self.refused.append)
            watch.check_settings()
            watch.run_until_interrupted(2.0, sleep)

    @property
    def names(self) -> list[str]:
        return [row.program for row in self.written]


def nothing() -> None:
    """Happens while no one touches the folder."""


def puts(path: Path, text: str) -> Callable[[], object]:
    return lambda: path.write_text(text)


def test_a_new_file_and_a_changed_one_become_programs_once_each(folder: Path) -> None:
    (folder / "a.nc").write_text(PROGRAM)
    changed = PROGRAM.replace("X50", "X60.5")
    steps = [nothing] * 3 + [puts(folder / "b.nc", PROGRAM), nothing, nothing, puts(folder / "a.nc", changed)]
    seen = Watched(folder, *steps, *[nothing] * 4)
    assert seen.names == ["a.nc", "b.nc", "a.nc"] and not seen.refused
    assert Path("out/a.nc").read_text() == api.optimize(folder / "a.nc", **GIVEN).text
    assert (folder / "a.nc").read_text() == changed
    assert {row.program for row in read_table(Path("out/batch.csv")).values()} == {"a.nc", "b.nc"}
    assert "a.nc" in Path("out/batch.html").read_text() and "b.nc" in Path("out/batch.html").read_text()
    # Who watches again does not do again what is done.
    Path("out/b.nc").unlink()
    stamp = Path("out/a.nc").stat().st_mtime_ns
    assert Watched(folder, *[nothing] * 3).names == ["a.nc", "b.nc"]
    assert Path("out/a.nc").stat().st_mtime_ns == stamp


def test_a_file_in_the_output_folder_that_is_not_leafcuts_is_kept(folder: Path) -> None:
    (folder / "a.nc").write_text(PROGRAM)
    Path("out/a.nc").write_text("M30\n")
    seen = Watched(folder, *[nothing] * 4)
    assert not seen.names and len(seen.refused) == 1
    assert "out/a.nc: the file exists and its header does not show an unchanged file of leafcut" in seen.refused[0]
    assert Path("out/a.nc").read_text() == "M30\n"


def test_a_file_that_grows_is_waited_for(folder: Path) -> None:
    """Each look finds it larger; it is ready once, when two find it the same."""
    file = folder / "a.nc"
    look = FolderPoll(folder)
    found: list[Sequence[Path]] = []
    for end in (10, 60, 90, len(PROGRAM)):
        file.write_text(PROGRAM[:end])
        found.append(look.complete_files())
    assert found == [[]] * 4
    assert look.complete_files() == [file] and look.complete_files() == []


def test_programs_of_leafcut_in_the_folder_are_no_inputs(folder: Path) -> None:
    (folder / "own.nc").write_text(api.optimize("example:ten-points", thickness=6, preset="fast", threads=1).text)
    (folder / "a.nc").write_text(PROGRAM)
    look = FolderPoll(folder)
    assert look.complete_files() == []
    assert look.complete_files() == [folder / "a.nc"]


def test_a_drawing_that_lacks_its_end_is_waited_for_longer_and_then_refused(folder: Path, examples: Path) -> None:
    """A slow copy may pause between two polls; a file that stays incomplete is finally reported."""
    whole = (examples / "plate_10.dxf").read_bytes()
    part = whole[: len(whole) // 2]
    (folder / "plate.dxf").write_bytes(part)
    slow = Watched(
        folder, *[nothing] * 4, lambda: (folder / "plate.dxf").write_bytes(whole), *[nothing] * 3, given=DRILLED
    )
    assert slow.names == ["plate.ngc"] and not slow.refused
    (folder / "plate.dxf").write_bytes(part)
    never = Watched(folder, *[nothing] * 12)
    assert never.names == [] and "the end of the drawing is missing; save or send it again" in never.refused[0]


def test_after_an_error_it_goes_on_and_the_corrected_file_is_done(folder: Path) -> None:
    for name, text in (("a.nc", PROGRAM), ("b.nc", BROKEN), ("c.nc", PROGRAM)):
        (folder / name).write_text(text)
    seen = Watched(folder, *[nothing] * 3, puts(folder / "b.nc", PROGRAM), *[nothing] * 3)
    assert seen.names == ["a.nc", "c.nc", "b.nc"]
    assert len(seen.refused) == 1 and "b.nc:6" in seen.refused[0]


def test_a_program_is_removed_when_its_drawing_changes_into_one_that_is_refused(folder: Path) -> None:
    """It would be taken for the new drawing's program. Programs changed by others are kept."""
    (folder / "a.nc").write_text(PROGRAM)
    seen = Watched(folder, nothing, nothing, puts(folder / "a.nc", BROKEN), *[nothing] * 3)
    assert not Path("out/a.nc").exists()
    assert "removed, because it was made from an earlier version of in/a.nc" in seen.refused[1]
    (folder / "a.nc").write_text(PROGRAM)
    assert Watched(folder, nothing, nothing).names == ["a.nc"]
    Path("out/a.nc").write_text("mine")
    (folder / "a.nc").write_text(BROKEN)
    Watched(folder, *[nothing] * 3)
    assert Path("out/a.nc").read_text() == "mine"


def test_two_files_of_one_program_are_refused_until_one_has_another_name(folder: Path, examples: Path) -> None:
    board = "M48\nMETRIC\nT1C0.8\n%\nT1\nX10.0Y5.0\nX30.0Y5.0\nM30\n"
    (folder / "board.dxf").write_bytes((examples / "plate_10.dxf").read_bytes())
    (folder / "board.drl").write_text(board)
    seen = Watched(folder, nothing, nothing, (folder / "board.drl").unlink, *[nothing] * 3, given=DRILLED)
    assert [row.input for row in seen.written] == ["in/board.drl", "in/board.dxf"]
    assert seen.refused == ["in/board.dxf and in/board.drl would both be written as board.ngc; rename one of them"]


def test_what_is_hidden_passing_linked_empty_or_unknown_is_left_alone(folder: Path) -> None:
    for name in (".a.nc", "~b.nc", "c.nc~", "d.nc.part", "e.tmp", "f.bak"):
        (folder / name).write_text(PROGRAM)
    (folder / "empty.nc").write_text("")
    (folder / "letter.txt").write_text("Dear Sir,\n")
    (folder / "sub").mkdir()
    outside = Path("secret.nc")
    outside.write_text(PROGRAM)
    (folder / "link.nc").symlink_to(outside.resolve())
    seen = Watched(folder, *[nothing] * 4)
    assert seen.names == [] and not seen.refused


def test_a_folder_that_goes_away_is_told_once_and_waited_for(folder: Path) -> None:
    """The folder of programs, and the watched folder."""
    (folder / "a.nc").write_text(PROGRAM)
    away = [lambda: Path("out").rename("elsewhere"), nothing, nothing, lambda: Path("elsewhere").rename("out")]
    seen = Watched(folder, *away, *[nothing] * 3)
    assert seen.names == ["a.nc"] and len(seen.refused) == 1 and "is missing" in seen.refused[0]
    gone = [lambda: folder.rename("elsewhere"), nothing, lambda: Path("elsewhere").rename("in")]
    again = Watched(folder, *gone, *[nothing] * 3)
    assert again.names == ["a.nc"] and len(again.refused) == 1 and "cannot be read" in again.refused[0]


def test_inputs_are_never_overwritten(folder: Path, tmp_path: Path) -> None:
    """Neither by their own folder, nor by a link to them in the output folder."""
    (folder / "a.nc").write_text(PROGRAM)
    with open_executor("threads", 1) as executor:
        watch = FolderWatch(folder, tmp_path / "in", GIVEN, executor, print, print)
        with pytest.raises(OptionError, match="programs would be watched as well"):
            watch.check_settings()
    Path("out/a.nc").symlink_to((folder / "a.nc").resolve())
    seen = Watched(folder, *[nothing] * 3)
    assert seen.names == [] and "never overwritten" in seen.refused[0]
    assert (folder / "a.nc").read_text() == PROGRAM


@pytest.mark.parametrize(
    "words, status, told",
    [
        ("in", 2, "--watch needs -o FOLDER"),
        ("in out -o out", 2, "--watch takes one folder; 2 inputs were given"),
        ("nosuch -o out", 1, "nosuch: not a folder; the folder to watch must exist"),
        ("in -o nosuch", 1, "nosuch: not a folder; -o must exist"),
        ("in -o in", 2, "programs would be watched as well"),
        ("in -o out --machine haas-vf3", 2, "did you mean 'haas-vf2'"),
        ("in -o out --every 0", 2, "--every: choose 0.1s to 1h"),
        ("in -o out --every often", 2, "often"),
        ("in -o out --save-plan x.toml", 2, "--save-plan: names one file"),
        ("- -o out", 2, "--watch takes one folder"),
    ],
)
def test_what_cannot_be_watched_is_refused_before_the_first_look(
    words: str,
    status: int,
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("in", "out"):
        Path(name).mkdir(exist_ok=True)
    assert run(["optimize", *words.split(), "--watch", "--executor", "threads"]) == status
    said = capsys.readouterr()
    assert told in said.err and said.err.count("\n") == 1, said.err


def test_options_that_no_machine_has_are_refused_before_the_first_look(folder: Path) -> None:
    with pytest.raises(OptionError, match="haas-vf3"):
        Watched(folder, given={"machine": "haas-vf3"})
    with pytest.raises(OutputError, match="not a folder"):
        Watched(Path("nosuch"))


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is sent otherwise there")
def test_ctrl_c_ends_it_and_what_was_written_is_told(folder: Path) -> None:
    """The program is there when its line is; then the signal of Ctrl-C comes."""
    (folder / "a.nc").write_text(PROGRAM)
    # Whoever runs the tests in the background of a shell ignores Ctrl-C, and what they start would, too.
    listens = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    program = f"{listens}; from leafcut.cli.app import main; main()"
    command = [sys.executable, "-c", program, "optimize", "in", "--watch", "-o", "out", "--every", "0.1"]
    words = ["--machine", "linuxcnc-mill", "--preset", "fast", "--executor", "threads", "--workers", "1"]
    with subprocess.Popen([*command, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        limit = threading.Timer(240, process.kill)
        limit.start()
        assert process.stdout is not None
        lines = [process.stdout.readline(), process.stdout.readline()]
        process.send_signal(signal.SIGINT)
        rest, errors = process.communicate()
        limit.cancel()
    assert lines[0] == "watching in; Ctrl-C ends it\n" and lines[1].startswith("in/a.nc: a.nc, ")
    assert (process.returncode, rest) == (0, "ended; 1 program written, 0 refusals\n"), errors
    assert Path("out/a.nc").read_text() == api.optimize(folder / "a.nc", machine="linuxcnc-mill", preset="fast").text
