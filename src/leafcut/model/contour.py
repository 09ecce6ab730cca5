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
#: Words allowed next to them.
_BESIDE = ("BLOCK", "BLOCKS", "DRAWING", "LAYER", "LINE", "LINES", "SHEET", "A0", "A1", "A2", "A3", "A4")


def is_aside(layer: str) -> bool:
    """Return whether a layer name marks frames, title blocks, dimensions or texts, which are not parts.

    All of its words must match: ``Title block``, ``DIM_2``, not ``FRAME_OUT`` or ``TEXTURE``.
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
    """A drawn path: the edge of the finished part, not the path of the tool.

    Attributes
    ----------
    path
        Lines and arcs, mm; closed for the outline of a part or a hole in it, open for marking and trimming.
    kind
        ``cut``, ``mark``, ``sheet`` for the outline of the sheet itself, which is not cut, or ``text`` for a stroke of
        a text, which is a mark on mark layers and ignored elsewhere.
    part
        Number of its part, from 1, shared by the part's outer contour, holes and marks; 0 if not assigned.
    z
        Drawn height, mm.
    name
        Name of the part, on its outline; of a text the reason why it cannot be engraved. Empty if unknown.
    order
        Of a contour of a `Sheet`: position of its first stroke in the drawing.
    depth
        Of a contour of a `Sheet`: number of closed cut contours around it. 0 is the outline of a part, 1 a hole in it,
        2 a part in this hole. A mark or an open cut has the depth of the closed contour around it, a chamber one more
        than its outline.
    parent
        Of a contour of a `Sheet`: index in `Sheet.contours` of the closed cut contour around it, -1 for none.
    chamber
        The inside of a notch whose mouth the kerf closes. It is cut as a hole, but lies outside of its outline.
    """

    path: Polyline
    kind: str = "cut"
    layer: str = ""
    handle: str = ""
    part: int = 0
    z: float = 0.0
    name: str = ""
    order: int = 0
    depth: int = 0
    parent: int = -1
    chamber: bool = False

    @property
    def is_hole(self) -> bool:
        """Whether it is closed and cut, with the part outside."""
        return self.depth % 2 == 1 and self.path.closed and self.kind == "cut"
