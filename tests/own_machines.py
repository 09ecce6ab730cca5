"""Machine profiles for tests: a shipped one with keys of its own."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

import tomlkit


def own_machine(folder: Path, machine: str = "linuxcnc-mill", **tables: dict[str, Any]) -> str:
    """Return the path of a copy of a shipped profile with other keys in some tables."""
    profile: Any = tomlkit.parse((files("leafcut") / "machines" / f"{machine}.toml").read_text(encoding="utf-8"))
    for table, keys in tables.items():
        profile[table].update(keys)
    file = folder / "own_machine.toml"
    file.write_text(tomlkit.dumps(profile), encoding="utf-8")
    return str(file)


def machine_of_power(folder: Path, power: str) -> str:
    """Return the path of the profile of a mill with this spindle power."""
    return own_machine(folder, spindle={"power": power})


def blind_table(folder: Path) -> Path:
    """Return the path of the profile of the plasma table without its probe."""
    profile: Any = tomlkit.parse((files("leafcut") / "machines" / "plasma-table.toml").read_text(encoding="utf-8"))
    del profile["probe"]
    for key in [key for key in profile["sources"] if key.startswith("probe.")]:
        del profile["sources"][key]
    file = folder / "blind.toml"
    file.write_text(tomlkit.dumps(profile), encoding="utf-8")
    return file
