"""`reorder --feeds`: limits by power, torque, slots and descents, and changes that a machine can follow."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from leafcut.cli import app as cli
from leafcut.errors import OptionError
from leafcut.material.cutting_force import DRIVE_EFFICIENCY
from leafcut.model.issue import Severity
from leafcut.model.pace_change import FeedLimit
from leafcut.processes.program.plan import pace as plan
from leafcut.processes.program.plan.pace import _limit_to_reachable
from leafcut.report.pace_words import pace_facts
from own_machines import machine_of_power, own_machine
from pace_programs import BLOCK, HEAD, TAIL, body, reordered

#: A slot, 6 wide and 2 deep; 600 mm/min at 6000 1/min are 0.05 mm a tooth.
SLOT = HEAD + "G0 X10 Y10\nG0 Z2\nG1 Z-2 F60\nG1 X60 F600\n" + TAIL
#: kc11 and mc of aluminium 6061, N/mm².
KC11, MC = 800.0, 0.25


def library(folder: Path, **values: str) -> Path:
    """Return a library with a single two-flute mill."""
    said = {"feed": '"600 mm/min"', "spindle_speed": '"6000 rpm"', "teeth": "2", **values}
    lines = "".join(f"{key} = {value}\n" for key, value in said.items() if value)
    file = folder / "tools.toml"
    file.write_text(f'[[tool]]\nnumber = 1\nkind = "end-mill"\ndiameter = "6 mm"\n{lines}')
    return file


def machine(folder: Path) -> str:
    """Return the profile of a mill whose spindle has 0.2 N·m."""
    return own_machine(folder, spindle={"torque": "0.2 N·m"})


def power_of(feed: float) -> float:
    """Return the power of the slot at a feed in mm/min, W: area × feed × kc, by the mean chip over half a turn."""
    tooth = feed / 6000 / 2
    angles = np.linspace(0.0, math.pi, 20_001)
    mean = float(np.mean(tooth * np.sin(angles)))
    return 6 * 2 * feed / 60 * KC11 * mean**-MC / 1000


def slot_feed(text: str) -> float:
    """Return the feed of the slot, mm/min."""
    found = re.search(r"G1 X60 F([0-9.]+)", text)
    assert found is not None, text
    return float(found[1])


@pytest.mark.hazard
@pytest.mark.parametrize("limit", [200.0, 80.0])
def test_a_cut_takes_no_more_power_than_the_spindle_gives(tmp_path: Path, limit: float) -> None:
    found = reordered(
        tmp_path,
        SLOT,
        feeds=True,
        workpiece=BLOCK,
        tools=library(tmp_path),
        material="aluminium-6061",
        machine=machine_of_power(tmp_path, f"{limit} W"),
        cell=0.1,
    )
    power = power_of(slot_feed(found.text)) / DRIVE_EFFICIENCY
    assert 0.95 * limit < power <= 1.01 * limit
    (tool,) = found.detail.pace.tools
    (told,) = [one for one in tool.limits if one.name == "power"]
    assert told.before == pytest.approx(power_of(600) / DRIVE_EFFICIENCY, rel=0.02)
    assert (told.after, told.limit) == (pytest.approx(power, rel=0.02), limit)


def test_a_cut_takes_no_more_torque_than_the_spindle_gives(tmp_path: Path) -> None:
    found = reordered(
        tmp_path,
        SLOT,
        feeds=True,
        workpiece=BLOCK,
        tools=library(tmp_path),
        material="aluminium-6061",
        machine=machine(tmp_path),
        cell=0.1,
    )
    torque = 1000 * power_of(slot_feed(found.text)) / (2 * math.pi * 6000 / 60)
    assert 0.95 * 200 < torque <= 1.01 * 200
    assert [one.name for one in found.detail.pace.tools[0].limits] == ["torque"]
    said = " ".join(fact.sentence for fact in pace_facts(found.detail.pace))
    assert re.search(r"; torque 0\.36[0-9] → 0\.2 N·m, at most 0\.2", said)


def test_the_machines_own_power_counts_where_no_other_is_given(tmp_path: Path) -> None:
    """The Haas has 22 kW: no slot of this mill comes near."""
    haas = {"machine": "haas-vf2", "material": "aluminium-6061", "tools": library(tmp_path)}
    text = re.sub(r"(?<=[XYZF])(-?[0-9]+)(?![0-9.])", r"\1.", SLOT)
    found = reordered(tmp_path, text, feeds=True, workpiece=BLOCK, **haas)
    limits = {one.name: one.limit for one in found.detail.pace.tools[0].limits}
    assert limits == {"power": pytest.approx(22371, rel=0.01), "torque": pytest.approx(122_000, rel=0.01)}
    assert "F600" in found.text


def test_a_mill_goes_down_no_faster_than_its_library_says(tmp_path: Path) -> None:
    """The move through the air above keeps its feed; a slower move is unchanged."""
    tools = library(tmp_path, plunge_feed='"100 mm/min"')
    for own, said in ((300, "G1 Z-2 F100.0"), (60, "G1 Z-2 F60")):
        text = SLOT.replace("Z-2 F60", f"Z-2 F{own}").replace("G0 Z2", "G0 Z5")
        found = reordered(tmp_path, text, feeds=True, workpiece=BLOCK, tools=tools)
        lines = body(found)
        assert said in lines
        assert ("G1 Z1.0 F300.0" in lines or "G1 Z1.0 F300" in lines) == (own == 300), lines
        assert [one for one in found.detail.pace.tools[0].limits if one.name == "plunge"] == [
            FeedLimit("plunge", pytest.approx(own / 60), pytest.approx(min(own, 100) / 60), pytest.approx(100 / 60))
        ]


def test_a_plunge_keeps_its_limit_where_its_way_through_the_air_is_no_faster_as_a_rapid(tmp_path: Path) -> None:
    """At 6000 mm/min the rapid from 5 to 1 saves next to nothing; the way below it is slower all the same."""
    tools = library(tmp_path, plunge_feed='"100 mm/min"')
    for own in (600, 6000):
        text = SLOT.replace("Z-2 F60", f"Z-2 F{own}").replace("G0 Z2", "G0 Z5")
        found = reordered(tmp_path, text, feeds=True, air=True, workpiece=BLOCK, tools=tools)
        assert "G1 Z-2 F100.0" in body(found)
        (plunge,) = [one for one in found.detail.pace.tools[0].limits if one.name == "plunge"]
        assert plunge.after == pytest.approx(100 / 60)


def test_a_cut_whose_line_cannot_be_changed_and_is_above_a_limit_is_told(tmp_path: Path) -> None:
    """In inverse time (G93) the number behind F is no feed."""
    text = SLOT.replace("G1 X60 F600", "G93\nG1 X60 F12\nG94\nG1 X10 F600")
    found = reordered(tmp_path, text, feeds=True, workpiece=BLOCK, tools=library(tmp_path, feed='"450 mm/min"'))
    assert "G1 X60 F12" in body(found)
    said = [issue.message for issue in found.issues if issue.code == "L512"]
    assert said == ["T1 end-mill Ø6 stays above its limit (chip) in cuts whose lines cannot be changed"]


#: Down by 2 over 20 mm, then back on the level.
RAMP = HEAD + "G0 X10 Y10\nG0 Z0.5\nG1 Z0 F60\nG1 X30 Z-2 F300\nG1 X10\n" + TAIL


@pytest.mark.parametrize(("plunge", "most"), [(None, 300.0), (33.0, 332.0), (20.0, 201.0), (100.0, 450.0)])
def test_a_ramp_goes_down_as_fast_as_the_library_says_and_with_a_slots_chip(
    tmp_path: Path, plunge: float | None, most: float
) -> None:
    """300 along the ramp are 29.9 downwards. Unknown, it keeps its feed; known, it rises by half at most."""
    tools = library(tmp_path, **({} if plunge is None else {"plunge_feed": f'"{plunge} mm/min"'}))
    found = reordered(tmp_path, RAMP, feeds=True, workpiece=BLOCK, tools=tools)
    ramp = [line for line in body(found) if " Z-" in line and line.startswith("G1 X") and "F" in line]
    feeds = [float(word) for line in ramp for word in re.findall(r"F([0-9.]+)", line)]
    assert 0.9 * most < max(feeds) <= most, body(found)


def test_a_ramps_chip_is_no_thicker_than_in_a_slot(tmp_path: Path) -> None:
    """Of 330 mm/min at 6000 1/min: 450 would be too thick."""
    tools = library(tmp_path, plunge_feed='"100 mm/min"', feed='"330 mm/min"')
    found = reordered(tmp_path, RAMP, feeds=True, workpiece=BLOCK, tools=tools)
    ramp = [float(word) for word in re.findall(r"Z-[0-9.]+ F([0-9.]+)", found.text)]
    assert 300 < max(ramp) <= 330


def ramp_power_of(feed: float, depth: float) -> float:
    """Return the power of the ramp at a depth and a feed in mm/min, W: a slot at its side, and the whole of its end.

    It falls by 1 in 10. The side takes off width × depth × feed along the table, the end its area × feed downwards.
    """
    along, down = feed / 60 * 10 / math.sqrt(101), feed / 60 / math.sqrt(101)
    side = 6 * depth * along * KC11 * (2 / math.pi * along / 200) ** -MC
    return (side + 9 * math.pi * down * KC11 * (down / 200) ** -MC) / 1000


@pytest.mark.parametrize("text", [RAMP, RAMP.replace("G1 X10\n", "")], ids=["and a level", "alone"])
@pytest.mark.parametrize("limit", [200.0, 120.0])
def test_a_ramp_takes_no_more_power_than_the_spindle_gives(tmp_path: Path, text: str, limit: float) -> None:
    """Its last piece of 3 mm is cut 1.85 deep in the middle; before it, less. At its own feed it takes 294 W."""
    assert ramp_power_of(600, 1.85) == pytest.approx(294, abs=1)
    found = reordered(
        tmp_path,
        text.replace("F300", "F600"),
        feeds=True,
        workpiece=BLOCK,
        tools=library(tmp_path),
        cell=0.1,
        material="aluminium-6061",
        machine=machine_of_power(tmp_path, f"{limit / DRIVE_EFFICIENCY} W"),
    )
    feeds = [float(word) for word in re.findall(r"Z-[0-9.]+ F([0-9.]+)", found.text)]
    power = ramp_power_of(feeds[-1], 1.85)
    assert 0.93 * limit < power <= 1.01 * limit, body(found)
    (told,) = [one for one in found.detail.pace.tools[0].limits if one.name == "power"]
    assert told.after <= limit / DRIVE_EFFICIENCY * 1.001


#: Straight down by 4 into the full, then along.
PLUNGE = HEAD + "G0 X10 Y10\nG0 Z2\nG1 Z-4 F300\nG1 X60 F60\n" + TAIL


def plunge_power_of(feed: float) -> float:
    """Return the power of the whole end of the tool, W, at a feed in mm/min, by the descent per tooth."""
    return 9 * math.pi * feed / 60 * KC11 * (feed / 60 / 200) ** -MC / 1000


@pytest.mark.parametrize("text", [PLUNGE, PLUNGE.replace("G1 X60 F60\n", "")], ids=["and a slot", "alone"])
@pytest.mark.parametrize("limit", [200.0, 120.0])
def test_straight_down_a_mill_takes_no_more_power_than_the_spindle_gives(
    tmp_path: Path, text: str, limit: float
) -> None:
    """At 300 mm/min the end takes 284 W by hand: 28.27 mm² × 5 mm/s × 800 N/mm² × 0.025^-0.25."""
    assert plunge_power_of(300) == pytest.approx(284.5, abs=1)
    found = reordered(
        tmp_path,
        text,
        feeds=True,
        workpiece=BLOCK,
        tools=library(tmp_path),
        cell=0.1,
        material="aluminium-6061",
        machine=machine_of_power(tmp_path, f"{limit / DRIVE_EFFICIENCY} W"),
    )
    feed = [float(word) for word in re.findall(r"Z-4(?:\.0*)? F([0-9.]+)", found.text)][-1]
    assert 0.95 * limit < plunge_power_of(feed) <= 1.01 * limit, body(found)
    (told,) = [one for one in found.detail.pace.tools[0].limits if one.name == "power"]
    assert told.before == pytest.approx(284.5 / DRIVE_EFFICIENCY, rel=0.02)
    assert told.after <= limit / DRIVE_EFFICIENCY * 1.001


def test_straight_down_a_mill_takes_no_more_torque_than_the_spindle_gives(tmp_path: Path) -> None:
    found = reordered(
        tmp_path,
        PLUNGE,
        feeds=True,
        workpiece=BLOCK,
        tools=library(tmp_path),
        material="aluminium-6061",
        machine=machine(tmp_path),
        cell=0.1,
    )
    feed = [float(word) for word in re.findall(r"Z-4(?:\.0*)? F([0-9.]+)", found.text)][-1]
    torque = 1000 * plunge_power_of(feed) / (2 * math.pi * 6000 / 60)
    assert 0.95 * 200 < torque <= 1.01 * 200


def test_what_does_not_limit_is_told_once_with_what_to_give(tmp_path: Path) -> None:
    bare = reordered(tmp_path, SLOT, feeds=True, workpiece=BLOCK)
    assert [issue.message for issue in bare.issues if issue.code == "L514"] == [
        "the power and torque of the spindle do not limit the feeds, because the material is unknown; give --material",
        "feeds in slots are limited like feeds in other cuts",
        "plunges and ramps of T1 keep their feeds; give a plunge feed with --tools",
    ]
    some = {"tools": library(tmp_path, teeth=""), "material": "steel-c45"}
    known = reordered(tmp_path, SLOT, feeds=True, workpiece=BLOCK, machine=machine_of_power(tmp_path, "500 W"), **some)
    assert [issue.message for issue in known.issues if issue.code == "L514"] == [
        "the power and torque of the spindle do not limit the feeds of T1, because the number of teeth is "
        "unknown; give it with --tools",
        "feeds in slots are limited like feeds in other cuts",
        "plunges and ramps of T1 keep their feeds; give a plunge feed with --tools",
    ]
    machine = reordered(tmp_path, SLOT, feeds=True, workpiece=BLOCK, **some)
    assert any("the machine's profile does not state them" in issue.message for issue in machine.issues)


def test_a_material_that_is_not_known_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="unknown material 'cheese'"):
        reordered(tmp_path, SLOT, feeds=True, workpiece=BLOCK, material="cheese")


@pytest.mark.parametrize("seed", range(6))
def test_every_raised_stretch_reaches_its_speed_at_the_machines_acceleration(seed: int) -> None:
    """Against a way that is driven in small steps, forwards and backwards, as fast as the speeds and v² = 2as allow."""
    chance = np.random.default_rng(seed)
    count, acceleration = 60, 50.0
    length = chance.uniform(0.1, 4.0, count)
    own = np.repeat(chance.choice([5.0, 8.0, 12.0], count // 6), 6)
    wanted = own * chance.choice([0.6, 1.0, 1.1, 1.1**3, 1.5], count)
    found = _limit_to_reachable(wanted, own, length, acceleration)
    assert (found <= wanted + 1e-12).all()
    assert (found >= np.minimum(own, wanted) - 1e-12).all()
    step = 0.002
    piece = np.repeat(np.arange(count), np.ceil(length / step).astype(int))
    squared = found[piece] ** 2
    way = np.append(0.0, length / np.ceil(length / step))[piece + 1]
    for order in (range(1, len(piece)), range(len(piece) - 2, -1, -1)):
        for k in order:
            other = k - 1 if order.step > 0 else k + 1
            squared[k] = min(squared[k], squared[other] + 2 * acceleration * way[k])
    runs = np.append(0, np.cumsum(np.abs(np.diff(found)) > 1e-9))
    for run in range(runs[-1] + 1):
        speed = found[runs == run].max()
        if (found > own * (1 + 1e-9))[runs == run].any():
            assert math.sqrt(squared[runs[piece] == run].max()) == pytest.approx(speed, rel=0.01)
    assert (found > own).any()


@pytest.mark.hazard
@pytest.mark.parametrize(
    ("options", "library_says"),
    [
        ({"material": "aluminium-6061", "machine": "200 W"}, {}),
        ({}, {"plunge_feed": '"100 mm/min"'}),
        ({}, {}),
    ],
    ids=["power", "plunge", "chip"],
)
def test_the_proof_refuses_a_feed_above_a_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: dict[str, Any], library_says: dict[str, str]
) -> None:
    """What chose the feeds is made to raise all of them by a fifth, whatever is allowed."""
    text = RAMP.replace("F300", "F1100") if "plunge_feed" in library_says else SLOT
    monkeypatch.setattr(
        plan, "_speeds_in_material", lambda loads, *_: loads.feed * np.where(loads.removed.cuts, 1.2, 1.0)
    )
    tools = library(
        tmp_path, **{"feed": '"6000 mm/min"' if "plunge_feed" in library_says else '"600 mm/min"', **library_says}
    )
    if power := options.get("machine"):
        options = {**options, "machine": machine_of_power(tmp_path, power)}
    found = reordered(tmp_path, text, feeds=True, workpiece=BLOCK, tools=tools, **options)
    assert found.text == text
    (said,) = [issue.message for issue in found.issues if issue.code == "L513"]
    assert "a new speed is higher than is allowed there" in said


SIDE = "G1 Y11.5\nG1 X10\n"


@pytest.mark.parametrize(
    ("cuts", "tools", "options", "words"),
    [
        ("G1 X60 F600\n", None, {}, "the worst cut is a full slot at line 8, and the chip load is the same in"),
        ("G1 X60 F450\n", {"feed": '"450 mm/min"'}, {}, "in 100 % of the cutting time, the chip load is at the limit"),
        ("G1 X60 Z-3 F600\n", None, {}, "in 100 % of the cutting time, the tool cuts on ramps, first at line 8"),
        (f"G93\nG1 X60 F12\n{SIDE.replace('5', '5 F12').replace('X10', 'X10 F12')}G94\n", {"feed": '"4 m/min"'}, {},
         "lines that cannot be changed take 67 % of the cutting time; the first is line 10"),
        ("G0 Z2\nG81 X30 Y10 R2 Z-3 F100\nX40\nG80\n", None, {}, "the tool only plunges"),
    ],
)  # fmt: skip
def test_a_tool_that_keeps_its_feed_has_a_note_with_the_reason_and_its_line(
    tmp_path: Path, cuts: str, tools: dict[str, str] | None, options: dict[str, float], words: str
) -> None:
    """The line of the first cut is 8: four lines of a head, then two rapids and a plunge."""
    text = HEAD + "G0 X10 Y10\nG0 Z2\nG1 Z-2 F60\n" + cuts + TAIL
    given = {} if tools is None else {"tools": library(tmp_path, **tools)}
    found = reordered(tmp_path, text, feeds=True, workpiece=BLOCK, **given, **options)
    assert found.text == text
    (note,) = [issue for issue in found.issues if issue.code == "L512"]
    assert note.message.startswith(f"T1 end-mill Ø6 keeps its feed: {words}"), note.message
    assert note.severity is Severity.NOTE


@pytest.mark.parametrize("wide", [6.0, 4.5])
def test_the_worst_cut_is_as_wide_as_the_cut_behind_its_entry(tmp_path: Path, wide: float) -> None:
    """The mill enters from outside, along the middle of a slot or along an edge of the block; its radius is 3 mm."""
    y = 25.0 if wide == 6.0 else 3.0 - (6.0 - wide)
    text = f"{HEAD}G0 X-10 Y{y}\nG0 Z2\nG1 Z-2 F60\nG1 X80 F600\n{TAIL}"
    found = reordered(tmp_path, text, feeds=True, workpiece=BLOCK)
    (note,) = [issue.message for issue in found.issues if issue.code == "L512"]
    named = re.search(r"the worst cut is (?:a (full slot)|([0-9.]+) mm wide) at line 8", note)
    assert named is not None, note
    assert (6.0 if named[1] else float(named[2])) == pytest.approx(wide, abs=0.3)


def test_a_drill_and_a_mill_without_a_spindle_speed_have_a_reason_each(tmp_path: Path) -> None:
    hole = "G0 X10 Y10\nG0 Z2\nG1 Z-2 F60\nG0 Z2\n"
    mill = "G0 X10 Y10\nG0 Z2\nG1 Z-2 F60\nG1 X60 F600\n"
    for text, reason in (
        (HEAD.replace("flat end mill", "drill") + hole, "the tool does not mill"),
        (HEAD.replace("S6000 M3\n", "M3\n") + mill, "the program does not state the spindle speed of its cuts"),
    ):
        found = reordered(tmp_path, text + TAIL, feeds=True, workpiece=BLOCK)
        (note,) = [issue.message for issue in found.issues if issue.code == "L512"]
        assert note.endswith(f" keeps its feed: {reason}")


def test_a_tool_whose_feed_changes_has_no_reason_and_one_beside_it_that_keeps_its_own_has(tmp_path: Path) -> None:
    head = HEAD.replace("T1 M6\n", "(T2 D=4. - flat end mill)\nT1 M6\n")
    first = f"G0 X10 Y10\nG0 Z2\nG1 Z-2 F60\nG1 X60 F600\n{SIDE}G0 Z15\n"
    text = head + first + "M5\nT2 M6\nS6000 M3\nG0 X10 Y30\nG0 Z2\nG1 Z-2 F60\nG1 X60 F600\n" + TAIL
    found = reordered(tmp_path, text, feeds=True, workpiece=BLOCK)
    assert [issue.message.partition(":")[0] for issue in found.issues if issue.code == "L512"] == [
        "T2 end-mill Ø4 keeps its feed"
    ]


def test_the_summary_and_the_answer_say_why_a_feed_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "part.ngc"
    file.write_text(HEAD + "G0 X10 Y10\nG0 Z2\nG1 Z-2 F60\nG1 X60 F600\n" + TAIL)
    command = ["reorder", str(file), "-o", str(tmp_path / "new.ngc"), "--feeds", "--workpiece", BLOCK]
    reason = "T1 end-mill Ø6 keeps its feed: the worst cut is a full slot at line 8"
    assert cli.run(command) == 0
    assert reason in " ".join(capsys.readouterr().out.split())
    assert cli.run([*command, "--json"]) == 0
    assert any(reason in issue["message"] for issue in json.loads(capsys.readouterr().out)["issues"])


@pytest.mark.hazard
@pytest.mark.parametrize(("raised", "refused"), [(1.2, True), (1.0, False)])
def test_the_proof_refuses_more_volume_than_the_program_ever_took(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, raised: float, refused: bool
) -> None:
    """A slot 0.1 deep has the thickest chips, a side 0.6 wide and 2 deep the most volume: 720 against 360 mm³/min.

    Raised by a fifth, the chips of the side are 0.72 as thick as those of the slot, and its volume is 864 mm³/min.
    """
    slot, side = "G0 X-5 Y25\nG1 Z-0.1 F60\nG1 X75 F600\nG0 Z2\n", "G0 X-5 Y-2.4\nG1 Z-2 F60\nG1 X75 F600\n"
    text = HEAD + "G0 X-5 Y25\nG0 Z2\n" + slot + side + TAIL

    def feeds(loads: Any, *_: Any) -> Any:
        deep = loads.removed.cuts & (loads.moves.ends[:, 2] < -1.0)
        return loads.feed * np.where(deep, raised, 1.0)

    monkeypatch.setattr(plan, "_speeds_in_material", feeds)
    found = reordered(tmp_path, text, feeds=True, workpiece=BLOCK, tool_diameter=6)
    said = [issue.message for issue in found.issues if issue.code == "L513"]
    assert any("a new speed is higher than is allowed there" in message for message in said) == refused
