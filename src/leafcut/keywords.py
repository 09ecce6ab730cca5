"""The options as keywords of the library's functions, for editors and type checkers; None is "not given".

Made by `.ci/make_keywords.py` from the options; do not edit by hand.
"""

# Annotations are types at once: as texts each would be compiled when the module is imported.
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
    """Units of a file that does not state them (default: the file's, else mm)."""
    layers: str | Sequence[str] | None
    """Read only these layers; * and ? are wildcards (default: all visible layers)."""
    min_diameter: Quantity | None
    """Skip round holes smaller than this (mm; default: none)."""
    max_diameter: Quantity | None
    """Skip round holes larger than this (mm; default: none)."""
    merge_tolerance: Quantity | None
    """Merge holes of equal diameter closer than this (mm; default: 0.01mm)."""
    concentric: Literal[
        "smallest",
        "largest",
        "all",
        None,
    ]
    """Which of several concentric circles to drill (default: smallest)."""
    solid: int | None
    """Which solid of a STEP file with several, by its number: without it they are listed (default: the file's only
    one).
    """
    mirror: Literal[
        "x",
        "y",
        None,
    ]
    """Mirror the drawing: x reverses X (a board flipped sideways), y reverses Y (default: as drawn)."""
    rotate: Quantity | None
    """Rotate the drawing about its zero, counter-clockwise, after mirroring (deg)."""
    origin: str | Sequence[Quantity] | None
    """Program zero, set after rotating: lower-left, lower-right, upper-left, upper-right or centre of the geometry
    (hole centres), or a point x,y (mm; default: the drawing's zero).
    """
    strict: bool | None
    """Refuse input with skipped or repaired entities, and programs with dangerous moves."""
    cut_layers: str | Sequence[str] | None
    """Layers to cut; * and ? are wildcards (default: all others)."""
    mark_layers: str | Sequence[str] | None
    """Layers to mark, not cut through (default: MARK*, SCRIBE*, ENGRAV*, ETCH*)."""
    sheet_layers: str | Sequence[str] | None
    """Layers with the sheet outline (default: SHEET*, PLATE*, STOCK* if they hold one outline around everything
    else).
    """
    ignore_layers: str | Sequence[str] | None
    """Layers to ignore (default: none)."""
    join_tolerance: Quantity | None
    """Join line ends closer than this (mm; default: 0.05mm)."""
    open_paths: Literal[
        "refuse",
        "cut",
        "mark",
        "drop",
        None,
    ]
    """What to do with open paths on cut layers (default: refuse)."""
    machine: str | None
    """Machine name (see `leafcut machines`), or path of a TOML profile (default: linuxcnc-mill)."""
    work_offset: str | Sequence[Quantity] | None
    """Work offset: program zero in machine coordinates, x,y,z (mm; default: the machine's, else unknown)."""
    tools: str | Path | None
    """Tool library: TOML, LinuxCNC .tbl, Fusion .json or .tools, FreeCAD .fctl, a table .csv (default: one assumed
    drill per diameter).
    """
    depth: Quantity | None
    """Depth of blind holes or pockets below Z0 (mm; default: from --thickness, else 1 mm (spotting))."""
    thickness: Quantity | None
    """Thickness of the plate (holes go through), or of the sheet to cut (mm; default: unknown: holes are blind)."""
    break_through: Quantity | None
    """Break-through: how far through holes go below the plate (mm; default: 0.5mm)."""
    clearance_height: Quantity | None
    """Clearance height (initial plane): safe above part and clamps (mm; default: 10mm)."""
    retract_height: Quantity | None
    """Retract height (R plane): where rapid changes to feed (mm; default: 2mm)."""
    retract: Literal[
        "r",
        "initial",
        None,
    ]
    """Retract after a hole to the R plane (G99) or the initial plane (G98) (default: r)."""
    keep_out: str | Sequence[str] | None
    """Keep-out zones such as clamps: rectangles 'x0 y0 x1 y1' in mm, separated by commas; no cuts inside, rapids
    cross at --clearance-height or go around, with the tool radius as margin (default: none).
    """
    spindle_speed: Quantity | None
    """Spindle speed of assumed drills, or of the end mill (rpm; default: 20 m/min surface speed; for end mills
    from the tool library or --material).
    """
    diameter_tolerance: Quantity | None
    """Largest difference between tool and hole diameter (mm; default: 0.05mm)."""
    material: str | None
    """Material, by its name in the cut chart; for pockets it sets the speed of an assumed end mill; for cutting-
    data and for feeds of a program a name of `leafcut materials`, or a TOML file (default: mild_steel).
    """
    start_point: str | Sequence[Quantity] | None
    """Start point of the tool, x,y, or free; for a program, its position before the first rapid (mm; default:
    0,0).
    """
    end_point: str | Sequence[Quantity] | None
    """End point of the tool, x,y, or free (mm; default: at the last hole)."""
    keep_order: bool | None
    """Keep the given order; a program is only timed."""
    cut_process: str | None
    """Cutting process: plasma, laser, oxyfuel, waterjet, or a name in the cut chart such as laser_fiber_3kW
    (default: the machine's, else plasma).
    """
    amps: float | None
    """Cutting current, if the chart has several (default: the fastest in the chart that can pierce the sheet)."""
    nozzle: str | None
    """Nozzle, if the chart has several (default: any in the chart)."""
    chart: str | Path | None
    """Cut chart of your own, a CSV file (default: leafcut's chart)."""
    cut_speed: Quantity | None
    """Cutting speed (mm/min; default: the chart's)."""
    depth_to: Literal[
        "shoulder",
        "tip",
        None,
    ]
    """Depth reference: full diameter (shoulder) or drill point (tip) (default: shoulder)."""
    hole_heights: Literal[
        "one",
        "drawn",
        None,
    ]
    """Height at which holes begin: one for all, which becomes Z0, or each its own as drawn, with ways at
    --clearance-height over the highest; Z0 is then that of the drawing (default: one).
    """
    surface: str | Path | None
    """STL file of the part or its blank, with the zero of the drawing: each hole begins on it, and ways between
    holes are as low as it allows (default: flat).
    """
    surface_unit: Literal[
        "mm",
        "in",
        "cm",
        "m",
        None,
    ]
    """Unit of the STL files (default: mm)."""
    surface_clearance: Quantity | None
    """How far ways stay from the surface and from fixtures, above and aside (mm; default: 2mm)."""
    through: bool | None
    """Drill each hole through the part, as thick as the surface is there."""
    fixture: str | Sequence[str] | None
    """Boxes that stand on the surface, such as clamps: 'x0 y0 z0 x1 y1 z1' in mm, separated by commas; ways go
    over (default: none).
    """
    fixture_file: str | Path | None
    """STL or STEP file of what holds the part, such as clamps or a vise, with the zero of the surface; ways go
    over (default: none).
    """
    tool_change_height: Quantity | None
    """Tool change height, for machines without one of their own (mm; default: 25mm)."""
    cycle: Literal[
        "G81",
        "G82",
        "G83",
        "G73",
        "G84",
        "G85",
        None,
    ]
    """Drilling cycle for tools without one in the library (default: G83 with --peck, G82 with --dwell, else G81)."""
    peck: Quantity | None
    """Peck depth (Q of G83 and G73) (mm; default: no pecking)."""
    dwell: Quantity | None
    """Dwell at the bottom (P of G82) (s; default: none)."""
    feed: Quantity | None
    """Feed rate of assumed drills (mm/min; default: 0.02 diameters per revolution)."""
    centre_drill: bool | None
    """Centre-drill every hole first, with the library's centre drill."""
    hole_order: str | Path | None
    """Order file: drill these holes first, in this order; the search orders the rest (default: none)."""
    mark_speed: Quantity | None
    """Marking speed, with a laser or a scribe (mm/min; default: 2500 mm/min, or the machine's highest feed rate if
    lower).
    """
    kerf_width: Quantity | None
    """Kerf width (mm; default: the chart's)."""
    pierce_delay: Quantity | None
    """Pierce delay after the torch turns on (s; default: the chart's)."""
    pierce_height: Quantity | None
    """Torch height for piercing (mm; default: the chart's)."""
    cut_height: Quantity | None
    """Torch height for cutting (mm; default: the chart's)."""
    probe: Literal[
        "auto",
        "on",
        "off",
        None,
    ]
    """Probe the sheet before every pierce (G38.2), if the program moves Z (default: auto: if the machine profile
    has a probe).
    """
    switch_offset: Quantity | None
    """Switch offset: Z travel from touching the sheet until the probe switch trips (mm; default: the machine's)."""
    compensation: Literal[
        "geometry",
        "controller",
        "none",
        None,
    ]
    """Kerf compensation: in the path (geometry), by the controller (G41, G42), or none (default: geometry)."""
    direction: Literal[
        "auto",
        "clockwise",
        "counter-clockwise",
        "free",
        None,
    ]
    """Cutting direction of outlines; holes run the other way (default: auto: clockwise for plasma and oxyfuel,
    else free).
    """
    lead_in: Literal[
        "auto",
        "line",
        "arc",
        "none",
        None,
    ]
    """Shape of the lead-in (default: auto: arc for plasma and oxyfuel, else line)."""
    lead_out: Literal[
        "auto",
        "line",
        "arc",
        "none",
        None,
    ]
    """Shape of the lead-out (default: auto: as the lead-in for outlines by plasma or oxyfuel, else none)."""
    lead_in_length: Quantity | None
    """Length of the lead-in (mm; default: plasma 6, oxyfuel 15, or the thickness if larger; laser and water 3
    kerfs, at least 2).
    """
    lead_out_length: Quantity | None
    """Length of the lead-out (mm; default: as the lead-in, at least 6)."""
    lead_angle: Quantity | None
    """Lead angle: of a line to the contour, or swept by an arc (deg; default: 90deg)."""
    overcut: Quantity | None
    """Overcut past the start of a closed contour; with the torch off if the controller can (mm; default: 4 mm for
    plasma holes, else 0).
    """
    small_hole: Quantity | None
    """Small holes, below this diameter, are cut slower, from near the centre, without a lead-out (mm; default: 32
    mm for plasma, else 0).
    """
    small_hole_speed: float | str | None
    """Speed in small holes, percent of the cutting speed (default: 60%)."""
    corner_loops: bool | None
    """Loop through the scrap at sharp outer corners, if there is room."""
    loop_angle: Quantity | None
    """Loop at corners sharper than this (deg; default: 100deg)."""
    loop_length: Quantity | None
    """Loop length past the corner (mm; default: half the lead-in length)."""
    micro_joints: int | None
    """Number of micro-joints that hold each part."""
    joint_holes: bool | None
    """Add micro-joints to holes too, except small ones, to hold the slugs."""
    joint_width: Quantity | None
    """Width of a micro-joint (mm; default: 0.5mm)."""
    chains: bool | None
    """Chain-cut neighbouring outlines with one pierce, through the scrap, if that is faster."""
    chain_contours: int | None
    """Maximum contours per chain (default: 12)."""
    chain_bridge: Quantity | None
    """Longest bridge through the scrap between outlines of a chain (mm; default: as long as it is faster than a
    pierce).
    """
    common_lines: bool | None
    """Common-line cutting: cut edges one kerf apart once for both parts."""
    pierce_pitch: Quantity | None
    """Spacing of candidate pierce points along a contour (mm; default: a sixteenth of the contour, between 10 and
    100 mm).
    """
    start_at: Literal[
        "any",
        "corners",
        None,
    ]
    """Allowed start points on a contour: any, or corners only (default: any)."""
    edge_start: Literal[
        "auto",
        "always",
        "never",
        None,
    ]
    """Edge start: start outlines outside the sheet, without a pierce (default: auto: above the pierce capacity)."""
    splash: Quantity | None
    """Splash radius of a pierce, kept clear of parts if there is room (mm; default: one kerf)."""
    heat_distance: Quantity | None
    """Minimum distance between consecutive starts (mm)."""
    heat_time: Quantity | None
    """Minimum time between starts closer than --heat-distance (s; default: 0: applies to the next start only)."""
    sweep: Literal[
        "free",
        "x",
        "y",
        None,
    ]
    """Cut parts in bands along an axis, to keep the rest of the sheet flat (default: free)."""
    sweep_width: Quantity | None
    """Band width (mm; default: a fifth of the sheet, or its largest part)."""
    start_corner: Literal[
        "free",
        "lower-left",
        "lower-right",
        "upper-left",
        "upper-right",
        None,
    ]
    """Sheet corner where cutting begins (default: free)."""
    sheet_size: str | None
    """Sheet size, such as 3000x1500, with its lower left corner at 0,0 (default: the outline in the drawing, else
    unknown).
    """
    sheet_margin: Quantity | None
    """Minimum distance of leads from the sheet edge (mm)."""
    plan: str | Path | None
    """Plan file with fixed choices to keep (default: none)."""
    save_plan: str | Path | None
    """Plan file to write (default: none)."""
    save_norms: str | Path | None
    """CSV file to write: norms of time and consumption by part, sheet and batch (default: none)."""
    quantity: int | None
    """Number of sheets in the batch (default: 1)."""
    gas_rate: float | None
    """Gas or abrasive cost per hour of cutting."""
    power_rate: float | None
    """Power cost per hour of cutting."""
    consumables_rate: float | None
    """Consumables cost per hour of cutting."""
    pierce_cost: float | None
    """Consumables cost per pierce."""
    machine_rate: float | None
    """Machine and operator cost per hour."""
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
    """Clearing strategy; best tries all and writes the fastest (default: best)."""
    tool_diameter: Quantity | None
    """Diameter of the flat end mill (mm; default: required without a tool library)."""
    tool_number: int | None
    """Tool number of the end mill, also in the tool library (default: 1; with a library its end mill of that
    diameter, or its only one).
    """
    step_over: float | str | None
    """Maximum step-over, as a share of the tool diameter (default: 0.6)."""
    point_distance: float | str | None
    """Grid spacing as a share of the tool diameter: 0.5 to 0.7, and no more than the step-over (default: the step-
    over, at most 0.6).
    """
    pocket_top: Literal[
        "highest",
        "surface",
        None,
    ]
    """Where the material of a solid's pockets begins: at its highest place, or at the surface around each, where
    all else of the solid is milled already (default: highest).
    """
    step_down: Quantity | None
    """Step-down: depth per level (mm; default: half the tool diameter)."""
    stock: Quantity | None
    """Stock that roughing leaves on the walls for the finishing pass (mm)."""
    finishing_pass: bool | None
    """Finish every wall after zigzag and grid strategies (on unless False)."""
    closed_path: bool | None
    """Come back to the start of the path on each level, so that the tool is not lifted between levels."""
    milling: Literal[
        "climb",
        "conventional",
        None,
    ]
    """Milling direction (default: climb)."""
    zigzag_angle: Quantity | None
    """Zigzag angle (deg; default: the best of twelve angles)."""
    max_engagement: Quantity | None
    """Maximum tool engagement angle (deg; default: unlimited)."""
    entry: Literal[
        "ramp",
        "helix",
        "plunge",
        "predrilled",
        None,
    ]
    """Entry move to each level (default: ramp: along the start of the path)."""
    entry_angle: Quantity | None
    """Maximum ramp angle (deg; default: 3deg)."""
    plunge_feed: Quantity | None
    """Plunge rate (mm/min; default: the tool library's, else a third of the feed rate)."""
    milling_feed: Quantity | None
    """Feed rate of the end mill (mm/min; default: the tool library's, else two teeth at 1 % of the diameter, at
    most 0.05 mm, per tooth).
    """
    air_feed: Quantity | None
    """Feed rate at depth through cleared area; not below the milling feed (mm/min; default: the machine's highest
    feed rate).
    """
    uncovered_tolerance: float | str | None
    """Warn if more than this share of the reachable area stays uncut (default: 0.1%)."""
    merge_tools: bool | None
    """Merge sections of the same tool where it is safe."""
    allow_reverse: bool | None
    """Cut open paths of constant depth from either end; only if climb milling and lead-ins do not matter (slots,
    engraving, laser).
    """
    mix_operations: bool | None
    """Mix operations that the program's comments separate; cuts that free a part stay after the work before them."""
    renumber: bool | None
    """Renumber blocks, in steps of 10."""
    air: bool | None
    """Make fed moves in the air rapids, where the stock shows that they keep clear of all material."""
    low_retracts: bool | None
    """Lower retracts and R planes to just above what stands under the way; clamps are not known: name them with
    --keep-out; needs --workpiece.
    """
    air_clearance: Quantity | None
    """How far the ways that --air and --low-retracts change keep from all material (mm; default: 1mm)."""
    pocket_layers: str | Sequence[str] | None
    """Layers with pocket outlines; * and ? are wildcards (default: POCKET* if present)."""
    island_layers: str | Sequence[str] | None
    """Layers with island outlines; * and ? are wildcards (default: ISLAND* if present)."""
    pixel_size: Quantity | None
    """Pixel size of the picture (mm; default: required for pictures)."""
    threshold: float | str | None
    """Brightness threshold: mill pixels darker than this (default: Otsu's method)."""
    speckle: Quantity | None
    """Ignore spots in a picture narrower than this (mm; default: 1mm)."""
    invert: bool | None
    """Mill the bright areas of a picture."""
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
    """Algorithm (see `leafcut algorithms`) (default: auto)."""
    preset: Literal[
        "fast",
        "default",
        "thorough",
        None,
    ]
    """Search effort; the result is the same on every machine (default: default)."""
    objective: Literal[
        "time",
        "distance",
        None,
    ]
    """Quantity to minimise: machine time or travel distance (default: time)."""
    time_limit: Quantity | None
    """Stop after this time, or sooner when five colonies in a row find no improvement (s; default: the preset
    decides).
    """
    iterations: int | None
    """Stop after this many iterations (default: the preset decides)."""
    target_gap: float | str | None
    """Stop at this gap to the lower bound, in percent; the bound is computed first (default: none)."""
    bound: bool | None
    """Compute a lower bound and report the gap; a tenth of --time-limit is kept for it, except in `solve` (on
    unless False).
    """
    seed: int | None
    """Random seed: same seed, same result (default: 1)."""
    threads: int | None
    """Number of threads; does not change the result (default: one per core)."""
    colonies: int | None
    """So many colonies live apart and exchange their best tours; their number is part of the result (default: one,
    on all threads).
    """
    colonies_on: str | None
    """Where the colonies live: threads, processes, or dask://host:port; does not change the result (default:
    threads).
    """
    candidates: int | None
    """Candidate list length per node; 0 for all nodes, as in the original papers (default: 8 for colony and kicks,
    else 16).
    """
    local_search: bool | None
    """Improve the tour of every ant or firefly by local search (on unless False)."""
    n_ants: int | str | None
    """Ants per iteration (m); parts: one per part of a sheet, else one per node (default: one per node; 25 with
    local search; 10 for acs).
    """
    pheromone_weight: float | None
    """Pheromone weight (α) (default: 1)."""
    heuristic_weight: float | None
    """Heuristic weight: how much short edges are preferred (β) (default: 2)."""
    evaporation_rate: float | None
    """Evaporation rate: share of pheromone lost per iteration (ρ) (default: 0.5 as, eas · 0.1 asrank, acs · 0.02
    mmas, 0.2 with local search).
    """
    initial_pheromone: float | str | None
    """Pheromone on every edge at the start (τ₀); random: a random share of 1/(nC) on each; r stands for ρ
    (default: from the nearest-neighbour tour).
    """
    parallel: Literal[
        "threads",
        "processes",
        "exchange",
        None,
    ]
    """Parallel ants: threads; processes, to which a master sends its pheromone; exchange: processes with pheromone
    of their own that send each other their changes (default: threads).
    """
    n_processes: int | None
    """Number of worker processes; part of the result where they exchange changes (default: 2)."""
    device: Literal[
        "cpu",
        "gpu",
        None,
    ]
    """What builds the tours of the ants: gpu, one ant to a thread of a CUDA GPU (default: cpu)."""
    elitist_weight: float | None
    """Weight of the best tour's deposit (e of eas) (default: the number of ants)."""
    n_ranks: int | None
    """Number of ranks that deposit (w of asrank) (default: 6)."""
    greedy_probability: float | None
    """Probability of taking the best edge (q₀ of acs) (default: 0.9)."""
    local_evaporation_rate: float | None
    """Local evaporation on each edge used (ξ of acs) (default: 0.1)."""
    best_probability: float | None
    """Probability of rebuilding the best tour at convergence; sets the trail limits (p_best of mmas) (default:
    0.05).
    """
    variant: Literal[
        "leafcut",
        "published",
        None,
    ]
    """Firefly variant; published: position-wise distances, the n best of m × n moves, no local search (default:
    leafcut).
    """
    firefly_mode: Literal[
        "simple",
        "complex",
        None,
    ]
    """Published settings to start from: for simple or for complex pockets (default: simple)."""
    n_fireflies: int | None
    """Number of fireflies (n) (default: 11 in simple mode, 10 in complex)."""
    attractiveness: float | None
    """Attractiveness: inversions per move towards a near tour (β₀); tried per move where published (default: 20 in
    simple mode, 15 in complex).
    """
    absorption: float | None
    """Absorption: how fast attractiveness falls with tour distance (γ) (default: 0.015)."""
    switch_at: float | str | None
    """Switch to short inversions after this share of the iterations or time limit (default: 27 in simple mode, 37
    in complex).
    """
    short_inversion: int | None
    """Longest short inversion, in nodes: the size of a random step (α) (default: a quarter of the nodes; 50 with
    local search).
    """
    firefly_patience: int | None
    """Stop after this many iterations without improvement (default: 20; unlimited with --time-limit)."""
    firefly_start: Literal[
        "greedy",
        "random",
        None,
    ]
    """Initial tours: greedy with small changes, or random (default: greedy; random in the published variant)."""
    dialect: str | None
    """Dialect of the controller (see `leafcut dialects`), or path of a TOML file (default: the machine's)."""
    output_units: Literal[
        "mm",
        "inch",
        None,
    ]
    """Units of the program (default: mm)."""
    line_numbers: bool | None
    """Number the blocks N10, N20, …."""
    program_number: int | None
    """Program number, O0001 (default: 1)."""
    header: bool | None
    """Write header comments: source, options, tools, extents, time (on unless False)."""
    date: bool | None
    """Write date and time in the header."""
    repeat_words: bool | None
    """Repeat modal words on every block."""
    coolant: bool | None
    """Turn coolant on while cutting."""
    preselect_tool: bool | None
    """After each tool change, name the next tool (T without M6), so that the magazine has it ready."""
    optional_stop: bool | None
    """Optional stop (M1) before each tool change."""
    beam_power: int | None
    """Laser power for cutting, S word (GRBL: value of $30) (default: 1000)."""
    mark_power: int | None
    """Laser power for marking, S word (default: 200)."""
    path_tolerance: Quantity | None
    """Path tolerance: how far the torch may round corners to keep speed (G64 P); 0 for exact path (mm; default:
    0.1mm).
    """
    material_number: int | None
    """Material number in the controller's table (QtPlasmaC M190); the controller then sets the feed (default:
    cutting data are written in the program).
    """
    workpiece: str | None
    """Material before the first cut, in program coordinates: x,y,z of the lower and of the upper corner of a
    block, or an STL file in mm, or a STEP file (default: as the program shows: just around the cuts below Z0
    (stock), or where no rapid has been (reorder --air)).
    """
    cell: Quantity | None
    """Side of a cell of the stock model: 4 bytes each, at most 64 million (256 MB) (mm; default: a fortieth of the
    smallest tool, up to a fifth of it for a large stock).
    """
    mill_diameter: Quantity | None
    """Diameter of tools that neither --tools nor the program's comments describe; they count as flat mills (mm;
    default: such a tool is refused).
    """
    feeds: bool | None
    """Fit the feeds of milling tools to their chips: faster where the tool meets less than in its worst cut,
    slower where that is more than its data allow; a foreign program needs --workpiece, too.
    """
    feed_increase: float | str | None
    """How much --feeds raises a feed at most, in percent (default: 50%)."""
    slot_chip: float | str | None
    """Thickest chip where a mill cuts its whole width, in percent of the one that its data allow; from half of the
    width on in proportion (default: no less than elsewhere).
    """
    max_power: Quantity | None
    """Limit of the spindle's power (kW; default: the machine's, else none)."""
    max_torque: Quantity | None
    """Limit of the spindle's torque (N·m; default: the machine's, else none)."""
    drive_efficiency: float | str | None
    """Part of the spindle's power that reaches the tool (default: 0.75)."""


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
    """Units of a file that does not state them (default: the file's, else mm)."""
    layers: str | Sequence[str] | None
    """Read only these layers; * and ? are wildcards (default: all visible layers)."""
    solid: int | None
    """Which solid of a STEP file with several, by its number: without it they are listed (default: the file's only
    one).
    """
    strict: bool | None
    """Refuse input with skipped or repaired entities, and programs with dangerous moves."""
    cut_layers: str | Sequence[str] | None
    """Layers to cut; * and ? are wildcards (default: all others)."""
    mark_layers: str | Sequence[str] | None
    """Layers to mark, not cut through (default: MARK*, SCRIBE*, ENGRAV*, ETCH*)."""
    sheet_layers: str | Sequence[str] | None
    """Layers with the sheet outline (default: SHEET*, PLATE*, STOCK* if they hold one outline around everything
    else).
    """
    ignore_layers: str | Sequence[str] | None
    """Layers to ignore (default: none)."""
    join_tolerance: Quantity | None
    """Join line ends closer than this (mm; default: 0.05mm)."""
    open_paths: Literal[
        "refuse",
        "cut",
        "mark",
        "drop",
        None,
    ]
    """What to do with open paths on cut layers (default: refuse)."""
    machine: str | None
    """Machine name (see `leafcut machines`), or path of a TOML profile (default: linuxcnc-mill)."""
    cut_process: str | None
    """Cutting process: plasma, laser, oxyfuel, waterjet, or a name in the cut chart such as laser_fiber_3kW
    (default: the machine's, else plasma).
    """
    sheet: str | Sequence[str] | None
    """Sheet size, such as 3000x1500 or 120inx60in, with count and price 3000x1500:4@180, or a drawing of a
    remnant; several are allowed, the cheapest are used (default: the table of --machine; 2500x1250 for plasma-
    table).
    """
    kerf: Quantity | None
    """Kerf width (mm; default: 2mm)."""
    gap: Quantity | None
    """Gap between parts, in addition to the kerf (mm; default: 5mm)."""
    margin: Quantity | None
    """Margin along the sheet edge (mm; default: 10mm)."""
    rotations: str | Sequence[str] | None
    """Allowed rotations of parts, or free for any (default: 0,90,180,270)."""
    nester: Literal[
        "auto",
        "shapes",
        "rectangles",
        None,
    ]
    """Nesting method: by true shapes, by bounding rectangles, or whichever suits the parts (default: auto)."""
    max_sheets: int | None
    """Maximum number of sheets; parts that do not fit are reported (default: as many as needed)."""
    variants: int | None
    """Number of nests to offer, best first (default: 3)."""
    all_variants: bool | None
    """Write every variant, not only the best."""
    blocks: Literal[
        "none",
        "pairs",
        "rows",
        "grids",
        None,
    ]
    """Group equal parts one kerf apart for common-line cutting: pairs, two rows (plasma, oxyfuel), or grids
    (laser, water) (default: none).
    """
    remnants_out: str | Path | None
    """Folder for drawings of the remnants, for use as --sheet (default: none)."""
    remnant_size: Quantity | None
    """Minimum width of a remnant to keep (mm; default: 150mm)."""
    into_holes: bool | None
    """Nest small parts in holes of large ones, if that saves sheet (on unless False)."""
    preset: Literal[
        "fast",
        "default",
        "thorough",
        None,
    ]
    """Search effort; the result is the same on every machine (default: default)."""
    time_limit: Quantity | None
    """Stop after this time, or sooner when five colonies in a row find no improvement (s; default: the preset
    decides).
    """
    iterations: int | None
    """Stop after this many iterations (default: the preset decides)."""
    seed: int | None
    """Random seed: same seed, same result (default: 1)."""
    threads: int | None
    """Number of threads; does not change the result (default: one per core)."""


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
    """Units of a file that does not state them (default: the file's, else mm)."""
    layers: str | Sequence[str] | None
    """Read only these layers; * and ? are wildcards (default: all visible layers)."""
    min_diameter: Quantity | None
    """Skip round holes smaller than this (mm; default: none)."""
    max_diameter: Quantity | None
    """Skip round holes larger than this (mm; default: none)."""
    merge_tolerance: Quantity | None
    """Merge holes of equal diameter closer than this (mm; default: 0.01mm)."""
    concentric: Literal[
        "smallest",
        "largest",
        "all",
        None,
    ]
    """Which of several concentric circles to drill (default: smallest)."""
    solid: int | None
    """Which solid of a STEP file with several, by its number: without it they are listed (default: the file's only
    one).
    """
    strict: bool | None
    """Refuse input with skipped or repaired entities, and programs with dangerous moves."""
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
    """Algorithm (see `leafcut algorithms`) (default: auto)."""
    preset: Literal[
        "fast",
        "default",
        "thorough",
        None,
    ]
    """Search effort; the result is the same on every machine (default: default)."""
    time_limit: Quantity | None
    """Stop after this time, or sooner when five colonies in a row find no improvement (s; default: the preset
    decides).
    """
    iterations: int | None
    """Stop after this many iterations (default: the preset decides)."""
    target_gap: float | str | None
    """Stop at this gap to the lower bound, in percent; the bound is computed first (default: none)."""
    bound: bool | None
    """Compute a lower bound and report the gap; a tenth of --time-limit is kept for it, except in `solve` (on
    unless False).
    """
    seed: int | None
    """Random seed: same seed, same result (default: 1)."""
    threads: int | None
    """Number of threads; does not change the result (default: one per core)."""
    colonies: int | None
    """So many colonies live apart and exchange their best tours; their number is part of the result (default: one,
    on all threads).
    """
    colonies_on: str | None
    """Where the colonies live: threads, processes, or dask://host:port; does not change the result (default:
    threads).
    """
    candidates: int | None
    """Candidate list length per node; 0 for all nodes, as in the original papers (default: 8 for colony and kicks,
    else 16).
    """
    local_search: bool | None
    """Improve the tour of every ant or firefly by local search (on unless False)."""
    n_ants: int | str | None
    """Ants per iteration (m); parts: one per part of a sheet, else one per node (default: one per node; 25 with
    local search; 10 for acs).
    """
    pheromone_weight: float | None
    """Pheromone weight (α) (default: 1)."""
    heuristic_weight: float | None
    """Heuristic weight: how much short edges are preferred (β) (default: 2)."""
    evaporation_rate: float | None
    """Evaporation rate: share of pheromone lost per iteration (ρ) (default: 0.5 as, eas · 0.1 asrank, acs · 0.02
    mmas, 0.2 with local search).
    """
    initial_pheromone: float | str | None
    """Pheromone on every edge at the start (τ₀); random: a random share of 1/(nC) on each; r stands for ρ
    (default: from the nearest-neighbour tour).
    """
    parallel: Literal[
        "threads",
        "processes",
        "exchange",
        None,
    ]
    """Parallel ants: threads; processes, to which a master sends its pheromone; exchange: processes with pheromone
    of their own that send each other their changes (default: threads).
    """
    n_processes: int | None
    """Number of worker processes; part of the result where they exchange changes (default: 2)."""
    device: Literal[
        "cpu",
        "gpu",
        None,
    ]
    """What builds the tours of the ants: gpu, one ant to a thread of a CUDA GPU (default: cpu)."""
    elitist_weight: float | None
    """Weight of the best tour's deposit (e of eas) (default: the number of ants)."""
    n_ranks: int | None
    """Number of ranks that deposit (w of asrank) (default: 6)."""
    greedy_probability: float | None
    """Probability of taking the best edge (q₀ of acs) (default: 0.9)."""
    local_evaporation_rate: float | None
    """Local evaporation on each edge used (ξ of acs) (default: 0.1)."""
    best_probability: float | None
    """Probability of rebuilding the best tour at convergence; sets the trail limits (p_best of mmas) (default:
    0.05).
    """
    variant: Literal[
        "leafcut",
        "published",
        None,
    ]
    """Firefly variant; published: position-wise distances, the n best of m × n moves, no local search (default:
    leafcut).
    """
    firefly_mode: Literal[
        "simple",
        "complex",
        None,
    ]
    """Published settings to start from: for simple or for complex pockets (default: simple)."""
    n_fireflies: int | None
    """Number of fireflies (n) (default: 11 in simple mode, 10 in complex)."""
    attractiveness: float | None
    """Attractiveness: inversions per move towards a near tour (β₀); tried per move where published (default: 20 in
    simple mode, 15 in complex).
    """
    absorption: float | None
    """Absorption: how fast attractiveness falls with tour distance (γ) (default: 0.015)."""
    switch_at: float | str | None
    """Switch to short inversions after this share of the iterations or time limit (default: 27 in simple mode, 37
    in complex).
    """
    short_inversion: int | None
    """Longest short inversion, in nodes: the size of a random step (α) (default: a quarter of the nodes; 50 with
    local search).
    """
    firefly_patience: int | None
    """Stop after this many iterations without improvement (default: 20; unlimited with --time-limit)."""
    firefly_start: Literal[
        "greedy",
        "random",
        None,
    ]
    """Initial tours: greedy with small changes, or random (default: greedy; random in the published variant)."""


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
    """Units of a file that does not state them (default: the file's, else mm)."""
    strict: bool | None
    """Refuse input with skipped or repaired entities, and programs with dangerous moves."""
    machine: str | None
    """Machine name (see `leafcut machines`), or path of a TOML profile (default: linuxcnc-mill)."""
    work_offset: str | Sequence[Quantity] | None
    """Work offset: program zero in machine coordinates, x,y,z (mm; default: the machine's, else unknown)."""
    thickness: Quantity | None
    """Thickness of the plate (holes go through), or of the sheet to cut (mm; default: unknown: holes are blind)."""
    clearance_height: Quantity | None
    """Clearance height (initial plane): safe above part and clamps (mm; default: 10mm)."""
    material: str | None
    """Material, by its name in the cut chart; for pockets it sets the speed of an assumed end mill; for cutting-
    data and for feeds of a program a name of `leafcut materials`, or a TOML file (default: mild_steel).
    """
    cut_process: str | None
    """Cutting process: plasma, laser, oxyfuel, waterjet, or a name in the cut chart such as laser_fiber_3kW
    (default: the machine's, else plasma).
    """
    amps: float | None
    """Cutting current, if the chart has several (default: the fastest in the chart that can pierce the sheet)."""
    nozzle: str | None
    """Nozzle, if the chart has several (default: any in the chart)."""
    chart: str | Path | None
    """Cut chart of your own, a CSV file (default: leafcut's chart)."""
    cut_speed: Quantity | None
    """Cutting speed (mm/min; default: the chart's)."""


