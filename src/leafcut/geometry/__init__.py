"""Plane geometry that several packages share."""
