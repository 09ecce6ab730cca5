"""Frozen data that every stage shares: parts, machines, tools, problems, toolpaths, outcomes, issues."""
