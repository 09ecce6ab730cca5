"""A serial port that is opened exclusively. All failures are reported in one line."""

from __future__ import annotations

import errno
import os
from types import ModuleType
from typing import Protocol

from leafcut.errors import OptionError, SendError, name_suggestion
from leafcut.message import Message

#: Default baud rate of GRBL (BAUD_RATE).
BAUD = 115_200
#: Accepted baud rates. Any other rate is considered a mistake.
BAUDS = (9600, 19200, 38400, 57600, 115200, 230400, 250000, 460800, 500000, 921600, 1000000, 2000000)
_LONGEST_READ = 4096
#: Time limit of a write, s.
_WRITE_SECONDS = 5.0


class PortLost(SendError):
    """The port was lost because the cable was unplugged or the machine was turned off."""


class Port(Protocol):
    """The methods that every port has."""

    name: str

    def read(self, seconds: float) -> bytes:
        """Wait up to `seconds` for the first byte, and return all bytes that have arrived.

        Raises `PortLost` if the port is lost.
        """

    def write(self, data: bytes) -> None:
        """Send bytes. Raises `PortLost` if the port is lost."""

    def close(self) -> None:
        """Close the port."""


class SerialPort:
    """A serial port of this computer."""

    def __init__(self, name: str, baud: int = BAUD) -> None:
        """Open the port.

        Raises
        ------
        OptionError
            The port does not exist or is a file or folder, or the baud rate is unusual.
        SendError
            The port is in use, or access is denied.
        """
        serial = _import_pyserial()
        if baud not in BAUDS:
            raise OptionError("--baud {}: {}", baud, name_suggestion(str(baud), [str(rate) for rate in BAUDS])[2:])
        self.name = name
        if os.name == "posix" and not os.path.exists(name):  # noqa: PTH110 - a device, and no path of ours
            raise OptionError("--port {} does not exist; {}", name, serial_ports_sentence())
        for is_kind, kind in ((os.path.isdir, "a folder"), (os.path.isfile, "a file")):
            if is_kind(name):
                raise OptionError("--port {}: this is {}, not a serial port; {}", name, kind, serial_ports_sentence())
        try:
            self._serial = serial.Serial(
                name, baud, timeout=0.0, write_timeout=_WRITE_SECONDS, exclusive=True if os.name == "posix" else None
            )
        except (serial.SerialException, OSError, ValueError) as problem:
            raise _port_error(name, problem) from None

    def read(self, seconds: float) -> bytes:
        """Wait up to `seconds` for the first byte, and return all bytes that have arrived.

        Raises `PortLost` if the port is lost.
        """
        import serial

        try:
            self._serial.timeout = seconds
            first: bytes = self._serial.read(1)
            waiting = self._serial.in_waiting if first else 0
            rest: bytes = self._serial.read(min(waiting, _LONGEST_READ)) if waiting else b""
        except (serial.SerialException, OSError, TypeError):
            raise PortLost("the connection to {} is lost", self.name) from None
        return first + rest

    def write(self, data: bytes) -> None:
        """Send bytes. Raises `PortLost` if the port is lost."""
        import serial

        try:
            self._serial.write(data)
        except (serial.SerialException, OSError, TypeError):
            raise PortLost("the connection to {} is lost", self.name) from None

    def close(self) -> None:
        """Close the port."""
        try:
            self._serial.close()
        except OSError:
            return


def _import_pyserial() -> ModuleType:
    try:
        import serial
    except ModuleNotFoundError:
        raise OptionError("serial ports need the package pyserial: pip install pyserial") from None
    return serial


def _port_error(name: str, problem: Exception) -> SendError:
    number = getattr(problem, "errno", None)
    text = str(problem)
    if number in (errno.EBUSY, errno.EWOULDBLOCK) or "exclusively lock" in text or "Access is denied" in text:
        return SendError("--port {} is in use by another program; close that program first", name)
    if number in (errno.EACCES, errno.EPERM):
        return SendError("--port {}: access was denied; on Linux, join the group 'dialout'", name)
    if number == errno.ENOENT or "FileNotFound" in text:
        return SendError("--port {} does not exist; {}", name, serial_ports_sentence())
    return SendError("--port {} is not a serial port, or does not support this baud rate", name)


def list_serial_ports() -> list[tuple[str, str]]:
    """Return the name and the description of each serial port of this computer."""
    _import_pyserial()
    from serial.tools.list_ports import comports

    return sorted((str(port.device), str(port.description)) for port in comports())


def serial_ports_sentence() -> Message:
    """List the serial ports in words, for the end of a message."""
    names = [name for name, _ in list_serial_ports()]
    return (
        Message("there are {}", ", ".join(names))
        if names
        else Message("no serial port was found; is the machine plugged in?")
    )
