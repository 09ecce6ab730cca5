"""Machine profiles: the shipped ones, and messages for wrong ones."""

from __future__ import annotations

from pathlib import Path

import pytest

import leafcut
from leafcut.errors import OptionError
from leafcut.read.machine import SOURCE_KEYS, load_machine, machine_names, machine_template
from leafcut.read.machine_keys import PROFILE_KEYS

PROFILE = """
name = "mine"
description = "a mill of mine"
controller = "linuxcnc"
max_feed = "3 m/min"

[rapid]
style = "linear"
velocity = ["6 m/min", "100 ipm", "50 mm/s"]
acceleration = "0.5 m/s2"

[travel]
min = ["0 mm", "0 mm", "-8 in"]
max = ["400 mm", "20 cm", "0 mm"]

[spindle]
max_speed = "6 krpm"

[tool_change]
automatic = false
time = "1 min"
position = ["0 mm", "200 mm"]
"""


def write(folder: Path, text: str) -> str:
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def refusal(name: str) -> str:
    with pytest.raises(OptionError) as caught:
        load_machine(name)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_these_machines_are_shipped_with_a_description_each() -> None:
    assert set(machine_names()) == {
        "haas-vf2",
        "linuxcnc-mill",
        "linuxcnc-sim",
        "grbl-3018",
        "mach3-router",
        "fagor-8055",
        "pcb-drill",
        "marlin-mpcnc",
        "siemens-828d",
        "heidenhain-tnc",
        "centroid-mill",
        "uccnc-router",
        "edingcnc-router",
        "masso-router",
        "mach4-router",
        "duet-router",
        "shapeoko-router",
        "openbuilds-router",
        "grbl-laser-5w",
        "grbl-laser-20w",
        "grbl-laser-co2",
        "plasma-table",
        "laser-table",
        "flame-table",
        "water-table",
    }
    assert all(load_machine(name).description for name in machine_names())


@pytest.mark.parametrize("name", machine_names())
def test_every_value_of_a_shipped_profile_has_its_source(name: str) -> None:
    import tomllib
    from importlib import resources

    machine = load_machine(name)
    data = tomllib.loads((resources.files("leafcut.machines") / f"{name}.toml").read_text(encoding="utf-8"))
    stated = {
        key
        for key in SOURCE_KEYS
        if (key.split(".")[-1] in data.get(key.split(".")[0], {}) if "." in key else key in data)
    }
    assert machine.name == name
    assert set(machine.sources) == stated
    assert all(machine.sources.values())


def test_a_profile_may_say_how_corners_are_taken(tmp_path: Path) -> None:
    plain = load_machine(write(tmp_path, PROFILE))
    assert (plain.corners, plain.corner_deviation) == ("", 0.01)
    stated = load_machine(write(tmp_path, PROFILE + '[corners]\nstyle = "round"\ndeviation = "0.002 in"\n'))
    assert stated.corners == "round"
    assert stated.corner_deviation == pytest.approx(0.0508)
    assert "'grbl'" in refusal(write(tmp_path, PROFILE + '[corners]\nstyle = "gribl"\n'))
    assert "corners.deviation" in refusal(write(tmp_path, PROFILE + '[corners]\ndeviation = "0 mm"\n'))


def test_the_simulated_machine_is_that_of_its_ini_file() -> None:
    """[AXIS_*] MAX_VELOCITY 100, 100, 50; MAX_ACCELERATION 500, 500, 300; limits -2000..4000, -500..500; ratio 0.1."""
    machine = load_machine("linuxcnc-sim")
    assert machine.rapid_velocity == (100.0, 100.0, 50.0)
    assert machine.acceleration == (500.0, 500.0, 300.0)
    assert machine.acceleration_factor == 0.9
    assert (machine.travel_min, machine.travel_max) == ((-2000.0, -2000.0, -500.0), (4000.0, 4000.0, 500.0))
    assert (machine.rapid_style, machine.safe_z, machine.tool_change_s) == ("linear", None, 0.0)


