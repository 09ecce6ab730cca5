"""G-code dialects of controllers.

A dialect is a TOML file. The shipped dialects are in `dialects/`, with a source for every value. Installed packages
(`leafcut.dialects`) can add dialects, and users can write their own file.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass, field, fields, replace
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

from leafcut.errors import DataError, OptionError, name_suggestion, printable
from leafcut.files.plugins import PluginKind, entry_point_file
from leafcut.files.schemas import DIALECT
from leafcut.files.toml_table import TomlTable
from leafcut.files.whole_files import key_place, parse_toml, read_toml_text
from leafcut.gcode.word_groups import GROUP_OF, M_GROUP_OF
from leafcut.message import Message
from leafcut.model.kinds import CutMethod

_CYCLES = ("G81", "G82", "G83", "G73", "G84", "G85")
#: Limits for the value of each key, as arguments of the methods of `TomlTable`. With fewer decimals, the verification
#: of a program would fail.
_LIMITS: dict[str, dict[str, Any]] = {
    "max_line": {"lowest": 40, "highest": 10_000},
    "decimals_mm": {"lowest": 2, "highest": 6},
    "decimals_inch": {"lowest": 3, "highest": 7},
} | {
    key: {"choices": choices}
    for key, choices in {
        "language": ("g-code", "sinumerik", "klartext"),
        "groups": ("rs274", "fanuc"),
        "percent": ("", "frame", "title"),
        "units_mm": ("G21", "G71", "G710", ""),
        "units_inch": ("G20", "G70", "G700", ""),
        "comments": ("()", ";"),
        "cycles": _CYCLES,
        "cycle_words": ("rs274", "fagor", "siemens", "klartext"),
        "dwell_cycles": _CYCLES,
        "dwell_unit": ("s", "ms", "point", "cs"),
        "tool_change": ("M6", "pause", "M0"),
        "stop_word": ("M0", "M226"),
        "length_offset": ("H", "D", "edge", ""),
        "length_offset_off": ("G49", "G44", "D0", ""),
        "machine_move": ("G53", "G28", "SUPA", ""),
        "end_word": ("M2", "M30", ""),
        "end_required": ("", "word", "percent"),
        "line_ends": ("", "lf", "any"),
        "torch.cuts": tuple(CutMethod),
        "torch.heights": ("program", "controller", "none"),
        "torch.compensation": ("", "G41", "G41.1"),
        "torch.probe": ("", "G38.2"),
    }.items()
}

#: Pattern that a text must match, and its description.
_PATTERNS = {
    "extension": (r"\.[A-Za-z0-9]{1,8}", Message("a dot and up to eight letters and digits, such as .nc")),
    "dwell_letter": (r"[A-Z]", Message("a capital letter")),
    "repeat_letter": (r"[A-Z]?", Message("a capital letter, or empty")),
    "description": (r".+", Message("a string")),
}

#: Values that some keys must have in a language, because its writer and reader do not support other values.
_REQUIRED = {"klartext": {"end_word": "M30", "stop_word": "M0"}, "sinumerik": {"length_offset": "edge"}}

#: Placeholders for the beam power and the material number in the words of a torch.
POWER, NUMBER = "{power}", "{number}"
_PLACES = {"on": POWER, "mark_on": POWER, "material": NUMBER}


@dataclass(frozen=True)
class Torch:
    """Describes how a controller drives a torch or a laser beam: the table ``[torch]`` of a dialect.

    Attributes
    ----------
    on, off
        Words that switch the torch on and off. ``{power}`` is replaced by the power.
    mark_on, mark_off
        Words for the scribe, or for the torch at marking power; empty if the machine cannot mark.
    mark_tool
        Tool number of the scribe. The tool table of the controller holds its X and Y offset from the torch (tool 0).
        None if the marker has no offset.
    cuts
        Supported processes: ``plasma``, ``laser``, ``oxyfuel``, ``waterjet``.
    heights
        Who moves Z: ``program``, ``controller`` (which probes, pierces and holds the height), or ``none``.
    waits
        Whether the program contains the pierce delay (G4). Otherwise, the controller adds it.
    power
        Whether S sets the beam power, and S0 switches the beam off while the head keeps moving.
    dark_rapids
        Whether the controller switches the beam off in every rapid, regardless of S.
    arc_output, height_output
        Digital outputs (M62 to M65) that keep the arc off during a move, and that hold the torch height; None if the
        controller lacks them.
    feed_output
        Analog output (M67, M68) that reduces the feed, in percent, while M52 P1 is active. With None, only F sets the
        feed.
    probe
        Word that probes downwards for the sheet; empty if the program does not probe.
    compensation
        ``G41.1``: D is the kerf width. ``G41``: D is a register of the controller. Empty: no compensation.
    material, material_feed
        Blocks that select material ``{number}`` from the controller's table, and the F word that uses its feed.
    material_comment
        Whether the controller reads the cutting parameters of the material from a comment.
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
        """The number of the M word that switches the torch on."""
        return int(next(word for word in self.on.split() if word.startswith("M"))[1:])

    @property
    def can_switch_off_along_path(self) -> bool:
        """Whether the program can switch the torch off and on again along a path without another pierce."""
        return self.power or self.arc_output is not None


