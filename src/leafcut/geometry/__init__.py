"""Plane geometry shared by several packages."""
