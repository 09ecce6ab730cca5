"""The meanings of GRBL's error and alarm numbers.

Source: gnea/grbl 1.1, doc/csv/error_codes_en_US.csv and alarm_codes_en_US.csv, and report.h. Numbers that grblHAL
and FluidNC add or redefine: grblHAL/core, errors.h and alarms.h; bdring/FluidNC, Error.h, Error.cpp and ExecAlarm of
Protocol.h.
"""

from __future__ import annotations

from leafcut.message import Message
from leafcut.sender.answers import Status

_ERRORS = {
    1: Message("a word does not start with a letter"),
    2: Message("a number is missing or cannot be read"),
    3: Message("a $ command is not understood"),
    4: Message("a value is negative"),
    5: Message("homing is off ($22)"),
    6: Message("the step pulse must be longer than 3 µs"),
    7: Message("the stored settings could not be read and were reset to the defaults"),
    8: Message("this command is accepted only while the machine is idle"),
    9: Message("the machine is locked by an alarm"),
    10: Message("soft limits need homing ($22)"),
    11: Message("the line is too long"),
    12: Message("the setting exceeds the maximum step rate of the board"),
    13: Message("the safety door is open"),
    14: Message("the line is too long for the controller's memory"),
    15: Message("the jog goes beyond the machine's travel"),
    16: Message("a jog has invalid words"),
    17: Message("laser mode needs a spindle output of variable power"),
    20: Message("the controller does not support this word"),
    21: Message("two words of the same modal group are in one block"),
    22: Message("a cut has no feed rate (F)"),
    23: Message("a G or M word needs a whole number"),
    24: Message("two commands in one block need X, Y or Z"),
    25: Message("a word is repeated"),
    26: Message("a command needs X, Y or Z"),
    27: Message("the line number is out of range"),
    28: Message("a required word is missing (P or L)"),
    29: Message("the controller has only the work offsets G54 to G59"),
    30: Message("G53 is used with another word than G0 or G1"),
    31: Message("X, Y or Z is given, but no command uses it"),
    32: Message("an arc has no end point in its plane"),
    33: Message("the end of a move cannot be reached (an arc or a probe)"),
    34: Message("the radius of an arc does not fit its ends"),
    35: Message("an arc has no centre in its plane (I, J, K)"),
    36: Message("the line contains unused words"),
    37: Message("a tool length offset on an axis other than Z"),
    38: Message("the number of a tool is too large"),
}

_ALARMS = {
    1: Message("a limit switch was reached: the machine stopped at once and lost its position; home it"),
    2: Message("a move would leave the machine's travel (soft limits, $20)"),
    3: Message("reset during a move: steps and position are lost; home it"),
    4: Message("the probe was closed before probing"),
    5: Message("the probe made no contact"),
    6: Message("homing was interrupted by a reset"),
    7: Message("homing was interrupted by the safety door"),
    8: Message("homing could not release the limit switch; check the switches and $27"),
    9: Message("homing did not find the limit switch within its travel"),
}

_ERRORS_OF = {
    "grblHAL": {
        18: Message("the controller was reset"),
        19: Message("a value must be above zero"),
        39: Message("a value is out of range"),
        40: Message("the tool change is not finished"),
        41: Message("the spindle does not turn"),
        42: Message("this plane may not be used here"),
        43: Message("the feed exceeds the machine's maximum"),
        44: Message("the spindle speed is out of range"),
        45: Message("a limit switch is pressed"),
        46: Message("homing is needed first"),
        47: Message("the wrong tool is mounted"),
        48: Message("two values contradict each other"),
        49: Message("the self-test of the controller failed"),
        50: Message("the emergency stop is pressed"),
        51: Message("a motor reports a fault"),
        52: Message("the value of a setting is out of range"),
        53: Message("the setting is off, or the board does not have it"),
        54: Message("the retract height is invalid"),
        55: Message("the homing settings are invalid"),
        56: Message("this work offset is locked"),
        57: Message("a % in the wrong place"),
        58: Message("the board has no such auxiliary input or output"),
        60: Message("the card cannot be used"),
        61: Message("a file cannot be read"),
        62: Message("a folder cannot be opened"),
        63: Message("the folder does not exist"),
        64: Message("no card is in use"),
        65: Message("no file system is in use"),
        66: Message("the file system is read-only"),
        70: Message("Bluetooth does not start"),
        71: Message("an expression has an unknown operator"),
        72: Message("an expression divides by zero"),
        73: Message("a value in an expression is out of range"),
        74: Message("a value in an expression cannot be used"),
        75: Message("an expression cannot be read"),
        76: Message("the result of an expression cannot be used"),
        77: Message("log in first"),
        78: Message("access is denied"),
        79: Message("not accepted during a critical event, such as an emergency stop"),
        80: Message("flow control works only inside a macro"),
        81: Message("flow control cannot be read"),
        82: Message("flow control is nested too deep"),
        83: Message("not enough memory for flow control"),
        84: Message("a file cannot be opened"),
        253: Message("the program itself raised an error"),
    },
    "FluidNC": {
        5: Message("the setting is off"),
        18: Message("no homing cycle is configured"),
        19: Message("single axes may not be homed"),
        38: Message("a value is too large"),
        39: Message("the value of P is too large"),
        40: Message("a control input is on"),
        60: Message("the card or the flash memory cannot be used"),
        61: Message("a file cannot be read"),
        62: Message("a folder cannot be opened"),
        63: Message("the folder does not exist"),
        64: Message("the file is empty"),
        65: Message("the file does not exist"),
        66: Message("a file cannot be opened"),
        67: Message("the file system is busy"),
        68: Message("a folder cannot be deleted"),
        69: Message("a file cannot be deleted"),
        70: Message("a file cannot be renamed"),
        80: Message("the value of a setting is out of range"),
        81: Message("a setting has an invalid value"),
        82: Message("a file cannot be created"),
        83: Message("the file system cannot be formatted"),
        90: Message("a message could not be sent"),
        100: Message("a setting could not be stored"),
        101: Message("the settings storage of the controller does not respond"),
        110: Message("the password is wrong, or missing"),
        111: Message("the line is incomplete"),
        112: Message("the file ended"),
        113: Message("the controller was reset"),
        114: Message("there is no data"),
        120: Message("another connection is in use"),
        130: Message("the jog was cancelled"),
        150: Message("a pin in the configuration is invalid"),
        151: Message("a value in the configuration is invalid"),
        152: Message("the configuration of the controller is invalid: see its messages at start-up"),
        160: Message("a file could not be sent to the controller"),
        161: Message("a file could not be downloaded from the controller"),
        162: Message("the setting is read-only"),
        170: Message("an expression divides by zero"),
        171: Message("a value in an expression cannot be used"),
        172: Message("the result of an expression cannot be used"),
        173: Message("an expression has an unknown operator"),
        174: Message("a value in an expression is out of range"),
        175: Message("an expression cannot be read"),
        176: Message("flow control cannot be read"),
        177: Message("flow control works only inside a macro"),
        178: Message("not enough memory for flow control"),
        179: Message("flow control is nested too deep"),
    },
}

