"""Verify a pocketing program by reading it back and simulating it."""
