"""The version, in a module of its own: rooms tell it without importing the package above them."""

__version__ = "0.2.0"
