"""Options of earlier versions that were removed, with their replacements."""

from __future__ import annotations

from leafcut.message import Message
from leafcut.options.option_spec import flag_name

#: Name → reason and remedy, or the new name as "now --name". All interfaces refuse these options by name.
REMOVED = {
    "air_clearance": "rapids clear the material by at least 1 mm",
    "air_feed": "set max_feed in the machine profile; it is the feed through cleared area",
    "all_variants": "--variants N writes N nests",
    "best_probability": "p_best of mmas is fixed at 0.05 (Dorigo and Stützle 2004)",
    "chain_bridge": "a bridge is used where it is faster than a pierce",
    "chain_contours": "a chain has at most 12 contours",
    "closed_path": "closed paths saved at most 0.3 % of the time; --strategy connected needs no retracts inside a "
    "level",
    "colonies": "one colony uses all threads; leave it out",
    "colonies_on": "one colony uses all threads; leave it out",
    "consumables_rate": "now --cutting-rate (gas, power and consumables together)",
    "cut_depth": "now --step-down",
    "cut_length": "without a drawing, the results of end mills are for 1 m of cut",
    "cut_width": "now --step-over (a share of the tool diameter)",
    "date": "the header contains no date, so that equal jobs give equal programs; the file system keeps the date",
    "device": "now --parallel gpu",
    "drill_diameter": "now --tool-diameter",
    "drive_efficiency": "75 % of the spindle's power reaches the tool; lower spindle.power in the machine profile",
    "edge_start": "above the pierce capacity, cuts start at the sheet's edge; with --pierce-delay, they pierce",
    "elitist_weight": "e of eas is fixed at the number of ants (Dorigo and Stützle 2004)",
    "feed_increase": "--feeds raises a feed by at most 50 %",
    "feed_step": "feeds are tried in steps of 5 mm/min",
    "finishing_pass": "every wall gets a finishing pass; without it, cusps of up to half a step-over would remain",
    "firefly_mode": "--variant published-complex has the settings published for complex pockets",
    "firefly_patience": "the search ends after 20 iterations without a gain, or at --iterations or --time-limit",
    "firefly_start": "the published variant starts from random tours, leafcut's from greedy tours",
    "fixture_file": "now --fixture (boxes: --keep-out 'x0 y0 x1 y1 h')",
    "gas_rate": "now --cutting-rate (gas, power and consumables together)",
    "heat_time": "--heat-distance keeps consecutive starts apart",
    "hole_heights": "--z-zero drawn starts each hole at its drawn height",
    "hole_order": "now --plan",
    "holes": "without a drawing, the results are for one hole",
    "into_holes": "small parts are nested in holes if that saves sheet",
    "joint_holes": "holes get no micro-joints; their slugs may fall",
    "keep_order": "--algorithm none keeps the given order",
    "kerf_width": "now --kerf",
    "lead_angle": "straight leads meet the contour at 90°, arcs sweep 90°",
    "lead_out_length": "lead-outs are as long as lead-ins, at least 6 mm, and are shortened if there is no room",
    "local_evaporation_rate": "the local evaporation rate ξ of acs is fixed at 0.1 (Dorigo and Stützle 2004)",
    "loop_angle": "corners sharper than 100° get loops",
    "loop_length": "loops are half as long as the lead-in",
    "machine_rate": "now --shop-rate",
    "max_chip": "set feed.drill or feed.mill in a material file",
    "max_life": "tools are replaced after 4 h of cutting at the latest",
    "max_power": "set spindle.power in the machine profile",
    "max_sheets": "give the number of sheets in --sheet, such as 3000x1500:4",
    "max_thrust": "set spindle.max_thrust in the machine profile",
    "max_torque": "set spindle.torque in the machine profile",
    "merge_tolerance": "holes of equal diameter less than 0.01 mm apart are merged",
    "mill_diameter": "now --tool-diameter",
    "milling_feed": "now --feed",
    "min_chip": "the minimum chip thickness is a quarter of the material's maximum",
    "min_life": "a tool lasts for at least 5 min of cutting",
    "move_time": "give a drawing; without one, the move between two holes takes 1.5 s",
    "n_ranks": "w of asrank is fixed at 6 ranks (Dorigo and Stützle 2004)",
    "optional_stop": "set tool_change.optional_stop in the machine profile",
    "path_tolerance": "the path tolerance is 0.1 mm (G64 P)",
    "pierce_pitch": "leafcut chooses the spacing of pierce points by the length of the contour",
    "point_distance": "the distance of points follows --step-over, up to 0.6 tool diameters",
    "power_rate": "now --cutting-rate (gas, power and consumables together)",
    "preselect_tool": "set tool_change.preselect in the machine profile",
    "probe": "programs probe if the machine profile has a table [probe]",
    "remnant_size": "remnants narrower than 150 mm are not kept",
    "renumber": "now --line-numbers",
    "repeat_words": "modal words are written once",
    "save_norms": "give --report FILE.csv",
    "sheet_margin": "draw a smaller sheet outline, or give a smaller --sheet-size",
    "short_inversion": "short inversions have up to a quarter of the nodes; 50 with local search",
    "slot_chip": "give a smaller --step-down for slots",
    "small_hole_speed": "small holes are cut at 60 % of the cutting speed; --small-hole 0 cuts them at full speed",
    "speed_step": "spindle speeds are tried in steps of 10 rpm",
    "splash": "pierces stay one kerf away from parts if there is room",
    "start_at": "cuts may start at corners and between them",
    "start_corner": "--sweep -x or -y starts at the far side; --start-point takes a point such as 3000,0",
    "surface_clearance": "travel moves stay 2 mm away from the surface and fixtures",
    "sweep_width": "a band is as wide as a fifth of the sheet, or as the largest part if that is wider",
    "switch_at": "--variant sets it",
    "switch_offset": "set probe.switch_offset in the machine profile",
    "target_gap": "a search ends when it no longer pays; --time-limit or --iterations end it earlier",
    "through": "now --depth through",
    "tool_change_height": "tools are changed 25 mm above Z0, or at safe_z of the machine profile",
    "tool_cost": "set life_cost in the tool library",
    "tool_numbers": "use a tool library with only these tools",
    "uncovered_tolerance": "an uncut area of more than 0.1 % is reported",
    "worn_change": "replacing a worn tool takes 2 min",
    "zigzag_angle": "leafcut chooses the best of twelve angles",
}


def why_removed(name: str) -> Message:
    """Return the error message for a removed option, "" for any other name."""
    replacement = REMOVED.get(name) or REMOVED.get(name.removeprefix("no_"), "")
    if not replacement:
        return Message("")
    if replacement.startswith("now "):
        return Message("{} is {}", flag_name(name), replacement)
    return Message("{} was removed: {}", flag_name(name), replacement)
