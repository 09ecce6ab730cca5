"""Which room may import which (the picture in CONTRIBUTING.md), read from the syntax trees."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

from leafcut.processes import registry

ROOT = Path(__file__).parents[1] / "src" / "leafcut"

#: What stands below all rooms: a part of the standard library that is quicker to import.
BELOW = {"quick_dataclass"}
BASE = {"errors", "kinds", "units"}
MODEL = BASE | {"geometry", "model"}
STAGE = MODEL | {"options", "gcode"}
STAGES = {"read", "timing", "solve", "post", "proof", "report"}
#: Room → the rooms that it may import, of those below the processes.
MAY_IMPORT = {
    "_version": set(),
    "__main__": {"_version", "cli"},
    "quick_dataclass": set(),
    "errors": set(),
    "kinds": set(),
    "units": {"errors"},
    "kernels": set(),
    "files": {"errors"},
    "executors": {"errors", "_version"},
    "plugins": {"errors"},
    "geometry": BASE,
    "option_spec": BASE | {"plugins"},
    "options": BASE | {"option_spec"},
    "model": BASE | {"geometry"},
    "gcode": MODEL | {"files", "plugins"},
    "stock": MODEL | {"kernels"},
    "machines": set(),
    "materials": set(),
    "read": STAGE | {"files", "plugins"},
    "timing": STAGE | {"kernels"},
    "solve": STAGE | {"executors", "kernels", "plugins"},
    "post": STAGE,
    "proof": STAGE | {"stock", "timing"},
    "report": STAGE | {"stock", "timing"},
    "progress": set(),
    "keywords": set(),
    "flags": BASE | {"option_spec", "plain_line"},
    "plain_line": {"option_spec"},
    "usage": BASE | {"option_spec"},
}
#: Above the processes: what joins them and what people see.
MAY_IMPORT["api"] = STAGE | STAGES | {"keywords", "files", "processes", "stock"}
MAY_IMPORT["lab"] = MODEL | {
    "api",
    "executors",
    "options",
    "option_spec",
    "solve",
    "processes",
    "files",
    "read",
    "report",
    "_version",
}
MAY_IMPORT["studio"] = MODEL | {
    "api",
    "lab",
    "option_spec",
    "options",
    "files",
    "progress",
    "read",
    "report",
    "user_files",
}
MAY_IMPORT["studio"] |= {"gcode", "processes", "sender", "stock", "_version"}
MAY_IMPORT["public"] = MODEL | {"api", "keywords", "options", "files", "processes", "read", "stock"}
MAY_IMPORT["user_files"] = MAY_IMPORT["files"] | {"files"}
MAY_IMPORT["several"] = BASE | {"files", "read"}
MAY_IMPORT["batch"] = BASE | {
    "api",
    "executors",
    "files",
    "model",
    "read",
    "report",
    "several",
    "_version",
}
MAY_IMPORT["watch_folder"] = BASE | {"api", "batch", "executors", "files", "read"}
MAY_IMPORT["shop_defaults"] = BASE | {"files", "option_spec", "processes"}
MAY_IMPORT["addons"] = BASE | {"files"}
MAY_IMPORT["warming"] = MODEL | {"api", "files", "kernels", "options", "solve", "stock"}
MAY_IMPORT["cli_inside"] = BASE | {
    "progress",
    "warming",
    "addons",
    "files",
    "gcode",
    "processes",
    "read",
    "shop_defaults",
    "usage",
    "user_files",
}
MAY_IMPORT["linuxcnc_filter"] = BASE | {"api", "files", "model", "processes", "read"}
MAY_IMPORT["cli"] = BASE | {
    "studio",
    "api",
    "option_spec",
    "options",
    "flags",
    "plain_line",
    "files",
    "progress",
    "read",
    "report",
}
MAY_IMPORT["cli_lab"] = BASE | {"batch", "executors", "lab", "files", "option_spec", "processes", "progress", "several"}
MAY_IMPORT["sender"] = MODEL | {"files", "gcode", "proof", "read", "timing"}
MAY_IMPORT["terminal_keys"] = set()
MAY_IMPORT["cli_send"] = BASE | {"files", "model", "sender", "terminal_keys", "usage"}
MAY_IMPORT["cli_machine"] = BASE | {"api", "files", "read", "report", "sender", "timing", "usage"}
MAY_IMPORT["cli"] |= {
    "batch",
    "cli_inside",
    "watch_folder",
    "cli_lab",
    "cli_machine",
    "cli_send",
    "executors",
    "linuxcnc_filter",
    "usage",
    "gcode",
    "user_files",
    "several",
    "model",
    "processes",
    "_version",
}

#: What all processes share, and what stands between them and the rest of the program.
COURSE = STAGE | STAGES | {"files", "plugins", "option_spec", "stock", "processes", "_version"}
#: Part of a process → what it may import, beside other parts of its own process (`OWN`).
IN_A_PROCESS = {
    "plan": STAGE | {"stock", "timing", "processes"},
    "proof": STAGE | {"stock", "timing", "proof"},
    "post": STAGE | {"post"},
    "report": STAGE | {"stock", "timing", "report"},
}
#: Part of a process → the parts of the same process that it may import. What judges shares nothing with what made it.
OWN = {"plan": set(), "proof": set(), "post": set(), "report": set()}
#: A process → those whose public names it uses.
NEEDS = {"nesting": {"sheet"}}
PROCESSES = {"drilling", "sheet", "pocket", "program", "nesting"}
#: Room of the studio → the rooms of it that it may import; what stands beside them, everybody may.
OF_STUDIO: dict[str, set[str]] = {
    "drawing": set(),
    "jobs": {"drawing"},
    "machine": {"jobs"},
    "page": {"drawing", "jobs", "machine"},
    "server": {"jobs", "machine", "page"},
}

FILES = sorted(ROOT.rglob("*.py"))


def room_of(path: Path) -> str:
    """Return the room of a file: its folder under leafcut, or its own name."""
    first = path.relative_to(ROOT).parts[0]
    return first.removesuffix(".py")


def process_of(parts: Sequence[str]) -> str:
    """Return the process that a module belongs to, by the parts of its name below leafcut, "" for any other."""
    return parts[1] if len(parts) > 1 and parts[0] == "processes" and parts[1] in PROCESSES else ""


def part_of(parts: Sequence[str]) -> str:
    """Return the part of its process that a module is: plan, proof, post or report, "" for what joins them."""
    return parts[2] if len(parts) > 2 and process_of(parts) and parts[2] in IN_A_PROCESS else ""


@cache  # most tests here ask for it; none changes what it gets
def imported(path: Path) -> set[tuple[str, ...]]:
    """Return the modules of leafcut that a file imports, also inside functions, as the parts of their names."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        found |= {tuple(name.split(".")[1:]) for name in names if name.startswith("leafcut.")}
    return found


