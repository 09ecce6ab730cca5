"""Which room may import which (the picture in CONTRIBUTING.md), read from the syntax trees."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1] / "src" / "leafcut"

BASE = {"errors", "units"}
MODEL = BASE | {"geometry", "model"}
STAGE = MODEL | {"options", "gcode"}
MAY_IMPORT = {
    "errors": set(),
    "units": {"errors"},
    "kernels": set(),
    "files": {"errors"},
    "geometry": BASE,
    "option_spec": BASE,
    "options": BASE | {"option_spec", "files"},
    "model": BASE | {"geometry"},
    "gcode": MODEL,
    "machines": set(),
    "read": STAGE | {"files"},
    "plan": STAGE,
    "timing": STAGE | {"kernels"},
    "solve": STAGE | {"kernels"},
    "post": STAGE,
    "verify": STAGE | {"timing"},
    "report": STAGE | {"timing"},
    "progress": set(),
    "flags": BASE | {"option_spec"},
}
STAGES = {"read", "plan", "timing", "solve", "post", "verify", "report"}
MAY_IMPORT["runs"] = STAGE | STAGES
MAY_IMPORT["api"] = STAGE | STAGES | {"files", "runs"}
MAY_IMPORT["studio"] = MODEL | {"api", "option_spec", "options", "files", "progress", "read", "report"}
MAY_IMPORT["user_files"] = MAY_IMPORT["files"] | {"files"}
MAY_IMPORT["several"] = BASE | {"files", "read"}
MAY_IMPORT["cli"] = BASE | {"studio", "api", "option_spec", "options", "flags", "files", "progress", "read", "report"}
MAY_IMPORT["studio"] |= {"user_files"}
MAY_IMPORT["cli"] |= {"user_files", "several", "model"}

FILES = sorted(ROOT.rglob("*.py"))


def room_of(path: Path) -> str:
    """Return the room of a file: its folder under leafcut, or its own name."""
    first = path.relative_to(ROOT).parts[0]
    return first.removesuffix(".py")


def imported_rooms(path: Path) -> set[str]:
    """Return the rooms of leafcut that a file imports anywhere, also inside functions."""
    rooms = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            names = [node.module or ""]
        else:
            continue
        rooms |= {name.split(".")[1] for name in names if name.startswith("leafcut.")}
    return rooms


@pytest.mark.parametrize("path", [f for f in FILES if f.name != "__init__.py" or f.parent != ROOT], ids=str)
def test_a_room_imports_only_what_it_may(path: Path) -> None:
    room = room_of(path)
    assert imported_rooms(path) - {room} <= MAY_IMPORT[room]


def loaded_by(statement: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter has loaded after `statement`."""
    code = f"{statement}\nimport sys\nprint(' '.join({{m.split('.')[0] for m in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split())


HEAVY = {"numba", "ezdxf", "gerbonara", "jinja2", "numpy", "rich"}


def test_the_version_is_told_without_loading_anything_heavy() -> None:
    loaded = loaded_by("from leafcut.cli import run\nrun(['--version'])")
    assert not loaded & (HEAVY - {"rich"})


def test_importing_leafcut_loads_nothing_heavy() -> None:
    assert not loaded_by("import leafcut") & HEAVY


def test_no_public_name_is_hidden_by_a_room() -> None:
    import leafcut

    rooms = {room_of(f) for f in FILES}
    assert not rooms & (set(leafcut.__all__) - {"__version__"})
    assert all(callable(getattr(leafcut, name)) for name in leafcut.__all__ if name != "__version__")


def test_reading_and_planning_do_not_load_numba() -> None:
    statement = "import leafcut\nfrom leafcut.plan.drilling import plan_drilling\nleafcut.read_part('example:plate-70')"
    assert "numba" not in loaded_by(statement)
