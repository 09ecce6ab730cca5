"""A given option is obeyed or refused: the declared options of each kind of work are those that its runs read."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import ezdxf
import pytest
from PIL import Image, ImageDraw

from leafcut import api
from leafcut.errors import OptionError
from leafcut.options import FireflyOptions, PostOptions, SolveOptions
from leafcut.options.option_spec import OptionGroup, flag_name, typed_text
from leafcut.processes import registry
from leafcut.processes.settings import all_options, collect_settings, options_used_by, settings_for
from meshes import binary_stl, box_triangles
from own_machines import machine_of_power

TOOLS = """
[[tool]]
number = 1
diameter = "3 mm"
kind = "drill"
feed = "100 mm/min"
spindle_speed = "2000 rpm"
[[tool]]
number = 2
diameter = "8 mm"
kind = "end-mill"
feed = "300 mm/min"
plunge_feed = "100 mm/min"
spindle_speed = "6000 rpm"
"""
#: Properties that stand for an option.
_STANDS_FOR = {
    "sheets": "sheet", "angles": "rotations", "n_offered": "variants", "n_written": "variants", "blind_depth": "depth",
    "is_through": "depth",
}  # fmt: skip
#: What only hands options on, or looks whether their files are in each other's way.
_HANDS_ON = (
    "leafcut.options.option_spec",
    "dataclasses",
    "leafcut.options.",
    "leafcut.processes.settings",
    __name__,
)
WORKS = {work.name: work for work in registry.works()}
FAST: dict[str, Any] = {"preset": "fast", "threads": 1}
LITTLE = {**FAST, "iterations": 1}
#: Files of the examples.
EXAMPLES = Path(__file__).parents[1] / "examples"
APART: dict[str, Any] = {"algorithm": "acs", "parallel": "exchange", "n_processes": 1}
QUOTED: dict[str, Any] = {
    "material": "mild_steel", "shop_rate": 60, "setup_cost": 1, "markup": 2, "currency": "EUR", "valid_days": 3,
    "seller": "A", "terms": "B",
}  # fmt: skip


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return tiny inputs of every kind."""
    folder = tmp_path_factory.mktemp("inputs")
    sheet = ezdxf.new(units=4)
    space = sheet.modelspace()
    for x in range(0, 360, 60):
        space.add_lwpolyline([(x, 0), (x + 40, 0), (x + 40, 40), (x, 40)], close=True)
        space.add_circle((x + 20, 20), 8)
    space.add_line((-20, 0), (-20, 30))
    space.add_lwpolyline([(5, 5), (10, 5)], dxfattribs={"layer": "MARK"})
    sheet.saveas(folder / "sheet.dxf")
    pocket = ezdxf.new(units=4)
    pocket.modelspace().add_lwpolyline([(0, 0), (40, 0), (40, 32), (0, 32)], close=True)
    pocket.modelspace().add_line((-20, 0), (-20, 30))
    pocket.saveas(folder / "pocket.dxf")
    picture = Image.new("L", (40, 36), 255)
    ImageDraw.Draw(picture).rectangle((6, 6, 33, 29), fill=0)
    picture.save(folder / "pocket.png")
    holes = [(7.0 * (k * 5 % 11), 9.0 * (k * 4 % 13)) for k in range(16)]
    (folder / "holes.csv").write_text("x,y,diameter\n" + "".join(f"{x},{y},3\n" for x, y in holes))
    (folder / "sizes.csv").write_text("x,y,diameter\n5,5,3\n20,5,3\n5,20,4\n")
    (folder / "tools.toml").write_text(TOOLS)
    (folder / "block.stl").write_bytes(binary_stl(box_triangles(-9, -9, -6, 99, 129, 0)))
    (folder / "clamp.stl").write_bytes(binary_stl(box_triangles(100, 0, -6, 110, 9, 9)))
    cuts = "G81 X90. Y90. Z-2. R2. F100\n" + "".join(f"X{x} Y{y}\n" for x, y in holes) + "G80\n"
    (folder / "cam.nc").write_text(f"G21 G90 G17 G94\nT1 M6\nS1000 M3\nG0 Z5\n{cuts}M5\nM30\n")
    torch = (
        "(o=0, kw=1, ph=3, pd=0.1, ch=1, fr=1000, ca=45, cv=90, pe=0, gp=0, cm=0, jh=0, jd=0)\nM3 $0 S1\nG1 X5\nM5 $0\n"
    )
    (folder / "plasma.ngc").write_text(f"G21 G90\nF#<_hal[plasmac.cut-feed-rate]>\nG0 X0 Y0\n{torch}M2\n")
    return {file.name: file for file in folder.iterdir()}


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> Iterator[set[str]]:
    """Return the names of the options read from now on, except by code that only passes them on."""
    found: set[str] = set()

    def read(self: OptionGroup, name: str) -> Any:
        asked = _STANDS_FOR.get(name, name)
        if asked in type(self).__dataclass_fields__:  # type: ignore[attr-defined]
            module = sys._getframe(1).f_globals.get("__name__", "")
            if not module.startswith(_HANDS_ON) and not module.endswith(".options"):
                found.add(asked)
        return object.__getattribute__(self, name)

    monkeypatch.setattr(OptionGroup, "__getattribute__", read, raising=False)
    return found


