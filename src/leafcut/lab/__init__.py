"""Experiments that run algorithms repeatedly with several seeds, and compare the stored results."""
