"""Read work materials: convert TOML to a `WorkMaterial`.

A shipped material is loaded by its name or a synonym, and any other material by its path.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, OptionError, name_suggestion
from leafcut.files.schemas import MATERIAL
from leafcut.files.toml_table import TomlTable
from leafcut.files.whole_files import parse_toml, read_toml, read_toml_text
from leafcut.model.kinds import CuttingWork, ToolMaterial
from leafcut.model.work_material import ToolLife, WorkMaterial
from leafcut.units import SECONDS_PER_MINUTE

_EXPONENTS = ("diameter", "feed", "width", "depth", "teeth")
#: The keys of a material file, by table.
MATERIAL_KEYS: dict[str, tuple[str, ...]] = {
    "": ("name", "description", "also", "tensile_strength", "hardness", "density", "drill_constant"),
    "cutting_force": ("kc11", "mc"),
    "feed": ("drill", "mill"),
    "life": ("work", "tool", "constant", "factor", "speed", "at_life", "life", *_EXPONENTS, "least_feed", "source"),
}
_TOP_KEYS = (*MATERIAL_KEYS[""], *(table for table in MATERIAL_KEYS if table), "sources")
_SOURCE_KEYS = (
    "tensile_strength", "hardness", "density", "drill_constant", "cutting_force", "feed.drill", "feed.mill",
)  # fmt: skip

#: Largest exponent of a tool life law.
_STEEPEST = 4.0
#: Conversion of Taylor's C from m/min at 1 min, as in handbooks, to mm/s at 1 s: multiply by this value and by 60^m.
_MM_PER_S = 1000.0 / SECONDS_PER_MINUTE


def material_names() -> list[str]:
    """Return the sorted names of the shipped materials."""
    files = resources.files("leafcut.materials").iterdir()
    return sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml"))


def load_material(name_or_path: str) -> WorkMaterial:
    """Load a material by its name, a synonym, or the path of its ``.toml`` file.

    Raises
    ------
    OptionError
        The material or the file does not exist (the message suggests the nearest name).
    DataError
        The file cannot be read, or a key is unknown, missing, of the wrong kind or out of range.
    """
    if name_or_path.lower().endswith(".toml"):
        return _material_from_values(read_toml(Path(name_or_path), MATERIAL), name_or_path)
    key = name_or_path.strip().lower().replace("_", "-").replace(" ", "-")
    if key in material_names():
        return _shipped_material(key)
    by_synonym = {synonym: name for name in material_names() for synonym in _shipped_material(name).also}
    if key in by_synonym:
        return _shipped_material(by_synonym[key])
    known = (
        [*material_names(), *by_synonym] if name_suggestion(key, by_synonym).startswith("; did") else material_names()
    )
    raise OptionError("unknown material '{}'{}", name_or_path, name_suggestion(key, known))


def material_descriptions() -> list[tuple[str, str]]:
    """Return the name of each shipped material, and a description that includes its synonyms."""
    materials = [_shipped_material(name) for name in material_names()]
    return [(material.name, f"{material.description} ({', '.join(material.also)})") for material in materials]


def material_file_text(name_or_path: str) -> str:
    """Return the text of a material file for editing. The text states the source of every value.

    Raises the same errors as `load_material`.
    """
    material = load_material(name_or_path)
    if name_or_path.lower().endswith(".toml"):
        return read_toml_text(Path(name_or_path))
    return (resources.files("leafcut.materials") / f"{material.name}.toml").read_text(encoding="utf-8")


def _shipped_material(name: str) -> WorkMaterial:
    file = resources.files("leafcut.materials") / f"{name}.toml"
    return _material_from_values(parse_toml(file.read_text(encoding="utf-8"), file.name, MATERIAL), file.name)


def _material_from_values(data: dict[str, Any], place: str) -> WorkMaterial:
    top = TomlTable(data, place, _TOP_KEYS)
    force, feed = (top.table(name, MATERIAL_KEYS[name]) for name in ("cutting_force", "feed"))
    sources = top.table("sources", _SOURCE_KEYS)
    kc11 = force.quantity("kc11", "N/mm²")
    mc = _parse_exponent(force, "mc")
    if not 0 < kc11 < 100_000:
        raise force.value_error("kc11", "is {}, but must be above 0 and below 100000 N/mm²", force.as_written("kc11"))
    if not mc < 1:
        raise force.value_error("mc", "is {:g}, but must be below 1", mc)
    return WorkMaterial(
        name=top.text("name", Path(place).stem),
        kc11=kc11,
        mc=mc,
        description=top.text("description", ""),
        also=_parse_synonyms(top),
        tensile_strength=_parse_non_negative(top, "tensile_strength", "N/mm²"),
        hardness=_parse_number_up_to(top, "hardness", 1000.0),
        density=_parse_non_negative(top, "density", "kg/m³"),
        lives=_parse_tool_lives(top),
        drill_constant=_parse_number_up_to(top, "drill_constant", 100.0),
        drill_feed=_parse_number_up_to(feed, "drill", 1.0),
        mill_feed=_parse_number_up_to(feed, "mill", 1.0),
        sources={key: sources.text(key) for key in sources.values},
    )


def _parse_synonyms(top: TomlTable) -> tuple[str, ...]:
    value = top.values.get("also", [])
    if not isinstance(value, list) or not all(isinstance(name, str) and name.isprintable() for name in value):
        raise top.value_error("also", 'must be a list of other names, such as ["1045", "ck45"]')
    return tuple(value)


def _parse_non_negative(table: TomlTable, key: str, unit: str) -> float:
    value = table.quantity(key, unit, 0.0)
    if value < 0:
        raise table.value_error(key, "is {}, but must not be negative", table.as_written(key))
    return value


def _parse_number_up_to(table: TomlTable, key: str, limit: float) -> float:
    value = table.number(key, 0.0)
    if not 0 <= value <= limit:
        raise table.value_error(key, "is {:g}, but must be from 0 to {:g}", value, limit)
    return value


def _parse_positive_number(table: TomlTable, key: str, default: float | None = None) -> float:
    if key not in table and default is None:
        raise DataError("{}: the key '{}' is missing", table.place, key)
    value = table.number(key, default or 0.0)
    if not value > 0:
        raise table.value_error(key, "is {:g}, but must be above 0", value)
    return value


def _parse_exponent(table: TomlTable, key: str, default: float | None = None) -> float:
    if key not in table and default is None:
        raise DataError("{}: the key '{}' is missing", table.place, key)
    value = table.number(key, default or 0.0)
    if not 0 <= value <= _STEEPEST:
        raise table.value_error(key, "is {:g}, but an exponent must be from 0 to {:g}", value, _STEEPEST)
    return value


def _parse_tool_lives(top: TomlTable) -> tuple[ToolLife, ...]:
    tables = top.values.get("life", [])
    if not isinstance(tables, list):
        raise DataError("{}: 'life' must be written as [[life]], once for each entry", top.place)
    lives: list[ToolLife] = []
    for count, values in enumerate(tables, start=1):
        table = TomlTable(values, f"{top.place}: [[life]] {count}", MATERIAL_KEYS["life"])
        life = _parse_tool_life(table)
        if any(
            (other_life.work, other_life.tool_material, other_life.least_feed) == _tool_life_key(life)
            for other_life in lives
        ):
            raise table.value_error(
                "work",
                "is given twice for the same work and tool material; such entries need different 'least_feed' values",
            )
        lives.append(life)
    return tuple(sorted(lives, key=_tool_life_key))


def _tool_life_key(life: ToolLife) -> tuple[CuttingWork, ToolMaterial, float]:
    return life.work, life.tool_material, life.least_feed


def _parse_tool_life(table: TomlTable) -> ToolLife:
    exponent = _parse_exponent(table, "life")
    if not 0 < exponent < 1:
        raise table.value_error("life", "is {:g}, but Taylor's exponent must be above 0 and below 1", exponent)
    exponents = {key: _parse_exponent(table, key, 0.0) for key in _EXPONENTS}
    if "constant" in table and "speed" in table:
        raise table.value_error("speed", "and 'constant' have the same meaning; leave one out")
    if "speed" in table:
        if any(exponents.values()):
            raise table.value_error(
                "speed", "is for a single tool and feed: exponents other than 'life' need 'constant'"
            )
        speed, life = table.quantity("speed", "mm/s"), table.quantity("at_life", "s")
        if not (speed > 0 and life > 0):
            raise table.value_error("speed", "and 'at_life' must be above 0")
        constant = speed * life**exponent
    else:
        if "at_life" in table:
            raise table.value_error("at_life", "is used only with 'speed'")
        constant = _parse_positive_number(table, "constant") * _MM_PER_S * SECONDS_PER_MINUTE**exponent
    return ToolLife(
        work=CuttingWork(table.text("work", choices=tuple(CuttingWork))),
        tool_material=ToolMaterial(table.text("tool", choices=tuple(ToolMaterial))),
        constant=_parse_positive_number(table, "factor", 1.0) * constant,
        life=exponent,
        **exponents,
        least_feed=_parse_non_negative(table, "least_feed", "mm"),
        source=table.text("source", ""),
    )
