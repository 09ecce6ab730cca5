"""Compute the material that a program removes: swept areas, engagement and step-over, for planning and verification."""
