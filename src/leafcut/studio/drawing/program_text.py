"""The element that shows the lines of a program, optionally beside the original.

It sends a scene of kind ``program`` (format: `studio.drawing.scene`) with the blocks

=========== ======== =============================================================================================
``text``    u1       the program, UTF-8
``other``   u1       the original, UTF-8; empty without an original
``pair``    u4 × 2   matching lines in the original and the program, from 1 (`line_match.matching_lines`)
``missing`` u4       lines of the original with work that is missing in the program
``added``   u4       lines of the program with work that is missing in the original
=========== ======== =============================================================================================

The header has ``beside`` if both programs are visible initially.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from leafcut.studio.drawing.canvas import Canvas, DataServer
from leafcut.studio.drawing.scene import pack_scene


def program_scene(
    text: str,
    other: str = "",
    pairs: ArrayLike = (),
    *,
    missing: Sequence[int] = (),
    added: Sequence[int] = (),
    beside: bool = False,
) -> bytes:
    """Create the scene of a program, alone or beside the original."""
    header = {"kind": "program", "name": "program", "origin": [0.0, 0.0], "extents": None}
    return pack_scene(
        {**header, "beside": True} if beside else header,
        {
            "text": ("u1", np.frombuffer(text.encode("utf-8", "replace"), dtype=np.uint8)),
            "other": ("u1", np.frombuffer(other.encode("utf-8", "replace"), dtype=np.uint8)),
            "pair": ("u4", np.asarray(pairs, dtype=np.uint32).reshape(-1, 2)),
            "missing": ("u4", np.asarray(missing, dtype=np.uint32)),
            "added": ("u4", np.asarray(added, dtype=np.uint32)),
        },
    )


class ProgramText(DataServer, component="../static/gcode_element.js"):
    """The lines of a program. The selection and the playback are synchronized with a drawing.

    The element shows the program of `drawing`, or the `program_scene` that `source` returns. When a browser requests
    the scene, `source` is called in a thread. `words` contains the texts of the element by key.
    """

    def __init__(self, drawing: Canvas, words: Mapping[str, str], source: Callable[[], bytes] | None = None) -> None:
        super().__init__()
        self.props.update(drawing=drawing.id, words=dict(words))
        self.props["source"] = self.serve("program", source) if source is not None else ""
