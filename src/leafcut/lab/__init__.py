"""Experiments: run algorithms repeatedly with several seeds, store the results of each run, and compare them."""
