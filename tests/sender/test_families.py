"""One number means different things to GRBL, grblHAL and FluidNC: each is told by its own firmware's list."""

from __future__ import annotations

import pytest

from leafcut.sender.answers import Greeting, parse
from leafcut.sender.explained import alarm_in_words, error_in_words, family_of


@pytest.mark.parametrize(
    "line, family",
    [
        ("Grbl 1.1h ['$' for help]", ""),
        ("GrblHAL 1.1f ['$' or '$HELP' for help]", "grblHAL"),
        ("[FIRMWARE:grblHAL]", "grblHAL"),
        ("Grbl 3.7 [FluidNC v3.7.12 (wifi) '$' for help]", "FluidNC"),
        ("[VER:3.7 FluidNC v3.7.12:]", "FluidNC"),
    ],
)
def test_the_firmware_is_told_by_its_greeting_or_its_version(line: str, family: str) -> None:
    assert family_of(line) == family
    assert isinstance(parse(line), Greeting) == line.startswith("Grbl")


def test_numbers_that_mean_different_things_are_told_by_the_firmware() -> None:
    """Status_LimitsEngaged is 45 and Status_EStop 50 (grblHAL errors.h); FsFileNotFound is 65 (FluidNC Error.h)."""
    assert "limit switch" in error_in_words(45, "grblHAL") and "emergency stop" in error_in_words(50, "grblHAL")
    assert error_in_words(65, "FluidNC") == "error 65: there is no such file"
    assert error_in_words(20, "FluidNC") == error_in_words(20)
    assert "not in the list of FluidNC" in error_in_words(45, "FluidNC")
    assert "not in the list of GRBL" in error_in_words(45)
    assert "emergency stop" in alarm_in_words(10, "grblHAL") and "spindle" in alarm_in_words(10, "FluidNC")
    assert "homing is needed" in alarm_in_words(14, "FluidNC") and "spindle" in alarm_in_words(14, "grblHAL")
