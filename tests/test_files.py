"""A file appears whole or not at all, and an input is never overwritten."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from leafcut.errors import ReadError
from leafcut.files.whole_files import (
    LARGEST_PROGRAM,
    OutputError,
    check_output,
    read_program,
    write_all_or_none,
    write_whole,
)


def names(folder: Path) -> list[str]:
    return sorted(p.name for p in folder.iterdir())


def test_what_is_written_is_read_again_with_plain_line_ends(tmp_path: Path) -> None:
    write_whole(tmp_path / "a.nc", "G21\nM30\n")
    assert (tmp_path / "a.nc").read_bytes() == b"G21\nM30\n"
    assert names(tmp_path) == ["a.nc"]


def test_a_file_that_exists_is_replaced_and_keeps_its_permissions(tmp_path: Path) -> None:
    file = tmp_path / "a.nc"
    file.write_text("old")
    file.chmod(0o640)
    write_whole(file, "new")
    assert (file.read_text(), file.stat().st_mode & 0o777) == ("new", 0o640)


def test_a_new_file_has_the_permissions_that_any_new_file_gets(tmp_path: Path) -> None:
    write_whole(tmp_path / "a.nc", "x")
    (tmp_path / "b.nc").touch()
    assert (tmp_path / "a.nc").stat().st_mode == (tmp_path / "b.nc").stat().st_mode


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_write_that_fails_leaves_the_old_file_and_nothing_beside_it(
    failure: BaseException, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "a.nc"
    file.write_text("old")

    def fail(_: int) -> None:
        raise failure

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises((OutputError, KeyboardInterrupt)):
        write_whole(file, "new")
    assert (file.read_text(), names(tmp_path)) == ("old", ["a.nc"])


def test_a_letter_that_cannot_be_written_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="a character is not in utf-8"):
        write_whole(tmp_path / "a.html", "bad \udcff")
    assert names(tmp_path) == []


def test_a_link_keeps_pointing_to_the_file_it_names(tmp_path: Path) -> None:
    file, link = tmp_path / "a.nc", tmp_path / "link.nc"
    file.write_text("old")
    link.symlink_to(file)
    write_whole(link, "new")
    assert link.is_symlink()
    assert file.read_text() == "new"


def test_an_input_is_never_an_output_by_whatever_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source, link = tmp_path / "a.dxf", tmp_path / "link.dxf"
    source.write_text("x")
    link.symlink_to(source)
    monkeypatch.chdir(tmp_path)
    for target in (source, link, Path("a.dxf"), Path("../") / tmp_path.name / "a.dxf"):
        with pytest.raises(OutputError, match="is an input"):
            check_output(target, [None, source])
    with pytest.raises(OutputError, match="is an input"):
        check_output(tmp_path / "page.html", [tmp_path / "page.html"])  # neither is there yet
    check_output(tmp_path / "b.nc", [source])
    check_output(None, [source])


def test_what_is_no_file_is_refused_before_any_work(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for target, words in (
        (tmp_path, "is a folder"),
        ("", "the name of the output is empty"),
        (f"{tmp_path}/e.nc/", "e.nc/: no such folder"),
        (tmp_path / "no" / "a.nc", "no folder"),
        (tmp_path / "pipe", "is a device or a pipe"),
        (Path(os.devnull), "is a device or a pipe"),
    ):
        with pytest.raises(OutputError, match=words):
            check_output(target, [])


def test_old_controllers_programs_are_read_as_latin_1(tmp_path: Path) -> None:
    file = tmp_path / "a.nc"
    file.write_bytes("(Ø5)\nM30\n".encode("latin-1"))
    assert read_program(file) == "(Ø5)\nM30\n"
    file.write_bytes("(Ø5)\nM30\n".encode("utf-8-sig"))
    assert read_program(file) == "(Ø5)\nM30\n"


def test_what_is_no_program_is_refused_with_its_name(tmp_path: Path) -> None:
    empty, huge = tmp_path / "empty.nc", tmp_path / "huge.nc"
    empty.write_bytes(b" \n")
    with huge.open("wb") as file:
        file.truncate(LARGEST_PROGRAM + 1)  # a sparse file: it takes no room
    wide, binary = tmp_path / "wide.nc", tmp_path / "binary.nc"
    wide.write_bytes("G0 X1\n".encode("utf-16"))
    binary.write_bytes(b"G0\0X1\n")
    for file_name, words in (
        (empty, "is empty"),
        (huge, "is larger than"),
        (tmp_path / "no.nc", "cannot be read"),
        (wide, "this text is UTF-16; save it as UTF-8"),
        (binary, "this is a binary file"),
    ):
        with pytest.raises(ReadError, match=f"{file_name.name}: {words}"):
            read_program(file_name)


def test_what_a_killed_run_left_is_removed_by_the_next_and_nothing_else(tmp_path: Path) -> None:
    """Killed between writing and naming: its temporary file names a process that is over."""
    program = f"""
