"""Reorder programs from other CAM systems to save machine time, and prove that they still do the same work."""
