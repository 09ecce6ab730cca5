"""Settings of real machines: values read by eye and worked out by hand; the profile is read back."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from leafcut.errors import ReadError
from leafcut.model.kinds import Head
from leafcut.read.controllers.importing import ImportedMachine, load_settings_text, machine_from_settings
from leafcut.read.machine import load_machine
from outside_programs import missing

HERE = Path(__file__).parent / "settings" / "real"
#: Where Debian's package has the samples of LinuxCNC.
LINUXCNC = Path("/usr/share/doc/linuxcnc/examples/sample-configs")
INCH = 25.4
UNKNOWN = ((-math.inf,) * 3, (math.inf,) * 3)

#: File → kind, rapids (mm/s), accelerations (mm/s²), travel (mm), and more values of the machine.
REAL: dict[str, tuple[str, Any, Any, Any, dict[str, Any]]] = {
    # $22 has bit 3: machine zero is at the switches, and $23 = 1: the switch of x is at its lower end
    "grbl_altmill.txt": ("grbl", (250, 250, 100), (1500, 1500, 1500), ((0, -1248, -170), (1260, 0, 0)),
        {"spindle_min_rpm": 7500, "spindle_max_rpm": 24000, "spindle_start_s": 11.0, "steps_per_mm": (320, 320, 200),
         "motor_lock_s": 0.0, "home": (0, 0, 0)}),
    "grbl_k40.txt": ("grbl", (200, 200, 200), (1000, 1000, 1000), ((-200, -300, -10), (0, 0, 0)),
        {"home": (-200, -300, 0), "steps_per_mm": (157.575, 157.575, 250)}),
    # of two answers the second counts, which is the same with $30
    "grbl_xcarve.txt": ("grbl", (8000 / 60, 8000 / 60, 500 / 60), (50, 50, 10), ((-200,) * 3, (0,) * 3),
        {"spindle_max_rpm": 1000, "steps_per_mm": (40, 46.8, 755.79), "motor_lock_s": 0.1}),
    "mach3_rnr.xml": ("mach3", (14.67, 5, 5), (60, 20, 20), UNKNOWN,
        {"units": "mm", "spindle_max_rpm": 24000, "spindle_start_s": 1.0, "name": "Mach3Mill"}),
    # the fourth pulley (<PULLEY>3); soft limits were set, and are off
    "mach3_cnc_models.xml": ("mach3", (16.67, 18.33, 10), (120, 120, 100), ((-593, -890, -160), (0, 0, 0)),
        {"units": "mm", "spindle_max_rpm": 8000, "spindle_min_rpm": 0, "spindle_start_s": 1.0}),
    # 33866.67 ÷ 4064 = 8.3333 in/s; 203200 ÷ 4064 = 50 in, 48768 ÷ 8128 = 6 in
    "mach4_1212.ini": ("mach4", (500 * INCH / 60, 500 * INCH / 60, 250 * INCH / 60), (25 * INCH, 25 * INCH, 20 * INCH),
        ((0, 0, 0), (50 * INCH, 50 * INCH, 6 * INCH)), {"units": "in", "spindle_max_rpm": 3600}),
    # 117041.2 ÷ 25536.26 = 275 in/min, 85120.9 ÷ 25536.26 = 200 in/min, 37650 ÷ 64542.8 = 35 in/min; 44, 48 and 7 in
    "mach4_industrial.ini": ("mach4", (275 * INCH / 60, 200 * INCH / 60, 35 * INCH / 60),
        (7.83 * INCH, 7.83 * INCH, 3.1 * INCH), ((0, 0, -7 * INCH), (44 * INCH, 48 * INCH, 0)),
        {"units": "in", "spindle_max_rpm": 24000, "spindle_start_s": 1.0}),
    # 112888.92 ÷ 13546.67 = 8.3333 in/s = 500 in/min; 885952 and 1473876 ÷ 13546.67 = 65.399984 in and 108.79987 in;
    # 84666.67 ÷ 25400 = 3.3333 in/s, 260350 ÷ 25400 = 10.25 in
    "mach4_blp.ini": ("mach4", (500 * INCH / 60, 500 * INCH / 60, 200 * INCH / 60),
        (100 * INCH, 100 * INCH, 50 * INCH),
        ((0, 0, -10.25 * INCH), (65.399984 * INCH, 108.79987 * INCH, 0)),
        {"units": "in", "spindle_max_rpm": 24000, "spindle_start_s": 1.0, "name": "BLP"}),
    # z homes upwards, the others downwards
    "fluidnc_lowrider.yaml": ("fluidnc", (150, 150, 20), (200, 200, 80), ((0, 0, -300), (1220, 2440, 0)),
        {"name": "LowRider", "steps_per_mm": (50, 50, 200), "home": (0, 0, 0)}),
    "fluidnc_6x.yaml": ("fluidnc", (5000 / 60,) * 3, (100,) * 3, ((150, -150, -150), (450, 150, 150)),
        {"spindle_min_rpm": 6000, "spindle_max_rpm": 24000, "home": (150, 150, 150), "steps_per_mm": (800,) * 3}),
    "fluidnc_s9.yaml": ("fluidnc", (100, 100, 1000 / 60), (1000,) * 3, ((1, 1, 0), (376, 396, 200)),
        {"head": Head.LASER, "controller": "grbl-laser", "arc_tolerance": 0.002, "steps_per_mm": (80, 80, 250)}),
    # M208 is no travel in Marlin; 10 mm/s of jerk: v² = a δ s/(1 - s), s = √½
    "marlin_ubl.txt": ("marlin", (500, 500, 10), (500, 500, 100), UNKNOWN,
        {"corner_deviation": pytest.approx(100 / (500 * 2.41421), rel=1e-3), "steps_per_mm": (80.29, 80.29, 399.21)}),
    "marlin_eeprom.gcode": ("marlin", (300, 300, 50), (2000, 2000, 100), UNKNOWN,
        {"corner_deviation": 0.03, "steps_per_mm": (80.12, 80.12, 399.78)}),
    # the second answer counts; T500 of M204, 7 mm/s of jerk
    "marlin_genius.txt": ("marlin", (200, 200, 20), (500, 500, 500), UNKNOWN,
        {"corner_deviation": pytest.approx(49 / (500 * 2.41421), rel=1e-3)}),
    "rrf_jenkins.g": ("rrf", (5000 / 60,) * 3, (400,) * 3, ((-838, -838, -85), (0, 0, 0)),
        {"name": "JenkinsCNC", "controller": "rrf", "spindle_max_rpm": 24000, "spindle_min_rpm": 0,
         "steps_per_mm": (80, 80, 400)}),
    # the switch of z is at its upper end
    "rrf_miranda.g": ("rrf", (2000 / 60, 2000 / 60, 1000 / 60), (70, 70, 100), ((0, 0, 0), (450, 450, 200)),
        {"home": (0, 0, 200), "steps_per_mm": (506.66, 506.66, 1500)}),
    "rrf_dethklok.g": ("rrf", (1000 / 60, 1000 / 60, 3), (500, 500, 20), UNKNOWN,
        {"name": "DeathKlok-Hacman", "spindle_min_rpm": 3000, "spindle_max_rpm": 23940}),
    # the files that it runs (M98) have the speeds; the travel is in variables of another file of the owner
    "milo/config.g": ("rrf", (50, 50, 6), (1000, 1000, 20), UNKNOWN, {"name": "Millenium Milo v1.5 M016"}),
}  # fmt: skip

#: Profiles whose owners never saved the tuning of their motors: real files without what a machine needs.
UNTUNED = ("mach3_untuned_inch.xml", "mach3_lathe4d.xml")

#: Samples of LinuxCNC that stand for a machine, the same way.
SAMPLES: dict[str, tuple[Any, Any, Any, dict[str, Any]]] = {
    "by_machine/boss/boss.ini": ((2 * INCH,) * 3, (10 * INCH,) * 3, ((0, 0, -4.75 * INCH), (18 * INCH, 12 * INCH, 0)),
        {"units": "in", "name": "LinuxCNC-BP-BOSS6"}),
    "by_machine/sherline/Sherline3Axis/Sherline3Axis_mm.ini": ((8,) * 3, (50,) * 3,
        ((-400, -300, -300), (400, 300, 300)), {"units": "mm"}),
    "by_machine/tormach/pcnc-1100-seriesII.ini": ((1.5 * INCH, 1.5 * INCH, 1.083 * INCH),
        (9 * INCH, 9 * INCH, 6 * INCH), ((0, 0, -20 * INCH), (18 * INCH, 9.5 * INCH, 0)), {"name": "PCNC-1100"}),
}  # fmt: skip


def of_file(path: Path) -> ImportedMachine:
    return machine_from_settings(load_settings_text(path), str(path))


def check(found: ImportedMachine, velocity: Any, acceleration: Any, travel: Any, more: dict[str, Any]) -> None:
    machine = found.machine
    assert machine.rapid_velocity == pytest.approx(velocity, rel=1e-6)
    assert machine.acceleration == pytest.approx(acceleration, rel=1e-6)
    assert machine.travel_min == pytest.approx(travel[0], abs=1e-4)
    assert machine.travel_max == pytest.approx(travel[1], abs=1e-4)
    for key, value in more.items():
        assert getattr(machine, key) == (pytest.approx(value) if isinstance(value, int | float | tuple) else value), key


def is_read_again(found: ImportedMachine, folder: Path) -> None:
    """The profile as a file is the machine that it was written from."""
    file = folder / "my.toml"
    file.write_text(found.text, encoding="utf-8")
    assert load_machine(str(file)) == found.machine


@pytest.mark.parametrize("name", REAL)
def test_a_file_of_a_real_machine_says_what_was_read_by_eye(name: str, tmp_path: Path) -> None:
    kind, velocity, acceleration, travel, more = REAL[name]
    found = of_file(HERE / name)
    assert found.kind == kind
    check(found, velocity, acceleration, travel, more)
    is_read_again(found, tmp_path)


def test_every_real_file_is_tried() -> None:
    files = {str(f.relative_to(HERE)) for f in HERE.rglob("*") if f.is_file() and f.suffix != ".md"}
    assert files - set(REAL) - set(UNTUNED) == {f"milo/{name}.g" for name in ("speed", "limits", "drives")}


def test_every_importer_reads_three_real_files_and_mach3_two() -> None:
    """Of Mach3 five were found, and only in two of them is the tuning of the motors. LinuxCNC's are its samples."""
    kinds = [values[0] for values in REAL.values()] + ["linuxcnc"] * len(SAMPLES)
    count = {kind: kinds.count(kind) for kind in kinds}
    assert count.pop("mach3") == 2
    assert min(count.values()) >= 3 and set(count) == {"grbl", "mach4", "fluidnc", "marlin", "rrf", "linuxcnc"}


