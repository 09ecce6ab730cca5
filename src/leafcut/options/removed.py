"""Options of earlier versions that were removed, with their replacements."""

from __future__ import annotations

from functools import partial

from leafcut.message import Message
from leafcut.options.option_spec import flag_name

_RENAMED = partial(Message, "{} is now {}")
_USE = partial(Message, "{} was removed; use {}")
_PROFILE = partial(Message, "{} was removed; set {} in the machine profile")
_MATERIAL = partial(Message, "{} was removed; set {} in a material file")
_LIBRARY = partial(Message, "{} was removed; set {} in the tool library")
_FIXED = partial(Message, "{} was removed: its value is always {}; leave it out")
_AUTOMATIC = partial(Message, "{} was removed: leafcut chooses the value; leave it out")
_NO_REPLACEMENT = partial(Message, "{} was removed without a replacement; leave it out")

#: Name → message, and its value if it has one. All interfaces refuse these options by name.
REMOVED: dict[str, tuple[partial[Message], *tuple[str, ...]]] = {
    "air_clearance": (_FIXED, "1 mm"),
    "air_feed": (_PROFILE, "max_feed"),
    "all_variants": (_USE, "--variants"),
    "best_probability": (_FIXED, "0.05"),
    "chain_bridge": (_AUTOMATIC,),
    "chain_contours": (_FIXED, "12"),
    "closed_path": (_USE, "--strategy connected"),
    "colonies": (_FIXED, "1"),
    "colonies_on": (_NO_REPLACEMENT,),
    "consumables_rate": (_RENAMED, "--cutting-rate"),
    "cut_depth": (_RENAMED, "--step-down"),
    "cut_length": (_FIXED, "1 m"),
    "cut_width": (_RENAMED, "--step-over"),
    "date": (_NO_REPLACEMENT,),
    "device": (_RENAMED, "--parallel gpu"),
    "drill_diameter": (_RENAMED, "--tool-diameter"),
    "drive_efficiency": (_FIXED, "75 %"),
    "edge_start": (_USE, "--pierce-delay"),
    "elitist_weight": (_AUTOMATIC,),
    "feed_increase": (_FIXED, "50 %"),
    "feed_step": (_FIXED, "5 mm/min"),
    "finishing_pass": (_FIXED, "on"),
    "firefly_mode": (_USE, "--variant"),
    "firefly_patience": (_USE, "--iterations, --time-limit"),
    "firefly_start": (_USE, "--variant"),
    "fixture_file": (_RENAMED, "--fixture"),
    "gas_rate": (_RENAMED, "--cutting-rate"),
    "heat_time": (_USE, "--heat-distance"),
    "hole_heights": (_USE, "--z-zero drawn"),
    "hole_order": (_RENAMED, "--plan"),
    "holes": (_FIXED, "1"),
    "into_holes": (_AUTOMATIC,),
    "joint_holes": (_FIXED, "off"),
    "keep_order": (_USE, "--algorithm none"),
    "kerf_width": (_RENAMED, "--kerf"),
    "lead_angle": (_FIXED, "90°"),
    "lead_out_length": (_USE, "--lead-in-length"),
    "local_evaporation_rate": (_FIXED, "0.1"),
    "loop_angle": (_FIXED, "100°"),
    "loop_length": (_AUTOMATIC,),
    "machine_rate": (_RENAMED, "--shop-rate"),
    "max_chip": (_MATERIAL, "feed.drill, feed.mill"),
    "max_life": (_FIXED, "4 h"),
    "max_power": (_PROFILE, "spindle.power"),
    "max_sheets": (_USE, "--sheet 3000x1500:4"),
    "max_thrust": (_PROFILE, "spindle.max_thrust"),
    "max_torque": (_PROFILE, "spindle.torque"),
    "merge_tolerance": (_FIXED, "0.01 mm"),
    "mill_diameter": (_RENAMED, "--tool-diameter"),
    "milling_feed": (_RENAMED, "--feed"),
    "min_chip": (_AUTOMATIC,),
    "min_life": (_FIXED, "5 min"),
    "move_time": (_FIXED, "1.5 s"),
    "n_ranks": (_FIXED, "6"),
    "optional_stop": (_PROFILE, "tool_change.optional_stop"),
    "path_tolerance": (_FIXED, "0.1 mm"),
    "pierce_pitch": (_AUTOMATIC,),
    "point_distance": (_USE, "--step-over"),
    "power_rate": (_RENAMED, "--cutting-rate"),
    "preselect_tool": (_PROFILE, "tool_change.preselect"),
    "probe": (_PROFILE, "[probe]"),
    "remnant_size": (_FIXED, "150 mm"),
    "renumber": (_RENAMED, "--line-numbers"),
    "repeat_words": (_FIXED, "off"),
    "save_norms": (_USE, "--report FILE.csv"),
    "sheet_margin": (_USE, "--sheet-size"),
    "short_inversion": (_AUTOMATIC,),
    "slot_chip": (_USE, "--step-down"),
    "small_hole_speed": (_FIXED, "60 %"),
    "speed_step": (_FIXED, "10 rpm"),
    "splash": (_AUTOMATIC,),
    "start_at": (_AUTOMATIC,),
    "start_corner": (_USE, "--sweep, --start-point"),
    "surface_clearance": (_FIXED, "2 mm"),
    "sweep_width": (_AUTOMATIC,),
    "switch_at": (_USE, "--variant"),
    "switch_offset": (_PROFILE, "probe.switch_offset"),
    "target_gap": (_USE, "--time-limit, --iterations"),
    "through": (_RENAMED, "--depth through"),
    "tool_change_height": (_PROFILE, "safe_z"),
    "tool_cost": (_LIBRARY, "life_cost"),
    "tool_numbers": (_USE, "--tools"),
    "uncovered_tolerance": (_FIXED, "0.1 %"),
    "worn_change": (_FIXED, "2 min"),
    "zigzag_angle": (_AUTOMATIC,),
}


def removal_message(name: str) -> Message:
    """Return the error message for a removed option, "" for any other name."""
    for option in (name, name.removeprefix("no_")):
        if option in REMOVED:
            message, *values = REMOVED[option]
            return message(flag_name(name), *values)
    return Message("")
