"""A Marlin board in plain Python, with a clock of its own: as far as its sources say what it does and prints.

MarlinFirmware/Marlin 2.1: gcode/queue.cpp (numbers, checksums, `Resend:` and the `ok` behind it, a queue of four,
commands that act before their turn), gcode/gcode.cpp (`busy:` every two seconds, unknown words are told and answered
with `ok`), module/planner.cpp (16 blocks, one kept free; a quick stop drops moves for a second), module/motion.cpp
(moves are cut off at soft end stops without a word), gcode/host/M115.cpp, M114.cpp, M113.cpp, gcode/control/M211.cpp,
M3-M5.cpp, gcode/lcd/M0_M1.cpp, MarlinCore.cpp (`start`, `kill`). It is no more than that: no real board was there.
"""

from __future__ import annotations

import math
import os
import re
import select
import threading
import time
import tty
from collections import deque
from contextlib import suppress
from dataclasses import dataclass

from leafcut.sender.port import PortLost

#: Commands of its queue; blocks of its planner that can be filled; characters of a line (MAX_CMD_SIZE).
QUEUE, BLOCKS, LONGEST = 4, 15, 95
#: Interval between two ``busy:``, s; time for which moves are dropped after a quick stop, s.
BUSY, DROPPED = 2.0, 1.0
SETTINGS = """echo:; Linear Units:
echo:  G21 ; (mm)
echo:; Steps per unit:
echo:  M92 X80.00 Y80.00 Z400.00
echo:; Max feedrates (units/s):
echo:  M203 X50.00 Y50.00 Z15.00
echo:; Max Acceleration (units/s2):
echo:  M201 X180.00 Y180.00 Z80.00
echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):
echo:  M204 P180.00 R180.00 T180.00
echo:; Advanced (B<min_segment_time_us> S<min_feedrate> T<min_travel_feedrate> J<junc_dev>):
echo:  M205 B20000.00 S0.00 T0.00 J0.05"""
FIRMWARE = (
    "FIRMWARE_NAME:Marlin 2.1.2.1 (Jan  2 2026 03:04:05) SOURCE_CODE_URL:github.com/MarlinFirmware/Marlin "
    "PROTOCOL_VERSION:1.0 MACHINE_TYPE:MPCNC EXTRUDER_COUNT:0 UUID:cede2a2f-41a2-4748-9b12-c55c62f367ff"
)


@dataclass
class Block:
    """A move that is planned: where it ends, and how long it takes, s."""

    end: list[float]
    seconds: float
    begin: list[float]
    done: float = 0.0


