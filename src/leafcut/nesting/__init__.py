"""Nesting: arrange parts close together on sheets."""
