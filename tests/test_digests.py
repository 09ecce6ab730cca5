"""A program shows whether anyone has changed it since leafcut wrote it."""

from __future__ import annotations

import pytest

import leafcut
from leafcut.files.digests import DIGEST_LINE, fill_in_digest, is_unchanged

PROGRAM = f"%\n(plate)\n({DIGEST_LINE})\nG21\nG0 X1\nM30\n%\n"


def test_a_signed_program_is_unchanged_and_signing_it_again_changes_nothing() -> None:
    text = fill_in_digest(PROGRAM)
    assert text != PROGRAM
    assert is_unchanged(text)
    assert fill_in_digest(text) == text


@pytest.mark.parametrize("old, new", [("X1", "X2"), ("M30\n", "M30\n(note)\n"), ("(plate)", "(Plate)")])
def test_any_edit_is_seen(old: str, new: str) -> None:
    assert not is_unchanged(fill_in_digest(PROGRAM).replace(old, new))


def test_a_program_without_a_digest_is_not_known() -> None:
    assert not is_unchanged("G21\nM30\n")
    assert fill_in_digest("G21\nM30\n") == "G21\nM30\n"


@pytest.mark.parametrize("machine", ["haas-vf2", "linuxcnc-mill", "heidenhain-tnc", "grbl-3018"])
def test_a_written_program_carries_its_digest(machine: str) -> None:
    outcome = leafcut.optimize("example:plate-8x8-10", process="drill", thickness=5, preset="fast", machine=machine)
    assert is_unchanged(outcome.text)


def test_a_reordered_program_carries_its_digest() -> None:
    outcome = leafcut.optimize("examples/cam_121.nc", preset="fast", machine="linuxcnc-mill")
    assert is_unchanged(outcome.text)
    assert outcome.text.count("leafcut digest") == 1
