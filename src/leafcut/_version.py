"""The version. This module has no imports, so every package may read it."""

__version__ = "0.3.0.dev0"