class StockKeywords(TypedDict, total=False):
    """Options of `leafcut.cut_stock`."""

    units: Literal[
        "mm",
        "cm",
        "m",
        "in",
        "mil",
        "ft",
        None,
    ]
    """Units of a file that does not state them (default: the file's, else mm)."""
    solid: int | None
    """Which solid of a STEP file with several, by its number: without it they are listed (default: the file's only
    one).
    """
    strict: bool | None
    """Refuse input with skipped or repaired entities, and programs with dangerous moves."""
    machine: str | None
    """Machine name (see `leafcut machines`), or path of a TOML profile (default: linuxcnc-mill)."""
    work_offset: str | Sequence[Quantity] | None
    """Work offset: program zero in machine coordinates, x,y,z (mm; default: the machine's, else unknown)."""
    tools: str | Path | None
    """Tool library: TOML, LinuxCNC .tbl, Fusion .json or .tools, FreeCAD .fctl, a table .csv (default: one assumed
    drill per diameter).
    """
    workpiece: str | None
    """Material before the first cut, in program coordinates: x,y,z of the lower and of the upper corner of a
    block, or an STL file in mm, or a STEP file (default: as the program shows: just around the cuts below Z0
    (stock), or where no rapid has been (reorder --air)).
    """
    cell: Quantity | None
    """Side of a cell of the stock model: 4 bytes each, at most 64 million (256 MB) (mm; default: a fortieth of the
    smallest tool, up to a fifth of it for a large stock).
    """
    mill_diameter: Quantity | None
    """Diameter of tools that neither --tools nor the program's comments describe; they count as flat mills (mm;
    default: such a tool is refused).
    """


