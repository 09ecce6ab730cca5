"""The package of the page on plug-ins, installed: every kind is listed and used, and what is broken stops nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import leafcut
from leafcut import api
from leafcut.cli.app import build_app, run
from leafcut.gcode.dialects import load_dialect
from leafcut.processes import registry
from leafcut.read.machine import load_machine
from packages import Installer, shop

INSERTION = "random insertion: nodes in any order, each where the tour grows least"
KINDS = {
    "reader polar": "bolt circles: radius, angle and diameter in each line (of shop-leafcut)",
    "process spot": "spotting (of shop-leafcut)",
    "algorithm random-insertion": f"{INSERTION} (of shop-leafcut)",
    "dialect shop-fanuc": "our Fanuc 0i-MC, which has little memory (of shop-leafcut)",
    "machine shop-mill": "our mill (of shop-leafcut)",
}
#: Unusable entry points, one per group.
BROKEN = dict.fromkeys(("readers", "processes", "algorithms", "dialects", "machines"), "no_such_module:thing")
CIRCLE = "".join(f"20 {angle} 5\n" for angle in range(0, 360, 60))


@pytest.fixture(autouse=True)
def installed(install: Installer) -> None:
    """Install the page's package, and a second package whose entry points are all unusable."""
    install(*shop())
    install("torn", {f"leafcut.{group}": {"torn": names} for group, names in BROKEN.items()})


@pytest.fixture
def circle(tmp_path: Path) -> str:
    """Write a drawing of the page's own format."""
    (tmp_path / "circle.polar").write_text(CIRCLE)
    return str(tmp_path / "circle.polar")


def listed(capsys: pytest.CaptureFixture[str], kind: str) -> dict[str, str]:
    """Return the output of `leafcut list` for a kind; the text output lists the same."""
    assert run(["list", kind, "--json"]) == 0
    rows = {row["name"]: row["description"] for row in json.loads(capsys.readouterr().out)[kind]}
    assert run(["list", kind]) == 0
    words = capsys.readouterr().out
    assert all(name in words and text in words for name, text in rows.items())
    return rows


def test_all_that_packages_add_is_listed_with_what_is_broken(capsys: pytest.CaptureFixture[str]) -> None:
    rows = listed(capsys, "plugins")
    told = "plug-in of torn that cannot be used (ModuleNotFoundError: No module named 'no_such_module')"
    assert rows == KINDS | {f"{kind.split()[0]} torn": told for kind in KINDS}
    for command, name in (
        ("formats", "polar"),
        ("dialects", "shop-fanuc"),
        ("algorithms", "random-insertion"),
        ("machines", "shop-mill"),
    ):
        rows = listed(capsys, command)
        assert rows["torn"] == told, command
        assert name in rows
        assert len(rows) > 10


def test_without_packages_nothing_is_listed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    monkeypatch.setattr(sys, "path", [folder for folder in sys.path if "packages" not in folder])
    assert run(["list", "plugins"]) == 0
    assert capsys.readouterr().out == "no plug-ins installed\n"
    assert listed(capsys, "formats").keys().isdisjoint({"polar", "torn"})


def test_a_drawing_of_the_packages_format_is_drilled_on_its_machine_in_its_dialect(circle: str, tmp_path: Path) -> None:
    program = tmp_path / "a.txt"
    assert (
        run(
            ["optimize", circle, "-o", str(program), "--machine", "shop-mill", "--depth", "3", "--preset", "fast", "-q"]
        )
        == 0
    )
    text = program.read_text()
    assert "SHOP-MILL" in text.upper()
    assert "\nG17 G90\nG40 G49 G80\nG94 G54\n" in text
    assert all(f"X{x}" in text for x in ("20.", "-20.", "10.", "-10."))
    assert api.output_name(circle, machine="shop-mill") == "circle.txt"
    assert run(["simulate", str(program), "--machine", "shop-mill"]) == 0
    assert run(["verify", str(program), str(program), "--dialect", "shop-fanuc"]) == 0


def test_the_machine_and_the_dialect_are_what_the_files_say() -> None:
    mill, words = load_machine("shop-mill"), load_dialect("shop-fanuc")
    assert (mill.name, mill.family, mill.travel_max[0]) == ("shop-mill", "fanuc", 800.0)
    assert load_dialect(mill.controller).preamble == words.preamble == ("G17 G90", "G40 G49 G80", "G94 G54")
    assert (words.name, words.extension, words.point_required) == ("shop-fanuc", ".txt", True)
    assert leafcut.optimize("example:plate-10", dialect="shop-fanuc", depth=3, preset="fast").dialect == "shop-fanuc"


