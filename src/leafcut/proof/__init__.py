"""Checks for all processes: the program matches the plan and is safe."""
