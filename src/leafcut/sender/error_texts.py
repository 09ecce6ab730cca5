"""The meanings of GRBL's error and alarm numbers.

Source: gnea/grbl 1.1, doc/csv/error_codes_en_US.csv and alarm_codes_en_US.csv, and report.h. Numbers that grblHAL
and FluidNC add or redefine: grblHAL/core, errors.h and alarms.h; bdring/FluidNC, Error.h, Error.cpp and ExecAlarm of
Protocol.h.
"""

from __future__ import annotations

from leafcut.message import Message
from leafcut.sender.answers import Status

_ERRORS = {
    1: "a word does not start with a letter",
    2: "a number is missing or cannot be read",
    3: "a $ command is not understood",
    4: "a value is negative",
    5: "homing is off ($22)",
    6: "the step pulse must be longer than 3 µs",
    7: "its stored settings could not be read and were reset",
    8: "this command is accepted only while the machine is idle",
    9: "the machine is locked by an alarm",
    10: "soft limits need homing ($22)",
    11: "the line is too long",
    12: "the setting needs more steps in a second than the board can make",
    13: "the safety door is open",
    14: "the line is too long for its memory",
    15: "the jog goes beyond the machine's travel",
    16: "a jog has invalid words",
    17: "laser mode needs a spindle output of variable power",
    20: "the controller does not support this word",
    21: "two words of one group exclude each other",
    22: "a cut has no feed rate (F)",
    23: "a G or M word needs a whole number",
    24: "two words in a block need X, Y or Z",
    25: "a word is repeated",
    26: "a word needs X, Y or Z",
    27: "the line number is out of range",
    28: "a required word is missing (P or L)",
    29: "the controller has only the work offsets G54 to G59",
    30: "G53 is used with another word than G0 or G1",
    31: "X, Y or Z is given, but no word uses it",
    32: "an arc has no end point in its plane",
    33: "the end of a move cannot be reached (an arc or a probe)",
    34: "the radius of an arc does not fit its ends",
    35: "an arc has no centre in its plane (I, J, K)",
    36: "unused words remain in the line",
    37: "a tool length offset on an axis other than Z",
    38: "the number of a tool is too large",
}

_ALARMS = {
    1: "a limit switch was reached: the machine stopped at once and lost its position; home it",
    2: "a move would leave the machine's travel (soft limits, $20)",
    3: "reset during a move: steps and position are lost; home it",
    4: "the probe was closed before probing",
    5: "the probe made no contact",
    6: "homing was interrupted by a reset",
    7: "homing was interrupted by the safety door",
    8: "homing could not release the limit switch; check the switches and $27",
    9: "homing did not find the limit switch within its travel",
}

