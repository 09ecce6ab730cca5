"""Settings of controllers: values worked out by hand; profiles that can be read back; refusals."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import pytest

from leafcut.errors import LeafcutError, OptionError, ReadError
from leafcut.model.kinds import Head
from leafcut.read.controllers.fluidnc import parse_board_configuration
from leafcut.read.controllers.importing import (
    KINDS,
    ImportedMachine,
    change_profile_values,
    decode_settings,
    detect_settings_kind,
    load_settings_text,
    machine_from_settings,
)
from leafcut.read.controllers.questions import QUESTIONS, machine_from_answers
from leafcut.read.controllers.values import ValueOrigin
from leafcut.read.machine import load_machine

HERE = Path(__file__).parent / "settings"
INCH = 25.4
NO = math.inf
LOW = -math.inf

FILES = sorted(f.name for f in HERE.iterdir() if f.is_file() and f.name not in ("README.md", "changes.toml"))

#: Values of a machine that a file does not state but that follow from it: file, value, expectation.
WORKED_OUT = [
    # 33866.67 counts/s ÷ 4064 counts/in = 8.333 in/s, which is 500 in/min
    ("mach4_inch.ini", "rapid_velocity", (500 * INCH / 60, 500 * INCH / 60, 250 * INCH / 60)),
    # X is moved by Motor1, Y by Motor0: 400000 ÷ 160 = 2500, 208000 ÷ 160 = 1300
    ("mach4_mm.ini", "travel_max", (2500, 1300, 0)),
    # Y homes upwards to 5 mm, X downwards to 0, Z not at all
    ("fluidnc_router.yaml", "home", (0, 5, 0)),
    # 90° at 10 mm/s: v² = a δ s/(1 - s), s = √½: 100 = 500 δ 2.4142
    ("marlin_jerk.txt", "corner_deviation", 100 / (500 * 2.41421)),
    # M203 in mm/min; of two motors the slower; 15 mm/s of jerk
    ("rrf_router.g", "rapid_velocity", (250, 200, 2000 / 60)),
    ("rrf_router.g", "corner_deviation", 225 / (500 * 2.41421)),
]


def of_file(name: str) -> ImportedMachine:
    return machine_from_settings(load_settings_text(HERE / name), str(HERE / name))


@pytest.mark.parametrize(
    ("old", "new", "controller"),
    [
        ("MACHINE = ", "MACHINE = Plasma-THC ", "plasma"),
        ("[TRAJ]", "[HAL]\nHALFILE = plasma-5i20.hal\n[TRAJ]", "plasma"),
        ("[TRAJ]", "[PLASMA]\nCUT = 1\n[TRAJ]", "plasma"),
        ("[TRAJ]", "[QTPLASMAC]\nMODE = 0\n[HAL]\nHALFILE = plasma.hal\n[TRAJ]", "qtplasmac"),
        ("DISPLAY = axis", "DISPLAY = qtvcp qtPLASMAc", "qtplasmac"),
        ("DISPLAY = axis", "DISPLAY = gmoccapy Plasma", "plasma"),
        ("[DISPLAY]", "[DISPLAY]\nPYVCP = plasma_panel.xml", "plasma"),
        ("[DISPLAY]", "[DISPLAY]\nEMBED_TAB_COMMAND = gladevcp plasma.ui", "plasma"),
        ("[TRAJ]", "[RS274NGC]\nPARAMETER_FILE = plasma.var\n[TRAJ]", "plasma"),
        ("[TRAJ]", "[HAL]\nHALFILE = plasmac.hal\n[TRAJ]", "plasma"),
        ("[TRAJ]", "[TRAJ]", "linuxcnc"),
    ],
)
def test_a_linuxcnc_file_that_names_plasma_is_of_a_plasma_table(old: str, new: str, controller: str) -> None:
    """Names as in LinuxCNC's sample configurations for plasma."""
    machine = machine_from_settings(INI.replace(old, new, 1), "x.ini").machine
    assert machine.controller == controller
    assert (machine.head is Head.TORCH) is (controller != "linuxcnc")