@pytest.mark.parametrize("name", UNTUNED)
def test_a_profile_of_mach3_without_motor_tuning_says_what_to_save(name: str) -> None:
    with pytest.raises(ReadError, match="has no <Vel0>: the tuning of this motor was never saved; in Mach3 open"):
        of_file(HERE / name)


def test_a_profile_of_mach3_without_units_asks_for_them_and_takes_them() -> None:
    text = load_settings_text(HERE / "mach3_cnc_models.xml").replace("<Units>0</Units>", "")
    with pytest.raises(ReadError, match="has no <Units>, so its lengths may be mm or inches; set --units"):
        machine_from_settings(text, "a.xml")
    assert machine_from_settings(text, "a.xml", units="in").machine.rapid_velocity[2] == pytest.approx(10 * INCH)


@pytest.fixture
def linuxcnc_samples() -> Path:
    """Return the folder of the sample configurations that LinuxCNC ships."""
    if not LINUXCNC.is_dir():
        missing(f"the folder {LINUXCNC}", "linuxcnc-uspace")
    return LINUXCNC


def test_samples_of_linuxcnc_are_read_as_written(linuxcnc_samples: Path, tmp_path: Path) -> None:
    for name, values in SAMPLES.items():
        found = of_file(linuxcnc_samples / name)
        assert found.kind == "linuxcnc"
        check(found, *values)
        is_read_again(found, tmp_path)


