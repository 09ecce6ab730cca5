"""leafcut: the shortest-time, verified CNC program for a drawing or for another CAM's code."""

from __future__ import annotations

__version__ = "0.1.0"
