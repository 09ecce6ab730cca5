"""Limits of new speeds and heights, with loads worked out by hand: chips, rates, ramps, plunges and clearances."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest

from leafcut.errors import VerifyError
from leafcut.material.cutting import Removed
from leafcut.material.loads import Loads
from leafcut.material.straight_moves import StraightMoves
from leafcut.model.cutter import flat_mill
from leafcut.model.pace import PaceRules, PaceStretch, SpindleLoad, ToolLimits
from leafcut.model.toolpath import DrillCycle, Toolpath, ToolpathBuilder
from leafcut.processes.program.proof.new_speeds import check_limits, check_lowered, highest_new_speeds
from leafcut.read.work_materials import load_material

RAPID = math.inf
Point = tuple[float, float, float]


class Move(NamedTuple):
    """A simulated move; without an area it cuts nothing. `over` is the height of the material above its tip, mm."""

    begin: Point
    end: Point
    over: float = -9.0
    area: float = 0.0
    row: int = 0
    rapid: bool = False
    tool: int = 1
    feed: float = 10.0
    rpm: float = 600.0
    share: float = 1.0
    rate: float = 40.0


def loads_of(*moves: Move) -> Loads:
    def column(name: str) -> np.ndarray:
        return np.array([getattr(move, name) for move in moves])

    n = len(moves)
    none, rows = np.zeros(n), column("row").astype(np.int64)
    ends = np.array([(*move.begin, *move.end) for move in moves], dtype=np.float64)
    straight = StraightMoves(ends, rows, column("rapid"), column("tool"), ToolpathBuilder().build(), none)
    removed = Removed(none, column("area"), none, none, none, column("over"), none, none)
    feed = np.where(column("rapid"), 0.0, column("feed"))
    return Loads(straight, removed, feed, column("rpm"), column("share"), none + 3.0, column("rate"), rows)


def along(x: float, **more: object) -> Move:
    return Move((x, 0, -1), (x + 1, 0, -1), **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("parts", "speeds"),
    [
        ([(1.0, 20.0)], [20, 20, 20, 20]),
        ([(0.25, 5.0), (1.0, RAPID)], [5, RAPID, RAPID, RAPID]),
        ([(0.2501, 20.0), (1.0, 5.0)], [20, 5, 5, 5]),
        ([(0.26, 20.0), (1.0, 5.0)], [20, 20, 5, 5]),
        ([(0.26, 5.0), (1.0, 20.0)], [5, 20, 20, 20]),
        ([(0.2499, 5.0), (1.0, 20.0)], [5, 20, 20, 20]),
        ([(0.24, 5.0), (1.0, 20.0)], [20, 20, 20, 20]),
        ([(0.4, 5.0), (0.45, RAPID), (1.0, 7.0)], [5, RAPID, 7, 7]),
    ],
)
def test_a_move_has_the_highest_speed_of_its_stretches(parts: list[tuple[float, float]], speeds: list[float]) -> None:
    """Row 3 has four moves; points of division are rounded."""
    loads = loads_of(along(0, row=2), *(along(x, row=3) for x in range(4)), along(9, row=7, feed=30.0))
    stretches = {3: tuple(PaceStretch(*part) for part in parts), 5: (PaceStretch(1.0, 90.0),), 99: ()}
    assert highest_new_speeds(loads, stretches).tolist() == [10, *speeds, 30]
    assert highest_new_speeds(loads, {7: (PaceStretch(1.0, 4.0),)}).tolist() == [10, 10, 10, 10, 10, 4]


FREE = ToolLimits(99.0, 999.0, True)
CUT = Move((0, 0, -1), (10, 0, -1), 1.0, 4.0)
RAMP = Move((0, 0, 0), (10, 0, -1), 1.0, 4.0)
#: Clear of all material by the clearance, 1 mm.
AIR = Move((0, 0, 3), (10, 0, 3), -1.0)
PLUNGE = Move((0, 0, 5), (0, 0, -1), 1.0, 4.0)

#: Name → the move, the limits of tool 1, its stretches, whether moves in air may be rapids, and whether all is allowed.
SPEEDS: dict[str, tuple[Move, ToolLimits | None, list[tuple[float, float]], bool, bool]] = {
    "unchanged": (CUT, None, [], True, True),
    "slower": (CUT, None, [(1.0, 9.0)], True, True),
    "as fast": (CUT, None, [(1.0, 10.000009)], True, True),
    "without limits": (CUT, None, [(1.0, 10.1)], True, False),
    "half as fast again": (CUT, FREE, [(1.0, 15.0)], True, True),
    "more than half as fast again": (CUT, FREE, [(1.0, 15.001)], True, False),
    # 10 mm/s at 10 turns a second are a chip of 1 mm.
    "thickest chip": (CUT, FREE._replace(chip=1.2), [(1.0, 12.0)], True, True),
    "too thick a chip": (CUT, FREE._replace(chip=1.2), [(1.0, 12.001)], True, False),
    "half a chip": (CUT._replace(share=0.5), FREE._replace(chip=0.7), [(1.0, 14.0)], True, True),
    "too thick half a chip": (CUT._replace(share=0.5), FREE._replace(chip=0.7), [(1.0, 14.001)], True, False),
    "thick chip of another tool": (CUT._replace(tool=2), FREE._replace(chip=1.2), [(1.0, 14.0)], True, True),
    "highest rate": (CUT, FREE._replace(rate=52.0), [(1.0, 13.0)], True, True),
    "too high a rate": (CUT, FREE._replace(rate=52.0), [(1.0, 13.001)], True, False),
    "rapid in material": (CUT, FREE, [(1.0, RAPID)], True, False),
    "rapid that cuts beside air": (CUT._replace(over=-9.0), FREE, [(1.0, RAPID)], True, False),
    # A ramp goes down by a tenth of its way.
    "ramp": (RAMP, FREE._replace(plunge=1.2), [(1.0, 12.05)], True, True),
    "too steep a ramp": (RAMP, FREE._replace(plunge=1.2), [(1.0, 12.07)], True, False),
    "ramp without a known plunge rate": (RAMP, FREE, [(1.0, 10.1)], True, False),
    "slower ramp without a known plunge rate": (RAMP, FREE, [(1.0, 9.0)], True, True),
    "chip of a ramp": (RAMP._replace(share=0.1), FREE._replace(plunge=9.0, chip=1.2), [(1.0, 12.001)], True, False),
    "rapid in air": (AIR, None, [(1.0, RAPID)], True, True),
    "feed in air": (AIR, None, [(1.0, 99.0)], True, True),
    "feed in air that stays": (AIR, FREE, [(1.0, 99.0)], False, False),
    "slightly faster feed in air that stays": (AIR, FREE, [(1.0, 15.0)], False, True),
    "rapid near material": (AIR._replace(over=-0.999), FREE, [(1.0, RAPID)], True, False),
    "feed near material": (AIR._replace(over=-0.999), FREE, [(1.0, 99.0)], True, False),
    "slightly faster near material": (AIR._replace(over=-0.999), FREE, [(1.0, 15.0)], True, True),
    # A plunge from 5 to -1 into material up to 0 slows down at 1.
    "plunge": (PLUNGE, None, [(4 / 6, RAPID), (1.0, 10.0)], True, True),
    "plunge at another feed": (PLUNGE, None, [(4 / 6, 99.0), (1.0, 10.0)], True, True),
    "plunge too far down": (PLUNGE, None, [(4.01 / 6, RAPID), (1.0, 10.0)], True, False),
    "plunge too fast in material": (PLUNGE, None, [(1.0, 10.1)], True, False),
    "plunge slower in material": (PLUNGE, None, [(4 / 6, RAPID), (1.0, 9.0)], True, True),
    "rise": (Move((0, 0, -1), (0, 0, 5), 1.0, 4.0), None, [(1.0, RAPID)], True, True),
    "rapid in the program": (PLUNGE._replace(rapid=True), None, [(1.0, RAPID)], True, True),
}


@pytest.mark.parametrize("name", SPEEDS)
def test_a_new_speed_is_within_the_limits_or_refused(name: str) -> None:
    move, limit, parts, air, allowed = SPEEDS[name]
    loads = loads_of(along(20, area=4.0, over=1.0, row=0), move._replace(row=1))
    limits = {} if limit is None else {1: limit, 2: FREE}
    stretches = {1: tuple(PaceStretch(*part) for part in parts)} if parts else {}
    cutters = {1: flat_mill(6.0), 2: flat_mill(8.0)}

    def found() -> list[float]:
        return check_limits(loads, stretches, limits, PaceRules(air, True), cutters).tolist()

    if allowed:
        feed = 0.0 if move.rapid else 10.0
        assert found() == [10.0, max((speed for _, speed in parts), default=feed)]
    else:
        x, y, z = move.begin
        with pytest.raises(VerifyError) as refused:
            found()
        text = f"T{move.tool} at X{x:.3f} Y{y:.3f} Z{z:.3f}: a new speed is higher than is allowed there"
        assert str(refused.value) == text


@pytest.mark.parametrize("limited", ["power", "torque"])
def test_a_new_speed_needs_no_more_than_the_spindle_has(limited: str) -> None:
    """The factor that the spindle allows for a mill of 6 mm is that of the loads."""
    loads, material = loads_of(CUT), load_material("steel-c45")
    needed = float(loads.power(SpindleLoad(material), 2, 6.0)[0])
    # At 600 rpm, 1 W is 60,000 / (2 π 600) N·mm.
    most = 1.2 * needed * (1.0 if limited == "power" else 60_000 / (2 * math.pi * 600))
    spindle = SpindleLoad(material, **{limited: most})
    limit = FREE._replace(spindle=spindle, teeth=2)
    ratio = float(loads.max_feed_factor(limit, 6.0)[0])
    assert 1.1 < ratio < 1.4
    for part, allowed in ((1.0, True), (1.001, False)):
        stretches = {0: (PaceStretch(1.0, 10.0 * ratio * part),)}
        if allowed:
            check_limits(loads, stretches, {1: limit}, PaceRules(True, True), {1: flat_mill(6.0)})
        else:
            with pytest.raises(VerifyError):
                check_limits(loads, stretches, {1: limit}, PaceRules(True, True), {1: flat_mill(6.0)})


def path_of(*heights: float, plane: float = 1.0, to_initial: bool = True, top: float = 9.0) -> Toolpath:
    """Return rapids from X0 at these heights, each 10 mm farther; then a hole with an R plane, and a cut."""
    builder = ToolpathBuilder()
    builder.rapid(0.0, 0.0, top, line=1)
    for k, z in enumerate(heights):
        builder.rapid(10.0 * k, 10.0 * (k == 3), z, line=k + 2)
    builder.drill(10.0, 0.0, DrillCycle("G81", plane, -5.0, to_initial), feed=1.0, line=20)
    builder.feed(0.0, 0.0, -1.0, feed=1.0, line=21)
    return builder.build()


#: Rows of the paths: 0 to 4 are rapids at X0 to X30, 5 is the hole, 6 the cut.
HIGH, LOW = path_of(9.0, 9.0, 9.0, 9.0), path_of(9.0, 9.0, 4.0, 4.0)
ACROSS = Move((20, 0, 4), (30, 10, 4), -1.0, row=4, rapid=True)


@pytest.mark.parametrize(
    ("move", "bent_above", "allowed"),
    [
        (ACROSS, -RAPID, True),
        (ACROSS._replace(over=-0.999), -RAPID, False),
        (ACROSS._replace(row=2, over=5.0), -RAPID, True),
        (ACROSS._replace(row=3, over=5.0), -RAPID, False),
        (ACROSS, 3.0, True),
        (ACROSS, 3.001, False),
        (ACROSS._replace(end=(30, 0, 4)), 99.0, True),
        (ACROSS._replace(rapid=False), 99.0, True),
        (ACROSS._replace(begin=(20, 0, 6)), 3.001, False),
        (Move((20, 0, 4), (20, 0, 9), 5.0, row=4, rapid=True), -RAPID, True),
        (Move((20, 0, 9), (20, 0, 4), 5.0, row=4, rapid=True), -RAPID, False),
        (Move((20, 0, 9), (20, 0, 4), 5.0, row=4), -RAPID, True),
        (Move((20, 0, 4), (30, 0, 4), 5.0, row=4), -RAPID, False),
        # The hole starts lower, and so does the cut after it: they may touch material only below the R plane.
        (Move((10, 0, 4), (10, 0, 1), 5.0, row=5, rapid=True), -RAPID, True),
        (Move((10, 0, 1), (10, 0, -5), 5.0, row=5), -RAPID, True),
        (Move((30, 0, 4), (10, 0, 4), 5.0, row=5, rapid=True), -RAPID, False),
        (Move((30, 0, 4), (10, 0, 4), -1.0, row=5, rapid=True), -RAPID, True),
        (Move((10, 0, -3), (10, 1, -4), 5.0, row=5), -RAPID, True),
        (Move((10, 0, 4), (0, 0, -1), 5.0, row=6), -RAPID, False),
        (Move((10, 0, 4), (10, 0, -1), 5.0, row=6, rapid=True), -RAPID, True),
    ],
)
def test_a_lower_move_stays_clear_of_the_material(move: Move, bent_above: float, allowed: bool) -> None:
    rules, loads = PaceRules(True, True), loads_of(along(0, row=0, over=9.0), move)
    if allowed:
        check_lowered(HIGH, LOW, loads, rules, bent_above)
    else:
        with pytest.raises(VerifyError) as refused:
            check_lowered(HIGH, LOW, loads, rules, bent_above)
        assert str(refused.value) == f"line {LOW.line[move.row]}: a lowered move comes too close to the material"


@pytest.mark.parametrize(
    ("plane", "to_initial", "top", "allowed"),
    [(1.0, True, 4.0, True), (0.5, True, 4.0, False), (1.0, False, 9.0, False), (1.0, True, 9.0, True)],
)
def test_the_approach_to_a_lower_r_plane_is_clear(plane: float, to_initial: bool, top: float, allowed: bool) -> None:
    """An approach to an R plane that stays differs only in its start."""
    after = path_of(9.0, 9.0, 9.0, top, plane=plane, to_initial=to_initial)
    loads = loads_of(Move((10, 0, 4), (10, 0, 1), 5.0, row=5, rapid=True))
    if allowed:
        check_lowered(HIGH, after, loads, PaceRules(True, True))
    else:
        with pytest.raises(VerifyError, match=r"^line 20: a lowered move comes too close to the material$"):
            check_lowered(HIGH, after, loads, PaceRules(True, True))
