"""Hand-made Gerber files for tests."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

#: Excellon file with two holes.
DRILLS = "M48\nMETRIC\nT1C0.800\nT2C3.000\n%\nG90\nG05\nT1\nX3.0Y3.0\nT2\nX17.0Y7.0\nM30\n"


def gerber(body: str, function: str = "Copper,L1,Top", apertures: str = "") -> str:
    """Return a Gerber file in mm with six decimals. Coordinates in `body` are in µm, written with three zeros less."""
    head = f"%TF.FileFunction,{function}*%\n" if function else ""
    return f"{head}%FSLAX43Y43*%\n%MOMM*%\n{apertures}{body}M02*\n"


def rectangle(x0: int, y0: int, x1: int, y1: int) -> str:
    """Return a filled rectangle, µm."""
    return f"G01*\nG36*\nX{x0}Y{y0}D02*\nX{x1}Y{y0}D01*\nX{x1}Y{y1}D01*\nX{x0}Y{y1}D01*\nX{x0}Y{y0}D01*\nG37*\n"


def edge(x0: int, y0: int, x1: int, y1: int) -> str:
    """Return the file of a rectangular board edge, µm."""
    lines = f"D10*\nX{x0}Y{y0}D02*\nX{x1}Y{y0}D01*\nX{x1}Y{y1}D01*\nX{x0}Y{y1}D01*\nX{x0}Y{y0}D01*\n"
    return gerber(lines, "Profile,NP", "%ADD10C,0.1*%\n")


def archive(files: Mapping[str, str]) -> bytes:
    """Return a ZIP archive of texts."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, text in files.items():
            packed.writestr(name, text)
    return stream.getvalue()
