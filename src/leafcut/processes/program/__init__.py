"""Reorder programs from other CAM systems to save time, with proof that the work stays the same."""