def test_the_haas_is_that_of_its_data_sheet() -> None:
    """Travels 30 × 16 × 20 in, rapids 1000 in/min, cutting 650 in/min, 8100 rpm."""
    machine = load_machine("haas-vf2")
    travel = [h - low for low, h in zip(machine.travel_min, machine.travel_max, strict=True)]
    assert travel == pytest.approx([30 * 25.4, 406, 508])
    assert machine.rapid_velocity == pytest.approx((25400 / 60,) * 3)
    assert machine.max_feed == pytest.approx(650 * 25.4 / 60, rel=1e-3)
    assert (machine.rapid_style, machine.spindle_max_rpm, machine.safe_z) == ("dogleg", 8100, 0.0)


def test_a_file_of_the_users_is_read_with_its_units(tmp_path: Path) -> None:
    machine = load_machine(write(tmp_path, PROFILE))
    assert machine.rapid_velocity == pytest.approx((100, 2540 / 60, 50))
    assert machine.acceleration == pytest.approx((500, 500, 500))
    assert machine.travel_min == pytest.approx((0, 0, -203.2))
    assert machine.travel_max == pytest.approx((400, 200, 0))
    assert (machine.spindle_max_rpm, machine.tool_change_s) == pytest.approx((6000, 60))
    assert machine.tool_change_position == (0.0, 200.0)
    assert machine.work_offset is None
    assert not machine.tool_changer


def test_a_profile_may_say_what_its_spindle_gives(tmp_path: Path) -> None:
    """10 hp are 7.457 kW, 30 ft·lb 40.67 N·m; without the keys the values are unknown."""
    plain = load_machine(write(tmp_path, PROFILE))
    assert (plain.spindle_power, plain.spindle_torque, plain.max_thrust) == (0.0, 0.0, 0.0)
    said = '[spindle]\npower = "10 hp"\ntorque = "30 ft-lb"\nmax_thrust = "2 kN"\n'
    machine = load_machine(write(tmp_path, PROFILE.replace("[spindle]\n", said)))
    assert machine.spindle_power == pytest.approx(7457, rel=1e-4)
    assert machine.spindle_torque == pytest.approx(40_675, rel=1e-4)
    assert machine.max_thrust == 2000.0
    for key, value in (("power", "-1 kW"), ("torque", "-1 N·m"), ("max_thrust", "-1 N")):
        text = PROFILE.replace("[spindle]\n", f'[spindle]\n{key} = "{value}"\n')
        assert f"'spindle.{key}' must not be negative" in refusal(write(tmp_path, text))


def test_a_work_offset_given_takes_the_place_of_the_profiles() -> None:
    assert load_machine("linuxcnc-sim", (1, 2, 3)).work_offset == (1.0, 2.0, 3.0)
    with pytest.raises(OptionError, match="x, y and z"):
        load_machine("linuxcnc-sim", (1, 2))