def test_the_algorithm_orders_the_work(circle: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The best order of six holes on a circle follows the circle; insertion always finds it in these tries."""
    given: dict[str, Any] = {"depth": 3, "objective": "distance", "preset": "fast"}
    ours = leafcut.optimize(circle, algorithm="random-insertion", **given)
    assert ours.operations[0].solution.algorithm == "random-insertion"
    assert ours.verified
    assert ours.after.travel_mm == pytest.approx(leafcut.optimize(circle, **given).after.travel_mm)
    assert "--ALGORITHM RANDOM-INSERTION" in ours.text.upper()
    assert run(["solve", "random:30", "--algorithm", "random-insertion", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["algorithm"] == "random-insertion"


def test_the_process_makes_a_program_with_its_own_option(circle: str, capsys: pytest.CaptureFixture[str]) -> None:
    outcome = leafcut.optimize(circle, process="spot", spot_depth="0.8mm", preset="fast")
    assert outcome.verified
    assert "Z-0.8" in outcome.text
    assert "Z-0.5" in leafcut.optimize(circle, process="spot", preset="fast").text
    assert (
        run(["optimize", circle, "--process", "spot", "--spot-depth", "0.8", "--preset", "fast", "-q", "--dry-run"])
        == 0
    )
    assert run(["spot", circle, "--spot-depth", "0.8", "--preset", "fast", "-q"]) == 0
    capsys.readouterr()
    assert run(["optimize", circle, "--process", "spot", "--depth", "3"]) == 2
    assert "use --spot-depth instead" in capsys.readouterr().err
    assert run(["optimize", circle, "--spot-depth", "0.8", "--dry-run"]) == 2
    assert "only to spotting" in capsys.readouterr().err
    assert run(["optimize", "--help-all"]) == 0
    told = capsys.readouterr().out
    assert "--spot-depth" in told
    assert "random-insertion" in told


@pytest.mark.parametrize(
    "flags, words",
    [
        (["--process", "torn"], "the process 'torn' is a plug-in of torn that cannot be used (ModuleNotFoundError"),
        (["--algorithm", "torn"], "the algorithm 'torn' is a plug-in of torn that cannot be used (ModuleNotFoundError"),
        (["--dialect", "torn"], "the dialect 'torn' is a plug-in of torn that cannot be used (ModuleNotFoundError"),
        (["--machine", "torn"], "the machine 'torn' is a plug-in of torn that cannot be used (ModuleNotFoundError"),
        (["--algorithm", "random"], "unknown value 'random'; did you mean 'random-insertion'?"),
        (["--machine", "shop-mil"], "unknown machine 'shop-mil'; did you mean 'shop-mill'?"),
    ],
)
def test_what_is_broken_is_told_where_it_is_asked_for(
    flags: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert run(["optimize", "example:plate-10", "--depth", "3", *flags]) == 2
    told = capsys.readouterr().err
    assert words in told
    assert told.count("\n") == 1


def test_a_broken_plug_in_does_not_disturb_other_jobs() -> None:
    assert run(["optimize", "example:plate-10", "--depth", "3", "--preset", "fast", "-q", "--dry-run"]) == 0


def test_a_plate_is_drilled_as_if_no_package_were_there(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    with_them = leafcut.optimize("example:plate-27", depth=3, preset="fast").text
    monkeypatch.setattr(sys, "path", [folder for folder in sys.path if "packages" not in folder])
    assert with_them == leafcut.optimize("example:plate-27", depth=3, preset="fast").text


def test_no_package_takes_the_name_of_a_command() -> None:
    commands = {name for name in build_app() if not name.startswith("-")}
    assert commands - set(registry.PACKAGED.names()) <= set(registry.PACKAGED.built_in())
    assert {"spot", "drill", "list", "machine"} <= commands


def test_a_shipped_dialect_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["list", "dialects", "haas"]) == 0
    text = capsys.readouterr().out
    assert 'base = "haas"\n' in text
    assert run(["list", "dialects", "haas", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"schema": 1, "name": "haas", "dialect": text}
    assert run(["list", "dialects", "hass"]) == 2
    assert "leafcut has no built-in dialect 'hass'; did you mean 'haas'?" in capsys.readouterr().err
