"""Drawings of a few entities, written by ezdxf or by hand."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import pytest


@pytest.fixture
def draw(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that saves the drawing of `build(document, modelspace)`; mm and R2010 by default."""

    def save(build: Callable[[Any, Any], object], units: int = 4, version: str = "R2010", fmt: str = "asc") -> Path:
        document = ezdxf.new(version, units=units)
        build(document, document.modelspace())
        path = tmp_path / f"drawing-{version}-{fmt}.dxf"
        document.saveas(path, fmt=fmt)
        return path

    return save


@pytest.fixture
def hand_drawn(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes an R12 drawing of raw entities, as simple programs do."""

    def write(entities: str, insunits: int | None = 4, blocks: str = "", end: str = "0\nENDSEC\n0\nEOF\n") -> Path:
        units = "" if insunits is None else f"9\n$INSUNITS\n70\n{insunits}\n"
        text = f"0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n{units}0\nENDSEC\n"
        if blocks:
            text += f"0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n"
        path = tmp_path / "hand.dxf"
        path.write_text(f"{text}0\nSECTION\n2\nENTITIES\n{entities}{end}", encoding="ascii")
        return path

    return write


@pytest.fixture
def text_file(tmp_path: Path) -> Callable[[str, str], Path]:
    """Return a function that writes a text file of a given name."""

    def write(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8", newline="")
        return path

    return write
