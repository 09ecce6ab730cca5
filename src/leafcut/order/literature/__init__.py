"""Algorithms of the literature, as in their papers, each for both move sets (`places`, `choices`)."""
