"""Dialects: profiles as data."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from leafcut.errors import OptionError
from leafcut.gcode.dialects import Dialect, dialect_names, dialect_template, load_dialect, parse_dialect
from leafcut.gcode.word_groups import GROUP_OF, M_GROUP_OF
from packages import Installer

NAMES = dialect_names()


def test_a_dialect_is_for_mills_or_for_torches() -> None:
    mills, torches = dialect_names(torch=False), dialect_names(torch=True)
    assert sorted(mills + torches) == NAMES
    assert {"fanuc", "grbl", "linuxcnc"} <= set(mills)
    assert {"fanuc-laser", "grbl-laser", "plasma"} <= set(torches)


@pytest.mark.parametrize("name", NAMES)
def test_every_value_of_a_profile_states_its_source(name: str) -> None:
    """A fact without a source is an opinion: each key but the name's and the text's has one."""
    profile = load_dialect(name)
    changed = {
        f.name
        for f in dataclasses.fields(Dialect)
        if f.name not in ("name", "description", "sources", "family")
        and (f.default is dataclasses.MISSING or getattr(profile, f.name) != f.default)
    }
    assert changed <= profile.sources.keys()
    assert all(profile.sources.values())
    assert profile.sources.keys() <= {f.name for f in dataclasses.fields(Dialect)}


@pytest.mark.parametrize("name", NAMES)
def test_every_word_of_a_profile_is_one_that_the_interpreter_knows(name: str) -> None:
    """Codes have a modal group; cycles, units and the preamble use words of the same profile."""
    profile = load_dialect(name)
    assert profile.g_codes <= GROUP_OF.keys()
    assert profile.m_codes <= M_GROUP_OF.keys()
    said = " ".join(profile.preamble).split()
    words = {*profile.units_mm.split(), *profile.units_inch.split(), *(word for word in said if word.startswith("G"))}
    assert {word for word in said if word.startswith("M")} <= set(profile.m_words.split())
    written = {w for w in profile.cycles if not (profile.cycle_words == "fagor" and w == "G82")}
    written = set() if profile.language != "g-code" else written
    assert words | written <= set(profile.g_words.split())
    assert profile.end_word in ("", *profile.m_words.split())
    assert profile.dwell_unit in ("s", "ms", "cs", "point")
    assert profile.groups in ("rs274", "fanuc")


def test_an_unknown_dialect_names_the_nearest() -> None:
    """One line, with a suggestion."""
    with pytest.raises(OptionError, match="unknown dialect 'hass'; did you mean 'haas'"):
        load_dialect("hass")
    with pytest.raises(OptionError, match=f"choose one of {NAMES[0]}"):
        load_dialect("../../etc/passwd")


TOY = """description = "toy"
extension = ".toy"
g_words = "G0 G1 G20 G21 G90"
m_words = "M3 M5 M30"
groups = "rs274"
preamble = ["G90"]
cycles = []
"""


def toy(text: str = "", name: str = "toy") -> Dialect:
    """Return a dialect with its own words and additional text."""
    return parse_dialect(TOY + text, name)


def test_a_controller_is_added_by_a_text_alone() -> None:
    """A new profile needs its own words only; a wrong key or a missing one is named, with its line."""
    assert toy().g_codes == {0, 10, 200, 210, 900}
    with pytest.raises(OptionError, match="toy:8: unknown key 'cicles'; did you mean 'cycles'"):
        toy("cicles = []")
    with pytest.raises(OptionError, match=r"^dialect toy: the key 'preamble' is missing"):
        parse_dialect(TOY.replace('preamble = ["G90"]', ""), "toy")
    with pytest.raises(OptionError, match="not a TOML file"):
        parse_dialect("=", "toy")


@pytest.mark.parametrize(
    "text, words",
    [
        ('name = "haas"', "toy:8: unknown key 'name'"),
        ('family = "linuxcnc"', "toy:8: unknown key 'family'"),
        ("torch = 5", "toy:8: 'torch' is not a table"),
        ("point_required = 1", "toy:8: 'point_required' is 1, but must be true or false"),
        ("decimals_mm = 0", "toy:8: 'decimals_mm' is 0, but must be a whole number from 2 to 6"),
        ("decimals_mm = true", "'decimals_mm' is True, but must be a whole number"),
        ("max_line = 1000000000", "'max_line' is 1000000000, but must be a whole number from 40 to 10000"),
        ('notes = "one"', "'notes' is one, but must be a list of strings"),
        ('notes = ["a\\nG0 Z-99"]', "'notes' has a G0 Z-99, but must be a list of strings without line breaks"),
        ('dwell_unit = "min"', "'dwell_unit' is 'min'; choose one of s, ms, point, cs"),
        ('stop_word = "M9"', "'stop_word' is 'M9'; choose one of M0, M226"),
        ('dwell_letter = "PP"', "'dwell_letter' is 'PP', but must be a capital letter"),
        ('dwell_cycles = ["G99"]', "'dwell_cycles' has 'G99'; choose one of G81, G82"),
        ('end_word = "M2"', "toy:8: 'end_word' is M2, which is not among the words of this dialect"),
        ('units_mm = "G71"', "'units_mm' is G71, which is not among the words of this dialect"),
        ("[sources]\nwords = 'x'", "toy:9: unknown key 'sources.words'; did you mean 'g_words'"),
        ('[torch]\non = "M3"', "'torch.off' is missing"),
        ('[torch]\non = "M5"\noff = "M5"', "toy:9: 'torch.on' must have the word M3 or M4"),
        ('[torch]\non = "M3"\noff = "M4"', "toy:10: 'torch.off' must have the word M5, and no other M word"),
        ('[torch]\non = "M3 S{power:>9999999}"\noff = "M5"', "'torch.on' has a brace"),
        ('[torch]\non = "M3 S{power.__class__}"\noff = "M5"', "'torch.on' has a brace"),
        ('[torch]\non = "M3"\noff = "M5"\npower = true', "'torch.on' must contain {power} if power = true"),
        (
            '[torch]\non = "M3"\noff = "M5"\nprobe = "G38.2"',
            "'torch.probe' has G38.2, which is not among the words of this dialect",
        ),
    ],
)
def test_what_no_dialect_can_say_is_refused_with_its_line(text: str, words: str) -> None:
    with pytest.raises(OptionError) as refused:
        toy(text)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "old, new, words",
    [
        ('".toy"', '"/../../x"', "'extension' is '/../../x', but must be a dot and up to eight letters and digits"),
        ('"G0 G1', '"G0 G1 G999', "toy:3: 'g_words' has 'G999', which is not a G word that leafcut understands"),
        ('"M3 M5', '"M3 M5 M3.5', "toy:4: 'm_words' has 'M3.5', which is not a M word that leafcut understands"),
        ('["G90"]', '["G90 G91"]', "toy:6: 'preamble' has G91, which is not among the words of this dialect"),
        ("cycles = []", 'cycles = ["G81"]', "toy:7: 'cycles' has G81, which is not among the words of this dialect"),
        ('"rs274"', '"siemens"', "toy:5: 'groups' is 'siemens'; choose one of rs274, fanuc"),
    ],
)
def test_words_that_leafcut_does_not_understand_are_refused_with_their_line(old: str, new: str, words: str) -> None:
    with pytest.raises(OptionError) as refused:
        parse_dialect(TOY.replace(old, new), "toy")
    assert words in str(refused.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('base = "heidenhain"\nend_word = ""', "toml:2: 'end_word' is '', but must be M30 for the language klartext"),
        ('base = "siemens"\nlength_offset = ""', "'length_offset' is '', but must be edge for the language sinumerik"),
    ],
)
def test_a_word_that_the_language_of_a_controller_requires_cannot_be_changed(
    text: str, words: str, tmp_path: Path
) -> None:
    file = tmp_path / "ours.toml"
    file.write_text(text)
    with pytest.raises(OptionError) as refused:
        load_dialect(str(file))
    assert words in str(refused.value)


def test_a_file_says_what_differs_from_its_base_and_is_of_that_family(tmp_path: Path) -> None:
    file = tmp_path / "ours.toml"
    file.write_text('base = "linuxcnc"\nextension = ".tap"\n')
    ours, base = load_dialect(str(file)), load_dialect("linuxcnc")
    changed = {"name": "ours.toml", "extension": ".tap"}
    assert ours == dataclasses.replace(base, **changed)
    assert ours.family == base.family == "linuxcnc"
    assert toy(name="linuxcnc").family == ""


@pytest.mark.parametrize("name", NAMES)
def test_a_dialect_that_is_printed_to_be_changed_is_the_same_until_it_is(name: str, tmp_path: Path) -> None:
    file = tmp_path / "my.toml"
    file.write_text(dialect_template(name), encoding="utf-8")
    assert load_dialect(str(file)) == dataclasses.replace(load_dialect(name), name="my.toml")
    with pytest.raises(OptionError, match="leafcut has no built-in dialect 'my'"):
        dialect_template("my")


def test_a_base_brings_its_own_base_and_its_torch_with_what_the_file_says_of_it() -> None:
    found = parse_dialect('base = "flame"\n[torch]\ncuts = ["plasma"]\n', "mine")
    flame = load_dialect("flame")
    assert flame.torch is not None
    assert found.torch == dataclasses.replace(flame.torch, cuts=("plasma",))
    assert (found.extension, found.notes, found.family) == (flame.extension, flame.notes, "flame")
    assert parse_dialect('base = "fanuc"\n', "mine").torch is None


@pytest.mark.parametrize("base", ['"nothing"', '"../machines/haas-vf2"', "5", '"my.toml"'])
def test_a_base_is_a_shipped_dialect_by_its_name(base: str) -> None:
    with pytest.raises(OptionError, match="mine:1: 'base' is"):
        parse_dialect(f"base = {base}\n", "mine")


def test_a_file_that_is_not_there_or_too_large_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=r"none\.toml: file not found"):
        load_dialect(str(tmp_path / "none.toml"))
    with (tmp_path / "large.toml").open("wb") as file:
        file.truncate(1_000_001)
    with pytest.raises(OptionError, match=r"large\.toml: the file is larger than 1000 kB"):
        load_dialect(str(tmp_path / "large.toml"))


def test_a_package_adds_a_dialect_and_a_broken_one_stops_no_other(install: Installer) -> None:
    install(
        "controls",
        {"leafcut.dialects": {"ours": "controls", "torn": "controls:TORN", "haas": "controls"}},
        {
            "controls/__init__.py": "from pathlib import Path\nTORN = Path(__file__).parent / 'torn.toml'",
            "controls/ours.toml": 'base = "haas"\nmax_line = 60\n',
            "controls/torn.toml": 'base = "haas"\nmax_line = "long"\n',
        },
    )
    assert load_dialect("ours") == dataclasses.replace(load_dialect("haas"), name="ours", max_line=60)
    assert load_dialect("haas").max_line == 80
    assert dialect_names() == sorted([*NAMES, "ours"])
    with pytest.raises(OptionError, match=r"the dialect 'torn' is a plug-in of controls .*torn\.toml:2: 'max_line' is"):
        load_dialect("torn")
    with pytest.raises(OptionError, match="unknown dialect 'our'; did you mean 'ours'"):
        load_dialect("our")