def _runs(work: str, files: dict[str, Path], out: Path) -> None:
    """Do small runs of a kind of work in which each of its options matters once."""
    at = {name: str(path) for name, path in files.items()}
    if work == "drill":
        api.optimize(at["holes.csv"], depth=3, cycle=None, **FAST)
        api.optimize(at["sizes.csv"], depth=3, **FAST)
        api.optimize(at["holes.csv"], thickness=3, tools=at["tools.toml"], **APART, **LITTLE)
        api.optimize(at["holes.csv"], depth=3, machine="haas-vf2", algorithm="firefly", **LITTLE)
        (out / "fusion.csv").write_text("T,D [mm],kind,feed [mm/min],rpm,preset\n1,3,drill,100,2000,Steel\n")
        api.optimize(at["holes.csv"], depth=3, tools=out / "fusion.csv", material="steel", **FAST)
        surface = {"surface": at["block.stl"], "depth": "through", "keep_out": "200 200 210 210 9"}
        surface["fixture"] = at["clamp.stl"]
        api.optimize(at["holes.csv"], **surface, **LITTLE)
    elif work == "cut":
        common = {"process": "cut", "thickness": 6, "open_paths": "cut", **LITTLE}
        more = {"micro_joints": 1, "heat_distance": 5, "sweep": "x", "concentric": "all"}
        api.optimize(at["sheet.dxf"], machine="laser-table", **more, **common)
        api.optimize(at["sheet.dxf"], machine="laser-table", chains=True, **APART, **common)
        common |= {"quote": out / "quote.html", "cutting_rate": 9, "stock_price": 5, **QUOTED}
        api.optimize(at["sheet.dxf"], ignore_layers="MARK", corner_loops=True, algorithm="firefly", **common)
    elif work == "pocket":
        common = {"process": "pocket", "depth": 1, "tool_diameter": 8, **LITTLE}
        api.optimize(
            at["pocket.dxf"],
            tools=at["tools.toml"],
            thickness=5,
            open_paths="drop",
            outline="pocket",
            **APART,
            **common,
        )
        api.optimize(at["pocket.png"], machine="haas-vf2", pixel_size=1, **common)
        fed = {"feeds": True, "machine": machine_of_power(out, "5 kW"), "strategy": "zigzag", "step_over": 0.4}
        (out / "teeth.toml").write_text(TOOLS.replace('kind = "end-mill"', 'kind = "end-mill"\nteeth = 3'))
        api.optimize(at["pocket.dxf"], tools=out / "teeth.toml", material="c45", open_paths="drop", **fed, **common)
    elif work == "part":
        common = {"process": "part", "thickness": 3, "open_paths": "drop", "tabs": 1, **LITTLE}
        board = {"operations": EXAMPLES / "board.toml", "tools": EXAMPLES / "board_tools.toml", "tool_number": 1}
        board |= {"machine": "shapeoko-router", "thickness": 1.6}
        api.optimize(EXAMPLES / "board.zip", process="part", **board, **LITTLE)
        api.optimize(at["sheet.dxf"], machine="haas-vf2", tools=at["tools.toml"], **APART, **common)
        once = {"copies": "1x1", "pitch": (9, 9)}
        api.optimize(at["sheet.dxf"], machine="haas-vf2", tool_diameter=3, algorithm="firefly", **once, **common)
        plate = ezdxf.new(units=4)
        plate.modelspace().add_lwpolyline([(0, 0), (40, 0), (40, 32), (0, 32)], close=True)
        plate.saveas(out / "plate.dxf")
        quoted = {"quote": out / "quote.html", "stock_price": 5, **QUOTED}
        api.optimize(out / "plate.dxf", machine="haas-vf2", tool_diameter=3, **quoted, **common)
    elif work == "program":
        api.optimize(at["cam.nc"], **APART, **LITTLE)
        api.optimize(at["cam.nc"], algorithm="firefly", **LITTLE)
        api.optimize(at["cam.nc"], keep_out="200 200 210 210", **FAST)
        stock = {"workpiece": "-10,-10,-9,110,130,0", "tool_diameter": 3}
        api.optimize(at["cam.nc"], air=True, low_retracts=True, feeds=True, **stock, **FAST)
        limits = {"material": "c45", "tools": at["tools.toml"]}
        api.optimize(at["cam.nc"], feeds=True, **limits, **stock, **FAST)
        api.optimize(at["plasma.ngc"], machine="plasma-table", **LITTLE)
    elif work == "nest":
        laid = {"sheet": "400x200", "ignore_layers": "MARK", "open_paths": "drop", "nester": "shapes", **FAST}
        api.nest([at["sheet.dxf"]], out / "nest.dxf", remnants_out=out, **laid)
    elif work == "solve":
        api.solve(at["holes.csv"], **APART, **LITTLE)
        api.solve("random:12", algorithm="firefly", **LITTLE)
    elif work == "simulate":
        api.simulate(at["cam.nc"])
        api.simulate(at["plasma.ngc"], machine="plasma-table")
    elif work == "stock":
        (out / "cam.nc").write_text("G21 G90\nT1 M6\nM3 S900\nG0 X0 Y0 Z5\nG1 Z-1 F60\nG1 X9\nG0 Z5\nM2\n")
        api.stock(out / "cam.nc", tool_diameter=3)
    elif work == "cutting-data":
        made = {"material": "c45"}
        api.tool_speeds(at["holes.csv"], material="c45", depth=3, tools=at["tools.toml"], **FAST)
        surface = {"surface": at["block.stl"], "depth": "through", "keep_out": "200 200 210 210 9"}
        surface["fixture"] = at["clamp.stl"]
        api.tool_speeds(at["holes.csv"], material="c45", **surface, **FAST)
        api.tool_speeds(at["holes.csv"], material="c45", depth=3, cycle=None, feed=99, spindle_speed=900, **FAST)
        api.tool_speeds(**made, depth=3, tool_diameter=3)
        (out / "mill.toml").write_text(TOOLS.replace('kind = "end-mill"', 'kind = "end-mill"\nteeth = 3'))
        api.tool_speeds(**made, thickness=3, tools=out / "mill.toml", step_down=2)
    else:
        api.verify(at["plasma.ngc"], at["plasma.ngc"], machine="plasma-table")


