"""Active comments and settings of the controller, line by line, with values worked by hand."""

from __future__ import annotations

import pytest

from leafcut.gcode.active_comments import (
    active_or_displayed_comments,
    controller_settings,
    is_active_comment,
    may_stop_program,
    select_active_comments,
)
from leafcut.gcode.dialects import load_dialect

ACTIVE = (
    "debug, x", "PRINT,x", "log ,x", "logopen,a", "LogAppend\t,a", "py,1", "pyrun,1", "axis,hide", "preview,stop",
    "msg", "MSG, turn", "msg x", "logclose", "probeopen a", "PROBECLOSE", "pyreload", "{x", "abort, now", "ABORT ,x",
)  # fmt: skip
PASSIVE = (
    "debug", "print it", "logger, x", "my debug, x", "msgs", "msg_1", "msg2", "logclosed", "probeopened", "x{", "abort",
    "abort now", "aborted, x", "",
)  # fmt: skip


@pytest.mark.parametrize("comment", ACTIVE)
def test_a_comment_of_a_command_is_active(comment: str) -> None:
    assert is_active_comment(comment) is True
    assert may_stop_program(["note", comment]) is comment.lower().startswith("abort")


@pytest.mark.parametrize("comment", PASSIVE)
def test_a_remark_is_not_active(comment: str) -> None:
    assert is_active_comment(comment) is False
    assert not may_stop_program([comment])


def test_the_comments_from_the_first_active_one_on_are_shown() -> None:
    assert select_active_comments(["a", "msg", "b"]) == ["msg", "b"]
    assert select_active_comments(["a", "b"]) == [] == select_active_comments([])
    haas, linuxcnc = load_dialect("haas"), load_dialect("linuxcnc")
    for line, at_haas, elsewhere in (
        ("G0 X1 (a) (msg, b)", ["msg, b"], ["msg, b"]),
        ("#3000=1 (stop)", ["stop"], []),
        ("#3006 = 2 (ask)", ["ask"], []),
        ("M109 P1 (ask)", ["ask"], []),
        ("m0109 (ask)", ["ask"], []),
        ("M1090 (no)", [], []),
        ("M109.5 (no)", [], []),
        ("#3001=1 (no)", [], []),
        ("X1 ; print, x", ["print, x"], ["print, x"]),
        ("#3000=1", [], []),
    ):
        assert active_or_displayed_comments(line, haas) == at_haas
        assert active_or_displayed_comments(line, linuxcnc) == elsewhere


@pytest.mark.parametrize(
    ("line", "value"),
    [
        ("#<holes>=2", ("holes", 2.0)),
        ("#<Holes> = 2.0 (note)", ("holes", 2.0)),
        ("n10 #<oclength>=3;note", ("oclength", 3.0)),
        ("/N10#<oclength>=[1+2]", ("oclength", "[1+2]")),
        ("#<other>=2", None),
        ("x #<holes>=2", None),
        # A name with a space before the equals sign is another name.
        ("(O=0, ph=4.0, pd =2, ph=3)", ("comment", False, ("O", "0"), ("pd ", "2"), ("ph", 3.0))),
        ("(o=0, kw=1.50, nu=1.50)", ("comment", True, ("kw", 1.5), ("nu", "1.50"), ("o", "0"))),
        ("  N5 (o=0, kw=a)", ("comment", True, ("kw", "a"), ("o", "0"))),
        ("( o=0, kw=1)", ("comment", False, ("kw", 1.0), ("o", "0"))),
        (";qtplasmac filtered G", ("comment", True, ";qtplasmacfilteredg")),
        ("G0 X1 ;QtPlasmaC  filtered", ("comment", False, "g0x1;qtplasmacfiltered")),
        (";conversational block", ("comment", True, ";conversationalblock")),
        ("(a remark)", None),
        ("G0 X1", None),
    ],
)  # fmt: skip
def test_settings_of_a_line_have_equal_values_if_they_do_the_same(line: str, value: tuple[object, ...] | None) -> None:
    found = controller_settings(["G21", line], load_dialect("qtplasmac"))
    assert [tuple(setting) for setting in found] == ([] if value is None else [(2, value, line.strip())])
    assert controller_settings([line], load_dialect("grbl")) == ()


def test_a_setting_is_quoted_shortly_and_may_turn_cuts_into_pierces() -> None:
    words = load_dialect("qtplasmac")
    (long,) = controller_settings(["(o=0, " + "x" * 90 + ")"], words)
    assert long.text == "(o=0, " + "x" * 54
    for line, pierces in (("#<pierce-only>=1", True), ("#<pierce-only>=0", False), ("#<holes>=1", False)):
        (setting,) = controller_settings([line], words)
        assert setting.pierces_only is pierces
