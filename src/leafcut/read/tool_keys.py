"""The keys of a tool library, with their meanings and defaults."""

from __future__ import annotations

from leafcut.model.kinds import ToolMaterial
from leafcut.model.tool import ToolKind
from leafcut.options import CYCLES
from leafcut.read.machine_keys import ProfileKey

#: Kinds of tools that a tool library never contains, because their data come from a cut chart.
NO_TOOLS = (ToolKind.TORCH,)
_POSITIVE = "above 0"
_LENGTH = "above 0 and at most 1000 mm"

TOOL_KEYS: tuple[ProfileKey, ...] = (
    ProfileKey("number", "number in programs, the T word", example=1, required=True, bounds="1 to 99999999"),
    ProfileKey("kind", "kind of tool", ToolKind.DRILL.value, choices=tuple(k for k in ToolKind if k not in NO_TOOLS)),
    ProfileKey("diameter", "diameter of the hole it makes", required=True, unit="mm", bounds=_LENGTH),
    ProfileKey("name", "name for lists and programs", why="its kind"),
    ProfileKey(
        "point_angle",
        "full angle of its point, or of the cone of a chamfer mill or V-bit; not of end mills",
        why="118° of drills and centre drills, else flat",
        unit="rad",
        bounds="above 0° and at most 180°",
    ),
    ProfileKey("feed", "feed rate", why="assumed from its diameter", unit="mm/s", bounds=_POSITIVE),
    ProfileKey("spindle_speed", "spindle speed", why="assumed from its diameter", unit="rpm", bounds=_POSITIVE),
    ProfileKey("cycle", "drilling cycle; only taps use G84", why="the value of --cycle", choices=CYCLES),
    ProfileKey("peck", "peck depth; G83 and G73 need it", why="no pecking", unit="mm", bounds=_LENGTH),
    ProfileKey("dwell", "dwell at the bottom; G82 needs it", why="none", unit="s", bounds="0 to 100 s"),
    ProfileKey(
        "pitch", "of a tap: length per revolution", why="a tap needs it", unit="mm", bounds="below the diameter"
    ),
    ProfileKey("flute_length", "maximum cutting depth", why="the requested depth", unit="mm", bounds=_LENGTH),
    ProfileKey("depth", "of a centre drill: drilling depth", why="the value of --depth", unit="mm", bounds=_LENGTH),
    ProfileKey("plunge_feed", "of a mill: plunge rate", why="a third of its feed", unit="mm/s", bounds=_POSITIVE),
    ProfileKey("teeth", "of a mill: number of teeth", why="not known", example=2, bounds="1 to 100"),
    ProfileKey(
        "corner_radius",
        "of an end mill: radius of its corners",
        why="sharp corners",
        unit="mm",
        bounds="above 0 and at most half the diameter",
    ),
    ProfileKey(
        "tip_diameter",
        "of a chamfer mill or V-bit: diameter of its flat tip",
        why="a sharp tip",
        unit="mm",
        bounds="above 0 and below the diameter",
    ),
    ProfileKey(
        "material",
        "material of its cutting edges, for `leafcut tools speeds`",
        why="the value of --tool-material",
        example=ToolMaterial.HSS.value,
        choices=tuple(ToolMaterial),
    ),
    ProfileKey(
        "life_cost",
        "cost per tool life (a new tool or a regrind), for `leafcut tools speeds`",
        why="an estimate: 10",
        example=12.5,
        bounds="0 or more",
    ),
    ProfileKey(
        "shank_diameter",
        "diameter above its flutes; with flute_length",
        why="unknown; its collisions are not checked",
        unit="mm",
        bounds=_LENGTH,
    ),
    ProfileKey("stickout", "from its tip to its holder", why="not known", unit="mm", bounds=_LENGTH),
    ProfileKey(
        "shaft",
        "sections between flutes and shank, from the flutes up: diameter x length in mm, a cone as lower-upper x "
        "length; with flute_length",
        why="nothing",
        example="4-6 x 3",
    ),
    ProfileKey(
        "holder",
        "sections of the holder, from below: diameter x length in mm, a cone as lower-upper x length; with stickout",
        why="unknown; its collisions are not checked",
        example="20-28 x 5, 28 x 40",
    ),
)
HOLE_KEYS: tuple[ProfileKey, ...] = (
    ProfileKey("diameter", "diameter of the drawn holes", required=True, unit="mm", bounds=_LENGTH),
    ProfileKey("layer", "layers of the drawn holes; * and ? are wildcards", "*", "all layers"),
    ProfileKey("steps", "numbers of the tools that make the hole, in this order", example=[1, 2], required=True),
)
