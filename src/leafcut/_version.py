"""The version, in a module without imports: every package may read it."""

__version__ = "0.3.0.dev0"
