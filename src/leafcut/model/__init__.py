"""Frozen data that all packages share: parts, machines, tools, problems, toolpaths, outcomes, and issues."""
