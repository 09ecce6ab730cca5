"""Solving: a `RoutingProblem` in, a `Solution` out."""
