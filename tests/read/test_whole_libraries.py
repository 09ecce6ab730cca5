"""Whole tool libraries: each tool as TOML and as read, the tools left out, and refusals, all checked by eye."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from leafcut.errors import LeafcutError
from leafcut.read.tool_text import convert_library_to_toml
from leafcut.read.tools import load_tools
from plain_text import text_of

LIBRARIES = Path(__file__).parent / "libraries"
FILES = sorted(file for file in LIBRARIES.iterdir() if file.suffix not in (".txt", ".fctb"))

#: Units and materials with which each library is read.
READ = (("", ""), ("mm", ""), ("in", "steel"))


def readings_of(file: Path) -> str:
    """Return a library as TOML and as tools, for each unit and material."""
    parts: dict[str, str] = {}
    for units, material in READ:
        try:
            if file.suffix == ".toml":
                library, text = load_tools(file), ""
            else:
                text, library = convert_library_to_toml(str(file), units, material)
            tools = "\n".join(map(text_of, (*library.tools, *library.recipes)))
            found = f"{text}\n{tools}\nleft out: {text_of(library.left_out)}; without feeds: {library.without_feeds}"
        except LeafcutError as problem:
            found = f"{type(problem).__name__}: {str(problem).replace(str(file), file.name)}"
        parts[found] = f"{parts[found]}; {units} {material}" if found in parts else f"{units} {material}"
    return "\n\n".join(f"== {title}\n{found}" for found, title in parts.items()) + "\n"


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_library_is_read_as_it_was_written(file: Path) -> None:
    assert readings_of(file) == (LIBRARIES / f"{file.name}.txt").read_text(encoding="utf-8")


#: A tool of leafcut's own library → the whole refusal.
REFUSED = {
    "diameter = '5 mm'": "[[tool]] 1: the key 'number' is missing",
    "number = 0": "[[tool]] 1: 'number' is 0, but must be a whole number from 1 to 99999999",
    "number = true": "[[tool]] 1: 'number' is True, but must be a whole number from 1 to 99999999",
    "number = 1": "[[tool]] 1: the key 'diameter' is missing",
    "number = 1\ndiameter = 5": "[[tool]] 1: 'diameter' is 5, but must be a string with a unit, such as '1 mm'",
    "number = 1\ndiameter = '0 mm'": "[[tool]] 1: 'diameter' is 0 mm, but must be above 0 and at most 1000 mm",
    "number = 1\ndiameter = '1001 mm'": "[[tool]] 1: 'diameter' is 1001 mm, but must be above 0 and at most 1000 mm",
    "number = 1\ndiameter = '5 mm'\nfeed = '0 mm/min'": "[[tool]] 1: 'feed' is 0 mm/min, but must be above 0",
    "number = 1\ndiameter = '5 mm'\ncycle = 'G83'": "[[tool]] 1: 'cycle' is G83, which needs 'peck', the peck depth",
    "number = 1\ndiameter = '5 mm'\ncycle = 'G73'": "[[tool]] 1: 'cycle' is G73, which needs 'peck', the peck depth",
    "number = 1\ndiameter = '5 mm'\ncycle = 'G82'":
        "[[tool]] 1: 'cycle' is G82, which needs 'dwell', the dwell at the bottom",
    "number = 1\ndiameter = '5 mm'\ncycle = 'G84'":
        "[[tool]] 1: 'cycle' is G84 for a drill; G84 requires a tap, and a tap requires G84",
    "number = 1\ndiameter = '5 mm'\nkind = 'tap'\npitch = '1 mm'\ncycle = 'G81'":
        "[[tool]] 1: 'cycle' is G81 for a tap; G84 requires a tap, and a tap requires G84",
    "number = 1\ndiameter = '5 mm'\nkind = 'tap'":
        "[[tool]] 1: a tap needs 'pitch', mm per revolution, such as '1 mm' for M6",
    "number = 1\ndiameter = '5 mm'\nkind = 'tap'\npitch = '5 mm'":
        "[[tool]] 1: 'pitch' is 5 mm, not below the diameter 5 mm",
    "number = 1\ndiameter = '5 mm'\nkind = 'tap'\npitch = '1 mm'\nspindle_speed = '600 rpm'\nfeed = '500 mm/min'":
        "[[tool]] 1: 'feed' is 500 mm/min, but pitch × speed is 600 mm/min; leave it out",
    "number = 1\ndiameter = '5 mm'\ndwell = '101 s'": "[[tool]] 1: 'dwell' is 101 s, but must be from 0 to 100 s",
    "number = 1\ndiameter = '5 mm'\ndwell = '-1 s'": "[[tool]] 1: 'dwell' is -1 s, but must be from 0 to 100 s",
    "number = 1\ndiameter = '5 mm'\nlife_cost = -1": "[[tool]] 1: 'life_cost' is -1, but must be from 0 to 1000000",
    "number = 1\ndiameter = '5 mm'\nlife_cost = 1e7": "[[tool]] 1: 'life_cost' is 1e+07, but must be from 0 to 1000000",
    "number = 1\ndiameter = '5 mm'\ndepth = '1 mm'":
        "[[tool]] 1: 'depth' is for centre drills only; set the depth of holes with --depth or --thickness",
    "number = 1\ndiameter = '5 mm'\npoint_angle = '0 deg'":
        "[[tool]] 1: 'point_angle' must be above 0° and at most 180°",
    "number = 1\ndiameter = '5 mm'\npoint_angle = '181 deg'":
        "[[tool]] 1: 'point_angle' must be above 0° and at most 180°",
    "number = 1\ndiameter = '5 mm'\nteeth = 2": "[[tool]] 1: 'teeth' is for mills only",
    "number = 1\ndiameter = '5 mm'\nplunge_feed = '1 m/min'": "[[tool]] 1: 'plunge_feed' is for mills only",
    "number = 1\ndiameter = '5 mm'\nkind = 'end-mill'\nteeth = 101":
        "[[tool]] 1: 'teeth' is 101, but must be a whole number from 1 to 100",
    "number = 1\ndiameter = '5 mm'\nkind = 'end-mill'\npeck = '1 mm'":
        "[[tool]] 1: 'peck' is not for kind 'end-mill', only for drilling tools",
    "number = 1\ndiameter = '5 mm'\nkind = 'end-mill'\npoint_angle = '90 deg'":
        "[[tool]] 1: 'point_angle' is not for kind 'end-mill', only for drilling tools",
    "number = 1\ndiameter = '5 mm'\nkind = 'ball-mill'\ncorner_radius = '1 mm'":
        "[[tool]] 1: 'corner_radius' is not for kind 'ball-mill', only for end-mill",
    "number = 1\ndiameter = '5 mm'\nkind = 'end-mill'\ncorner_radius = '2.6 mm'":
        "[[tool]] 1: 'corner_radius' is 2.6 mm, more than half of the diameter",
    "number = 1\ndiameter = '5 mm'\nkind = 'end-mill'\ntip_diameter = '1 mm'":
        "[[tool]] 1: 'tip_diameter' is not for kind 'end-mill', only for chamfer-mill, v-bit",
    "number = 1\ndiameter = '5 mm'\nkind = 'v-bit'":
        "[[tool]] 1: a v-bit needs 'point_angle', the full angle of its cone",
    "number = 1\ndiameter = '5 mm'\nkind = 'v-bit'\npoint_angle = '60 deg'\ntip_diameter = '5 mm'":
        "[[tool]] 1: 'tip_diameter' is 5 mm, not below the diameter",
    "number = 1\ndiameter = '5 mm'\nshank_diameter = '6 mm'":
        "[[tool]] 1: 'shank_diameter' needs 'flute_length': its start above the tip",
    "number = 1\ndiameter = '5 mm'\nshaft = '6 x 3'":
        "[[tool]] 1: 'shaft' needs 'flute_length': its start above the tip",
    "number = 1\ndiameter = '5 mm'\nholder = '20 x 30'":
        "[[tool]] 1: 'holder' needs 'stickout': its start above the tip",
    "number = 1\ndiameter = '5 mm'\nstickout = '9 mm'\nholder = '2 by 3'":
        "[[tool]] 1: 'holder' has the section '2 by 3', but must be such as '28 x 40', or '20-28 x 5' for a cone, "
        "in mm",
    "number = 1\ndiameter = '5 mm'\nstickout = '9 mm'\nholder = '20 x 0'":
        "[[tool]] 1: 'holder' has the section '20 x 0', but must be such as '28 x 40', or '20-28 x 5' for a cone, "
        "in mm",
    "number = 1\ndiameter = '5 mm'\n[[tool]]\nnumber = 1\ndiameter = '6 mm'":
        "[[tool]] 2: 'number' 1 is used twice; every tool needs its own",
    "number = 1\ndiameter = '5 mm'\n[[hole]]\ndiameter = '5 mm'\nsteps = [2]":
        "[[hole]] 1: 'steps' names tool 2, which is not in this library",
    "number = 1\ndiameter = '5 mm'\n[[hole]]\ndiameter = '5 mm'\nsteps = []":
        "[[hole]] 1: 'steps' is [], but must be a list such as [1, 2]",
    "number = 1\ndiameter = '5 mm'\n[[hole]]\ndiameter = '5 mm'\nsteps = [1, 1]":
        "[[hole]] 1: 'steps' names a tool twice",
    "number = 1\ndiameter = '5 mm'\nkind = 'end-mill'\n[[hole]]\ndiameter = '5 mm'\nsteps = [1]":
        "[[hole]] 1: 'steps' names tool 1, a mill; a step needs a drilling tool",
    "number = 1\ndiameter = '5 mm'\n[[hole]]\ndiameter = '5 mm'\nsteps = [1]\n[[hole]]\ndiameter = '5 mm'\nsteps = [1]":
        "[[hole]] 2: 'diameter' 5 mm on layer '*' already has a recipe",
}  # fmt: skip


@pytest.mark.parametrize("tool", REFUSED)
def test_a_tool_that_cannot_be_is_refused_with_its_place_and_value(tool: str, tmp_path: Path) -> None:
    file = tmp_path / "shop.toml"
    file.write_text(f"[[tool]]\n{tool}\n", encoding="utf-8")
    with pytest.raises(LeafcutError) as caught:
        load_tools(file)
    assert str(caught.value) == f"{file}: {REFUSED[tool]}"


#: Materials of the workshop: a preset with such a name is for that material alone.
MATERIALS = """
    abs acetal acrylic alloy alu aluminium brass bronze carbon ceramic composite copper delrin fiberglass foam fr4 g10
    glass granite graphite hardwood hdpe inconel iron leather magnesium marble mdf nylon paper peek petg plastic
    plastics plywood pmma polycarbonate polyethylene polypropylene pom ptfe pvc rubber softwood stainless steel stone
    teflon titanium uhmw wax wood zinc
"""


def test_a_preset_that_names_a_material_is_for_no_other(tmp_path: Path) -> None:
    names = [*MATERIALS.split(), "Roughing", "fast"]
    tools = [
        {
            "type": "drill",
            "unit": "millimeters",
            "post-process": {"number": number},
            "geometry": {"DC": 5},
            "start-values": {"presets": [{"name": f"My {name.title()} 2", "n": 1000, "v_f": 100}]},
        }
        for number, name in enumerate(names, 1)
    ]
    (tmp_path / "a.json").write_text(json.dumps({"data": tools}))
    assert [names[t.number - 1] for t in load_tools(tmp_path / "a.json", material="bone").tools] == ["Roughing", "fast"]
    assert len(load_tools(tmp_path / "a.json").tools) == len(names)
