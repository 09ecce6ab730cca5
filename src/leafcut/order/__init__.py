"""Ordering: searches for a short path (`Solution`) through the clusters of a `RoutingProblem`."""
