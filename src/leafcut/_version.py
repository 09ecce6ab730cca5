"""The version, in a module without imports that every package may read."""

__version__ = "0.3.0.dev0"
