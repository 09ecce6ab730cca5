"""Experiments that run algorithms repeatedly with several seeds, store the result of each run, and compare the results.
"""
