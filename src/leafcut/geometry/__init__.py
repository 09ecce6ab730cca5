"""Plane geometry that several packages use."""
