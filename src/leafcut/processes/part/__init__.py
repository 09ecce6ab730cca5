"""Milling a whole part from a drawing: its outlines, windows and holes, with tabs."""
