"""Compute the machine time of single moves, of travel between positions, and of whole toolpaths."""
