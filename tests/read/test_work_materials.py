"""Workpiece materials: the shipped ones, and files of the user."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.errors import OptionError
from leafcut.model.kinds import CuttingWork, ToolMaterial
from leafcut.read.work_materials import load_material, material_descriptions, material_names

OWN = """
name = "my-steel"
[cutting_force]
kc11 = "1700 MPa"
mc = 0.25
[[life]]
work = "drill"
tool = "hss"
constant = 9.8
life = 0.2
diameter = 0.4
feed = 0.5
"""


def own(tmp_path: Path, text: str) -> str:
    file = tmp_path / "my.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_every_value_of_every_shipped_material_has_its_source_or_is_called_an_estimate() -> None:
    assert len(material_names()) >= 12
    for name in material_names():
        material = load_material(name)
        assert material.name == name
        assert material.description
        assert material.density > 0
        said = {"density": True, "cutting_force": True, "hardness": material.hardness > 0}
        said |= {"tensile_strength": material.tensile_strength > 0, "drill_constant": material.drill_constant > 0}
        said |= {"feed.drill": material.drill_feed > 0, "feed.mill": material.mill_feed > 0}
        assert set(material.sources) == {key for key, there in said.items() if there}, name
        assert all(len(life.source) > 20 for life in material.lives)


def test_no_two_materials_share_a_name() -> None:
    names = [word for name in material_names() for word in (name, *load_material(name).also)]
    assert len(names) == len(set(names))
    assert [name for name, _ in material_descriptions()] == material_names()


@pytest.mark.parametrize("name", ["1045", "C45", " steel_c45 ", "steel c45"])
def test_a_material_is_found_by_any_of_its_names_however_they_are_written(name: str) -> None:
    assert load_material(name).name == "steel-c45"


def test_the_published_exercise_of_a_drill_is_met(tmp_path: Path) -> None:
    """D 9 mm, f 0.3 mm, T 15 min: v = 9.8·9^0.4 / (15^0.2·0.3^0.5) = 25.07 m/min; printed with rounding: 24.95."""
    life = load_material(own(tmp_path, OWN)).lives[0]
    speed = 25.067 * 1000 / 60
    assert life.seconds(speed, 0.3, 9.0) == pytest.approx(15 * 60.0, rel=1e-3)
    assert life.seconds(24.95 * 1000 / 60, 0.3, 9.0) == pytest.approx(15 * 60.0, rel=0.03)


def test_a_speed_and_its_life_are_a_taylor_constant(tmp_path: Path) -> None:
    """110 m/min for 15 min with n = 0.25: twice the speed lasts 1/16 as long."""
    text = OWN.partition("[[life]]")[0] + '[[life]]\nwork = "mill"\ntool = "carbide"\nspeed = "110 m/min"\n'
    material = load_material(own(tmp_path, text + 'at_life = "15 min"\nlife = 0.25\n'))
    (life,) = material.lives_of(CuttingWork.MILL, ToolMaterial.CARBIDE)
    assert life.seconds(110_000 / 60, 0.1, 10.0) == pytest.approx(900.0)
    assert life.seconds(220_000 / 60, 0.1, 10.0) == pytest.approx(900.0 / 16.0)
    assert material.lives_of(CuttingWork.DRILL, ToolMaterial.HSS) == ()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("steel-c54", "unknown material 'steel-c54'; did you mean 'steel-c45'?"),
        ("6016", "did you mean '6061'?"),
        ("xyz", "choose one of aluminium-6061"),
    ],
)
def test_an_unknown_material_is_refused_with_the_nearest_name(name: str, words: str) -> None:
    with pytest.raises(OptionError) as refused:
        load_material(name)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mc = 0.25", "", "the key 'mc' is missing"),
        ("mc = 0.25", "mc = 1.2", "'cutting_force.mc' is 1.2, but must be below 1"),
        ("mc = 0.25", "mc = -0.1", "'cutting_force.mc' is -0.1, but an exponent must be from 0 to 4"),
        ('"1700 MPa"', '"-1 MPa"', "'cutting_force.kc11' is -1 MPa, but must be above 0"),
        ('"1700 MPa"', "1700", "'cutting_force.kc11' is 1700, but must be a string with a unit"),
        ("constant = 9.8", "constant = 0", "[[life]] 1: 'constant' is 0, but must be above 0"),
        ("constant = 9.8", "", "[[life]] 1: the key 'constant' is missing"),
        ("constant = 9.8", "constant = 9.8\nspeed = '20 m/min'", "have the same meaning"),
        ("constant = 9.8", "speed = '20 m/min'\nat_life = '15 min'", "exponents other than 'life' need 'constant'"),
        ("constant = 9.8", "constant = 9.8\nat_life = '15 min'", "'at_life' is used only with 'speed'"),
        ("life = 0.2", "life = 1.0", "Taylor's exponent must be above 0 and below 1"),
        ("life = 0.2", "", "the key 'life' is missing"),
        ("feed = 0.5", "feed = 9", "'feed' is 9, but an exponent must be from 0 to 4"),
        ('tool = "hss"', 'tool = "wood"', "'tool' is 'wood'; choose one of hss, carbide"),
        ('name = "my-steel"', "also = 3", "'also' must be a list of other names"),
        ('name = "my-steel"', "hardness = -3", "'hardness' is -3, but must be from 0 to 1000"),
        ('name = "my-steel"', 'density = "-3 g/cm3"', "'density' is -3 g/cm3, but must not be negative"),
        ('name = "my-steel"', "drill_constant = -1", "'drill_constant' is -1, but must be from 0 to 100"),
        ('name = "my-steel"', "colour = 'red'", "unknown key 'colour'"),
        ("[[life]]", "[life]", "'life' must be written as [[life]]"),
        ("[[life]]", '[[life]]\nwork="drill"\ntool="hss"\nconstant=1\nlife=0.2\n[[life]]', "'work' is given twice"),
    ],
)
def test_a_file_that_cannot_be_is_refused_in_one_line_that_says_where(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    with pytest.raises(OptionError) as refused:
        load_material(own(tmp_path, OWN.replace(old, new)))
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)
    assert "my.toml" in str(refused.value)