def test_an_unknown_machine_is_told_the_nearest_name() -> None:
    assert "did you mean 'haas-vf2'" in refusal("haas-vf3")
    assert "haas-vf2" in refusal("zzz")
    assert "unknown machine" in refusal("../machines/haas-vf2")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("max_feed", "max_fed", "unknown key 'max_fed'; did you mean 'max_feed'"),
        ("velocity =", "velocty =", "unknown key 'rapid.velocty'; did you mean 'velocity'"),
        ("[rapid]", "[rapids]", "did you mean 'rapid'"),
        ('acceleration = "0.5 m/s2"', 'acceleration = "-0.5 m/s2"', "'rapid.acceleration' of x is -0.5 m/s2"),
        ("max = [", "mix = [", "unknown key 'travel.mix'"),
        ('max = ["400 mm", "20 cm", "0 mm"]', "", "the key 'travel.max' is missing"),
        ('controller = "linuxcnc"', "", "the key 'controller' is missing"),
        ('max_feed = "3 m/min"', "max_feed = 3", "must be a string with a unit"),
        ('max_feed = "3 m/min"', 'max_feed = "3 m/fortnight"', "unknown unit 'm/fortnight'"),
        ('max_feed = "3 m/min"', 'max_feed = "0 m/min"', "'max_feed' is 0 m/min, but must be above 0"),
        ('max_feed = "3 m/min"', 'max_feed = "-1 m/min"', "'max_feed' is -1 m/min, but must be above 0"),
        ('max_feed = "3 m/min"', 'max_feed = "1e999 m/min"', "not a finite number"),
        ('style = "linear"', 'style = "linaer"', "did you mean 'linear'"),
        ('["400 mm", "20 cm", "0 mm"]', '["400 mm", "20 cm"]', "3 strings, one for each axis"),
        ('["400 mm", "20 cm", "0 mm"]', '["400 mm", "-20 cm", "0 mm"]', "'travel.max' of y is -200 mm"),
        ("automatic = false", 'automatic = "no"', "must be true or false"),
        ('time = "1 min"', 'time = "-1 min"', "'tool_change.time' is -60 s"),
        ('name = "mine"', "name = 7", "'name' is 7, but must be a string"),
        ('name = "mine"', 'home = "9 m"\nname = "mine"', "'home' of x is 9000 mm, outside the travel"),
        ('name = "mine"', 'safe_z = "1 mm"\nname = "mine"', "'safe_z' is 1 mm, outside the travel"),
        ('name = "mine"', 'acceleration_factor = 2\nname = "mine"', "'acceleration_factor' is 2"),
        ('name = "mine"', 'name = ""', "'name' is empty"),
        ('max_speed = "6 krpm"', 'max_speed = "0 rpm"', "'spindle.max_speed' must be above 0 and not below"),
        ('max_speed = "6 krpm"', 'max_speed = "6 krpm"\nmin_speed = "7 krpm"', "'spindle.max_speed' must be above 0"),
        ("[rapid]", '[corners]\narc_tolerance = "0 mm"\n[rapid]', "'corners.arc_tolerance' is 0 mm, but must be above"),
        (
            "[rapid]",
            '[motors]\nsteps_per_mm = ["80 steps/mm", "0 steps/mm", "9 steps/mm"]\n[rapid]',
            "'motors.steps_per_mm' of y is 0, but must be above 0",
        ),
        ("[rapid]", '[motors]\nlock_time = "1 s"\n[rapid]', "'motors.lock_time' is 1 s, but must be 0 or more, below"),
        ('name = "mine"', 'nozzle_diameter = "1 m"\nname = "mine"', "'nozzle_diameter' is 1 m, but must be 0 to"),
        (
            'controller = "linuxcnc"',
            'controller = "linuxnc"',
            "'linuxnc', which is not a dialect; did you mean 'linuxcnc'",
        ),
        ('controller = "linuxcnc"', 'controller = "none.toml"', "which does not exist in the folder of the profile"),
        ('controller = "linuxcnc"', 'controller = "../a.toml"', "must be in the folder of the profile"),
        ("[spindle]", "[sources]\nrapids = 'a book'\n[spindle]", "unknown key 'sources.rapids'"),
        ("[rapid]", "rapid = 3\n[x]", "unknown key 'x'"),
        ("[rapid]", "[rapid", "not a TOML file"),
        ("[rapid]", "x = " + "[" * 100_000, "not a TOML file"),
        ("[rapid]", "x = " + "9" * 10_000, "not a TOML file"),
    ],
)
def test_a_wrong_profile_is_refused_in_one_line_with_its_file(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in PROFILE
    name = write(tmp_path, PROFILE.replace(old, new))
    message = refusal(name)
    assert message.startswith(name)
    assert words in message


def test_a_table_that_is_no_table_is_refused(tmp_path: Path) -> None:
    text = 'rapid = 3\nname = "mine"\ndescription = "d"\ncontroller = "haas"\nmax_feed = "1 m/min"\n'
    assert "'rapid' is not a table; write [rapid]" in refusal(write(tmp_path, text))


def test_what_is_no_file_of_ours_is_refused_in_one_line(tmp_path: Path) -> None:
    assert "file not found" in refusal(str(tmp_path / "none.toml"))
    (tmp_path / "folder.toml").mkdir()
    assert "file not found" in refusal(str(tmp_path / "folder.toml"))
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\x00\xff\xfe" * 100)
    assert "not UTF-8" in refusal(str(binary))
    large = tmp_path / "large.toml"
    large.write_bytes(b"# " + b"x" * 1_000_001)
    assert "larger than" in refusal(str(large))
    assert "file not found" in refusal("a\0b.toml")


def test_a_torch_may_have_a_probe(tmp_path: Path) -> None:
    probe = load_machine(write(tmp_path, PROFILE + '[probe]\nfeed = "600 mm/min"\nswitch_offset = "4 mm"\n')).probe
    assert probe is not None
    assert (probe.feed, probe.depth, probe.switch_offset) == (10.0, 20.0, 4.0)
    for wrong, words in (
        ('feed = "0 mm/min"', "probe.feed"),
        ('feed = "1 m/min"\ndepth = "2 mm"\nswitch_offset = "3 mm"', "probe.switch_offset"),
        ('depth = "2 mm"', "feed"),
    ):
        with pytest.raises(OptionError, match=words):
            load_machine(write(tmp_path, PROFILE + f"[probe]\n{wrong}\n"))


@pytest.mark.parametrize("name", machine_names())
def test_a_profile_shown_as_a_template_is_the_same_machine_when_it_is_read_again(name: str, tmp_path: Path) -> None:
    """And so it is with all that it only shows as comments written in, where that is what holds."""
    text = machine_template(name)
    assert load_machine(write(tmp_path, text)) == load_machine(name)
    for key in PROFILE_KEYS:
        assert f"# {key.help}" in text
        if key.default is not None and key.table != "probe":
            text = text.replace(f"\n# {key.key} = ", f"\n{key.key} = ", 1)
    said = load_machine(write(tmp_path, text))
    assert (said.units, said.acceleration_factor, said.spindle_min_rpm) == (
        load_machine(name).units,
        load_machine(name).acceleration_factor,
        load_machine(name).spindle_min_rpm,
    )


FEW = """
controller = "grbl"
[rapid]
velocity = ["3 m/min", "2 m/min", "600 mm/min"]
[travel]
min = "0 mm"
max = ["400 mm", "300 mm", "80 mm"]
"""


def test_few_keys_make_a_machine_and_what_is_taken_for_the_others_is_told(tmp_path: Path) -> None:
    """The name is that of the file; the maximum feed is the slower rapid of x and y: 2 m/min."""
    file = write(tmp_path, FEW)
    machine = load_machine(file)
    assert (machine.name, machine.description) == ("mine", "mine")
    assert machine.max_feed == pytest.approx(2000 / 60)
    assert machine.acceleration == (500.0, 500.0, 500.0)
    assert set(machine.assumed) == {"max_feed"} | {key.name for key in PROFILE_KEYS if key.reported and key.default}
    required = {key.name for key in PROFILE_KEYS if key.required}
    assert required == {"controller", "rapid.velocity"}
    (told,) = [i for i in leafcut.optimize("example:plate-10", machine=file, thickness=5).issues if i.code == "L408"]
    assert told.severity == "note" and "max_feed 2000 mm/min" in told.message
    assert load_machine(write(tmp_path, machine_template(file))) == machine


@pytest.mark.parametrize("name", machine_names())
def test_nothing_that_is_told_is_assumed_of_a_shipped_machine(name: str) -> None:
    assert load_machine(name).assumed == {}
