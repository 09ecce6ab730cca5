"""Blocks of foreign programs, one by one: all words of RS274/NGC and Fanuc, and what to do with the others.

A block that makes sense, but whose doing is not known here, becomes a row FOREIGN: it is kept where it is, word for
word, and the axes that it may have moved are not known until they are programmed again. A block that makes no sense is
a `BlockError`.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

from leafcut.gcode.canned import end_cycle
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.foreign_state import ForeignState, named_axes
from leafcut.gcode.interpreter import Reader
from leafcut.gcode.modal import GROUP_OF, M_GROUP_OF, OUTPUT_CODES, PAUSE, SortedBlock, sort_words
from leafcut.gcode.motion import run_home
from leafcut.gcode.origin import chooses_origin, run_origin
from leafcut.gcode.saying import may_stop, obeyed_among
from leafcut.gcode.state import AXES, whole
from leafcut.gcode.torch import lower_feed
from leafcut.gcode.words import Block, BlockError, UnclearBlock, Word
from leafcut.model.cycles import PECKING
from leafcut.model.toolpath import STILL, UNKNOWN, Kind

#: G codes in tenths that turn, scale, mirror or wrap all that follows, and those that end it.
#: After G66 a macro runs at every move, rapids included.
_TRANSFORMS = {
    160: 150, 510: 500, 511: 501, 660: 670, 661: 670, 680: 690, 682: 690, 121: 131, 1120: 1130, 70: 80, 434: 490,
    435: 490,
}  # fmt: skip
#: G codes in tenths that are not understood, but choose no motion: one-shots, limits, accuracy, more work offsets.
_NO_MOTION = frozenset({
    80, 90, 110, 220, 221, 230, 231, 250, 260, 350, 360, 370, 480, 600, 620, 630, 650, 1030, *range(1100, 1300, 10),
    1530, 1540, 1870, 1880,
})  # fmt: skip
_ENDS_TRANSFORM = frozenset(_TRANSFORMS.values()) - {490}
#: Of these, G8 (lathes: radius mode) alone is a word of LinuxCNC; it refuses the others (seen with rs274).
_NOT_LINUXCNC = (_NO_MOTION | _ENDS_TRANSFORM) - {80}
_MOTIONS = frozenset({0, 10, 20, 30})
#: Cycles that `model.cycles` knows; G76, G87 and G88 wait for a person or move aside at the bottom.
_CYCLES = frozenset({730, 810, 820, 830, 840, 850, 860, 890})
#: Those of LinuxCNC that take P, and Q.
_TAKES_P, _TAKES_Q = frozenset({74, 76, 82, 84, 86, 88, 89}), frozenset({73, 76, 83})
#: M words that call a program elsewhere, or may; M72 brings back modes that were stored, M73 at the end of a call.
_CALLS = frozenset({197, 198, 72})
_JUMPS_ON_SIGNAL = 96
_RESTORES_LATER = 73
#: What Fagor has in parentheses beside remarks: statements that do something, and those that go elsewhere in the text.
_FAGOR_STATEMENT = re.compile(r"P[ \t]*[0-9]+[ \t]*=|(?:CALL|PCALL|MCALL|PROBE|DIGIT|ERROR|OPEN|WRITE|DGWZ)\b", re.I)
_FAGOR_JUMP = re.compile(r"(?:GOTO|RPT|IF|SUB|RET|WHILE|ENDIF|ENDWHILE)\b", re.I)
_FAGOR_MESSAGE = re.compile(r"MSG\b", re.I)
#: A block with a number that is not known is understood as far as its words are of these groups, and the number of
#: these letters.
_CLEAR_GROUPS = frozenset(
    {"motion", "cycle", "plane", "distance", "arc distance", "feed mode", "units", "retract", "radius", "path",
     "length", "offset", "non-modal"}
)  # fmt: skip
_CLEAR_LETTERS = frozenset("ABCDFHIJKLPQRSUVWXYZ")
_OF_MACHINE = "only the machine knows the numbers in it"
_OTHER_AXES = ("A", "B", "C", "U", "V", "W")
_ALL = (True, True, True)
_NONE = (False, False, False)
_PROBES = (382, 383, 384, 385)
#: More rows than this are no program, but a slip in a repeat, and would fill the memory.
MAX_ROWS = 10_000_000


#: LinuxCNC, in which G70 and G71 are cycles of a lathe, and not units (seen with rs274).
_LINUXCNC = frozenset({"linuxcnc", "plasma", "qtplasmac"})


def _codes(dialect: Dialect) -> frozenset[int]:
    """Return the G codes, in tenths, whose meaning in a dialect is known."""
    if dialect.cycle_words == "fagor":
        return dialect.g_codes
    # Haas has bolt circles there, and G69 is the end of a rotation nearly everywhere.
    lathe_cycles = dialect.groups == "fanuc" or dialect.family in _LINUXCNC
    other = {690, 700, 710} if lathe_cycles else {690}
    return frozenset(GROUP_OF) - (other - dialect.g_codes)


def _is_malformed(words: tuple[Word, ...]) -> bool:
    """Return whether a block has a G or M word twice, or N or O behind another word, which LinuxCNC refuses."""
    codes = [(word.letter, word.value) for word in words if word.letter in "GM"]
    letters = [word.letter for word in words]
    numbered = letters[0] == "N"
    return "N" in letters[1:] or "O" in letters[1 + numbered :] or len(set(codes)) < len(codes)


def _probes(words: SortedBlock) -> bool:
    """Return whether a block moves until a probe trips: G38.2 to G38.5, and G31 on Fanuc and Mach."""
    return words.g.get("motion") in _PROBES or any(str(w) == "G31" for w in words.unknown or ())


class BlockRunner(Reader):
    """Carries out the blocks of a foreign program.

    After `run`: `unclear` says what is not understood, and which axes are then not known; `unknown` holds the words
    that are not, `obeyed` the comments that a controller acts on; `named` is the word that tells a stop or a reference
    point from others like it; `refused` says that LinuxCNC refuses the block, whatever it means; `reason` says why the
    block must stay as it is ("" when it need not); `call` is the subprogram that it calls and how often; `returns` says
    that it ends one (M99).
    """

    state: ForeignState

    def __init__(self, state: ForeignState) -> None:
        super().__init__(state)
        self.state = state
        self.reason = ""
        self.unknown: tuple[Word, ...] = ()
        self.obeyed: list[str] = []
        self.named = ""
        self.call: tuple[int | None, int] | None = None
        self.returns = False
        #: The N-number at which a subprogram begins that the block calls (M97), or to which it jumps (M99 P).
        self.label: int | None = None
        #: Who may have changed anything, and whether that goes elsewhere in the text.
        self.opaque = ""
        self.jumps = self.restores = self.refused = False
        #: Whether a subprogram begins with the next block, so that it may bear a program number.
        self.begins = False
        self._g, self._m = _codes(state.dialect), frozenset(M_GROUP_OF) - OUTPUT_CODES - {PAUSE}
        # Of another CAM's program M3 and M4 are two things: in a laser the power follows the speed or does not.
        self._turning = {3: 1, 4: -1, 5: 0}
        self.unclear: list[tuple[str, tuple[bool, bool, bool]]] = []

    def run(self, block: Block) -> None:
        """Carry out one block."""
        self.reason, self.call, self.returns, self.unclear = "", None, False, []
        self.unknown, self.obeyed = (), obeyed_among(block.comments)
        self.label, self.opaque, self.jumps, self.restores, self.named = None, "", False, False, ""
        self.refused = False
        if block.percent is not None:
            self._percent(block.percent)
            return
        if block.deleted:
            self.reason = "a switch of the machine may skip it"
        if self.obeyed:
            stops = may_stop(self.obeyed)
            self.reason = "its comment may stop the program" if stops else "it shows a message or writes a record"
        self.state.line = block.line
        if block.comments and self.state.dialect.cycle_words == "fagor":
            self._statements(block.comments)
        if block.words:
            self._run_words(block)

    def _run_words(self, block: Block) -> None:
        state = self.state
        self.refused = state.dialect.family in _LINUXCNC and _is_malformed(block.words)
        macro = next((w for w in block.words if w.letter == "G" and w.value == 65.0), None)
        if macro is not None:
            # The other words are the macro's, and mean what it makes of them.
            self._blocks, self.opaque = self._blocks + 1, str(macro)
            return
        unknown = {word.letter for word in block.words if math.isnan(word.value)}
        if unknown:
            block = replace(block, words=tuple(w for w in block.words if not math.isnan(w.value)))
        words = self._sorted(block)
        letters = words.letters
        letters.pop("N", None)
        if "O" in letters:
            self._program_number(whole(letters.pop("O")))
        self._blocks += 1
        self._subprograms(words)
        self._note_refused(words)
        self.unknown = tuple(words.unknown or ())
        if unknown:
            self.reason = _OF_MACHINE
            if unknown != {"F"}:
                self._run_unknown(words, unknown)
                return
            state.unsure.add("feed")
        self._settings(words)
        self._tool_words(words)
        off_last = state.dialect.off_after_motion
        self._switches(words, off=None if not off_last else False)
        self._modes(words)
        self._act(words)
        if off_last:
            self._switches(words, off=True)
        self._stop(words.m.get("stop"))
        stops = [99] if self.returns else words.m.get("stop", [])
        self.named = next((f"M{code}" for code in stops if code > 1), self.named)
        if len(state.path) > MAX_ROWS:
            raise BlockError(f"the program comes to more than {MAX_ROWS:,} moves")

    def _statements(self, comments: tuple[str, ...]) -> None:
        """Note what of the comments of a Fagor is none."""
        for comment in comments:
            if _FAGOR_JUMP.match(comment):
                self.jumps = True
            elif _FAGOR_STATEMENT.match(comment):
                self.opaque = f"({comment[:20]})"
            elif _FAGOR_MESSAGE.match(comment):
                self.reason = "it shows a message or writes a record"

    def _run_unknown(self, words: SortedBlock, unknown: set[str]) -> None:
        """Carry out what is known of a block whose numbers of some letters are not; a row FOREIGN takes its place."""
        state, g = self.state, words.g
        named = named_axes({**words.letters, **dict.fromkeys(unknown, Word("", 0.0, ""))})
        clear = unknown <= _CLEAR_LETTERS and g.keys() <= _CLEAR_GROUPS and not words.unknown
        if self.opaque or not clear or "tool change" in words.m or g.get("non-modal", 40) not in (40, 530, 280, 300):
            self.opaque = self.opaque or _OF_MACHINE
            return
        if "F" in unknown:
            state.unsure.add("feed")
        if "S" in unknown:
            state.unsure.add("speed")
        g.pop("path", None)
        if g.get("non-modal") == 40:
            g.pop("non-modal")
        self._settings(words)
        self._tool_words(words)
        self._switches(words, off=None)
        self._modes(words)
        self._choose_motion(g)
        if state.cycle is not None:
            end_cycle(state)
            state.motion, state.foreign_motion = None, "a cycle with numbers that only the machine knows"
        if "offset" in g:
            state.choose_frame(g["offset"])
        if "length" in g or (unknown & set("HD")):
            state.register, named = -state.line, (*named[:2], True)
            state.offset_on = True
        place = tuple(UNKNOWN if gone else p for p, gone in zip(state.path.position, named, strict=True))
        state.path.set_place(Kind.FOREIGN, (place[0], place[1], place[2]), 0, state.line)
        if any(named):
            state.path.initial_plane = None
        self._stop(words.m.get("stop"))

    def lose_all(self, who: str) -> None:
        """Add a row FOREIGN after which nothing is known."""
        state = self.state
        state.forget(who)
        state.path.set_place(Kind.FOREIGN, (UNKNOWN, UNKNOWN, UNKNOWN), 1, state.line)

    def check_end(self, file: str) -> None:
        """Accept any end: many programs have none."""

    def _percent(self, rest: str) -> None:
        if self._blocks or self._percents:
            self.ended = True
        self._percents = 1

    def _sorted(self, block: Block) -> SortedBlock:
        # G80 beside G0 to G3 is in the safe start line of most posts, and means one thing only.
        separate = self._separate or any(w.letter == "G" and w.value == 80 for w in block.words)
        return sort_words(block, self._g, self._m, separate, keep_unknown=True)

    def _note_refused(self, words: SortedBlock) -> None:
        """Note what LinuxCNC refuses (seen with rs274), though what is meant is clear."""
        state = self.state
        if state.dialect.family not in _LINUXCNC:
            return
        starts = words.g.get("radius", 400) != 400
        again = starts and state.radius != 40
        strange = any(round(word.value * 10) in _NOT_LINUXCNC for word in words.unknown or () if word.letter == "G")
        # G94 and G95 forget F, also where they say nothing new.
        state.feed_forgotten = "F" not in words.letters and (
            state.feed_forgotten or words.g.get("feed mode") in (940, 950)
        )
        lacks_feed = (state.feed_forgotten or state.feed_said == 0.0) and "F" not in words.letters
        inverse = words.g.get("feed mode", 10 * state.feed_mode) == 930
        unfed = ("F" not in words.letters if inverse else lacks_feed) and self._feeds(words)
        # Radius compensation allows no other plane, length or work offset, or return of cycles.
        changed = not words.g.keys().isdisjoint(("length", "offset", "retract"))
        changed |= words.g.get("plane", 10 * state.plane) != 10 * state.plane
        torn = (changed or (starts and "L" in words.letters)) and (starts or state.radius in (41, 42))
        two = "motion" in words.g and words.g.get("non-modal") in (280, 300)  # both would use the words of the axes
        self.refused |= again or strange or unfed or torn or two or self._has_spare_words(words)

    def _has_spare_words(self, words: SortedBlock) -> bool:
        """Return whether a cycle is given a P or a Q that it does not use."""
        cycle, letters = words.g.get("cycle", 10 * (self.state.cycle or 0)) // 10, words.letters
        others = words.unknown or words.m or not words.g.keys().isdisjoint(("non-modal", "path"))
        if cycle in (0, 80) or others:
            return False
        return ("P" in letters and cycle not in _TAKES_P) or ("Q" in letters and cycle not in _TAKES_Q)

    def _feeds(self, words: SortedBlock) -> bool:
        """Return whether a block chooses G1, or moves at feed."""
        state, g = self.state, words.g
        active = state.cycle if state.cycle is not None else state.motion
        chosen = g.get("cycle", g.get("motion", active))
        moving = not words.letters.keys().isdisjoint((*AXES, *_OTHER_AXES))
        return g.get("motion") == 10 or (moving and chosen not in (None, 0, 800))

    def _program_number(self, number: int) -> None:
        if self._blocks and not self.begins:
            raise BlockError(f"O{number}: another program starts before the end of the first")

    def _subprograms(self, words: SortedBlock) -> None:
        """Note calls and ends of subprograms, and the codes after which nothing is certain."""
        unknown, letters = words.unknown or [], words.letters
        for word in list(unknown):
            if word.letter != "M":
                continue
            if word.value in _CALLS:
                self.opaque = str(word)
            elif word.value == _JUMPS_ON_SIGNAL:
                self.jumps = True
            elif word.value == _RESTORES_LATER:
                self.restores = True
            elif word.value in (97, 98):
                times = whole(letters.pop("L"), 9_999) if "L" in letters else 1
                number = whole(letters.pop("P")) if "P" in letters else None
                if word.value == 98:
                    self.call = (number, times)
                else:
                    self.call, self.label = (None, times), number
                    self.jumps |= number is None
                unknown.remove(word)
            elif word.value in (99, 47):
                self.label = whole(letters.pop("P")) if "P" in letters else None
                self.returns = True
                unknown.remove(word)

    def _settings(self, words: SortedBlock) -> None:
        state, said = self.state, words.letters.get("F")
        unit, mode = state.unit, state.feed_mode
        if "S" in words.letters:
            state.unsure.discard("speed")
        super()._settings(words)
        if said is not None:
            state.feed_said = said.value
        elif state.feed_mode != mode:
            state.feed_said = 0.0
        elif unit is not None and state.unit is not None and unit != state.unit:
            state.feed_said *= unit / state.unit
        if "speed" in words.g:
            state.surface = words.g["speed"] == 960
            if state.surface:
                words.letters.pop("D", None)
                self._keep("constant surface speed (G96) is not understood", _NONE)

    def _tool_words(self, words: SortedBlock) -> None:
        state = self.state
        if state.dialect.length_offset == "D" and "T" in words.letters:
            self._split_tool(words.letters)
        if "tool change" in words.m and state.pending_tool is None and "T" not in words.letters:
            self._keep("M6 without a T before it", _NONE)
            state.tool = None
            del words.m["tool change"]
        super()._tool_words(words)
        if state.dialect.length_offset == "D" and state.offset_on and state.offset_number not in (None, state.register):
            state.register, state.path.position[2] = state.offset_number or 0, UNKNOWN

    def _split_tool(self, letters: dict[str, Word]) -> None:
        """Take T5.2 of a Fagor for T5 D2. Source: Fagor 8055, programming manual, 5.6.4."""
        tool, point, offset = letters["T"].text.partition(".")
        if point and offset.isdecimal() and tool.isdecimal():
            letters["T"] = Word("T", float(tool), tool)
            letters.setdefault("D", Word("D", float(offset), offset))

    def _change_tool(self, number: int) -> None:
        state = self.state
        state.path.tool(number, line=state.line)
        state.tool = number
        state.pending_tool = None if state.dialect.changes_by_hand else number

    def _switches(self, words: SortedBlock, off: bool | None) -> None:
        spindle = words.letters.get("$")
        if "spindle" in words.m and "speed" in self.state.unsure and 5 not in words.m["spindle"]:
            self._keep("its speed is not known", _NONE)
            self.state.spindle = self._turning[words.m.pop("spindle")[0]]
            words.letters.pop("$", None)
        super()._switches(words, off)
        if spindle is not None and spindle.value not in (0.0, -1.0):
            self._keep(f"{spindle}: another spindle is not understood", _NONE)

    def _hear(self, word: Word, letters: dict[str, Word]) -> None:
        """Let the output that lowers a torch's feed do so; its block stays as it is all the same."""
        state = self.state
        if state.dialect.torch is not None and word.value == 52:
            state.adaptive = "P" not in letters or letters["P"].value != 0.0
        elif word.value in (67, 68) and {"E", "Q"} <= letters.keys():
            lower_feed(state, whole(letters["E"]), letters["Q"].value)

    def _modes(self, words: SortedBlock) -> None:
        state, g, letters = self.state, words.g, words.letters
        radius = g.pop("radius", None)
        path = g.pop("path", None)
        state.unsure -= g.keys()
        if g.get("non-modal") == 40 and not self._tells_dwell(letters):
            g.pop("non-modal")
        super()._modes(words)
        if radius is not None:
            mode = radius // 10
            register = letters.pop("D", None) if mode != 40 else None
            if radius in (411, 421):
                letters.pop("L", None)
            if mode != state.radius or register is not None:
                state.radius = mode
                state.path.radius(mode, 0.0 if register is None else register.value, line=state.line)
        if path is not None:
            said = [letters.pop(letter, None) if path == 640 else None for letter in "PQ"]
            tolerance, joining = (0.0 if word is None else state.length(word) for word in said)
            # Without Q, P is for short moves, too. Source: LinuxCNC, G64; seen with rs274.
            joining = tolerance if said[1] is None else joining
            if (path, tolerance, joining) != (state.blending, state.tolerance, state.joining):
                state.blending, state.tolerance, state.joining = path, tolerance, joining
                state.path.blending(path, tolerance, joining, line=state.line)

    def _tells_dwell(self, letters: dict[str, Word]) -> bool:
        """Return whether a dwell says its time as its controller has it; else its words are taken away.

        Fanuc, Haas and Mach take X as well, or U, in seconds; what has no point may be thousandths.
        """
        dialect = self.state.dialect
        given = [letter for letter in "PXUFSK" if letter in letters]
        if not given:
            return True
        if dialect.dwell_letter in given:
            word = letters[dialect.dwell_letter]
            if dialect.dwell_unit not in ("ms", "cs") or "." not in word.text:
                return True
        word = letters.pop(dialect.dwell_letter if dialect.dwell_letter in given else given[0])
        if word.letter in "XU" and "." in word.text and word.value >= 0.0 and dialect.groups == "fanuc":
            self.state.path.dwell(word.value, line=self.state.line)
        else:
            self._keep(f"how long it dwells with {word} is not known", _NONE)
        return False

    def _act(self, words: SortedBlock) -> None:
        """Offsets and motion; when it is not clear what they do, one row FOREIGN takes their place."""
        state, path = self.state, self.state.path
        named = named_axes(words.letters)
        rows, arcs, place = len(path), len(path.arcs), tuple(path.position)
        probing = state.feed if named[2] and _probes(words) and state.feed_mode == 94 else 0.0
        try:
            self._unknown_words(words, named)
            self._offsets(words)
            self._motion(words)
        except UnclearBlock as problem:
            self._keep(str(problem), _ALL if state.cycle is not None else named)
        if words.letters and not words.unknown and not self.unclear and not self.opaque:
            self._keep(f"{next(iter(words.letters.values()))} has no meaning in this block", named)
        if not self.unclear:
            return
        path.cut_back(rows, arcs)
        state.length_row = -1
        lost = [any(axes[axis] for _, axes in self.unclear) for axis in range(3)]
        after = [UNKNOWN if gone else p for p, gone in zip(place, lost, strict=True)]
        if any(lost):
            path.initial_plane = None
        stays = not any(lost) and not any(named) and not words.g
        path.set_place(Kind.FOREIGN, (after[0], after[1], after[2]), STILL if stays else 0, state.line, probing)
        if words.g.get("length") == 432:
            state.take_dynamic_length()
        self.reason = self.unclear[0][0]

    def _keep(self, reason: str, lost: tuple[bool, bool, bool]) -> None:
        """Note why this block is to be kept as it is, and which axes are then not known."""
        self.unclear.append((reason, lost))

    def _unknown_words(self, words: SortedBlock, named: tuple[bool, bool, bool]) -> None:
        state = self.state
        for word in words.unknown or ():
            if word.letter == "M":
                self._keep(f"{word} is not understood", named)
                if word.value == 61 and "Q" in words.letters:
                    state.tool = whole(words.letters["Q"], 99_999)
                self._hear(word, words.letters)
                continue
            code = round(word.value * 10)
            if code in _ENDS_TRANSFORM and not any(named):
                if state.transform:
                    state.transform = 0
                    state.move_origin(_ALL)
                continue
            if code in _TRANSFORMS:
                state.transform = code
            state.shift += 1
            if any(named) or code not in _NO_MOTION:
                state.foreign_motion = str(word)
            self._keep(f"{word} is not understood", named if str(word) == "G31" and any(named) else _ALL)

    def _offsets(self, words: SortedBlock) -> None:
        """Tool length and work offset."""
        state, g = self.state, words.g
        length = g.get("length")
        off = state.dialect.length_offset_off
        if length == 490 or (length is not None and off == f"G{length // 10}"):
            state.set_register(0)
        elif length == 430:
            self._take_length(words.letters)
        elif length == 431:
            # The length is in the block: with Z, or with K in LinuxCNC before 2.4.
            for letter in ("X", "Y", "Z", "I", "J", "K"):
                words.letters.pop(letter, None)
            state.move_origin((True, True, True))
            state.take_dynamic_length()
        elif length is not None:
            state.shift += 1
            words.letters.pop("H", None)
            self._keep(f"G{length / 10:g} is not understood", (False, False, True))
        if "offset" in g:
            state.choose_frame(g["offset"])

    def _take_length(self, letters: dict[str, Word]) -> None:
        state = self.state
        number = state.offset_number if state.dialect.length_offset == "D" else state.tool
        if "H" in letters:
            number = whole(letters.pop("H"), 99_999)
        if number is None:
            raise UnclearBlock("G43 without H, and no tool was called")
        state.set_register(number)

    def _choose_motion(self, g: dict[str, int]) -> None:
        """Choose the motion or the cycle; those that are not understood are remembered by name."""
        state = self.state
        motion, cycle = g.get("motion"), g.get("cycle")
        if motion is None and cycle is None:
            return
        number = cycle if cycle not in (None, 800) else motion
        if number is not None and number not in (_MOTIONS | _CYCLES):
            end_cycle(state)
            state.motion, state.foreign_motion = None, f"G{number / 10:g}"
            state.cycle_said.clear()
            return
        was = state.cycle
        super()._choose_motion({key: g[key] for key in ("motion", "cycle") if key in g})
        if cycle == 800 and motion is not None:
            state.motion = motion // 10
        if self._separate and cycle == 800 and state.motion is None:
            state.foreign_motion = state.foreign_motion or "what was active before the cycle"
        else:
            state.foreign_motion = ""
        if state.cycle is None or (state.cycle != was and not self._separate):
            state.cycle_said.clear()

    def _move(self, words: SortedBlock) -> None:
        state, g, letters = self.state, words.g, words.letters
        moving = not letters.keys().isdisjoint(AXES)
        special = g.get("non-modal")
        if special is not None and chooses_origin(special):
            if "motion" in g and g["motion"] != 0 and moving:
                raise BlockError(f"G{special / 10:g} and a motion in one block, and only one set of axes")
            run_origin(state, special, letters)
            return
        other = next((letter for letter in _OTHER_AXES if letter in letters), None)
        if other is not None:
            state.note_axis(other)
            raise UnclearBlock(f"the axis {other} is not understood")
        if state.transform and moving:
            raise UnclearBlock(f"G{state.transform / 10:g} is active, which is not understood")
        # G28 and G30 move in rapid, whatever motion is active.
        home = special in (280, 300) and "motion" not in g
        if state.foreign_motion and not home and (moving or "motion" in g or g.get("cycle", 800) != 800):
            raise UnclearBlock(f"{state.foreign_motion} is not understood")
        self._be_sure(moving)
        if special == 530 and not moving:
            raise UnclearBlock("G53 without an axis")
        if special in (280, 300):
            self._run_home(g, letters)
            return
        repeat = letters.get(state.dialect.repeat_letter)
        if (
            state.cycle is not None
            and repeat is not None
            and repeat.value == 0.0
            and ("X" in letters or "Y" in letters)
        ):
            raise UnclearBlock(f"{repeat}: whether the tool goes to a place where nothing is drilled")
        if special == 530 and self._separate and state.motion is None:
            state.motion = 0
        if state.cycle is not None:
            self._say_cycle(letters)
            self._run_cycle(words)
        else:
            super()._move(words)
        if state.cycle == 84 and state.cycle_words.dwell is None and state.last_dwell and not self._separate:
            self.reason = "the tap dwells as a cycle before it does"

    def _run_cycle(self, words: SortedBlock) -> None:
        """Run a hole of a cycle; where it is not understood, neither are those that go on with it."""
        state, fagor = self.state, self.state.dialect.cycle_words == "fagor"
        spare = {state.dialect.repeat_letter, "K" if fagor else "", "I" if fagor else ""}
        other = next((w for w in "IJKDE" if w in words.letters and w not in spare), None)
        try:
            if other is not None and state.dialect.groups == "fanuc":
                raise UnclearBlock(f"G{state.cycle} with {words.letters[other]} is not understood")
            super()._move(words)
        except UnclearBlock:
            name = f"G{state.cycle}"
            if other is not None or (name in PECKING and state.cycle_words.peck is None):
                end_cycle(state)
                state.motion, state.foreign_motion = None, name
            raise

    def _be_sure(self, moving: bool) -> None:
        """Refuse to move by modes that are not known.

        Raises
        ------
        UnclearBlock
            One of them matters to the move.
        """
        state = self.state
        if not state.unsure or not moving:
            return
        needed = {"distance": "G90 or G91"}
        if state.cycle is not None:
            needed |= {"plane": "which plane", "retract": "G98 or G99"}
        elif state.motion is not None and state.motion >= 2:
            needed |= {"plane": "which plane"}
        for name, words in needed.items():
            if name in state.unsure:
                raise UnclearBlock(f"{words} is active is not known")

    def _run_home(self, g: dict[str, int], letters: dict[str, Word]) -> None:
        if self.state.cycle is not None or g.get("motion", 0) != 0:
            raise BlockError("G28 or G30 with another motion active; G80 is missing before it")
        self.named = " ".join([f"G{g['non-modal'] // 10}", *(str(letters.pop(p)) for p in "P" if p in letters)])
        run_home(self.state, letters)

    def _say_cycle(self, letters: dict[str, Word]) -> None:
        """Remember the words of the cycle as they are written."""
        kept = "ZIKB" if self.state.dialect.cycle_words == "fagor" else "RZPQ"
        for letter in kept:
            if letter in letters and letter != self.state.dialect.repeat_letter:
                self.state.cycle_said[letter] = letters[letter].value
