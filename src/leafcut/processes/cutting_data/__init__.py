"""Speeds and feeds of the tools of a part: all that a machine has, their costs, and the Pareto front of them."""
