"""`Contour`: a path of a drawing that is cut or marked."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

from leafcut.geometry.polyline import Polyline

#: Words of layer names for frames, title blocks, dimensions and texts; accents are left out.
_ASIDE = (
    *("ANNO", "ANNOTATION", "ANNOTATIONS", "BORDER", "BORDERS", "DEFPOINTS", "DIM", "DIMS", "DIMENSION", "DIMENSIONS"),
    *("DIMENSIONING", "FRAME", "FRAMES", "TEXT", "TEXTS", "TITLE", "TITLES", "TITLEBLOCK", "TITLEBLOCKS"),
    *("BEMA", "BEMASSUNG", "BEMASSUNGEN", "BLATTRAHMEN", "RAHMEN", "SCHRIFTFELD", "SCHRIFTFELDER", "TEXTE"),
    *("ZEICHNUNGSRAHMEN", "CADRE", "CADRES", "CARTOUCHE", "CARTOUCHES", "COTATION", "COTATIONS", "COTE", "COTES"),
    *(
        "TEXTES",
        "ACOTACION",
        "ACOTACIONES",
        "CAJETIN",
        "CAJETINES",
        "COTA",
        "COTAS",
        "MARCO",
        "MARCOS",
        "TEXTO",
        "TEXTOS",
    ),
)
#: Words that may stand beside them.
_BESIDE = ("BLOCK", "BLOCKS", "DRAWING", "LAYER", "LINE", "LINES", "SHEET", "A0", "A1", "A2", "A3", "A4")


def is_aside(layer: str) -> bool:
    """Return whether the name of a layer shows that nothing on it is a part: frames, title blocks, dimensions, texts.

    All of its words must show that: ``Title block``, ``DIM_2``, not ``FRAME_OUT`` or ``TEXTURE``.
    """
    letters = unicodedata.normalize("NFKD", layer.casefold().upper())
    words = re.findall(r"[^\W\d_]+[0-9]*", "".join(c for c in letters if not unicodedata.combining(c)))
    named = [word.rstrip("0123456789") in _ASIDE for word in words]
    return any(named) and all(
        is_named or word in _BESIDE or word.rstrip("0123456789") in _BESIDE
        for word, is_named in zip(words, named, strict=True)
    )


@dataclass(frozen=True)
class Contour:
    """A path as it is drawn: the edge of the finished part, not the way of the tool.

    Attributes
    ----------
    path
        Lines and arcs, mm; closed for the outline of a part or a hole in it, open for marking and trimming.
    kind
        ``cut``, ``mark``, ``sheet`` for the outline of the sheet itself, which is not cut, or ``text`` for a stroke of
        a text, which is a mark on the layers of marks and left out elsewhere.
    layer, handle
        The drawing's layer and entity handle (of its first entity).
    part
        Number of the part it belongs to, from 1, or 0 where nobody has said: its outer contour, its holes and its
        marks have the same number.
    z
        The height at which it is drawn, mm.
    name
        What the part is called, on its outline; of a text why it cannot be engraved. Empty where nobody has said.
    """

    path: Polyline
    kind: str = "cut"
    layer: str = ""
    handle: str = ""
    part: int = 0
    z: float = 0.0
    name: str = ""