class FakeMarlin:
    """The port to it. Each read lets time pass.

    Attributes
    ----------
    faults
        What happens to the line of the program of that number, counted from 1 as they are first sent: ``noise`` (a
        byte comes wrong), ``split`` (a line end comes in the middle), ``dropped`` (it never comes), ``deaf`` (its
        answer is lost), ``slow`` (it says nothing for 4 s), ``reset``, ``kill``, ``error``, ``endstop``, ``silent``,
        ``lost`` (the cable), ``garbage``.
    taken
        What it obeyed, without numbers, in order; behind the questions, from ``M84 S0`` on.
    """

    def __init__(self, faults: dict[int, str] | None = None, *, keen: float = 20.0) -> None:
        self.name = "fake"
        self.faults = dict(faults or {})
        #: How many times faster than life it moves.
        self.keen = keen
        self.now = 0.0
        self.said = b""
        self.written = b""
        self.firmware, self.settings, self.keepalive = FIRMWARE, SETTINGS, "echo:M113 S2"
        self.abilities = "Cap:SERIAL_XON_XOFF:0\nCap:EEPROM:1\nCap:EMERGENCY_PARSER:0\nCap:ARCS:1"
        self.lacks = {"G17", "M9", "M8"}
        self.endstops: tuple[bool, list[float], list[float]] = (True, [0.0, 0.0, -30.0], [600.0, 600.0, 50.0])
        self.resend_ok = True
        #: Whether it sends ``wait`` when idle (NO_TIMEOUTS).
        self.waiting = False
        self.wait_at = 0.0
        self.silent = self.lost = self.killed = False
        self.spindle = 0.0
        self.percent = 100
        self.moves: list[list[float]] = []
        self._begin()
        self.place = [0.0, 0.0, 20.0]
        self.planned = list(self.place)
        self.taken: list[str] = []
        self.seen: set[int] = set()
        self.bad = 0

    def _begin(self) -> None:
        self.last, self.line = 0, b""
        self.queue: deque[str] = deque()
        self.blocks: deque[Block] = deque()
        self.doing: tuple[str, float] | None = None
        self.busy_at = self.now + BUSY
        self.dropping = -1.0
        self.place = [0.0, 0.0, 0.0]
        self.planned = list(self.place)
        self.spindle = 0.0
        self.waits = False

    def clock(self) -> float:
        """Return the board's time, s; each call advances it."""
        return self.now

    def close(self) -> None:
        """Do nothing: no resource is open."""

    def say(self, line: str) -> None:
        self.said += line.encode("latin-1") + b"\n"

    def start(self) -> None:
        """Start again, as after a reset."""
        self._begin()
        self.say("start")
        self.say("echo: External Reset")
        self.say("echo:Marlin 2.1.2.1")

    def write(self, data: bytes) -> None:
        if self.lost:
            raise PortLost("the connection to fake is lost")
        self.written += data
        if self.killed or self.silent:
            return
        for byte in data:
            if byte in b"\r\n":
                line, self.line = self.line, b""
                if line:
                    self._receive(line.decode("latin-1"))
            else:
                self.line += bytes([byte])

    def _receive(self, line: str) -> None:
        line = self._hurt(line)
        if self.killed or self.silent or self.lost:
            return
        if line.startswith("N"):
            number, wrong = re.match(r"N(-?\d+)", line), ""
            value = int(number[1]) if number else 0
            if "M110" in line:
                second = re.search(r"M110.*N(\d+)", line)
                value = int(second[1]) if second else value
            elif value != self.last + 1:
                wrong = f"Line Number is not Last Line Number+1, Last Line: {self.last}"
            body, star, check = line.rpartition("*")
            if not wrong and not star:
                wrong = f"No Checksum with line number, Last Line: {self.last}"
            elif not wrong and (not check.isdigit() or int(check) != xor(body)):
                wrong = f"checksum mismatch, Last Line: {self.last}"
            if wrong:
                self.bad += 1
                self.say(f"Error:{wrong}")
                self.say(f"Resend: {self.last + 1}")
                if self.resend_ok:
                    self.say("ok")
                return
            self.last = value
            line = body.partition(" ")[2]
        elif line == "M410":
            self._quickstop()
        elif line == "M112":
            self._kill()
            return
        elif line == "M108":
            self.waits = False
        assert len(self.queue) < QUEUE, "more lines than its queue holds"
        assert len(line) <= LONGEST
        self.queue.append(line)

    def _hurt(self, line: str) -> str:
        """Let happen what shall happen to a line of the program when it comes for the first time."""
        number = re.match(r"N(\d+)", line)
        if not number or not self.faults or "M84" not in "".join(self.taken) or int(number[1]) in self.seen:
            return line
        self.seen.add(int(number[1]))
        fault = self.faults.get(len(self.seen), "")
        if fault == "noise":
            return line[:5] + chr(ord(line[5]) ^ 4) + line[6:]
        if fault == "split":
            self._receive(line[:5])
            return line[5:] if line[5:].startswith("N") else "N" + line[5:]
        if fault == "dropped":
            return "M118"  # as if nothing had come: answered by nothing
        if fault == "reset":
            self.start()
            self.silent = False
            return ";"
        if fault == "kill":
            self._kill()
        if fault == "error":
            self.say("Error:G2/G3 bad parameters")
        if fault == "endstop":
            self.say("echo:endstops hit:  X:12.00")
        if fault == "garbage":
            self.say("o\xffk\x00")
        self.silent |= fault == "silent"
        self.lost |= fault == "lost"
        self.deaf = fault == "deaf"
        self.stalled = self.now + 4.0 if fault == "slow" else self.stalled
        return line

    deaf = False
    stalled = 0.0

    def _kill(self) -> None:
        self.blocks.clear()
        self.queue.clear()
        self.spindle = 0.0
        self.say("Error:Printer halted. kill() called!")
        self.killed = True

    def _quickstop(self) -> None:
        self.blocks.clear()
        self.planned = list(self.place)
        self.dropping = self.now + DROPPED

    def read(self, seconds: float) -> bytes:
        if self.lost:
            raise PortLost("the connection to fake is lost")
        self.now += max(seconds, 0.001)
        if not self.killed:
            self._run(max(seconds, 0.001) * self.keen)
        said, self.said = (b"", b"") if self.silent else (self.said, b"")
        return said

    def _run(self, seconds: float) -> None:
        self._move(seconds)
        if self.now < self.stalled:
            return
        for _ in range(QUEUE):
            if self.doing is None and self.queue:
                self.doing = (self.queue.popleft(), self.now)
                self.busy_at = self.now + BUSY
            if self.doing is None:
                if self.waiting and self.now >= self.wait_at:
                    self.say("wait")
                    self.wait_at = self.now + 1.0
                return
            if not self._done(*self.doing):
                if self.now >= self.busy_at:
                    self.say("echo:busy: paused for user" if self.waits else "echo:busy: processing")
                    self.busy_at = self.now + BUSY
                return
            self.doing = None
            if self.deaf:
                self.deaf = False
            else:
                self.say("ok")

    def _move(self, seconds: float) -> None:
        while self.blocks and seconds > 0.0:
            block = self.blocks[0]
            step = min(seconds, block.seconds - block.done)
            block.done += step
            seconds -= step
            share = 1.0 if block.seconds <= block.done else block.done / block.seconds
            self.place = [a + share * (b - a) for a, b in zip(block.begin, block.end, strict=True)]
            if block.done >= block.seconds:
                self.moves.append(list(block.end))
                self.blocks.popleft()

    def _done(self, line: str, since: float) -> bool:
        """Do a command, or go on doing it; return whether it is done."""
        if line.startswith(";") or line == "M118":
            self.doing = None
            return False
        word, *rest = line.split(" ")
        said = {one[0]: float(one[1:]) for one in rest if one[1:].replace(".", "").replace("-", "").isdigit()}
        if word in self.lacks or word not in self._WORDS:
            self.say(f'echo:Unknown command: "{line}"')
        elif word in ("G0", "G1", "G2", "G3"):
            if len(self.blocks) >= BLOCKS:
                return False
            self._plan(said)
        elif word in ("M400", "M3", "M4", "M5", "M0", "G4", "G28"):
            if self.blocks:
                return False
            if word == "G4" and (self.now - since) * self.keen < said.get("P", 0.0) / 1000.0 + said.get("S", 0.0):
                return False
            if word == "M0":
                self.waits = True
            self._set(word, said)
        elif word == "G92":
            self.place = [said.get(axis, old) for axis, old in zip("XYZ", self.place, strict=True)]
            self.planned = list(self.place)
        else:
            self._tell(word, said)
        if self.taken or word == "M84":
            self.taken.append(line)
        return True

    _WORDS = frozenset(
        [f"G{n}" for n in (0, 1, 2, 3, 4, 17, 21, 28, 90, 92)]
        + [f"M{n}" for n in (0, 3, 4, 5, 7, 8, 9, 84, 110, 113, 114, 115, 211, 220, 400, 410, 503, 999)]
    )

    def _set(self, word: str, said: dict[str, float]) -> None:
        if word in ("M3", "M4", "M5"):
            self.spindle = 0.0 if word == "M5" else said.get("S", 0.0)
        if word == "G28":
            self.place = [0.0, 0.0, 0.0]
            self.planned = list(self.place)

    def _plan(self, said: dict[str, float]) -> None:
        if self.now < self.dropping or not set("XYZ") & set(said):
            self.feed = said.get("F", self.feed)
            return
        self.feed = said.get("F", self.feed)
        end = [said.get(axis, old) for axis, old in zip("XYZ", self.planned, strict=True)]
        on, low, high = self.endstops
        if on:
            end = [min(max(one, a), b) for one, a, b in zip(end, low, high, strict=True)]
        length = math.dist(end, self.planned)
        seconds = max(length / (self.feed * self.percent / 6000.0), 0.02)
        self.blocks.append(Block(end, seconds, list(self.planned)))
        self.planned = end

    feed = 600.0

    def _tell(self, word: str, said: dict[str, float]) -> None:
        x, y, z = self.planned
        on, low, high = self.endstops
        ends = [" ".join(f"{a}{v:.2f}" for a, v in zip("XYZ", end, strict=True)) for end in (low, high)]
        for line in {
            "M115": f"{self.firmware}\n{self.abilities}",
            "M503": self.settings,
            "M113": self.keepalive,
            "M114": f"X:{x:.2f} Y:{y:.2f} Z:{z:.2f} Count X:{x * 80:.0f} Y:{y * 80:.0f} Z:{z * 400:.0f}",
            "M211": f"echo:Soft endstops: {'ON' if on else 'OFF'}  Min:  {ends[0]}   Max:  {ends[1]}",
        }.get(word, "").split("\n"):
            if line:
                self.say(line)
        if word == "M220" and "S" in said:
            self.percent = int(said["S"])


def xor(text: str) -> int:
    """Return the exclusive or of all characters."""
    value = 0
    for char in text:
        value ^= ord(char)
    return value


class MarlinOnACable:
    """The board behind a serial port of this computer, in the time of life; `port` is the name of the port."""

    def __init__(self, board: FakeMarlin) -> None:
        self.board = board
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        self.port = os.ttyname(self._theirs)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        before = time.monotonic()
        with suppress(OSError, PortLost):
            while not self._ended.is_set():
                ready, _, _ = select.select([self._ours], [], [], 0.002)
                if ready:
                    self.board.write(os.read(self._ours, 4096))
                now = time.monotonic()
                said = self.board.read(now - before)
                before = now
                if said:
                    os.write(self._ours, said)

    def close(self) -> None:
        """Take it away."""
        self._ended.set()
        self._thread.join()
        os.close(self._ours)
        os.close(self._theirs)
