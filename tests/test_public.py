"""The public names of leafcut: few, loaded when they are used, and hidden by no module."""

from __future__ import annotations

import inspect
import pkgutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import leafcut
from leafcut.errors import OptionError
from leafcut.processes import registry

EXAMPLES = Path(__file__).parents[1] / "examples"
#: Commands whose functions have their names.
COMMANDS = ("optimize", "drill", "cut", "pocket", "part", "reorder", "nest", "simulate", "verify", "stock", "solve")


def test_each_command_has_a_function_of_its_name() -> None:
    processes = {one.command for one in registry.processes()}
    assert processes <= set(COMMANDS)
    for name in (*COMMANDS, "tool_speeds", "read_part"):
        assert inspect.isfunction(getattr(leafcut, name)), name
        assert inspect.getdoc(getattr(leafcut, name)), name


def test_there_are_few_public_names_and_each_is_that_of_its_module() -> None:
    assert len(leafcut.__all__) <= 40
    assert set(dir(leafcut)) == set(leafcut.__all__)
    for name in set(leafcut.__all__) - {"__version__"}:
        thing = getattr(leafcut, name)
        assert thing is getattr(import_module(thing.__module__), name)


def test_no_module_of_leafcut_has_the_name_of_a_public_name() -> None:
    """`import leafcut.NAME` sets `leafcut.NAME` to the module: a function of that name would be lost."""
    modules = {module.name for module in pkgutil.iter_modules(leafcut.__path__)}
    assert {"read", "order", "api"} <= modules
    assert modules.isdisjoint(leafcut.__all__)


def test_importing_all_modules_hides_no_function() -> None:
    modules = sorted(module.name for module in pkgutil.iter_modules(leafcut.__path__) if module.name != "__main__")
    imports = "".join(f"import leafcut.{name}\n" for name in modules)
    code = f"{imports}print(all(callable(getattr(leafcut, name)) for name in {COMMANDS}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


def test_an_unknown_name_is_an_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'optimise'"):
        leafcut.optimise  # noqa: B018


@pytest.mark.parametrize(
    "command, option", [("drill", "pierce_cost"), ("cut", "peck"), ("pocket", "pierce_cost"), ("reorder", "peck")]
)
def test_the_option_of_another_process_is_refused_by_name(command: str, option: str) -> None:
    source = EXAMPLES / "cam_121.nc" if command == "reorder" else "example:plate-70"
    with pytest.raises(OptionError, match=f"^--{option.replace('_', '-')}: this option does not apply to "):
        getattr(leafcut, command)(source, **{option: 1})


def test_reorder_takes_a_program_and_drill_takes_a_drawing() -> None:
    with pytest.raises(OptionError, match="the input is a drawing, not a program"):
        leafcut.reorder("example:plate-70")
