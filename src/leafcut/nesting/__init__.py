"""Nesting: place parts close together on sheets."""
