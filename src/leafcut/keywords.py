"""The options as keywords of the library's functions, for editors and type checkers; None is "not given".

Made by `.ci/make_keywords.py` from the options; do not edit by hand.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal, TypedDict

#: A number in the unit that is told beside it, or a text with a unit of its own: ``6``, ``"0.25in"``.
Quantity = float | str


class OptimizeKeywords(TypedDict, total=False):
    """Options of `leafcut.optimize`."""

    units: Literal[
        "mm",
        "cm",
        "m",
        "in",
        "mil",
        "ft",
        None,
    ]
    """Units of a file that does not say them (default: the file's own, else mm)."""
    layers: str | Sequence[str] | None
    """Only these layers, with * and ? as wildcards (default: all that are on)."""
    min_diameter: Quantity | None
    """Leave out round holes smaller than this (mm; default: none)."""
    max_diameter: Quantity | None
    """Leave out round holes larger than this (mm; default: none)."""
    merge_tolerance: Quantity | None
    """Holes of one diameter closer than this are one hole (mm; default: 0.01mm)."""
    concentric: Literal[
        "smallest",
        "largest",
        "all",
        None,
    ]
    """Which of several circles with one centre is drilled (default: smallest)."""
    mirror: Literal[
        "x",
        "y",
        None,
    ]
    """Mirror the drawing first: x makes X to −X, as a board turned over sideways shows its back; y makes Y to −Y
    (default: as it is drawn).
    """
    rotate: Quantity | None
    """Then turn it about its zero, counter-clockwise (deg)."""
    origin: str | Sequence[Quantity] | None
    """Then make this its zero: lower-left, lower-right, upper-left, upper-right or centre of what is worked, holes
    by their centres; or a point x,y (mm; default: the zero of the drawing).
    """
    strict: bool | None
    """Refuse a file in which anything had to be skipped or repaired, and a program that is dangerous as it is."""
    cut_layers: str | Sequence[str] | None
    """Layers that are cut, with * and ?; no others are then (default: all others)."""
    mark_layers: str | Sequence[str] | None
    """Layers that are marked, not cut through (default: MARK*, SCRIBE*, ENGRAV*, ETCH*)."""
    sheet_layers: str | Sequence[str] | None
    """Layers that show the edge of the sheet (default: SHEET*, PLATE*, STOCK* where they hold one outline round
    all else).
    """
    ignore_layers: str | Sequence[str] | None
    """Layers that are left out (default: none)."""
    join_tolerance: Quantity | None
    """Ends closer than this are one point (mm; default: 0.05mm)."""
    open_paths: Literal[
        "refuse",
        "cut",
        "mark",
        "drop",
        None,
    ]
    """What becomes of open paths on layers that are cut (default: refuse)."""
    machine: str | None
    """Name of a machine (see `leafcut machines`), or the path of a TOML profile (default: linuxcnc-mill)."""
    work_offset: str | Sequence[Quantity] | None
    """Program zero in machine coordinates, x,y,z (mm; default: the machine's own, else unknown)."""
    tools: str | Path | None
    """Tool library: TOML, or LinuxCNC's .tbl, Fusion's .json or .tools, FreeCAD's .fctl (default: a drill per
    diameter is assumed).
    """
    depth: Quantity | None
    """Depth of a blind hole below Z0 (mm; default: from --thickness, else 1 mm (spotting))."""
    thickness: Quantity | None
    """Thickness of the plate, through which holes go, or of the sheet that is cut (mm; default: holes are not
    through).
    """
    break_through: Quantity | None
    """How far below the plate a through hole goes (mm; default: 0.5mm)."""
    clearance_height: Quantity | None
    """Initial plane: safe height over the part and its clamps (mm; default: 10mm)."""
    retract_height: Quantity | None
    """R plane: where rapid becomes feed (mm; default: 2mm)."""
    retract: Literal[
        "r",
        "initial",
        None,
    ]
    """After a hole: up to the R plane (G99) or to the initial plane (G98) (default: r)."""
    keep_out: str | Sequence[str] | None
    """Rectangles 'x0 y0 x1 y1' in mm, such as clamps: nothing is cut there, rapids cross them at --clearance-
    height or above, or go round, and the tool's radius is kept away; several with commas (default: none).
    """
    spindle_speed: Quantity | None
    """Spindle speed of assumed drills, or of a pocket's end mill (rpm; default: 20 m/min at the tool's edge; of an
    end mill as its library or --material has it).
    """
    diameter_tolerance: Quantity | None
    """How far a tool may differ from the hole drawn (mm; default: 0.05mm)."""
    material: str | None
    """Material, as the cut chart names it; of a pocket it says how fast an assumed mill turns (default:
    mild_steel).
    """
    start_point: str | Sequence[Quantity] | None
    """Where the tool starts, x,y, or free; of a program, where it stands before the first rapid (mm; default:
    0,0).
    """
    end_point: str | Sequence[Quantity] | None
    """Where the tool ends, x,y, or free (mm; default: at the last hole)."""
    keep_order: bool | None
    """Leave the order as it is; of a program, only measure it."""
    cut_process: str | None
    """Plasma, laser, oxyfuel or waterjet, or a name of the cut chart such as laser_fiber_3kW (default: what the
    machine is, else plasma).
    """
    amps: float | None
    """Current, where the chart has several (default: the fastest of the chart that pierces the sheet)."""
    chart: str | Path | None
    """Your own cut chart, a CSV file (default: the shipped one)."""
    cut_speed: Quantity | None
    """Cutting speed (mm/min; default: the chart's)."""
    depth_to: Literal[
        "shoulder",
        "tip",
        None,
    ]
    """What reaches the depth: the full diameter or the point of the drill (default: shoulder)."""
    tool_change_height: Quantity | None
    """Height for changing tools, on a machine that has no safe height of its own (mm; default: 25mm)."""
    cycle: Literal[
        "G81",
        "G82",
        "G83",
        "G73",
        "G84",
        "G85",
        None,
    ]
    """Cycle of every drill that the tool library says nothing of (default: G83 with --peck, G82 with --dwell, else
    G81).
    """
    peck: Quantity | None
    """Depth of one peck (Q of G83 and G73) (mm; default: no pecking)."""
    dwell: Quantity | None
    """Wait at the bottom (P of G82) (s; default: none)."""
    feed: Quantity | None
    """Feed of drills whose data are assumed (mm/min; default: 0.02 diameters a revolution)."""
    centre_drill: bool | None
    """First centre every hole with the library's centre drill."""
    hole_order: str | Path | None
    """Order file: holes that come first in the order of the file; the rest is found around them (default: none)."""
    mark_speed: Quantity | None
    """Speed of marks, with a laser or a scribe (mm/min; default: 2500 mm/min, or the machine's highest feed)."""
    kerf_width: Quantity | None
    """Width of the cut (mm; default: the chart's)."""
    pierce_delay: Quantity | None
    """Wait after the torch goes on (s; default: the chart's)."""
    pierce_height: Quantity | None
    """Height of the torch when it goes on (mm; default: the chart's)."""
    cut_height: Quantity | None
    """Height of the torch while it cuts (mm; default: the chart's)."""
    probe: Literal[
        "auto",
        "on",
        "off",
        None,
    ]
    """Find the sheet with the torch before every pierce (G38.2), where the program moves Z (default: auto: where
    the machine's profile has a probe).
    """
    switch_offset: Quantity | None
    """How far Z goes on after the torch has touched the sheet, until the switch of the probe trips (mm; default:
    the machine's).
    """
    compensation: Literal[
        "geometry",
        "controller",
        "none",
        None,
    ]
    """Who keeps half a kerf away from the part: the program's path, the controller (G41, G42), or nobody (default:
    geometry).
    """
    direction: Literal[
        "auto",
        "clockwise",
        "counter-clockwise",
        "free",
        None,
    ]
    """Which way round outlines are cut; holes the other way (default: auto: clockwise for plasma and oxyfuel, else
    free).
    """
    lead_in: Literal[
        "auto",
        "line",
        "arc",
        "none",
        None,
    ]
    """How a cut comes to its contour (default: auto: arc for plasma and oxyfuel, else line)."""
    lead_out: Literal[
        "auto",
        "line",
        "arc",
        "none",
        None,
    ]
    """How a cut leaves its contour (default: auto: as the lead-in on outlines cut by plasma or oxyfuel, else
    none).
    """
    lead_in_length: Quantity | None
    """Length of the lead-in (mm; default: plasma 6, oxyfuel 15, or the thickness; laser and water 3 kerfs, at
    least 2).
    """
    lead_out_length: Quantity | None
    """Length of the lead-out (mm; default: as the lead-in, 6 at least)."""
    lead_angle: Quantity | None
    """Angle of a line to the contour, or that an arc turns by (deg; default: 90deg)."""
    overcut: Quantity | None
    """How far a closed cut goes on past its beginning; with the torch off where the controller can (mm; default: 4
    mm on holes cut by plasma, else 0).
    """
    small_hole: Quantity | None
    """Holes below this diameter are cut slower, from near the centre and without a lead-out (mm; default: 32 mm
    for plasma, else 0).
    """
    small_hole_speed: float | str | None
    """Speed in small holes, in percent of the cutting speed (default: 60%)."""
    corner_loops: bool | None
    """Go round sharp outer corners in a loop through the scrap, where there is room."""
    loop_angle: Quantity | None
    """Corners sharper than this have a loop (deg; default: 100deg)."""
    loop_length: Quantity | None
    """How far a loop goes on past its corner (mm; default: half the lead-in)."""
    micro_joints: int | None
    """Places where an outline stays uncut, so that the part hangs on."""
    joint_holes: bool | None
    """Holes have micro-joints like outlines, so that what falls out of them hangs on; not small holes."""
    joint_width: Quantity | None
    """Width of a micro-joint (mm; default: 0.5mm)."""
    chains: bool | None
    """Cut neighbouring outlines with one pierce: with the torch on from one to the next, through the scrap, where
    that is quicker than a new pierce.
    """
    chain_contours: int | None
    """Contours in one chain at most (default: 12)."""
    chain_bridge: Quantity | None
    """Longest way through the scrap from one outline of a chain to the next (mm; default: as long as it is quicker
    than a pierce).
    """
    common_lines: bool | None
    """Cut the edges of parts that lie one kerf apart once for both parts, before what is around them."""
    pierce_pitch: Quantity | None
    """Distance between the places of a contour that are tried as its start (mm; default: a sixteenth of the
    contour, between 10 and 100 mm).
    """
    start_at: Literal[
        "any",
        "corners",
        None,
    ]
    """Where on a contour a cut may start: anywhere, or at its corners (default: any)."""
    edge_start: Literal[
        "auto",
        "always",
        "never",
        None,
    ]
    """Start outlines beyond the sheet's edge, in the air (default: auto: above the pierce capacity)."""
    splash: Quantity | None
    """Radius around a pierce that is kept clear of parts where there is room (mm; default: one kerf)."""
    heat_distance: Quantity | None
    """Least distance between one start and the next (mm)."""
    heat_time: Quantity | None
    """Starts nearer than --heat-distance are this far apart in time at least (s; default: 0: only the next start
    is kept away).
    """
    sweep: Literal[
        "free",
        "x",
        "y",
        None,
    ]
    """Cut the parts in bands along an axis, so that the rest of the sheet stays flat (default: free)."""
    sweep_width: Quantity | None
    """Width of a band (mm; default: a fifth of the sheet, or its largest part)."""
    start_corner: Literal[
        "free",
        "lower-left",
        "lower-right",
        "upper-left",
        "upper-right",
        None,
    ]
    """Corner of the sheet at which cutting begins (default: free)."""
    sheet_size: str | None
    """Size of the sheet from its lower left corner at 0,0, such as 3000x1500 (default: the outline in the drawing,
    else not known).
    """
    sheet_margin: Quantity | None
    """Leads keep this far from the sheet's edge (mm)."""
    plan: str | Path | None
    """Plan file whose fixed choices are kept (default: none)."""
    save_plan: str | Path | None
    """Plan file to write (default: none)."""
    quantity: int | None
    """Sheets in the batch (default: 1)."""
    gas_rate: float | None
    """Cost of gas or abrasive for an hour of cutting."""
    power_rate: float | None
    """Cost of power for an hour of cutting."""
    consumables_rate: float | None
    """Cost of consumables for an hour of cutting."""
    pierce_cost: float | None
    """What a pierce costs besides, in consumables."""
    machine_rate: float | None
    """Cost of the machine and its operator for an hour."""
    strategy: Literal[
        "best",
        "zigzag",
        "contour",
        "connected",
        "firefly",
        "ants",
        "adaptive",
        None,
    ]
    """How the pocket is cleared; with best every strategy is tried, and the quickest one written (default: best)."""
    tool_diameter: Quantity | None
    """Diameter of the flat end mill (mm; default: needed without a tool library)."""
    tool_number: int | None
    """Number of the end mill, in the tool library where one is given (default: 1; of a library the end mill of the
    diameter, or its only one).
    """
    step_over: float | str | None
    """Largest distance between passes, as a share of the tool's diameter (default: 0.6)."""
    point_distance: float | str | None
    """Distance between the points of a grid, as a share of the tool's diameter: above 0.5, or points crowd; below
    0.7, or the corners between four points stay uncut; no more than the step-over (default: the step-over, at
    most 0.6).
    """
    step_down: Quantity | None
    """Depth of one level (mm; default: half the tool's diameter)."""
    stock: Quantity | None
    """What roughing leaves on the walls for the finishing pass (mm)."""
    finishing_pass: bool | None
    """Go along every wall after zigzag and grid strategies (on unless False)."""
    milling: Literal[
        "climb",
        "conventional",
        None,
    ]
    """Which side of the tool cuts (default: climb)."""
    zigzag_angle: Quantity | None
    """Angle of the lines of a zigzag (deg; default: the best of twelve)."""
    max_engagement: Quantity | None
    """Largest angle of the tool's edge in the material (deg; default: not limited)."""
    entry: Literal[
        "ramp",
        "helix",
        "plunge",
        "predrilled",
        None,
    ]
    """How the tool comes down to a level (default: ramp: along the first piece of the path)."""
    entry_angle: Quantity | None
    """Steepest way down of a ramp or a helix (deg; default: 3deg)."""
    plunge_feed: Quantity | None
    """Feed straight down (mm/min; default: that of the tool library, else a third of the feed)."""
    milling_feed: Quantity | None
    """Feed of the end mill (mm/min; default: that of the tool library, else two teeth, a hundredth of the diameter
    each, 0.05 mm at most).
    """
    air_feed: Quantity | None
    """Feed at depth where the tool cuts nothing, which is proved; no less than that of the mill (mm/min; default:
    the largest feed of the machine).
    """
    uncovered_tolerance: float | str | None
    """Uncut share of the reachable area above which there is a warning (default: 0.1%)."""
    merge_tools: bool | None
    """Join separated sections of one tool, where nothing forbids it."""
    allow_reverse: bool | None
    """Cut open lines of one depth from either end (slots, engraving, laser), where neither climb milling nor a
    lead-in matters; the tool may then go down at what was the end.
    """
    mix_operations: bool | None
    """Mix the work of operations that a program's comments mark; what frees a part stays behind the work before
    it.
    """
    renumber: bool | None
    """Give the blocks new N-numbers, in steps of 10."""
    pocket_layers: str | Sequence[str] | None
    """Layers with the outlines of pockets, with * and ? (default: POCKET* where there are such)."""
    island_layers: str | Sequence[str] | None
    """Layers with the outlines of islands (default: ISLAND* where there are such)."""
    pixel_size: Quantity | None
    """Width of a pixel of a picture (mm; default: for pictures: needed)."""
    threshold: float | str | None
    """Brightness below which a pixel is to be milled (default: found by Otsu's method)."""
    speckle: Quantity | None
    """Spots of a picture that are narrower than this are dirt (mm; default: 1mm)."""
    invert: bool | None
    """Mill what is bright in a picture."""
    algorithm: Literal[
        "auto",
        "colony",
        "as",
        "eas",
        "asrank",
        "mmas",
        "acs",
        "firefly",
        "kicks",
        "2opt",
        "nn",
        "none",
        None,
    ]
    """Name of an algorithm (see `leafcut algorithms`) (default: auto)."""
    preset: Literal[
        "fast",
        "default",
        "thorough",
        None,
    ]
    """Budget of work, the same on every machine; the search ends sooner when the colonies agree, and but for
    thorough when more of it would take longer than it saves (default: default).
    """
    objective: Literal[
        "time",
        "distance",
        None,
    ]
    """What is made small: machine seconds or millimetres of travel (default: time)."""
    time_limit: Quantity | None
    """Stop after this time by the clock, or sooner, when five colonies in a row find nothing better (s; default:
    the preset's budget of work).
    """
    iterations: int | None
    """Stop after this many iterations (default: the preset's)."""
    target_gap: float | str | None
    """Stop at this gap to the lower bound, in percent; it is found first (default: none)."""
    bound: bool | None
    """Find a lower bound and tell the gap to it, outside the time limit (on unless False)."""
    seed: int | None
    """Start of the random numbers: same seed, same answer (default: 1)."""
    threads: int | None
    """Threads that ants run in; the answer does not depend on it (default: one per core)."""
    candidates: int | None
    """Length of each node's candidate list; 0 for all nodes, as in the first papers (default: 8 for colony and
    kicks, else 16).
    """
    local_search: bool | None
    """Improve the tour of every ant or firefly by exchanges of edges (on unless False)."""
    n_ants: int | None
    """Ants per iteration (default: one per node; 25 with local search; 10 for acs)."""
    pheromone_weight: float | None
    """Weight of the pheromone (α) (default: 1)."""
    heuristic_weight: float | None
    """Weight of nearness (β) (default: 2)."""
    evaporation_rate: float | None
    """Part of the pheromone lost per iteration (ρ) (default: 0.5 as, eas · 0.1 asrank, acs · 0.02 mmas, 0.2 with
    local search).
    """
    elitist_weight: float | None
    """Deposits of the best tour so far (e of eas) (default: the number of ants)."""
    n_ranks: int | None
    """Ranks that deposit (w of asrank) (default: 6)."""
    greedy_probability: float | None
    """Chance to take the best edge (q0 of acs) (default: 0.9)."""
    local_evaporation_rate: float | None
    """Pheromone lost by an edge just used (ξ of acs) (default: 0.1)."""
    best_probability: float | None
    """Chance to rebuild the best tour at convergence; sets the trail limits (p_best of mmas) (default: 0.05)."""
    firefly_mode: Literal[
        "simple",
        "complex",
        None,
    ]
    """Which of the published settings stand for what is not given: those for simple or for complex pockets
    (default: simple).
    """
    n_fireflies: int | None
    """Fireflies in the swarm (n) (default: 11 in simple mode, 10 in complex)."""
    attractiveness: float | None
    """Inversions of one flight towards a tour close by (β0) (default: 20 in simple mode, 15 in complex)."""
    absorption: float | None
    """How fast they become fewer with the distance of two tours (γ): 10 when no edge is the same (default: 0.015)."""
    switch_at: float | str | None
    """Share of the iterations, or of the time limit, after which inversions are short (default: 27 in simple mode,
    37 in complex).
    """
    short_inversion: int | None
    """Nodes of the longest of the short inversions; long ones have as many as two tours have different edges
    (default: a quarter of all; 50 with local search).
    """
    firefly_patience: int | None
    """Iterations without a shorter tour after which the search ends (default: 20; with --time-limit none)."""
    firefly_start: Literal[
        "greedy",
        "random",
        None,
    ]
    """What fireflies begin with: greedy tours, each with edges changed a little, or tours at random (default:
    greedy).
    """
    dialect: str | None
    """Name of the controller's dialect (see `leafcut dialects`), or the path of a TOML file (default: the
    machine's own).
    """
    output_units: Literal[
        "mm",
        "inch",
        None,
    ]
    """Units of the program (default: mm)."""
    line_numbers: bool | None
    """Number the blocks N10, N20, …."""
    program_number: int | None
    """Number of the program, O0001 (default: 1)."""
    header: bool | None
    """Write the comments at the top: source, options, tools, extents, time (on unless False)."""
    date: bool | None
    """Write the date and time into the header."""
    repeat_words: bool | None
    """Repeat modal words on every block."""
    coolant: bool | None
    """Coolant on while drilling."""
    beam_power: int | None
    """S of a laser's beam when it cuts (GRBL: its $30) (default: 1000)."""
    mark_power: int | None
    """S of a laser's beam when it marks (default: 200)."""
    path_tolerance: Quantity | None
    """How far a torch may cut a corner short to keep its speed (P of G64); 0 for not at all (mm; default: 0.1mm)."""
    material_number: int | None
    """Material of the controller's own table that is cut (QtPlasmaC: M190); its feed is then the controller's
    (default: the material's figures are written).
    """


class NestKeywords(TypedDict, total=False):
    """Options of `leafcut.nest`."""

    units: Literal[
        "mm",
        "cm",
        "m",
        "in",
        "mil",
        "ft",
        None,
    ]
    """Units of a file that does not say them (default: the file's own, else mm)."""
    layers: str | Sequence[str] | None
    """Only these layers, with * and ? as wildcards (default: all that are on)."""
    strict: bool | None
    """Refuse a file in which anything had to be skipped or repaired, and a program that is dangerous as it is."""
    cut_layers: str | Sequence[str] | None
    """Layers that are cut, with * and ?; no others are then (default: all others)."""
    mark_layers: str | Sequence[str] | None
    """Layers that are marked, not cut through (default: MARK*, SCRIBE*, ENGRAV*, ETCH*)."""
    sheet_layers: str | Sequence[str] | None
    """Layers that show the edge of the sheet (default: SHEET*, PLATE*, STOCK* where they hold one outline round
    all else).
    """
    ignore_layers: str | Sequence[str] | None
    """Layers that are left out (default: none)."""
    join_tolerance: Quantity | None
    """Ends closer than this are one point (mm; default: 0.05mm)."""
    open_paths: Literal[
        "refuse",
        "cut",
        "mark",
        "drop",
        None,
    ]
    """What becomes of open paths on layers that are cut (default: refuse)."""
    machine: str | None
    """Name of a machine (see `leafcut machines`), or the path of a TOML profile (default: linuxcnc-mill)."""
    cut_process: str | None
    """Plasma, laser, oxyfuel or waterjet, or a name of the cut chart such as laser_fiber_3kW (default: what the
    machine is, else plasma).
    """
    sheet: str | Sequence[str] | None
    """Length and width of a sheet, such as 3000x1500 or 120inx60in; or several, with how many there are and what
    one costs, 3000x1500:4@180, and drawings of remnants; those are taken that cost least (default: as large as
    the table of --machine: 2500x1250 of plasma-table).
    """
    kerf: Quantity | None
    """Width of the cut (mm; default: 2mm)."""
    gap: Quantity | None
    """What stays between two parts besides the kerf (mm; default: 5mm)."""
    margin: Quantity | None
    """Strip along the edge of the sheet that stays free (mm; default: 10mm)."""
    rotations: str | Sequence[str] | None
    """Angles in which a part may lie, or free for any (default: 0,90,180,270)."""
    nester: Literal[
        "auto",
        "shapes",
        "rectangles",
        None,
    ]
    """How parts are laid: by their shapes, by the rectangles around them, or the one that suits them (default:
    auto).
    """
    max_sheets: int | None
    """Sheets at most; parts that find no room are told (default: as many as it takes)."""
    variants: int | None
    """Nests to offer, the best first (default: 3)."""
    all_variants: bool | None
    """Write every variant, not only the best."""
    blocks: Literal[
        "none",
        "pairs",
        "rows",
        "grids",
        None,
    ]
    """Lay equal parts in blocks, a kerf apart, to be cut with common lines: pairs, two rows at most (plasma,
    flame), or grids (laser, water) (default: none).
    """
    remnants_out: str | Path | None
    """Folder for drawings of what remains of the sheets, to be given as --sheet again (default: none)."""
    remnant_size: Quantity | None
    """A remnant is kept where it is so wide, and a disc of this diameter fits in (mm; default: 150mm)."""
    into_holes: bool | None
    """Lay small parts into the holes of large ones, where that saves sheet (on unless False)."""
    preset: Literal[
        "fast",
        "default",
        "thorough",
        None,
    ]
    """Budget of work, the same on every machine; the search ends sooner when the colonies agree, and but for
    thorough when more of it would take longer than it saves (default: default).
    """
    time_limit: Quantity | None
    """Stop after this time by the clock, or sooner, when five colonies in a row find nothing better (s; default:
    the preset's budget of work).
    """
    iterations: int | None
    """Stop after this many iterations (default: the preset's)."""
    seed: int | None
    """Start of the random numbers: same seed, same answer (default: 1)."""
    threads: int | None
    """Threads that ants run in; the answer does not depend on it (default: one per core)."""


class SolveKeywords(TypedDict, total=False):
    """Options of `leafcut.solve_part` and `leafcut.solve_file`."""

    units: Literal[
        "mm",
        "cm",
        "m",
        "in",
        "mil",
        "ft",
        None,
    ]
    """Units of a file that does not say them (default: the file's own, else mm)."""
    layers: str | Sequence[str] | None
    """Only these layers, with * and ? as wildcards (default: all that are on)."""
    min_diameter: Quantity | None
    """Leave out round holes smaller than this (mm; default: none)."""
    max_diameter: Quantity | None
    """Leave out round holes larger than this (mm; default: none)."""
    merge_tolerance: Quantity | None
    """Holes of one diameter closer than this are one hole (mm; default: 0.01mm)."""
    concentric: Literal[
        "smallest",
        "largest",
        "all",
        None,
    ]
    """Which of several circles with one centre is drilled (default: smallest)."""
    strict: bool | None
    """Refuse a file in which anything had to be skipped or repaired, and a program that is dangerous as it is."""
    algorithm: Literal[
        "auto",
        "colony",
        "as",
        "eas",
        "asrank",
        "mmas",
        "acs",
        "firefly",
        "kicks",
        "2opt",
        "nn",
        "none",
        None,
    ]
    """Name of an algorithm (see `leafcut algorithms`) (default: auto)."""
    preset: Literal[
        "fast",
        "default",
        "thorough",
        None,
    ]
    """Budget of work, the same on every machine; the search ends sooner when the colonies agree, and but for
    thorough when more of it would take longer than it saves (default: default).
    """
    time_limit: Quantity | None
    """Stop after this time by the clock, or sooner, when five colonies in a row find nothing better (s; default:
    the preset's budget of work).
    """
    iterations: int | None
    """Stop after this many iterations (default: the preset's)."""
    target_gap: float | str | None
    """Stop at this gap to the lower bound, in percent; it is found first (default: none)."""
    bound: bool | None
    """Find a lower bound and tell the gap to it, outside the time limit (on unless False)."""
    seed: int | None
    """Start of the random numbers: same seed, same answer (default: 1)."""
    threads: int | None
    """Threads that ants run in; the answer does not depend on it (default: one per core)."""
    candidates: int | None
    """Length of each node's candidate list; 0 for all nodes, as in the first papers (default: 8 for colony and
    kicks, else 16).
    """
    local_search: bool | None
    """Improve the tour of every ant or firefly by exchanges of edges (on unless False)."""
    n_ants: int | None
    """Ants per iteration (default: one per node; 25 with local search; 10 for acs)."""
    pheromone_weight: float | None
    """Weight of the pheromone (α) (default: 1)."""
    heuristic_weight: float | None
    """Weight of nearness (β) (default: 2)."""
    evaporation_rate: float | None
    """Part of the pheromone lost per iteration (ρ) (default: 0.5 as, eas · 0.1 asrank, acs · 0.02 mmas, 0.2 with
    local search).
    """
    elitist_weight: float | None
    """Deposits of the best tour so far (e of eas) (default: the number of ants)."""
    n_ranks: int | None
    """Ranks that deposit (w of asrank) (default: 6)."""
    greedy_probability: float | None
    """Chance to take the best edge (q0 of acs) (default: 0.9)."""
    local_evaporation_rate: float | None
    """Pheromone lost by an edge just used (ξ of acs) (default: 0.1)."""
    best_probability: float | None
    """Chance to rebuild the best tour at convergence; sets the trail limits (p_best of mmas) (default: 0.05)."""
    firefly_mode: Literal[
        "simple",
        "complex",
        None,
    ]
    """Which of the published settings stand for what is not given: those for simple or for complex pockets
    (default: simple).
    """
    n_fireflies: int | None
    """Fireflies in the swarm (n) (default: 11 in simple mode, 10 in complex)."""
    attractiveness: float | None
    """Inversions of one flight towards a tour close by (β0) (default: 20 in simple mode, 15 in complex)."""
    absorption: float | None
    """How fast they become fewer with the distance of two tours (γ): 10 when no edge is the same (default: 0.015)."""
    switch_at: float | str | None
    """Share of the iterations, or of the time limit, after which inversions are short (default: 27 in simple mode,
    37 in complex).
    """
    short_inversion: int | None
    """Nodes of the longest of the short inversions; long ones have as many as two tours have different edges
    (default: a quarter of all; 50 with local search).
    """
    firefly_patience: int | None
    """Iterations without a shorter tour after which the search ends (default: 20; with --time-limit none)."""
    firefly_start: Literal[
        "greedy",
        "random",
        None,
    ]
    """What fireflies begin with: greedy tours, each with edges changed a little, or tours at random (default:
    greedy).
    """


class SimulateKeywords(TypedDict, total=False):
    """Options of `leafcut.simulate`."""

    units: Literal[
        "mm",
        "cm",
        "m",
        "in",
        "mil",
        "ft",
        None,
    ]
    """Units of a file that does not say them (default: the file's own, else mm)."""
    strict: bool | None
    """Refuse a file in which anything had to be skipped or repaired, and a program that is dangerous as it is."""
    machine: str | None
    """Name of a machine (see `leafcut machines`), or the path of a TOML profile (default: linuxcnc-mill)."""
    work_offset: str | Sequence[Quantity] | None
    """Program zero in machine coordinates, x,y,z (mm; default: the machine's own, else unknown)."""
    thickness: Quantity | None
    """Thickness of the plate, through which holes go, or of the sheet that is cut (mm; default: holes are not
    through).
    """
    clearance_height: Quantity | None
    """Initial plane: safe height over the part and its clamps (mm; default: 10mm)."""
    material: str | None
    """Material, as the cut chart names it; of a pocket it says how fast an assumed mill turns (default:
    mild_steel).
    """
    cut_process: str | None
    """Plasma, laser, oxyfuel or waterjet, or a name of the cut chart such as laser_fiber_3kW (default: what the
    machine is, else plasma).
    """
    amps: float | None
    """Current, where the chart has several (default: the fastest of the chart that pierces the sheet)."""
    chart: str | Path | None
    """Your own cut chart, a CSV file (default: the shipped one)."""
    cut_speed: Quantity | None
    """Cutting speed (mm/min; default: the chart's)."""


class VerifyKeywords(TypedDict, total=False):
    """Options of `leafcut.verify_programs`."""

    units: Literal[
        "mm",
        "cm",
        "m",
        "in",
        "mil",
        "ft",
        None,
    ]
    """Units of a file that does not say them (default: the file's own, else mm)."""
    machine: str | None
    """Name of a machine (see `leafcut machines`), or the path of a TOML profile (default: linuxcnc-mill)."""
    work_offset: str | Sequence[Quantity] | None
    """Program zero in machine coordinates, x,y,z (mm; default: the machine's own, else unknown)."""
    thickness: Quantity | None
    """Thickness of the plate, through which holes go, or of the sheet that is cut (mm; default: holes are not
    through).
    """
    material: str | None
    """Material, as the cut chart names it; of a pocket it says how fast an assumed mill turns (default:
    mild_steel).
    """
    cut_process: str | None
    """Plasma, laser, oxyfuel or waterjet, or a name of the cut chart such as laser_fiber_3kW (default: what the
    machine is, else plasma).
    """
    amps: float | None
    """Current, where the chart has several (default: the fastest of the chart that pierces the sheet)."""
    chart: str | Path | None
    """Your own cut chart, a CSV file (default: the shipped one)."""
    cut_speed: Quantity | None
    """Cutting speed (mm/min; default: the chart's)."""
