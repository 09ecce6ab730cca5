"""Machine time of single moves, of travel moves between positions, and of whole toolpaths."""
