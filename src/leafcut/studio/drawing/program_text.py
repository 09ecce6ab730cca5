"""The program as an element of the page: its lines, and of one that was changed also the original beside it.

What it shows goes to the browser as the bytes of a scene (`studio.drawing.scene`) of the kind ``program``, with blocks

=========== ======== =============================================================================================
``text``    u1       the program, UTF-8
``other``   u1       the original, UTF-8; empty where there is none
``pair``    u4 × 2   old line and new line, from 1, of all that is in both (`line_match.line_pairs`)
``missing`` u4       lines of the original that do what the other program does not
``added``   u4       lines of the program that do what the original does not
=========== ======== =============================================================================================

and ``beside`` in the header where both are to be seen at first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from leafcut.studio.drawing.canvas import Canvas
from leafcut.studio.drawing.scene import packed
from leafcut.studio.drawing.serving import Serving


def program_scene(
    text: str,
    other: str = "",
    pairs: ArrayLike = (),
    *,
    missing: Sequence[int] = (),
    added: Sequence[int] = (),
    beside: bool = False,
) -> bytes:
    """Return a program, alone or with the original that it was made of or is compared with."""
    header = {"kind": "program", "name": "program", "origin": [0.0, 0.0], "extents": None}
    return packed(
        {**header, "beside": True} if beside else header,
        {
            "text": ("u1", np.frombuffer(text.encode("utf-8", "replace"), dtype=np.uint8)),
            "other": ("u1", np.frombuffer(other.encode("utf-8", "replace"), dtype=np.uint8)),
            "pair": ("u4", np.asarray(pairs, dtype=np.uint32).reshape(-1, 2)),
            "missing": ("u4", np.asarray(missing, dtype=np.uint32)),
            "added": ("u4", np.asarray(added, dtype=np.uint32)),
        },
    )


class ProgramText(Serving, component="../static/gcode_element.js"):
    """A program, line by line; selection and playing are linked with a drawing both ways.

    Parameters
    ----------
    drawing
        The drawing, whose own program is shown where no other is given.
    source
        Called, in a thread, for a `program_scene` when a browser asks for it.
    words
        In place of the English ones of ``static/words.js``, by the same keys.
    """

    def __init__(
        self, drawing: Canvas, *, source: Callable[[], bytes] | None = None, words: Mapping[str, str] | None = None
    ) -> None:
        super().__init__()
        self.props.update(drawing=drawing.id, words=dict(words or {}))
        self.props["source"] = self.serve("program", source) if source is not None else ""