def module(path: Path) -> tuple[str, ...]:
    """Return the parts of a module's name below leafcut."""
    return path.relative_to(ROOT).with_suffix("").parts


def rooms_outside() -> list[Path]:
    return [f for f in FILES if room_of(f) not in ("processes", "__init__")]


def faults(files: Iterable[Path], wrong: Callable[[tuple[str, ...], tuple[str, ...]], bool]) -> list[str]:
    """Return the imports that are wrong, each as "who: whom"."""
    return [
        f"{'.'.join(module(file))}: {'.'.join(name)}"
        for file in files
        for name in sorted(imported(file))
        if wrong(module(file), name)
    ]


def test_a_room_imports_only_what_it_may() -> None:
    assert not faults(rooms_outside(), lambda me, it: it[0] != me[0] and it[0] not in MAY_IMPORT[me[0]] | BELOW)


def test_the_processes_import_rooms_alone_and_never_what_stands_above_them() -> None:
    assert not faults(ROOT.glob("processes/**/*.py"), lambda _, it: it[0] not in COURSE | BELOW)


def test_a_room_of_the_studio_imports_only_what_it_may() -> None:
    def wrong(me: tuple[str, ...], it: tuple[str, ...]) -> bool:
        mine, its = me[1], it[1] if it[0] == "studio" else ""
        return its in OF_STUDIO and its != mine and its not in OF_STUDIO[mine]

    assert {file.parent.name for file in ROOT.glob("studio/*/*.py")} == set(OF_STUDIO)
    assert not faults(ROOT.glob("studio/*/*.py"), wrong)


def test_no_file_outside_a_process_imports_one_by_name() -> None:
    """The registry alone finds processes: what all of them share, and what stands above, knows none of them.

    But their models have public names, as the details of outcomes.
    """

    def wrong(me: tuple[str, ...], it: tuple[str, ...]) -> bool:
        return bool(process_of(it)) and not (me == ("public",) and it[2] == "model")

    assert not faults([f for f in FILES if not process_of(module(f))], wrong)


def test_the_registry_knows_every_process_that_is_there() -> None:
    packages = {f.parent.name for f in ROOT.glob("processes/*/process.py")}
    assert packages == PROCESSES
    assert {place.split(".")[2] for place in registry.BUILT_IN.values()} == PROCESSES
    assert [process.name for process in registry.processes()] == list(registry.BUILT_IN)


def test_a_process_imports_no_other_but_those_it_stands_on() -> None:
    def other(me: tuple[str, ...], it: tuple[str, ...]) -> bool:
        mine, its = process_of(me), process_of(it)
        return bool(mine and its and mine != its and its not in NEEDS.get(mine, set()))

    assert not faults(ROOT.glob("processes/**/*.py"), other)


