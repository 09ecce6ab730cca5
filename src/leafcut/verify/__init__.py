"""Verification: what was written is what was planned, and is safe."""
