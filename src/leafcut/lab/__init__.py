"""Experiments: algorithms repeated with several seeds, the results of each run, and their comparison."""
