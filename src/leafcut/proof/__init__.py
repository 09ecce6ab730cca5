"""Checks, for all processes, that a program matches the plan and is safe."""
