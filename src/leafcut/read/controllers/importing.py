"""Import the settings file of a controller.

The module detects the kind of file, reads the values, and writes a machine profile. A connected controller sends the
same text when `leafcut.sender.firmware.query_settings` asks for its settings, so `machine_from_settings` accepts that
text too.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from leafcut.errors import OptionError, ReadError, name_suggestion, printable
from leafcut.files.schemas import MACHINE
from leafcut.files.whole_files import decode_text
from leafcut.message import Message
from leafcut.model.machine import Machine
from leafcut.read.controllers import fluidnc, grbl, linuxcnc, mach, reprap
from leafcut.read.controllers.values import Value, ValueOrigin, Values
from leafcut.read.machine import load_profile_values, machine_from_profile_text
from leafcut.read.machine_keys import PROFILE_KEYS, toml_value

#: Maximum size of a settings file, bytes: ten times the largest known file.
MOST_BYTES = 4 * 1024 * 1024


@dataclass(frozen=True)
class SettingsKind:
    """A kind of settings file: its name, its description, and the function that reads it.

    The function converts a text to values. It also takes the file name and the units.
    """

    name: str
    help: str
    read: Callable[..., Values]
    states_units: bool = False


KINDS: dict[str, SettingsKind] = {
    kind.name: kind
    for kind in (
        SettingsKind("grbl", "the answer of GRBL or grblHAL to $$, saved as text", grbl.import_grbl, states_units=True),
        SettingsKind("linuxcnc", "the .ini of LinuxCNC", linuxcnc.import_linuxcnc),
        SettingsKind("mach3", "the .xml of Mach3", mach.import_mach3),
        SettingsKind("mach4", "the Machine.ini of Mach4", mach.import_mach4),
        SettingsKind("fluidnc", "the config.yaml of FluidNC", fluidnc.import_fluidnc, states_units=True),
        SettingsKind("marlin", "the answer of Marlin to M503, saved as text", reprap.import_marlin, states_units=True),
        SettingsKind("rrf", "the config.g of RepRapFirmware (Duet)", reprap.import_rrf, states_units=True),
    )
}

_SECTION = re.compile(r"^\s*\[\w[^\]\n]{0,40}\]\s*$", re.MULTILINE)
_LINUXCNC = re.compile(r"^(\s*\[(TRAJ|KINS|EMC|RS274NGC|JOINT_0|AXIS_X|AXIS_0)\]|#INCLUDE )", re.MULTILINE)
_MACH4 = re.compile(r"^\s*\[Motor0\]", re.MULTILINE)
_AXES = re.compile(r"^axes\s*:", re.MULTILINE | re.IGNORECASE)
#: Commands that identify Marlin's reply or a RepRapFirmware file. M208 sets the travel in RepRapFirmware, but moves the
#: filament in Marlin.
_MARLIN_WORDS, _RRF_WORDS = {"M205", "M206", "M301"}, {"M453", "M550", "M566", "M584", "M669", "M950"}


@dataclass(frozen=True)
class ImportedMachine:
    """A machine that was imported from the settings of its controller."""

    kind: str
    title: str
    machine: Machine
    values: tuple[Value, ...]
    notes: tuple[str, ...]
    text: str


def load_settings_text(path: str | Path) -> str:
    """Read a settings file.

    Raises
    ------
    ReadError
        The file is missing, not a regular file, empty, too large, or not text.
    """
    file = Path(path)
    try:
        if not file.is_file():
            raise ReadError(path, "this is a folder; name a file in it" if file.is_dir() else "file not found")
        with file.open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
    except ValueError:
        raise ReadError(printable(str(path)), "not a valid file name") from None
    except OSError as problem:
        raise ReadError(path, Message("cannot be read ({})", problem.strerror)) from None
    return decode_settings(data, str(path))


def decode_settings(data: bytes, path: str) -> str:
    """Decode the bytes of a settings file. Error messages use `path` as the name of the file.

    Raises
    ------
    ReadError
        The settings are empty, too large, or not text.
    """
    if len(data) > MOST_BYTES:
        raise ReadError(path, f"is larger than {MOST_BYTES >> 20} MiB, too large for the settings of a controller")
    if not data.strip():
        raise ReadError(path, "is empty")
    if data.startswith(b"PK"):
        raise ReadError(path, "is a zip file; unpack it, and import the file of settings in it")
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise ReadError(path, "is UTF-16; save it as UTF-8")
    if b"\0" in data:
        raise ReadError(path, "is a binary file; settings of a controller are text")
    return decode_text(data)[0]


def detect_settings_kind(text: str, file: str) -> str:
    """Detect the kind of settings file from its contents.

    Raises
    ------
    ReadError
        The kind is unknown or ambiguous.
    """
    start = text.lstrip("\ufeff \t\r\n")
    if start.startswith("<"):
        if "<Preferences" in text or "<profile" in text[:2000]:
            return "mach3"
        raise ReadError(file, "is XML, but not a Mach3 profile: <profile> with <Preferences> was expected")
    if _MACH4.search(text) and "CountsPerUnit" in text:
        return "mach4"
    if _LINUXCNC.search(text):
        return "linuxcnc"
    if grbl.is_settings_reply(text):
        return "grbl"
    if _AXES.search(text):
        return "fluidnc"
    commands = {match[1].upper() for line in text.splitlines() if (match := reprap.match_command(line))}
    if commands & {"M201", "M203"}:
        if "echo:" in text:  # Marlin starts the lines of its answers with "echo:"
            return "marlin"
        marlin = bool(commands & _MARLIN_WORDS)
        duet = bool(commands & _RRF_WORDS) or reprap.has_rrf_travel(text)
        if marlin is duet:
            both = "words of both Marlin and RepRapFirmware" if marlin else "M201 and M203 only"
            raise ReadError(
                file, f"has {both}, so M203 may be in mm/s or in mm/min; choose with --kind marlin or --kind rrf"
            )
        return "marlin" if marlin else "rrf"
    if "M98" in commands and commands & _RRF_WORDS:
        return "rrf"
    raise ReadError(
        file, f"{_unknown_file_reason(text)}; leafcut imports {', '.join(kind.help for kind in KINDS.values())}"
    )


def _unknown_file_reason(text: str) -> str:
    if _SECTION.search(text):
        return "is an INI file of no controller that leafcut knows"
    if len(re.findall(r"^\s*[NGM]\d+\b", text[:5000], re.MULTILINE)) > 1:
        return "is a program, not the settings of a controller"
    return "is of no kind that leafcut knows"


def machine_from_settings(text: str, file: str, kind: str | None = None, units: str | None = None) -> ImportedMachine:
    """Convert the text of a settings file to a machine.

    Parameters
    ----------
    file
        Name of the settings file. It appears in messages and in the profile. If the settings contain no machine name,
        the machine is named after the file.
    kind
        One of `KINDS`, or None to detect the kind from the contents.

    Raises
    ------
    ReadError
        The kind is unknown, or a required value is missing or implausible.
    OptionError
        The kind is invalid, or the caller passed units for a file that states its units.
    """
    if kind is not None and kind not in KINDS:
        raise OptionError(f"--kind: unknown kind '{printable(kind, 30)}'{name_suggestion(kind[:80], KINDS)}")
    if units not in (None, "mm", "in"):
        raise OptionError(f"--units: '{printable(str(units), 20)}' is not mm or in")
    kind_name = kind or detect_settings_kind(text, file)
    if units is not None and KINDS[kind_name].states_units:
        raise OptionError("--units: this file states its units; leave it out")
    values = KINDS[kind_name].read(text, file, *([] if units is None else [units]))
    if "name" not in values.entries:
        values.derive("name", printable(Path(file).stem, 40) or kind_name, "the name of the file")
    values.derive("description", f"{values.entries['name'].value}, from settings of {values.title}", "the file")
    origin = f"settings of {values.title}, {printable(Path(file).name, 60)}"
    return _machine_from_values(kind_name, values, origin)


def _machine_from_values(kind: str, values: Values, origin: str) -> ImportedMachine:
    for key in PROFILE_KEYS:
        if key.reported and key.default is not None and key.name not in values.entries:
            values.assume(key.name, key.default, key.why.removeprefix("estimate: ") or "leafcut's own default")
    sorted_values = tuple(values.entries[key.name] for key in PROFILE_KEYS if key.name in values.entries)
    text = profile_text(sorted_values, f"Machine profile from {origin}.")
    machine = machine_from_profile_text(text, values.file)
    return ImportedMachine(kind, values.title, machine, sorted_values, tuple(values.notes), text)


def profile_text(values: tuple[Value, ...], title: str) -> str:
    """Write a machine profile as TOML.

    A comment next to each value explains its origin, and the table ``[sources]`` repeats the source.
    """
    lines = [
        f"# {title}",
        "# taken: from the file; derived: from these values, or from the behaviour of the controller;",
        "# assumed: unknown, but likely; check it.",
        MACHINE.toml_line,
    ]
    tables = dict.fromkeys(value.key.rpartition(".")[0] for value in values)
    for table in sorted(tables, key=bool):  # values without a table come first
        lines.append("")
        if table:
            lines.append(f"[{table}]")
        for value in values:
            if value.key.rpartition(".")[0] == table:
                lines.append(f"# {value.how}: {_printable_comment(value.source)}")
                lines.append(f"{value.key.rpartition('.')[2]} = {toml_value(value.value)}")
    sourced = [value for value in values if value.key not in ("name", "description")]
    lines += [
        "",
        "[sources]",
        *(f"{toml_value(value.key)} = {toml_value(_printable_comment(value.source_text))}" for value in sourced),
    ]
    return "\n".join(lines) + "\n"


def _printable_comment(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)


def values_of_profile(data: Mapping[str, Any]) -> tuple[Value, ...]:
    """List the values of a loaded machine profile with their sources."""
    sources = data.get("sources", {})
    values = []
    for key in PROFILE_KEYS:
        table = data.get(key.table, {}) if key.table else data
        if key.key in table:
            source = str(sources.get(key.name, "the profile"))
            estimate = source.startswith("estimate")
            reason = source.removeprefix("estimate").lstrip(": ") or "no source"
            values.append(
                Value(
                    key.name,
                    table[key.key],
                    ValueOrigin.ASSUMED if estimate else ValueOrigin.TAKEN,
                    reason if estimate else source,
                )
            )
    return tuple(values)


def change_profile_values(name_or_path: str, changes: Mapping[str, tuple[Any, str]], place: str) -> str:
    """Change values of a machine profile and their sources, and return the new profile as TOML.

    Error messages use `place` as the name of the file to be written.

    Raises
    ------
    OptionError
        The machine does not exist, or a value is invalid.
    """
    data = load_profile_values(name_or_path)
    values = {value.key: value for value in values_of_profile(data)}
    for key, (value, source) in changes.items():
        values[key] = Value(key, value, ValueOrigin.DERIVED, source)
    sorted_values = tuple(values[key.name] for key in PROFILE_KEYS if key.name in values)
    text = profile_text(
        sorted_values, f"Machine profile {data.get('name', name_or_path)}, fitted by leafcut machine check."
    )
    machine_from_profile_text(text, place)
    return text
