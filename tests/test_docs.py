"""Examples in the documents run, and print the figures that the pages show."""

from __future__ import annotations

import re
import runpy
import shlex
import shutil
from pathlib import Path

import pytest

from leafcut.cli.app import run

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_python_example_of_the_readme_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code = re.search(r"^    import leafcut\n(?:\n|    .*\n)+", README, flags=re.MULTILINE)
    assert code
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    exec(re.sub("^    ", "", code.group(0), flags=re.MULTILINE), {})
    assert re.fullmatch(r"\d+ s became \d+ s, verified: True\n", capsys.readouterr().out)
    assert (tmp_path / "plate.nc").read_text().startswith("%")


def test_the_figures_of_the_readme_are_those_of_the_plate() -> None:
    import leafcut

    outcome = leafcut.optimize("example:plate-70", thickness="0.25in")
    assert f"{outcome.before.travel_mm / 1000:.2f} m of rapids" in README
    assert f"by leafcut: {outcome.after.travel_mm / 1000:.2f} m" in README


@pytest.mark.slow
def test_the_commands_of_the_page_on_sheets_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every program is verified and written."""
    commands = commands_of("sheets.md")
    assert len(commands) >= 6
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    for command in commands:
        words = shlex.split(command)
        output = Path(words[words.index("-o") + 1])
        output.unlink(missing_ok=True)
        assert run([*words, "--preset", "fast"]) == 0, command
        assert output.read_text().count("M3") >= 3


def test_the_commands_of_the_page_on_machines_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each runs on files with the names of the page; the times are those of half the accelerations, which the fit
    finds.
    """
    import leafcut
    from leafcut.read.machine import load_machine
    from leafcut.read.tools import load_tools

    page = (ROOT / "docs" / "machines.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    shutil.copy(ROOT / "tests" / "read" / "settings" / "grbl_3018.txt", "settings.txt")
    Path("shop.csv").write_text("number,kind,diameter\n1,drill,1/4in\n")
    for name, width in (("a.nc", 150.0), ("b.nc", 20.0), ("c.nc", 3.0)):
        hops = "".join(f"G0 X{k % 2 * width} Y{k}.0\nG4 P0.1\n" for k in range(90))
        Path(name).write_text(f"G21 G90\nG0 Z5.0\n{hops}M2\n")
    imported, asked, new, check, tools = commands_of("machines.md")
    assert asked.startswith("machine import --port ")  # it needs a board: tests/sender/test_send_board.py
    for command in (imported, new, tools):
        assert run(shlex.split(command)) == 0, command
    assert load_machine("my.toml").controller == "grbl" and load_machine("vf2.toml").name == "VF-2"
    assert load_tools("shop.toml").tools == load_tools("shop.csv").tools
    halved = re.sub(
        r"^acceleration = .*$", 'acceleration = "15 mm/s2"', Path("my.toml").read_text(), flags=re.MULTILINE
    )
    Path("slow.toml").write_text(halved)
    for time in ("12:34", "8:05", "754s"):
        name = f"{'abc'[('12:34', '8:05', '754s').index(time)]}.nc"
        check = check.replace(time, f"{leafcut.simulate(name, machine='slow.toml').measure.time_s:.2f}s")
    assert run(shlex.split(check)) == 0
    assert load_machine("fitted.toml").acceleration[:2] == pytest.approx((15, 15), rel=0.01)
    Path("four.toml").write_text(
        "\n".join(re.findall(r"^    ((?:name|controller|rapid\.\w+) = .+)$", page, re.MULTILINE))
    )
    assert load_machine("four.toml").rapid_velocity == (50.0, 50.0, 50.0)


@pytest.mark.slow
def test_the_commands_of_the_page_on_nesting_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nest, cut, *more = commands_of("nesting.md")
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    assert run([*shlex.split(nest), "--preset", "fast", "-q"]) == 0
    assert run([*shlex.split(cut), "--preset", "fast", "-q"]) == 0
    # A bracket has two holes and a gusset has one; each contour is pierced once.
    assert Path("nested.ngc").read_text().count("M3 $0") == 10 * 3 + 4 * 2
    assert [run([*shlex.split(command), "--preset", "fast", "-q"]) for command in more] == [0] * len(more)


@pytest.mark.slow
def test_the_commands_of_the_page_on_quotes_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    commands = commands_of("quotes.md")
    assert len(commands) == 2
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    for command in commands:
        Path("quote.html").unlink(missing_ok=True)
        assert run([*shlex.split(command), "--preset", "fast", "-q"]) == 0, command
        assert "Example Metalwork" in Path("quote.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_sheet_that_the_readme_cuts_is_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (command,) = re.findall(r"leafcut (cut examples/sheet\.dxf .+)$", README, flags=re.MULTILINE)
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    assert run([*shlex.split(command), "--preset", "fast", "-q"]) == 0
    assert (tmp_path / "sheet.ngc").read_text().count("M3 $0") == 31
    assert (tmp_path / "sheet.html").stat().st_size > 10_000


@pytest.mark.slow
def test_the_commands_of_the_page_on_pockets_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With one strategy, as the others have tests of their own; every program is verified and written."""
    from leafcut.processes.pocket import clearing
    from leafcut.processes.pocket.strategies import STRATEGIES

    few = tuple(way for way in STRATEGIES if way.name == "contour")
    monkeypatch.setattr(clearing, "STRATEGIES", few)
    text = (ROOT / "docs" / "pockets.md").read_text(encoding="utf-8")
    commands = re.findall(r"^    leafcut (pocket examples/pocket\..+)$", text, flags=re.MULTILINE)
    assert len(commands) >= 5
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    for command in commands:
        words = shlex.split(command)
        output = Path(words[words.index("-o") + 1])
        output.unlink(missing_ok=True)
        assert run(words) == 0, command
        assert "G1" in output.read_text()


def test_the_commands_of_the_page_on_speeds_print_the_table_that_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    choose, drill = commands_of("cutting_data.md")[:2]
    text = (ROOT / "docs" / "cutting_data.md").read_text(encoding="utf-8")
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    assert run(shlex.split(choose)) == 0
    table = re.search(r"^ +quickest .*\n(?:.+\n){11}", capsys.readouterr().out, flags=re.MULTILINE)
    assert table
    shown = "".join(f"    {line}\n" for line in table[0].splitlines())
    assert shown in text
    assert Path("front.svg").read_text(encoding="utf-8") == (ROOT / "docs" / "pictures" / "front.svg").read_text(
        "utf-8"
    )
    assert run([*shlex.split(drill), "-q"]) == 0
    assert "S1450 M3" in Path("plate.nc").read_text()


def commands_of(page: str) -> list[str]:
    """Return the commands that a page shows, without the first word."""
    return re.findall(r"^    leafcut (.+)$", (ROOT / "docs" / page).read_text(encoding="utf-8"), flags=re.MULTILINE)


#: Scripts among the examples, without the script of the plates: tests/read/test_read_examples.py runs it.
SCRIPTS = [
    pytest.param(name, marks=pytest.mark.slow if name in ("compare_algorithms.py", "make_stepped_plate.py") else ())
    for name in sorted(p.name for p in (ROOT / "examples").glob("*.py"))
    if name != "make_plates.py"
]


@pytest.mark.parametrize("script", SCRIPTS)
def test_an_example_script_runs_and_draws_the_shipped_files(script: str, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    runpy.run_path(str(tmp_path / "examples" / script), run_name="__main__")
    for drawn in (ROOT / "examples").iterdir():
        if drawn.suffix in (".dxf", ".svg", ".nc"):
            assert (tmp_path / "examples" / drawn.name).read_bytes() == drawn.read_bytes(), drawn.name


def test_every_picture_of_the_docs_is_on_a_page() -> None:
    pages = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    assert [file.name for file in (ROOT / "docs" / "pictures").iterdir() if f"pictures/{file.name}" not in text] == []
