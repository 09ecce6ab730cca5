"""Frozen data shared by all packages: parts, machines, tools, problems, toolpaths, outcomes, issues."""
