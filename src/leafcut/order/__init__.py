"""Ordering: a `RoutingProblem` in, a `Solution` out."""
