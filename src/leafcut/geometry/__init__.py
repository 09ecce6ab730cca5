"""Plane geometry that several rooms share."""
