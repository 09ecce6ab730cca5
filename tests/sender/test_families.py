"""One number means different things to GRBL, grblHAL and FluidNC: each is told by its own firmware's list."""

from __future__ import annotations

import pytest

from leafcut.errors import SendError
from leafcut.sender.answers import Greeting, parse
from leafcut.sender.conversation import Conversation
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


class Says:
    """A port at which a controller greets, and refuses whatever it is told."""

    name = "a port"

    def __init__(self, greeting: bytes) -> None:
        self.said = greeting

    def read(self, _seconds: float) -> bytes:
        said, self.said = self.said, b""
        return said

    def write(self, _data: bytes) -> None:
        self.said = b"error:39\r\n"


@pytest.mark.parametrize(
    "greeting, told",
    [
        (b"Grbl 3.7 [FluidNC v3.7.12 (wifi) '$' for help]\r\n", "the value of P is too large"),
        (b"GrblHAL 1.1f ['$' or '$HELP' for help]\r\n", "a value is out of range"),
    ],
)
def test_a_conversation_explains_by_the_firmware_that_greeted(greeting: bytes, told: str) -> None:
    talk = Conversation(Says(greeting))  # type: ignore[arg-type]  # as much of a port as this needs
    talk.listen()
    with pytest.raises(SendError, match=f"'G4 P1' was refused: error 39: {told}$"):
        talk.ask("G4 P1")