def test_the_preferences_of_mach3_may_be_the_whole_file() -> None:
    inner = MACH3[MACH3.index("<Preferences>") : MACH3.index("</profile>")]
    assert machine_from_settings(inner, "mach3_mm.xml").text == machine_from_settings(MACH3, "mach3_mm.xml").text
    bare = "\ufeff <?xml version='1.0'?>\n" + MACH3.replace("<Profile>Router", "<Profile>Rou\x01ter")
    assert machine_from_settings(bare, "a.xml").machine.name == "Rou?ter"


def test_there_are_three_files_of_each_kind() -> None:
    kinds = [of_file(name).kind for name in FILES]
    assert {kind: kinds.count(kind) for kind in KINDS} == dict.fromkeys(KINDS, 3) and len(kinds) == 3 * len(KINDS)


@pytest.mark.parametrize(("name", "value", "expected"), WORKED_OUT)
def test_a_file_of_settings_says_what_was_worked_out_by_hand(name: str, value: str, expected: Any) -> None:
    assert getattr(of_file(name).machine, value) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("name", FILES)
def test_a_profile_is_read_again_as_the_machine_it_was_written_from(name: str, tmp_path: Path) -> None:
    """Each value has its source and its origin; unknown values are marked as estimates."""
    found = of_file(name)
    file = tmp_path / "my.toml"
    file.write_text(found.text, encoding="utf-8")
    assert load_machine(str(file)) == found.machine
    told = {value.key for value in found.values} - {"name", "description"}
    assert set(found.machine.sources) == told
    for value in found.values:
        assert f"# {value.how}: {value.source}" in found.text
        if value.key in told:
            assert found.machine.sources[value.key].startswith("estimate: ") is (value.how is ValueOrigin.ASSUMED)
    assert all(key in ("travel",) for key in found.machine.assumed)


def test_what_a_profile_cannot_hold_is_told() -> None:
    assert any("corexy" in note for note in of_file("fluidnc_corexy.yaml").notes)
    assert any("not Cartesian" in note for note in of_file("rrf_delta_laser.g").notes)
    assert any("soft limits of z are off" in note for note in of_file("mach4_inch.ini").notes)
    assert any("PlasmaMode" in note for note in of_file("mach3_plasma.xml").notes)
    assert any("homing is off" in note for note in of_file("grbl_3018.txt").notes)
    text = (HERE / "linuxcnc_mm.ini").read_text().replace("trivkins coordinates=XYYZ", "genserkins coordinates=XYYZ")
    assert any("genserkins" in note for note in machine_from_settings(text, "x.ini").notes)


@pytest.mark.parametrize("name", ["linuxcnc_mm.ini", "mach3_mm.xml", "mach4_mm.ini"])
def test_units_are_asked_for_where_the_file_does_not_say_them_and_refused_where_it_does(name: str) -> None:
    text = load_settings_text(HERE / name)
    for there in ("LINEAR_UNITS = mm\n", "<Units>0</Units>", "SetupUnits=210\n"):
        unclear = text.replace(there, "<Units>7</Units>" if there.startswith("<") else "")
        if unclear != text:
            with pytest.raises(ReadError, match="mm or inches; set --units"):
                machine_from_settings(unclear, name)
            metric, inch = (machine_from_settings(unclear, name, units=unit).machine for unit in ("mm", "in"))
            assert inch.rapid_velocity == pytest.approx([INCH * one for one in metric.rapid_velocity])
    with pytest.raises(ReadError, match="leave --units out"):
        machine_from_settings(text, name, units="in")
    assert machine_from_settings(text, name, units="mm").machine == of_file(name).machine


def test_grbl_has_one_unit_and_refuses_another() -> None:
    with pytest.raises(OptionError, match="leave it out"):
        machine_from_settings(load_settings_text(HERE / "grbl_3018.txt"), "x", units="in")


def grbl(**changed: str) -> str:
    lines = (HERE / "grbl_3018.txt").read_text().splitlines()
    return "\n".join(f"${line[1:4]}={changed[line[1:4]]}" if line[1:4] in changed else line for line in lines)