class CuttingDataKeywords(TypedDict, total=False):
    """Options of `leafcut.cutting_data`."""

    units: Literal[
        "mm",
        "cm",
        "m",
        "in",
        "mil",
        "ft",
        None,
    ]
    """Units of a file that does not state them (default: the file's, else mm)."""
    layers: str | Sequence[str] | None
    """Read only these layers; * and ? are wildcards (default: all visible layers)."""
    min_diameter: Quantity | None
    """Skip round holes smaller than this (mm; default: none)."""
    max_diameter: Quantity | None
    """Skip round holes larger than this (mm; default: none)."""
    merge_tolerance: Quantity | None
    """Merge holes of equal diameter closer than this (mm; default: 0.01mm)."""
    concentric: Literal[
        "smallest",
        "largest",
        "all",
        None,
    ]
    """Which of several concentric circles to drill (default: smallest)."""
    solid: int | None
    """Which solid of a STEP file with several, by its number: without it they are listed (default: the file's only
    one).
    """
    mirror: Literal[
        "x",
        "y",
        None,
    ]
    """Mirror the drawing: x reverses X (a board flipped sideways), y reverses Y (default: as drawn)."""
    rotate: Quantity | None
    """Rotate the drawing about its zero, counter-clockwise, after mirroring (deg)."""
    origin: str | Sequence[Quantity] | None
    """Program zero, set after rotating: lower-left, lower-right, upper-left, upper-right or centre of the geometry
    (hole centres), or a point x,y (mm; default: the drawing's zero).
    """
    strict: bool | None
    """Refuse input with skipped or repaired entities, and programs with dangerous moves."""
    machine: str | None
    """Machine name (see `leafcut machines`), or path of a TOML profile (default: linuxcnc-mill)."""
    work_offset: str | Sequence[Quantity] | None
    """Work offset: program zero in machine coordinates, x,y,z (mm; default: the machine's, else unknown)."""
    tools: str | Path | None
    """Tool library: TOML, LinuxCNC .tbl, Fusion .json or .tools, FreeCAD .fctl, a table .csv (default: one assumed
    drill per diameter).
    """
    depth: Quantity | None
    """Depth of blind holes or pockets below Z0 (mm; default: from --thickness, else 1 mm (spotting))."""
    thickness: Quantity | None
    """Thickness of the plate (holes go through), or of the sheet to cut (mm; default: unknown: holes are blind)."""
    break_through: Quantity | None
    """Break-through: how far through holes go below the plate (mm; default: 0.5mm)."""
    clearance_height: Quantity | None
    """Clearance height (initial plane): safe above part and clamps (mm; default: 10mm)."""
    retract_height: Quantity | None
    """Retract height (R plane): where rapid changes to feed (mm; default: 2mm)."""
    retract: Literal[
        "r",
        "initial",
        None,
    ]
    """Retract after a hole to the R plane (G99) or the initial plane (G98) (default: r)."""
    keep_out: str | Sequence[str] | None
    """Keep-out zones such as clamps: rectangles 'x0 y0 x1 y1' in mm, separated by commas; no cuts inside, rapids
    cross at --clearance-height or go around, with the tool radius as margin (default: none).
    """
    spindle_speed: Quantity | None
    """Spindle speed of assumed drills, or of the end mill (rpm; default: 20 m/min surface speed; for end mills
    from the tool library or --material).
    """
    diameter_tolerance: Quantity | None
    """Largest difference between tool and hole diameter (mm; default: 0.05mm)."""
    material: str | None
    """Material, by its name in the cut chart; for pockets it sets the speed of an assumed end mill; for cutting-
    data and for feeds of a program a name of `leafcut materials`, or a TOML file (default: mild_steel).
    """
    start_point: str | Sequence[Quantity] | None
    """Start point of the tool, x,y, or free; for a program, its position before the first rapid (mm; default:
    0,0).
    """
    end_point: str | Sequence[Quantity] | None
    """End point of the tool, x,y, or free (mm; default: at the last hole)."""
    depth_to: Literal[
        "shoulder",
        "tip",
        None,
    ]
    """Depth reference: full diameter (shoulder) or drill point (tip) (default: shoulder)."""
    hole_heights: Literal[
        "one",
        "drawn",
        None,
    ]
    """Height at which holes begin: one for all, which becomes Z0, or each its own as drawn, with ways at
    --clearance-height over the highest; Z0 is then that of the drawing (default: one).
    """
    surface: str | Path | None
    """STL file of the part or its blank, with the zero of the drawing: each hole begins on it, and ways between
    holes are as low as it allows (default: flat).
    """
    surface_unit: Literal[
        "mm",
        "in",
        "cm",
        "m",
        None,
    ]
    """Unit of the STL files (default: mm)."""
    surface_clearance: Quantity | None
    """How far ways stay from the surface and from fixtures, above and aside (mm; default: 2mm)."""
    through: bool | None
    """Drill each hole through the part, as thick as the surface is there."""
    fixture: str | Sequence[str] | None
    """Boxes that stand on the surface, such as clamps: 'x0 y0 z0 x1 y1 z1' in mm, separated by commas; ways go
    over (default: none).
    """
    fixture_file: str | Path | None
    """STL or STEP file of what holds the part, such as clamps or a vise, with the zero of the surface; ways go
    over (default: none).
    """
    tool_change_height: Quantity | None
    """Tool change height, for machines without one of their own (mm; default: 25mm)."""
    cycle: Literal[
        "G81",
        "G82",
        "G83",
        "G73",
        "G84",
        "G85",
        None,
    ]
    """Drilling cycle for tools without one in the library (default: G83 with --peck, G82 with --dwell, else G81)."""
    peck: Quantity | None
    """Peck depth (Q of G83 and G73) (mm; default: no pecking)."""
    dwell: Quantity | None
    """Dwell at the bottom (P of G82) (s; default: none)."""
    feed: Quantity | None
    """Feed rate of assumed drills (mm/min; default: 0.02 diameters per revolution)."""
    centre_drill: bool | None
    """Centre-drill every hole first, with the library's centre drill."""
    hole_order: str | Path | None
    """Order file: drill these holes first, in this order; the search orders the rest (default: none)."""
    preset: Literal[
        "fast",
        "default",
        "thorough",
        None,
    ]
    """Search effort; the result is the same on every machine (default: default)."""
    time_limit: Quantity | None
    """Stop after this time, or sooner when five colonies in a row find no improvement (s; default: the preset
    decides).
    """
    seed: int | None
    """Random seed: same seed, same result (default: 1)."""
    threads: int | None
    """Number of threads; does not change the result (default: one per core)."""
    holes: int | None
    """Holes of every drill in one part (default: from the drawing)."""
    move_time: Quantity | None
    """Time from one hole to the next, up and down included (s; default: 1.5s)."""
    drill_diameter: Quantity | None
    """Diameter of the drill, without --tools (mm)."""
    tool_material: Literal[
        "hss",
        "carbide",
        None,
    ]
    """Cutting edges of tools whose library does not say their material (default: hss)."""
    tool_numbers: str | Sequence[str] | None
    """Numbers of the tools to choose speeds for, such as 1,3 (default: all drills, and with --cut-length all end
    mills).
    """
    cut_length: Quantity | None
    """Length that every end mill is fed in the material for one part (mm; default: end mills are left out)."""
    cut_width: Quantity | None
    """Width of an end mill's cut (mm; default: the tool's diameter: a slot)."""
    cut_depth: Quantity | None
    """Depth of an end mill's cut (mm; default: half of the tool's diameter)."""
    shop_rate: float | None
    """Cost of machine and operator by the hour, in any currency (default: 60)."""
    tool_cost: float | None
    """Cost of one life of a tool, new or reground, in the same currency; `life_cost` in the library goes before
    (default: 10).
    """
    worn_change: Quantity | None
    """Time to replace a worn tool and to set its length (s; default: 120s)."""
    min_life: Quantity | None
    """Shortest tool life allowed, in the cut (s; default: 300s)."""
    max_life: Quantity | None
    """Longest tool life that is counted on, in the cut: then the tool is replaced (s; default: 14400s)."""
    speed_step: Quantity | None
    """Step of spindle speeds (rpm; default: 10rpm)."""
    feed_step: Quantity | None
    """Step of feed rates (mm/min; default: 5mm/min)."""
    min_chip: Quantity | None
    """Least feed of a drill per revolution, of a mill per tooth (mm; default: a quarter of the highest)."""
    max_chip: Quantity | None
    """Highest feed of a drill per revolution, of a mill per tooth (mm; default: from the material, by the tool's
    diameter).
    """
    max_power: Quantity | None
    """Limit of the spindle's power (kW; default: the machine's, else none)."""
    max_torque: Quantity | None
    """Limit of the spindle's torque (N·m; default: the machine's, else none)."""
    max_thrust: Quantity | None
    """Limit of a drill's thrust (N; default: the machine's, else none)."""
    drive_efficiency: float | str | None
    """Part of the spindle's power that reaches the tool (default: 0.75)."""


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
    """Units of a file that does not state them (default: the file's, else mm)."""
    machine: str | None
    """Machine name (see `leafcut machines`), or path of a TOML profile (default: linuxcnc-mill)."""
    work_offset: str | Sequence[Quantity] | None
    """Work offset: program zero in machine coordinates, x,y,z (mm; default: the machine's, else unknown)."""
    thickness: Quantity | None
    """Thickness of the plate (holes go through), or of the sheet to cut (mm; default: unknown: holes are blind)."""
    material: str | None
    """Material, by its name in the cut chart; for pockets it sets the speed of an assumed end mill; for cutting-
    data and for feeds of a program a name of `leafcut materials`, or a TOML file (default: mild_steel).
    """
    cut_process: str | None
    """Cutting process: plasma, laser, oxyfuel, waterjet, or a name in the cut chart such as laser_fiber_3kW
    (default: the machine's, else plasma).
    """
    amps: float | None
    """Cutting current, if the chart has several (default: the fastest in the chart that can pierce the sheet)."""
    nozzle: str | None
    """Nozzle, if the chart has several (default: any in the chart)."""
    chart: str | Path | None
    """Cut chart of your own, a CSV file (default: leafcut's chart)."""
    cut_speed: Quantity | None
    """Cutting speed (mm/min; default: the chart's)."""
