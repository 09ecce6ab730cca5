"""Speeds and feeds for the tools of a part: all candidates of a machine, their costs, and the Pareto front."""
