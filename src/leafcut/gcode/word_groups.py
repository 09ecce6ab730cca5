"""Groups of words that exclude each other in a block (RS274/NGC section 3.4, table 4)."""

from __future__ import annotations

from dataclasses import dataclass, field

from leafcut.gcode.words import Block, BlockError, Word

#: Codes are in tenths, so that G59.1 is the whole number 591.
_GROUPS: dict[str, tuple[int, ...]] = {
    "non-modal": (40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923),
    "motion": (0, 10, 20, 30, 50, 51, 52, 53, 330, 331, 382, 383, 384, 385),
    "cycle": (690, 730, 760, 800, 810, 820, 830, 840, 850, 860, 870, 880, 890),
    "plane": (170, 180, 190),
    "distance": (900, 910),
    "arc distance": (901, 911),
    "feed mode": (930, 940, 950),
    "units": (200, 210, 700, 710, 7000, 7100),
    "radius": (400, 410, 411, 420, 421),
    "length": (430, 431, 432, 440, 490),
    "retract": (980, 990),
    "offset": (540, 550, 560, 570, 580, 590, 591, 592, 593),
    "path": (610, 611, 640),
    "speed": (960, 970),
    "language": (2900, 2910),
}
GROUP_OF = {code: group for group, codes in _GROUPS.items() for code in codes}

_M_GROUPS: dict[str, tuple[int, ...]] = {
    "stop": (0, 1, 2, 30, 60, 226),
    "tool change": (6,),
    "spindle": (3, 4, 5),
    "coolant": (7, 8, 9),
    "output": (62, 63, 64, 65, 66, 67, 68),
    "adaptive": (52,),
    "material": (190,),
}
#: Pause word of a firmware in which M0, M1 and M2 end the program.
PAUSE = 226
M_GROUP_OF = {code: group for group, codes in _M_GROUPS.items() for code in codes}
#: Words for outputs of the machine. Their effect is known only if the dialect names the device.
OUTPUT_CODES = frozenset(code for group in ("output", "adaptive", "material") for code in _M_GROUPS[group])

#: G codes, in tenths, that rotate, scale, mirror or wrap all following moves, with the code that ends them. After G66,
#: a macro runs at every move, rapids included.
TRANSFORMS = {
    160: 150, 510: 500, 511: 501, 660: 670, 661: 670, 680: 690, 682: 690, 121: 131, 1120: 1130, 70: 80, 434: 490,
    435: 490,
}  # fmt: skip
ENDS_TRANSFORM = frozenset(TRANSFORMS.values()) - {490}
#: Unsupported G codes, in tenths, that do not select a motion: non-modal codes, limits, accuracy, further work offsets.
NO_MOTION = frozenset({
    80, 90, 110, 220, 221, 230, 231, 250, 260, 350, 360, 370, 480, 600, 620, 630, 650, 1030, *range(1100, 1300, 10),
    1530, 1540, 1870, 1880,
})  # fmt: skip
OTHER_AXES = ("A", "B", "C", "U", "V", "W")


@dataclass(slots=True)
class SortedBlock:
    """The words of a block by group: one G code per group, M codes by group, and every other letter at most once.

    `unknown` contains the unsupported G and M words.
    """

    g: dict[str, int] = field(default_factory=dict)
    m: dict[str, list[int]] = field(default_factory=dict)
    letters: dict[str, Word] = field(default_factory=dict)
    unknown: list[Word] = field(default_factory=list)


def sort_words(block: Block, g_codes: frozenset[int], m_codes: frozenset[int], separate_cycles: bool) -> SortedBlock:
    """Sort the words of a block by group.

    Parameters
    ----------
    g_codes, m_codes
        Codes of the dialect. G codes are in tenths.
    separate_cycles
        Whether cycles and G80 are a separate group (Fanuc). Otherwise, they exclude G0 to G3 (RS274/NGC).

    Raises
    ------
    BlockError
        Two codes belong to the same group, or a letter occurs twice.
    """
    result = SortedBlock()
    for word in block.words:
        letter = word.letter
        if letter == "G":
            _add_g_word(result, word, g_codes)
        elif letter == "M":
            _add_m_word(result, word, m_codes)
        elif letter == "N" and "N" in result.letters:
            continue  # a second line number before the first
        elif letter in result.letters:
            raise BlockError("{} is given twice: {} and {}", letter, result.letters[letter], word)
        else:
            result.letters[letter] = word
    if not separate_cycles and "motion" in result.g and "cycle" in result.g:
        _refuse_conflict("G", result.g["motion"] / 10, result.g["cycle"] / 10)
    return result


def _add_g_word(result: SortedBlock, word: Word, known: frozenset[int]) -> None:
    code = round(word.value * 10)
    if code not in known or abs(word.value * 10 - code) > 1e-6:
        result.unknown.append(word)
        return
    group = GROUP_OF[code]
    before = result.g.setdefault(group, code)
    if before != code:
        _refuse_conflict("G", before / 10, code / 10)


def _add_m_word(result: SortedBlock, word: Word, known: frozenset[int]) -> None:
    code = int(word.value)
    if code not in known or code != word.value:
        result.unknown.append(word)
        return
    codes = result.m.setdefault(M_GROUP_OF[code], [])
    # Mist and flood may be on together; all other codes of a group exclude each other.
    if codes and {*codes, code} - {7, 8} and code not in codes:
        _refuse_conflict("M", codes[0], code)
    codes.append(code)


def _refuse_conflict(letter: str, one: float, other: float) -> None:
    raise BlockError("{}{:g} and {}{:g} exclude each other in one block", letter, one, letter, other)
