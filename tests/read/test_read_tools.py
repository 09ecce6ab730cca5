"""Tool libraries: the sample, and messages for wrong ones."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from leafcut.errors import OptionError
from leafcut.model.tool import ToolKind, ToolLibrary
from leafcut.read.tools import load_tools

SAMPLE = Path(__file__).parents[2] / "examples" / "tools.toml"

LIBRARY = """
[[tool]]
number = 1
diameter = "0.25 in"
feed = "12 ipm"
spindle_speed = "3000 rpm"
cycle = "G83"
peck = "3 mm"

[[tool]]
number = 2
kind = "tap"
diameter = "6 mm"
pitch = "1 mm"
spindle_speed = "600 rpm"

[[hole]]
diameter = "6 mm"
layer = "M6"
steps = [1, 2]
"""


def load(folder: Path, text: str) -> ToolLibrary:
    file = folder / "tools.toml"
    file.write_text(text, encoding="utf-8")
    return load_tools(file)


def test_the_sample_library_has_every_kind_of_tool_for_holes_and_pockets_and_recipes_for_threads() -> None:
    library = load_tools(SAMPLE)
    assert {t.kind for t in library.tools} == set(ToolKind) - {ToolKind.TORCH}
    assert {5.0, 6.35, 6.8, 8.5} <= {t.diameter for t in library.tools}
    for recipe in library.recipes:
        kinds = [library.by_number[number].kind for number in recipe.steps]
        assert kinds == sorted(kinds, key=list(ToolKind).index)
    core = {r.steps[-1]: library.by_number[r.steps[-2]].diameter for r in library.recipes}
    for tap in (t for t in library.tools if t.kind is ToolKind.TAP):
        assert tap.pitch is not None
        assert core[tap.number] == pytest.approx(tap.diameter - tap.pitch, abs=0.1)


def test_units_are_those_of_the_text(tmp_path: Path) -> None:
    """0.25 in = 6.35 mm; 12 in/min = 304.8 mm/min = 5.08 mm/s; the tap feeds 1 mm × 600/min = 10 mm/s."""
    library = load(tmp_path, LIBRARY)
    drill, tap = library.tools
    assert (drill.diameter, drill.feed, drill.spindle_rpm, drill.peck) == pytest.approx((6.35, 5.08, 3000, 3))
    assert drill.point_angle == pytest.approx(math.radians(118))
    assert (tap.feed, tap.cycle, tap.point_angle) == (pytest.approx(10), "G84", math.pi)
    assert library.recipes[0].steps == (1, 2)
    assert library.source.endswith("tools.toml")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("number = 2", "number = 1", "[[tool]] 2: 'number' 1 is used twice"),
        ("number = 2", "number = 0", "whole number from 1"),
        ("number = 2", "number = true", "whole number from 1"),
        ("number = 2", 'number = "2"', "whole number from 1"),
        ('pitch = "1 mm"', "", "[[tool]] 2: a tap needs 'pitch'"),
        ('pitch = "1 mm"', 'pitch = "7 mm"', "not below the diameter"),
        ('pitch = "1 mm"', 'pitch = "1 mm"\nfeed = "500 mm/min"', "pitch × speed is 600 mm/min"),
        ('pitch = "1 mm"', 'pitch = "1 mm"\ncycle = "G81"', "G84 requires a tap"),
        ("steps = [1, 2]", "steps = [1, 9]", "[[hole]] 1: 'steps' names tool 9"),
        ("steps = [1, 2]", "steps = [1, 1]", "names a tool twice"),
        ("steps = [1, 2]", "steps = []", "must be a list"),
        ('diameter = "0.25 in"', 'diameter = "0 mm"', "[[tool]] 1: 'diameter' is 0"),
        ('diameter = "0.25 in"', 'diameter = "-3 mm"', "must be above 0"),
        ('diameter = "0.25 in"', 'diameter = "2 m"', "at most 1000 mm"),
        ('diameter = "0.25 in"', "diameter = 6.35", "must be a string with a unit"),
        ('diameter = "0.25 in"', "", "[[tool]] 1: the key 'diameter' is missing"),
        ('feed = "12 ipm"', 'fed = "12 ipm"', "[[tool]] 1: unknown key 'fed'; did you mean 'feed'"),
        ('feed = "12 ipm"', 'feed = "0 ipm"', "'feed' is 0 ipm"),
        ('kind = "tap"', 'kind = "taps"', "did you mean 'tap'"),
        ('cycle = "G83"', 'cycle = "G84"', "G84 requires a tap"),
        ('cycle = "G83"', 'cycle = "G88"', "'cycle' is 'G88'"),
        ('peck = "3 mm"', "", "G83, which needs 'peck'"),
        ('peck = "3 mm"', 'point_angle = "200deg"\npeck = "3 mm"', "at most 180°"),
        ('cycle = "G83"', 'cycle = "G82"', "G82, which needs 'dwell'"),
        ('cycle = "G83"', "teeth = 2", "'teeth' is for mills only"),
        (
            'cycle = "G83"',
            'kind = "end-mill"\ncycle = "G83"',
            "'cycle' is not for kind 'end-mill', only for drilling tools",
        ),
        ('cycle = "G83"\npeck = "3 mm"', 'kind = "end-mill"', "'steps' names tool 1, a mill"),
        ('cycle = "G83"\npeck = "3 mm"', 'kind = "v-bit"', "a v-bit needs 'point_angle'"),
        (
            'cycle = "G83"\npeck = "3 mm"',
            'kind = "ball-mill"\ncorner_radius = "1 mm"',
            "not for kind 'ball-mill', only for end-mill",
        ),
        ('cycle = "G83"\npeck = "3 mm"', 'kind = "end-mill"\ncorner_radius = "9 mm"', "9 mm, more than half"),
        ('cycle = "G83"\npeck = "3 mm"', 'kind = "v-bit"\npoint_angle = "90deg"\ntip_diameter = "9 mm"', "not below"),
        ('cycle = "G83"', 'material = "wood"\ncycle = "G83"', "'material' is 'wood'; choose one of hss, carbide"),
        ('cycle = "G83"', 'life_cost = -2\ncycle = "G83"', "'life_cost' is -2, but must be from 0 to 1000000"),
        ('cycle = "G83"', 'cycle = "G82"\ndwell = "101 s"', "'dwell' is 101 s, but must be from 0 to 100 s"),
        ('cycle = "G83"', 'depth = "3 mm"\ncycle = "G83"', "'depth' is for centre drills only; set the depth of holes"),
        ('cycle = "G83"', 'life_cost = "2"\ncycle = "G83"', "'life_cost' is 2, but must be a number"),
        ("[[hole]]", "[[holes]]", "did you mean 'hole'"),
        ("[[hole]]", '[[hole]]\ndiameter = "6 mm"\nlayer = "M6"\nsteps = [1]\n[[hole]]', "already has a recipe"),
    ],
)
def test_a_wrong_table_is_refused_in_one_line_with_file_and_number(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    assert old in LIBRARY
    with pytest.raises(OptionError) as caught:
        load(tmp_path, LIBRARY.replace(old, new, 1))
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "tools.toml"))
    assert words in message
    assert "\n" not in message


@pytest.mark.parametrize("text", ["", "tool = 3", "tool = [3]", "[tool]\nnumber = 1", "hole = [[[1]]]"])
def test_a_file_without_a_tool_table_is_no_library(tmp_path: Path, text: str) -> None:
    with pytest.raises(OptionError, match=r"tools\.toml"):
        load(tmp_path, text)


def test_a_library_says_what_is_above_the_flutes_of_a_tool(tmp_path: Path) -> None:
    file = tmp_path / "tools.toml"
    file.write_text(
        '[[tool]]\nnumber = 1\nkind = "end-mill"\ndiameter = "6 mm"\nflute_length = "20 mm"\nshank_diameter = "8 mm"\n'
        'stickout = "1.5 in"\nshaft = "5.8 x 4, 5.8-8X3mm"\nholder = "20-28 x 5, 28 x 0.5in"\n'
    )
    (tool,) = load_tools(file).tools
    assert (tool.shank_diameter, tool.stickout) == pytest.approx((8.0, 38.1))
    assert tool.shaft == ((4.0, 5.8, 5.8), (3.0, 5.8, 8.0))
    assert tool.holder == ((5.0, 20.0, 28.0), pytest.approx((12.7, 28.0, 28.0)))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('holder = "28 x 40"', "'holder' needs 'stickout': its start above the tip"),
        ('shank_diameter = "6 mm"', "'shank_diameter' needs 'flute_length'"),
        ('stickout = "9 mm"\nholder = "28 x 40, 30"', "has the section '30', but must be such as '28 x 40'"),
        ('stickout = "9 mm"\nholder = "28 x -4"', "has the section '28 x -4'"),
        ('stickout = "9 mm"\nholder = "28-x 4"', "has the section '28-x 4'"),
        ('stickout = "9 mm"\nholder = "28 x 2000"', "has the section '28 x 2000'"),
        ('stickout = "9 mm"\nholder = ""', "has the section ''"),
        (f'stickout = "9 mm"\nholder = "{", ".join(["9 x 1"] * 41)}"', "has 41 sections; the limit is 40"),
        ('stickout = "0 mm"', "'stickout' is 0 mm, but must be above 0"),
    ],
)
def test_a_body_that_cannot_be_is_refused_with_its_key(line: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "tools.toml"
    file.write_text(f'[[tool]]\nnumber = 1\nkind = "end-mill"\ndiameter = "6 mm"\n{line}\n')
    with pytest.raises(OptionError) as refused:
        load_tools(file)
    assert words in str(refused.value)
    assert str(refused.value).startswith(f"{file}: [[tool]] 1: ")
