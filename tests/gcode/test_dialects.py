"""Dialects: profiles as data."""

from __future__ import annotations

import dataclasses

import pytest

from every import every
from leafcut.errors import OptionError
from leafcut.gcode.dialects import Dialect, dialect, dialects, parse_dialect
from leafcut.gcode.modal import GROUP_OF, M_GROUP_OF

MILLS = ["fagor8055", "fanuc", "grbl", "haas", "linuxcnc", "mach3", "mach4"]
TORCHES = ["fanuc-laser", "flame", "grbl-laser", "plasma", "qtplasmac", "waterjet"]
NAMES = sorted(MILLS + TORCHES)


def test_all_dialects_are_there() -> None:
    """Mills and drills, and those that drive a torch or a beam, by name."""
    assert dialects() == NAMES
    assert dialects(torch=True) == TORCHES
    assert dialects(torch=False) == MILLS


@every("name", NAMES)
def test_every_value_of_a_profile_states_its_source(name: str) -> None:
    """A fact without a source is an opinion: each key but the name's and the text's has one."""
    profile = dialect(name)
    changed = {
        f.name
        for f in dataclasses.fields(Dialect)
        if f.name not in ("name", "description", "sources")
        and (f.default is dataclasses.MISSING or getattr(profile, f.name) != f.default)
    }
    assert changed <= profile.sources.keys()
    assert all(profile.sources.values())
    assert profile.sources.keys() <= {f.name for f in dataclasses.fields(Dialect)}


@every("name", NAMES)
def test_every_word_of_a_profile_is_one_that_the_interpreter_knows(name: str) -> None:
    """Codes have a modal group; cycles, units and the preamble use words of the same profile."""
    profile = dialect(name)
    assert profile.g_codes <= GROUP_OF.keys()
    assert profile.m_codes <= M_GROUP_OF.keys()
    said = " ".join(profile.preamble).split()
    words = {profile.units_mm, profile.units_inch, *(word for word in said if word.startswith("G"))}
    assert {word for word in said if word.startswith("M")} <= set(profile.m_words.split())
    written = {w for w in profile.cycles if not (profile.cycle_words == "fagor" and w == "G82")}
    assert words | written <= set(profile.g_words.split())
    assert profile.end_word in profile.m_words.split()
    assert profile.dwell_unit in ("s", "ms", "cs", "point")
    assert profile.groups in ("rs274", "fanuc")


def test_an_unknown_dialect_names_the_nearest() -> None:
    """One line, with a suggestion."""
    with pytest.raises(OptionError, match="unknown dialect 'hass'; did you mean 'haas'"):
        dialect("hass")
    with pytest.raises(OptionError, match="there are: fagor8055"):
        dialect("../../etc/passwd")


def test_a_controller_is_added_by_a_text_alone() -> None:
    """A new profile needs its own words only; a wrong key or a missing one is named."""
    toy = 'description = "toy"\nextension = ".toy"\ng_words = "G0 G1 G90"\nm_words = "M2"\ngroups = "rs274"\n'
    rest = "preamble = []\ncycles = []\n"
    assert parse_dialect(toy + rest, "toy").g_codes == {0, 10, 900}
    with pytest.raises(OptionError, match="unknown key 'cicles'; did you mean 'cycles'"):
        parse_dialect(toy + rest + "cicles = []", "toy")
    with pytest.raises(OptionError, match="'preamble' is missing"):
        parse_dialect(toy, "toy")
    with pytest.raises(OptionError, match="not a TOML file"):
        parse_dialect("=", "toy")
