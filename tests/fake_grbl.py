"""A GRBL board in plain Python with a simulated clock, for protocol rules and behaviour that no real board shows."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Iterator
from typing import ClassVar

from leafcut.sender.port import PortLost

#: Bytes of its buffer.
BUFFER = 128


class FakeGrbl:
    """The port to it. Each read lets time pass; now and then a line is taken out of the buffer and answered.

    Its buffer may never hold more than `BUFFER` bytes: that is asserted at every write.

    Attributes
    ----------
    paces
        How many reads pass before each line is taken, over and over.
    faults
        What happens instead of the answer to the line of that number, counted from 1 behind the questions: ``alarm``,
        ``reset``, ``garbage``, ``drop`` (no answer), ``twice``, ``silent`` (never again), ``lost`` (the cable).
    acts
        The bytes that act at once, and as which byte of GRBL.
    """

    acts: ClassVar = {one: one for one in (b"?", b"!", b"~", b"\x18")}

    greeting = "Grbl 1.1h ['$' for help]"

    def __init__(self, paces: tuple[int, ...] = (0,), faults: dict[int, str] | None = None) -> None:
        self.name = "fake"
        self.faults = faults or {}
        self.paces = self._over(paces)
        self.wait = 0
        self.now = 0.0
        self.buffer: deque[str] = deque()
        self.line = b""
        self.said = b""
        self.taken: list[str] = []
        #: Questions, settings and jogs.
        self.asked: list[str] = []
        self.realtime: list[bytes] = []
        self.state, self.shown = "Idle", ""
        #: The speed that is active; empty for a board without one.
        self.speed = " S0"
        self.most = 0
        self.override = 100
        self.silent = self.lost = False
        self.strict = True
        self.settings = {13: 0, 20: 1, 22: 1, 27: 1, 30: 1000, 32: 0, 130: 200, 131: 200, 132: 100}
        self.settings |= {11: 0.01, 100: 80, 101: 80, 102: 80, 110: 800, 111: 800, 112: 800}
        self.settings |= {120: 10, 121: 10, 122: 10}
        self.origin = "-100.000,-100.000,-50.000"
        self.place = "-100.000,-100.000,-20.000"
        #: The places of G28 and G30, in machine coordinates.
        self.stored = {"G28": "0.000,0.000,0.000", "G30": "0.000,0.000,0.000"}

    @staticmethod
    def _over(paces: tuple[int, ...]) -> Iterator[int]:
        while True:
            yield from paces

    def clock(self) -> float:
        """Return the board's time, s; each call advances it."""
        return self.now

    def close(self) -> None:
        """Do nothing: no resource is open."""

    def say(self, line: str) -> None:
        self.said += line.encode("latin-1") + b"\r\n"

    def write(self, data: bytes) -> None:
        if self.lost:
            raise PortLost("the connection to fake is lost")
        for byte in data:
            one = bytes([byte])
            if one in self.acts or byte >= 0x80:
                self._act(one)
                continue
            self.line += one
            if one == b"\n":
                self.buffer.append(self.line.decode("ascii").rstrip("\n"))
                self.line = b""
        held = sum(len(line) + 1 for line in self.buffer) + len(self.line)
        self.most = max(self.most, held)
        assert held <= BUFFER or not self.strict, f"{held} bytes in a buffer of {BUFFER}"

    def read(self, seconds: float) -> bytes:
        if self.lost:
            raise PortLost("the connection to fake is lost")
        self.now += max(seconds, 0.001)
        if self.buffer and self.state != "Hold":
            if self.wait <= 0:
                self._take(self.buffer.popleft())
                self.wait = next(self.paces)
            else:
                self.wait -= 1
        said, self.said = (b"", b"") if self.silent else (self.said, b"")
        return said

    def _act(self, byte: bytes) -> None:
        if self.acts.get(byte) != b"?":
            self.realtime.append(byte)
        byte = self.acts.get(byte, byte)
        if byte == b"?":
            free = BUFFER - sum(len(line) + 1 for line in self.buffer)
            state = {"Hold": "Hold:0"}.get(self.state, "Run" if self.buffer and self.state == "Idle" else self.state)
            state = self.shown or state
            self.say(f"<{state}|MPos:{self.place}|Bf:15,{free}|FS:0,0|WCO:{self.origin}|Ov:{self.override},100,100>")
        elif byte == b"!":
            self.state = "Hold" if self.state in ("Idle", "Hold") else self.state
        elif byte == b"~":
            self.state = "Idle" if self.state == "Hold" else self.state
        elif byte == b"\x18":
            self._reset()
        elif byte == b"\x91":
            self.override = min(200, self.override + 10)
        elif byte == b"\x90":
            self.override = 100

    def _reset(self) -> None:
        self.buffer.clear()
        self.line = b""
        self.state = "Idle" if self.state != "Alarm" else "Alarm"
        self.say("")
        self.say(self.greeting)

    def _take(self, line: str) -> None:
        if line == "" or line.startswith("$"):
            self.asked.append(line)
            self._answer(line)
            return
        self.taken.append(line)
        fault = self.faults.get(len(self.taken), "")
        if fault == "alarm":
            self.state = "Alarm"
            self.say("ALARM:1")
        elif fault == "reset":
            self._reset()
        elif fault == "garbage":
            self.say("o\xffk\x00\x81")
        elif fault == "twice":
            self.say("ok")
            self.say("ok")
        elif fault == "silent":
            self.silent = True
        elif fault == "lost":
            self.lost = True
        elif fault.startswith("error"):
            self.say(fault)
        elif fault != "drop":
            self.say("ok")

    def _answer(self, line: str) -> None:
        if line == "$I":
            self.say("[VER:1.1h.20190830:]")
            self.say("[OPT:V,15,128]")
        elif line == "$$":
            for number, value in self.settings.items():
                self.say(f"${number}={value}")
        elif line == "$#":
            self.say(f"[G54:{self.origin}]")
            for name, place in self.stored.items():
                self.say(f"[{name}:{place}]")
            self.say("[G92:0.000,0.000,0.000]")
            self.say("[TLO:0.000]")
        elif line == "$G":
            self.say(f"[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0{self.speed}]")
        elif line == "$C":
            self.state = "Check"
        elif re.match(r"\$\d+=", line):
            number, value = line[1:].split("=")
            self.settings[int(number)] = float(value)
        self.say("ok")