@dataclass(frozen=True)
class Dialect:
    """Program format of a controller. Read-only; the shipped dialects are `gcode/dialects/*.toml`.

    Attributes
    ----------
    name, description, extension
        The extension includes the dot. The name of a dialect loaded from a file is the file name, ``my.toml``.
    family
        Name of the shipped dialect that this dialect is or is based on. Rules for that controller also apply to this
        dialect. Empty for an independent dialect.
    g_words, m_words
        All G and M words that both the controller and leafcut support, separated by spaces: ``"G0 G1 …"``.
    language
        ``g-code``; ``sinumerik``: the native language of Siemens controls; ``klartext``: Heidenhain Klartext, for
        drilling. In languages other than G-code, leafcut reads only its own programs.
    groups
        ``rs274``: a block cannot combine a cycle or G80 with G0–G3, and each new cycle restates its planes.
        ``fanuc``: cycles are a separate group, and their planes stay active until G80.
    percent
        ``frame``: percent signs in the first and last line. ``title``: a first line ``%NAME,MX,``. Empty: none.
    program_number
        Whether the program has an O word.
    comments
        ``()``: in parentheses. ``;``: from a semicolon to the end of the line.
    uppercase_comments
        Whether the panel displays capital letters only.
    line_numbers
        Whether blocks may be numbered (N10).
    one_command
        Whether every block starts with its only G or M word. The firmware would ignore a second G or M word.
    max_line
        Maximum line length, in characters.
    point_required
        Whether a length without a decimal point may mean thousandths. The point is then always written, and required
        when a program is read.
    opening
        Blocks before all others, for example to select the language.
    units_mm, units_inch
        Words that select the unit; without a word for inches, all programs are in millimetres.
    preamble
        Blocks between the units and the first move. They select the plane and absolute mode and cancel active modes.
    cycles
        Canned cycles of the controller, by their LinuxCNC and Fanuc names. Others are expanded into single moves.
    cycle_words
        ``rs274``: Z is the bottom, R the R plane, Q the peck. ``fagor``: Z is the R plane, I the bottom.
        ``siemens``: MCALL CYCLE81 (RTP, RFP, SDIS, DP) and similar. ``klartext``: CYCL DEF 200.
    dwell_cycles
        Cycles that accept a dwell.
    dwell_letter, dwell_unit
        Letter and unit of a dwell. ``s``: seconds. ``ms``: integer milliseconds. ``point``: seconds with a decimal
        point, otherwise milliseconds. ``cs``: integer hundredths of a second.
    repeat_letter
        Letter of the number of repeats of a cycle.
    tool_change
        ``M6``; ``pause``: T, then a stop for a manual tool change; ``M0``: the same in one block, M0 T1.
    stop_word
        Word that stops the program until the operator continues: ``M0``, or ``M226`` if M0, M1 and M2 end the program.
    rapid_feed
        Whether rapids also use the last F. G0 then states the rapid feed, and every cut after it restates its own feed.
    arc_turns
        Whether G2 and G3 accept the number of turns in P.
    corner_tolerance
        Whether G64 accepts the corner tolerance in P.
    rounding
        Whether the tool stops after every move with G61, and with G64 rounds corners as its acceleration requires.
    arc_ends
        Whether even a full circle states its end point.
    hand_change_pause
        Whether M6 may continue without waiting, so that a manual tool change needs an M0 after it.
    length_offset
        ``H``: G43 Hn. ``D``: Dn with the tool, and G43. ``edge``: D1, the first cutting edge of the tool. Empty: the
        program selects no length offset.
    machine_move
        Move in machine coordinates: ``G53``; ``G28`` to machine zero (G91 G28, then G90); ``SUPA`` with the length
        offset cancelled (D0). Empty: not available in programs.
    off_after_motion
        Whether M5 and M9 act after the motion of their block, not before it.
    end_word, end_required
        The last word; empty if the program ends with its text. Required: ``word`` (M2 or M30), ``percent`` (a word or a
        closing percent sign), or empty.
    notes
        Header lines about the machine settings that the program requires.
    obeyed_comments, obeyed_parameters
        Prefixes of comments, and names of parameters, that the controller treats as settings although its interpreter
        ignores them (`gcode.active_comments`).
    line_ends
        ``lf``: only a line feed ends a line, and a carriage return within a line is a space. ``any``: either character
        ends it. Empty: unknown.
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
        """Whether the program or the controller moves Z. This is False for a beam with a fixed head."""
        return self.torch is None or self.torch.heights != "none"

    @property
    def has_z_words(self) -> bool:
        """Whether programs contain Z words."""
        return self.torch is None or self.torch.heights == "program"

    @property
    def changes_by_hand(self) -> bool:
        """Whether the program stops for the operator to change the tool, instead of using M6."""
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


def dialect_names(torch: bool | None = None) -> list[str]:
    """Return the sorted names of all dialects.

    With `torch`, return only dialects with (True) or without (False) a torch.
    """
    names = sorted([*_shipped_names(), *(one.name for one in DIALECTS.plugins() if one.adds is not None)])
    return names if torch is None else [name for name in names if (load_dialect(name).torch is not None) == torch]


def dialect_names_and_descriptions() -> list[tuple[str, str]]:
    """Return the name and description of every dialect.

    If a plug-in is broken, its description is the error message.
    """
    known = [(name, load_dialect(name).description) for name in dialect_names()]
    return known + [(one.name, one.refusal) for one in DIALECTS.plugins() if one.adds is None]


def dialect_template(name: str) -> str:
    """Return a TOML template based on a shipped dialect.

    Raises
    ------
    OptionError
        No shipped dialect has this name.
    """
    if name not in _shipped_names():
        raise OptionError(
            "leafcut has no built-in dialect '{}'{}", name, name_suggestion(name, sorted(_shipped_names()))
        )
    text = re.sub(r"^base = .*\n", "", _read_shipped_file(name), flags=re.MULTILINE)
    about = f"# Save it as my.toml, change it, and run with --dialect my.toml. What it does not say is as in {name}."
    return f'{about}\nbase = "{name}"\n{text}'


def load_dialect(name: str) -> Dialect:
    """Return a dialect by its name, or by the path of a ``.toml`` file.

    Raises
    ------
    OptionError
        The name is unknown. The message suggests the nearest name.
    DataError
        The file is not a valid dialect.
    """
    if name.lower().endswith(".toml"):
        return _read_dialect(Path(name), Path(name).name)
    if name in _shipped_names():
        return _shipped_dialect(name)
    if name in DIALECTS.names():
        return DIALECTS.load(name)
    raise OptionError("unknown dialect '{}'{}", name, name_suggestion(name, dialect_names()))


def _read_dialect(path: Path, name: str) -> Dialect:
    return parse_dialect(read_toml_text(path), name, str(path))


@cache
def _shipped_names() -> frozenset[str]:
    return frozenset(
        entry.name.removesuffix(".toml") for entry in _dialect_folder().iterdir() if entry.name.endswith(".toml")
    )


#: Dialects of other packages. Each of them is a TOML file.
DIALECTS = PluginKind(
    "dialect",
    "leafcut.dialects",
    _shipped_names,
    lambda name, found: _read_dialect(entry_point_file(name, found), name),
    lambda one: one.description,
)


@cache
def _shipped_dialect(name: str) -> Dialect:
    return replace(parse_dialect(_read_shipped_file(name), name), family=name)


def parse_dialect(text: str, name: str, place: str = "") -> Dialect:
    """Parse a dialect from TOML. `place` names the file in messages.

    Raises
    ------
    DataError
        The text is not TOML, a key is unknown or missing, or a value is invalid.
    """
    place = place or Message("dialect {}", name)
    given = parse_toml(text, place, DIALECT)
    try:
        return _dialect_from_table(given, name)
    except DataError as problem:
        place = key_place(place, text, problem.table, problem.key)
        raise DataError("{}: {}", place, problem) from None


def _dialect_from_table(given: dict[str, Any], name: str) -> Dialect:
    base_name = given.pop("base", None)
    if base_name is not None and base_name not in _shipped_names():
        suggestion = name_suggestion(str(base_name)[:80], sorted(_shipped_names()))
        raise DataError("'base' is '{}'{}", printable(str(base_name)), suggestion).at(key="base")
    base = None if base_name is None else _shipped_dialect(base_name)
    for key in ("g_words", "m_words"):  # these texts may span several lines
        if isinstance(given.get(key), str):
            given[key] = " ".join(given[key].split())
    top = TomlTable(given, "", _field_names(Dialect))
    values = _table_values(top, Dialect, base)
    if "torch" in top:
        base_torch = None if base is None else base.torch
        torch = _table_values(top.table("torch", _field_names(Torch)), Torch, base_torch)
        values["torch"] = Torch(**torch) if base_torch is None else replace(base_torch, **torch)
    sources = top.table("sources", _field_names(Dialect))
    values["sources"] = ({} if base is None else base.sources) | {key: sources.text(key) for key in sources.values}
    dialect = Dialect(name=name, **values) if base is None else replace(base, name=name, **values)
    for place, message in _faults_of_words(dialect):
        table, _, key = place.rpartition(".")
        raise DataError("'{}' {}", place, message).at(table, key=key)
    return dialect


def _field_names(kind: type[Dialect | Torch]) -> list[str]:
    return [key.name for key in fields(kind) if key.name not in ("name", "family")]


def _table_values(table: TomlTable, kind: type[Dialect | Torch], base: Dialect | Torch | None) -> dict[str, Any]:
    """Return the values of a table without its nested tables.

    Without a base dialect, all required keys must be present.
    """
    read: dict[str, Callable[..., Any]] = {
        "str": table.text,
        "bool": table.flag,
        "int": table.integer,
        "tuple[str, ...]": table.texts,
    }
    values: dict[str, Any] = {}
    for key in fields(kind):
        read_value = read.get(str(key.type).removesuffix(" | None"))
        required = base is None and key.default is key.default_factory is MISSING and key.name != "name"
        if read_value is not None and (key.name in table or required):
            limits = _LIMITS.get(f"{table.section[0]}.{key.name}".lstrip("."), {})
            values[key.name] = read_value(key.name, **limits)
    return values


def _faults_of_words(dialect: Dialect) -> Iterator[tuple[str, Message]]:
    """Yield each key of a dialect with inconsistent words, and the error.

    Both the controller and leafcut must support every word that leafcut writes.
    """
    yield from _faults_of_texts(dialect)
    g_words, m_words = dialect.g_words.split(), dialect.m_words.split()
    for key, words, letter, known in (
        ("g_words", g_words, "G", {f"G{code / 10:g}" for code in GROUP_OF}),
        ("m_words", m_words, "M", {f"M{code}" for code in M_GROUP_OF}),
    ):
        for word in words:
            if word not in known:
                yield key, Message("has '{}', which is not a {} word that leafcut understands", printable(word), letter)
    known_words = {*g_words, *m_words}
    for key in ("units_mm", "units_inch", "end_word"):
        word = getattr(dialect, key)
        if word and word not in known_words:
            yield key, Message("is {}, which is not among the words of this dialect", word)
    written: dict[str, Any] = {"opening": dialect.opening, "preamble": dialect.preamble}
    if dialect.cycle_words == "rs274":
        written["cycles"] = dialect.cycles
    if dialect.torch is not None:
        yield from _faults_of_torch(dialect.torch)
        torch_words = vars(dialect.torch).items()
        written |= {f"torch.{key}": value for key, value in torch_words if key not in ("cuts", "compensation")}
    for key, value in written.items():
        for word in re.findall(r"[GM]\d[\d.]*", _joined_words(value)):
            if word not in known_words:
                yield key, Message("has {}, which is not among the words of this dialect", word)


def _faults_of_texts(dialect: Dialect) -> Iterator[tuple[str, Message]]:
    for key, (pattern, description) in _PATTERNS.items():
        text = getattr(dialect, key)
        if not re.fullmatch(pattern, text):
            yield key, Message("is '{}', but must be {}", printable(text), description)
    for key, value in _REQUIRED.get(dialect.language, {}).items():
        text = getattr(dialect, key)
        if text != value:
            yield key, Message("is '{}', but must be {} for the language {}", text, value, dialect.language)


def _joined_words(value: Any) -> str:
    return " ".join(value) if isinstance(value, list | tuple) else str(value)


def _faults_of_torch(torch: Torch) -> Iterator[tuple[str, Message]]:
    for key, wanted in (("on", "M3 M4"), ("off", "M5"), ("mark_on", "M3 M4"), ("mark_off", "M5")):
        words = getattr(torch, key)
        switches = [word for word in words.split() if word.startswith("M")]
        if not words and key.startswith("mark"):
            continue
        if len(switches) != 1 or switches[0] not in wanted.split():
            yield (
                f"torch.{key}",
                (
                    Message("must have the word M3 or M4, and no other M word")
                    if key in ("on", "mark_on")
                    else Message("must have the word M5, and no other M word")
                ),
            )
    for key, value in vars(torch).items():
        text = _joined_words(value)
        rest = text.replace(_PLACES[key], "") if key in _PLACES else text
        if "{" in rest or "}" in rest:
            yield (
                f"torch.{key}",
                Message(
                    "has a brace; braces are allowed only in {} (keys on and mark_on) and in {} (key material)",
                    POWER,
                    NUMBER,
                ),
            )
    if (POWER in torch.on) != torch.power:
        yield "torch.on", Message("must contain {} if power = true, and must not contain it otherwise", POWER)


def _read_shipped_file(name: str) -> str:
    text: str = (_dialect_folder() / f"{name}.toml").read_text(encoding="utf-8")
    return text


def _dialect_folder() -> Any:
    return files("leafcut.gcode") / "dialects"
