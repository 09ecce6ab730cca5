"""The command `send`: one-line refusals before any motion, and the keys of a terminal."""

from __future__ import annotations

import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import pytest

from leafcut.cli.app import run
from leafcut.cli.send import Keys

PROGRAM = "G21 G90 G94 G17\nG0 Z5\nM3 S900\nG0 X1 Y1\nG1 Z-1 F100\nG0 Z5\nM5\nM30\n"


@pytest.fixture
def part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "part.nc"
    file.write_text(PROGRAM, encoding="utf-8")
    return file


@pytest.mark.parametrize(
    "words, status, told",
    [
        ("part.nc --port nosuch", 2, "--port nosuch does not exist"),
        ("part.nc --port part.nc", 2, "--port part.nc: this is a file, not a serial port; "),
        ("part.nc --port .", 2, "--port .: this is a folder, not a serial port; "),
        ("part.nc --port /dev/null", 1, "--port /dev/null is not a serial port, or does not support this baud rate"),
        ("part.nc --port nosuch --baud 1152000", 2, "--baud 1152000: did you mean '115200'"),
        ("part.nc", 2, "send needs --port; "),
        ("missing.nc --port nosuch", 1, "missing.nc"),
        ("- --port nosuch", 2, "send -: name a file"),
        ("part.nc part.nc --port nosuch", 2, "send takes one program, not 2"),
        ("part.nc --port nosuch --from-hole 1 --from-line 2", 2, "both set the line to resume at"),
        ("part.nc --port nosuch --check --dry-run", 2, "--check and --dry-run exclude each other"),
        ("part.nc --port nosuch --accept L9", 2, "--accept: 'L9' is not an issue code"),
        ("part.nc --port nosuch --log part.nc", 1, "part.nc"),
        ("part.nc --port nosuch --log no/such/folder", 1, "no/such"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    words: str, status: int, told: str, part: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["send", *words.split(), "--machine", "grbl-3018", "--yes"]) == status
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1 and told in err, err
    assert part.read_text() == PROGRAM


@pytest.mark.hazard
def test_nobody_starts_a_machine_without_saying_so(part: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["send", "part.nc", "--port", "nosuch", "--machine", "grbl-3018"]) == 2
    assert "use a terminal, or add --yes" in capsys.readouterr().err


def test_a_program_for_another_kind_of_machine_is_refused(part: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["send", "part.nc", "--port", "nosuch", "--machine", "haas-vf2", "--yes"]) == 2
    assert re.search("its controller is haas; leafcut sends only to GRBL and Marlin boards", capsys.readouterr().err)


def test_keys_of_a_terminal_come_one_by_one_and_lines_whole() -> None:
    """In a process with a terminal of its own: two keys, a line in between, one key."""
    code = (
        "import sys, threading\n"
        "from leafcut.cli.send import Keys\n"
        "got, more = [], threading.Semaphore(0)\n"
        "keys = Keys(lambda key: (got.append(key), more.release()))\n"
        "with keys:\n"
        "    print('keys', flush=True)\n"
        "    more.acquire(); more.acquire()\n"
        "    with keys.line_input():\n"
        "        print('line', flush=True)\n"
        "        got.append(sys.stdin.readline())\n"
        "    print('key', flush=True)\n"
        "    more.acquire()\n"
        "print(got)\n"
    )
    ours, theirs = pty.openpty()
    try:
        done = subprocess.Popen([sys.executable, "-c", code], stdin=theirs, stdout=subprocess.PIPE, text=True)
        assert done.stdout is not None
        for word, typed in (("keys", b"!~"), ("line", b"G10 L20 P0 Z0\n"), ("key", b"q")):
            assert done.stdout.readline().strip() == word
            os.write(ours, typed)
        assert done.stdout.readline().strip() == str(["!", "~", "G10 L20 P0 Z0\n", "q"])
        assert done.wait() == 0
        done.stdout.close()
    finally:
        os.close(ours)
        os.close(theirs)


def test_where_there_is_no_terminal_no_keys_are_read() -> None:
    with Keys(pytest.fail) as keys:
        assert not keys.terminal
        with keys.line_input():
            pass
