"""grblHAL and FluidNC in plain Python, where they differ from GRBL; their messages are copied from the sources.

grblHAL/core, report.c (`report_build_info`, `report_ngc_parameters`, `report_realtime_status`), protocol.c
(`protocol_enqueue_realtime_command`), grbl.h; bdring/FluidNC, Report.cpp, ProcessSettings.cpp, SettingsDefinitions.cpp,
Configuration/Generator.h.
"""

from __future__ import annotations

from typing import ClassVar

from fake_grbl import FakeGrbl

#: A configuration as FluidNC dumps it: homing of X ends at its lower end, of Y at its upper one.
CONFIGURATION = """board: 6 Pack
name: Small router
meta:
stepping:
  engine: I2S_STREAM
  idle_ms: 255
axes:
  shared_stepper_disable_pin: NO_PIN
  x:
    steps_per_mm: 400.000000
    max_rate_mm_per_min: 5000.000000
    acceleration_mm_per_sec2: 150.000000
    max_travel_mm: 200.000000
    soft_limits: true
    homing:
      cycle: 2
      positive_direction: false
      mpos_mm: 0.000000
  y:
    steps_per_mm: 400.000000
    max_rate_mm_per_min: 4000.000000
    acceleration_mm_per_sec2: 150.000000
    max_travel_mm: 200.000000
    soft_limits: true
    homing:
      cycle: 2
      positive_direction: true
      mpos_mm: 5.000000
  z:
    steps_per_mm: 800.000000
    max_rate_mm_per_min: 800.000000
    acceleration_mm_per_sec2: 25.000000
    max_travel_mm: 100.000000
    soft_limits: true
    homing:
      cycle: 1
      positive_direction: true
      mpos_mm: 0.000000
start:
  must_home: true
10V:
  output_pin: gpio.27
  spinup_ms: 2500
  speed_map: 0=0.000% 1000=0.000% 6000=25.000% 24000=100.000%
arc_tolerance_mm: 0.002000
junction_deviation_mm: 0.020000
"""


class FakeGrblHal(FakeGrbl):
    """A board with five axes whose ``?``, ``!`` and ``~`` are letters like others (``[NEWOPT:…,RT-``)."""

    greeting = "GrblHAL 1.1f ['$' or '$HELP' for help]"
    acts: ClassVar = {b"\x80": b"?", b"\x82": b"!", b"\x81": b"~", b"\x18": b"\x18", b"\x90": b"\x90", b"\x91": b"\x91"}

    def __init__(self, homed: int = 7) -> None:
        super().__init__((1,))
        self.homed, self.strict = homed, False
        self.origin, self.place = f"{self.origin},0.000,0.000", f"{self.place},0.000,0.000"

    def _answer(self, line: str) -> None:
        if line == "$I":
            for said in (
                "[VER:1.1f.20260801:]",
                "[OPT:VNMGZ,100,1024,5,0]",
                "[AXS:5:XYZAB]",
                "[NEWOPT:ENUMS,RT-,HOME,TC,SED]",
                "[FIRMWARE:grblHAL]",
                "[NVS STORAGE:*FLASH]",
                "[DRIVER:RP2040]",
                "[COMPATIBILITY LEVEL:0]",
            ):
                self.say(said.replace("Z,100", ",100"))
            self.say("ok")
        elif line == "$$":
            for number, value in self.settings.items():
                self.say(f"${number}={value}")
            for said in ("$73=1", "$74=", "$75=a word, and (one more)", "$76=********", "$305=N/A", "$341=0"):
                self.say(said)
            self.say("ok")
        elif line == "$#":
            for name in ("G54", "G55", "G59.3", "G28", "G30", "G92"):
                self.say(f"[{name}:{self.origin if name == 'G54' else '0.000,0.000,0.000,0.000,0.000'}]")
            self.say(f"[HOME:0.000,0.000,0.000,0.000,0.000:{self.homed}]")
            self.say("[TLO:0.000,0.000,0.000,0.000,0.000]")
            self.say("[PRB:0.000,0.000,0.000,0.000,0.000:0]")
            self.say("ok")
        elif "?" in line or "!" in line:
            self.say("error:1")
        else:
            super()._answer(line)

    def _take(self, line: str) -> None:
        if "?" in line or "!" in line:
            line = "$" + line
        super()._take(line)


class FakeFluidNc(FakeGrbl):
    """A board with FluidNC."""

    greeting = "Grbl 3.9 [FluidNC v3.9.1 (wifi) '$' for help]"

    def __init__(self, configuration: str = CONFIGURATION) -> None:
        super().__init__((1,))
        self.configuration = configuration
        self.settings = {10: 1, 13: 0, 20: 1, 21: 0, 22: 1, 23: 1, 32: 0, 110: 5000.0, 130: 200.0}
        self.origin, self.place = "50.000,-100.000,-50.000", "50.000,-100.000,-20.000"

    def _answer(self, line: str) -> None:
        if line == "$I":
            for said in ("[VER:3.9 FluidNC v3.9.1:]", "[OPT:PHS]", "[MSG: Machine: Small router]", "ok"):
                self.say(said)
        elif line == "$CD":
            for said in self.configuration.splitlines():
                self.say(said)
            self.say("ok")
        else:
            super()._answer(line)
