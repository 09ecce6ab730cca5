"""Options: one frozen dataclass per stage, one definition for five faces.

`AcoOptions.n_ants` is the flag `--n-ants`, the key `n_ants` under `[aco]` in a TOML file, the keyword `n_ants` of
`leafcut.optimize`, and an entry of the studio's form: all are made from the fields below. Values are checked and
converted to inner units when an object is made, so no stage checks again.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar, Literal

from leafcut.errors import OptionError, nearest
from leafcut.option_spec import OptionGroup, OptionSpec, flag_name, option, written
from leafcut.units import parse_quantity

#: What `--algorithm` takes, in words.
ALGORITHM_TITLES = {
    "auto": "leafcut's choice: the colony",
    "colony": "ants that improve tours of their own (Lin–Kernighan), then follow each other's trails (edge assembly)",
    "as": "Ant System",
    "eas": "Elitist Ant System",
    "asrank": "rank-based Ant System",
    "mmas": "MAX–MIN Ant System",
    "acs": "Ant Colony System",
    "firefly": "discrete firefly algorithm: orders fly towards shorter ones",
    "kicks": "one tour, kicked at one place at a time and mended by exchanges of up to five edges (Lin–Kernighan)",
    "2opt": "nearest neighbour, improved by 2-opt and Or-opt",
    "nn": "nearest neighbour",
    "none": "the order of the drawing",
}
ALGORITHMS = tuple(ALGORITHM_TITLES)
#: No sheet is longer, mm: the nester reckons with seven digits.
LARGEST_SHEET = 20_000.0
CYCLES = ("G81", "G82", "G83", "G73", "G84", "G85")


@dataclass(frozen=True)
class ReadOptions(OptionGroup):
    """What to take from a file."""

    section: ClassVar[str] = "read"

    units: str | None = option(
        "text",
        None,
        "units of a file that does not say them",
        choices=("mm", "cm", "m", "in", "mil", "ft"),
        default_words="the file's own, else mm",
    )
    layers: tuple[str, ...] = option(
        "names", (), "only these layers, with * and ? as wildcards", default_words="all that are on"
    )
    min_diameter: float | None = option(
        "quantity", None, "leave out holes smaller than this", unit="mm", minimum=0, default_words="none"
    )
    max_diameter: float | None = option(
        "quantity", None, "leave out holes larger than this", unit="mm", minimum=0, default_words="none"
    )
    merge_tolerance: float = option(
        "quantity", 0.01, "holes of one diameter closer than this are one hole", unit="mm", minimum=0, maximum=1
    )
    concentric: str = option(
        "text",
        "smallest",
        "which of several circles with one centre is drilled",
        choices=("smallest", "largest", "all"),
    )
    strict: bool = option("flag", False, "refuse a file in which anything had to be skipped or repaired")


@dataclass(frozen=True)
class SheetOptions(OptionGroup):
    """What in a drawing of a sheet is what, and how its lines are joined."""

    section: ClassVar[str] = "sheet"

    cut_layers: tuple[str, ...] = option(
        "names", (), "layers that are cut, with * and ?; no others are then", default_words="all others"
    )
    mark_layers: tuple[str, ...] = option(
        "names", (), "layers that are marked, not cut through", default_words="MARK*, SCRIBE*, ENGRAV*, ETCH*"
    )
    sheet_layers: tuple[str, ...] = option(
        "names",
        (),
        "layers that show the edge of the sheet",
        default_words="SHEET*, PLATE*, STOCK* where they hold one outline round all else",
    )
    ignore_layers: tuple[str, ...] = option("names", (), "layers that are left out", default_words="none")
    join_tolerance: float = option(
        "quantity", 0.05, "ends closer than this are one point", unit="mm", minimum=1e-4, maximum=5
    )
    open_paths: str = option(
        "text", "refuse", "what becomes of open paths on layers that are cut", choices=("refuse", "cut", "mark", "drop")
    )


@dataclass(frozen=True)
class MachineOptions(OptionGroup):
    """Which machine, and where the part lies on it."""

    section: ClassVar[str] = "machine"

    machine: str = option("text", "linuxcnc-mill", "name of a shipped machine, or the path of a TOML profile")
    work_offset: tuple[float, ...] | None = option(
        "point",
        None,
        "program zero in machine coordinates, x,y,z",
        unit="mm",
        default_words="the machine's own, else unknown",
    )


@dataclass(frozen=True)
class DrillOptions(OptionGroup):
    """How holes become drilling operations."""

    section: ClassVar[str] = "drill"

    tools: Path | None = option(
        "path", None, "tool library, a TOML file", default_words="a drill per diameter is assumed"
    )
    depth: float | None = option(
        "quantity",
        None,
        "depth of a blind hole below Z0",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="from --thickness, else 1 mm (spotting)",
    )
    thickness: float | None = option(
        "quantity",
        None,
        "thickness of the plate, through which holes go, or of the sheet that is cut",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="holes are not through",
    )
    depth_to: str = option(
        "text",
        "shoulder",
        "what reaches the depth: the full diameter or the point of the drill",
        choices=("shoulder", "tip"),
    )
    break_through: float = option(
        "quantity", 0.5, "how far below the plate a through hole goes", unit="mm", minimum=0, maximum=100
    )
    clearance_height: float = option(
        "quantity",
        10.0,
        "initial plane: safe height over the part and its clamps",
        unit="mm",
        minimum=0.1,
        maximum=1000,
    )
    retract_height: float = option(
        "quantity", 2.0, "R plane: where rapid becomes feed", unit="mm", minimum=0.05, maximum=1000
    )
    tool_change_height: float = option(
        "quantity",
        25.0,
        "height for changing tools, on a machine that has no safe height of its own",
        unit="mm",
        minimum=0.1,
        maximum=1000,
    )
    retract: str = option(
        "text", "r", "after a hole: up to the R plane (G99) or to the initial plane (G98)", choices=("r", "initial")
    )
    keep_out: tuple[str, ...] = option(
        "names",
        (),
        "rectangles 'x0 y0 x1 y1' in mm, such as clamps: nothing is drilled there, moves cross them at the initial "
        "plane only, and the tool's radius is kept away; several with commas",
        default_words="none",
    )
    cycle: str | None = option(
        "text",
        None,
        "cycle of every drill that the tool library says nothing of",
        choices=CYCLES,
        default_words="G83 with --peck, G82 with --dwell, else G81",
    )
    peck: float | None = option(
        "quantity",
        None,
        "depth of one peck (Q of G83 and G73)",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="no pecking",
    )
    dwell: float | None = option(
        "quantity", None, "wait at the bottom (P of G82)", unit="s", minimum=0, maximum=100, default_words="none"
    )
    feed: float | None = option(
        "quantity",
        None,
        "feed of assumed drills",
        unit="mm/s",
        minimum=0.001,
        default_words="0.02 diameters a revolution",
    )
    spindle_speed: float | None = option(
        "quantity",
        None,
        "spindle speed of assumed drills",
        unit="rpm",
        minimum=1,
        default_words="20 m/min at the drill's edge",
    )
    diameter_tolerance: float = option(
        "quantity", 0.05, "how far a tool may differ from the hole drawn", unit="mm", minimum=0, maximum=5
    )
    centre_drill: bool = option("flag", False, "first centre every hole with the library's centre drill")
    start_point: tuple[float, ...] | None = option(
        "point", (0.0, 0.0), "where the tool starts, x,y, or free", unit="mm"
    )
    end_point: tuple[float, ...] | None = option(
        "point", None, "where the tool ends, x,y, or free", unit="mm", default_words="at the last hole"
    )


@dataclass(frozen=True)
class CutOptions(OptionGroup):
    """How a nested sheet is cut by plasma, laser, flame or water.

    The sheet's thickness, the safe height, clamps and the first and last place are those of `DrillOptions`.
    """

    section: ClassVar[str] = "cut"

    cut_process: str | None = option(
        "text",
        None,
        "plasma, laser, oxyfuel or waterjet, or a name of the cut chart such as laser_fiber_3kW",
        default_words="what the machine is: laser, else plasma",
    )
    material: str = option("text", "mild_steel", "material, as the cut chart names it")
    amps: float | None = option(
        "number", None, "current, where the chart has several", minimum=0, default_words="the chart's lowest"
    )
    chart: Path | None = option("path", None, "your own cut chart, a CSV file", default_words="the shipped one")
    cut_speed: float | None = option(
        "quantity", None, "cutting speed", unit="mm/s", minimum=0.01, default_words="the chart's"
    )
    kerf_width: float | None = option(
        "quantity", None, "width of the cut", unit="mm", minimum=0.001, maximum=50, default_words="the chart's"
    )
    pierce_delay: float | None = option(
        "quantity",
        None,
        "wait after the torch goes on",
        unit="s",
        minimum=0,
        maximum=600,
        default_words="the chart's",
    )
    pierce_height: float | None = option(
        "quantity",
        None,
        "height of the torch when it goes on",
        unit="mm",
        minimum=0.01,
        maximum=100,
        default_words="the chart's",
    )
    cut_height: float | None = option(
        "quantity",
        None,
        "height of the torch while it cuts",
        unit="mm",
        minimum=0.01,
        maximum=100,
        default_words="the chart's",
    )
    compensation: str = option(
        "text",
        "geometry",
        "who keeps half a kerf away from the part: the program's path, the controller (G41, G42), or nobody",
        choices=("geometry", "controller", "none"),
    )
    direction: str = option(
        "text",
        "auto",
        "which way round outlines are cut; holes the other way",
        choices=("auto", "clockwise", "counter-clockwise", "free"),
        default_words="auto: clockwise for plasma and oxyfuel, else free",
    )
    lead_in: str = option(
        "text",
        "auto",
        "how a cut comes to its contour",
        choices=("auto", "line", "arc", "none"),
        default_words="auto: arc for plasma and oxyfuel, else line",
    )
    lead_out: str = option(
        "text",
        "auto",
        "how a cut leaves its contour",
        choices=("auto", "line", "arc", "none"),
        default_words="auto: as the lead-in on outlines cut by plasma or oxyfuel, else none",
    )
    lead_in_length: float | None = option(
        "quantity",
        None,
        "length of the lead-in",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="plasma 6, oxyfuel 15, or the thickness; laser and water 3 kerfs, at least 2",
    )
    lead_out_length: float | None = option(
        "quantity",
        None,
        "length of the lead-out",
        unit="mm",
        minimum=0.01,
        maximum=1000,
        default_words="as the lead-in, 6 at least",
    )
    lead_angle: float = option(
        "quantity",
        1.5707963267948966,
        "angle of a line to the contour, or that an arc turns by",
        unit="rad",
        minimum=0.17,
        maximum=2.97,
    )
    overcut: float | None = option(
        "quantity",
        None,
        "how far a closed cut goes on past its beginning; with the torch off where the controller can",
        unit="mm",
        minimum=0,
        maximum=100,
        default_words="4 mm on holes cut by plasma, else 0",
    )
    small_hole: float | None = option(
        "quantity",
        None,
        "holes below this diameter are cut slower, from near the centre and without a lead-out",
        unit="mm",
        minimum=0,
        maximum=1000,
        default_words="32 mm for plasma, else 0",
    )
    small_hole_speed: float = option(
        "percent", 60.0, "speed in small holes, in percent of the cutting speed", minimum=1, maximum=100
    )
    corner_loops: bool = option(
        "flag", False, "go round sharp outer corners in a loop through the scrap, where there is room"
    )
    loop_angle: float = option(
        "quantity", 1.7453292519943295, "corners sharper than this have a loop", unit="rad", minimum=0.17, maximum=2.8
    )
    loop_length: float | None = option(
        "quantity",
        None,
        "how far a loop goes on past its corner",
        unit="mm",
        minimum=0.1,
        maximum=100,
        default_words="half the lead-in",
    )
    micro_joints: int = option(
        "whole", 0, "places where an outline stays uncut, so that the part hangs on", minimum=0, maximum=100
    )
    joint_width: float = option("quantity", 0.5, "width of a micro-joint", unit="mm", minimum=0.01, maximum=50)
    chains: bool = option(
        "flag",
        False,
        "cut neighbouring outlines with one pierce: with the torch on from one to the next, through the scrap, where "
        "that is quicker than a new pierce",
    )
    chain_contours: int = option("whole", 12, "contours in one chain at most", minimum=2, maximum=1000)
    chain_bridge: float | None = option(
        "quantity",
        None,
        "longest way through the scrap from one outline of a chain to the next",
        unit="mm",
        minimum=0.1,
        maximum=1000,
        default_words="as long as it is quicker than a pierce",
    )
    common_lines: bool = option(
        "flag",
        False,
        "cut the edges of parts that lie one kerf apart once for both parts, before what is around them",
    )
    pierce_pitch: float | None = option(
        "quantity",
        None,
        "distance between the places of a contour that are tried as its start",
        unit="mm",
        minimum=0.1,
        default_words="a sixteenth of the contour, between 10 and 100 mm",
    )
    start_at: str = option(
        "text", "any", "where on a contour a cut may start: anywhere, or at its corners", choices=("any", "corners")
    )
    edge_start: str = option(
        "text",
        "auto",
        "start outlines beyond the sheet's edge, in the air",
        choices=("auto", "always", "never"),
        default_words="auto: above the pierce capacity",
    )
    splash: float | None = option(
        "quantity",
        None,
        "radius around a pierce that is kept clear of parts where there is room",
        unit="mm",
        minimum=0,
        maximum=100,
        default_words="one kerf",
    )
    heat_distance: float = option(
        "quantity", 0.0, "least distance between one start and the next", unit="mm", minimum=0
    )
    heat_time: float = option(
        "quantity",
        0.0,
        "starts nearer than --heat-distance are this far apart in time at least",
        unit="s",
        minimum=0,
        default_words="0: only the next start is kept away",
    )
    sweep: str = option(
        "text",
        "free",
        "cut the parts in bands along an axis, so that the rest of the sheet stays flat",
        choices=("free", "x", "y"),
    )
    sweep_width: float | None = option(
        "quantity",
        None,
        "width of a band",
        unit="mm",
        minimum=1,
        default_words="a fifth of the sheet, or its largest part",
    )
    start_corner: str = option(
        "text",
        "free",
        "corner of the sheet at which cutting begins",
        choices=("free", "lower-left", "lower-right", "upper-left", "upper-right"),
    )
    sheet_size: str | None = option(
        "text",
        None,
        "size of the sheet from its lower left corner at 0,0, such as 3000x1500",
        default_words="the outline in the drawing, else not known",
    )
    sheet_margin: float = option(
        "quantity", 0.0, "leads keep this far from the sheet's edge", unit="mm", minimum=0, maximum=1000
    )
    plan: Path | None = option("path", None, "plan file whose fixed choices are kept", default_words="none")
    save_plan: Path | None = option("path", None, "plan file to write", default_words="none", changes_program=False)
    quantity: int = option("whole", 1, "sheets in the batch", minimum=1, maximum=1_000_000)
    gas_rate: float = option("number", 0.0, "cost of gas or abrasive for an hour of cutting", minimum=0)
    power_rate: float = option("number", 0.0, "cost of power for an hour of cutting", minimum=0)
    consumables_rate: float = option("number", 0.0, "cost of consumables for an hour of cutting", minimum=0)
    pierce_cost: float = option("number", 0.0, "what a pierce costs besides, in consumables", minimum=0)
    machine_rate: float = option("number", 0.0, "cost of the machine and its operator for an hour", minimum=0)


@dataclass(frozen=True)
class PocketOptions(OptionGroup):
    """How pockets are cleared.

    Depth, safe height, retract height, spindle speed, and the first and last place are those of `DrillOptions`.
    """

    section: ClassVar[str] = "pocket"

    strategy: str = option(
        "text",
        "best",
        "how the pocket is cleared; all others that are possible are measured beside it",
        choices=("best", "zigzag", "contour", "firefly", "ants", "adaptive"),
    )
    tool_diameter: float | None = option(
        "quantity", None, "diameter of the flat end mill", unit="mm", minimum=0.01, maximum=200, default_words="needed"
    )
    step_over: float = option(
        "number", 0.6, "largest distance between passes, as a share of the tool's diameter", minimum=0.02, maximum=0.95
    )
    point_distance: float = option(
        "number",
        0.6,
        "distance between the points of a grid, as a share of the tool's diameter: above 0.5, or points crowd; below "
        "0.7, or the corners between four points stay uncut",
        minimum=0.02,
        maximum=2,
    )
    step_down: float | None = option(
        "quantity",
        None,
        "depth of one level",
        unit="mm",
        minimum=0.001,
        maximum=1000,
        default_words="half the tool's diameter",
    )
    stock: float = option(
        "quantity", 0.0, "what roughing leaves on the walls for the finishing pass", unit="mm", minimum=0, maximum=100
    )
    finishing_pass: bool = option("flag", True, "go along every wall after zigzag and grid strategies")
    milling: str = option("text", "climb", "which side of the tool cuts", choices=("climb", "conventional"))
    zigzag_angle: float | None = option(
        "quantity", None, "angle of the lines of a zigzag", unit="rad", default_words="the best of twelve"
    )
    max_engagement: float | None = option(
        "quantity",
        None,
        "largest angle of the tool's edge in the material",
        unit="rad",
        minimum=0.17,
        maximum=3.1416,
        default_words="not limited",
    )
    entry: str = option(
        "text",
        "ramp",
        "how the tool comes down to a level",
        choices=("ramp", "helix", "plunge", "predrilled"),
        default_words="ramp: along the first piece of the path",
    )
    entry_angle: float = option(
        "quantity",
        0.05235987755982989,
        "steepest way down of a ramp or a helix",
        unit="rad",
        minimum=0.001,
        maximum=0.8,
    )
    plunge_feed: float | None = option(
        "quantity", None, "feed straight down", unit="mm/s", minimum=0.001, default_words="a third of the feed"
    )
    milling_feed: float | None = option(
        "quantity",
        None,
        "feed of the end mill",
        unit="mm/s",
        minimum=0.001,
        default_words="0.01 diameters a revolution",
    )
    pocket_layers: tuple[str, ...] = option(
        "names", (), "layers with the outlines of pockets, with * and ?", default_words="POCKET* where there are such"
    )
    island_layers: tuple[str, ...] = option(
        "names", (), "layers with the outlines of islands", default_words="ISLAND* where there are such"
    )
    pixel_size: float | None = option(
        "quantity", None, "width of a pixel of a picture", unit="mm", minimum=1e-4, maximum=100, default_words="needed"
    )
    threshold: float | None = option(
        "percent",
        None,
        "brightness below which a pixel is to be milled",
        minimum=0,
        maximum=100,
        default_words="found by Otsu's method",
    )
    speckle: float = option(
        "quantity",
        1.0,
        "spots of a picture that are narrower than this are dirt",
        unit="mm",
        minimum=0,
        maximum=100,
    )
    invert: bool = option("flag", False, "mill what is bright in a picture")
    uncovered_tolerance: float = option(
        "percent", 0.1, "uncut share of the reachable area above which there is a warning", minimum=0, maximum=100
    )


@dataclass(frozen=True)
class NestOptions(OptionGroup):
    """How parts are laid on sheets.

    The seed, the time limit and the budget of work are those of `SolveOptions`.
    """

    section: ClassVar[str] = "nest"

    sheet: str = option("text", "3000x1500", "length and width of a sheet, such as 3000x1500 or 120inx60in")
    kerf: float = option("quantity", 2.0, "width of the cut", unit="mm", minimum=0, maximum=50)
    gap: float = option(
        "quantity", 5.0, "what stays between two parts besides the kerf", unit="mm", minimum=0, maximum=1000
    )
    margin: float = option(
        "quantity", 10.0, "strip along the edge of the sheet that stays free", unit="mm", minimum=0, maximum=1000
    )
    rotations: tuple[str, ...] = option(
        "names", ("0", "90", "180", "270"), "angles in which a part may lie, or free for any"
    )
    nester: str = option(
        "text",
        "auto",
        "how parts are laid: by their shapes, by the rectangles around them, or the one that suits them",
        choices=("auto", "shapes", "rectangles"),
    )
    max_sheets: int | None = option(
        "whole",
        None,
        "sheets at hand; parts that find no room are told",
        minimum=1,
        maximum=100_000,
        default_words="as many as it takes",
    )
    variants: int = option("whole", 3, "nests to offer, the best first", minimum=1, maximum=100)
    all_variants: bool = option("flag", False, "write every variant, not only the best")
    into_holes: bool = option("flag", True, "lay small parts into the holes of large ones, where that saves sheet")

    def __post_init__(self) -> None:
        super().__post_init__()
        length, width = self.size
        if min(length, width) <= 2.0 * self.margin:
            raise OptionError(f"--margin: {self.margin:g} mm on both sides leaves nothing of a sheet of {self.sheet}")
        _ = self.angles

    @property
    def size(self) -> tuple[float, float]:
        """Length (x) and width (y) of a sheet, mm."""
        sides = self.sheet.lower().replace("×", "x").split("x")
        try:
            length, width = (parse_quantity(side, "mm") for side in sides)
        except (OptionError, ValueError):
            raise OptionError(f"--sheet: '{self.sheet}' is not a size such as 3000x1500 or 120inx60in") from None
        if not (0.0 < length <= LARGEST_SHEET and 0.0 < width <= LARGEST_SHEET):
            raise OptionError(f"--sheet: {self.sheet} is not between 0 and {LARGEST_SHEET / 1000:g} m a side")
        return length, width

    @property
    def angles(self) -> tuple[float, ...] | None:
        """The angles in which a part may lie, rad; None for any."""
        return parse_angles(self.rotations, "--rotations")


def parse_angles(words: Sequence[str], where: str) -> tuple[float, ...] | None:
    """Return angles in rad, once each, from words in degrees; None for the one word ``free``.

    Raises
    ------
    OptionError
        A word is no angle; `where` names what was asked for.
    """
    if tuple(words) == ("free",):
        return None
    try:
        angles = [parse_quantity(word, "rad") % math.tau for word in words]
    except OptionError as problem:
        raise OptionError(f"{where}: {problem}; angles are such as 0,90,180,270, or free for any") from None
    if not angles:
        raise OptionError(f"{where}: names no angle; angles are such as 0,90,180,270, or free for any")
    return tuple(dict.fromkeys(angles))


@dataclass(frozen=True)
class ResequenceOptions(OptionGroup):
    """How a program of another CAM is put in order."""

    section: ClassVar[str] = "resequence"

    merge_tools: bool = option("flag", False, "join separated sections of one tool, where nothing forbids it")
    allow_reverse: bool = option(
        "flag",
        False,
        "cut open lines of one depth from either end (slots, engraving, laser), where neither climb milling nor a "
        "lead-in matters; the tool may then go down at what was the end",
    )
    keep_order: bool = option("flag", False, "leave the order as it is; of a program, only measure it")
    renumber: bool = option("flag", False, "give the blocks new N-numbers, in steps of 10")


@dataclass(frozen=True)
class SolveOptions(OptionGroup):
    """How the order is sought."""

    section: ClassVar[str] = "solve"

    algorithm: str = option("text", "auto", "name of an algorithm (see `leafcut algorithms`)", choices=ALGORITHMS)
    preset: str = option(
        "text",
        "default",
        "budget of work, the same on every machine; the search ends sooner when the colonies agree",
        choices=("fast", "default", "thorough"),
    )
    objective: Literal["time", "distance"] = option(
        "text", "time", "what is made small: machine seconds or millimetres of travel", choices=("time", "distance")
    )
    time_limit: float | None = option(
        "quantity",
        None,
        "stop after this time by the clock, or sooner, when five colonies in a row find nothing better",
        unit="s",
        minimum=0.001,
        default_words="the preset's budget of work",
    )
    iterations: int | None = option(
        "whole", None, "stop after this many iterations", minimum=0, default_words="the preset's"
    )
    target_gap: float | None = option(
        "percent",
        None,
        "stop at this gap to the lower bound, in percent; it is found first",
        minimum=0,
        default_words="none",
    )
    bound: bool = option(
        "flag", True, "find a lower bound and tell the gap to it, outside the time limit", changes_program=False
    )
    seed: int = option("whole", 1, "start of the random numbers: same seed, same answer", minimum=0, maximum=2**32 - 1)
    threads: int = option(
        "whole",
        0,
        "threads that ants run in; the answer does not depend on it",
        minimum=0,
        maximum=1024,
        default_words="one per core",
        changes_program=False,
    )
    candidates: int | None = option(
        "whole",
        None,
        "length of each node's candidate list; 0 for all nodes, as in the first papers",
        minimum=0,
        maximum=1000,
        default_words="8 for colony and kicks, else 16",
    )
    local_search: bool = option("flag", True, "improve every ant's tour by 2-opt and Or-opt")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.target_gap is not None and not self.bound:
            raise OptionError("--target-gap needs the lower bound; leave out --no-bound")


@dataclass(frozen=True)
class AcoOptions(OptionGroup):
    """The parameters of the ants; each default is the one its authors recommend (`solve.aco.RECOMMENDED`)."""

    section: ClassVar[str] = "aco"

    n_ants: int | None = option(
        "whole",
        None,
        "ants per iteration",
        minimum=1,
        maximum=1_000_000,
        default_words="one per node; 25 with local search; 10 for acs",
    )
    pheromone_weight: float = option("number", 1.0, "weight of the pheromone (α)", minimum=0, maximum=20)
    heuristic_weight: float = option("number", 2.0, "weight of nearness (β)", minimum=0, maximum=20)
    evaporation_rate: float | None = option(
        "number",
        None,
        "part of the pheromone lost per iteration (ρ)",
        minimum=1e-6,
        maximum=1,
        default_words="0.5 as, eas · 0.1 asrank, acs · 0.02 mmas, 0.2 with local search",
    )
    elitist_weight: float | None = option(
        "number", None, "deposits of the best tour so far (e of eas)", minimum=0, default_words="the number of ants"
    )
    n_ranks: int = option("whole", 6, "ranks that deposit (w of asrank)", minimum=1, maximum=1000)
    greedy_probability: float = option("number", 0.9, "chance to take the best edge (q0 of acs)", minimum=0, maximum=1)
    local_evaporation_rate: float = option(
        "number", 0.1, "pheromone lost by an edge just used (ξ of acs)", minimum=0, maximum=1
    )
    best_probability: float = option(
        "number",
        0.05,
        "chance to rebuild the best tour at convergence; sets the trail limits (p_best of mmas)",
        minimum=1e-6,
        maximum=0.999,
    )


@dataclass(frozen=True)
class FireflyOptions(OptionGroup):
    """The parameters of the fireflies."""

    section: ClassVar[str] = "firefly"

    n_fireflies: int = option("whole", 20, "fireflies in the swarm", minimum=1, maximum=10_000)
    attractiveness: float = option(
        "number", 1.0, "share of its steps that a brighter order gives one beside it (β0)", minimum=0, maximum=1
    )
    absorption: float = option(
        "number",
        0.05,
        "how fast that falls with the distance of two orders (γ): ten when no step is the same",
        minimum=0,
        maximum=100,
    )
    random_moves: int = option(
        "whole", 2, "clusters that move at random after every flight (α)", minimum=0, maximum=1000
    )


@dataclass(frozen=True)
class PostOptions(OptionGroup):
    """How the program is written."""

    section: ClassVar[str] = "post"

    dialect: str | None = option("text", None, "controller's dialect", default_words="the machine's own")
    output_units: str = option("text", "mm", "units of the program", choices=("mm", "inch"))
    line_numbers: bool = option("flag", False, "number the blocks N10, N20, …")
    program_number: int = option("whole", 1, "number of the program, O0001", minimum=1, maximum=9999)
    header: bool = option("flag", True, "write the comments at the top: source, options, tools, extents, time")
    date: bool = option("flag", False, "write the date and time into the header")
    repeat_words: bool = option("flag", False, "repeat modal words on every block")
    coolant: bool = option("flag", False, "coolant on while drilling")
    beam_power: int = option(
        "whole", 1000, "S of a laser's beam when it cuts (GRBL: its $30)", minimum=1, maximum=1_000_000
    )
    mark_power: int = option("whole", 200, "S of a laser's beam when it marks", minimum=1, maximum=1_000_000)
    path_tolerance: float = option(
        "quantity",
        0.1,
        "how far a torch may cut a corner short to keep its speed (P of G64); 0 for not at all",
        unit="mm",
        minimum=0,
        maximum=1,
    )
    material_number: int | None = option(
        "whole",
        None,
        "material of the controller's own table that is cut (QtPlasmaC: M190); its feed is then the controller's",
        minimum=0,
        maximum=9_999_999,
        default_words="the material's figures are written",
    )


GROUPS: tuple[type[OptionGroup], ...] = (
    ReadOptions,
    SheetOptions,
    MachineOptions,
    DrillOptions,
    CutOptions,
    PocketOptions,
    NestOptions,
    ResequenceOptions,
    SolveOptions,
    AcoOptions,
    FireflyOptions,
    PostOptions,
)


@dataclass(frozen=True)
class Settings:
    """All options of one run, one group per stage."""

    read: ReadOptions = field(default_factory=ReadOptions)
    sheet: SheetOptions = field(default_factory=SheetOptions)
    machine: MachineOptions = field(default_factory=MachineOptions)
    drill: DrillOptions = field(default_factory=DrillOptions)
    cut: CutOptions = field(default_factory=CutOptions)
    pocket: PocketOptions = field(default_factory=PocketOptions)
    nest: NestOptions = field(default_factory=NestOptions)
    resequence: ResequenceOptions = field(default_factory=ResequenceOptions)
    solve: SolveOptions = field(default_factory=SolveOptions)
    aco: AcoOptions = field(default_factory=AcoOptions)
    firefly: FireflyOptions = field(default_factory=FireflyOptions)
    post: PostOptions = field(default_factory=PostOptions)

    @classmethod
    def collect(cls, values: Mapping[str, Any], file: Path | None = None) -> Settings:
        """Return the settings of a TOML `file` (if any), overridden by `values`.

        `values` maps option names to values; None stands for "not given". A number without a unit means the same
        here, in the file and on the command line (`units.BARE_UNIT`).

        Raises
        ------
        OptionError
            An unknown name (the nearest known one is named), or a value out of its bounds.
        """
        given = {group.section: dict(table) for group, table in _file_tables(file)} if file else {}
        for name, value in values.items():
            if value is not None:
                given.setdefault(group_of(name).section, {})[name] = value
        made: dict[str, Any] = {
            group.section: group(**group.as_typed(given.get(group.section, {}))) for group in GROUPS
        }
        return cls(**made)

    def changed(self) -> dict[str, str]:
        """Return every option that is not at its default and can change the program: flag → value as one types it."""
        return {
            flag_name(name if value is not False else f"no_{name}"): written(group.specs()[name], value)
            for group in (getattr(self, f.name) for f in fields(self))
            for name, value in group.changed().items()
            if group.specs()[name].changes_program
        }


def all_options() -> Iterator[tuple[type[OptionGroup], str, OptionSpec]]:
    """Yield every option as (group, name, specification), in the order of the stages."""
    for group in GROUPS:
        for name, spec in group.specs().items():
            yield group, name, spec


def group_of(name: str) -> type[OptionGroup]:
    """Return the group that holds the option `name`, or raise `OptionError` with the nearest name."""
    names = {option: group for group, option, _ in all_options()}
    if name not in names:
        raise OptionError(f"unknown option '{name}'{nearest(name, names)}")
    return names[name]


def _file_tables(file: Path) -> Iterator[tuple[type[OptionGroup], dict[str, Any]]]:
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as problem:
        raise OptionError(f"{file}: cannot be read ({problem.strerror})") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as problem:
        raise OptionError(f"{file}: not a TOML file ({problem})") from None
    sections = {group.section: group for group in GROUPS}
    for section, table in data.items():
        if section not in sections:
            raise OptionError(f"{file}: unknown table [{section}]{nearest(section, sections)}")
        if not isinstance(table, dict):
            raise OptionError(f"{file}: '{section}' is not a table; write [{section}]")
        for name in table:
            if name not in sections[section].specs():
                raise OptionError(
                    f"{file}: unknown option '{name}' in [{section}]{nearest(name, sections[section].specs())}"
                )
        yield sections[section], table