import os, signal, sys
from leafcut.files import whole_files as files
os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL)
files.write_whole({str(tmp_path / "out.nc")!r}, "half")
"""
    killed = subprocess.run([sys.executable, "-c", program], check=False)
    assert killed.returncode == -signal.SIGKILL
    assert len(left := list(tmp_path.iterdir())) == 1
    others = [
        ".out.nc.swp",
        ".out.nc.AbCd",
        f".out.nc.leafcut-{os.getpid()}-mine",
        ".other.nc.leafcut-1-x",
        "out.nc.bak",
    ]
    for name in others:
        (tmp_path / name).write_text("kept", encoding="utf-8")
    write_whole(tmp_path / "out.nc", "whole")
    assert not left[0].exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([*others, "out.nc"])


#: Writes a program and its companion files again and again, killed before its first disk operation, its second, …;
#: prints the files present after each, and at the end those of a complete run.
KILLED = """
import json, os, signal, sys
from pathlib import Path
from leafcut.files.whole_files import write_all_or_none
folder = Path(sys.argv[1])
names = [folder / name for name in ("a.nc", "a.json", "a.html")]
found = []
for step in range(1, 100):
    for path in names:
        path.write_text("old")
    child = os.fork()
    if not child:
        left = step
        def killing(real):
            def call(*given, **more):
                global left
                left -= 1
                if not left:
                    os.kill(os.getpid(), signal.SIGKILL)
                return real(*given, **more)
            return call
        for name in ("fsync", "replace", "unlink", "link", "open", "chmod"):
            setattr(os, name, killing(getattr(os, name)))
        write_all_or_none({str(path): "new" for path in names})
        os._exit(0)
    _, status = os.waitpid(child, 0)
    found.append({path.name: path.read_text() for path in folder.iterdir() if not path.name.startswith(".")})
    if not status:
        break
print(json.dumps([found, sorted(path.name for path in folder.iterdir())]))
"""


def test_a_kill_at_any_step_leaves_no_report_beside_a_program_that_it_is_not_about(tmp_path: Path) -> None:
    """The program always exists, old or new; its companion files belong to the same run."""
    done = subprocess.run(
        [sys.executable, "-c", KILLED, str(tmp_path)], capture_output=True, text=True, check=True, timeout=300
    )
    found, left = json.loads(done.stdout)
    assert len(found) > 15  # each of the steps on the disk
    assert all("a.nc" in names and len(set(names.values())) == 1 for names in found)
    assert {names["a.nc"] for names in found[:-1]} == {"old", "new"}
    assert found[-1] == {"a.nc": "new", "a.json": "new", "a.html": "new"}
    assert left == ["a.html", "a.json", "a.nc"]  # the files left by killed runs are gone


@pytest.mark.parametrize("last", ["a.nc", "a.html"])
@pytest.mark.parametrize("old", [True, False])
def test_files_that_belong_together_are_all_written_or_none(
    old: bool, last: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If a file cannot be renamed, all keep their previous contents, and no temporary file remains."""
    report, program = tmp_path / "a.html", tmp_path / "a.nc"
    if old:
        report.write_text("old report", encoding="utf-8")
        program.write_text("old program", encoding="utf-8")
    replace = Path.replace

    def refused(self: Path, target: Path) -> Path:
        if Path(target).name == last and self.read_text(encoding="utf-8").startswith("new"):
            raise OSError(28, "No space left on device")
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", refused)
    with pytest.raises(OutputError, match="No space"):
        write_all_or_none({str(program): "new program", str(report): "new report"})
    found = {p.name: p.read_text(encoding="utf-8") for p in tmp_path.iterdir()}
    assert found == ({"a.html": "old report", "a.nc": "old program"} if old else {})


def test_files_that_belong_together_have_their_own_encodings(tmp_path: Path) -> None:
    """A program for an old controller, and its report."""
    report, program = tmp_path / "a.html", tmp_path / "a.nc"
    write_all_or_none({str(report): "Ø", str(program): "(Ø)"}, encodings={str(program): "latin-1"})
    assert (report.read_bytes(), program.read_bytes()) == ("Ø".encode(), b"(\xd8)")
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.skipif(os.name == "nt", reason="Windows has no permission bits")
@pytest.mark.parametrize("mask, mode", [(0o022, 0o644), (0o077, 0o600)])
def test_a_new_file_has_the_permissions_of_the_umask_and_a_replaced_file_keeps_its_own(
    tmp_path: Path, mask: int, mode: int
) -> None:
    kept = tmp_path / "kept.nc"
    kept.write_text("old", encoding="utf-8")
    kept.chmod(0o646)
    before = os.umask(mask)
    try:
        write_all_or_none({str(tmp_path / "new.nc"): "a", str(kept): "b"})
        during = os.umask(mask)
    finally:
        os.umask(before)
    assert during == mask
    assert [(tmp_path / name).stat().st_mode & 0o777 for name in ("new.nc", "kept.nc")] == [mode, 0o646]
    assert sorted(file.name for file in tmp_path.iterdir()) == ["kept.nc", "new.nc"]