_ALARMS_OF = {
    "grblHAL": {
        10: Message("the emergency stop is pressed"),
        11: Message("homing is needed first"),
        12: Message("a limit switch is pressed; release it first"),
        13: Message("the protected probe was triggered"),
        14: Message("the spindle does not follow its command"),
        15: Message("homing did not find the second limit switch of an auto-squared axis"),
        16: Message("the self-test of the controller failed"),
        17: Message("a motor reports a fault"),
        18: Message("homing failed"),
    },
    "FluidNC": {
        10: Message("the spindle does not follow its command"),
        11: Message("a control or limit input was on when the controller started"),
        12: Message("limit switches at both ends are pressed, or the pressed switch is unknown"),
        13: Message("the machine was stopped abruptly: its position is lost; home it"),
        14: Message("homing is needed first"),
        15: Message("the controller has just started up"),
    },
}

_STATES = {
    "Idle": Message("standing still"),
    "Run": Message("moving"),
    "Hold": Message("on hold"),
    "Jog": Message("jogging"),
    "Home": Message("homing"),
    "Alarm": Message("locked by an alarm"),
    "Check": Message("in check mode"),
    "Door": Message("stopped by its safety door"),
    "Sleep": Message("asleep"),
    "Tool": Message("waiting for a tool change"),
    "Stopped": Message("stopped without deceleration, and may have lost steps"),
    # FluidNC, Types.h: `State`. Most versions report Alarm instead of these two.
    "ConfigAlarm": Message("locked, as its configuration is invalid: see its messages at start-up"),
    "Critical": Message("locked by a critical event: check its switches, and reset it"),
}


def firmware_family(text: str) -> str:
    """Return ``grblHAL`` or ``FluidNC`` if the text mentions one of them, otherwise an empty string.

    The text is a greeting, or the answer to ``$I``.
    """
    return next((name for name in _ERRORS_OF if name.lower() in text.lower()), "")


def error_in_words(code: int, family: str = "") -> Message:
    """Return an error number with an explanation, such as ``error 20: the controller does not support this word``.

    `family` is ``grblHAL`` or ``FluidNC``. It is empty for plain GRBL.
    """
    return Message("error {}: {}", code, _code_meaning(code, _ERRORS_OF.get(family, {}), _ERRORS, family))


def alarm_in_words(code: int, family: str = "") -> Message:
    """Return an alarm number, with an explanation and a remedy. An empty `family` means plain GRBL."""
    return Message("alarm {}: {}", code, _code_meaning(code, _ALARMS_OF.get(family, {}), _ALARMS, family))


def _code_meaning(code: int, by_family: dict[int, Message], common: dict[int, Message], family: str) -> str:
    unknown = Message("unknown to {}; see the manual of your controller", family or "GRBL")
    return by_family.get(code, common.get(code, unknown))


def state_in_words(status: Status, family: str = "") -> str:
    """Return the state of the machine in words.

    If the status contains an alarm number (grblHAL), the alarm is explained.
    """
    words = _STATES.get(status.state, Message("in the state '{}'", status.state))
    if status.state == "Alarm" and status.detail:
        return Message("{} ({})", words, alarm_in_words(status.detail, family))
    return words
