"""Ordering: find a `Solution` of a `RoutingProblem`."""