def test_every_sample_of_linuxcnc_is_read_or_lacks_what_a_machine_needs(linuxcnc_samples: Path) -> None:
    """Lathes have no y, etching machines no z; the others demonstrate a single feature."""
    files = sorted(linuxcnc_samples.rglob("*.ini"))
    refused = []
    for file in files:
        try:
            of_file(file)
        except ReadError as problem:
            refused.append(str(problem))
    assert len(files) - len(refused) > 250
    words = (
        "has no axis",
        "more than any machine has",
        "of no controller",
        "which does not exist",
        "has no MAX_VELOCITY",
    )
    assert not [message for message in refused if not any(word in message for word in words)]


def config(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        (folder / f"{name}.g").write_text(text)
    return folder / "config.g"


SPEEDS = "M203 X6000 Y6000 Z600\nM201 X500 Y500 Z100\n"


def test_a_config_runs_the_files_of_its_folder_and_puts_numbers_for_variables(tmp_path: Path) -> None:
    """Values name the file that they stand in; the variable that was set last counts."""
    file = config(
        tmp_path,
        config='M453\nglobal xMax = 300\nset global.xMax = 335\nM98 P"0:/sys/speed.g"\nM98 P"limits.g" ; travel\n',
        speed="\n" + SPEEDS,
        limits="var zMin = -120\nM208 X0 Y0 Z{var.zMin} S1\nM208 X{global.xMax} Y208 Z0 S0\n",
    )
    found = of_file(file)
    assert (found.machine.travel_min, found.machine.travel_max) == ((0, 0, -120), (335, 208, 0))
    assert found.machine.sources["rapid.velocity"] == "M203, speed.g, line 2"
    assert found.machine.sources["travel.max"] == "M208, limits.g, lines 2 and 3"
    assert not any("not known" in note or "expressions" in note for note in found.notes)


def test_what_a_config_does_not_tell_is_noted(tmp_path: Path) -> None:
    notes = " ".join(of_file(HERE / "milo" / "config.g").notes)
    assert "files that are not in its folder" in notes and "vars.g" in notes and "M208 has expressions" in notes
    text = f'M453\nif exists(global.x)\n    M98 P"/macros/a.g"\n{SPEEDS}M98 P"../b.g"\n'
    (tmp_path / "b.g").write_text("M203 X1 Y1 Z1\n")
    (tmp_path / "sys").mkdir()
    found = of_file(config(tmp_path / "sys", config=text))
    assert found.machine.rapid_velocity == (100, 100, 10)  # nothing outside its folder was run
    assert any("conditions" in note for note in found.notes) and any("../b.g" in note for note in found.notes)


def test_a_config_that_runs_itself_ends(tmp_path: Path) -> None:
    with pytest.raises(ReadError, match="does a file run itself"):
        of_file(config(tmp_path, config=f'M453\n{SPEEDS}M98 P"config.g"\n'))
    many = {f"f{k}": f'M98 P"f{k + 1}.g"\n' * 9 for k in range(6)}
    with pytest.raises(ReadError, match="more than 100 files"):
        of_file(config(tmp_path, config=f'M453\n{SPEEDS}M98 P"f0.g"\n', f6="G90\n", **many))


def test_a_value_in_a_file_that_is_run_is_refused_with_its_place(tmp_path: Path) -> None:
    file = config(tmp_path, config='M453\nM98 P"a.g"\n', a="M203 X{1 + 2} Y1 Z1\nM201 X1 Y1 Z1\n")
    with pytest.raises(ReadError, match=r"M203 X \(a\.g, line 1\) is '\{1 \+ 2\}', but must be a number"):
        of_file(file)


GRBL = {"$22": "0", "$110": "5000.000", "$111": "5000.000", "$112": "800.000", "$120": "200.000", "$121": "200.000",
        "$122": "50.000", "$130": "400.000", "$131": "300.000", "$132": "60.000"}  # fmt: skip


def test_settings_as_senders_keep_them_in_a_file_are_those_of_grbl() -> None:
    """Universal Gcode Sender writes a list of keys and values, gSender one mapping; both as JSON."""
    plain = machine_from_settings("\n".join(f"{key}={value}" for key, value in GRBL.items()), "a.txt")
    each = ",\n".join(f'{{"key": "{k}",\n"value": "{v}",\n"units": "mm"}}' for k, v in GRBL.items())
    kept = machine_from_settings(
        f'{{"name": "Exported settings",\n"firmwareName": "GRBL 1.1f",\n"settings": [{each}]}}', "a.txt"
    )
    mapping = machine_from_settings("{" + ",".join(f'"{k}":"{v}"' for k, v in GRBL.items()) + "}", "a.txt")
    for one in (kept, mapping):
        assert one.kind == "grbl"
        assert one.machine.rapid_velocity == plain.machine.rapid_velocity == (5000 / 60, 5000 / 60, 800 / 60)
        assert one.machine.travel_min == plain.machine.travel_min == (-400, -300, -60)
    assert kept.machine.sources["rapid.acceleration"].endswith("lines 15, 18 and 21")


def test_grblhal_is_known_by_its_numbers_where_nothing_names_it() -> None:
    text = load_settings_text(HERE / "grbl_altmill.txt").replace("$300=grblHAL\n", "")
    assert machine_from_settings(text, "a.txt").title == "grblHAL"
    without = "\n".join(line for line in text.splitlines() if int(line[1:].partition("=")[0]) < 340)
    assert machine_from_settings(without, "a.txt").title == "GRBL"
