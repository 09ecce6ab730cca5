"""Removed options of earlier versions, with replacements."""

from __future__ import annotations

from leafcut.options.option_spec import flag_name

#: Name → reason and remedy, or the new name, "now --name". These options are refused by name everywhere.
REMOVED = {
    "air_clearance": "rapids in the air keep 1 mm from the material",
    "air_feed": "give max_feed in the machine profile, the feed through cleared area",
    "all_variants": "--variants writes as many nests as it names",
    "best_probability": "it is 0.05, as in the book (p_best of mmas)",
    "chain_bridge": "bridges are as long as they are faster than a pierce",
    "chain_contours": "a chain has at most 12 contours",
    "closed_path": "it saved at most 0.3 % of the time; --strategy connected needs no retracts inside a level",
    "colonies": "one colony uses all threads; leave it out",
    "colonies_on": "one colony uses all threads; leave it out",
    "consumables_rate": "now --cutting-rate (gas, power and consumables together)",
    "cut_depth": "now --step-down",
    "cut_width": "now --step-over (a share of the tool diameter)",
    "date": "the header of the same job is always the same; your editor or file system keeps the date",
    "device": "now --parallel gpu",
    "drill_diameter": "now --tool-diameter",
    "drive_efficiency": "75 % of the spindle's power reaches the tool; give less spindle.power in the machine profile",
    "edge_start": "cuts start at the sheet's edge above the pierce capacity; --pierce-delay makes them pierce",
    "elitist_weight": "it is the number of ants, as in the book (e of eas)",
    "feed_increase": "--feeds raises a feed by 50 % at most",
    "feed_step": "feeds are tried in steps of 5 mm/min",
    "finishing_pass": "every wall is finished; without that, cusps of up to half a step-over stay on it",
    "firefly_mode": "--variant published-complex has the settings published for complex pockets",
    "firefly_patience": "the search ends after 20 iterations without a gain, or at --iterations or --time-limit",
    "firefly_start": "the published variant starts from random tours, leafcut's from greedy tours",
    "gas_rate": "now --cutting-rate (gas, power and consumables together)",
    "heat_time": "--heat-distance keeps consecutive starts apart",
    "into_holes": "small parts are nested in holes if that saves sheet",
    "joint_holes": "holes get no micro-joints; their slugs may fall",
    "kerf_width": "now --kerf",
    "lead_angle": "straight leads meet the contour at 90°, arcs sweep 90°",
    "local_evaporation_rate": "it is 0.1, as in the book (ξ of acs)",
    "loop_angle": "corners sharper than 100° get loops",
    "loop_length": "loops are half as long as the lead-in",
    "machine_rate": "now --shop-rate",
    "max_chip": "give feed.drill or feed.mill in a material file",
    "max_life": "tools are replaced after 4 h in the cut",
    "max_power": "give spindle.power in the machine profile",
    "max_sheets": "give the number of sheets in --sheet, such as 3000x1500:4",
    "max_thrust": "give spindle.max_thrust in the machine profile",
    "max_torque": "give spindle.torque in the machine profile",
    "merge_tolerance": "holes of one diameter closer than 0.01 mm are one",
    "mill_diameter": "now --tool-diameter",
    "milling_feed": "now --feed",
    "min_chip": "it is a quarter of the largest chip of the material",
    "min_life": "a tool lasts 5 min in the cut at least",
    "move_time": "give a drawing; without one 1.5 s pass between two holes",
    "n_ranks": "6 ranks deposit, as in the book (w of asrank)",
    "optional_stop": "give tool_change.optional_stop in the machine profile",
    "path_tolerance": "it is 0.1 mm (G64 P)",
    "pierce_pitch": "leafcut chooses the spacing of pierce points by the length of the contour",
    "point_distance": "it follows --step-over, up to 0.6 tool diameters",
    "power_rate": "now --cutting-rate (gas, power and consumables together)",
    "preselect_tool": "give tool_change.preselect in the machine profile",
    "remnant_size": "remnants narrower than 150 mm are not kept",
    "renumber": "now --line-numbers",
    "repeat_words": "modal words are written once",
    "save_norms": "give --report FILE.csv",
    "sheet_margin": "draw a smaller sheet outline, or give a smaller --sheet-size",
    "short_inversion": "short inversions have up to a quarter of the nodes; 50 with local search",
    "slot_chip": "give a smaller --step-down for slots",
    "small_hole_speed": "small holes are cut at 60 % of the cutting speed; --small-hole 0 cuts them at full speed",
    "speed_step": "spindle speeds are tried in steps of 10 rpm",
    "splash": "pierces keep one kerf from parts if there is room",
    "start_at": "cuts may start at corners and between them",
    "start_corner": "--sweep -x or -y starts at the far side; --start-point is a place such as 3000,0",
    "surface_clearance": "travel moves keep 2 mm from the surface and fixtures",
    "sweep_width": "a band is a fifth of the sheet, or its largest part",
    "switch_at": "it is that of --variant",
    "switch_offset": "give probe.switch_offset in the machine profile",
    "tool_change_height": "tools are changed 25 mm above Z0, or at safe_z of the machine profile",
    "tool_cost": "give life_cost in the tool library",
    "tool_numbers": "use a tool library with only these tools",
    "uncovered_tolerance": "more than 0.1 % of uncut area is reported",
    "worn_change": "a worn tool takes 2 min to replace",
    "zigzag_angle": "leafcut chooses the best of twelve angles",
}


def why_removed(name: str) -> str:
    """Return the error message for a removed option, "" for any other name."""
    replacement = REMOVED.get(name) or REMOVED.get(name.removeprefix("no_"), "")
    if not replacement:
        return ""
    verb = "is" if replacement.startswith("now ") else "was removed:"
    return f"{flag_name(name)} {verb} {replacement}"