@pytest.mark.slow
@pytest.mark.parametrize("work", WORKS)
def test_the_options_that_a_kind_of_work_names_are_those_that_its_runs_read(
    work: str, files: dict[str, Path], reads: set[str], tmp_path: Path
) -> None:
    """An option that is named and never read would be ignored; one that is read and not named, refused for nothing."""
    _runs(work, files, tmp_path)
    # The command line reads `strict` for the exit status of these.
    named = {name for _, name, _ in options_used_by(WORKS[work])} - {"simulate": {"strict"}, "stock": {"strict"}}.get(
        work, set()
    )
    # Speeds are chosen for a program that is planned, written and proved as usual, but not shown.
    unseen = {*PostOptions.specs(), *SolveOptions.specs(), *FireflyOptions.specs()} if work == "cutting-data" else set()
    # Each drawing is read with its zero, also for work that has none.
    unseen |= {"origin", "up", "z_zero"}
    assert (sorted(named - reads), sorted(reads - named - unseen)) == ([], [])


@pytest.mark.parametrize("work", WORKS)
def test_an_option_of_another_kind_of_work_is_refused_and_its_default_too(work: str) -> None:
    """One line: the option, the work, and the work that it applies to."""
    others = [(group, name) for group, name, _ in all_options() if name not in WORKS[work].used()]
    assert others
    for group, name in others:
        settings = collect_settings({name: _default_or_some(group, name)})
        with pytest.raises(
            OptionError, match=f"^{flag_name(name)}: this option does not apply to {WORKS[work].title},"
        ):
            settings_for(settings, WORKS[work])


def _default_or_some(group: type[OptionGroup], name: str) -> Any:
    """Return an option's default as one types it; where it has none, any value that it takes."""
    spec, default = group.specs()[name], group.defaults()[name]
    value = spec.maximum if default is None else default
    if value is not None:
        return typed_text(spec, value) if spec.kind == "quantity" else value
    if spec.choices or spec.example:
        return spec.example or spec.choices[0]
    return {"text": "10x10", "names": "a", "point": "1,2", "place": "centre", "path": "a", "flag": True}.get(
        spec.kind, 2
    )