BOMB = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{b}: &{b} [*{a},*{a},*{a},*{a},*{a},*{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
ENTITIES = (
    '<?xml version="1.0"?><!DOCTYPE p [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>'
    "<profile><Preferences><Units>&b;</Units></Preferences></profile>"
)
OUTSIDE = '<!DOCTYPE p [<!ENTITY a SYSTEM "file:///etc/passwd">]><profile><Preferences><Profile>&a;</Profile></Preferences></profile>'
AXES = "axes:\n  x: {max_rate_mm_per_min: 9000}\n  y: {max_rate_mm_per_min: 9000}\n"
MACH3 = (HERE / "mach3_mm.xml").read_text()
INI = (HERE / "linuxcnc_mm.ini").read_text()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("hello\nworld\n", "of no kind that leafcut knows; leafcut imports the answer of GRBL"),
        ("%\nO1\nG0 X1\nM30\n%\n", "is a program, not the settings"),
        ("[a]\nb = 1\n", "an INI file of no controller"),
        ("<svg></svg>", "is XML, but not a Mach3 profile"),
        (grbl(**{"110": "1e9"}), r"more than any machine has.*\$110"),
        (grbl(**{"110": "1e999"}), r"\$110 is 1e999, which no machine has"),
        (INI.replace("[AXIS_Z]", "[AXIS_W]"), "has no MAX_VELOCITY in"),
        (INI.replace("coordinates=XYYZ", "coordinates=XZ"), "has no axis y"),
        (INI.replace("= mm", "= furlong"), "LINEAR_UNITS is 'furlong', but must be mm or inch"),
        (INI.replace("KINK_RATIO = 0.05", "KINK_RATIO = 1.5"), "ARC_BLEND_KINK_RATIO is 1.5"),
        (INI + "\n#INCLUDE /etc/passwd\n", "includes '/etc/passwd', which is not in its folder"),
        (INI + "\n#INCLUDE ../test_controllers.py\n", "which is not in its folder"),
        (INI + "\n#INCLUDE ~/x\n", "which is not in its folder"),
        (INI + "\n#INCLUDE none.inc\n", "which does not exist"),
        (MACH3[: len(MACH3) // 2], "is not a complete XML file"),
        (MACH3.replace("<Vel1>", "<Vol1>").replace("</Vel1>", "</Vol1>"), "has no <Vel1>"),
        (MACH3.replace("<Steps0>200.", "<Steps0>0."), "steps per unit"),
        (ENTITIES, "declares XML entities"),
        (OUTSIDE, "declares XML entities"),
        (BOMB + AXES, ":1: has an anchor"),
        ("axes: " + "{a: " * 5000, "is nested too deep"),
        ("axes:\n  x: [1\n", "is not YAML"),
        ("axes:\n" + " " * 300_000, "has more than 256 KiB"),
        ("M203 X1 Y1 Z1\nM201 X1 Y1 Z1\n", "may be in mm/s or in mm/min; choose with --kind"),
        ("M566 X1\nM205 J1\nM203 X1 Y1 Z1\n", "words of both"),
        ("echo:  M203 X1 Y1\necho:  M201 X1 Y1 Z1\n", "M203 has no Z; is the file complete"),
        ("echo:  M203 X1 Y1 Z1\n", "has no M201"),
        ("M566 X1\nM203 X{a} Y1 Z1\nM201 X1 Y1 Z1", "M203 X is '.a.', but must be a number"),
        (AXES + "  z: {max_rate_mm_per_min: 9}\npwm:\n  speed_map: 0=0% fast\n", ":6: speed_map is '0=0% fast'"),
        ("M203 X1 Y1 Z1\nM201 X1 Y1 Z1\nM205 J0\n", ":3: M205 J is 0, but must be above 0"),
        ("echo: M203 X1 Y1 Z1\nM201 X1 Y1 Z1\nM205 J1\nM204 T0\n", ":4: M204 T is 0, but must be above 0"),
        (INI.replace("POSITION = 10 20 -5", "POSITION = 7"), "TOOL_CHANGE_POSITION is '7', but must be x, y and z"),
        ("<a><b>1</b></a>", "is XML, but not a Mach3 profile"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_refused_in_one_line_with_its_place(text: str, words: str) -> None:
    file = str(HERE / "bad.ini")
    with pytest.raises(ReadError, match=words) as caught:
        machine_from_settings(text, file)
    message = str(caught.value)
    assert message.startswith(file) and "\n" not in message and len(message) < 600


def test_an_ini_that_includes_itself_ends(tmp_path: Path) -> None:
    (tmp_path / "a.ini").write_text("[EMC]\n#INCLUDE a.ini\n")
    with pytest.raises(ReadError, match="does it include itself"):
        machine_from_settings("[EMC]\n#INCLUDE a.ini\n", str(tmp_path / "b.ini"))


def test_files_that_each_include_several_others_end(tmp_path: Path) -> None:
    """Nine times nine times nine …: they would be 43 million."""
    for k in range(8):
        (tmp_path / f"{k}.inc").write_text(f"#INCLUDE {k + 1}.inc\n" * 9)
    (tmp_path / "8.inc").write_text("[EMC]\n")
    with pytest.raises(ReadError, match="more than 200 files"):
        machine_from_settings("#INCLUDE 1.inc\n", str(tmp_path / "a.ini"))


def test_standard_input_has_the_bounds_of_a_file() -> None:
    with pytest.raises(ReadError, match="standard input: is larger than 4 MiB"):
        decode_settings(b"$" * (5 << 20), "standard input")


@pytest.mark.parametrize("before", ["", "Recv: ", "22:24:55.041 : ", "swift/serial_ascii: VERBOSE: -> "])
def test_what_a_terminal_writes_before_each_line_of_marlin_is_passed_over(before: str) -> None:
    """OctoPrint, Repetier-Host and others keep the answer to M503 with a time or a name before each line."""
    words = ("Steps per unit:", "  M203 X500.00 Y400.00 Z12.00 E120.00", "  M201 X900 Y800 Z500 E10000", "  M205 J0.02")
    machine = machine_from_settings("\n".join(f"{before}echo:{line}" for line in words), "a").machine
    assert machine.rapid_velocity == (500.0, 400.0, 12.0) and machine.controller == "marlin"


def test_lines_and_tags_that_only_cost_time_are_refused_or_left_out() -> None:
    """Each would take hours if every way of parsing it were tried."""
    for text in ("M203 " + "B{" * 500_000, "M205 J1\n" + "Min: X1 Y1 Z1\n" * 50_000, "Recv" + " " * 2_000_000):
        with pytest.raises(ReadError):
            machine_from_settings(text, "a")
    deep = "<a>" * 200_000 + "</a>" * 200_000
    assert machine_from_settings(MACH3.replace("<PulseSpeed>0</PulseSpeed>", deep), "a").kind == "mach3"


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.inc").write_text("[TRAJ]\n")
    (tmp_path / "in" / "link.inc").symlink_to(tmp_path / "secret.inc")
    with pytest.raises(ReadError, match="not in its folder"):
        machine_from_settings("[EMC]\n#INCLUDE link.inc\n", str(tmp_path / "in" / "a.ini"))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is empty"),
        (b" \n", "is empty"),
        (b"PK\x03\x04", "is a zip file"),
        ("$110=5\n".encode("utf-16"), "is UTF-16"),
        (b"\x7fELF\0\0", "is a binary file"),
        (b"x" * (5 << 20), "is larger than 4 MiB"),
    ],
)
def test_what_is_no_text_of_settings_is_refused(data: bytes, words: str, tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(data)
    with pytest.raises(ReadError, match=words):
        load_settings_text(tmp_path / "a")


def test_a_large_file_is_not_read_to_its_end(tmp_path: Path) -> None:
    """A file of 100 MB that uses no disk space: only the limit and one byte are read."""
    with (tmp_path / "large").open("wb") as file:
        file.truncate(100 << 20)
    with pytest.raises(ReadError, match="larger than 4 MiB"):
        load_settings_text(tmp_path / "large")
    for name, words in ((tmp_path, "a folder"), (tmp_path / "none", "not found"), ("a\0b", "not found|not a valid")):
        with pytest.raises(ReadError, match=words):
            load_settings_text(name)


def test_a_kind_can_be_said_where_the_contents_do_not_tell_it() -> None:
    """The same numbers are mm/s for Marlin and mm/min for RepRapFirmware."""
    text = "M203 X6000 Y6000 Z600\nM201 X500 Y500 Z100\n"
    assert machine_from_settings(text, "a", "marlin").machine.rapid_velocity == (6000, 6000, 600)
    assert machine_from_settings(text, "a", "rrf").machine.rapid_velocity == (100, 100, 10)
    with pytest.raises(OptionError, match="did you mean 'marlin'"):
        machine_from_settings(text, "a", "marlim")
    with pytest.raises(ReadError):
        detect_settings_kind(text, "a")


def test_names_from_a_file_cannot_break_the_profile(tmp_path: Path) -> None:
    text = INI.replace("shop-router", 'x" \\u0000 \x1b[31m # [rapid]')
    found = machine_from_settings(text, str(tmp_path / 'odd "name".ini'))
    assert tomllib.loads(found.text)["rapid"]["velocity"] == ["120 mm/s", "100 mm/s", "50 mm/s"]
    assert "\x1b" not in found.text


FOUR = 'name = "mine"\ncontroller = "grbl"\nrapid.velocity = "3 m/min"\nrapid.acceleration = "0.2 m/s2"\n'


def test_a_profile_of_four_lines_is_a_machine_and_its_unknown_travel_is_told(tmp_path: Path) -> None:
    import leafcut

    file = tmp_path / "four.toml"
    file.write_text(FOUR)
    machine = load_machine(str(file))
    assert (machine.rapid_velocity, machine.acceleration) == ((50, 50, 50), (200, 200, 200))
    assert machine.travel_min == (LOW,) * 3 and machine.reach(0) == NO and not machine.table_known
    outcome = leafcut.optimize("example:plate-10", machine=str(file), thickness=5)
    told = {issue.code: issue.message for issue in outcome.issues}
    assert "travel unknown in x, y, z" in told["L408"] and "the travel was not checked" in told["L403"]
    assert outcome.verified and math.isfinite(outcome.after.time_s)


def test_an_axis_whose_travel_is_unknown_leaves_the_others_checked(tmp_path: Path) -> None:
    import leafcut
    from leafcut.errors import VerifyError

    file = tmp_path / "small.toml"
    file.write_text(FOUR + '[travel]\nmin = ["0 mm", "0 mm", "unknown"]\nmax = ["9 mm", "9 mm", "unknown"]\n')
    assert load_machine(str(file)).travel_max == (9, 9, NO)
    with pytest.raises(VerifyError, match=r"the machine's travel is 9\.000 mm"):
        leafcut.optimize("example:plate-10", machine=str(file), thickness=5)
    file.write_text(FOUR + '[travel]\nmin = "0 mm"\nmax = ["1 m", "1 m", "unknwon"]\n')
    with pytest.raises(OptionError, match=r"'travel\.max' is wrong"):
        load_machine(str(file))


def answered(**more: Any) -> ImportedMachine:
    return machine_from_answers({"name": "Mill", "controller": "haas", "rapid": "1000 ipm", **more})


def test_a_few_answers_make_a_machine_and_the_rest_is_an_estimate_of_a_like_one(tmp_path: Path) -> None:
    """1000 in/min is 25.4 m/min; missing values are those of the Haas VF-2."""
    found = answered(travel="30in,16in,20in")
    vf2 = load_machine("haas-vf2")
    assert found.machine.rapid_velocity == pytest.approx((25400 / 60,) * 3)
    assert found.machine.travel_min == pytest.approx((-762, -406.4, -508)) and found.machine.travel_max == (0, 0, 0)
    for key in ("rapid_style", "acceleration", "corners", "spindle_max_rpm", "tool_changer", "tool_change_s"):
        assert getattr(found.machine, key) == getattr(vf2, key)
    assert {v.key for v in found.values if v.how is ValueOrigin.TAKEN} == {
        "name",
        "controller",
        "rapid.velocity",
        "travel.min",
        "travel.max",
    }
    (tmp_path / "a.toml").write_text(found.text, encoding="utf-8")
    assert load_machine(str(tmp_path / "a.toml")) == found.machine


def test_a_centroid_has_its_own_dialect() -> None:
    found = machine_from_answers({"name": "Knee mill", "controller": "centroid", "rapid": "300ipm"})
    assert found.machine.controller == "centroid" and found.machine.sources["controller"] == "answered"


def test_questions_are_asked_in_order_until_each_has_an_answer() -> None:
    """After a wrong answer the question is repeated with the error; Enter accepts the suggestion."""
    asked: list[str] = []
    replies = iter(
        ["Old mill", "hass", "haas", "", "in", "fast", "10 m/min", "", "500mm,400mm,300mm", "", "", "maybe", "no", ""]
    )

    def ask(question: str, likely: str) -> str:
        asked.append(question)
        return next(replies)

    machine = machine_from_answers({}, ask).machine
    assert (machine.name, machine.controller, machine.units, machine.tool_changer) == ("Old mill", "haas", "in", False)
    assert machine.rapid_velocity == pytest.approx((1000 / 6,) * 3) and machine.travel_min == (-500, -400, -300)
    assert [any(one.text in words for words in asked) for one in QUESTIONS] == [True] * len(QUESTIONS)
    assert "did you mean 'haas'" in asked[2] and "is not a number" in asked[6] and "not yes or no" in asked[12]


def test_an_imported_profile_is_completed_by_its_estimates_alone(tmp_path: Path) -> None:
    file = tmp_path / "imported.toml"
    file.write_text(of_file("linuxcnc_mm.ini").text, encoding="utf-8")
    asked: list[str] = []

    def ask(question: str, likely: str) -> str:
        asked.append(question)
        return {"whether the machine changes tools itself: yes or no": "yes", "time of one tool change": "6 s"}.get(
            question, ""
        )

    before, machine = load_machine(str(file)), machine_from_answers({}, ask, str(file)).machine
    assert (machine.tool_changer, machine.tool_change_s) == (True, 6.0)
    assert not any("rapids" in words or "travel" in words for words in asked)
    for key in ("rapid_velocity", "acceleration", "travel_min", "home", "acceleration_factor", "name", "corners"):
        assert getattr(machine, key) == getattr(before, key)


def test_what_a_base_has_by_estimate_stays_where_nobody_answers(tmp_path: Path) -> None:
    """The router's travel is an estimate, and better than none."""
    base, made = load_machine("mach3-router"), machine_from_answers({"name": "mine"}, None, "mach3-router").machine
    for key in ("travel_min", "travel_max", "rapid_velocity", "acceleration", "tool_change_s", "corner_deviation"):
        assert getattr(made, key) == getattr(base, key)
    enter = machine_from_answers({"name": "mine"}, lambda question, likely: "", "mach3-router")
    assert enter.machine == made
    assert machine_from_answers({"travel": "1m,2m,0.1m"}, None, "mach3-router").machine.travel_max == (1000, 2000, 0)


def test_a_controller_that_is_typed_is_compared_as_it_was_typed() -> None:
    replies = iter(["Knee", "Centroid", "", "", "300 ipm"])
    asked = machine_from_answers({}, lambda question, likely: next(replies, "")).machine
    given = machine_from_answers({"name": "Knee", "controller": "Centroid", "rapid": "300 ipm"}).machine
    assert asked == given and "centroid-mill" in asked.sources["rapid.acceleration"]
    assert asked.rapid_style == "linear" and asked.description == "Knee (centroid)"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rapid": "0"}, "--rapid: .*above 0"),
        ({"rapid": "1,2"}, "2 values, but must be one, or x,y,z"),
        ({"rapid": "1e9"}, "no machine has more than"),
        ({"rapid": "soon"}, "--rapid: 'soon' is not a number"),
        ({"acceleration": "1000 g"}, "no machine has more"),
        ({"travel": "5,5"}, "lengths of x,y,z"),
        ({"travel": "5,5,-1"}, "must be above 0"),
        ({"controller": "hass"}, "did you mean 'haas'"),
        ({"process": "hammer"}, "--process: 'hammer' is unknown"),
        ({"tool-changer": "maybe"}, "not yes or no"),
        ({"spindle-speed": "-1"}, "not above 0"),
        ({"name": ""}, "is not an answer"),
        ({"velocity": "1"}, "unknown answer 'velocity'"),
    ],
)
def test_a_wrong_answer_is_refused_by_its_name(given: dict[str, str], words: str) -> None:
    with pytest.raises(OptionError, match=words):
        answered(**given)


def test_where_nobody_can_be_asked_what_has_no_likely_answer_is_named() -> None:
    with pytest.raises(OptionError, match="needs --controller and --rapid"):
        machine_from_answers({"name": "x"})

    def ask(question: str, likely: str) -> str:
        return "nonsense?"

    with pytest.raises(LeafcutError, match="5 wrong answers"):
        machine_from_answers({"name": "x"}, ask)


def test_a_changed_profile_keeps_all_else() -> None:
    text = change_profile_values("mach3-router", {"corners.deviation": ("0.2 mm", "fitted")}, "new.toml")
    data = tomllib.loads(text)
    assert data["corners"] == {"style": "round", "deviation": "0.2 mm"}
    assert data["sources"]["corners.deviation"] == "fitted"
    assert data["rapid"]["velocity"] == ["10 m/min", "10 m/min", "4 m/min"]
    with pytest.raises(OptionError, match="deviation"):
        change_profile_values("mach3-router", {"corners.deviation": ("0 mm", "")}, "new.toml")


BOARD = """
junction_deviation_mm: 0.02
arc_tolerance_mm: 0.003
start:
  must_home: false
axes:
  x: {steps_per_mm: 80, max_rate_mm_per_min: 6000, acceleration_mm_per_sec2: 500, max_travel_mm: 300, soft_limits: true,
      homing: {cycle: 2, mpos_mm: 10, positive_direction: false}}
  y: {steps_per_mm: 81, max_rate_mm_per_min: 5400, acceleration_mm_per_sec2: 400, max_travel_mm: 200, soft_limits: true,
      homing: {cycle: 2, mpos_mm: 0}}
  z: {steps_per_mm: 400, max_rate_mm_per_min: 600, acceleration_mm_per_sec2: 50, soft_limits: true, homing: {cycle: 1}}
10V:
  speed_map: 0=0% 6000=25% 18000=100%
"""


def test_a_fluidnc_board_is_set_to_what_its_configuration_says() -> None:
    """X homes towards minus at 10, so it goes up from there; Y homes towards plus at 0, so it goes down."""
    board = parse_board_configuration(BOARD, "$CD")
    assert (board.low, board.high) == ((10, -200, LOW), (310, 0, NO))
    assert board.rates == (100, 90, 10)
    assert (board.accelerations, board.steps) == ((500, 400, 50), (80, 81, 400))
    assert (board.deviation, board.arc_tolerance, board.fastest) == (0.02, 0.003, 18000)
    assert (board.homing, board.must_home, board.soft_limits) == (True, False, True)


@pytest.mark.parametrize(
    ("old", "new", "name", "value"),
    [
        ("cycle: 1", "cycle: 0", "homing", False),
        ("homing: {cycle: 1}", "a: 1", "homing", False),
        ("must_home: false", "a: 1", "must_home", True),
        ("50, soft_limits: true", "50", "soft_limits", False),
        ("speed_map: 0=0% 6000=25% 18000=100%", "a: 1", "fastest", NO),
    ],
)
def test_one_changed_line_of_a_fluidnc_board_changes_one_value(old: str, new: str, name: str, value: object) -> None:
    assert old in BOARD
    changed = parse_board_configuration(BOARD.replace(old, new), "$CD")
    same = parse_board_configuration(BOARD, "$CD")
    differ = {key for key in vars(type(same))["__annotations__"] if getattr(changed, key) != getattr(same, key)}
    assert differ == {name}
    assert getattr(changed, name) == value
