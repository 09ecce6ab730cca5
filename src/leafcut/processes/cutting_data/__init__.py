"""Speeds and feeds for the tools of a part: all candidates for a machine, their costs, and the Pareto front."""
