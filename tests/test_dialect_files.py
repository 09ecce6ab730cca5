"""A dialect in a file behaves like a shipped dialect."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import leafcut
from leafcut import api
from leafcut.cli.app import run
from leafcut.errors import OptionError, VerifyError
from leafcut.files.whole_files import OutputError
from leafcut.gcode.dialects import dialect_names, load_dialect
from leafcut.read.machine import load_machine, machine_template, shipped_machines
from own_machines import blind_table

PLATE = "example:plate-10"
FAST = {"preset": "fast", "seed": 3}
DRILLED = {**FAST, "depth": 3}


@pytest.fixture
def ours(tmp_path: Path) -> Path:
    """Return the file of a dialect that only names its base."""
    file = tmp_path / "shop" / "ours.toml"
    file.parent.mkdir()
    file.write_text('base = "haas"\n')
    return file


def machine_of(folder: Path, controller: str, shipped: str = "haas-vf2") -> Path:
    """Write a shipped machine's profile with another controller."""
    text = machine_template(shipped).replace(f'"{load_machine(shipped).controller}"', f'"{controller}"', 1)
    (folder / "mine.toml").write_text(text)
    return folder / "mine.toml"


@pytest.mark.parametrize("name", dialect_names(torch=False))
def test_a_file_that_changes_nothing_writes_the_bytes_of_its_base(name: str, tmp_path: Path) -> None:
    file = tmp_path / "same.toml"
    file.write_text(f'base = "{name}"\n')
    shipped, same = (leafcut.optimize(PLATE, dialect=word, header=False, **DRILLED) for word in (name, str(file)))
    assert same.text == shipped.text
    assert same.after == shipped.after
    assert (same.dialect, same.verified) == ("same.toml", True)


def test_the_header_tells_the_name_of_the_file_alone(ours: Path) -> None:
    text = leafcut.optimize(PLATE, dialect=str(ours), **DRILLED).text
    assert "--DIALECT OURS.TOML" in text.upper()
    assert str(ours.parent).upper() not in text.upper()


def test_what_the_file_changes_is_what_is_written_and_how_programs_are_named(ours: Path, tmp_path: Path) -> None:
    ours.write_text(
        'base = "haas"\nextension = ".eia"\ndecimals_mm = 4\ncycles = []\npreamble = ["G17 G90 G40 G49 G80 G94 G54"]\n'
    )
    outcome = leafcut.optimize(PLATE, dialect=str(ours), **DRILLED)
    assert outcome.verified
    assert "G81" not in outcome.text
    assert "\nG17 G90 G40 G49 G80 G94 G54\n" in outcome.text
    assert api.output_name(PLATE, dialect=str(ours)) == "plate-10.eia"
    assert outcome.extension == ".eia"
    words = ["optimize", PLATE, "--dialect", str(ours), "-o", str(tmp_path / "a.eia")]
    assert run([*words, "--depth", "3", "--preset", "fast", "-q"]) == 0


def test_a_file_with_which_no_safe_program_can_be_written_writes_none(ours: Path, tmp_path: Path) -> None:
    """Without G94 a feed could be one per turn, left over from the program before."""
    ours.write_text('base = "haas"\npreamble = ["G17 G90 G40 G49 G80 G54"]\n')
    with pytest.raises(VerifyError, match="the program was not written: feed: planned"):
        leafcut.optimize(PLATE, tmp_path / "a.nc", dialect=str(ours), **DRILLED)
    assert not (tmp_path / "a.nc").exists()


