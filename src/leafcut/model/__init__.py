"""Frozen data shared by all stages: parts, machines, tools, problems, toolpaths, outcomes, issues."""
