"""`Contour`: a path in a drawing that is cut or marked."""

from __future__ import annotations

import fnmatch
import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from leafcut.geometry.polyline import Polyline

#: Words that identify layers with frames, title blocks, dimensions and texts, without accents.
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
#: Additional words that the names of such layers may contain.
_BESIDE = ("BLOCK", "BLOCKS", "DRAWING", "LAYER", "LINE", "LINES", "SHEET", "A0", "A1", "A2", "A3", "A4")


def is_annotation_layer(layer: str) -> bool:
    """Return whether the name of a layer marks frames, title blocks, dimensions or texts, which are not parts.

    All words of the name must match: ``Title block`` and ``DIM_2`` match, but ``FRAME_OUT`` and ``TEXTURE`` do not.
    """
    letters = unicodedata.normalize("NFKD", layer.casefold().upper())
    words = re.findall(r"[^\W\d_]+[0-9]*", "".join(c for c in letters if not unicodedata.combining(c)))
    named = [word.rstrip("0123456789") in _ASIDE for word in words]
    return any(named) and all(
        is_named or word in _BESIDE or word.rstrip("0123456789") in _BESIDE
        for word, is_named in zip(words, named, strict=True)
    )


def layer_matcher(patterns: Sequence[str]) -> Callable[[str], bool]:
    """Return a function that tests whether a layer name matches any of the patterns.

    The test ignores case. The wildcards * and ? are supported.
    """
    tests = [re.compile(fnmatch.translate(p), re.IGNORECASE) for p in patterns]
    return lambda layer: any(t.match(layer) for t in tests)


def layer_filter(patterns: tuple[str, ...]) -> Callable[[str], bool]:
    """Return a test for ``--layers``. It uses `layer_matcher`, but without patterns all layers pass."""
    return layer_matcher(patterns or ("*",))


@dataclass(frozen=True)
class Contour:
    """A path as drawn. It is the edge of the finished part, not the path of the tool.

    Attributes
    ----------
    path
        Lines and arcs, mm. The path is closed for the outline of a part or a hole in it, and open for marking and
        trimming.
    kind
        ``cut``, ``mark``, ``sheet`` for the outline of the sheet, which is not cut, or ``text`` for a stroke of a text.
        A text on a mark layer is marked; texts on other layers are ignored.
    part
        Number of the part, from 1. The outline, holes and marks of a part share this number. 0 if not assigned.
    z
        Drawn height, mm.
    name
        For an outline, the name of the part. For a text, the reason why it cannot be engraved. Empty if unknown.
    order
        On a `Sheet`: position of the contour's first stroke in the drawing.
    depth
        On a `Sheet`: number of closed cut contours around this contour. The outline of a part has depth 0, a hole in
        the part has 1, and a part in this hole has 2. A mark or an open cut has the depth of the closed contour around
        it. A chamber is one level deeper than its outline.
    parent
        On a `Sheet`: index in `Sheet.contours` of the closed cut contour around this contour, or -1.
    chamber
        Whether this is the inside of a notch whose mouth is narrower than the kerf. A chamber is cut like a hole, but
        lies outside the outline.
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
        """Whether the contour is a hole in a part: a closed cut that lies inside the part."""
        return self.depth % 2 == 1 and self.path.closed and self.kind == "cut"