def test_a_machine_names_a_file_beside_its_profile_wherever_it_is_run_from(
    ours: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    profile = machine_of(ours.parent, "ours.toml")
    monkeypatch.chdir(tmp_path)
    outcome = leafcut.optimize(PLATE, machine=f"shop/{profile.name}", header=False, **DRILLED)
    assert outcome.text == leafcut.optimize(PLATE, machine="haas-vf2", header=False, **DRILLED).text
    assert api.output_name(PLATE, machine=str(profile)) == "plate-10.nc"
    assert outcome.extension == ".nc"
    assert api.dialect_of({"machine": f"shop/{profile.name}"}) == str(Path("shop") / "ours.toml")


#: Those that take such a program; the others have a language of their own.
G_CODE = [name for name in shipped_machines() if load_dialect(load_machine(name).controller).language == "g-code"]


@pytest.mark.parametrize("shipped", G_CODE)
def test_a_machine_is_timed_as_the_controller_that_its_dialect_is_based_on(shipped: str, tmp_path: Path) -> None:
    """A program with sharp corners, arcs and changes of power, whose costs differ between controllers."""
    (tmp_path / "ours.toml").write_text(f'base = "{load_machine(shipped).controller}"\n')
    profile = machine_of(tmp_path, "ours.toml", shipped)
    program = tmp_path / "a.nc"
    body = "".join(f"X{k}. Y{k % 2}. S{100 + k}\nG2 X{k + 1}. Y{k % 2}. I0.5 J0.\nG1\n" for k in range(0, 40, 2))
    program.write_text(f"%\nG21 G90 G94\nM3 S100\nG0 X0. Y0.\nG1 F3000.\n{body}M5\nM30\n%\n")
    as_shipped, as_ours = (api.simulate(program, machine=name) for name in (shipped, str(profile)))
    assert as_ours.measure == as_shipped.measure
    assert as_ours.issues == as_shipped.issues


@pytest.mark.parametrize("controller", ["../ours.toml", "/ours.toml", "a/../../ours.toml"])
def test_a_profile_names_no_file_elsewhere(controller: str, ours: Path) -> None:
    inner = ours.parent / "inner"
    inner.mkdir(exist_ok=True)
    with pytest.raises(
        OptionError, match=r"'controller' names .*, but a dialect file must be in the folder of the profile"
    ):
        load_machine(str(machine_of(inner, controller)))


def test_a_wrong_dialect_of_a_profile_is_told_by_its_own_file_and_line(ours: Path) -> None:
    profile = machine_of(ours.parent, "ours.toml")
    ours.write_text('base = "haas"\n\nmax_line = "long"\n')
    with pytest.raises(OptionError, match=r"ours\.toml:3: 'max_line' is long, but must be a whole number"):
        load_machine(str(profile))
    ours.unlink()
    with pytest.raises(OptionError, match=r"names 'ours\.toml', which does not exist in the folder of the profile"):
        load_machine(str(profile))


def test_a_program_is_simulated_and_verified_by_a_file(ours: Path, examples: Path) -> None:
    ours.write_text('base = "linuxcnc"\n')
    program = str(examples / "cam_121.nc")
    by_file, shipped = (api.simulate(program, dialect=word) for word in (str(ours), "linuxcnc"))
    assert (by_file.dialect, by_file.measure, by_file.issues) == ("ours.toml", shipped.measure, shipped.issues)
    assert api.verify(program, program, dialect=str(ours)).same
    assert run(["simulate", program, "--dialect", str(ours), "--json"]) == 0
    assert run(["verify", program, program, "--dialect", str(ours)]) == 0


def test_a_dialect_file_reads_a_reordered_program(ours: Path) -> None:
    ours.write_text('base = "linuxcnc"\n')
    program = Path(__file__).parent / "styles" / "cambam_drill.nc"
    outcome = leafcut.optimize(program, dialect=str(ours), **FAST)
    shipped = leafcut.optimize(program, dialect="linuxcnc", **FAST)
    assert outcome.verified
    assert outcome.text.replace("ours.toml", "linuxcnc") == shipped.text


def test_a_dialect_file_writes_a_cutting_program(ours: Path, examples: Path) -> None:
    ours.write_text('base = "plasma"\n[torch]\nprobe = ""\n')
    given = {"process": "cut", "thickness": "6mm", "header": False, **FAST}
    outcome = leafcut.optimize(examples / "gusset.svg", dialect=str(ours), **given)
    shipped = leafcut.optimize(
        examples / "gusset.svg", dialect="plasma", machine=str(blind_table(ours.parent)), **given
    )
    assert outcome.text == shipped.text


def test_neither_a_dialect_nor_the_one_that_a_machine_names_is_overwritten(ours: Path) -> None:
    profile = machine_of(ours.parent, "ours.toml")
    for options in ({"dialect": str(ours)}, {"machine": str(profile)}):
        with pytest.raises(OutputError, match="never overwritten"):
            leafcut.optimize(PLATE, ours, **options, **DRILLED)
    assert ours.read_text() == 'base = "haas"\n'


def test_defaults_name_a_dialect_from_where_they_lie(ours: Path, tmp_path: Path) -> None:
    defaults = ours.parent / "defaults.toml"
    defaults.write_text('dialect = "ours.toml"\n')
    outcome = leafcut.optimize(PLATE, defaults_file=defaults, **DRILLED)
    assert outcome.dialect == "ours.toml"
    assert outcome.defaults == ("--dialect ours.toml",)


def test_a_file_may_change_between_two_runs(ours: Path) -> None:
    assert load_dialect(str(ours)).max_line == 80
    shutil.copy(ours, ours.with_name("before.toml"))
    ours.write_text('base = "haas"\nmax_line = 60\n')
    assert load_dialect(str(ours)).max_line == 60
