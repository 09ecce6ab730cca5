"""A file in place of a command is optimized, and its program is written next to it."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut._version import __version__
from leafcut.cli.app import run
from leafcut.files.digests import fill_in_digest, is_unchanged
from leafcut.processes import registry
from leafcut.processes.settings import collect_settings
from leafcut.read.registry import read_source_with_format

EXAMPLES = Path(__file__).parents[1] / "examples"
FAST = ("--preset", "fast", "--threads", "1", "-q")


@pytest.fixture
def shop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder below the working folder with a drawing and a program."""
    (tmp_path / "jobs").mkdir()
    shutil.copy(EXAMPLES / "plate_8x8_10.dxf", tmp_path / "jobs" / "plate.dxf")
    shutil.copy(EXAMPLES / "cam_121.nc", tmp_path / "jobs" / "part.nc")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "jobs"


def names(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_a_file_without_a_command_is_optimized_and_its_program_stands_beside_it(shop: Path) -> None:
    assert run(["jobs/plate.dxf", "--thickness", "6", "--machine", "haas-vf2", *FAST]) == 0
    text = (shop / "plate.nc").read_text()
    assert text == leafcut.optimize("jobs/plate.dxf", thickness=6, machine="haas-vf2", preset="fast").text
    assert names(shop) == ["part.nc", "plate.dxf", "plate.nc"]


def test_the_program_of_a_program_has_leafcut_in_its_name(shop: Path) -> None:
    before = (shop / "part.nc").read_bytes()
    assert run(["reorder", "jobs/part.nc", *FAST]) == 0
    assert names(shop) == ["part.leafcut.nc", "part.nc", "plate.dxf"]
    assert (shop / "part.nc").read_bytes() == before


@pytest.mark.parametrize(
    "name, options, command",
    [
        ("sheet.dxf", {}, "cut"),  # layers CUT and SHEET
        ("sheet.dxf", {"layers": "CUT"}, "auto"),
        ("sheet.dxf", {"machine": "haas-vf2", "cycle": "G81"}, "auto"),
        ("bracket.dxf", {"machine": "plasma-table"}, "cut"),
        ("bracket.dxf", {"kerf": 1.0}, "cut"),
        ("pocket.dxf", {}, "pocket"),  # layers POCKET and ISLAND
        ("plate_10.dxf", {"tool_diameter": 6.0}, "pocket"),
        ("plate_10.dxf", {"thickness": 6.0}, "auto"),
        ("gusset.svg", {"machine": "grbl-3018"}, "pocket"),
        ("gusset.svg", {"machine": "grbl-3018", "tool_diameter": 3.0}, "part"),  # an outline with an opening
        ("gusset.svg", {"machine": "grbl-3018", "depth": 2.0, "tool_diameter": 3.0}, "pocket"),
        ("bracket.dxf", {"machine": "shapeoko-router", "thickness": 3.0}, "auto"),
        ("bracket.dxf", {"machine": "shapeoko-router", "thickness": 3.0, "tool_diameter": 3.0}, "part"),
        ("bracket.dxf", {"machine": "shapeoko-router", "depth": 3.0}, "auto"),
        ("bracket.dxf", {"thickness": 3.0}, "auto"),  # nobody named a mill
        ("bracket.dxf", {"thickness": 3.0, "tool_diameter": 3.0}, "pocket"),
        ("bracket.dxf", {"tabs": 2}, "part"),
        ("plate_10.dxf", {"machine": "shapeoko-router", "thickness": 6.0}, "auto"),  # mostly holes
        ("pocket.dxf", {"machine": "shapeoko-router", "tool_diameter": 3.0}, "pocket"),
        ("sheet.dxf", {"machine": "shapeoko-router", "tool_diameter": 3.0}, "part"),
        ("stepped_plate.step", {"machine": "shapeoko-router", "tool_diameter": 3.0}, "pocket"),
        ("cam_121.nc", {"machine": "plasma-table"}, "auto"),
    ],
)
def test_machine_options_and_layers_decide_what_a_file_is_for(name: str, options: dict[str, Any], command: str) -> None:
    assert registry.guess_command([read_source_with_format(EXAMPLES / name)], collect_settings(options)) == command


def test_a_guessed_work_has_its_usual_machine(shop: Path) -> None:
    """The program equals that of the command by name."""
    shutil.copy(EXAMPLES / "bracket.dxf", "b.dxf")
    blocks = []
    for words in (["b.dxf"], ["cut", "b.dxf"]):
        assert run([*words, "--thickness", "6", "--kerf", "1.5", *FAST, "--no-header", "-o", "out.ngc"]) == 0
        blocks.append(Path("out.ngc").read_text())
        Path("out.ngc").unlink()
    assert blocks[0] == blocks[1]


def test_a_drawing_without_a_usual_work_is_refused_with_the_commands(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(EXAMPLES / "gusset.svg", "g.svg")
    assert run(["g.svg", "--thickness", "3"]) == 2
    assert capsys.readouterr().err == (
        "leafcut: g.svg: several kinds of work are possible; use leafcut cut g.svg, leafcut pocket g.svg or "
        "leafcut part g.svg\n"
    )
    assert run(["g.svg", "--thickness", "3", "--machine", "laser-table", *FAST]) == 0


def test_a_wrong_input_is_named_before_an_existing_output(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (shop / "plate.ngc").write_text("M30\n")
    assert run(["reorder", "jobs/plate.dxf", *FAST]) == 2
    assert "the input is a drawing, not a program" in capsys.readouterr().err


FOREIGN = (
    "leafcut: {}: the file exists and its header does not show an unchanged file of leafcut; name another file with "
    "-o, or move this one away\n"
)


@pytest.mark.parametrize(
    "command, name, example",
    [("drill", "kept.dxf", "bracket.dxf"), ("drill", "kept.nc", "cam_121.nc"), ("nest", "kept.dxf", "bracket.dxf")],
)
def test_a_named_file_that_leafcut_did_not_write_is_not_replaced(
    shop: Path, command: str, name: str, example: str, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(EXAMPLES / example, name)
    words = ["jobs/plate.dxf", "--thickness", "6", *FAST] if command == "drill" else ["jobs/plate.dxf:1", *NEST]
    assert run([command, *words, "-o", name]) == 1
    assert capsys.readouterr().err == FOREIGN.format(name)
    assert Path(name).read_bytes() == (EXAMPLES / example).read_bytes()


def test_a_named_own_program_is_replaced_even_by_another_command(shop: Path) -> None:
    """Scripts repeat the same command, or remove the file first."""
    assert run(["drill", "jobs/plate.dxf", "--thickness", "6", *FAST, "-o", "out.nc"]) == 0
    assert run(["drill", "jobs/plate.dxf", "--thickness", "8", *FAST, "-o", "out.nc"]) == 0
    assert "--thickness 8mm" in Path("out.nc").read_text()
    assert run(["reorder", "jobs/part.nc", *FAST, "-o", "out.nc"]) == 0
    assert is_unchanged(Path("out.nc").read_text())
    Path("out.nc").write_text("M30\n")
    assert run(["reorder", "jobs/part.nc", *FAST, "-o", "out.nc"]) == 1
    Path("out.nc").unlink()
    assert run(["reorder", "jobs/part.nc", *FAST, "-o", "out.nc"]) == 0


def test_a_changed_program_in_a_folder_of_programs_is_not_replaced(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("out").mkdir()
    words = ["drill", "jobs/plate.dx?", "--thickness", "6", *FAST, "-o", "out"]
    assert run(words) == 0
    program = Path("out/plate.ngc")
    edited = program.read_text() + "(checked)\n"
    program.write_text(edited)
    capsys.readouterr()
    assert run(words) == 1
    assert capsys.readouterr().err == FOREIGN.format("out/plate.ngc")
    assert program.read_text() == edited


def test_inputs_of_one_name_in_two_folders_have_their_programs_beside_them(shop: Path) -> None:
    for folder in ("a", "b"):
        Path(folder).mkdir()
        shutil.copy(EXAMPLES / "plate_8x8_10.dxf", f"{folder}/plate.dxf")
    assert run(["drill", "a/plate.dxf", "b/plate.dxf", "--thickness", "6", *FAST]) == 0
    assert names(Path("a")) == names(Path("b")) == ["plate.dxf", "plate.ngc"]


def test_a_built_in_input_is_written_into_the_working_folder(shop: Path) -> None:
    assert run(["example:plate-8x8-10", "--thickness", "6", *FAST]) == 0
    assert names(Path()) == ["jobs", "plate-8x8-10.ngc"]


def test_an_own_program_is_replaced_and_an_edited_one_is_not(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["jobs/plate.dxf", *FAST, "--thickness"]
    replaced = "jobs/plate.ngc: replaced leafcut's earlier program; name another file with -o to keep both"
    for thickness, said in (("6", False), ("6", False), ("8", True)):
        assert run([*words, thickness]) == 0
        assert (replaced in capsys.readouterr().err) is said
    program = shop / "plate.ngc"
    assert "--thickness 8mm" in program.read_text() and is_unchanged(program.read_text())
    edited = program.read_text().replace("G21", "G21 (checked)", 1)
    program.write_text(edited)
    assert run([*words, "6"]) == 1
    assert capsys.readouterr().err == FOREIGN.format("jobs/plate.ngc")
    assert run([*words, "6", "-o", "jobs/plate.ngc"]) == 1
    assert program.read_text() == edited
    program.unlink()
    assert run([*words, "6"]) == 0
    assert is_unchanged(program.read_text())


def test_the_program_of_another_command_is_not_replaced(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(EXAMPLES / "pocket.dxf", shop / "pocket.dxf")
    drilled = ["drill", "jobs/pocket.dxf", "--depth", "3", *FAST]
    milled = ["pocket", "jobs/pocket.dxf", "--depth", "3", "--tool-diameter", "6", *FAST]
    assert run(drilled) == 3 and run(drilled) == 3  # its slot is missing
    program = (shop / "pocket.ngc").read_bytes()
    capsys.readouterr()
    assert run(milled) == 1
    assert (
        "jobs/pocket.ngc: the file exists and was written by `leafcut drill`; name another file with -o to keep both"
        in (capsys.readouterr().err)
    )
    assert (shop / "pocket.ngc").read_bytes() == program
    text = fill_in_digest(program.decode().replace(f"{__version__} drill", f"{__version__} pocket"))
    (shop / "pocket.ngc").write_text(text)
    assert run(drilled) == 1
    assert "written by `leafcut pocket`" in capsys.readouterr().err
    assert (shop / "pocket.ngc").read_text() == text


def test_two_inputs_of_one_name_and_a_folder_as_output_are_refused(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (shop / "plate.csv").write_text("x,y,diameter\n1,2,3\n4,5,3\n")
    assert run(["jobs/plate.dxf", "jobs/plate.csv", "--thickness", "6", *FAST]) == 2
    assert "would both be written as jobs/plate.ngc" in capsys.readouterr().err
    assert run(["jobs/plate.dxf", "--thickness", "6", "-o", "jobs", *FAST]) == 1
    assert "jobs: is a folder" in capsys.readouterr().err
    assert names(shop) == ["part.nc", "plate.csv", "plate.dxf"]


def test_a_folder_is_done_again_without_its_own_programs(shop: Path) -> None:
    (shop / "part.nc").unlink()
    for _ in range(2):
        assert run(["drill", "jobs", "--thickness", "6", *FAST]) == 0
    assert names(shop) == ["plate.dxf", "plate.ngc"]


def test_a_dry_run_writes_nothing(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["jobs/plate.dxf", "--thickness", "6", "--dry-run", *FAST]) == 0
    assert run(["jobs/plate.dxf", "--thickness", "6", "--dry-run", "-o", "x.nc"]) == 2
    assert "--dry-run writes no program; leave -o out" in capsys.readouterr().err
    assert names(shop) == ["part.nc", "plate.dxf"]


NEST = ("--sheet", "500x300", "--nester", "rectangles", "-q")


def test_nested_sheets_stand_beside_the_first_part_and_a_changed_one_is_not_replaced(
    shop: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(EXAMPLES / "bracket.dxf", shop / "bracket.dxf")
    before = names(shop)
    assert run(["nest", "jobs/bracket.dxf:3", *NEST, "--dry-run"]) == 0
    assert names(shop) == before
    assert run(["nest", "jobs/bracket.dxf:4", *NEST]) == 0  # 3 on the first sheet
    sheets = [name for name in names(shop) if name not in before]
    assert sheets == ["bracket.leafcut_1.dxf", "bracket.leafcut_2.dxf"]
    assert all(is_unchanged((shop / name).read_text()) for name in sheets)
    assert run(["nest", "jobs/bracket.dxf:4", *NEST]) == 0
    edited = (shop / sheets[1]).read_text().replace("CUT_HOLES", "HOLES")
    (shop / sheets[1]).write_text(edited)
    assert run(["nest", "jobs/bracket.dxf:4", *NEST]) == 1
    assert capsys.readouterr().err == FOREIGN.format(f"jobs/{sheets[1]}")
    assert (shop / sheets[1]).read_text() == edited


def test_a_changed_remnant_is_not_replaced(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(EXAMPLES / "bracket.dxf", "bracket.dxf")
    words = ["nest", "bracket.dxf:1", *NEST, "-o", "nested.dxf", "--remnants-out", "jobs"]
    assert run(words) == run(words) == 0
    remnant = next(shop.glob("nested_rest*.dxf"))
    remnant.write_text(remnant.read_text().replace("SHEET", "PLATE"))
    capsys.readouterr()
    assert run(words) == 1
    assert capsys.readouterr().err == FOREIGN.format(f"jobs/{remnant.name}")


def test_a_nest_of_a_parts_list_has_the_name_of_the_list(shop: Path) -> None:
    shutil.copy(EXAMPLES / "bracket.dxf", shop / "bracket.dxf")
    (shop / "order.csv").write_text("bracket.dxf,2\n")
    assert run(["nest", "jobs/order.csv", *NEST]) == 0
    assert "order.dxf" in names(shop)


def test_a_nest_of_a_missing_part_names_the_part(shop: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copy(EXAMPLES / "bracket.dxf", shop / "bracket.dxf")
    assert run(["nest", "jobs/bracket.dxf*20", *NEST]) == 1
    assert capsys.readouterr().err == "leafcut: jobs/bracket.dxf*20: file not found\n"
