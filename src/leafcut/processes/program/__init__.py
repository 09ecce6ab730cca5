"""Reorder programs of other CAMs to save time, with proof that the work stays the same."""
