"""`Contour`: a path of a drawing that is cut or marked."""

from __future__ import annotations

from leafcut.geometry.polyline import Polyline
from leafcut.quick_dataclass import dataclass

#: Layers whose names show that nothing on them is a part: frames and title blocks, dimensions and texts, helper points.
ASIDE = (
    *("FRAME*", "BORDER*", "TITLE*", "RAHMEN*", "ZEICHNUNGSRAHMEN*", "SCHRIFTFELD*", "CADRE*", "CARTOUCHE*"),
    *("MARCO*", "CAJETIN*", "DIM*", "BEMA*", "COTA*", "TEXT*", "ANNO*", "DEFPOINTS"),
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