def test_what_an_option_needs_is_an_option_and_one_of_its_values() -> None:
    known = {name: spec for _, name, spec in all_options()}
    for name, needs in [pair for work in registry.works() for pair in work.used().items()]:
        for condition in needs:
            assert set(condition.names) <= known.keys(), name
            for other in condition.names:
                assert set(condition.values) <= set(known[other].choices), name


def test_a_table_of_a_process_holds_all_that_it_uses_and_each_option_stands_once(tmp_path: Path) -> None:
    """Also in shared tables: a shop's file states each value once."""
    shop = tmp_path / "shop.toml"
    shop.write_text("[drill]\nthickness = 6\ntools = 'a.toml'\n[cut]\nmaterial = 'brass'\n[read]\nstrict = true\n")
    settings = collect_settings({}, shop)
    job = settings.job
    assert (job.thickness, job.tools, job.material, settings.read.strict) == (6.0, Path("a.toml"), "brass", True)
    for text, words in (
        ("[drill]\nthickness = 6\n[job]\nthickness = 8\n", r"shop.toml:4: .* twice, in \[drill\] and in \[job\]"),
        ("[nest]\nthickness = 6\n", r"shop.toml:2: unknown option 'thickness' in \[nest\]"),
    ):
        shop.write_text(text)
        with pytest.raises(OptionError, match=words):
            collect_settings({}, shop)


@pytest.mark.parametrize(
    "source, options, words",
    [
        (
            "holes.csv",
            {"quantity": 1},
            "--quantity: this option does not apply to drilling, only to cutting a sheet and milling parts; leave it",
        ),
        (
            "holes.csv",
            {"strategy": "zigzag"},
            "--strategy: this option does not apply to drilling, only to milling pockets",
        ),
        ("holes.csv", {"corner_loops": True}, "--corner-loops: this option does not apply to drilling"),
        (
            "cam.nc",
            {"output_units": "mm"},
            "--output-units: this option does not apply to reordering a program, .* keeps its own units",
        ),
        ("cam.nc", {"coolant": True}, "--coolant: "),
        ("cam.nc", {"depth": 3}, "--depth: "),
        (
            "cam.nc",
            {"clearance_height": 9},
            "--clearance-height: only used with --keep-out; add --keep-out or leave out",
        ),
        (
            "holes.csv",
            {"n_ants": 7},
            "--n-ants: only .* --algorithm as, eas, asrank, mmas or acs; set --algorithm or leave",
        ),
        (
            "holes.csv",
            {"depth": 3, "tools": "tools.toml", "feed": 9},
            "--feed: the tools in .* have values of their own; leave it out",
        ),
        (
            "holes.csv",
            {"depth": 3, "cycle": "G81", "peck": 1},
            "--peck: no cycle of this program uses it; leave it out",
        ),
        (
            "holes.csv",
            {"depth": 3, "cycle": "G81", "dwell": 1},
            "--dwell: no cycle of this program uses it; leave it out",
        ),
        (
            "holes.csv",
            {"depth": 3, "program_number": 7},
            "--program-number: linuxcnc programs have no number; leave it out",
        ),
        ("pocket.dxf", {"process": "pocket", "pixel_size": 1}, "--pixel-size: only used for a picture; leave it out"),
        ("plasma.ngc", {"amps": 45, "cut_speed": 900}, "--amps: not used with --cut-speed; leave out --cut-speed or"),
        ("sheet.dxf", {"process": "cut", "joint_width": 1}, "--joint-width: .*only used with --micro-joints"),
    ],
)
def test_what_would_be_ignored_is_refused(source: str, options: Any, words: str, files: dict[str, Path]) -> None:
    """On 0.1.0 all of these ran, and some stood under "to repeat this run"."""
    given = {name: str(files[value]) if value in files else value for name, value in options.items()}
    with pytest.raises(OptionError, match=words):
        api.optimize(files[source], **given)


def test_a_file_of_options_may_serve_many_kinds_of_work(files: dict[str, Path], tmp_path: Path) -> None:
    """Unused options of a file are not applied, and are missing in the command that repeats the run."""
    shop = tmp_path / "shop.toml"
    shop.write_text("[drill]\ndepth = 3\npeck = 1\n[cut]\nquantity = 4\n[aco]\nn_ants = 7\n[solve]\nseed = 5\n")
    drilled = api.optimize(files["holes.csv"], options_file=shop, iterations=1)
    assert set(drilled.options) == {"--depth", "--peck", "--seed", "--iterations"}
    ordered = api.optimize(files["cam.nc"], options_file=shop, iterations=1)
    assert set(ordered.options) == {"--seed", "--iterations"}
