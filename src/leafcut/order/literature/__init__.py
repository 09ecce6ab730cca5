"""Algorithms from the literature, as described in their papers, each for both move sets (`places` and `choices`)."""