def test_plan_proof_post_and_report_of_a_process_share_no_code() -> None:
    """What judges imports nothing of what made it, and neither of them what tells of it."""

    def wrong(me: tuple[str, ...], it: tuple[str, ...]) -> bool:
        part = part_of(me)
        if not part:
            return False
        if process_of(it) == process_of(me):
            return part_of(it) != part and part_of(it) not in OWN[part] and it[2] not in ("model", "options")
        return it[0] not in IN_A_PROCESS[part] | BELOW

    assert not faults(ROOT.glob("processes/**/*.py"), wrong)


def circle_in(imports: dict[str, set[str]]) -> list[str]:
    """Return modules that import each other in a circle, the first once more at the end; none where there is none."""
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as found:
        circle: list[str] = found.args[1]
        return circle
    return []


def test_no_modules_import_each_other_in_a_circle() -> None:
    """Imports inside functions count, and those for types alone, too: what knows each other cannot be read alone."""
    names = {".".join(module(file)).removesuffix(".__init__"): file for file in FILES}
    imports = {
        name: {found for whole in imported(file) if (found := _module_of(whole, names)) and found != name}
        for name, file in names.items()
    }
    assert sum(map(len, imports.values())) > 1000
    assert circle_in(imports) == []


def _module_of(name: tuple[str, ...], names: Iterable[str]) -> str:
    """Return the module that an import names: itself, or the one that holds what is imported."""
    return next((found for found in (".".join(name), ".".join(name[:-1])) if found in names), "")


def test_a_circle_is_found() -> None:
    """The test above would find one: b, c and a import each other, d and e do not."""
    assert set(circle_in({"a": {"b"}, "b": {"c", "d"}, "c": {"a"}, "d": {"e"}, "e": set()})) == {"a", "b", "c"}


def test_a_class_or_a_type_is_defined_once_under_its_name() -> None:
    """A reader who meets a name looks it up in one place; what a module keeps to itself begins with an underscore."""
    homes: dict[str, list[str]] = {}
    for file in FILES:
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            names = [node.name] if isinstance(node, ast.ClassDef) else _assigned(node)
            for name in names:
                if name[0].isupper() and not name.isupper():
                    homes.setdefault(name, []).append(file.name)
    assert {name: files for name, files in homes.items() if len(files) > 1} == {}


def _assigned(node: ast.stmt) -> list[str]:
    return [t.id for t in node.targets if isinstance(t, ast.Name)] if isinstance(node, ast.Assign) else []


def loaded_by(statement: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter has loaded after `statement`."""
    code = f"{statement}\nimport sys\nprint(' '.join({{m.split('.')[0] for m in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


HEAVY = {"numba", "optuna", "ezdxf", "gerbonara", "jinja2", "numpy", "rich", "shapely"}


@pytest.mark.parametrize("flag", ["--version", "--help"])
def test_the_version_and_the_help_are_told_without_loading_anything_heavy(flag: str) -> None:
    loaded = loaded_by(f"from leafcut.cli import run\nrun([{flag!r}])")
    assert not loaded & (HEAVY - {"rich"})


def test_the_version_alone_is_said_without_the_command_line() -> None:
    """The command says what the command line says, and loads none of it."""
    code = """
import runpy, sys
sys.argv = ["leafcut", "--version"]
try:
    runpy.run_module("leafcut", run_name="__main__")
except SystemExit as end:
    print(end.code, *{"leafcut.cli", "cyclopts", "dataclasses"} & set(sys.modules))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    told = subprocess.run(
        [sys.executable, "-m", "leafcut.cli", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == [told.stdout.strip(), "0"]


def test_what_reads_entry_points_is_not_loaded_where_no_package_has_any_of_ours() -> None:
    code = "from leafcut.cli import run\nrun(['--version'])\nimport sys\nprint('importlib.metadata' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False"


def test_timing_a_program_loads_no_library_that_it_does_not_need() -> None:
    program = ROOT.parents[1] / "examples" / "cam_121.nc"
    loaded = loaded_by(f"from leafcut.cli import run\nrun(['simulate', {str(program)!r}])")
    assert not loaded & (HEAVY - {"rich", "numpy"})


def test_shapely_is_imported_at_the_top_unless_a_comment_says_why() -> None:
    """A reader may wait with it, so that commands that need none of it start quickly."""
    inside = re.compile(r"^ +(import shapely|from shapely.* import .*)$", re.MULTILINE)
    assert not [f"{f.name}: {found[1]}" for f in FILES for found in inside.finditer(f.read_text(encoding="utf-8"))]


def test_importing_leafcut_loads_nothing_heavy() -> None:
    assert not loaded_by("import leafcut") & HEAVY


def test_no_public_name_is_hidden_by_a_room() -> None:
    import leafcut

    rooms = {room_of(f) for f in FILES}
    assert not rooms & (set(leafcut.__all__) - {"__version__"})
    assert all(getattr(leafcut, name) is not None for name in leafcut.__all__)


def test_reading_and_planning_do_not_load_numba() -> None:
    planning = "from leafcut.processes.drilling.plan.drilling import plan_drilling"
    assert "numba" not in loaded_by(f"import leafcut\n{planning}\nleafcut.read_part('example:plate-70')")