_ERRORS_OF = {
    "grblHAL": {
        18: "the controller was reset",
        19: "a value must be more than zero",
        39: "a value is out of range",
        40: "the tool change is not finished",
        41: "the spindle does not turn",
        42: "this plane may not be used here",
        43: "the feed exceeds the machine's maximum",
        44: "the spindle speed is out of range",
        45: "a limit switch is pressed",
        46: "homing is needed first",
        47: "the wrong tool is mounted",
        48: "two values contradict each other",
        49: "its self-test failed",
        50: "the emergency stop is pressed",
        51: "a motor reports a fault",
        52: "the value of a setting is out of range",
        53: "the setting is off, or the board does not have it",
        54: "the retract height is invalid",
        55: "the homing settings are invalid",
        56: "this work offset is locked",
        57: "a % in the wrong place",
        58: "the board has no such auxiliary input or output",
        60: "the card cannot be used",
        61: "a file cannot be read",
        62: "a folder cannot be opened",
        63: "the folder does not exist",
        64: "no card is in use",
        65: "no file system is in use",
        66: "the file system is read-only",
        70: "Bluetooth does not start",
        71: "an expression has an unknown operator",
        72: "an expression divides by zero",
        73: "a value in an expression is out of range",
        74: "a value in an expression cannot be used",
        75: "an expression cannot be read",
        76: "the result of an expression cannot be used",
        77: "log in first",
        78: "access is denied",
        79: "not accepted during a critical event, such as an emergency stop",
        80: "flow control works only inside a macro",
        81: "flow control cannot be read",
        82: "flow control is nested too deep",
        83: "flow control needs more memory than there is",
        84: "a file cannot be opened",
        253: "the program itself raised an error",
    },
    "FluidNC": {
        5: "the setting is off",
        18: "no homing cycle is configured",
        19: "single axes may not be homed",
        38: "a value is too large",
        39: "the value of P is too large",
        40: "a control input is on",
        60: "the card or the flash memory cannot be used",
        61: "a file cannot be read",
        62: "a folder cannot be opened",
        63: "the folder does not exist",
        64: "the file is empty",
        65: "the file does not exist",
        66: "a file cannot be opened",
        67: "the file system is busy",
        68: "a folder cannot be deleted",
        69: "a file cannot be deleted",
        70: "a file cannot be renamed",
        80: "the value of a setting is out of range",
        81: "the value of a setting cannot be used",
        82: "a file cannot be created",
        83: "the file system cannot be formatted",
        90: "a message could not be sent",
        100: "a setting could not be stored",
        101: "its settings storage does not respond",
        110: "the password is wrong, or missing",
        111: "the line is incomplete",
        112: "the file ended",
        113: "the controller was reset",
        114: "there is no data",
        120: "another connection is in use",
        130: "the jog was cancelled",
        150: "a pin of its configuration is invalid",
        151: "a value of its configuration is invalid",
        152: "its configuration is invalid: see its messages at start-up",
        160: "a file could not be sent to it",
        161: "a file could not be downloaded from it",
        162: "the setting is read-only",
        170: "an expression divides by zero",
        171: "a value in an expression cannot be used",
        172: "the result of an expression cannot be used",
        173: "an expression has an unknown operator",
        174: "a value in an expression is out of range",
        175: "an expression cannot be read",
        176: "flow control cannot be read",
        177: "flow control works only inside a macro",
        178: "flow control needs more memory than there is",
        179: "flow control is nested too deep",
    },
}

_ALARMS_OF = {
    "grblHAL": {
        10: "the emergency stop is pressed",
        11: "homing is needed first",
        12: "a limit switch is pressed; release it first",
        13: "the protected probe was triggered",
        14: "the spindle does not follow its command",
        15: "homing did not find the second limit switch of an auto-squared axis",
        16: "its self-test failed",
        17: "a motor reports a fault",
        18: "homing failed",
    },
    "FluidNC": {
        10: "the spindle does not follow its command",
        11: "a control or limit input was on when it started",
        12: "limit switches at both ends are pressed, or it is unclear which",
        13: "it was stopped abruptly: its position is lost; home it",
        14: "homing is needed first",
        15: "it has just started up",
    },
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
    "Stopped": "stopped without deceleration, and may have lost steps",
    # FluidNC, Types.h: `State`. Most versions report Alarm for both.
    "ConfigAlarm": "locked, as its configuration is invalid: see its messages at start-up",
    "Critical": "locked by a critical event: check its switches, and reset it",
}


def firmware_family(text: str) -> str:
    """Return ``grblHAL`` or ``FluidNC`` if a greeting or the answer to ``$I`` contains this name; otherwise ""."""
    return next((name for name in _ERRORS_OF if name.lower() in text.lower()), "")


def error_in_words(code: int, family: str = "") -> str:
    """Return an error number with its meaning: ``error 20: the controller does not support this word``.

    `family` is ``grblHAL``, ``FluidNC`` or empty for GRBL.
    """
    return Message("error {}: {}", code, _code_meaning(code, _ERRORS_OF.get(family, {}), _ERRORS, family))


def alarm_in_words(code: int, family: str = "") -> str:
    """Return an alarm number with its meaning and remedy. An empty `family` means GRBL."""
    return Message("alarm {}: {}", code, _code_meaning(code, _ALARMS_OF.get(family, {}), _ALARMS, family))


def _code_meaning(code: int, by_family: dict[int, str], common: dict[int, str], family: str) -> str:
    unknown = f"unknown to {family or 'GRBL'}; see the manual of your controller"
    return by_family.get(code, common.get(code, unknown))


def state_in_words(status: Status, family: str = "") -> str:
    """Return the state of a machine in words, with the alarm if the status contains its number (grblHAL)."""
    words = _STATES.get(status.state, Message("in the state '{}'", status.state))
    if status.state == "Alarm" and status.detail:
        return f"{words} ({alarm_in_words(status.detail, family)})"
    return words
