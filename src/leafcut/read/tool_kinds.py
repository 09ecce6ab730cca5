"""Recognise the kinds of tools in the libraries of other programs."""

from __future__ import annotations

import re
from typing import Any

#: Name of a preset (feeds and speeds for one material), and the values of a ``[[tool]]`` that uses the preset.
Preset = tuple[str, dict[str, Any]]
#: Name of a tool, and either its values or the reason why it is left out.
ToolRow = tuple[str, dict[str, Any] | str]
#: The same as `ToolRow`, but the tool may still have several presets.
RawRow = tuple[str, dict[str, Any] | str | list[Preset]]

#: Patterns for each kind of tool in a comment. The first match wins. A size or "HSS" alone means a drill, and flutes
#: mean a mill.
_IN_WORDS = (
    ("centre-drill", r"\b(centre|center|spot)[\s-]*drill|\bspot(ting)?\b"),
    ("reamer", r"\bream"),
    ("slot-mill", r"\bslot[\s-]*(mill|drill|cutter)|\brouter\b"),
    ("ball-mill", r"\bball\b"),
    ("end-mill", r"\bend[\s-]*mill|\bem\b|\bschaftfr(ä|ae)ser\b"),
    ("drill", r"\bdrill\b|\bbohrer\b|^[\W\d]*(mm|in|inch)?\s*hss[\W\d]*(mm|in|inch)?\W*$"),
    ("end-mill", r"\b[1-9]\s*-?(fl|flutes?)\b|\brough(er|ing)\b"),
)
#: Words for other kinds of tools, which exclude the patterns above.
_OTHER_WORDS = re.compile(
    r"\b(tap|bull|chamfer|v-?bit|vee|engrav|face|fly|thread|probe|dove|mill[\s-]*drill|c'?sink|csk|countersink|c'?bore"
    r"|counterbore|key|woodruff|t-?slot|lollipop|(corner\s*)?radius|taper|step|saw|slitting|form)(?!\s*drill)",
    re.IGNORECASE,
)
#: Patterns for tools with a cone, which need an angle.
_CONES = (
    ("chamfer-mill", r"\bchamfer|\bc'?sink|\bcsk\b|\bcountersink|\bmill[\s-]*drill"),
    ("v-bit", r"\bv-?bit|\bengrav"),
)
_TAP = re.compile(r"\btap\b", re.IGNORECASE)
#: Words that turn "tap" into a different tool: a tap drill, a thread mill, or a left-hand tap.
_NO_TAP = re.compile(r"drill|mill|\blh\b|\bleft\b", re.IGNORECASE)
#: Sizes of threads: M6, M6x1, and 1/4-20 or #10-32 with the threads per inch.
_METRIC = re.compile(r"\bM([0-9]{1,2}(?:\.[0-9])?)(?:\s*[x×*-]\s*([0-9]?\.?[0-9]{1,3}))?(?![\w./])", re.IGNORECASE)
_PER_INCH = re.compile(r"(?:[0-9]/[0-9]{1,2}|#[0-9]{1,2})\s*-\s*([1-9][0-9])\b")
#: Coarse pitches, mm, by nominal diameter. They apply to a thread without a stated pitch. Source: ISO 261, ISO 965-1.
_COARSE = {
    "1.6": 0.35, "2": 0.4, "2.5": 0.45, "3": 0.5, "4": 0.7, "5": 0.8, "6": 1.0, "8": 1.25, "10": 1.5, "12": 1.75,
    "14": 2.0, "16": 2.0, "18": 2.5, "20": 2.5, "22": 2.5, "24": 3.0,
}  # fmt: skip
#: If the angle of a chamfer mill or countersink is below this, degrees, it is probably the half angle.
SMALLEST_CHAMFER = 60
_ANGLE = re.compile(r"\b([1-9][0-9]{1,2})\s*(deg\b|degrees?\b|°)", re.IGNORECASE)
FUSION_KINDS = {
    "drill": "drill", "center drill": "centre-drill", "spot drill": "centre-drill", "reamer": "reamer",
    "flat end mill": "end-mill", "bull nose end mill": "end-mill", "ball end mill": "ball-mill",
    "chamfer mill": "chamfer-mill", "slot mill": "slot-mill", "tap right hand": "tap",
}  # fmt: skip


def tool_kind_in_comment(comment: str) -> str | None:
    """Return the kind of tool that a comment mentions, or None."""
    if _OTHER_WORDS.search(comment):
        return None
    return next((kind for kind, pattern in _IN_WORDS if re.search(pattern, comment, re.IGNORECASE)), None)


def tap_pitch_in_comment(comment: str) -> str | None:
    """Return the pitch of the right-hand tap that a comment mentions, as text.

    Return "" if the comment does not state the pitch, and None if the tool is not a right-hand tap.
    """
    if _TAP.search(comment) is None or _NO_TAP.search(comment):
        return None
    if per_inch := _PER_INCH.search(comment):
        return f"{25.4 / int(per_inch.group(1)):.6f} mm"
    metric = _METRIC.search(comment)
    pitch = None if metric is None else metric.group(2) or _COARSE.get(metric.group(1))
    return "" if pitch is None else f"{pitch} mm"


def cone_in_comment(comment: str) -> tuple[str, str] | None:
    """Return the kind of conical tool that a comment mentions, and its full angle as text.

    The angle is "" if the comment does not state it. A small angle of a chamfer mill is usually the half angle, so the
    function uses it only if the comment contains "included".
    """
    kind = next((kind for kind, pattern in _CONES if re.search(pattern, comment, re.IGNORECASE)), None)
    if kind is None:
        return None
    angle = _ANGLE.search(comment)
    one_side = angle is not None and kind == "chamfer-mill" and int(angle.group(1)) < SMALLEST_CHAMFER
    if angle is None or (one_side and "incl" not in comment.lower()):
        return kind, ""
    return kind, f"{angle.group(1)} deg"
