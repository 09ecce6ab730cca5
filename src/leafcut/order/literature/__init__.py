"""Published algorithms, implemented as their papers describe them, for both move sets (`places` and `choices`)."""
