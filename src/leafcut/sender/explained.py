"""The numbers of GRBL's errors and alarms in words.

Source: gnea/grbl 1.1, doc/csv/error_codes_en_US.csv and alarm_codes_en_US.csv, and report.h; from error 39 on
grblHAL/core, errors.h and alarms.h.
"""

from __future__ import annotations

_ERRORS = {
    1: "a word does not begin with a letter",
    2: "a number is missing or cannot be read",
    3: "a $ command is not understood",
    4: "a value is negative",
    5: "homing is off ($22)",
    6: "the step pulse must be longer than 3 µs",
    7: "its memory of settings could not be read, and was set back",
    8: "this command is taken only while the machine stands",
    9: "the machine is locked by an alarm",
    10: "soft limits need homing ($22)",
    11: "the line is too long",
    12: "the setting needs more steps in a second than the board can make",
    13: "the safety door is open",
    14: "the line is too long for its memory",
    15: "the jog goes beyond the machine's travel",
    16: "a jog has words that it may not have",
    17: "laser mode needs a spindle output of variable power",
    20: "the controller does not have this word",
    21: "two words of one group exclude each other",
    22: "a cut has no feed rate (F)",
    23: "a G or M word needs a whole number",
    24: "two words both need X, Y or Z",
    25: "a word is repeated",
    26: "a word needs X, Y or Z, and none is given",
    27: "the line number is out of range",
    28: "a word that is needed is missing (P or L)",
    29: "the controller has only the work offsets G54 to G59",
    30: "G53 is used with another word than G0 or G1",
    31: "X, Y or Z is given, and no word uses it",
    32: "an arc has no end in its plane",
    33: "the end of a move cannot be reached (an arc or a probe)",
    34: "the radius of an arc does not fit its ends",
    35: "an arc has no centre in its plane (I, J, K)",
    36: "words are left over that nothing uses",
    37: "a tool length is given on another axis than Z",
    38: "the number of a tool is too large",
    39: "a value is out of range",
    40: "the tool change is not finished",
    41: "the spindle does not turn",
    45: "homing is needed first",
    46: "homing is needed first",
    79: "the emergency stop is pressed",
}

_ALARMS = {
    1: "a limit switch was reached: the machine stood still at once, and its position is lost; home it",
    2: "a move would leave the machine's travel (soft limits, $20)",
    3: "it was reset while it moved: steps are lost, and so is its position; home it",
    4: "the probe was already closed before the probing began",
    5: "the probe touched nothing",
    6: "homing was ended by a reset",
    7: "homing was ended by the safety door",
    8: "homing did not get free of the limit switch; look at the switches and at $27",
    9: "homing did not find the limit switch within its travel",
    10: "the emergency stop is pressed",
    11: "homing is needed first",
    12: "a limit switch is pressed; free it first",
    14: "the spindle does not turn as it was told",
    17: "a motor reports a fault",
}

_STATES = {
    "Idle": "standing still",
    "Run": "moving",
    "Hold": "on hold",
    "Jog": "jogging",
    "Home": "homing",
    "Alarm": "locked by an alarm",
    "Check": "in check mode",
    "Door": "stopped by its safety door",
    "Sleep": "asleep",
    "Tool": "waiting for a tool change",
}


def error_in_words(code: int) -> str:
    """Return what an error means: ``error 20: the controller does not have this word``."""
    return f"error {code}: {_ERRORS.get(code, 'not in the list of GRBL; see the manual of your controller')}"


def alarm_in_words(code: int) -> str:
    """Return what an alarm means, and what to do."""
    return f"alarm {code}: {_ALARMS.get(code, 'not in the list of GRBL; see the manual of your controller')}"


def state_in_words(state: str) -> str:
    """Return what a machine in this state does."""
    return _STATES.get(state, f"in the state '{state}'")
