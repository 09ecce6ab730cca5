"""Verification of a pocketing program, which is read back and simulated."""
