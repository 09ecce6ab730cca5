"""Checks for all processes: a program must match the plan and be safe."""
