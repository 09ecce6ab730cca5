"""Readers: one file per format, each turns a file into a `Part`."""
