"""Dialects: what each controller's G-code is like, as data.

One TOML file each in the folder `dialects/`, every value with its source; others by the path of their file, or of a
package that is installed (`leafcut.dialects`).

dialect("haas").cycles        ('G81', 'G82', 'G83', 'G73', 'G84', 'G85')
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

from leafcut.errors import DataError, OptionError, nearest, shown
from leafcut.files.plugins import PluginKind, file_of
from leafcut.files.schemas import DIALECT
from leafcut.files.whole_files import line_of, parse_toml, toml_bytes
from leafcut.gcode.dialect_checks import fault_of, faults_of_words


@dataclass(frozen=True)
class Torch:
    """How a controller drives a torch or the beam of a laser: the table ``[torch]`` of a profile.

    Attributes
    ----------
    on, off
        Words that light it and put it out; ``{power}`` stands for the power.
    mark_on, mark_off
        Words of a scribe, or of the torch at marking power; empty: it cannot mark.
    mark_tool
        Tool of the scribe in the controller's table, with its offset in X and Y from the torch, which is tool 0; None:
        what marks is where the torch is.
    cuts
        Processes that it can cut with: ``plasma``, ``laser``, ``oxyfuel``, ``waterjet``.
    heights
        Who moves Z: ``program``, ``controller`` (probing, piercing and height are its own), or ``none``.
    waits
        The program waits for the pierce (G4); else the controller does.
    power
        S is the power of the beam; S0 keeps it dark while the head moves on.
    dark_rapids
        The controller darkens the beam in every rapid, whatever S is.
    arc_output, height_output
        Digital output (M62 to M65) that keeps the arc off while the torch moves on, that holds the height; or None.
    feed_output
        Analog output (M67, M68) that lowers the feed, in percent while M52 P1 is on; or None: F says every feed.
    probe
        The word that goes down until the torch touches the sheet; empty: the program does not probe.
    compensation
        ``G41.1``: D is the width of the kerf. ``G41``: D is a register of the controller. Empty: none.
    material, material_feed
        Blocks that choose the material ``{number}`` of the controller's table, and the F word that then holds.
    material_comment
        The controller takes a comment with the figures of the material.
    finish
        Blocks before the end of the program.
    """

    on: str
    off: str
    mark_on: str = ""
    mark_off: str = ""
    mark_tool: int | None = None
    cuts: tuple[str, ...] = ("plasma",)
    heights: str = "program"
    waits: bool = True
    power: bool = False
    dark_rapids: bool = False
    arc_output: int | None = None
    height_output: int | None = None
    feed_output: int | None = None
    probe: str = ""
    compensation: str = ""
    material: tuple[str, ...] = ()
    material_feed: str = ""
    material_comment: bool = False
    finish: tuple[str, ...] = ()

    @property
    def on_code(self) -> int:
        """The number of the M word that lights it."""
        return _m_code(self.on)

    @property
    def darkens(self) -> bool:
        """Whether it can be dark for a while and go on, without a new pierce by the program."""
        return self.power or self.arc_output is not None


def _m_code(words: str) -> int:
    return int(next(word for word in words.split() if word.startswith("M"))[1:])


@dataclass(frozen=True)
class Dialect:
    """One controller's way to write a program. Read-only; the profiles are `gcode/dialects/*.toml`.

    Attributes
    ----------
    name, description, extension
        The extension has its dot. The name of one that was given as a file is that of the file, ``my.toml``.
    family
        The shipped dialect that it is, or is based on: what is known of that controller beyond its table holds for this
        one, too. Empty: it stands on its own.
    g_words, m_words
        Every G and M word that the controller has and leafcut understands, in words: ``"G0 G1 …"``.
    language
        ``g-code``. ``sinumerik``: the own language of Siemens controls. ``klartext``: Heidenhain's plain language, for
        drilling. Of any but G-code leafcut reads only what it writes itself.
    groups
        ``rs274``: cycles and G80 exclude G0–G3 in a block, and each new cycle states its planes again.
        ``fanuc``: cycles are a group of their own, and their planes stay until G80.
    percent
        ``frame``: a percent sign first and last. ``title``: a first line ``%NAME,MX,``. Empty: none.
    program_number
        The program has an O word.
    comments
        ``()``: in parentheses. ``;``: from a semicolon to the end of the line.
    uppercase_comments
        The panel shows capital letters only.
    line_numbers
        Blocks may be numbered (N10).
    one_command
        A block is one G or M word, stated first and in every block, with its other words behind it: of two in a block
        the firmware would obey one.
    max_line
        Longest line, in characters.
    decimals_mm, decimals_inch
        Decimals of lengths and feeds.
    point_required
        A length without a decimal point may mean thousandths: always written, and refused when read.
    opening
        Blocks before all others, such as the one that chooses the language.
    units_mm, units_inch
        The words that choose the unit; without one for inches, programs are in millimetres only.
    preamble
        The blocks after the units and before the first move: plane, absolute, nothing active that may be left over.
    cycles
        Canned cycles that the controller has, by their LinuxCNC and Fanuc names. The others are written out.
    cycle_words
        ``rs274``: Z is the bottom, R the R plane, Q the peck. ``fagor``: Z is the R plane, I the bottom.
        ``siemens``: MCALL CYCLE81 (RTP, RFP, SDIS, DP) and its like. ``klartext``: CYCL DEF 200.
    dwell_cycles
        Cycles that take a dwell.
    dwell_letter, dwell_unit
        ``s``: seconds. ``ms``: milliseconds, whole. ``point``: seconds with a decimal point, else milliseconds.
        ``cs``: hundredths of a second, whole.
    dwell_x
        G4 takes seconds in X, too.
    repeat_letter
        Repeats of a cycle.
    tool_change
        ``M6``; ``pause``: T, then the stop, and a person changes the tool; ``M0``: the same in one block, M0 T1.
    stop_word
        What stops a program until a person goes on: ``M0``, or ``M226`` where M0, M1 and M2 end it.
    rapid_feed
        A rapid moves at the last F, too: G0 states the speed of rapids, and every cut behind it its own.
    arc_turns
        G2 and G3 take full turns in P.
    corner_tolerance
        G64 takes how far a corner may be cut short in P.
    rounding
        Under G61 the tool stands still after every move; under G64 it cuts corners as short as its acceleration needs.
    arc_ends
        A full circle, too, says where it ends.
    hand_change_pause
        M6 may go on without waiting, so a change by hand needs an M0 behind it.
    length_offset
        ``H``: G43 Hn. ``D``: Dn with the tool, and G43. ``edge``: D1, the first cutting edge of the
        tool. Empty: none that a program chooses.
    length_offset_off
        The word that takes the length offset off.
    machine_move
        How the axes go to machine coordinates: ``G53``, or ``G28`` for machine zero (G91 G28, then G90); ``SUPA``: with
        the length offset taken off (D0). Empty: programs cannot say it.
    off_after_motion
        M5 and M9 act after the motion of their block, not before.
    end_word, end_required
        The last word; empty: a program ends where its text ends. Required: ``word`` (M2 or M30), ``percent`` (that, or
        a closing percent sign), or empty.
    notes
        Lines for the header: what must be set on the machine for the program to mean what it says.
    obeyed_comments, obeyed_parameters
        How comments begin, and names of parameters, that are settings to the controller though its interpreter passes
        them by (`gcode.active_comments`).
    line_ends
        ``lf``: only a line feed ends a line, and a carriage return before anything else is a space. ``any``: each of
        the two ends it. Empty: not known.
    torch
        How it drives a torch or a beam, or None for a spindle.
    sources
        Where each value comes from, by key.
    """

    name: str
    description: str
    extension: str
    g_words: str
    m_words: str
    groups: str
    preamble: tuple[str, ...]
    cycles: tuple[str, ...]
    language: str = "g-code"
    percent: str = ""
    program_number: bool = False
    comments: str = "()"
    uppercase_comments: bool = False
    line_numbers: bool = True
    one_command: bool = False
    max_line: int = 255
    decimals_mm: int = 3
    decimals_inch: int = 4
    point_required: bool = False
    opening: tuple[str, ...] = ()
    units_mm: str = "G21"
    units_inch: str = "G20"
    cycle_words: str = "rs274"
    dwell_cycles: tuple[str, ...] = ("G82",)
    dwell_letter: str = "P"
    dwell_unit: str = "s"
    dwell_x: bool = False
    repeat_letter: str = "L"
    tool_change: str = "M6"
    stop_word: str = "M0"
    rapid_feed: bool = False
    hand_change_pause: bool = False
    arc_turns: bool = False
    corner_tolerance: bool = False
    rounding: bool = False
    arc_ends: bool = False
    length_offset: str = "H"
    length_offset_off: str = "G49"
    machine_move: str = "G53"
    off_after_motion: bool = False
    end_word: str = "M30"
    end_required: str = ""
    notes: tuple[str, ...] = ()
    obeyed_comments: tuple[str, ...] = ()
    obeyed_parameters: tuple[str, ...] = ()
    line_ends: str = ""
    torch: Torch | None = None
    sources: dict[str, str] = field(default_factory=dict, hash=False)
    family: str = ""

    @property
    def moves_z(self) -> bool:
        """Whether anybody moves Z, the program or the controller; a beam whose head keeps its height moves none."""
        return self.torch is None or self.torch.heights != "none"

    @property
    def states_z(self) -> bool:
        """Whether programs say heights; else Z is the controller's, or nobody's."""
        return self.torch is None or self.torch.heights == "program"

    @property
    def changes_by_hand(self) -> bool:
        """Whether a tool change is a stop at which a person changes it, not M6."""
        return self.tool_change != "M6"

    @property
    def has_machine_moves(self) -> bool:
        """Whether a program can send an axis to machine zero."""
        if self.machine_move == "SUPA":
            return True
        return 280 in self.g_codes if self.machine_move == "G28" else 530 in self.g_codes and bool(self.machine_move)

    @cached_property
    def g_codes(self) -> frozenset[int]:
        """The G words in tenths: G59.1 is 591."""
        return frozenset(round(float(word[1:]) * 10) for word in self.g_words.split())

    @cached_property
    def m_codes(self) -> frozenset[int]:
        """The M words as whole numbers."""
        return frozenset(int(word[1:]) for word in self.m_words.split())


def dialects(torch: bool | None = None) -> list[str]:
    """Return the names of all dialects, sorted; with `torch` only those that drive one, or only those that do not.

    Those of plug-ins are among them, but for what cannot be used.
    """
    names = sorted([*_shipped_names(), *(one.name for one in DIALECTS.plugins() if one.adds is not None)])
    return names if torch is None else [name for name in names if (dialect(name).torch is not None) == torch]


def dialect_list() -> list[tuple[str, str]]:
    """Return the names of all dialects with what they are; of a broken plug-in with its error."""
    known = [(name, dialect(name).description) for name in dialects()]
    return known + [(one.name, one.refusal) for one in DIALECTS.plugins() if one.adds is None]


def dialect_template(name: str) -> str:
    """Return the file of a shipped dialect as one that is based on it, to be saved and changed.

    Raises
    ------
    OptionError
        No dialect of that name is shipped.
    """
    if name not in _shipped_names():
        raise OptionError(f"no dialect '{name}' is shipped{nearest(name, sorted(_shipped_names()))}")
    text = re.sub(r"^base = .*\n", "", _content(name).decode("utf-8"), flags=re.MULTILINE)
    about = f"# Save it as my.toml, change it, and run with --dialect my.toml. What it does not say is as in {name}."
    return f'{about}\nbase = "{name}"\n{text}'


def dialect(name: str) -> Dialect:
    """Return the dialect of that name, or that of a ``.toml`` file by its path.

    Raises
    ------
    OptionError
        There is none (the nearest name is suggested), or its file says what no dialect can.
    """
    if name.lower().endswith(".toml"):
        return _of_file(Path(name), Path(name).name)
    if name in _shipped_names():
        return _shipped(name)
    if name in DIALECTS.names():
        return DIALECTS.load(name)
    raise OptionError(f"unknown dialect '{name}'{nearest(name, dialects())}")


def _of_file(path: Path, name: str) -> Dialect:
    return parse_dialect(toml_bytes(path), name, str(path))


@cache
def _shipped_names() -> frozenset[str]:
    return frozenset(entry.name.removesuffix(".toml") for entry in _folder().iterdir() if entry.name.endswith(".toml"))


#: Dialects of other packages: each is a TOML file.
DIALECTS = PluginKind(
    "dialect",
    "leafcut.dialects",
    _shipped_names,
    lambda name, found: _of_file(file_of(name, found), name),
    lambda one: one.description,
)


@cache
def _shipped(name: str) -> Dialect:
    return replace(parse_dialect(_content(name), name), family=name)


def parse_dialect(content: bytes, name: str, place: str = "") -> Dialect:
    """Return the dialect that a TOML text describes; `place` is its file, which messages begin with.

    Raises
    ------
    DataError
        The text is not TOML, a key is unknown or missing, or a value is none that a dialect can have.
    """
    place = place or f"dialect {name}"
    said = parse_toml(content, place, DIALECT)

    def refused(key: str, words: str) -> DataError:
        section, _, bare = key.rpartition(".")
        line = line_of(content.decode("utf-8", errors="replace"), section, bare)
        return DataError(f"{place}{f':{line}' if line else ''}: {words}")

    base = said.pop("base", None)
    if base is not None and base not in _shipped_names():
        words = nearest(str(base)[:80], sorted(_shipped_names()))
        raise refused("base", f"'base' is '{shown(str(base))}'{words}")
    for key in _TABLES:
        if key in said and not isinstance(said[key], dict):
            raise refused(key, f"'{key}' is not a table; write [{key}]")
    table = _on_base(said, base)
    _check_kinds(table, Dialect, "", refused)
    if "torch" in table:
        _check_kinds(table["torch"], Torch, "torch.", refused)
    known = _kinds(Dialect)
    for key in table.get("sources", {}):
        if key not in (*known, "torch") or not isinstance(table["sources"][key], str):
            raise refused(f"sources.{key}", f"'{shown(key)}' in [sources] is no key of a dialect with a text behind it")
    torch = {**_defaults(Torch), **table["torch"]} if "torch" in table else None
    for key, words in faults_of_words({**_defaults(Dialect), **table, "torch": torch}):
        raise refused(key, f"'{key}' {words}")
    table["torch"] = None if torch is None else Torch(**_frozen(torch))
    return Dialect(name=name, family=base or "", **_frozen(table))


#: The tables in the table of a dialect; of one that is based on another, what they do not say is that one's, too.
_TABLES = ("torch", "sources")


def _on_base(said: dict[str, Any], base: str | None) -> dict[str, Any]:
    """Return the table with all that it does not say from the shipped dialect `base`."""
    if base is None:
        return said
    below = parse_toml(_content(base), base, DIALECT)
    below = _on_base(below, below.pop("base", None))
    tables = {key: {**below.get(key, {}), **said.get(key, {})} for key in _TABLES if key in below or key in said}
    return {**below, **said, **tables}


def _kinds(of: type[Dialect] | type[Torch]) -> dict[str, Any]:
    """Return the keys that a file may have, and the types of their values; those of tables are left out."""
    return {key: kind for key, kind in get_type_hints(of).items() if key not in ("name", "family", *_TABLES)}


def _check_kinds(
    table: dict[str, Any], of: type[Dialect] | type[Torch], place: str, refused: Callable[[str, str], DataError]
) -> None:
    """Refuse a key that is unknown or missing, and a value that is not of its kind."""
    kinds = _kinds(of)
    known = [*kinds, *(_TABLES if of is Dialect else ())]
    for key, value in table.items():
        if key not in known:
            raise refused(place + key, f"unknown key '{shown(key)}'{nearest(key[:80], known)}")
        fault = "" if key in _TABLES else fault_of(place + key, value, _bare(kinds[key]))
        if fault:
            raise refused(place + key, f"'{place + key}' {fault}")
    for one in fields(of):
        if one.name in kinds and one.name not in table and one.default is one.default_factory is MISSING:
            raise refused(place.rstrip("."), f"'{place + one.name}' is missing")


def _defaults(of: type[Dialect] | type[Torch]) -> dict[str, Any]:
    """Return the values of the keys that need not be said."""
    return {one.name: one.default for one in fields(of) if one.default is not MISSING}


def _bare(kind: Any) -> Any:
    """Return the type of what may also be None: no file says that."""
    return (
        next((one for one in get_args(kind) if one is not type(None)), kind) if get_origin(kind) is UnionType else kind
    )


def _frozen(table: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}


def _content(name: str) -> bytes:
    content: bytes = (_folder() / f"{name}.toml").read_bytes()
    return content


def _folder() -> Any:
    return files("leafcut.gcode") / "dialects"
