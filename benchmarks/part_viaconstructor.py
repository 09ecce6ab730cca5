"""Script for viaConstructor's Python: run its command line with settings for each layer.

    python part_viaconstructor.py LAYERS.json -s SETUP.json -o PROGRAM.ngc DRAWING.dxf

LAYERS.json contains the settings of each layer by section and name, as in its window's tab *Layers*, which its command
line lacks.
"""

import json
import sys
from pathlib import Path

from viaconstructor import viaconstructor

LAYERS = json.loads(Path(sys.argv.pop(1)).read_text(encoding="utf-8"))


class WithLayers(viaconstructor.ViaConstructor):
    """viaConstructor with settings for each layer."""

    def prepare_segments(self):
        """Create the objects, and change the settings of those on the given layers."""
        super().prepare_segments()
        for made in self.project["objects"].values():
            for section, values in LAYERS.get(made["layer"], {}).items():
                made["setup"][section].update(values)
            made["inner_objects"] = []
        self.project["maxOuter"] = viaconstructor.find_tool_offsets(self.project["objects"])


WithLayers()
